//! A frame as its bits on the wire, for those who look at single bits. How long it is tells
//! [`Frame::frame_bits`] without all this.

use crate::Frame;

/// CRC delimiter, acknowledge slot and delimiter, seven bits of end of frame.
const TAIL_BITS: u16 = 10;

/// The bits of a frame from start of frame to end of frame, stuff bits included, as its transmitter
/// sends them: the acknowledge slot is recessive.
///
/// A bit is `false` when it is dominant, `true` when it is recessive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitStream {
    /// Bit 0 first, from the lowest bit on; at most 157 of them.
    words: [u64; 3],
    length: u16,
    /// Behind the last bit that takes part in arbitration.
    arbitration_end: u16,
}

impl Frame {
    /// The frame's bits on the wire.
    pub fn bit_stream(&self) -> BitStream {
        let (bits, count) = self.stuffed_part();
        // RTR, and of a 29-bit frame SRR and IDE before it, can lose too.
        let arbitrated = if self.is_extended() { 33 } else { 13 };
        let mut stream = BitStream {
            words: [0; 3],
            length: 0,
            arbitration_end: 0,
        };
        let (mut value, mut run) = (true, 0_u8);
        for at in (0..count).rev() {
            let bit = bits >> at & 1 == 1;
            run = if bit == value { run + 1 } else { 1 };
            value = bit;
            stream.push(bit);
            if count - at == arbitrated {
                stream.arbitration_end = stream.length;
            }
            if run == 5 {
                stream.push(!bit);
                (value, run) = (!bit, 1);
            }
        }
        (0..TAIL_BITS).for_each(|_| stream.push(true));
        stream
    }
}

impl BitStream {
    fn push(&mut self, recessive: bool) {
        let word = usize::from(self.length / 64);
        if let Some(word) = self.words.get_mut(word) {
            *word |= u64::from(recessive) << (self.length % 64);
            self.length += 1;
        }
    }

    /// Bit `number`, counted from start of frame; `None` behind end of frame.
    #[inline]
    pub fn bit(&self, number: u16) -> Option<bool> {
        let word = self.words.get(usize::from(number / 64))?;
        (number < self.length).then(|| word >> (number % 64) & 1 == 1)
    }

    /// How many there are: [`Frame::frame_bits`].
    #[inline]
    #[allow(
        clippy::len_without_is_empty,
        reason = "a frame has at least 44 bits on the wire"
    )]
    pub fn len(&self) -> u16 {
        self.length
    }

    /// Number of the acknowledge slot.
    #[inline]
    pub fn ack_slot(&self) -> u16 {
        self.length - 9
    }

    /// Whether a recessive bit of this number that is read back dominant is arbitration lost.
    #[inline]
    pub fn is_arbitrated(&self, number: u16) -> bool {
        number < self.arbitration_end
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::{ExtendedId, StandardId};
    use proptest::prelude::*;
    use std::string::String;

    fn text(stream: &BitStream) -> String {
        (0..stream.len())
            .map(|n| if stream.bit(n).unwrap() { '1' } else { '0' })
            .collect()
    }

    /// SYNC, whose bits are worked out by hand in `wire.rs`.
    #[test]
    fn sync_by_hand() {
        let frame = Frame::data_frame(StandardId::new(0x80).unwrap(), &[]).unwrap();
        let stream = frame.bit_stream();
        let stuffed = "0000 1 00000 1 00000 1 00000 1 0 111 00000 1 00 1 0 1";
        let expected = std::format!("{stuffed}1111111111").replace(' ', "");
        assert_eq!(text(&stream), expected);
        assert_eq!(stream.bit(stream.len()), None);
        assert_eq!(stream.bit(u16::MAX), None);
        assert_eq!(stream.ack_slot(), stream.len() - 9);
        // SOF, identifier and RTR are 13 bits, and the first stuff bit is among them.
        assert!(stream.is_arbitrated(13) && !stream.is_arbitrated(14));
    }

    /// Identifier 0x15555555 leaves no five equal bits up to the end of RTR, so nothing is stuffed
    /// there.
    #[test]
    fn arbitration_of_a_29_bit_frame_ends_behind_its_rtr() {
        let frame = Frame::data_frame(ExtendedId::new(0x1555_5555).unwrap(), &[]).unwrap();
        let stream = frame.bit_stream();
        assert!(stream.is_arbitrated(32) && !stream.is_arbitrated(33));
    }

    proptest! {
        #[test]
        fn it_is_as_long_as_the_frame_and_never_has_six_equal_bits(
            id in 0_u32..0x2000_0000, wide in any::<bool>(), remote in any::<bool>(),
            data in prop::collection::vec(prop_oneof![Just(0_u8), Just(255_u8), any::<u8>()], 0..=8),
        ) {
            let id: crate::Id = if wide {
                ExtendedId::new(id).unwrap().into()
            } else {
                StandardId::new((id & 0x7FF) as u16).unwrap().into()
            };
            let frame = if remote {
                Frame::remote_frame(id, data.len() as u8).unwrap()
            } else {
                Frame::data_frame(id, &data).unwrap()
            };
            let stream = frame.bit_stream();
            prop_assert_eq!(stream.len(), frame.frame_bits());
            let bits = text(&stream);
            let stuffed = &bits[..bits.len() - 10];
            prop_assert!(!stuffed.contains("000000") && !stuffed.contains("111111"));
            prop_assert_eq!(&bits[bits.len() - 10..], "1111111111");
        }
    }
}
