//! A model of an SDO server, written from CiA 301 7.2.4 and not from the client: one object of any
//! length, the three protocols, and what servers may differ in.

use can::{Frame, StandardId};

/// Identifier of the model's answers, of node 5.
pub const ANSWERS: u16 = 0x585;

/// What servers may differ in.
#[derive(Clone, Copy, Debug)]
pub struct Traits {
    /// Indicates sizes of uploads, those of expedited ones included.
    pub sizes: bool,
    /// Offers a checksum for block transfers.
    pub crc: bool,
    /// Knows block transfers.
    pub blocks: bool,
    /// Sizes of the blocks of a download, in turn.
    pub block_sizes: [u8; 2],
    /// Uses another protocol for block uploads if the client allows it.
    pub switches: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Idle,
    Upload { toggle: u8, offset: usize },
    Download { toggle: u8 },
    BlockUploadBegun,
    BlockUpload { offset: usize, sent: u8 },
    BlockUploadEnded,
    BlockDownload { good: u8, block: u8 },
    BlockDownloadComplete { last: u8 },
}

/// A server of one object.
#[derive(Clone, Debug)]
pub struct Server {
    traits: Traits,
    object: [u8; 3],
    /// What uploads read.
    pub value: Vec<u8>,
    /// What downloads wrote, once they were complete.
    pub written: Option<Vec<u8>>,
    state: State,
    /// Answers that have not left yet.
    pub out: std::collections::VecDeque<Frame>,
    incoming: Vec<u8>,
    announced: Option<u32>,
    with_crc: bool,
    block_size: u8,
    turn: usize,
    before: Option<Frame>,
}

/// x^16 + x^12 + x^5 + 1, bit by bit.
pub fn crc16(bytes: &[u8]) -> u16 {
    let mut crc = 0u16;
    for byte in bytes {
        crc ^= u16::from(*byte) << 8;
        for _ in 0..8 {
            let carry = crc & 0x8000 != 0;
            crc <<= 1;
            if carry {
                crc ^= 0x1021;
            }
        }
    }
    crc
}

impl Server {
    /// A server of the object 0x2345,6.
    pub fn new(traits: Traits, value: Vec<u8>) -> Server {
        Server {
            traits,
            object: [0x45, 0x23, 6],
            value,
            written: None,
            state: State::Idle,
            out: std::collections::VecDeque::new(),
            incoming: Vec::new(),
            announced: None,
            with_crc: false,
            block_size: 0,
            turn: 0,
            before: None,
        }
    }

    fn send(&mut self, bytes: [u8; 8]) {
        let id = StandardId::new(ANSWERS).expect("an identifier");
        let frame = Frame::data_frame(id, &bytes).expect("eight bytes");
        self.out.push_back(frame);
    }

    fn answer(&mut self, command: u8, data: u32) {
        let [index_low, index_high, sub] = self.object;
        let [d0, d1, d2, d3] = data.to_le_bytes();
        self.send([command, index_low, index_high, sub, d0, d1, d2, d3]);
    }

    fn abort(&mut self, code: u32) {
        self.state = State::Idle;
        self.answer(0x80, code);
    }

    /// Nothing has come for long: a transfer that runs is given up.
    pub fn time_out(&mut self) {
        if self.state != State::Idle {
            self.state = State::Idle;
            self.before = None;
        }
    }

