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
    use crate::{VIRTUAL_P3, Vector};

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
