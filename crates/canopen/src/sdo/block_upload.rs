//! Block upload (CiA 301 7.2.4.3.12 to 7.2.4.3.15): up to 127 segments an acknowledge.

use super::source::Source;
use super::{Phase, Readable, Transfer};
use crate::outbox::Slot;
use crate::{Abort, Address, Instant, Node, NodeMemory, Owner};

impl<M: NodeMemory> Node<M> {
    /// Blocks are asked for: with a checksum, of how many segments, and up to how many bytes the
    /// client would rather have no blocks.
    pub(crate) fn begin_block_upload<O: Owner>(
        &mut self,
        n: u8,
        address: Address,
        (with_crc, block_size, switch_bytes): (bool, u8, u8),
        now: Instant,
        owner: &mut O,
    ) {
        self.interrupt(n, owner);
        if self.server(n).is_waiting() {
            self.server(n).aborted(address, Abort::DEVICE_STATE);
            return self.outbox.post(Slot::Sdo(n));
        }
        let opened = self.readable(address).and_then(|found| match found {
            Readable::Entry(entry) => self.open(address, &entry, owner),
            Readable::Highest(highest) => Ok(Source::number(u64::from(highest), 1)),
        });
        let source = match opened {
            Ok(_) if !is_block_size(block_size) => Err(Abort::BLOCK_SIZE),
            opened => opened,
        };
        let source = match source {
            Ok(source) => source,
            Err(abort) => {
                self.server(n).aborted(address, abort);
                return self.outbox.post(Slot::Sdo(n));
            }
        };
        let transfer = Transfer {
            phase: Phase::BlockUploadStart,
            address,
            place: source.place,
            value: source.value,
            block_size,
            with_crc,
            ..Transfer::IDLE
        }
        .of_size(source.size);
        // The protocol switch (CiA 301 7.2.4.3.12): answered as an ordinary upload is.
        let few = source
            .size
            .filter(|size| switch_bytes > 0 && *size <= u32::from(switch_bytes));
        if let Some(size) = few {
            return self.switch_protocol(n, &transfer, size, now, owner);
        }
        let server = self.server(n);
        server.transfer = transfer;
        match source.size {
            Some(size) => server.answer(0xC6, address, size),
            None => server.answer(0xC4, address, 0),
        }
        self.await_client(n, now);
        self.outbox.post(Slot::Sdo(n));
    }

    fn switch_protocol<O: Owner>(
        &mut self,
        n: u8,
        transfer: &Transfer,
        size: u32,
        now: Instant,
        owner: &mut O,
    ) {
        let address = transfer.address;
        if let 1..=4 = size {
            match self.piece(transfer, 0, owner) {
                Ok(piece) => {
                    let [b0, b1, b2, b3, ..] = piece.bytes;
                    let raw = u32::from_le_bytes([b0, b1, b2, b3]);
                    let dialect = &self.device.dialect;
                    self.server(n).uploaded(address, raw, size as u8, dialect);
                }
                Err(abort) => self.server(n).aborted(address, abort),
            }
        } else {
            let server = self.server(n);
            server.transfer = Transfer {
                phase: Phase::Upload,
                ..*transfer
            };
            server.answer(0x41, address, size);
            self.await_client(n, now);
        }
        self.outbox.post(Slot::Sdo(n));
    }

    /// The client is ready: the first block is sent.
    pub(crate) fn start_blocks<O: Owner>(&mut self, n: u8, now: Instant, owner: &mut O) {
        if self.server(n).transfer.phase != Phase::BlockUploadStart {
            return self.abort_transfer(n, Abort::COMMAND, owner);
        }
        self.send_block(n, now);
    }

    /// Whether segments of a block still wait for the wire.
    pub(crate) fn is_sending_block(&mut self, n: u8) -> bool {
        self.server(n).transfer.phase == Phase::BlockUpload && self.outbox.is_waiting(Slot::Sdo(n))
    }

    fn send_block(&mut self, n: u8, now: Instant) {
        let transfer = &mut self.server(n).transfer;
        transfer.phase = Phase::BlockUpload;
        transfer.next = 1;
        transfer.is_last = false;
        self.await_client(n, now);
        self.outbox.post(Slot::Sdo(n));
    }

