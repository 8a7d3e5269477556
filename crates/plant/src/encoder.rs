//! The absolute encoder: what it makes of the shaft's angle.

use control::io::Magnet;
use control::{Mask as _, Real, sin_cos};

use crate::Invalid;
use crate::magnet::{BEST_MM, LEAST, WEAK, WEAK_NOISE_PART, field_at, magnet_of};
use crate::noise::Draws;

/// The absolute encoder: a magnet on the rotor's end, glued on at any angle.
///
/// The reading, before it is rounded to the nearest count of a turn of N counts, is
///
/// zero ± (θ + eccentricity(θ) + noise), θ the shaft's angle `lag_s` ago, plus a magnet's slip,
///
/// with eccentricity(θ) = `eccentricity_counts` · sin(θ + `eccentricity_phase_rad`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Counts of one turn, up to 2²⁰.
    pub counts_per_turn: u32,
    /// Reading with the rotor at angle zero, aligned with phase A.
    pub zero_counts: u32,
    /// Whether the reading falls when the shaft turns in its positive direction.
    pub reversed: bool,
    /// Amplitude of the error that repeats once a turn, because the magnet is not centred over the
    /// sensor, counts.
    pub eccentricity_counts: f32,
    /// Where in the turn that error is: it is greatest a quarter turn less this angle, rad.
    pub eccentricity_phase_rad: f32,
    /// Age of a reading when the control loops get it, s, up to 1 ms.
    pub lag_s: f64,
    /// Standard deviation of a reading with the magnet at its best distance, counts. It grows as
    /// the field falls.
    pub noise_counts: f32,
    /// Distance of the magnet from the sensor, mm; see [`field_at`].
    pub magnet_mm: f32,
    /// Part of the answers whose check sum is wrong, 0 to 1.
    pub bad_answers: f32,
}

impl Encoder {
    /// An encoder without error but rounding, with its magnet at the best distance.
    pub const fn ideal(counts_per_turn: u32, zero_counts: u32) -> Self {
        Self {
            counts_per_turn,
            zero_counts,
            reversed: false,
            eccentricity_counts: 0.0,
            eccentricity_phase_rad: 0.0,
            lag_s: 0.0,
            noise_counts: 0.0,
            magnet_mm: BEST_MM,
            bad_answers: 0.0,
        }
    }

    /// Whether such an encoder can be.
    pub(crate) fn check(&self) -> Result<(), Invalid> {
        let counts = self.counts_per_turn;
        if counts == 0 || counts > 1 << 20 {
            return Err(Invalid::EncoderCounts(counts));
        }
        let quarter = 0.25 * f64::from(counts);
        for (value, least, most) in [
            (self.eccentricity_counts.into(), -quarter, quarter),
            (self.eccentricity_phase_rad.into(), -1e4, 1e4),
            (self.lag_s, 0.0, 1e-3),
            (self.noise_counts.into(), 0.0, quarter),
            (self.magnet_mm.into(), 0.0, 1e3),
            (self.bad_answers.into(), 0.0, 1.0),
        ] {
            if !(value >= least && value <= most) {
                return Err(Invalid::EncoderError(value));
            }
        }
        Ok(())
    }
}

/// What can be wrong with an encoder beside its accuracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EncoderFault {
    /// Nothing.
    #[default]
    None,
    /// It answers, with a right check sum, and always with the same angle.
    Stuck,
    /// No answer: the cable is off.
    NoAnswer,
    /// Every answer has a wrong bit, and hence a wrong check sum.
    BadParity,
}

/// The encoder at work. A batch shares its faults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reader<R: Real> {
    counts: R,
    counts_per_turn: R::Count,
    zero: R::Count,
    direction: R::Count,
    turned: bool,
    /// Any of the effects below; without, a reading is a rounding.
    effects: bool,
    eccentricity: R,
    eccentricity_phase: R::Count,
    /// Angle counts by which a reading is late for each rad/s.
    lag: R,
    noise_counts: R,
    noise: R,
    bad_answers: R,
    field: f32,
    slip: R::Count,
    fault: EncoderFault,
    held: R::Count,
}

const COUNTS_PER_RAD: f64 = 4_294_967_296.0 / core::f64::consts::TAU;

/// The nearest angle count, 2³² a turn.
fn angle_count(turns: f32) -> i32 {
    let turns = if turns.is_finite() { turns } else { 0.0 };
    let fraction = turns - (turns as i32) as f32;
    ((f64::from(fraction) * 4_294_967_296.0) as i64) as i32
}

