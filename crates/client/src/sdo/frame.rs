//! SDO frames, both ways, tolerant of what drives do to them.

use can::Frame;
use canopen::{Abort, Address, DataType, NodeId};

use crate::{RequestForm, Value};

/// The data of an expedited transfer: up to four bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Data {
    bytes: [u8; 4],
    len: u8,
    is_sized: bool,
}

impl Data {
    /// No bytes.
    pub const EMPTY: Data = Data {
        bytes: [0; 4],
        len: 0,
        is_sized: true,
    };

    /// These bytes, 1 to 4 of them, and no more; `None` for another number.
    pub fn sized(bytes: &[u8]) -> Option<Data> {
        if bytes.is_empty() {
            return None;
        }
        Data::with(bytes, true)
    }

    /// Bytes of which the sender did not say how many count; at most 4.
    pub fn unsized_bytes(bytes: &[u8]) -> Option<Data> {
        Data::with(bytes, false)
    }

    fn with(bytes: &[u8], is_sized: bool) -> Option<Data> {
        let mut all = [0; 4];
        all.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(Data {
            bytes: all,
            len: bytes.len() as u8,
            is_sized,
        })
    }

    /// The bytes that came. If [`Data::is_sized`] is false, trailing ones may be padding (P2).
    pub fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.len)]
    }

    /// Whether the sender said how many bytes count.
    pub fn is_sized(&self) -> bool {
        self.is_sized
    }

    /// All bytes as a little-endian number.
    pub fn raw(&self) -> u32 {
        u32::from_le_bytes(self.bytes)
    }

    /// As a value of `data_type`; `None` if the bytes are too few, or more than the type has
    /// although the sender said how many count.
    pub fn value(&self, data_type: DataType) -> Option<Value> {
        if self.is_sized && data_type != DataType::Text && self.len > data_type.size() {
            return None;
        }
        Value::decode(self.bytes(), data_type)
    }
}

/// What a client asks a server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Read an object.
    Upload(Address),
    /// Write an object.
    Download(Address, Data),
    /// Begin to write an object in segments; its size if indicated.
    SegmentedDownload(Address, Option<u32>),
    /// Give up a transfer.
    Abort(Address, Abort),
    /// Something else: a segment or a block transfer.
    Other {
        /// The first byte.
        command: u8,
    },
}

/// What a server answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The value of an object.
    Uploaded(Address, Data),
    /// An object was written.
    Downloaded(Address),
    /// It was not, and this is why.
    Aborted(Address, Abort),
    /// The server begins to send an object in segments; its size if indicated.
    SegmentedUpload(Address, Option<u32>),
    /// Something else: a segment or a block transfer.
    Other {
        /// The first byte.
        command: u8,
    },
}

/// Index, sub-index and the bytes after them; `None` for a frame under four bytes.
fn split(frame: &Frame) -> Option<(u8, Address, &[u8])> {
    if frame.is_extended() {
        return None;
    }
    let (&[command, index_low, index_high, sub], data) = frame.data().split_first_chunk::<4>()?;
    Some((
        command,
        Address::new(u16::from_le_bytes([index_low, index_high]), sub),
        data,
    ))
}

/// Bytes 4 to 7 as a number, zero padded.
fn number(data: &[u8]) -> u32 {
    let mut raw = [0; 4];
    for (place, byte) in raw.iter_mut().zip(data) {
        *place = *byte;
    }
    u32::from_le_bytes(raw)
}

/// The data of an expedited transfer: as many as the size bits say, or all there are.
fn expedited(command: u8, data: &[u8]) -> Data {
    let data = &data[..data.len().min(4)];
    let said = 4 - usize::from(command >> 2 & 3);
    match (command & 1 != 0, data.get(..said)) {
        (true, Some(data)) => Data::sized(data),
        _ => Data::unsized_bytes(data),
    }
    .unwrap_or(Data::EMPTY)
}

impl Request {
    /// Reads a frame sent to a server; `None` for one too short to be a request.
    pub fn parse(frame: &Frame) -> Option<Request> {
        let (command, address, data) = split(frame)?;
        Some(match command >> 5 {
            1 if command & 2 != 0 => Request::Download(address, expedited(command, data)),
            1 => Request::SegmentedDownload(address, (command & 1 != 0).then(|| number(data))),
            2 => Request::Upload(address),
            4 => Request::Abort(address, Abort(number(data))),
            _ => Request::Other { command },
        })
    }

    /// The frame that asks this of `node`; `None` for [`Request::Other`].
    pub fn frame(&self, node: NodeId, form: RequestForm) -> Option<Frame> {
        let (command, address, data, length) = match (*self, form) {
            (Request::Upload(address), RequestForm::Standard) => (0x40, address, 0, 8),
            (Request::Upload(address), RequestForm::Short) => (0x40, address, 0, 4),
            (Request::Download(address, data), RequestForm::Standard) if data.is_sized() => {
                (0x23 | (4 - data.len) << 2, address, data.raw(), 8)
            }
            (Request::Download(address, data), RequestForm::Standard) => {
                (0x22, address, data.raw(), 8)
            }
            (Request::Download(address, data), RequestForm::Short) => {
                (0x22, address, data.raw(), 4 + data.len)
            }
            (Request::SegmentedDownload(address, size), _) => (
                0x20 | u8::from(size.is_some()),
                address,
                size.unwrap_or(0),
                8,
            ),
            (Request::Abort(address, abort), _) => (0x80, address, abort.0, 8),
            (Request::Other { .. }, _) => return None,
        };
        let [low, high] = address.index.to_le_bytes();
        let [d0, d1, d2, d3] = data.to_le_bytes();
        let bytes = [command, low, high, address.sub, d0, d1, d2, d3];
        Some(Frame::classic(0x600 + u16::from(node.get()), bytes, length))
    }
}

