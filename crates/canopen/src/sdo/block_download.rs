//! Block download (CiA 301 7.2.4.3.8 to 7.2.4.3.11): up to 127 segments an acknowledge.

use super::{Phase, SdoServer, Wait};
use crate::access::Written;
use crate::outbox::Slot;
use crate::{Abort, Dialect, Events, Instant, Node, NodeMemory, Owner, SdoTransfers};

/// A block whose segments have ceased for so long is acknowledged as far as it came, once: its last
/// segment was lost, and the client waits for that acknowledge.
const SILENCE_MS: u64 = 100;

impl<M: NodeMemory> Node<M> {
    /// A segment of a block.
    pub(crate) fn block_segment<O: Owner>(
        &mut self,
        n: u8,
        frame: [u8; 8],
        now: Instant,
        owner: &mut O,
    ) {
        let [command, bytes @ ..] = frame;
        let number = command & 0x7F;
        if number == 0 {
            // No segment has the number 0: with bit 7 this is an abort, else nothing.
            if command == 0x80 {
                let [_, _, _, c0, c1, c2, c3] = bytes;
                let why = Abort(u32::from_le_bytes([c0, c1, c2, c3]));
                self.drop_transfer(n, why, owner);
            }
            return;
        }
        let is_last = command & 0x80 != 0;
        let transfer = self.server(n).transfer;
        self.server(n).transfer.has_begun = true;
        let in_order = number == transfer.next;
        if in_order {
            // The one before it was not the last, so all of it counts.
            if let Some(held) = transfer.held
                && let Err(abort) = self.gather_checked(n, &held, owner)
            {
                return self.abort_transfer(n, abort, owner);
            }
            let transfer = &mut self.server(n).transfer;
            transfer.held = Some(bytes);
            transfer.next = number.saturating_add(1);
            transfer.is_last = is_last;
        }
        let ends = is_last || number >= transfer.block_size;
        if ends {
            self.acknowledge_block(n, now);
        } else {
            self.await_segment(n, now);
        }
    }

    fn await_segment(&mut self, n: u8, now: Instant) {
        let due = now.plus_ms(SILENCE_MS);
        self.server(n).due = due;
        self.due = self.due.min(due);
    }

    /// Says how many segments of the block came in order; those after are sent again.
    fn acknowledge_block(&mut self, n: u8, now: Instant) {
        let SdoTransfers::All { block_size, .. } = self.device.dialect.sdo else {
            return;
        };
        let server = self.server(n);
        let came = server.transfer.next.saturating_sub(1);
        server.transfer.next = 1;
        server.transfer.has_begun = false;
        server.transfer.block_size = block_size;
        if server.transfer.is_last {
            server.transfer.phase = Phase::BlockDownloadEnd;
        }
        server.reply = [0xA2, came, block_size, 0, 0, 0, 0, 0];
        self.await_client(n, now);
        self.outbox.post(Slot::Sdo(n));
    }

    /// Whether server `n` was in the middle of a block, which is now acknowledged as far as it came.
    pub(crate) fn block_fell_silent(&mut self, n: u8, now: Instant) -> bool {
        let transfer = &self.server(n).transfer;
        let in_block = transfer.phase == Phase::BlockDownload && transfer.has_begun;
        if in_block {
            self.acknowledge_block(n, now);
        }
        in_block
    }

    /// The client says that the last block was the last, how much of its last segment counts not,
    /// and the checksum.
    pub(crate) fn end_block_download<O: Owner>(
        &mut self,
        n: u8,
        unused: u8,
        checksum: u16,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let transfer = self.server(n).transfer;
        if transfer.phase != Phase::BlockDownloadEnd {
            return self.abort_transfer(n, Abort::COMMAND, owner);
        }
        let held = transfer.held.unwrap_or([0; 7]);
        let counted = held.get(..7 - usize::from(unused)).unwrap_or(&[]);
        if let Err(abort) = self.gather_checked(n, counted, owner) {
            return self.abort_transfer(n, abort, owner);
        }
        let transfer = self.server(n).transfer;
        if transfer.with_crc && transfer.crc.get() != checksum {
            return self.abort_transfer(n, Abort::CRC, owner);
        }
        match self.commit(n, now, owner, events) {
            Ok(Written::Now) => {
                self.let_go(n);
                let server = self.server(n);
                server.finish();
                server.blocks_came();
                self.outbox.post(Slot::Sdo(n));
            }
            Ok(Written::Later) => self.wait(n, Wait::BlocksEnd),
            Err(abort) => self.abort_transfer(n, abort, owner),
        }
    }

    #[inline]
    fn gather_checked<O: Owner>(
        &mut self,
        n: u8,
        bytes: &[u8],
        owner: &mut O,
    ) -> Result<(), Abort> {
        self.gather(n, bytes, owner)?;
        let transfer = &mut self.server(n).transfer;
        if transfer.with_crc {
            transfer.crc.update(bytes);
        }
        Ok(())
    }
}

impl SdoServer {
    /// Acknowledges the announcement of blocks; with a checksum, if the client has one.
    pub(crate) fn blocks_may_come(&mut self, dialect: &Dialect) {
        let SdoTransfers::All { block_size, .. } = dialect.sdo else {
            return;
        };
        self.transfer.phase = Phase::BlockDownload;
        self.transfer.block_size = block_size;
        let address = self.transfer.address;
        self.answer(0xA4, address, u32::from(block_size));
    }

    /// Acknowledges the end.
    pub(crate) fn blocks_came(&mut self) {
        self.reply = [0xA1, 0, 0, 0, 0, 0, 0, 0];
    }
}
