//! How long a frame occupies the wire, and which of two frames wins it.
//!
//! Both answers come from the bit string that a controller really sends (ISO 11898-1, classical
//! frame formats), not from an estimate: the CRC is computed and the stuff bits are counted.
//!
//! ```text
//! 11 bit  SOF id[10..0] RTR IDE=0 r0 DLC[3..0] data CRC[14..0]                            stuffed
//! 29 bit  SOF id[28..18] SRR=1 IDE=1 id[17..0] RTR r1 r0 DLC[3..0] data CRC[14..0]        stuffed
//! both    CRC delimiter, ACK slot, ACK delimiter, 7 × EOF                             not stuffed
//! ```

use crate::Frame;

/// Recessive bits that separate two frames (intermission), in bit times.
pub const INTERFRAME_BITS: u16 = 3;

/// CRC delimiter, ACK slot, ACK delimiter and seven bits of end of frame: never stuffed.
const TAIL_BITS: u16 = 10;

/// Generator polynomial of the classical CRC, x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1.
const POLYNOMIAL: u16 = 0x4599;

/// CRC of one byte, for the byte-wise computation.
const CRC: [u16; 256] = crc_table();

/// Stuffing by bytes: from the run before the byte (see [`run`]) and the byte, the run after it
/// (bits 0–2) and the number of stuff bits put in (bits 3 and up, at most 2).
const STUFF: [[u8; 256]; 8] = stuff_table();

impl Frame {
    /// Bit times from start of frame to the last bit of end of frame, stuff bits included.
    #[inline]
    pub fn frame_bits(&self) -> u16 {
        let (bits, count) = self.stuffed_part();
        count + stuff_bits(bits, count) + TAIL_BITS
    }

    /// Bit times until the next frame may start: [`Frame::frame_bits`] and [`INTERFRAME_BITS`].
    ///
    /// With an 11-bit identifier and *n* data bytes this lies between 47 + 8*n* and 55 + 10*n*,
    /// with a 29-bit one between 67 + 8*n* and 80 + 10*n*.
    #[inline]
    pub fn wire_bits(&self) -> u16 {
        self.frame_bits() + INTERFRAME_BITS
    }

    /// The frame's rank in arbitration: the smaller key wins the bus.
    ///
    /// The key is the arbitration field as sent, first bit highest (0 is dominant): eleven bits of
    /// base identifier, RTR or SRR, IDE, and of a 29-bit frame the rest of the identifier and RTR.
    /// Equal keys mean that arbitration cannot tell the two frames apart.
    #[inline]
    pub fn arbitration_key(&self) -> u32 {
        let id = self.raw_id();
        let remote = u32::from(self.is_remote());
        if self.is_extended() {
            const SRR_AND_IDE: u32 = 0b11 << 19;
            (id >> 18) << 21 | SRR_AND_IDE | (id & 0x3_FFFF) << 1 | remote
        } else {
            id << 21 | remote << 20
        }
    }

    /// Start of frame to the end of the CRC before stuffing, right-aligned, and how many bits.
    pub(crate) fn stuffed_part(&self) -> (u128, u16) {
        let remote = u128::from(self.is_remote());
        let length = u128::from(self.len());
        let id = u128::from(self.raw_id());
        let (head, head_bits) = if self.is_extended() {
            const SRR_AND_IDE: u128 = 0b11 << 25;
            (
                (id >> 18) << 27 | SRR_AND_IDE | (id & 0x3_FFFF) << 7 | remote << 6 | length,
                39,
            )
        } else {
            (id << 7 | remote << 6 | length, 19)
        };
        let bytes = if self.is_remote() {
            0
        } else {
            u16::from(self.len())
        };
        // Bytes past the length are zero and fall out at the bottom; `bytes` is at most 8.
        let data = u128::from(u64::from_be_bytes(self.bytes())) >> (64 - 8 * bytes);
        let covered = head << (8 * bytes) | data;
        let covered_bits = head_bits + 8 * bytes;
        (
            covered << 15 | u128::from(crc(covered, covered_bits)),
            covered_bits + 15,
        )
    }
}

