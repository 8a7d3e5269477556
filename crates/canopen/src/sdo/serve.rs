//! Serving an SDO request: from the client's frame to the answer that waits.

use can::Frame;

use super::{Phase, Request, SdoServer, Size, Transfer, Wait};
use crate::access::Written;
use crate::outbox::Slot;
use crate::row::flag;
use crate::{Abort, Address, Entry, Events, Image, Instant, Node, NodeMemory, Owner, SdoTransfers};

/// What may be read.
pub(crate) enum Readable {
    /// An object.
    Entry(Entry),
    /// A sub-index 0 that no row declares: the highest sub-index (CiA 301 7.4.3).
    Highest(u8),
}

impl<M: NodeMemory> Node<M> {
    /// Answers the upload of a number at once, which is what masters ask for all day; whether that
    /// is what the frame asks, of an idle server. If not, it is for [`Node::serve`].
    #[inline]
    pub(crate) fn upload_at_once<O: Owner>(&mut self, n: u8, frame: &Frame, owner: &mut O) -> bool {
        let [command, index_low, index_high, sub, ..] = frame.bytes();
        let may = self.server(n).is_idle() && self.answers_sdo();
        if !may || command >> 5 != 2 || frame.len() != 8 {
            return false;
        }
        let address = Address::new(u16::from_le_bytes([index_low, index_high]), sub);
        let Ok(entry) = self.device.table.find(address.index, address.sub) else {
            return false;
        };
        if entry.flags & (flag::READ | flag::LONG | flag::HISTORY) != flag::READ {
            return false;
        }
        let mut image = Image::new(self.memory.as_mut());
        if entry.has(flag::LIVE) {
            owner.publish(&mut image);
        }
        let raw = image.raw(entry.field);
        let dialect = &self.device.dialect;
        self.server(n)
            .uploaded(address, raw, entry.field.size(), dialect);
        self.outbox.post(Slot::Sdo(n));
        true
    }

    /// Serves one request to server `n`.
    pub(crate) fn serve<O: Owner>(
        &mut self,
        n: u8,
        frame: &Frame,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let in_block = self.server(n).transfer.phase == Phase::BlockDownload;
        if in_block && frame.len() == 8 && !self.server(n).is_announced_again(frame) {
            return self.block_segment(n, frame.bytes(), now, owner);
        }
        let Some(request) = Request::parse(frame, &self.device.dialect) else {
            return;
        };
        match request {
            Request::Upload(address) => {
                self.interrupt(n, owner);
                self.upload(n, address, now, owner);
            }
            Request::Download { address, raw, size } => {
                self.interrupt(n, owner);
                self.download(n, address, raw, size, now, owner, events);
            }
            request => {
                let [_, low, high, sub, ..] = frame.bytes();
                if self.is_last_segment_again(n, frame, now) {
                    return;
                }
                let is_short = self.device.dialect.sdo == SdoTransfers::Expedited;
                if is_short && self.server(n).is_idle() {
                    // An abort names the object of the transfer, over or not. Here there are none, so
                    // that it names what stands where an object would.
                    let named = Address::new(u16::from_le_bytes([low, high]), sub);
                    self.server(n).transfer.address = named;
                }
                self.serve_long(n, request, now, owner, events);
            }
        }
    }

    /// An upload: answered at once, or the beginning of a transfer.
    fn upload<O: Owner>(&mut self, n: u8, address: Address, now: Instant, owner: &mut O) {
        let dialect = &self.device.dialect;
        match self.readable(address) {
            Ok(Readable::Entry(entry)) if entry.has(flag::LONG) => {
                self.begin_upload(n, address, &entry, now, owner);
            }
            Ok(Readable::Entry(entry)) => {
                let mut image = Image::new(self.memory.as_mut());
                if entry.has(flag::LIVE) {
                    owner.publish(&mut image);
                }
                let raw = image.raw(entry.field);
                self.server(n)
                    .uploaded(address, raw, entry.field.size(), dialect);
            }
            Ok(Readable::Highest(highest)) => {
                self.server(n)
                    .uploaded(address, u32::from(highest), 1, dialect);
            }
            Err(abort) => self.server(n).aborted(address, abort),
        }
        self.outbox.post(Slot::Sdo(n));
    }

