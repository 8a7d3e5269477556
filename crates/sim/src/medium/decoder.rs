//! What a controller makes of the bits that it reads (ISO 11898-1, classical frame formats): it takes
//! the stuff bits out, finds the fields, and computes the CRC bit by bit.

use can::{ExtendedId, Frame, StandardId};

/// Generator polynomial of the classical CRC.
const POLYNOMIAL: u16 = 0x4599;
/// Bits of start of frame up to the data length code.
const HEADER_11: u16 = 19;
const HEADER_29: u16 = 39;
const CRC_BITS: u16 = 15;
/// A run so long is followed by a stuff bit.
const LONGEST_RUN: u8 = 5;

/// Where in a frame the next bit lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Field {
    /// Start of frame.
    Start,
    /// Identifier, RTR, SRR, IDE.
    Arbitration,
    /// Reserved bits and data length code.
    Control,
    /// Data.
    Data,
    /// CRC sequence.
    Crc,
    /// CRC delimiter.
    CrcDelimiter,
    /// Acknowledge slot.
    AckSlot,
    /// Acknowledge delimiter.
    AckDelimiter,
    /// End of frame, bit 1 to 7.
    End(u8),
    /// The delimiter of an error frame: no decoder comes here.
    ErrorDelimiter,
}

/// What a bit means to who receives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// The frame goes on.
    Nothing,
    /// Six equal bits.
    StuffError,
    /// A dominant bit where there must be a recessive one.
    FormError,
    /// The CRC is wrong; this is told behind the acknowledge delimiter.
    CrcError,
    /// The last bit of end of frame. A receiver takes the frame whatever that bit is.
    End,
}

/// A frame being read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decoder {
    /// Without stuff bits, the last one lowest.
    bits: u128,
    /// How many there are.
    count: u16,
    /// The last bit, and how many equal ones there have been.
    last: bool,
    run: u8,
    crc: u16,
    field: Field,
}

impl Decoder {
    /// Before start of frame.
    pub(super) const NEW: Decoder = Decoder {
        bits: 0,
        count: 0,
        last: true,
        run: 0,
        crc: 0,
        field: Field::Start,
    };

    /// The field of the next bit.
    pub(super) fn field(&self) -> Field {
        self.field
    }

    /// Whether the next bit must be a stuff bit. There may be one behind the CRC, too.
    fn expects_stuff_bit(&self) -> bool {
        self.run == LONGEST_RUN && self.field <= Field::CrcDelimiter
    }

    /// Whether the receiver agrees with the frame up to the CRC.
    pub(super) fn is_crc_right(&self) -> bool {
        self.crc == 0
    }

    /// Reads a bit, `true` if it is recessive.
    pub(super) fn read(&mut self, bit: bool) -> Meaning {
        match self.field {
            Field::CrcDelimiter if !self.expects_stuff_bit() => {
                return self.delimiter(bit, Field::AckSlot);
            }
            Field::AckSlot => self.field = Field::AckDelimiter,
            Field::AckDelimiter if !self.is_crc_right() => return Meaning::CrcError,
            Field::AckDelimiter => return self.delimiter(bit, Field::End(1)),
            Field::End(7) => return Meaning::End,
            Field::End(n) => return self.delimiter(bit, Field::End(n + 1)),
            _ => return self.stuffed(bit),
        }
        Meaning::Nothing
    }

    fn delimiter(&mut self, bit: bool, next: Field) -> Meaning {
        self.field = next;
        if bit {
            Meaning::Nothing
        } else {
            Meaning::FormError
        }
    }

    /// A bit of the part with stuff bits.
    fn stuffed(&mut self, bit: bool) -> Meaning {
        if self.expects_stuff_bit() {
            if bit == self.last {
                return Meaning::StuffError;
            }
            (self.last, self.run) = (bit, 1);
            return Meaning::Nothing;
        }
        self.run = if self.run > 0 && bit == self.last {
            self.run + 1
        } else {
            1
        };
        self.last = bit;
        self.bits = self.bits << 1 | u128::from(bit);
        self.count += 1;
        let feedback = bit != (self.crc >> 14 & 1 == 1);
        self.crc = self.crc << 1 & 0x7FFF ^ if feedback { POLYNOMIAL } else { 0 };
        self.field = self.field_at(self.count);
        Meaning::Nothing
    }

    /// The field of the bit of that number, stuff bits not counted.
    fn field_at(&self, number: u16) -> Field {
        match number {
            0 => Field::Start,
            1..14 => Field::Arbitration,
            _ => {
                let (rtr_end, header) = if self.is_extended() {
                    (33, HEADER_29)
                } else {
                    (13, HEADER_11)
                };
                let data = self.data_bits().map_or(u16::MAX, |bits| header + bits);
                match number {
                    n if n < rtr_end => Field::Arbitration,
                    n if n < header => Field::Control,
                    n if n < data => Field::Data,
                    n if n < data + CRC_BITS => Field::Crc,
                    _ => Field::CrcDelimiter,
                }
            }
        }
    }

    /// Bit `number` counted from start of frame, of those that are there.
    fn bit(&self, number: u16) -> bool {
        self.count > number && self.bits >> (self.count - 1 - number) & 1 == 1
    }

    fn part(&self, first: u16, count: u16) -> u32 {
        (first..first + count).fold(0, |value, n| value << 1 | u32::from(self.bit(n)))
    }

    fn is_extended(&self) -> bool {
        self.bit(13)
    }

    fn is_remote(&self) -> bool {
        self.bit(if self.is_extended() { 32 } else { 12 })
    }

    fn length_code(&self) -> u8 {
        let first = if self.is_extended() { 35 } else { 15 };
        self.part(first, 4) as u8
    }

    /// Bits of data, once the data length code is there.
    fn data_bits(&self) -> Option<u16> {
        let header = if self.is_extended() {
            HEADER_29
        } else {
            HEADER_11
        };
        if self.count < header {
            return None;
        }
        // A length code beyond 8 means 8.
        let bytes = u16::from(self.length_code().min(8));
        Some(if self.is_remote() { 0 } else { 8 * bytes })
    }

    /// The frame, read to its end.
    pub(super) fn frame(&self) -> Option<Frame> {
        let length = self.length_code().min(8);
        let first = if self.is_extended() {
            HEADER_29
        } else {
            HEADER_11
        };
        let id: can::Id = if self.is_extended() {
            ExtendedId::new(self.part(1, 11) << 18 | self.part(14, 18))?.into()
        } else {
            StandardId::new(self.part(1, 11) as u16)?.into()
        };
        if self.is_remote() {
            return Frame::remote_frame(id, length);
        }
        let bytes: Vec<u8> = (0..u16::from(length))
            .map(|n| self.part(first + 8 * n, 8) as u8)
            .collect();
        Frame::data_frame(id, &bytes)
    }
}
