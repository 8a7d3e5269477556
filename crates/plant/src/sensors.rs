//! What the drive sees of the world: whole counts.

use control::io::{Magnet, Sample};
use control::{Mask as _, Real};

use crate::encoder::{EncoderFault, Reader};
use crate::exponential::decayed_fraction;
use crate::noise::Noise;
use crate::{Invalid, Parameters, Vector};

/// The current sensors of phases A and B.
///
/// A reading is, before it is rounded and held between 0 and 4095,
///
/// zero + gain · current / (A per count) + noise,
///
/// with the zero of [`Parameters::current_zero_counts`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentSensors {
    /// What phases A and B read of a current, as a part of what they should; 1 is right.
    pub gain: [f32; 2],
    /// Standard deviation of a reading, counts.
    pub noise_counts: f32,
    /// Time constant of the sensors' low-pass filter, s.
    pub time_constant_s: f64,
}

impl CurrentSensors {
    /// Sensors without error but rounding.
    pub const IDEAL: Self = Self {
        gain: [1.0; 2],
        noise_counts: 0.0,
        time_constant_s: 0.0,
    };

    /// Whether such sensors can be.
    pub(crate) fn check(&self) -> Result<(), Invalid> {
        let [gain_a, gain_b] = self.gain.map(f64::from);
        for (value, most) in [
            (gain_a, 10.0),
            (gain_b, 10.0),
            (self.noise_counts.into(), 4095.0),
            (self.time_constant_s, 1.0),
        ] {
            if !(value >= 0.0 && value <= most) {
                return Err(Invalid::CurrentSensor(value));
            }
        }
        Ok(())
    }
}

/// Encoder and 12-bit converters. Every reading is rounded to the nearest count; the converters
/// saturate at 0 and 4095.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors<R: Real> {
    reader: Reader<R>,
    noise: Noise<R>,
    counts_per_a: [R; 2],
    current_zero: [R; 2],
    current_noise: R,
    is_noisy: bool,
    /// What the filter of the current sensors lets through in a PWM period; 1: all, no filter.
    passed: R,
    is_filtered: bool,
    filtered: Vector<R>,
    counts_per_v: R,
    counts_per_k: R,
    temperature_zero_c: R,
    motor_counts_per_k: R,
    motor_zero_c: R,
}

/// What there is to be sensed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed<R: Real> {
    /// Angle of the shaft, 2³² a turn.
    pub angle: R::Count,
    /// Speed of the shaft, rad/s.
    pub speed_rad_s: R,
    /// Stator current, A.
    pub current: Vector<R>,
    /// Bus voltage, V.
    pub bus_voltage_v: R,
    /// Temperature of the amplifier, °C.
    pub temperature_c: R,
}

const FULL_SCALE: f32 = 4095.0;

impl<R: Real> Sensors<R> {
    /// The sensors of a world.
    pub fn new(parameters: &Parameters) -> Self {
        let (scales, currents) = (&parameters.scales, &parameters.current_sensors);
        let per_a = |gain: f32| R::splat(gain / scales.current_a);
        let [gain_a, gain_b] = currents.gain;
        let [zero_a, zero_b] = parameters.current_zero_counts;
        let mut sensors = Self {
            reader: Reader::new(&parameters.encoder),
            noise: Noise::new(R::count(parameters.noise_seed as i32)),
            counts_per_a: [per_a(gain_a), per_a(gain_b)],
            current_zero: [R::splat(zero_a), R::splat(zero_b)],
            current_noise: R::splat(currents.noise_counts).sane(),
            is_noisy: currents.noise_counts != 0.0,
            passed: R::splat(1.0),
            is_filtered: false,
            filtered: Vector::zero(),
            counts_per_v: R::splat(1.0 / scales.voltage_v),
            counts_per_k: R::splat(1.0 / scales.temperature_k),
            temperature_zero_c: R::splat(scales.temperature_zero_c),
            motor_counts_per_k: R::splat(1.0 / scales.motor_temperature_k),
            motor_zero_c: R::splat(scales.motor_temperature_zero_c),
        };
        sensors.set_period_s(parameters);
        sensors
    }

    /// Takes over the PWM period of `parameters`.
    pub(crate) fn set_period_s(&mut self, parameters: &Parameters) {
        let time_constant = parameters.current_sensors.time_constant_s;
        self.is_filtered = time_constant > 0.0;
        if self.is_filtered {
            let passed = decayed_fraction(parameters.pwm_period_s / time_constant);
            self.passed = R::splat(passed as f32);
        }
    }

    /// Whether the current sensors want to see the current of every PWM period.
    #[inline(always)]
    pub(crate) fn is_filtered(&self) -> bool {
        self.is_filtered
    }

    /// One PWM period of the current sensors' filter.
    #[inline(always)]
    pub(crate) fn follow(&mut self, current: Vector<R>) {
        self.filtered = self.filtered + (current - self.filtered) * self.passed;
    }

    /// On to the noise of the next control period.
    #[inline(always)]
    pub(crate) fn advance(&mut self) {
        self.noise.advance();
    }

    /// Starts the noise anew from a seed.
    pub fn set_noise_seed(&mut self, seed: R::Count) {
        self.noise = Noise::new(seed);
    }