    /// An expedited download.
    #[allow(clippy::too_many_arguments, reason = "what the frame says, one by one")]
    fn download<O: Owner>(
        &mut self,
        n: u8,
        address: Address,
        raw: u32,
        size: Size,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        let written = self.writable(address).and_then(|entry| {
            if entry.has(flag::LONG) {
                let bytes = size.of_string(&entry)?;
                let data = raw.to_le_bytes();
                let data = data.get(..usize::from(bytes)).unwrap_or(&[]);
                let written = self.write_long_at_once(n, address, &entry, data, now, owner, events);
                return written.map(|written| (written, raw));
            }
            size.check(entry.field.size(), raw, &self.device.dialect)?;
            let raw = low_bytes(raw, entry.field.size());
            self.write(address, &entry, raw, now, owner, events)
                .map(|written| (written, raw))
        });
        let dialect = &self.device.dialect;
        match written {
            Ok((Written::Now, raw)) => self.server(n).downloaded(address, raw, dialect),
            Ok((Written::Later, raw)) => {
                let transfer = &mut self.server(n).transfer;
                transfer.address = address;
                transfer.value = u64::from(raw).to_le_bytes();
                return self.wait(n, Wait::Expedited);
            }
            Err(abort) => self.server(n).aborted(address, abort),
        }
        self.outbox.post(Slot::Sdo(n));
    }

    /// Everything that is not an expedited transfer.
    #[cold]
    fn serve_long<O: Owner>(
        &mut self,
        n: u8,
        request: Request,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) {
        // An abort is never answered (CiA 301 7.2.4.3.17); it ends what goes on.
        if let Request::Abort(why) = request {
            return self.client_aborts(n, why, owner);
        }
        if self.device.dialect.sdo == SdoTransfers::Expedited {
            if self.server(n).is_waiting() {
                let address = self.server(n).transfer.address;
                self.server(n).aborted(address, Abort::COMMAND);
                return self.outbox.post(Slot::Sdo(n));
            }
            return self.abort_transfer(n, Abort::COMMAND, owner);
        }
        match request {
            Request::DownloadSegments { address, size } => {
                self.begin_download(n, address, size, None, now, owner);
            }
            Request::Segment {
                toggle,
                bytes,
                count,
                is_last,
            } => {
                let data = bytes.get(..usize::from(count)).unwrap_or(&[]);
                self.download_segment(n, toggle, data, is_last, now, owner, events);
            }
            Request::UploadSegment { toggle } => self.upload_segment(n, toggle, now, owner),
            Request::BlockUpload {
                address,
                with_crc,
                block_size,
                switch_bytes,
            } => {
                let wish = (with_crc, block_size, switch_bytes);
                self.begin_block_upload(n, address, wish, now, owner);
            }
            Request::BlockUploadStart => self.start_blocks(n, now, owner),
            Request::BlockUploadAcknowledge {
                segments,
                block_size,
            } => self.block_acknowledged(n, segments, block_size, now, owner),
            Request::BlockUploadEnd => self.end_block_upload(n, owner),
            Request::BlockDownload {
                address,
                with_crc,
                size,
            } => self.begin_download(n, address, size, Some(with_crc), now, owner),
            Request::BlockDownloadEnd { unused, crc } => {
                self.end_block_download(n, unused, crc, now, owner, events);
            }
            Request::Unknown(address) => {
                self.drop_transfer(n, Abort::COMMAND, owner);
                self.server(n).aborted(address, Abort::COMMAND);
                self.outbox.post(Slot::Sdo(n));
            }
            Request::Upload(_) | Request::Download { .. } | Request::Abort(_) => {}
        }
    }

