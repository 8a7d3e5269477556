//! What the drive sees of the world: whole counts.

use control::io::{Sample, Scales};
use control::{Mask as _, Real};

use crate::Vector;

/// The absolute encoder: a magnet on the rotor's end, glued on at any angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Counts of one turn, up to 2²⁰.
    pub counts_per_turn: u32,
    /// Reading with the rotor at angle zero, aligned with phase A.
    pub zero_counts: u32,
    /// Whether the reading falls when the shaft turns in its positive direction.
    pub reversed: bool,
}

/// Encoder and 12-bit converters. Every reading is rounded to the nearest count; the converters
/// saturate at 0 and 4095.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors<R: Real> {
    encoder_counts: R,
    counts_per_turn: R::Count,
    encoder_zero: R::Count,
    direction: R::Count,
    counts_per_a: R,
    current_zero: [R; 2],
    counts_per_v: R,
    counts_per_k: R,
    temperature_zero_c: R,
}

const FULL_SCALE: f32 = 4095.0;

impl<R: Real> Sensors<R> {
    /// Sensors with converters of `scales`, except that phases A and B of this board read
    /// `current_zero_counts` at no current.
    pub fn new(encoder: &Encoder, scales: &Scales, current_zero_counts: [f32; 2]) -> Self {
        let counts = encoder.counts_per_turn.clamp(1, 1 << 20);
        let [zero_a, zero_b] = current_zero_counts;
        Self {
            encoder_counts: R::splat(counts as f32),
            counts_per_turn: R::count(counts as i32),
            encoder_zero: R::count((encoder.zero_counts % counts) as i32),
            direction: R::count(if encoder.reversed { -1 } else { 1 }),
            counts_per_a: R::splat(1.0 / scales.current_a),
            current_zero: [R::splat(zero_a), R::splat(zero_b)],
            counts_per_v: R::splat(1.0 / scales.voltage_v),
            counts_per_k: R::splat(1.0 / scales.temperature_k),
            temperature_zero_c: R::splat(scales.temperature_zero_c),
        }
    }

    /// Reads everything: the shaft's angle (2³² per turn), the stator current, A, the bus voltage,
    /// V, and the amplifier's temperature, °C.
    #[inline(always)]
    pub fn sample(
        &self,
        angle: R::Count,
        current: Vector<R>,
        bus_voltage_v: R,
        temperature_c: R,
    ) -> Sample<R> {
        let [a, b, _] = current.phases();
        let [zero_a, zero_b] = self.current_zero;
        Sample {
            phase_adc: [
                convert(a * self.counts_per_a + zero_a),
                convert(b * self.counts_per_a + zero_b),
            ],
            encoder: self.encoder(angle),
            bus_adc: convert(bus_voltage_v * self.counts_per_v),
            temperature_adc: convert((temperature_c - self.temperature_zero_c) * self.counts_per_k),
            overcurrent: R::Mask::splat(false),
            encoder_valid: R::Mask::splat(true),
        }
    }

    /// The encoder's reading, 0 to counts per turn - 1.
    #[inline(always)]
    fn encoder(&self, angle: R::Count) -> R::Count {
        let zero = R::splat(0.0);
        let counts = R::of_count(angle) * R::splat(1.0 / 4_294_967_296.0) * self.encoder_counts;
        // Into 0 to N before rounding, since to_count cuts toward zero.
        let counts = R::select(counts.lt(zero), counts + self.encoder_counts, counts);
        let nearest = (counts + R::splat(0.5)).to_count();
        let raw = R::count_add(self.encoder_zero, R::count_mul(self.direction, nearest));
        let below = R::of_count(raw).lt(zero);
        let raw = R::count_select(below, R::count_add(raw, self.counts_per_turn), raw);
        let above = self.encoder_counts.le(R::of_count(raw));
        R::count_select(above, R::count_sub(raw, self.counts_per_turn), raw)
    }
}

/// The nearest count that the converter has.
#[inline(always)]
fn convert<R: Real>(counts: R) -> R {
    let held = counts.greatest(R::splat(0.0)).least(R::splat(FULL_SCALE));
    R::of_count((held + R::splat(0.5)).to_count())
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::{Encoder, Sensors};
    use crate::{VIRTUAL_P3, Vector};

    fn with_encoder(counts_per_turn: u32, zero_counts: u32, reversed: bool) -> Sensors<f32> {
        let encoder = Encoder {
            counts_per_turn,
            zero_counts,
            reversed,
        };
        Sensors::new(&encoder, &VIRTUAL_P3.scales, [1833.0, 2071.0])
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
                let sensors = with_encoder(counts, zero, reversed);
                for step in 0..40_000_u32 {
                    let angle = step.wrapping_mul(107_374) as i32;
                    let raw = sensors.encoder(angle);
                    assert!((0..counts as i32).contains(&raw));
                    // Distance around the turn; f32 knows the angle to 2^-24 of it.
                    let turn = f64::from(counts);
                    let sign = if reversed { -1.0 } else { 1.0 };
                    let exact = f64::from(angle) / 4_294_967_296.0 * turn;
                    let error = f64::from(raw) - f64::from(zero) - sign * exact;
                    let error = error - (error / turn).round() * turn;
                    assert!(
                        error.abs() <= 0.5 + turn * 2.0_f64.powi(-24),
                        "{angle} {error}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_manuals_reading_under_phase_a() {
        let sensors = with_encoder(4096, 0x0DF8, false);
        assert_eq!(sensors.encoder(0), 0x0DF8);
        assert_eq!(sensors.encoder(1 << 30), (0x0DF8 + 1024) % 4096);
    }

    #[test]
    fn converters_have_their_zero_their_steps_and_their_ends() {
        let sensors = with_encoder(4096, 0, false);
        let adc = |alpha: f32| {
            sensors
                .sample(0, Vector { alpha, beta: 0.0 }, 48.0, 25.0)
                .phase_adc
        };
        assert_eq!(adc(0.0), [1833.0, 2071.0]);
        // 2.5 mA a count; phase B carries -1/2 of phase A.
        assert_eq!(adc(1.0), [2233.0, 1871.0]);
        assert_eq!(adc(0.001), [1833.0, 2071.0]);
        assert_eq!(adc(0.0015)[0], 1834.0);
        assert_eq!(adc(-0.0015)[0], 1832.0);
        assert_eq!(adc(100.0), [4095.0, 0.0]);
        assert_eq!(adc(-100.0), [0.0, 4095.0]);
        assert_eq!(adc(3.5)[0], 1833.0 + 1400.0);
        assert_eq!(adc(-3.5)[0], 1833.0 - 1400.0);
    }

    #[test]
    fn voltage_and_temperature() {
        let sensors = with_encoder(4096, 0, false);
        let read = |volts, celsius| {
            let sample = sensors.sample(0, Vector::zero(), volts, celsius);
            (sample.bus_adc, sample.temperature_adc)
        };
        // 17.6 mV and 0.05 K a count, the latter from -50 °C.
        assert_eq!(read(48.0, 25.0), (2727.0, 1500.0));
        assert_eq!(read(0.0, -50.0), (0.0, 0.0));
        assert_eq!(read(100.0, 1000.0), (4095.0, 4095.0));
    }
}
