//! Block download (CiA 301 7.2.4.3.8 to 7.2.4.3.11): up to 127 segments an acknowledge.

use can::Frame;

use super::{Phase, SdoServer, Wait};
use crate::access::Written;
use crate::outbox::Slot;
use crate::{Abort, Address, Dialect, Events, Instant, Node, NodeMemory, Owner, SdoTransfers};

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
                self.client_aborts(n, why, owner);
            }
            return;
        }
        let is_last = command & 0x80 != 0;
        let transfer = self.server(n).transfer;
        self.server(n).transfer.has_begun = true;
        let in_order = number == transfer.next;
        if !transfer.has_begun && !in_order {
            // What comes first of a block does not end it: it may be the second copy of the segment
            // that ended the block before. If it is not, silence follows.
            let [_, acknowledged, ..] = self.server(n).reply;
            if transfer.held == Some(bytes) && command == acknowledged {
                self.server(n).transfer.has_begun = false;
                return self.acknowledges_again(n, now);
            }
            return self.await_segment(n, now);
        }
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
        let server = self.server(n);
        let came = server.transfer.next.saturating_sub(1);
        server.transfer.has_begun = false;
        if server.transfer.is_last {
            server.transfer.phase = Phase::BlockDownloadEnd;
        } else {
            server.transfer.next = 1;
        }
        server.reply = [0xA2, came, server.transfer.block_size, 0, 0, 0, 0, 0];
        self.await_client(n, now);
        self.outbox.post(Slot::Sdo(n));
    }

    /// The last segment that was acknowledged has come once more. Right behind the first, the wire
    /// has doubled it; after a silence, its client has not heard the acknowledge and hears it again.
    fn acknowledges_again(&mut self, n: u8, now: Instant) {
        let SdoTransfers::All { timeout_ms, .. } = self.device.dialect.sdo else {
            return;
        };
        let rest = u64::from(timeout_ms).saturating_sub(SILENCE_MS);
        if now.plus_ms(rest) >= self.server(n).due {
            self.await_client(n, now);
            self.outbox.post(Slot::Sdo(n));
        }
    }

    /// Whether `frame` is the last segment of a block download once more, while its end is awaited:
    /// not what else its first byte would mean now, an abort for example. The end itself is the end,
    /// also where it looks alike.
    pub(crate) fn is_last_segment_again(&mut self, n: u8, frame: &Frame, now: Instant) -> bool {
        let transfer = &self.server(n).transfer;
        let [command, bytes @ ..] = frame.bytes();
        let is_again = transfer.phase == Phase::BlockDownloadEnd
            && command & 0x80 != 0
            && command & 0x7F == transfer.next.saturating_sub(1)
            && command & 0xE3 != 0xC1
            && transfer.held == Some(bytes);
        if is_again {
            self.acknowledges_again(n, now);
        }
        is_again
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
        if let SdoTransfers::All { block_size, .. } = dialect.sdo {
            // CiA 301 7.2.4.3.9.
            let block_size = block_size.clamp(1, 127);
            self.transfer.phase = Phase::BlockDownload;
            self.transfer.block_size = block_size;
            self.answer(0xA4, self.transfer.address, u32::from(block_size));
        }
    }

    /// Whether `frame` announces once more the blocks of which none has begun: its client has not
    /// heard that they may come. (Else it would be segment 64 or so, out of order.)
    pub(crate) fn is_announced_again(&self, frame: &Frame) -> bool {
        let transfer = &self.transfer;
        let [command, low, high, sub, ..] = frame.bytes();
        let object = Address::new(u16::from_le_bytes([low, high]), sub);
        transfer.held.is_none()
            && !transfer.has_begun
            && command & 0xE1 == 0xC0
            && object == transfer.address
    }

    /// Acknowledges the end.
    pub(crate) fn blocks_came(&mut self) {
        self.reply = [0xA1, 0, 0, 0, 0, 0, 0, 0];
    }
}
