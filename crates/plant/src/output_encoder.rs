//! An encoder on the output of a gear, beside the one on the rotor.

use control::io::Magnet;

use crate::Invalid;
use crate::magnet::{BEST_MM, LEAST, field_at, magnet_of};

/// A second absolute encoder, on the output: it turns `gear` times for one turn of the load's shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputEncoder {
    /// Turns of the output for one of the shaft.
    pub gear: f64,
    /// Counts of one turn of the output.
    pub counts_per_turn: u32,
    /// Reading with the shaft at angle zero, turns.
    pub zero_turns: f64,
    /// Whether the reading falls when the output turns in its positive direction.
    pub reversed: bool,
    /// Amplitude of the error that repeats once a turn of the output, turns.
    pub eccentricity_turns: f64,
    /// Its cable is off.
    pub silent: bool,
    /// Distance of its magnet from the sensor, mm; see [`crate::field_at`].
    pub magnet_mm: f32,
}

impl OutputEncoder {
    /// One without error but rounding.
    pub const fn ideal(gear: f64) -> OutputEncoder {
        OutputEncoder {
            gear,
            counts_per_turn: 1 << 14,
            zero_turns: 0.0,
            reversed: false,
            eccentricity_turns: 0.0,
            silent: false,
            magnet_mm: BEST_MM,
        }
    }

    /// The same, counting the other way round (its direction bit): it reads a turn less.
    pub(crate) fn turned(self) -> OutputEncoder {
        OutputEncoder {
            zero_turns: -self.zero_turns,
            reversed: !self.reversed,
            ..self
        }
    }

    pub(crate) fn check(&self) -> Result<(), Invalid> {
        for value in [
            self.gear,
            self.zero_turns,
            self.eccentricity_turns,
            self.magnet_mm.into(),
        ] {
            if !value.is_finite() {
                return Err(Invalid::OutputEncoder(value));
            }
        }
        match self.counts_per_turn {
            0 => Err(Invalid::OutputEncoder(0.0)),
            _ => Ok(()),
        }
    }

    /// What it says of its magnet, if it answers.
    pub(crate) fn magnet(&self) -> Option<Magnet> {
        (!self.silent).then_some(magnet_of(field_at(self.magnet_mm)))
    }

    /// The reading at `way` of the shaft, 2³² per turn: turns from 0 to below 1.
    pub(crate) fn reading(&self, way: i64) -> Option<f32> {
        if self.silent || field_at(self.magnet_mm) < LEAST {
            return None;
        }
        let output = way as f64 / 4_294_967_296.0 * self.gear;
        let (sine, _) = control::sin_cos::<f32>(angle(output));
        let direction = if self.reversed { -1.0 } else { 1.0 };
        let turned = output + self.eccentricity_turns * f64::from(sine);
        let counts = f64::from(self.counts_per_turn);
        let count = within_turn(self.zero_turns + direction * turned) * counts + 0.5;
        let count = count as u32 % self.counts_per_turn.max(1);
        Some((f64::from(count) / counts) as f32)
    }
}

/// The part of a turn, 0 to below 1.
fn within_turn(turns: f64) -> f64 {
    let whole = turns as i64 as f64;
    let part = turns - whole;
    if part < 0.0 { part + 1.0 } else { part }
}

/// An angle as 2³² per turn.
fn angle(turns: f64) -> i32 {
    (within_turn(turns) * 4_294_967_296.0) as i64 as i32
}

#[cfg(test)]
mod tests {
    use super::OutputEncoder;
    use control::io::Magnet;

    const TURN: i64 = 1 << 32;

    #[test]
    fn it_turns_with_the_gear() {
        let encoder = OutputEncoder {
            zero_turns: 0.25,
            ..OutputEncoder::ideal(1.0 / 9.0)
        };
        assert_eq!(encoder.reading(0), Some(0.25));
        assert_eq!(encoder.reading(9 * TURN), Some(0.25));
        let half = encoder.reading(9 * TURN / 2).unwrap();
        assert!((half - 0.75).abs() < 1.0 / 16_384.0, "{half}");
        let back = OutputEncoder {
            reversed: true,
            ..encoder
        };
        let quarter = back.reading(9 * TURN / 4).unwrap();
        // A hair below a whole turn is 0, too.
        assert!(!(1.0 / 16_384.0..=0.9999).contains(&quarter), "{quarter}");
    }

    #[test]
    fn turned_it_counts_back() {
        let encoder = OutputEncoder {
            zero_turns: 0.25,
            ..OutputEncoder::ideal(1.0)
        }
        .turned();
        assert_eq!(encoder.reading(0), Some(0.75));
        assert_eq!(encoder.reading(TURN / 4), Some(0.5));
    }

    #[test]
    fn its_magnet_has_a_best_distance() {
        let at = |magnet_mm| OutputEncoder {
            magnet_mm,
            ..OutputEncoder::ideal(1.0)
        };
        for (distance, magnet) in [
            (1.0, Magnet::Good),
            (0.2, Magnet::TooStrong),
            (2.5, Magnet::TooWeak),
            (5.0, Magnet::TooWeak),
        ] {
            assert_eq!(at(distance).magnet(), Some(magnet), "{distance}");
            // Too far for any angle.
            assert_eq!(at(distance).reading(0).is_none(), distance > 4.1);
        }
        let silent = OutputEncoder {
            silent: true,
            ..at(5.0)
        };
        assert_eq!(silent.magnet(), None);
    }

    #[test]
    fn without_a_cable_it_says_nothing() {
        let encoder = OutputEncoder {
            silent: true,
            ..OutputEncoder::ideal(1.0)
        };
        assert_eq!(encoder.reading(5), None);
    }
}
