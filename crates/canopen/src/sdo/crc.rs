//! The checksum of block transfers (CiA 301 7.2.4.3.16): polynomial 0x1021, begun with 0.

use crc::{CRC_16_XMODEM, Crc, Table};

const CRC: Crc<u16, Table<1>> = Crc::<u16, Table<1>>::new(&CRC_16_XMODEM);

/// The checksum after `bytes`, `so_far` being that of all before; 0 at the beginning.
pub(crate) fn update(so_far: u16, bytes: &[u8]) -> u16 {
    let mut digest = CRC.digest_with_initial(so_far);
    digest.update(bytes);
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of CiA 301 7.2.4.3.16, in one piece and in any two.
    #[test]
    fn the_standard_s_example() {
        let text = b"123456789";
        assert_eq!(update(0, text), 0x31C3);
        for cut in 0..=text.len() {
            let (head, tail) = text.split_at(cut);
            assert_eq!(update(update(0, head), tail), 0x31C3);
        }
    }
}