impl Answer {
    /// Reads a frame sent by a server; `None` for one too short to be an answer. Missing data bytes
    /// are zero, and the data of an acknowledge are not looked at (J1).
    pub fn parse(frame: &Frame) -> Option<Answer> {
        let (command, address, data) = split(frame)?;
        Some(match command >> 5 {
            2 if command & 2 != 0 => Answer::Uploaded(address, expedited(command, data)),
            2 => Answer::SegmentedUpload(address, (command & 1 != 0).then(|| number(data))),
            3 => Answer::Downloaded(address),
            4 => Answer::Aborted(address, Abort(number(data))),
            _ => Answer::Other { command },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::new(1).unwrap();

    fn frame(data: &[u8]) -> Frame {
        let mut bytes = [0; 8];
        bytes[..data.len()].copy_from_slice(data);
        Frame::classic(0x581, bytes, data.len() as u8)
    }

    #[test]
    fn requests_are_written_in_both_forms() {
        let controlword = Address::new(0x6040, 0);
        let data = Data::sized(&[0x86, 0x00]).unwrap();
        let download = Request::Download(controlword, data);
        // The size code is (4 - n) << 2: one byte 2F, two 2B, three 27, four 23.
        for (bytes, command) in [(1, 0x2F), (2, 0x2B), (3, 0x27), (4, 0x23)] {
            let data = Data::sized(&[7; 4][..bytes]).unwrap();
            let frame = Request::Download(controlword, data).frame(NODE, RequestForm::Standard);
            assert_eq!(frame.unwrap().data()[0], command);
            assert_eq!(frame.unwrap().len(), 8);
        }
        // P3 l.244, as printed.
        let short = download.frame(NODE, RequestForm::Short).unwrap();
        assert_eq!(short.to_string(), "601#224060008600");
        let short = Request::Upload(Address::new(0x3008, 1)).frame(NODE, RequestForm::Short);
        assert_eq!(short.unwrap().to_string(), "601#40083001");
        let standard = Request::Upload(controlword).frame(NODE, RequestForm::Standard);
        assert_eq!(standard.unwrap().to_string(), "601#4040600000000000");
    }

    #[test]
    fn an_answer_without_size_keeps_its_padding_and_says_so() {
        // P3 l.249.
        let answer = Answer::parse(&frame(&[0x42, 0x08, 0x30, 0x01, 0x96, 0x72, 0, 0]));
        let Some(Answer::Uploaded(address, data)) = answer else {
            panic!("{answer:?}")
        };
        assert_eq!(address, Address::new(0x3008, 1));
        assert!(!data.is_sized());
        assert_eq!(data.bytes(), [0x96, 0x72, 0, 0]);
        assert_eq!(data.value(DataType::U16), Some(Value::Integer(0x7296)));
    }

    #[test]
    fn an_answer_with_size_is_held_to_it() {
        let answer = Answer::parse(&frame(&[0x4B, 0x41, 0x60, 0, 0x37, 0x02, 0, 0]));
        let Some(Answer::Uploaded(_, data)) = answer else {
            panic!("{answer:?}")
        };
        assert_eq!(data.bytes(), [0x37, 0x02]);
        assert_eq!(data.value(DataType::U8), None);
        assert_eq!(data.value(DataType::U32), None);
        assert_eq!(data.value(DataType::U16), Some(Value::Integer(0x0237)));
    }

    #[test]
    fn what_a_request_writes_it_also_reads() {
        let address = Address::new(0x1010, 4);
        for request in [
            Request::Upload(address),
            Request::Download(address, Data::sized(&[1, 2, 3]).unwrap()),
            Request::SegmentedDownload(address, Some(21)),
            Request::Abort(address, Abort::TIMED_OUT),
        ] {
            let frame = request.frame(NODE, RequestForm::Standard).unwrap();
            assert_eq!(Request::parse(&frame), Some(request));
        }
    }

    #[test]
    fn short_answers_are_read_as_far_as_they_go() {
        assert_eq!(Answer::parse(&frame(&[0x60, 0x40, 0x60])), None);
        assert_eq!(
            Answer::parse(&frame(&[0x60, 0x40, 0x60, 0x00])),
            Some(Answer::Downloaded(Address::new(0x6040, 0)))
        );
        // Two bytes said, one there: the size cannot be believed.
        let answer = Answer::parse(&frame(&[0x4B, 0x40, 0x60, 0x00, 0x05]));
        let Some(Answer::Uploaded(_, data)) = answer else {
            panic!("{answer:?}")
        };
        assert_eq!((data.bytes(), data.is_sized()), (&[5][..], false));
    }
}
