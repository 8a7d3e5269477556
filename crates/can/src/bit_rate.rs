//! How fast a bus is.

use core::fmt;
use core::str::FromStr;

/// A bit rate of a classical CAN bus: those of CiA 301 table 1, and 100 kbit/s, which older devices
/// have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BitRate {
    /// 10 kbit/s.
    Kbit10,
    /// 20 kbit/s.
    Kbit20,
    /// 50 kbit/s.
    Kbit50,
    /// 100 kbit/s.
    Kbit100,
    /// 125 kbit/s.
    Kbit125,
    /// 250 kbit/s.
    Kbit250,
    /// 500 kbit/s.
    Kbit500,
    /// 800 kbit/s.
    Kbit800,
    /// 1 Mbit/s.
    Mbit1,
}

/// A text that names no [`BitRate`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownBitRate;

impl fmt::Display for UnknownBitRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("write one of ")?;
        for (n, rate) in BitRate::ALL.iter().enumerate() {
            let comma = if n == 0 { "" } else { ", " };
            write!(f, "{comma}{}", rate.word())?;
        }
        Ok(())
    }
}

impl core::error::Error for UnknownBitRate {}

impl BitRate {
    /// Every one, slowest first.
    pub const ALL: [BitRate; 9] = [
        BitRate::Kbit10,
        BitRate::Kbit20,
        BitRate::Kbit50,
        BitRate::Kbit100,
        BitRate::Kbit125,
        BitRate::Kbit250,
        BitRate::Kbit500,
        BitRate::Kbit800,
        BitRate::Mbit1,
    ];

    /// Thousands of bits per second.
    pub const fn kbit_s(self) -> u32 {
        match self {
            BitRate::Kbit10 => 10,
            BitRate::Kbit20 => 20,
            BitRate::Kbit50 => 50,
            BitRate::Kbit100 => 100,
            BitRate::Kbit125 => 125,
            BitRate::Kbit250 => 250,
            BitRate::Kbit500 => 500,
            BitRate::Kbit800 => 800,
            BitRate::Mbit1 => 1000,
        }
    }

    /// Bits per second.
    pub const fn bit_s(self) -> u32 {
        self.kbit_s() * 1000
    }

    /// How long a bit is on the wire, in nanoseconds: 100,000 to 1,000, always a whole number.
    pub const fn bit_ns(self) -> u64 {
        1_000_000 / self.kbit_s() as u64
    }

    /// The rate of so many thousand bits per second.
    pub fn from_kbit_s(kbit_s: u32) -> Option<BitRate> {
        let mut all = BitRate::ALL.into_iter();
        all.find(|rate| rate.kbit_s() == kbit_s)
    }

    /// The short way to write it, which [`BitRate::from_str`] reads: `125k`, `1M`.
    pub const fn word(self) -> &'static str {
        match self {
            BitRate::Kbit10 => "10k",
            BitRate::Kbit20 => "20k",
            BitRate::Kbit50 => "50k",
            BitRate::Kbit100 => "100k",
            BitRate::Kbit125 => "125k",
            BitRate::Kbit250 => "250k",
            BitRate::Kbit500 => "500k",
            BitRate::Kbit800 => "800k",
            BitRate::Mbit1 => "1M",
        }
    }
}

impl FromStr for BitRate {
    type Err = UnknownBitRate;

    /// Reads `125k`, `1M`, and bits per second: `125000`.
    fn from_str(text: &str) -> Result<BitRate, UnknownBitRate> {
        let mut all = BitRate::ALL.into_iter();
        let bit_s = text.parse::<u32>().ok();
        all.find(|rate| rate.word() == text || Some(rate.bit_s()) == bit_s)
            .ok_or(UnknownBitRate)
    }
}

impl fmt::Display for BitRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BitRate::Mbit1 => f.write_str("1 Mbit/s"),
            rate => write!(f, "{} kbit/s", rate.kbit_s()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString as _;
    extern crate std;

    #[test]
    fn every_rate_has_a_whole_bit_time_and_is_read_as_it_is_written() {
        for rate in BitRate::ALL {
            assert_eq!(rate.bit_ns() * u64::from(rate.bit_s()), 1_000_000_000);
            assert_eq!(rate.word().parse(), Ok(rate));
            assert_eq!(rate.bit_s().to_string().parse(), Ok(rate));
            assert_eq!(BitRate::from_kbit_s(rate.kbit_s()), Some(rate));
        }
        assert!(BitRate::ALL.is_sorted());
        assert_eq!(BitRate::Mbit1.to_string(), "1 Mbit/s");
        assert_eq!(BitRate::Kbit125.to_string(), "125 kbit/s");
    }

    #[test]
    fn others_are_refused_with_those_there_are() {
        for wrong in ["", "125", "1m", "33k", "1 M", "-10k", "10K", "99999999999"] {
            assert_eq!(wrong.parse::<BitRate>(), Err(UnknownBitRate), "{wrong}");
        }
        assert_eq!(
            UnknownBitRate.to_string(),
            "write one of 10k, 20k, 50k, 100k, 125k, 250k, 500k, 800k, 1M"
        );
    }
}
