//! The other end of the wire: a client that is written from CiA 301 7.2.4.3 alone, and dialogues of
//! frames in hexadecimal.

use can::{ExtendedId, Frame, StandardId};
use canopen::{Abort, Address, Device};

use crate::harness::{Bench, FULL, Streams};

/// Texts and streams of the full device.
pub(crate) const TEXT: Address = Address::new(0x2010, 1);
pub(crate) const LONGEST_TEXT: Address = Address::new(0x2010, 3);
pub(crate) const OCTETS: Address = Address::new(0x2011, 1);
pub(crate) const STREAM: Address = Address::new(0x2020, 0);
pub(crate) const WIDE: Address = Address::new(0x2000, 9);

/// A client of one server of a node on a bench.
pub(crate) struct Master {
    pub(crate) bench: Bench<Streams>,
    /// COB-IDs, bit 29 set for 29 bits.
    pub(crate) request: u32,
    pub(crate) reply: u32,
}

impl Master {
    pub(crate) fn new() -> Master {
        Master::of(&FULL, Streams::default())
    }

    pub(crate) fn of(device: &'static Device, owner: Streams) -> Master {
        Master {
            bench: Bench::with(device, owner),
            request: 0x605,
            reply: 0x585,
        }
    }

    /// Its streams read as `contents`.
    pub(crate) fn reading(contents: &[u8]) -> Master {
        Master::of(&FULL, Streams::of(contents))
    }

    /// Sends a frame and gives the answers, which are this server's and have eight bytes.
    pub(crate) fn send(&mut self, data: &[u8]) -> Vec<[u8; 8]> {
        let frame = frame(self.request, data);
        self.hand_over(frame);
        self.answers()
    }

    /// Hands a frame over without fetching what the node sends.
    pub(crate) fn hand_over(&mut self, frame: Frame) {
        let bench = &mut self.bench;
        bench.events = bench.node.receive(&frame, bench.now, &mut bench.owner);
    }

    /// Waits and gives the answers.
    pub(crate) fn after_ms(&mut self, ms: u64) -> Vec<[u8; 8]> {
        let bench = &mut self.bench;
        bench.now = bench.now.plus_ms(ms);
        bench.events = bench.node.poll(bench.now, &mut bench.owner);
        self.answers()
    }

    /// The owner answers what it had postponed.
    pub(crate) fn complete(&mut self, result: Result<(), Abort>) -> Vec<[u8; 8]> {
        let now = self.bench.now;
        self.bench.node.complete(result, now);
        self.answers()
    }

    pub(crate) fn answers(&mut self) -> Vec<[u8; 8]> {
        let frames = self.bench.frames();
        frames.iter().map(|frame| self.answer(frame)).collect()
    }

    fn answer(&self, answer: &Frame) -> [u8; 8] {
        assert_eq!(answer.key(), frame(self.reply, &[]).key(), "{answer}");
        assert_eq!(answer.len(), 8, "{answer}");
        answer.bytes()
    }

    /// Sends a frame that is answered by exactly one.
    pub(crate) fn ask(&mut self, data: &[u8]) -> [u8; 8] {
        match self.send(data)[..] {
            [answer] => answer,
            ref other => panic!("{data:02X?}: {other:02X?}"),
        }
    }

    /// Holds a dialogue: a line of `>` is sent, the lines of `<` after it are exactly what comes
    /// back, `~` and milliseconds wait. What stands behind `;` is a remark.
    #[track_caller]
    pub(crate) fn play(&mut self, dialogue: &str) {
        let mut waiting: Vec<[u8; 8]> = Vec::new();
        for line in dialogue.lines() {
            let line = line.split(';').next().unwrap_or("").trim();
            if line.is_empty() {
                continue;
            }
            let (mark, rest) = line.split_at(1);
            if mark == "<" {
                assert!(!waiting.is_empty(), "silence instead of {line}");
                let answer = waiting.remove(0);
                let answer: Vec<String> = answer.iter().map(|b| format!("{b:02X}")).collect();
                assert_eq!(answer.join(" "), rest.trim(), "in {dialogue}");
                continue;
            }
            assert!(waiting.is_empty(), "{waiting:02X?} before {line}");
            waiting = match mark {
                ">" => self.send(&hex(rest)),
                "~" => self.after_ms(rest.trim().parse().expect("milliseconds")),
                other => panic!("{other} is no mark"),
            };
        }
        assert!(waiting.is_empty(), "{waiting:02X?} at the end");
    }

    /// That the server serves as if nothing had been.
    #[track_caller]
    pub(crate) fn is_usable(&mut self) {
        self.play(
            "> 40 01 20 00 00 00 00 00
             < 4B 01 20 00 34 12 00 00
             > 2F 0B 20 00 07 00 00 00
             < 60 0B 20 00 00 00 00 00
             > 21 00 20 09 08 00 00 00
             < 60 00 20 09 00 00 00 00
             > 00 01 02 03 04 05 06 07
             < 20 00 00 00 00 00 00 00
             > 1D 08 00 00 00 00 00 00
             < 30 00 00 00 00 00 00 00",
        );
        assert!(self.bench.owner.is_balanced());
    }

    /// Uploads an object by segments or expedited, in whatever form the server chooses.
    ///
    /// # Errors
    /// The abort code.
    #[track_caller]
    pub(crate) fn upload(&mut self, object: Address) -> Result<Vec<u8>, u32> {
        let answer = self.ask(&initiate(0x40, object, 0));
        assert_eq!(answer[1..4], initiate(0, object, 0)[1..4]);
        if answer[0] == 0x80 {
            return Err(number(answer));
        }
        self.take_segments(answer)
    }