    /// What the sensor in a motor's winding of a temperature, °C, reads.
    pub(crate) fn motor_temperature_adc(&self, temperature_c: R) -> R {
        convert((temperature_c - self.motor_zero_c) * self.motor_counts_per_k)
    }

    /// What the encoder says of its magnet. A batch shares it.
    pub fn magnet(&self) -> Magnet {
        self.reader.magnet()
    }

    /// The encoder, to do something to it.
    pub(crate) fn reader(&mut self) -> &mut Reader<R> {
        &mut self.reader
    }

    /// Puts a fault into the encoder, or takes it out; one that sticks shows what it reads now.
    pub(crate) fn set_encoder_fault(&mut self, fault: EncoderFault, sensed: &Sensed<R>) {
        self.reader.set_fault(EncoderFault::None, R::count(0));
        let (reading, _) = self.encoder(sensed);
        self.reader.set_fault(fault, reading);
    }

    /// The encoder's reading and whether it is valid.
    #[inline(always)]
    fn encoder(&self, sensed: &Sensed<R>) -> (R::Count, R::Mask) {
        let mut draws = self.noise.draws();
        self.reader
            .read(sensed.angle, sensed.speed_rad_s, &mut draws)
    }

    /// Reads everything, except the trip of the gate drivers, which is no sensor's.
    #[inline(always)]
    pub fn sample(&self, sensed: &Sensed<R>) -> Sample<R> {
        let mut draws = self.noise.draws();
        let (encoder, encoder_valid) =
            self.reader
                .read(sensed.angle, sensed.speed_rad_s, &mut draws);
        let current = if self.is_filtered {
            self.filtered
        } else {
            sensed.current
        };
        let [a, b, _] = current.phases();
        let [per_a, per_b] = self.counts_per_a;
        let [zero_a, zero_b] = self.current_zero;
        let (mut a, mut b) = (a * per_a + zero_a, b * per_b + zero_b);
        if self.is_noisy {
            a += self.current_noise * draws.normal();
            b += self.current_noise * draws.normal();
        }
        let temperature = sensed.temperature_c - self.temperature_zero_c;
        Sample {
            phase_adc: [convert(a), convert(b)],
            encoder,
            bus_adc: convert(sensed.bus_voltage_v * self.counts_per_v),
            temperature_adc: convert(temperature * self.counts_per_k),
            overcurrent: R::Mask::splat(false),
            encoder_valid,
        }
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
    use super::{Sensed, Sensors};
    use crate::encoder::{Encoder, EncoderFault};
    use crate::{VIRTUAL_P3, Vector};
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

    fn adc(sensors: &Sensors<f32>, alpha: f32) -> [f32; 2] {
        let current = Vector { alpha, beta: 0.0 };
        sensors.sample(&Sensed { current, ..REST }).phase_adc
    }

    #[test]
    fn converters_have_their_zero_their_steps_and_their_ends() {
        let sensors = Sensors::<f32>::new(&VIRTUAL_P3);
        let adc = |alpha| adc(&sensors, alpha);
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
    fn current_sensors_have_their_gains_their_noise_and_their_delay() {
        let mut parameters = VIRTUAL_P3;
        parameters.current_sensors.gain = [1.05, 0.9];
        assert_eq!(
            adc(&Sensors::new(&parameters), 1.0),
            [1833.0 + 420.0, 2071.0 - 180.0]
        );
        parameters.current_sensors.noise_counts = 2.0;
        let mut sensors = Sensors::new(&parameters);
        let (mut squares, mut product) = ([0.0; 2], 0.0);
        for _ in 0..20_000 {
            sensors.advance();
            let [a, b] = adc(&sensors, 0.0).map(f64::from);
            let (a, b) = (a - 1833.0, b - 2071.0);
            squares = [squares[0] + a * a, squares[1] + b * b];
            product += a * b;
        }
        for square in squares {
            let variance = square / 20_000.0;
            assert!(
                (variance / (4.0 + 1.0 / 12.0) - 1.0).abs() < 0.04,
                "{variance}"
            );
        }
        assert!((product / 20_000.0).abs() < 0.15);
        // Five PWM periods of 10 µs at 25 µs: 1 - e^-2 of the way.
        parameters.current_sensors.noise_counts = 0.0;
        parameters.current_sensors.gain = [1.0; 2];
        parameters.current_sensors.time_constant_s = 25e-6;
        let mut sensors = Sensors::new(&parameters);
        for _ in 0..5 {
            sensors.follow(Vector {
                alpha: 2.0,
                beta: 0.0,
            });
        }
        let way = 1.0 - (-2.0_f32).exp();
        assert_eq!(adc(&sensors, 0.0)[0], 1833.0 + (800.0 * way).round());
    }

    #[test]
    fn voltage_and_temperature() {
        let sensors = Sensors::<f32>::new(&VIRTUAL_P3);
        let read = |bus_voltage_v, temperature_c| {
            let sample = sensors.sample(&Sensed {
                bus_voltage_v,
                temperature_c,
                ..REST
            });
            (sample.bus_adc, sample.temperature_adc)
        };
        // 17.6 mV and 0.05 K a count, the latter from -50 °C.
        assert_eq!(read(48.0, 25.0), (2727.0, 1500.0));
        assert_eq!(read(0.0, -50.0), (0.0, 0.0));
        assert_eq!(read(100.0, 1000.0), (4095.0, 4095.0));
    }
}