    /// Takes a request, or what is left of one.
    pub fn receive(&mut self, frame: &Frame) {
        let repeated = self.before.replace(*frame) == Some(*frame);
        let bytes = frame.bytes();
        let [command, a, b, ..] = bytes;
        // Confirmations that come while a block is on its way out mean nothing, and a frame that
        // is doubled on the wire is there before the answer to it has left.
        if repeated && !self.out.is_empty() {
            return;
        }
        if command == 0x80 {
            self.state = State::Idle;
            self.out.clear();
            return;
        }
        match self.state {
            State::BlockDownload { good, block } => return self.segment(bytes, good, block),
            State::BlockDownloadComplete { last } if repeated && command == last => return,
            _ => {}
        }
        match (command >> 5, self.state) {
            (2, _) => self.begin_upload(),
            (1, _) => self.begin_download(bytes),
            (5, _) if command & 3 == 0 => self.begin_block_upload(bytes),
            (6, _) if command & 1 == 0 => self.begin_block_download(bytes),
            (3, State::Upload { toggle, offset }) => {
                if command & 0x10 != toggle {
                    return self.abort(0x0503_0000);
                }
                let chunk = &self.value[offset..];
                let used = chunk.len().min(7);
                let last = chunk.len() <= 7;
                let mut answer = [0; 8];
                answer[0] = toggle | ((7 - used) as u8) << 1 | u8::from(last);
                answer[1..=used].copy_from_slice(&chunk[..used]);
                self.state = match last {
                    true => State::Idle,
                    false => State::Upload {
                        toggle: toggle ^ 0x10,
                        offset: offset + used,
                    },
                };
                self.send(answer);
            }
            (0, State::Download { toggle }) => {
                if command & 0x10 != toggle {
                    return self.abort(0x0503_0000);
                }
                let used = 7 - usize::from(command >> 1 & 7);
                self.incoming.extend_from_slice(&bytes[1..=used]);
                self.state = State::Download {
                    toggle: toggle ^ 0x10,
                };
                if command & 1 != 0 && !self.commit() {
                    return;
                }
                self.send([0x20 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            }
            (5, State::BlockUploadBegun) if command & 3 == 3 => self.send_block(0),
            (5, State::BlockUpload { offset, sent }) if command & 3 == 2 => {
                if a > sent {
                    return self.abort(0x0504_0003);
                }
                if !(1..=127).contains(&b) {
                    return self.abort(0x0504_0002);
                }
                self.block_size = b;
                let offset = offset + 7 * usize::from(a);
                if offset < self.value.len() || (a == 0 && self.value.is_empty()) {
                    return self.send_block(offset);
                }
                let unused = match (self.value.len(), self.value.len() % 7) {
                    (0, _) => 7,
                    (_, 0) => 0,
                    (_, used) => 7 - used as u8,
                };
                let crc = if self.with_crc { crc16(&self.value) } else { 0 };
                let [low, high] = crc.to_le_bytes();
                self.state = State::BlockUploadEnded;
                self.send([0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0]);
            }
            (5, State::BlockUploadEnded) if command & 3 == 1 => self.state = State::Idle,
            (6, State::BlockDownloadComplete { .. }) => {
                let used = 7 - usize::from(command >> 2 & 7);
                let len = (self.incoming.len() - 7) + used;
                self.incoming.truncate(len);
                if self.with_crc && crc16(&self.incoming) != u16::from_le_bytes([a, b]) {
                    return self.abort(0x0504_0004);
                }
                if self.commit() {
                    self.send([0xA1, 0, 0, 0, 0, 0, 0, 0]);
                }
            }
            _ => self.abort(0x0504_0001),
        }
    }

    fn begin_upload(&mut self) {
        let (len, sized) = (self.value.len(), self.traits.sizes);
        let mut data = [0; 4];
        if len <= 4 && (len == 4 || sized) && len > 0 {
            data[..len].copy_from_slice(&self.value);
            self.state = State::Idle;
            let command = match sized {
                true => 0x43 | ((4 - len) as u8) << 2,
                false => 0x42,
            };
            return self.answer(command, u32::from_le_bytes(data));
        }
        self.state = State::Upload {
            toggle: 0,
            offset: 0,
        };
        self.answer(0x40 | u8::from(sized), if sized { len as u32 } else { 0 });
    }

    fn begin_download(&mut self, bytes: [u8; 8]) {
        let [command, _, _, _, data @ ..] = bytes;
        self.incoming.clear();
        self.announced = None;
        if command & 2 == 0 {
            self.announced = (command & 1 != 0).then_some(u32::from_le_bytes(data));
            self.state = State::Download { toggle: 0 };
            return self.answer(0x60, 0);
        }
        let used = match command & 1 {
            0 => 4,
            _ => 4 - usize::from(command >> 2 & 3),
        };
        self.incoming.extend_from_slice(&data[..used]);
        self.commit();
        self.answer(0x60, 0);
    }

    /// The download is complete; false if it is not what was announced.
    fn commit(&mut self) -> bool {
        self.state = State::Idle;
        if let Some(announced) = self.announced
            && announced as usize != self.incoming.len()
        {
            self.abort(0x0607_0010);
            return false;
        }
        self.written = Some(std::mem::take(&mut self.incoming));
        true
    }

    fn begin_block_upload(&mut self, bytes: [u8; 8]) {
        let [command, _, _, _, size, threshold, ..] = bytes;
        let len = self.value.len();
        if !self.traits.blocks {
            return self.abort(0x0504_0001);
        }
        if !(1..=127).contains(&size) {
            return self.abort(0x0504_0002);
        }
        if self.traits.switches && threshold > 0 && len <= usize::from(threshold) {
            return self.begin_upload();
        }
        self.block_size = size;
        self.with_crc = self.traits.crc && command & 4 != 0;
        self.state = State::BlockUploadBegun;
        let sized = self.traits.sizes;
        let flags = u8::from(self.traits.crc) << 2 | u8::from(sized) << 1;
        self.answer(0xC0 | flags, if sized { len as u32 } else { 0 });
    }

    fn send_block(&mut self, offset: usize) {
        let value = self.value.clone();
        let rest = value.get(offset..).unwrap_or(&[]);
        let count = rest
            .len()
            .div_ceil(7)
            .clamp(1, usize::from(self.block_size));
        for number in 0..count {
            let chunk = rest.get(7 * number..).unwrap_or(&[]);
            let used = chunk.len().min(7);
            let mut segment = [0; 8];
            segment[0] = (number + 1) as u8 | if chunk.len() <= 7 { 0x80 } else { 0 };
            segment[1..=used].copy_from_slice(&chunk[..used]);
            self.send(segment);
        }
        self.state = State::BlockUpload {
            offset,
            sent: count as u8,
        };
    }

    fn begin_block_download(&mut self, bytes: [u8; 8]) {
        let [command, _, _, _, data @ ..] = bytes;
        if !self.traits.blocks {
            return self.abort(0x0504_0001);
        }
        self.incoming.clear();
        self.announced = (command & 2 != 0).then_some(u32::from_le_bytes(data));
        self.with_crc = self.traits.crc && command & 4 != 0;
        let block = self.next_block_size();
        self.state = State::BlockDownload { good: 0, block };
        self.answer(0xA0 | u8::from(self.traits.crc) << 2, u32::from(block));
    }

    fn next_block_size(&mut self) -> u8 {
        self.turn += 1;
        self.traits.block_sizes[self.turn % 2].clamp(1, 127)
    }

    fn segment(&mut self, bytes: [u8; 8], good: u8, block: u8) {
        let [first, data @ ..] = bytes;
        let (number, last) = (first & 0x7F, first & 0x80 != 0);
        // Initiating anew ends the transfer; its first byte would be a number out of the block.
        if number == 0 || number > block {
            return match first >> 5 {
                2 => self.begin_upload(),
                1 => self.begin_download(bytes),
                5 if first & 3 == 0 => self.begin_block_upload(bytes),
                6 if first & 1 == 0 => self.begin_block_download(bytes),
                _ => self.abort(0x0504_0003),
            };
        }
        let mut good = good;
        let is_next = number == good + 1;
        if is_next {
            self.incoming.extend_from_slice(&data);
            good = number;
        }
        if !last && number != block {
            self.state = State::BlockDownload { good, block };
            return;
        }
        let next = self.next_block_size();
        self.state = match last && is_next {
            true => State::BlockDownloadComplete { last: first },
            false => State::BlockDownload {
                good: 0,
                block: next,
            },
        };
        self.send([0xA2, good, next, 0, 0, 0, 0, 0]);
    }
}