    /// The rest of an upload whose initiate response has come.
    #[track_caller]
    pub(crate) fn take_segments(&mut self, answer: [u8; 8]) -> Result<Vec<u8>, u32> {
        let size = match answer[0] {
            0x43 | 0x47 | 0x4B | 0x4F => {
                let size = 4 - usize::from(answer[0] >> 2 & 3);
                assert!(answer[4 + size..].iter().all(|byte| *byte == 0));
                return Ok(answer[4..4 + size].to_vec());
            }
            0x41 => Some(number(answer) as usize),
            0x40 => {
                assert_eq!(number(answer), 0);
                None
            }
            other => panic!("upload response {other:02X}"),
        };
        let mut data = Vec::new();
        for toggle in [0x00, 0x10].into_iter().cycle() {
            let answer = self.ask(&[0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            if answer[0] == 0x80 {
                return Err(number(answer));
            }
            assert_eq!(answer[0] & 0xF0, toggle, "segment {answer:02X?}");
            let count = 7 - usize::from(answer[0] >> 1 & 7);
            assert!(answer[1 + count..].iter().all(|byte| *byte == 0));
            data.extend_from_slice(&answer[1..1 + count]);
            if answer[0] & 1 != 0 {
                break;
            }
            assert_eq!(count, 7, "a segment before the last is full");
        }
        assert!(size.is_none_or(|size| size == data.len()));
        Ok(data)
    }

    /// Downloads an object in segments.
    ///
    /// # Errors
    /// The abort code.
    #[track_caller]
    pub(crate) fn download(
        &mut self,
        object: Address,
        data: &[u8],
        say_size: bool,
    ) -> Result<(), u32> {
        let (command, size) = match say_size {
            true => (0x21, data.len() as u32),
            false => (0x20, 0),
        };
        let answer = self.ask(&initiate(command, object, size));
        acknowledged(answer, initiate(0x60, object, 0))?;
        self.send_segments(data)
    }

    /// The segments of a download whose initiate has been acknowledged.
    #[track_caller]
    pub(crate) fn send_segments(&mut self, data: &[u8]) -> Result<(), u32> {
        let last = data.len().saturating_sub(1) / 7;
        for (n, toggle) in (0..=last).zip([0x00, 0x10].into_iter().cycle()) {
            let part = &data[7 * n..data.len().min(7 * n + 7)];
            let command = toggle | (7 - part.len() as u8) << 1 | u8::from(n == last);
            let answer = self.ask(&segment(command, part));
            acknowledged(answer, [0x20 | toggle, 0, 0, 0, 0, 0, 0, 0])?;
        }
        Ok(())
    }
}

/// The frame that a COB-ID carries.
pub(crate) fn frame(cob_id: u32, data: &[u8]) -> Frame {
    match cob_id >> 29 {
        0 => Frame::data_frame(StandardId::new(cob_id as u16).expect("11 bits"), data),
        _ => {
            let id = ExtendedId::new(cob_id & 0x1FFF_FFFF).expect("29 bits");
            Frame::data_frame(id, data)
        }
    }
    .expect("at most eight bytes")
}

/// A frame with the multiplexer of an object and a number behind it.
pub(crate) fn initiate(command: u8, object: Address, number: u32) -> [u8; 8] {
    let [low, high] = object.index.to_le_bytes();
    let [d0, d1, d2, d3] = number.to_le_bytes();
    [command, low, high, object.sub, d0, d1, d2, d3]
}

/// A command and up to seven bytes.
pub(crate) fn segment(command: u8, data: &[u8]) -> [u8; 8] {
    let mut frame = [command, 0, 0, 0, 0, 0, 0, 0];
    frame[1..1 + data.len()].copy_from_slice(data);
    frame
}

/// The last four bytes.
pub(crate) fn number(answer: [u8; 8]) -> u32 {
    u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]])
}

/// The abort's frame.
pub(crate) fn abort(object: Address, code: Abort) -> [u8; 8] {
    initiate(0x80, object, code.0)
}

fn acknowledged(answer: [u8; 8], expected: [u8; 8]) -> Result<(), u32> {
    if answer[0] == 0x80 {
        return Err(number(answer));
    }
    assert_eq!(answer, expected);
    Ok(())
}

/// Bytes from hexadecimal.
pub(crate) fn hex(text: &str) -> Vec<u8> {
    let byte = |byte| u8::from_str_radix(byte, 16).expect("hexadecimal");
    text.split_whitespace().map(byte).collect()
}

/// `count` bytes of which no seven are like the next seven.
pub(crate) fn bytes(count: usize) -> Vec<u8> {
    (0..count)
        .map(|n| (n as u8).wrapping_mul(37) ^ (n / 256) as u8 ^ 0x5A)
        .collect()
}

/// Characters, for texts.
pub(crate) fn characters(count: usize) -> Vec<u8> {
    (0..count)
        .map(|n| b'a' + ((n + n / 7) % 26) as u8)
        .collect()
}

/// The checksum as CiA 301 7.2.4.3.16 describes it, bit by bit: x^16 + x^12 + x^5 + 1 from 0.
pub(crate) fn checksum(bytes: &[u8]) -> u16 {
    let mut crc: u16 = 0;
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
