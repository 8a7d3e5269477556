//! Where the bytes of an upload come from.

use super::{Phase, Place, Transfer};
use crate::row::{Default, flag};
use crate::{Abort, Address, DataType, Entry, Field, Image, Node, NodeMemory, Owner, Row};

/// An object that is about to be read.
pub(crate) struct Source {
    pub(crate) place: Place,
    /// Bytes, as far as that is known.
    pub(crate) size: Option<u32>,
    pub(crate) value: [u8; 8],
}

/// What one segment carries.
pub(crate) struct Piece {
    pub(crate) bytes: [u8; 7],
    pub(crate) count: u8,
    pub(crate) is_last: bool,
}

impl Source {
    /// A value that is at hand.
    pub(crate) fn number(raw: u64, bytes: u8) -> Source {
        Source {
            place: Place::Value(bytes),
            size: Some(u32::from(bytes)),
            value: raw.to_le_bytes(),
        }
    }
}

impl<M: NodeMemory> Node<M> {
    /// Opens an object for reading.
    pub(crate) fn open<O: Owner>(
        &mut self,
        address: Address,
        entry: &Entry,
        owner: &mut O,
    ) -> Result<Source, Abort> {
        let (place, size) = match entry.field.data_type() {
            DataType::Domain => (Place::Stream, owner.stream_size(address)?),
            DataType::Text if entry.has(flag::FLASH) => {
                let length = self.flash(entry.row).len();
                (Place::Flash(entry.row), u32::try_from(length).ok())
            }
            data_type => {
                let mut image = Image::new(self.memory.as_mut());
                if entry.has(flag::LIVE) {
                    owner.publish(&mut image);
                }
                match data_type {
                    DataType::Text => {
                        let bytes = image.bytes(entry.field);
                        let end = bytes.iter().position(|byte| *byte == 0);
                        let length = end.unwrap_or(bytes.len());
                        (Place::String(entry.field), u32::try_from(length).ok())
                    }
                    DataType::Bytes => {
                        let length = u32::from(entry.field.size());
                        (Place::String(entry.field), Some(length))
                    }
                    _ => return Ok(Source::number(image.wide(entry.field), entry.field.size())),
                }
            }
        };
        Ok(Source {
            place,
            size,
            value: [0; 8],
        })
    }

    /// A string has a new value: who is reading the old one cannot have the rest of it.
    pub(crate) fn replaced(&mut self, field: Field) {
        for server in &mut self.servers {
            let transfer = &mut server.transfer;
            let reads = matches!(
                transfer.phase,
                Phase::Upload | Phase::BlockUploadStart | Phase::BlockUpload
            );
            if reads && matches!(transfer.place, Place::String(of) if of == field) {
                transfer.place = Place::Gone;
            }
        }
    }

    /// The constant text of a row.
    fn flash(&self, row: u16) -> &'static str {
        match self.device.table.rows().get(usize::from(row)) {
            Some(Row {
                default: Default::Text(text),
                ..
            }) => text,
            _ => "",
        }
    }

    /// The next piece of `transfer`, from byte `at` on.
    pub(crate) fn piece<O: Owner>(
        &self,
        transfer: &Transfer,
        at: u32,
        owner: &mut O,
    ) -> Result<Piece, Abort> {
        // One byte more than a segment carries tells whether it is the last.
        let mut eight = [0; 8];
        let left = match transfer.size() {
            Some(size) => size.saturating_sub(at).min(8) as usize,
            None => 8,
        };
        let wanted = eight.get_mut(..left).unwrap_or(&mut []);
        let given = match transfer.place {
            Place::Stream => owner.stream_read(transfer.address, at, wanted)?.min(left),
            Place::Gone => return Err(Abort::DEVICE_STATE),
            Place::Value(count) => copy(&transfer.value, usize::from(count), at, wanted),
            Place::Flash(row) => {
                let text = self.flash(row);
                copy(text.as_bytes(), text.len(), at, wanted)
            }
            Place::String(field) => {
                let bytes = crate::image::bytes(self.memory.as_ref(), field);
                copy(bytes, bytes.len(), at, wanted)
            }
        };
        if transfer.size().is_some() && given < left {
            // It ends before its length.
            return Err(Abort::LENGTH);
        }
        let mut bytes = *eight.first_chunk().unwrap_or(&[0; 7]);
        if given < 7 {
            for byte in bytes.iter_mut().skip(given) {
                *byte = 0;
            }
        }
        Ok(Piece {
            bytes,
            count: given.min(7) as u8,
            is_last: given <= 7,
        })
    }
}

/// Copies the first `count` of `bytes` from `at` on, as far as they go.
fn copy(bytes: &[u8], count: usize, at: u32, into: &mut [u8]) -> usize {
    let rest = usize::try_from(at)
        .ok()
        .and_then(|at| bytes.get(at..count))
        .unwrap_or(&[]);
    let mut given = 0;
    for (place, byte) in into.iter_mut().zip(rest) {
        *place = *byte;
        given += 1;
    }
    given
}