    /// The object at `address` if it may be read.
    pub(crate) fn readable(&self, address: Address) -> Result<Readable, Abort> {
        let table = &self.device.table;
        let entry = match table.find(address.index, address.sub) {
            Ok(entry) => entry,
            Err(abort) if address.sub == 0 => {
                return table
                    .highest_sub_index(address.index)
                    .map(Readable::Highest)
                    .ok_or(abort);
            }
            Err(abort) => return Err(abort),
        };
        if !entry.has(flag::READ) {
            return Err(match entry.has(flag::WRITE) {
                true => Abort::WRITE_ONLY,
                false => Abort::NO_OBJECT, // seen by the drive alone
            });
        }
        if entry.has(flag::HISTORY) && !self.history_has(address.sub) {
            return Err(Abort::NO_DATA);
        }
        Ok(Readable::Entry(entry))
    }

    /// The object at `address` if it may be written now.
    pub(crate) fn writable(&self, address: Address) -> Result<Entry, Abort> {
        let entry = match self.device.table.find(address.index, address.sub) {
            Ok(entry) => entry,
            Err(abort) => return Err(self.sub_0(address, abort)),
        };
        if self.waiting.is_some() {
            // One thing at a time: the owner has not answered the last one yet.
            return Err(Abort::DEVICE_STATE);
        }
        if !entry.has(flag::WRITE) {
            return Err(match entry.has(flag::READ) {
                true => Abort::READ_ONLY,
                false => Abort::NO_OBJECT, // seen by the drive alone
            });
        }
        Ok(entry)
    }

    /// A write to the sub-index 0 that an upload makes up is a write to a constant.
    #[cold]
    fn sub_0(&self, address: Address, abort: Abort) -> Abort {
        let made_up = address.sub == 0
            && abort == Abort::NO_SUB_INDEX
            && self.device.table.highest_sub_index(address.index).is_some();
        if made_up { Abort::READ_ONLY } else { abort }
    }

    /// The client of server `n` begins anew: what it had begun is over. A write that its owner is
    /// at goes on.
    pub(crate) fn interrupt<O: Owner>(&mut self, n: u8, owner: &mut O) {
        if !self.server(n).is_idle() && !self.server(n).is_waiting() {
            self.drop_transfer(n, Abort::GENERAL, owner);
        }
    }

    /// The client of server `n` gives up: it wants no answer any more.
    pub(crate) fn client_aborts<O: Owner>(&mut self, n: u8, why: Abort, owner: &mut O) {
        self.drop_transfer(n, why, owner);
        self.outbox.withdraw(Slot::Sdo(n));
    }

    /// Ends the transfers of servers that exist no longer (0x1201 and on).
    #[cold]
    pub(crate) fn drop_switched_off<O: Owner>(&mut self, owner: &mut O) {
        for n in 1..crate::SDO_SERVERS as u8 {
            if !self.server(n).exists() {
                self.drop_transfer(n, Abort::NOT_AVAILABLE, owner);
                self.outbox.withdraw(Slot::Sdo(n));
            }
        }
    }

    /// Ends the transfer of server `n` before its end, if there is one; says nothing to the client.
    pub(crate) fn drop_transfer<O: Owner>(&mut self, n: u8, why: Abort, owner: &mut O) {
        let server = self.server(n);
        let transfer = server.transfer;
        server.finish();
        if transfer.is_open_stream() {
            owner.stream_abort(transfer.address, why);
        }
        self.let_go(n);
        // Segments that were about to be sent are not.
        if transfer.phase == Phase::BlockUpload {
            self.outbox.withdraw(Slot::Sdo(n));
        }
    }

    /// Ends the transfer of server `n` and tells the client why.
    pub(crate) fn abort_transfer<O: Owner>(&mut self, n: u8, why: Abort, owner: &mut O) {
        self.drop_transfer(n, why, owner);
        let server = self.server(n);
        let address = server.transfer.address;
        server.aborted(address, why);
        self.outbox.post(Slot::Sdo(n));
    }

