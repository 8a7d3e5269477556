//! Frames that get lost, or come twice, between outside programs and the bus: for tests of masters.

use std::fmt;
use std::str::FromStr;

use rand_core::{RngCore as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

/// Parts of a percent that a [`Share`] counts.
const PER_PERCENT: u32 = 10_000;
const WHOLE: u32 = 100 * PER_PERCENT;

/// How many of all frames, to the ten-thousandth of a percent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Share(u32);

impl Share {
    /// None of them.
    pub const NONE: Share = Share(0);
    /// All of them.
    pub const ALL: Share = Share(WHOLE);
}

/// A text that is no [`Share`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("write a share from 0% to 100% with at most four decimals, as in 1% or 0.5%")]
pub struct NoShare;

impl FromStr for Share {
    type Err = NoShare;

    fn from_str(text: &str) -> Result<Share, NoShare> {
        let number = text.trim().strip_suffix('%').ok_or(NoShare)?;
        let (whole, decimals) = number.split_once('.').unwrap_or((number, "0"));
        let are_digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        if !are_digits(whole) || !are_digits(decimals) || decimals.len() > 4 {
            return Err(NoShare);
        }
        let whole: u32 = whole.parse().map_err(|_| NoShare)?;
        let parts: u32 = format!("{decimals:0<4}").parse().map_err(|_| NoShare)?;
        let share = whole.checked_mul(PER_PERCENT).ok_or(NoShare)?;
        let share = share.checked_add(parts).ok_or(NoShare)?;
        (share <= WHOLE).then_some(Share(share)).ok_or(NoShare)
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let decimals = format!("{:04}", self.0 % PER_PERCENT);
        match decimals.trim_end_matches('0') {
            "" => write!(f, "{}%", self.0 / PER_PERCENT),
            decimals => write!(f, "{}.{decimals}%", self.0 / PER_PERCENT),
        }
    }
}

/// What is done to frames between outside programs and the bus, in each direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Disturbance {
    /// Frames that get lost.
    pub lose: Share,
    /// Of the others, those that come twice.
    pub duplicate: Share,
}

impl Disturbance {
    /// Whether nothing is done.
    pub fn is_none(self) -> bool {
        self == Disturbance::default()
    }
}

/// What was done to the frames of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Disturbed {
    /// All of them.
    pub frames: u64,
    /// Those that got lost.
    pub lost: u64,
    /// Those that came twice.
    pub duplicated: u64,
}

impl fmt::Display for Disturbed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Disturbed {
            frames,
            lost,
            duplicated,
        } = self;
        write!(f, "{lost} lost and {duplicated} duplicated of {frames}")
    }
}

/// Disturbs the frames of one direction.
#[derive(Debug)]
pub(crate) struct Disturber {
    disturbance: Disturbance,
    random: Pcg64Mcg,
    pub(crate) done: Disturbed,
}

impl Disturber {
    /// `direction` tells generators of one seed apart.
    pub(crate) fn new(disturbance: Disturbance, seed: u64, direction: u64) -> Disturber {
        let mixed = seed ^ (0x6469_7374_7572_6200 + direction);
        Disturber {
            disturbance,
            random: Pcg64Mcg::seed_from_u64(mixed),
            done: Disturbed::default(),
        }
    }

    /// How often the next frame comes: 0, 1 or 2 times.
    pub(crate) fn copies(&mut self) -> u8 {
        self.done.frames += 1;
        if self.hits(self.disturbance.lose) {
            self.done.lost += 1;
            return 0;
        }
        if self.hits(self.disturbance.duplicate) {
            self.done.duplicated += 1;
            return 2;
        }
        1
    }

    fn hits(&mut self, share: Share) -> bool {
        share > Share::NONE && self.random.next_u64() % u64::from(WHOLE) < u64::from(share.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_read_as_they_are_written() {
        for (text, parts) in [
            ("0%", 0),
            ("1%", 10_000),
            ("0.5%", 5_000),
            ("12.0625%", 120_625),
            ("0.0001%", 1),
            ("100%", WHOLE),
        ] {
            assert_eq!(text.parse(), Ok(Share(parts)), "{text}");
            assert_eq!(Share(parts).to_string(), text);
        }
        assert_eq!("2.50%".parse(), Ok(Share(25_000)));
        for wrong in [
            "1",
            "",
            "%",
            "-1%",
            "101%",
            "100.0001%",
            "1.00001%",
            "a%",
            "1.%",
            ".5%",
            "1e1%",
            "99999999999%",
        ] {
            assert_eq!(wrong.parse::<Share>(), Err(NoShare), "{wrong}");
        }
    }

    #[test]
    fn shares_are_kept_within_chance_and_directions_differ() {
        let disturbance = Disturbance {
            lose: Share(10_000),
            duplicate: Share(5_000),
        };
        let run = |seed, direction| {
            let mut disturber = Disturber::new(disturbance, seed, direction);
            let copies: Vec<u8> = (0..100_000).map(|_| disturber.copies()).collect();
            (copies, disturber.done)
        };
        let (copies, done) = run(1, 0);
        // Four standard deviations.
        assert!((874..=1126).contains(&done.lost), "{done}");
        assert!((406..=584).contains(&done.duplicated), "{done}");
        assert_eq!(done.frames, 100_000);
        assert_eq!(run(1, 0).0, copies);
        assert_ne!(run(1, 1).0, copies);
        assert_ne!(run(2, 0).0, copies);
        let mut all = Disturber::new(
            Disturbance {
                lose: Share::ALL,
                duplicate: Share::ALL,
            },
            1,
            0,
        );
        assert_eq!(all.copies(), 0);
    }
}