/// CRC-15 of the lowest `count` bits. Zeros in front do not change it, so whole bytes will do.
fn crc(bits: u128, count: u16) -> u16 {
    let mut crc = 0_u16;
    for byte in last_bytes(bits, count) {
        let index = ((crc >> 7) as u8) ^ byte;
        crc = (crc << 8) & 0x7FFF ^ CRC.get(usize::from(index)).copied().unwrap_or(0);
    }
    crc
}

/// Stuff bits that go into the lowest `count` bits, one after the last bit included.
fn stuff_bits(bits: u128, count: u16) -> u16 {
    // Fill the first byte with alternating bits that end recessive: they need no stuffing and
    // look to the start of frame, which is dominant, like an idle bus.
    const ALTERNATING: u128 = 0x5555_5555_5555_5555_5555_5555_5555_5555;
    let bits = ALTERNATING << count | bits;
    let mut state = run(1, 1);
    let mut stuffed = 0;
    for byte in last_bytes(bits, count) {
        let row = STUFF.get(usize::from(state & 7));
        let entry = row
            .and_then(|row| row.get(usize::from(byte)))
            .copied()
            .unwrap_or(0);
        state = entry & 7;
        stuffed += u16::from(entry >> 3);
    }
    stuffed
}

/// The bytes, first one first, that hold the lowest `count` bits.
fn last_bytes(bits: u128, count: u16) -> impl Iterator<Item = u8> {
    let skip = 16 - usize::from(count.div_ceil(8));
    bits.to_be_bytes().into_iter().skip(skip)
}

/// A run of `length` (1 to 4) equal bits `value`; at five the stuff bit starts a new run.
const fn run(value: u8, length: u8) -> u8 {
    value << 2 | (length - 1)
}

