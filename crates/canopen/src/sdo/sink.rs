//! Where the bytes of a download go: gathered, and judged as one write at the end.

use super::{Place, Transfer};
use crate::access::Written;
use crate::{Abort, Address, DataType, Entry, Events, Instant, Node, NodeMemory, Owner, Verdict};

/// The longest string in an image.
const LONGEST: usize = 255;

impl<M: NodeMemory> Node<M> {
    /// Where a download of `size` bytes, if that was said, to an object would go.
    ///
    /// # Errors
    /// It does not fit the object, or the one place where strings are gathered is taken.
    pub(crate) fn place_for(
        &mut self,
        n: u8,
        address: Address,
        entry: &Entry,
        size: Option<u32>,
    ) -> Result<Place, Abort> {
        let room = u32::from(entry.field.size());
        let data_type = entry.field.data_type();
        if data_type == DataType::Domain {
            self.is_free(n, address)?;
            return Ok(Place::Stream);
        }
        match size {
            Some(size) if size > room => return Err(Abort::TOO_LONG),
            Some(size) if size < room && data_type != DataType::Text => {
                return Err(Abort::TOO_SHORT);
            }
            _ => {}
        }
        if data_type.is_number() {
            return Ok(Place::Value(entry.field.size()));
        }
        if self.gathering.is_some_and(|other| other != n) {
            return Err(Abort::OUT_OF_MEMORY);
        }
        self.gathering = Some(n);
        Ok(Place::String(entry.field))
    }

    /// Whether server `n` may begin a download to a stream.
    ///
    /// # Errors
    /// Another server is at it.
    fn is_free(&self, n: u8, address: Address) -> Result<(), Abort> {
        let taken = (0u8..).zip(&self.servers).any(|(other, server)| {
            let transfer = &server.transfer;
            other != n && transfer.is_open_stream() && transfer.address == address
        });
        if taken {
            Err(Abort::DEVICE_STATE)
        } else {
            Ok(())
        }
    }

    /// Takes the next bytes of the download of server `n`. If they are refused, the stream is over.
    pub(crate) fn gather<O: Owner>(
        &mut self,
        n: u8,
        bytes: &[u8],
        owner: &mut O,
    ) -> Result<(), Abort> {
        let transfer = self.server(n).transfer;
        let Transfer {
            address, place, at, ..
        } = transfer;
        let end = at.checked_add(bytes.len() as u32).ok_or(Abort::TOO_LONG)?;
        if transfer.size().is_some_and(|size| end > size) {
            return Err(Abort::TOO_LONG);
        }
        let from = usize::try_from(at).map_err(|_| Abort::TOO_LONG)?;
        match place {
            Place::Stream => {
                if let Err(abort) = owner.stream_write(address, at, bytes) {
                    // The owner knows; it is not told again.
                    self.server(n).finish();
                    return Err(abort);
                }
            }
            Place::Value(count) => {
                let value = &mut self.server(n).transfer.value;
                let room = value.get_mut(..usize::from(count)).unwrap_or(&mut []);
                put(room, from, bytes)?;
            }
            Place::String(field) => {
                let values = self.device.table.value_bytes();
                let room = self
                    .memory
                    .as_mut()
                    .get_mut(values..)
                    .and_then(|room| room.get_mut(..usize::from(field.size())))
                    .ok_or(Abort::OUT_OF_MEMORY)?;
                put(room, from, bytes)?;
            }
            Place::Flash(_) | Place::Gone => return Err(Abort::READ_ONLY),
        }
        self.server(n).transfer.at = end;
        Ok(())
    }

    /// All bytes of the download of server `n` have come: judges and commits the write.
    pub(crate) fn commit<O: Owner>(
        &mut self,
        n: u8,
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) -> Result<Written, Abort> {
        let transfer = self.server(n).transfer;
        if transfer.size().is_some_and(|size| size != transfer.at) {
            return Err(Abort::TOO_SHORT);
        }
        let address = transfer.address;
        if let Place::Stream = transfer.place {
            if self.waiting.is_some() {
                // Its owner may answer later, and only one such answer can be awaited.
                return Err(Abort::DEVICE_STATE);
            }
            let verdict = owner.stream_end(address, transfer.at);
            // Whatever it says, the stream is over.
            self.server(n).finish();
            return match verdict {
                Verdict::Accept | Verdict::Done => {
                    let entry = self.device.table.find(address.index, address.sub)?;
                    events.changed.insert(entry.class);
                    Ok(Written::Now)
                }
                Verdict::Refuse(abort) => Err(abort),
                Verdict::Later => Ok(Written::Later),
            };
        }
        let entry = self.writable(address)?;
        if let Place::Value(count) = transfer.place {
            if transfer.at != u32::from(count) {
                return Err(Abort::TOO_SHORT);
            }
            let [b0, b1, b2, b3, ..] = transfer.value;
            return match entry.field.size() {
                8 => self.write_long(address, &entry, &transfer.value, now, owner, events),
                _ => {
                    let raw = u32::from_le_bytes([b0, b1, b2, b3]);
                    self.write(address, &entry, raw, now, owner, events)
                }
            };
        }
        let mut string = [0; LONGEST];
        let count = usize::try_from(transfer.at).unwrap_or(LONGEST);
        let values = self.device.table.value_bytes();
        let room = self.memory.as_ref().get(values..).unwrap_or(&[]);
        for (place, byte) in string.iter_mut().zip(room).take(count) {
            *place = *byte;
        }
        let string = string.get(..count).unwrap_or(&[]);
        self.write_long(address, &entry, string, now, owner, events)
    }

    /// An expedited download to an object that is not a number of at most four bytes.
    #[cold]
    #[allow(clippy::too_many_arguments, reason = "what a write has, one by one")]
    pub(crate) fn write_long_at_once<O: Owner>(
        &mut self,
        n: u8,
        address: Address,
        entry: &Entry,
        data: &[u8],
        now: Instant,
        owner: &mut O,
        events: &mut Events,
    ) -> Result<Written, Abort> {
        if entry.field.data_type() != DataType::Domain {
            return self.write_long(address, entry, data, now, owner, events);
        }
        self.is_free(n, address)?;
        let size = data.len() as u32;
        match owner.stream_begin(address, Some(size)) {
            Verdict::Accept | Verdict::Done => {}
            Verdict::Refuse(abort) => return Err(abort),
            Verdict::Later => {
                // There is no second request in which the bytes could come.
                owner.stream_abort(address, Abort::UNSUPPORTED_ACCESS);
                return Err(Abort::UNSUPPORTED_ACCESS);
            }
        }
        owner.stream_write(address, 0, data)?;
        match owner.stream_end(address, size) {
            Verdict::Accept | Verdict::Done => {
                events.changed.insert(entry.class);
                Ok(Written::Now)
            }
            Verdict::Refuse(abort) => Err(abort),
            Verdict::Later => Ok(Written::Later),
        }
    }
}

/// Puts `bytes` at `at`.
fn put(room: &mut [u8], at: usize, bytes: &[u8]) -> Result<(), Abort> {
    let place = room
        .get_mut(at..)
        .and_then(|rest| rest.get_mut(..bytes.len()))
        .ok_or(Abort::TOO_LONG)?;
    place.copy_from_slice(bytes);
    Ok(())
}