impl<R: Real> Reader<R> {
    pub(crate) fn new(encoder: &Encoder) -> Self {
        let counts = encoder.counts_per_turn.clamp(1, 1 << 20);
        let phase = encoder.eccentricity_phase_rad / core::f32::consts::TAU;
        let mut reader = Self {
            counts: R::splat(counts as f32),
            counts_per_turn: R::count(counts as i32),
            zero: R::count((encoder.zero_counts % counts) as i32),
            direction: R::count(if encoder.reversed { -1 } else { 1 }),
            turned: false,
            effects: false,
            eccentricity: R::splat(encoder.eccentricity_counts).sane(),
            eccentricity_phase: R::count(angle_count(phase)),
            lag: R::splat((encoder.lag_s * COUNTS_PER_RAD) as f32).sane(),
            noise_counts: R::splat(encoder.noise_counts).sane(),
            noise: R::splat(0.0),
            bad_answers: R::splat(encoder.bad_answers),
            field: 1.0,
            slip: R::count(0),
            fault: EncoderFault::None,
            held: R::count(0),
        };
        reader.set_magnet_mm(encoder.magnet_mm);
        reader
    }

    pub(crate) fn set_magnet_mm(&mut self, distance_mm: f32) {
        self.field = field_at(distance_mm);
        let lack = if self.field < WEAK {
            WEAK / self.field - 1.0
        } else {
            0.0
        };
        let weak = self.counts * R::splat(lack * WEAK_NOISE_PART);
        self.noise = self.noise_counts * R::splat(1.0 / self.field) + weak;
        self.look_for_effects();
    }

    pub(crate) fn set_bad_answers(&mut self, part: R) {
        self.bad_answers = part;
        self.look_for_effects();
    }

    pub(crate) fn set_fault(&mut self, fault: EncoderFault, reading: R::Count) {
        self.fault = fault;
        self.held = reading;
        self.look_for_effects();
    }

    /// Whether a turn of N counts reads N less what it was.
    pub(crate) fn set_turned(&mut self, turned: bool) {
        if turned != self.turned {
            self.turned = turned;
            let zero = R::count_sub(self.counts_per_turn, self.zero);
            let whole = self.counts.le(R::of_count(zero));
            self.zero = R::count_select(whole, R::count(0), zero);
            self.direction = R::count_sub(R::count(0), self.direction);
        }
    }

    /// Turns the magnet on the shaft, in the shaft's positive direction.
    pub(crate) fn slip(&mut self, angle: R::Count) {
        self.slip = R::count_add(self.slip, angle);
    }

    pub(crate) fn magnet(&self) -> Magnet {
        magnet_of(self.field)
    }

    fn look_for_effects(&mut self) {
        let zero = R::splat(0.0);
        let some = |value: R| !value.abs().le(zero);
        let any = some(self.eccentricity) | some(self.lag) | some(self.noise);
        let invalid = self.field < LEAST || self.fault != EncoderFault::None;
        self.effects = invalid | (any | some(self.bad_answers)).any();
    }

    /// The reading, 0 to counts per turn - 1, and whether it is valid.
    #[inline(always)]
    pub(crate) fn read(
        &self,
        angle: R::Count,
        speed_rad_s: R,
        draws: &mut Draws<R>,
    ) -> (R::Count, R::Mask) {
        let angle = R::count_add(angle, self.slip);
        if self.effects {
            self.with_effects(angle, speed_rad_s, draws)
        } else {
            (self.nearest(angle, R::splat(0.0)), R::Mask::splat(true))
        }
    }

    #[inline(never)]
    fn with_effects(
        &self,
        angle: R::Count,
        speed_rad_s: R,
        draws: &mut Draws<R>,
    ) -> (R::Count, R::Mask) {
        let angle = R::count_sub(angle, (speed_rad_s * self.lag).to_count());
        let (sine, _) = sin_cos::<R>(R::count_add(angle, self.eccentricity_phase));
        let error = self.eccentricity * sine + self.noise * draws.normal();
        let error = error.within(self.counts * R::splat(0.5));
        let reading = self.nearest(angle, error);
        let half = R::splat(0.5);
        let bad = (draws.even() * half + half).lt(self.bad_answers);
        // One bit more or less.
        let bit = R::count_sub(
            R::count(1),
            R::count_mul(self.lowest_bit(reading), R::count(2)),
        );
        let garbled = R::count_add(reading, bit);
        let beyond = self.counts.le(R::of_count(garbled));
        let garbled = R::count_select(beyond, R::count(0), garbled);
        let never = R::Mask::splat(false);
        match self.fault {
            EncoderFault::NoAnswer => (R::count(0), never),
            _ if self.field < LEAST => (R::count(0), never),
            EncoderFault::BadParity => (garbled, never),
            EncoderFault::Stuck => (self.held, R::Mask::splat(true)),
            EncoderFault::None => (R::count_select(bad, garbled, reading), !bad),
        }
    }

    #[inline(always)]
    fn lowest_bit(&self, reading: R::Count) -> R::Count {
        let half = R::count_shift_right(reading, 1);
        R::count_sub(reading, R::count_mul(half, R::count(2)))
    }

