//! Bit timings: table 0 of CiA 305, whose rates are those of CiA 301 table 1.

/// An entry of table 0. The number is the entry's index; 5 is reserved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum BitTiming {
    /// 1 Mbit/s.
    Kbit1000 = 0,
    /// 800 kbit/s.
    Kbit800 = 1,
    /// 500 kbit/s.
    Kbit500 = 2,
    /// 250 kbit/s.
    Kbit250 = 3,
    /// 125 kbit/s.
    Kbit125 = 4,
    /// 50 kbit/s.
    Kbit50 = 6,
    /// 20 kbit/s.
    Kbit20 = 7,
    /// 10 kbit/s.
    Kbit10 = 8,
    /// The device finds out the rate of the bus.
    Automatic = 9,
}

impl BitTiming {
    /// All entries, fastest first, automatic last.
    pub const ALL: [BitTiming; 9] = [
        BitTiming::Kbit1000,
        BitTiming::Kbit800,
        BitTiming::Kbit500,
        BitTiming::Kbit250,
        BitTiming::Kbit125,
        BitTiming::Kbit50,
        BitTiming::Kbit20,
        BitTiming::Kbit10,
        BitTiming::Automatic,
    ];

    /// From an index into table 0; `None` for the reserved 5 and above 9.
    pub const fn from_index(index: u8) -> Option<BitTiming> {
        Some(match index {
            0 => BitTiming::Kbit1000,
            1 => BitTiming::Kbit800,
            2 => BitTiming::Kbit500,
            3 => BitTiming::Kbit250,
            4 => BitTiming::Kbit125,
            6 => BitTiming::Kbit50,
            7 => BitTiming::Kbit20,
            8 => BitTiming::Kbit10,
            9 => BitTiming::Automatic,
            _ => return None,
        })
    }

    /// The index into table 0.
    pub const fn index(self) -> u8 {
        self as u8
    }

    /// The entry of a rate; `None` if table 0 has none.
    pub const fn from_kbit_s(kbit_s: u32) -> Option<BitTiming> {
        Some(match kbit_s {
            1000 => BitTiming::Kbit1000,
            800 => BitTiming::Kbit800,
            500 => BitTiming::Kbit500,
            250 => BitTiming::Kbit250,
            125 => BitTiming::Kbit125,
            50 => BitTiming::Kbit50,
            20 => BitTiming::Kbit20,
            10 => BitTiming::Kbit10,
            _ => return None,
        })
    }

    /// The rate in kbit/s; `None` for automatic.
    pub const fn kbit_s(self) -> Option<u32> {
        Some(match self {
            BitTiming::Kbit1000 => 1000,
            BitTiming::Kbit800 => 800,
            BitTiming::Kbit500 => 500,
            BitTiming::Kbit250 => 250,
            BitTiming::Kbit125 => 125,
            BitTiming::Kbit50 => 50,
            BitTiming::Kbit20 => 20,
            BitTiming::Kbit10 => 10,
            BitTiming::Automatic => return None,
        })
    }
}

impl core::fmt::Display for BitTiming {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.kbit_s() {
            Some(kbit_s) => write!(f, "{kbit_s} kbit/s"),
            None => f.write_str("automatic bit rate"),
        }
    }
}

/// A set of bit timings: what a device can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitTimings(u16);

impl BitTimings {
    /// Nothing: the device keeps its bit timing.
    pub const NONE: BitTimings = BitTimings(0);
    /// Every rate of table 0, without automatic.
    pub const RATES: BitTimings = BitTimings(0b1_1101_1111);

    /// With one more.
    #[must_use]
    pub const fn with(self, timing: BitTiming) -> BitTimings {
        BitTimings(self.0 | 1 << timing.index())
    }

    /// Whether it is in the set.
    pub const fn has(self, timing: BitTiming) -> bool {
        self.0 & 1 << timing.index() != 0
    }

    /// Whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}
