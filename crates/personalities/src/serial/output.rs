//! What waits to be sent.

use super::session::MOST_VALUES;

/// Bytes that can wait.
const ROOM: usize = 256;
/// The longest answer and the echo of what asked for it: a name of five characters, numbers of eleven
/// with what stands between them, two ends of lines.
const LONGEST_ANSWER: usize = 5 + MOST_VALUES * 12 + 2;

/// Bytes in the order in which they are sent. What does not fit is lost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Output {
    bytes: [u8; ROOM],
    first: u16,
    length: u16,
}

impl Output {
    pub(crate) const EMPTY: Output = Output {
        bytes: [0; ROOM],
        first: 0,
        length: 0,
    };

    /// Whether any answer fits.
    pub(crate) fn has_room(&self) -> bool {
        usize::from(self.length) + LONGEST_ANSWER <= ROOM
    }

    pub(crate) fn push(&mut self, byte: u8) {
        let at = (usize::from(self.first) + usize::from(self.length)) % ROOM;
        if usize::from(self.length) < ROOM
            && let Some(place) = self.bytes.get_mut(at)
        {
            *place = byte;
            self.length += 1;
        }
    }

    pub(crate) fn text(&mut self, text: &[u8]) {
        for byte in text {
            self.push(*byte);
        }
    }

    pub(crate) fn number(&mut self, value: i64) {
        if value < 0 {
            self.push(b'-');
        }
        let mut digits = [0; 20];
        let mut rest = value.unsigned_abs();
        let mut count = 0;
        for place in &mut digits {
            *place = b'0' + (rest % 10) as u8;
            count += 1;
            rest /= 10;
            if rest == 0 {
                break;
            }
        }
        for digit in digits.iter().take(count).rev() {
            self.push(*digit);
        }
    }

    pub(crate) fn pop(&mut self) -> Option<u8> {
        let left = self.length.checked_sub(1)?;
        let byte = self.bytes.get(usize::from(self.first)).copied()?;
        self.first = (self.first + 1) % ROOM as u16;
        self.length = left;
        Some(byte)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.length == 0
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::{String, ToString};
    use std::vec::Vec;

    use super::*;

    #[test]
    fn numbers_are_written_in_full() {
        for value in [
            0,
            7,
            -1,
            20_000,
            i64::from(i32::MIN),
            i64::from(u32::MAX),
            i64::MIN,
        ] {
            let mut output = Output::EMPTY;
            output.number(value);
            let text: Vec<u8> = core::iter::from_fn(|| output.pop()).collect();
            assert_eq!(String::from_utf8(text).unwrap(), value.to_string());
        }
    }

    #[test]
    fn bytes_come_out_as_they_went_in_however_often_round() {
        let mut output = Output::EMPTY;
        let mut expected = 0_u8;
        for byte in 0..2_000 {
            output.push((byte % 251) as u8);
            if byte % 3 != 0 || byte > 300 {
                assert_eq!(output.pop(), Some(expected));
                expected = (expected + 1) % 251;
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_lost() {
        let mut output = Output::EMPTY;
        output.text(&[1; ROOM + 5]);
        assert!(!output.has_room());
        assert_eq!(core::iter::from_fn(|| output.pop()).count(), ROOM);
        assert!(output.is_empty() && output.has_room());
    }
}
