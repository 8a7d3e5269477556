//! The rate of bridge and loops, and what switches and converters take their time for.

use canopen::Image;
use control::Real as _;
use personalities::{AmplifierObjects, BridgeTimeObjects};

use crate::ParameterError;
use crate::configuration::value;

/// The rate of the bridge and of the loops, and what else the PWM timer is to be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PwmTiming {
    /// PWM frequency, Hz; not 0.
    pub frequency_hz: u32,
    /// When the current converters begin to look, ns after the middle of the timer's pulse at which
    /// a control period begins; negative before it. What they hold is then the current in the middle
    /// of the switches' pulse, where it is the mean of the period.
    pub sampling_starts_ns: i32,
    /// For how long after each switching both switches of a half bridge are open, ns.
    pub dead_time_ns: u16,
    /// PWM periods per control period; not 0.
    pub periods_per_control: u8,
    /// By how many whole PWM periods the timer takes a duty later than at the end of the PWM period
    /// with which its control period begins, because the converters are not ready before.
    pub late_periods: u8,
}

impl PwmTiming {
    /// A timer at `frequency_hz` (not 0) whose bridge and converters take no time.
    pub const fn at(frequency_hz: u32, periods_per_control: u8) -> PwmTiming {
        PwmTiming {
            frequency_hz,
            sampling_starts_ns: 0,
            dead_time_ns: 0,
            periods_per_control,
            late_periods: 0,
        }
    }

    /// Control period, s.
    pub fn control_period_s(self) -> f32 {
        f32::from(self.periods_per_control) / self.frequency_hz as f32
    }

    /// The time of `n` control periods, ns, rounded down; 0 for a negative number.
    pub(crate) fn control_periods_ns(self, n: i32) -> u32 {
        let pwm = u64::try_from(n).unwrap_or(0) * u64::from(self.periods_per_control);
        let ns = pwm.saturating_mul(1_000_000_000) / u64::from(self.frequency_hz.max(1));
        u32::try_from(ns).unwrap_or(u32::MAX)
    }

    /// Control periods in `ns`, rounded up.
    pub(crate) fn control_periods(self, ns: u32) -> i32 {
        let pwm = u64::from(ns) * u64::from(self.frequency_hz);
        let control = pwm.div_ceil(u64::from(self.periods_per_control.max(1)) * 1_000_000_000);
        i32::try_from(control).unwrap_or(i32::MAX)
    }
}

/// What the loops make of the times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LoopTimes {
    /// The same in s.
    pub(crate) dead_time_s: f32,
    /// How much later than the timer the switches switch, s: the mean of what it can be.
    pub(crate) propagation_s: f32,
    /// From the begin of a control period until the timer takes its duty, s.
    pub(crate) load_delay_s: f32,
    /// Part of the PWM period for which a phase must stay on a rail, so that the converters can look.
    pub(crate) duty_margin: f32,
}

/// Reads the timer's settings.
///
/// A phase stays on a rail for as long as the converters need: they have looked by the middle of the
/// pulse, and before that the sensors must have settled. The dead time, which lengthens a pulse at one
/// end only, and what the drivers are apart come on top.
///
/// # Errors
/// The first [`ParameterError`].
pub(crate) fn read_timing(
    image: &Image<'_>,
    amplifier: &AmplifierObjects,
) -> Result<(PwmTiming, LoopTimes), ParameterError> {
    let frequency = value(image, amplifier.pwm_frequency_hz) as i64;
    let frequency_hz = match u32::try_from(frequency) {
        Ok(frequency_hz) if frequency_hz > 0 => frequency_hz,
        _ => return Err(ParameterError::PwmFrequency(frequency)),
    };
    let times = Times::read(image, &amplifier.times);
    let period_ns = 1_000_000_000 / frequency_hz;
    if times.spread > times.dead {
        return Err(ParameterError::DeadTime {
            ns: times.dead,
            least_ns: times.spread,
        });
    }
    let pulse_ns = times.pulse_ns();
    if 2 * pulse_ns > period_ns {
        return Err(ParameterError::SamplingPulse {
            ns: pulse_ns,
            period_ns,
        });
    }
    let propagation_ns = u32::from(times.least) + u32::from(times.spread) / 2;
    let ready_ns = propagation_ns + u32::from(times.conversion);
    let late = ready_ns / period_ns.max(1);
    let last = u32::from(amplifier.pwm_per_control.saturating_sub(1));
    if late > last {
        return Err(ParameterError::Conversion {
            ns: ready_ns,
            period_ns,
        });
    }
    let pwm_period_s = 1.0 / frequency_hz as f32;
    let timing = PwmTiming {
        sampling_starts_ns: propagation_ns as i32 - i32::from(times.sampling),
        dead_time_ns: times.dead,
        late_periods: late as u8,
        ..PwmTiming::at(frequency_hz, amplifier.pwm_per_control)
    };
    let loops = LoopTimes {
        dead_time_s: f32::from(times.dead) * 1e-9,
        propagation_s: propagation_ns as f32 * 1e-9,
        load_delay_s: (late + 1) as f32 * pwm_period_s,
        duty_margin: (pulse_ns as f32 * 1e-9 * frequency_hz as f32).least(0.5),
    };
    Ok((timing, loops))
}

/// The objects, ns.
#[derive(Clone, Copy, Debug)]
struct Times {
    dead: u16,
    least: u16,
    spread: u16,
    settling: u16,
    sampling: u16,
    conversion: u16,
}

impl Times {
    fn read(image: &Image<'_>, objects: &BridgeTimeObjects) -> Times {
        // A cast holds what is beyond at the type's end.
        let ns = |figure| value(image, figure) as u16;
        Times {
            dead: ns(objects.dead_time),
            least: ns(objects.propagation),
            spread: ns(objects.propagation_spread),
            settling: ns(objects.settling),
            sampling: ns(objects.sampling),
            conversion: ns(objects.conversion),
        }
    }

    /// The shortest pulse in which a current can be read, ns. Converters of which no time is known
    /// read it whenever they look.
    fn pulse_ns(&self) -> u32 {
        match u32::from(self.settling) + u32::from(self.sampling) {
            0 => 0,
            quiet => 2 * quiet + u32::from(self.dead) + u32::from(self.spread),
        }
    }
}
