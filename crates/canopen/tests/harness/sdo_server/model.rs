//! What a client of one server knows of its transfer from the frames alone, and what the server may
//! say then.

use canopen::{Abort, Address};

/// Where the transfer is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// There is none.
    #[default]
    Idle,
    /// Segments are sent, the next with this toggle bit.
    Download { toggle: u8 },
    /// Segments are asked for, likewise.
    Upload { toggle: u8 },
    /// Segments of a block are sent; those since the last acknowledge.
    BlockDownload { block: Vec<[u8; 8]> },
    /// The last segment has been acknowledged.
    BlockDownloadEnd,
    /// Blocks of so many segments may be started.
    BlockUploadStart { size: u8 },
    /// They come: so many of this block.
    BlockUpload { size: u8, came: u8, is_last: bool },
    /// All has come.
    BlockUploadEnd,
}

/// The client's view of one server.
#[derive(Clone, Debug, Default)]
pub struct Client {
    pub phase: Phase,
    /// What was asked last, of eight bytes.
    pub request: Option<[u8; 8]>,
    /// The object of the transfer.
    pub object: Option<Address>,
    /// Bytes that have been taken by the other side, or have come.
    pub data: Vec<u8>,
    /// Of the block that came last: what it carried, without the segments before.
    block: Vec<u8>,
    /// Of the last segment that counted.
    last: Vec<u8>,
    last_frame: [u8; 8],
    pub with_crc: bool,
    /// Bytes that were announced.
    pub announced: Option<u32>,
}

/// What an answer has brought about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The transfer goes on, or has been aborted.
    Nothing,
    /// A download is done: the object has its value.
    Written,
    /// An upload is done.
    Read,
}

/// The object that a request names.
pub fn object(frame: [u8; 8]) -> Address {
    Address::new(u16::from_le_bytes([frame[1], frame[2]]), frame[3])
}

fn number(frame: [u8; 8]) -> u32 {
    u32::from_le_bytes([frame[4], frame[5], frame[6], frame[7]])
}

impl Client {
    /// A request goes out.
    pub fn sends(&mut self, frame: [u8; 8]) {
        let command = frame[0];
        let is_again = self.phase == Phase::BlockDownloadEnd
            && frame == self.last_frame
            && command & 0xE3 != 0xC1;
        if is_again {
            return;
        }
        self.request = Some(frame);
        match &mut self.phase {
            Phase::BlockDownload { .. } if command == 0x80 => self.forget(),
            Phase::BlockDownload { block } => block.push(frame),
            _ if command >> 5 == 4 => self.forget(),
            Phase::BlockUpload { .. } if command >> 5 == 5 && command & 3 == 2 => {
                self.keeps(frame[1], frame[2]);
            }
            // Whatever else is said ends it.
            Phase::BlockUpload { .. } => self.phase = Phase::Idle,
            Phase::BlockUploadStart { size } if command >> 5 == 5 && command & 3 == 3 => {
                self.phase = Phase::BlockUpload {
                    size: *size,
                    came: 0,
                    is_last: false,
                };
            }
            Phase::BlockUploadEnd if command >> 5 == 5 && command & 3 == 1 => self.forget(),
            _ => {}
        }
    }

    /// The transfer is over.
    pub fn forget(&mut self) {
        *self = Client::default();
    }

    /// The checksum of a block download whose last segment has so many bytes that count not.
    pub fn checksum(&self, unused: u8) -> u16 {
        let mut all = self.data.clone();
        let count = 7 - usize::from(unused);
        all.extend(self.last.iter().take(count));
        crc(&all)
    }

    /// The last segment that was acknowledged.
    pub fn last_frame(&self) -> [u8; 8] {
        self.last_frame
    }

