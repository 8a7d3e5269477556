//! The checksum of a block transfer (CiA 301 7.2.4.3.16).

use crc::{CRC_16_XMODEM, Crc};

/// x^16 + x^12 + x^5 + 1, which is 0x1021, from an initial value of 0.
const TABLE: Crc<u16> = Crc::<u16>::new(&CRC_16_XMODEM);

/// The checksum of the bytes so far. A copy of it is a point to go on from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Crc16(u16);

impl Crc16 {
    /// Before the first byte.
    pub(crate) const START: Crc16 = Crc16(0);

    /// Goes on with `bytes`.
    #[inline]
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        let mut digest = TABLE.digest_with_initial(self.0);
        match bytes.first_chunk::<7>() {
            // A whole segment, whose loop the compiler unrolls.
            Some(segment) if bytes.len() == 7 => digest.update(segment),
            _ => digest.update(bytes),
        }
        self.0 = digest.finalize();
    }

    /// The checksum.
    #[inline]
    pub(crate) fn get(self) -> u16 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CiA 301 7.2.4.3.16 gives 0x31C3 for "123456789".
    #[test]
    fn the_standards_example_whole_and_in_pieces() {
        let text = b"123456789";
        for cut in 0..=text.len() {
            let mut crc = Crc16::default();
            crc.update(&text[..cut]);
            crc.update(&text[cut..]);
            assert_eq!(crc.get(), 0x31C3, "cut at {cut}");
        }
        assert_eq!(Crc16::default().get(), 0);
    }
}