    /// Server `n` needs its owner and the room for strings no longer.
    pub(crate) fn let_go(&mut self, n: u8) {
        if self.waiting == Some(n) {
            self.waiting = None;
        }
        if self.gathering == Some(n) {
            self.gathering = None;
        }
    }

    /// Server `n` answers when its owner does.
    pub(crate) fn wait(&mut self, n: u8, wait: Wait) {
        self.waiting = Some(n);
        let server = self.server(n);
        server.transfer.phase = Phase::Waiting(wait);
        server.due = Instant::NEVER;
    }

    /// The client's next step is due within the time that the dialect says.
    pub(crate) fn await_client(&mut self, n: u8, now: Instant) {
        let SdoTransfers::All { timeout_ms, .. } = self.device.dialect.sdo else {
            return;
        };
        let due = now.plus_ms(u64::from(timeout_ms));
        self.server(n).due = due;
        self.due = self.due.min(due);
    }

    /// Server `n`, one of [`crate::SDO_SERVERS`].
    #[inline]
    pub(crate) fn server(&mut self, n: u8) -> &mut SdoServer {
        let [first, second, third] = &mut self.servers;
        match n {
            0 => first,
            1 => second,
            _ => third,
        }
    }

    /// The transfer of server `n`.
    pub(crate) fn transfer(&self, n: u8) -> &Transfer {
        let [first, second, third] = &self.servers;
        match n {
            0 => &first.transfer,
            1 => &second.transfer,
            _ => &third.transfer,
        }
    }

    /// Gives up clients that have not taken the next step; called when one is due.
    pub(crate) fn give_clients_up<O: Owner>(&mut self, now: Instant, owner: &mut O) {
        for n in 0..crate::SDO_SERVERS as u8 {
            if now < self.server(n).due || self.server(n).due == Instant::NEVER {
                continue;
            }
            if self.is_sending_block(n) {
                // It is the wire that takes so long.
                self.await_client(n, now);
            } else if !self.block_fell_silent(n, now) {
                self.abort_transfer(n, Abort::TIMED_OUT, owner);
            }
        }
    }

    /// Answers the write that the owner judged [`crate::Verdict::Later`]. Does nothing if no such
    /// write waits (its client may have given up). Afterwards call [`Node::transmit`].
    pub fn complete(&mut self, result: Result<(), Abort>, now: Instant) {
        let Some(n) = self.waiting else { return };
        self.let_go(n);
        let dialect = &self.device.dialect;
        let transfer = *self.transfer(n);
        let Phase::Waiting(wait) = transfer.phase else {
            return;
        };
        // Nothing was committed: this is what the command's object reads as.
        let reads_as = match self.readable(transfer.address) {
            Ok(Readable::Entry(entry)) => self.raw(entry.field),
            _ => 0,
        };
        let server = self.server(n);
        server.finish();
        match (result, wait) {
            (Err(abort), _) => server.aborted(transfer.address, abort),
            (Ok(()), Wait::Expedited) => {
                server.downloaded(transfer.address, reads_as, dialect);
            }
            (Ok(()), Wait::SegmentsBegin) => {
                server.segments_may_come();
                self.await_client(n, now);
            }
            (Ok(()), Wait::SegmentsEnd) => server.segment_came(),
            (Ok(()), Wait::BlocksBegin) => {
                server.blocks_may_come(dialect);
                self.await_client(n, now);
            }
            (Ok(()), Wait::BlocksEnd) => server.blocks_came(),
        }
        self.outbox.post(Slot::Sdo(n));
    }
}

/// The low `bytes` (1 to 4) of `raw`.
#[inline]
fn low_bytes(raw: u32, bytes: u8) -> u32 {
    match bytes {
        1 => raw & 0xFF,
        2 => raw & 0xFFFF,
        _ => raw,
    }
}