    /// An answer has come.
    ///
    /// # Panics
    /// If the server may not say that now.
    pub fn hears(&mut self, answer: [u8; 8]) -> Outcome {
        let command = answer[0];
        if command == 0x80 {
            let code = Abort(number(answer));
            assert!(Abort::ALL.contains(&code), "{code}");
            self.forget();
            return Outcome::Nothing;
        }
        if let Phase::BlockUpload {
            size,
            came,
            is_last,
        } = &mut self.phase
            && command & 0x7F == *came + 1
            && *came < *size
            && !*is_last
        {
            *came += 1;
            *is_last = command & 0x80 != 0;
            self.block.extend_from_slice(&answer[1..]);
            return Outcome::Nothing;
        }
        let request = self.request.expect("an answer to nothing");
        match (request[0] >> 5, command) {
            (1, 0x60) if request[0] & 2 != 0 => {
                let size = 4 - usize::from(request[0] >> 2 & 3);
                self.begin(request, Phase::Idle);
                self.data = request[4..].to_vec();
                if request[0] & 1 != 0 {
                    self.data.truncate(size);
                }
                same_object(answer, request);
                assert_eq!(number(answer), 0);
                Outcome::Written
            }
            (1, 0x60) => {
                same_object(answer, request);
                assert_eq!(number(answer), 0);
                self.begin(request, Phase::Download { toggle: 0 });
                self.announced = (request[0] & 1 != 0).then_some(number(request));
                Outcome::Nothing
            }
            (0, 0x20 | 0x30) => {
                let Phase::Download { toggle } = self.phase else {
                    panic!("no download: {answer:02X?}");
                };
                assert_eq!(request[0] & 0x10, toggle);
                assert_eq!(answer, [0x20 | toggle, 0, 0, 0, 0, 0, 0, 0]);
                let count = 7 - usize::from(request[0] >> 1 & 7);
                self.data.extend_from_slice(&request[1..1 + count]);
                self.phase = Phase::Download {
                    toggle: toggle ^ 0x10,
                };
                if request[0] & 1 == 0 {
                    return Outcome::Nothing;
                }
                self.written()
            }
            (2 | 5, 0x43 | 0x47 | 0x4B | 0x4F) => {
                same_object(answer, request);
                assert!(
                    request[0] >> 5 == 2 || request[5] != 0,
                    "no switch was allowed"
                );
                let size = 4 - usize::from(command >> 2 & 3);
                assert!(answer[4 + size..].iter().all(|byte| *byte == 0));
                self.begin(request, Phase::Idle);
                self.data = answer[4..4 + size].to_vec();
                Outcome::Read
            }
            (2 | 5, 0x40 | 0x41) => {
                same_object(answer, request);
                assert!(
                    request[0] >> 5 == 2 || request[5] != 0,
                    "no switch was allowed"
                );
                self.begin(request, Phase::Upload { toggle: 0 });
                self.announced = (command & 1 != 0).then_some(number(answer));
                Outcome::Nothing
            }
            (3, 0x00..=0x1F) => {
                let Phase::Upload { toggle } = self.phase else {
                    panic!("no upload: {answer:02X?}");
                };
                assert_eq!((request[0] & 0x10, command & 0x10), (toggle, toggle));
                let count = 7 - usize::from(command >> 1 & 7);
                assert!(answer[1 + count..].iter().all(|byte| *byte == 0));
                self.data.extend_from_slice(&answer[1..1 + count]);
                self.phase = Phase::Upload {
                    toggle: toggle ^ 0x10,
                };
                if command & 1 == 0 {
                    assert_eq!(count, 7);
                    return Outcome::Nothing;
                }
                self.read()
            }
            (5, 0xC4 | 0xC6) if request[0] & 3 == 0 => {
                same_object(answer, request);
                assert!(matches!(request[4], 1..=127));
                self.begin(request, Phase::BlockUploadStart { size: request[4] });
                self.announced = (command & 2 != 0).then_some(number(answer));
                Outcome::Nothing
            }
            (5, _) if command & 0xE3 == 0xC1 => {
                let Phase::BlockUpload { is_last: true, .. } = self.phase else {
                    panic!("no end: {answer:02X?}");
                };
                let unused = usize::from(command >> 2 & 7);
                let count = self.data.len().checked_sub(unused).expect("so many bytes");
                self.data.truncate(count);
                let crc = if self.with_crc { crc(&self.data) } else { 0 };
                assert_eq!(u16::from_le_bytes([answer[1], answer[2]]), crc);
                assert_eq!(answer[3..], [0; 5]);
                self.read();
                self.phase = Phase::BlockUploadEnd;
                Outcome::Read
            }
            (6, 0xA4) if request[0] & 1 == 0 => {
                same_object(answer, request);
                assert!(matches!(answer[4], 1..=127) && answer[5..] == [0; 3]);
                self.begin(request, Phase::BlockDownload { block: Vec::new() });
                self.announced = (request[0] & 2 != 0).then_some(number(request));
                Outcome::Nothing
            }
            (6, 0xA1) => {
                assert_eq!(self.phase, Phase::BlockDownloadEnd);
                assert_eq!(answer[1..], [0; 7]);
                let unused = usize::from(request[0] >> 2 & 7);
                self.data.extend_from_slice(&self.last[..7 - unused]);
                if self.with_crc {
                    let said = u16::from_le_bytes([request[1], request[2]]);
                    assert_eq!(said, crc(&self.data));
                }
                self.written()
            }
            (_, 0xA2) => {
                self.block_taken(answer);
                Outcome::Nothing
            }
            _ => panic!("{answer:02X?} to {request:02X?} in {:?}", self.phase),
        }
    }