#[allow(clippy::indexing_slicing, reason = "evaluated at compile time")]
const fn crc_table() -> [u16; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = (byte as u16) << 7;
        let mut bit = 0;
        while bit < 8 {
            let carry = crc & 0x4000 != 0;
            crc = (crc << 1) & 0x7FFF;
            if carry {
                crc ^= POLYNOMIAL;
            }
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
}

#[allow(clippy::indexing_slicing, reason = "evaluated at compile time")]
const fn stuff_table() -> [[u8; 256]; 8] {
    let mut table = [[0; 256]; 8];
    let mut state = 0;
    while state < 8 {
        let mut byte = 0;
        while byte < 256 {
            let mut value = state as u8 >> 2;
            let mut length = (state as u8 & 3) + 1;
            let mut stuffed = 0;
            let mut bit = 8;
            while bit > 0 {
                bit -= 1;
                let next = (byte >> bit) as u8 & 1;
                length = if next == value { length + 1 } else { 1 };
                value = next;
                if length == 5 {
                    value = 1 - value;
                    length = 1;
                    stuffed += 1;
                }
            }
            table[state][byte] = stuffed << 3 | run(value, length);
            byte += 1;
        }
        state += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::{ExtendedId, StandardId};
    use proptest::prelude::*;
    use std::vec::Vec;

    fn standard(id: u16, data: &[u8]) -> Frame {
        Frame::data_frame(StandardId::new(id).unwrap(), data).unwrap()
    }

    fn extended(id: u32, data: &[u8]) -> Frame {
        Frame::data_frame(ExtendedId::new(id).unwrap(), data).unwrap()
    }

    /// NMT-like frame with identifier 0 and no data. By hand: SOF, identifier, RTR, IDE, r0 and
    /// DLC are 19 dominant bits; the CRC of zeros from a zero register is zero: 34 dominant bits.
    /// After five comes a recessive stuff bit, after each further five another one (the stuff bit
    /// is recessive, so the count starts anew): 34 / 5 = 6. And 34 + 6 + 10 = 50, with
    /// intermission 53.
    #[test]
    fn all_dominant_by_hand() {
        let frame = standard(0, &[]);
        assert_eq!(frame.stuffed_part(), (0, 34));
        assert_eq!(frame.frame_bits(), 50);
        assert_eq!(frame.wire_bits(), 53);
    }

    /// SYNC, identifier 080h. SOF to DLC: 0 00010000000 0 0 0 0000, of value 80h << 7 = 4000h.
    /// That is x^14, and the CRC is x^14 · x^15 mod g = x^29 mod g. By hand, with
    /// g = x^15+x^14+x^10+x^8+x^7+x^4+x^3+1 (C599h with its leading bit), doubling 15 times from
    /// x^14 = 4000h, each time reducing by 4599h when bit 14 was set:
    /// 4599 4EAB 58CF 7407 2D97 5B2E 73C5 2213 4426 4DD5 5E33 79FF 3667 6CCE 1C05.
    /// So the CRC is 1C05h = 001110000000101. Behind the header 0000 1 00000000000000 this gives,
    /// with the stuff bits in brackets, 0000 1 00000(1)00000(1)00000(1)0 111 00000(1)00 1 0 1:
    /// three in the run of sixteen, one in the run of seven, four in all.
    #[test]
    fn sync_by_hand() {
        let frame = standard(0x080, &[]);
        assert_eq!(frame.stuffed_part(), (0x4000 << 15 | 0x1C05, 34));
        assert_eq!(frame.frame_bits(), 34 + 4 + 10);
    }

    /// The published worst case (e.g. Davis et al. 2007) needs five equal bits, then groups of
    /// four that alternate, so that each stuff bit completes the next group. Checked on the
    /// counter itself, because no CRC fits the pattern for every length.
    #[test]
    fn worst_case_pattern_is_stuffed_every_four_bits() {
        for count in 5..=118_u16 {
            // Dominant five, then 1111 0000 1111 …
            let bits = (0..count).fold(0_u128, |bits, at| {
                let group = if at == 0 { 0 } else { (at - 1) / 4 };
                bits << 1 | u128::from(group % 2)
            });
            assert_eq!(stuff_bits(bits, count), (count - 1) / 4, "{count} bits");
        }
    }

    /// Without equal neighbours nothing is stuffed, however long the string.
    #[test]
    fn alternating_bits_are_not_stuffed() {
        for count in 1..=118_u16 {
            let bits = (0..count).fold(0_u128, |bits, at| bits << 1 | u128::from(at % 2));
            assert_eq!(stuff_bits(bits, count), 0);
        }
    }

    /// Five equal bits at the very end still get their stuff bit, before the CRC delimiter.
    #[test]
    fn stuff_bit_after_the_last_bit() {
        assert_eq!(stuff_bits(0b0101_00000, 9), 1);
        assert_eq!(stuff_bits(0b0101_0000, 8), 0);
    }

    #[test]
    fn a_remote_frame_carries_no_data_but_its_length() {
        let id = StandardId::new(0x701).unwrap();
        for len in 0..=8 {
            let frame = Frame::remote_frame(id, len).unwrap();
            assert_eq!(frame.wire_bits(), naive::wire_bits(&frame));
            assert!((47..=55).contains(&frame.wire_bits()));
        }
    }

    /// Base identifier, kind and width decide in this order.
    #[test]
    fn arbitration_by_hand() {
        let id = StandardId::new(0x100).unwrap();
        let ranked = [
            standard(0x0FF, &[0xFF; 8]),
            extended(0x0FF << 18 | 0x3_FFFF, &[]),
            standard(0x100, &[]),
            Frame::remote_frame(id, 0).unwrap(),
            extended(0x100 << 18, &[]),
            Frame::remote_frame(ExtendedId::new(0x100 << 18).unwrap(), 0).unwrap(),
            extended(0x100 << 18 | 1, &[]),
            standard(0x101, &[]),
        ];
        assert!(
            ranked
                .windows(2)
                .all(|pair| pair[0].arbitration_key() < pair[1].arbitration_key())
        );
    }

    /// The same rules once more, written out bit by bit and sharing nothing with the above.
    mod naive {
        use super::*;

        fn push(bits: &mut Vec<bool>, value: u32, count: u32) {
            (0..count)
                .rev()
                .for_each(|bit| bits.push(value >> bit & 1 == 1));
        }

        /// From start of frame up to and including RTR, IDE (11 bit) or RTR (29 bit).
        pub(super) fn arbitration_field(frame: &Frame) -> Vec<bool> {
            let mut bits = Vec::new();
            push(&mut bits, 0, 1);
            if frame.is_extended() {
                push(&mut bits, frame.raw_id() >> 18, 11);
                push(&mut bits, 0b11, 2);
                push(&mut bits, frame.raw_id(), 18);
                push(&mut bits, frame.is_remote().into(), 1);
            } else {
                push(&mut bits, frame.raw_id(), 11);
                push(&mut bits, frame.is_remote().into(), 1);
                push(&mut bits, 0, 1);
            }
            bits
        }

        pub(super) fn wire_bits(frame: &Frame) -> u16 {
            let mut bits = arbitration_field(frame);
            push(&mut bits, 0, if frame.is_extended() { 2 } else { 1 });
            push(&mut bits, frame.len().into(), 4);
            frame
                .data()
                .iter()
                .for_each(|byte| push(&mut bits, (*byte).into(), 8));
            // The register of the CAN specification, one bit at a time.
            let mut register = 0_u32;
            for bit in &bits {
                let feedback = *bit != (register >> 14 & 1 == 1);
                register = register << 1 & 0x7FFF;
                if feedback {
                    register ^= 0x4599;
                }
            }
            push(&mut bits, register, 15);
            let mut sent: Vec<bool> = Vec::new();
            for bit in bits {
                sent.push(bit);
                if let [.., a, b, c, d, e] = sent[..]
                    && [b, c, d, e] == [a; 4]
                {
                    sent.push(!bit);
                }
            }
            sent.len() as u16 + 1 + 2 + 7 + 3
        }
    }

    fn any_frame() -> impl Strategy<Value = Frame> {
        // Half of all bytes 00h or FFh: uniformly random ones are seldom stuffed.
        let byte = prop_oneof![Just(0_u8), Just(0xFF_u8), any::<u8>(), any::<u8>()];
        let data = prop::collection::vec(byte, 0..=8);
        (any::<u32>(), any::<bool>(), any::<bool>(), data).prop_map(|(id, wide, remote, data)| {
            let id: crate::Id = if wide {
                ExtendedId::new(id & 0x1FFF_FFFF).unwrap().into()
            } else {
                StandardId::new((id & 0x7FF) as u16).unwrap().into()
            };
            if remote {
                Frame::remote_frame(id, data.len() as u8).unwrap()
            } else {
                Frame::data_frame(id, &data).unwrap()
            }
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn length_equals_the_bit_by_bit_one(frame in any_frame()) {
            prop_assert_eq!(frame.wire_bits(), naive::wire_bits(&frame));
            prop_assert_eq!(frame.frame_bits() + 3, frame.wire_bits());
        }

        #[test]
        fn length_keeps_the_published_bounds(frame in any_frame()) {
            let bytes = frame.data().len() as u16;
            let bounds = if frame.is_extended() {
                67 + 8 * bytes..=80 + 10 * bytes
            } else {
                47 + 8 * bytes..=55 + 10 * bytes
            };
            prop_assert!(bounds.contains(&frame.wire_bits()));
        }

        /// On the wire the first differing bit decides, dominant (false) wins.
        #[test]
        fn arbitration_equals_the_bit_by_bit_one(a in any_frame(), b in any_frame(), same in any::<bool>()) {
            // Random identifiers nearly always differ in their first bits: share the base.
            let b = if same && a.is_extended() != b.is_extended() {
                let base = if a.is_extended() { a.raw_id() >> 18 } else { a.raw_id() };
                let id: crate::Id = if b.is_extended() {
                    ExtendedId::new(base << 18 | b.raw_id() & 0x3_FFFF).unwrap().into()
                } else {
                    StandardId::new(base as u16).unwrap().into()
                };
                if b.is_remote() { Frame::remote_frame(id, 0) } else { Frame::data_frame(id, &[]) }.unwrap()
            } else {
                b
            };
            let (x, y) = (naive::arbitration_field(&a), naive::arbitration_field(&b));
            let first = x.iter().zip(&y).find(|(x, y)| x != y).map(|(x, y)| x.cmp(y));
            let keys = a.arbitration_key().cmp(&b.arbitration_key());
            prop_assert_eq!(keys, first.unwrap_or(core::cmp::Ordering::Equal));
        }
    }
}