    /// The count nearest to an angle, 2³² a turn, and an error, counts.
    #[inline(always)]
    fn nearest(&self, angle: R::Count, error: R) -> R::Count {
        let zero = R::splat(0.0);
        let counts = R::of_count(angle) * R::splat(1.0 / 4_294_967_296.0) * self.counts + error;
        // Into 0 to N before rounding, since to_count cuts toward zero.
        let counts = R::select(counts.lt(zero), counts + self.counts, counts);
        let nearest = (counts + R::splat(0.5)).to_count();
        let raw = R::count_add(self.zero, R::count_mul(self.direction, nearest));
        let below = R::of_count(raw).lt(zero);
        let raw = R::count_select(below, R::count_add(raw, self.counts_per_turn), raw);
        let above = self.counts.le(R::of_count(raw));
        R::count_select(above, R::count_sub(raw, self.counts_per_turn), raw)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{Encoder, EncoderFault};
    use crate::{Sensed, Sensors, VIRTUAL_P3, Vector};
    use control::io::Magnet;

    const REST: Sensed<f32> = Sensed {
        angle: 0,
        speed_rad_s: 0.0,
        current: Vector {
            alpha: 0.0,
            beta: 0.0,
        },
        bus_voltage_v: 48.0,
        temperature_c: 25.0,
    };

    fn with_encoder(encoder: Encoder) -> Sensors<f32> {
        let mut parameters = VIRTUAL_P3;
        parameters.encoder = encoder;
        Sensors::new(&parameters)
    }

    fn reading(sensors: &Sensors<f32>, angle: i32) -> i32 {
        sensors.sample(&Sensed { angle, ..REST }).encoder
    }

    /// Difference around the turn, counts.
    fn around(difference: f64, turn: f64) -> f64 {
        difference - (difference / turn).round() * turn
    }

    #[test]
    fn encoder_rounds_to_the_nearest_count_in_both_directions() {
        for (counts, zero) in [
            (4096, 0x0DF8),
            (4096, 0),
            (4096, 4095),
            (1000, 999),
            (1 << 16, 5),
        ] {
            for reversed in [false, true] {
                let sensors = with_encoder(Encoder {
                    reversed,
                    ..Encoder::ideal(counts, zero)
                });
                for step in 0..40_000_u32 {
                    let angle = step.wrapping_mul(107_374) as i32;
                    let raw = reading(&sensors, angle);
                    assert!((0..counts as i32).contains(&raw));
                    // Distance around the turn; f32 knows the angle to 2^-24 of it.
                    let turn = f64::from(counts);
                    let sign = if reversed { -1.0 } else { 1.0 };
                    let exact = f64::from(angle) / 4_294_967_296.0 * turn;
                    let error = around(f64::from(raw) - f64::from(zero) - sign * exact, turn);
                    assert!(
                        error.abs() <= 0.5 + turn * 2.0_f64.powi(-24),
                        "{angle} {error}"
                    );
                }
            }
        }
    }

    #[test]
    fn turned_it_reads_a_turn_less_what_it_was() {
        for (zero, reversed) in [(0, false), (0, true), (0x0DF8, false), (1, true)] {
            let mut sensors = with_encoder(Encoder {
                reversed,
                ..Encoder::ideal(4096, zero)
            });
            for step in 0..1000_u32 {
                // Clear of halves, which are rounded away from the direction.
                let angle = (step.wrapping_mul(4_294_967) | 1 << 10) as i32;
                sensors.reader().set_turned(false);
                let before = reading(&sensors, angle);
                sensors.reader().set_turned(true);
                assert_eq!(reading(&sensors, angle), (4096 - before) % 4096);
            }
        }
    }

    #[test]
    fn the_manuals_reading_under_phase_a() {
        let sensors = with_encoder(Encoder::ideal(4096, 0x0DF8));
        assert_eq!(reading(&sensors, 0), 0x0DF8);
        assert_eq!(reading(&sensors, 1 << 30), (0x0DF8 + 1024) % 4096);
    }

    #[test]
    fn eccentricity_lag_and_slip_are_where_they_are_said_to_be() {
        let encoder = Encoder {
            eccentricity_counts: 12.0,
            eccentricity_phase_rad: 0.7,
            lag_s: 40e-6,
            ..Encoder::ideal(4096, 100)
        };
        for reversed in [false, true] {
            let mut sensors = with_encoder(Encoder {
                reversed,
                ..encoder
            });
            sensors.reader().slip(1 << 24);
            let sign = if reversed { -1.0 } else { 1.0 };
            let mut worst = 0.0_f64;
            for step in 0..10_000_u32 {
                let angle = step.wrapping_mul(429_497) as i32;
                let speed = 1_000.0;
                let sensed = Sensed {
                    angle,
                    speed_rad_s: speed,
                    ..REST
                };
                let sample = sensors.sample(&sensed);
                assert!(sample.encoder_valid);
                let theta = f64::from(angle) / 4_294_967_296.0 * core::f64::consts::TAU
                    - f64::from(speed) * 40e-6
                    + core::f64::consts::TAU / 256.0;
                let counts = theta / core::f64::consts::TAU * 4096.0 + 12.0 * (theta + 0.7).sin();
                let error = f64::from(sample.encoder) - 100.0 - sign * counts;
                worst = worst.max(around(error, 4096.0).abs());
            }
            assert!(worst < 0.502 && worst > 0.49, "{worst}");
        }
    }

    #[test]
    fn noise_has_the_stated_deviation_and_flickers_between_two_counts() {
        // Half way between two counts: even with little noise, both are read.
        let mut sensors = with_encoder(Encoder {
            noise_counts: 0.2,
            ..Encoder::ideal(4096, 0)
        });
        let half = 1 << 19;
        let mut seen = [0, 0];
        for _ in 0..2_000 {
            seen[reading(&sensors, half + (7 << 20)) as usize - 7] += 1;
            sensors.advance();
        }
        assert!(seen[0] > 850 && seen[1] > 850, "{seen:?}");
        // Much noise: rounding adds a twelfth of a count squared.
        let mut sensors = with_encoder(Encoder {
            noise_counts: 3.0,
            ..Encoder::ideal(4096, 2048)
        });
        let mut square = 0.0;
        for _ in 0..20_000 {
            square += f64::from(reading(&sensors, 0) - 2048).powi(2);
            sensors.advance();
        }
        let variance = square / 20_000.0;
        assert!(
            (variance / (9.0 + 1.0 / 12.0) - 1.0).abs() < 0.04,
            "{variance}"
        );
        // One moment has one reading.
        assert_eq!(reading(&sensors, 0), reading(&sensors, 0));
    }

    #[test]
    fn a_magnet_that_moves_away_first_warns_then_is_lost() {
        let mut sensors = with_encoder(Encoder::ideal(4096, 0));
        let deviation = |sensors: &mut Sensors<f32>| {
            let square: f64 = (0..1_000)
                .map(|_| {
                    sensors.advance();
                    around(f64::from(reading(sensors, 0)), 4096.0).powi(2)
                })
                .sum();
            (square / 1_000.0).sqrt()
        };
        for (mm, magnet, noise) in [
            (1.0, Magnet::Good, 0.0),
            (0.3, Magnet::Good, 0.0),
            (0.2, Magnet::TooStrong, 0.0),
            (1.9, Magnet::Good, 0.0),
            // Field 0.302: (0.5/0.302 - 1) of 4 counts.
            (2.716, Magnet::TooWeak, 2.62),
        ] {
            sensors.reader().set_magnet_mm(mm);
            assert_eq!(sensors.magnet(), magnet, "{mm}");
            let seen = deviation(&mut sensors);
            assert!((seen - noise).abs() < 0.25, "{mm}: {seen}");
            assert!(sensors.sample(&REST).encoder_valid);
        }
        sensors.reader().set_magnet_mm(4.2);
        assert_eq!(sensors.magnet(), Magnet::TooWeak);
        assert!(!sensors.sample(&REST).encoder_valid);
        sensors.reader().set_magnet_mm(1.0);
        assert!(sensors.sample(&REST).encoder_valid);
    }

    #[test]
    fn faults_come_and_go() {
        let mut sensors = with_encoder(Encoder::ideal(4095, 0));
        let here = Sensed {
            angle: -1 << 20,
            ..REST
        };
        let good = sensors.sample(&here).encoder;
        assert_eq!(good, 4094);
        sensors.set_encoder_fault(EncoderFault::Stuck, &here);
        let stuck = sensors.sample(&REST);
        assert_eq!((stuck.encoder, stuck.encoder_valid), (good, true));
        // Set anew, it sticks where the shaft is by then.
        sensors.set_encoder_fault(EncoderFault::Stuck, &REST);
        assert_eq!(sensors.sample(&here).encoder, 0);
        sensors.set_encoder_fault(EncoderFault::NoAnswer, &here);
        assert!(!sensors.sample(&here).encoder_valid);
        sensors.set_encoder_fault(EncoderFault::BadParity, &here);
        let bad = sensors.sample(&here);
        assert!(!bad.encoder_valid && bad.encoder != good);
        sensors.set_encoder_fault(EncoderFault::None, &here);
        assert_eq!(sensors.sample(&here).encoder, good);
        // Some of the answers only.
        sensors.reader().set_bad_answers(0.25);
        let bad = (0..8_000)
            .filter(|_| {
                sensors.advance();
                !sensors.sample(&here).encoder_valid
            })
            .count();
        assert!((1_850..2_150).contains(&bad), "{bad}");
    }
}