    /// An acknowledge of so many segments, which must have been sent.
    fn block_taken(&mut self, answer: [u8; 8]) {
        assert!(matches!(answer[2], 1..=127) && answer[3..] == [0; 5]);
        let Phase::BlockDownload { block } = &mut self.phase else {
            // Once more, for a client that has repeated its last segment.
            return assert_eq!(self.phase, Phase::BlockDownloadEnd);
        };
        let block = std::mem::take(block);
        let mut is_over = false;
        let mut from = block.iter();
        for number in 1..=answer[1] {
            let segment = from.find(|segment| segment[0] & 0x7F == number);
            let Some(segment) = segment else {
                // Nor has anything new been taken then.
                assert_eq!(number, 1, "{answer:02X?}: segment {number} was not sent");
                return;
            };
            self.data.append(&mut self.last);
            self.last = segment[1..].to_vec();
            self.last_frame = *segment;
            is_over = segment[0] & 0x80 != 0;
        }
        if is_over {
            self.phase = Phase::BlockDownloadEnd;
        }
    }

    /// What of the block that came is kept, when so many segments are acknowledged.
    fn keeps(&mut self, segments: u8, next_size: u8) {
        if let Phase::BlockUpload {
            size,
            came,
            is_last,
        } = &mut self.phase
            && segments <= *came
            && matches!(next_size, 1..=127)
        {
            self.block.truncate(7 * usize::from(segments));
            self.data.append(&mut self.block);
            if !(*is_last && segments == *came) {
                (*size, *came, *is_last) = (next_size, 0, false);
            }
        }
    }

    fn begin(&mut self, request: [u8; 8], phase: Phase) {
        *self = Client {
            phase,
            request: Some(request),
            object: Some(object(request)),
            with_crc: request[0] & 4 != 0,
            ..Client::default()
        };
    }

    fn written(&mut self) -> Outcome {
        self.is_as_announced();
        self.phase = Phase::Idle;
        Outcome::Written
    }

    fn read(&mut self) -> Outcome {
        self.is_as_announced();
        self.phase = Phase::Idle;
        Outcome::Read
    }

    fn is_as_announced(&self) {
        let count = self.data.len() as u32;
        assert!(self.announced.is_none_or(|announced| announced == count));
    }
}

fn same_object(answer: [u8; 8], request: [u8; 8]) {
    assert_eq!(answer[1..4], request[1..4], "of another object");
}

/// CiA 301 7.2.4.3.16.
pub fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0, |crc: u16, byte| {
        (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| {
            (crc << 1) ^ if crc & 0x8000 != 0 { 0x1021 } else { 0 }
        })
    })
}