    /// What server `n` answers; `None` if it is its turn to send the next segment of a block.
    #[inline]
    pub(crate) fn sdo_answer(&mut self, n: u8) -> Option<[u8; 8]> {
        let server = self.server(n);
        (server.transfer.phase != Phase::BlockUpload).then_some(server.reply)
    }

    /// Makes the next segment, and posts itself until the block is sent.
    pub(crate) fn next_segment<O: Owner>(&mut self, n: u8, owner: &mut O) -> [u8; 8] {
        // Not copied: it is as large as several segments.
        let transfer = self.transfer(n);
        let number = transfer.next;
        let before = 7 * u32::from(number.saturating_sub(1));
        let at = transfer.at.saturating_add(before);
        let piece = match self.piece(transfer, at, owner) {
            Ok(piece) => piece,
            Err(abort) => {
                self.drop_transfer(n, abort, owner);
                let server = self.server(n);
                server.aborted(server.transfer.address, abort);
                return server.reply;
            }
        };
        let transfer = &mut self.server(n).transfer;
        if transfer.with_crc && transfer.crc_at == at {
            let counted = piece.bytes.get(..usize::from(piece.count)).unwrap_or(&[]);
            transfer.crc.update(counted);
            transfer.crc_at = at.saturating_add(u32::from(piece.count));
        }
        transfer.next = number.saturating_add(1);
        transfer.is_last = piece.is_last;
        if !piece.is_last && number < transfer.block_size {
            self.outbox.post(Slot::Sdo(n));
        }
        let mut segment = [u8::from(piece.is_last) << 7 | number; 8];
        if let Some(data) = segment.last_chunk_mut() {
            *data = piece.bytes;
        }
        segment
    }

    /// The client has received `segments` of the block in order, and wants `block_size` next.
    pub(crate) fn block_acknowledged<O: Owner>(
        &mut self,
        n: u8,
        segments: u8,
        block_size: u8,
        now: Instant,
        owner: &mut O,
    ) {
        let transfer = self.server(n).transfer;
        if transfer.phase != Phase::BlockUpload {
            return self.abort_transfer(n, Abort::COMMAND, owner);
        }
        let sent = transfer.next.saturating_sub(1);
        if segments > sent {
            return self.abort_transfer(n, Abort::SEQUENCE_NUMBER, owner);
        }
        if !is_block_size(block_size) {
            return self.abort_transfer(n, Abort::BLOCK_SIZE, owner);
        }
        // Segments still to be sent are of no use: the client has spoken too early.
        self.outbox.withdraw(Slot::Sdo(n));
        if transfer.is_last && segments == sent {
            return self.announce_end(n, now, owner);
        }
        let server = self.server(n);
        server.transfer.at = transfer.at.saturating_add(7 * u32::from(segments));
        server.transfer.block_size = block_size;
        self.send_block(n, now);
    }

    /// All segments were received: says how much of the last one counts, and the checksum.
    fn announce_end<O: Owner>(&mut self, n: u8, now: Instant, owner: &mut O) {
        let transfer = self.server(n).transfer;
        let before = 7 * u32::from(transfer.next.saturating_sub(2));
        let last = transfer.at.saturating_add(before);
        let piece = match self.piece(&transfer, last, owner) {
            Ok(piece) => piece,
            Err(abort) => return self.abort_transfer(n, abort, owner),
        };
        let server = self.server(n);
        server.transfer.phase = Phase::BlockUploadEnd;
        let [low, high] = transfer.crc.get().to_le_bytes();
        server.reply = [0xC1 | (7 - piece.count) << 2, low, high, 0, 0, 0, 0, 0];
        self.await_client(n, now);
        self.outbox.post(Slot::Sdo(n));
    }

    /// The client has everything.
    pub(crate) fn end_block_upload<O: Owner>(&mut self, n: u8, owner: &mut O) {
        if self.server(n).transfer.phase != Phase::BlockUploadEnd {
            return self.abort_transfer(n, Abort::COMMAND, owner);
        }
        self.server(n).finish();
    }
}

/// Segments that a block may have (CiA 301 7.2.4.3.12).
fn is_block_size(segments: u8) -> bool {
    matches!(segments, 1..=127)
}
