//! CRC-32 over bytes that come piece by piece.

use crc::{CRC_32_ISO_HDLC, Crc};

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// CRC-32 (ISO HDLC) of the bytes seen so far; it may be kept and continued.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Checksum(u32);

impl Checksum {
    /// Of no bytes.
    pub const EMPTY: Checksum = Checksum(0);

    /// Of `bytes`.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Checksum {
        Checksum::EMPTY.and(bytes)
    }

    /// Of the bytes before and `bytes`.
    #[must_use]
    pub fn and(self, bytes: &[u8]) -> Checksum {
        // The register behind a finished value: the final inversion taken back, and in the order of
        // bits in which the algorithm states its initial value.
        let register = (!self.0).reverse_bits();
        let mut digest = CRC.digest_with_initial(register);
        digest.update(bytes);
        Checksum(digest.finalize())
    }

    /// The CRC-32.
    #[must_use]
    pub const fn value(self) -> u32 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value that the catalogue of CRCs states, in every way to cut it in three.
    #[test]
    fn pieces_give_what_the_whole_gives() {
        let text = b"123456789";
        assert_eq!(Checksum::of(text).value(), 0xCBF4_3926);
        for first in 0..=text.len() {
            for second in first..=text.len() {
                let sum = Checksum::EMPTY
                    .and(&text[..first])
                    .and(&text[first..second])
                    .and(&text[second..]);
                assert_eq!(sum.value(), 0xCBF4_3926);
            }
        }
    }
}
