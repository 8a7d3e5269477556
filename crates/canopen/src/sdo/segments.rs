//! Segmented transfers (CiA 301 7.2.4.3.3 to 7.2.4.3.7): one segment of seven bytes an answer.

use super::{Phase, Place, SdoServer, Transfer, Wait};
use crate::access::Written;
use crate::outbox::Slot;
use crate::{
    Abort, Address, Entry, Events, Instant, Node, NodeMemory, Owner, SdoTransfers, Verdict,
};

impl<M: NodeMemory> Node<M> {
    /// Answers an upload whose object is no number of at most four bytes.
    #[cold]
    pub(crate) fn begin_upload<O: Owner>(
        &mut self,
        n: u8,
        address: Address,
        entry: &Entry,
        now: Instant,
        owner: &mut O,
    ) {
        if let Err(abort) = self.try_begin_upload(n, address, entry, now, owner) {
            self.server(n).aborted(address, abort);
        }
    }

    fn try_begin_upload<O: Owner>(
        &mut self,
        n: u8,
        address: Address,
        entry: &Entry,
        now: Instant,
        owner: &mut O,
    ) -> Result<(), Abort> {
        let source = self.open(address, entry, owner)?;
        let transfer = Transfer {
            phase: Phase::Upload,
            address,
            place: source.place,
            value: source.value,
            ..Transfer::IDLE
        }
        .of_size(source.size);
        let dialect = &self.device.dialect;
        // What fits an expedited answer goes with one; none of them can say "no bytes".
        if let Some(size @ 1..=4) = source.size {
            let [b0, b1, b2, b3, ..] = self.piece(&transfer, 0, owner)?.bytes;
            let raw = u32::from_le_bytes([b0, b1, b2, b3]);
            self.server(n).uploaded(address, raw, size as u8, dialect);
            return Ok(());
        }
        if dialect.sdo == SdoTransfers::Expedited {
            return Err(if source.size == Some(0) {
                Abort::NO_DATA
            } else {
                Abort::UNSUPPORTED_ACCESS
            });
        }
        if self.server(n).is_waiting() {
            return Err(Abort::DEVICE_STATE);
        }
        let server = self.server(n);
        server.transfer = transfer;
        match source.size {
            Some(size) => server.answer(0x41, address, size),
            None => server.answer(0x40, address, 0),
        }
        self.await_client(n, now);
        Ok(())
    }

    /// The next segment is asked for (CiA 301 7.2.4.3.7).
    pub(crate) fn upload_segment<O: Owner>(
        &mut self,
        n: u8,
        toggle: bool,
        now: Instant,
        owner: &mut O,
    ) {
        let transfer = self.server(n).transfer;
        if transfer.phase != Phase::Upload {
            return self.abort_transfer(n, Abort::COMMAND, owner);
        }
        if toggle != transfer.toggle {
            return self.abort_transfer(n, Abort::TOGGLE, owner);
        }
        let piece = match self.piece(&transfer, transfer.at, owner) {
            Ok(piece) => piece,
            Err(abort) => return self.abort_transfer(n, abort, owner),
        };
        let server = self.server(n);
        let command = u8::from(toggle) << 4 | (7 - piece.count) << 1 | u8::from(piece.is_last);
        server.segment(command, piece.bytes);
        server.transfer.at = transfer.at.saturating_add(u32::from(piece.count));
        server.transfer.toggle = !toggle;
        if piece.is_last {
            server.finish();
        } else {
            self.await_client(n, now);
        }
        self.outbox.post(Slot::Sdo(n));
    }

    /// A download in segments, or with `blocks` in blocks, is announced.
    pub(crate) fn begin_download<O: Owner>(
        &mut self,
        n: u8,
        address: Address,
        size: Option<u32>,
        blocks: Option<bool>,
        now: Instant,
        owner: &mut O,
    ) {
        self.interrupt(n, owner);
        let opened = self
            .writable(address)
            .and_then(|entry| self.place_for(n, address, &entry, size));
        let place = match opened {
            Ok(place) => place,
            Err(abort) => {
                self.server(n).aborted(address, abort);
                return self.outbox.post(Slot::Sdo(n));
            }
        };
        let dialect = &self.device.dialect;
        let server = self.server(n);
        server.transfer = Transfer {
            address,
            place,
            with_crc: blocks.unwrap_or(false),
            ..Transfer::IDLE
        }
        .of_size(size);
        let verdict = match place {
            Place::Stream => owner.stream_begin(address, size),
            _ => Verdict::Accept,
        };
        match (verdict, blocks) {
            (Verdict::Refuse(abort), _) => server.aborted(address, abort),
            (Verdict::Later, None) => return self.wait(n, Wait::SegmentsBegin),
            (Verdict::Later, Some(_)) => return self.wait(n, Wait::BlocksBegin),
            (Verdict::Accept | Verdict::Done, None) => {
                server.segments_may_come();
                self.await_client(n, now);
            }
            (Verdict::Accept | Verdict::Done, Some(_)) => {
                server.blocks_may_come(dialect);
                self.await_client(n, now);
            }
        }
        self.outbox.post(Slot::Sdo(n));
    }

    /// A segment of a download (CiA 301 7.2.4.3.4).
    #[allow(clippy::too_many_arguments, reason = "what the frame says, one by one")]
    pub(crate) fn download_segment<O: Owner>(
        &mut self,
        n: u8,
        toggle: bool,
        data: &[u8],
        is_last: bool,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let transfer = self.server(n).transfer;
        if transfer.phase != Phase::Download {
            return self.abort_transfer(n, Abort::COMMAND, owner);
        }
        if toggle != transfer.toggle {
            return self.abort_transfer(n, Abort::TOGGLE, owner);
        }
        if let Err(abort) = self.gather(n, data, owner) {
            return self.abort_transfer(n, abort, owner);
        }
        if !is_last {
            self.server(n).segment_came();
            self.await_client(n, now);
            return self.outbox.post(Slot::Sdo(n));
        }
        match self.commit(n, now, owner, events) {
            Ok(Written::Now) => {
                self.let_go(n);
                let server = self.server(n);
                server.finish();
                server.segment_came();
                self.outbox.post(Slot::Sdo(n));
            }
            Ok(Written::Later) => self.wait(n, Wait::SegmentsEnd),
            Err(abort) => self.abort_transfer(n, abort, owner),
        }
    }
}

impl Transfer {
    /// Whether it is a download to a stream that has begun and not ended.
    pub(crate) fn is_open_stream(&self) -> bool {
        matches!(self.place, Place::Stream)
            && matches!(
                self.phase,
                Phase::Download
                    | Phase::BlockDownload
                    | Phase::BlockDownloadEnd
                    | Phase::Waiting(Wait::SegmentsBegin | Wait::BlocksBegin)
            )
    }
}

impl SdoServer {
    /// Eight bytes of which seven are data.
    pub(crate) fn segment(&mut self, command: u8, bytes: [u8; 7]) {
        let [b0, b1, b2, b3, b4, b5, b6] = bytes;
        self.reply = [command, b0, b1, b2, b3, b4, b5, b6];
    }

    /// Acknowledges the announcement of segments.
    pub(crate) fn segments_may_come(&mut self) {
        self.transfer.phase = Phase::Download;
        let address = self.transfer.address;
        self.answer(0x60, address, 0);
    }

    /// Acknowledges a segment.
    pub(crate) fn segment_came(&mut self) {
        let toggle = self.transfer.toggle;
        self.transfer.toggle = !toggle;
        self.segment(0x20 | u8::from(toggle) << 4, [0; 7]);
    }
}
