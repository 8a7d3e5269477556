//! What the controllers shall do next.

use crate::arithmetic::split;

/// An order to the control half, in force from the next control boundary until another one comes.
///
/// A segment runs for `duration_ns`; from then on its end value holds with zero slope. A duration
/// of 0 holds the start value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// The bridge is off and the motor free.
    Off,
    /// Enabled, and no torque: the bridge is off, the motor free.
    Idle,
    /// Torque control.
    Torque {
        /// Per mille of rated torque.
        start_pm: f32,
        /// Per mille of rated torque per second.
        slope_pm_per_s: f32,
        /// Length of the segment.
        duration_ns: u32,
    },
    /// Torque control in an electrical frame from outside: the torque's current flows a quarter of
    /// an electrical turn before `angle`.
    TorqueWithAngle {
        /// Electrical angle of the frame's d axis from phase A, 1/65,536 turn.
        angle: i16,
        /// Per mille of rated torque.
        start_pm: f32,
        /// Per mille of rated torque per second.
        slope_pm_per_s: f32,
        /// Length of the segment.
        duration_ns: u32,
    },
    /// The phases are shorted: a motor that turns brakes itself. From a drive's own behaviour only.
    Shorted,
    /// A voltage vector that turns by itself, to measure with. From own behaviour only.
    TurningVoltage {
        /// Electrical turns per second.
        turns_per_s: f32,
        /// Its length, 1/32,768 of the longest vector that the supply allows.
        voltage: i16,
    },
    /// A voltage vector in an electrical frame from outside; no controller.
    PhaseVoltage {
        /// Electrical angle of the frame's d axis from phase A, 1/65,536 turn.
        angle: i16,
        /// Voltage of the d axis, 1/32,768 of the longest vector that the supply allows.
        voltage_d: i16,
        /// Voltage of the q axis, in the same unit.
        voltage_q: i16,
    },
    /// A voltage a quarter of a turn before the rotor, where it makes torque; no controller.
    RotorVoltage {
        /// 1/32,768 of the longest vector that the supply allows.
        voltage_q: i16,
    },
    /// Velocity control.
    Velocity {
        /// Counts/s.
        start: f32,
        /// Counts/s².
        acceleration: f32,
        /// Added to the velocity controller's output, per mille of rated torque.
        torque_offset_pm: f32,
        /// Length of the segment.
        duration_ns: u32,
    },
    /// Position control.
    Position {
        /// Whole counts, wrapping.
        start: i32,
        /// Fraction of a count, 0 to below 1.
        fraction: f32,
        /// Counts/s at the start.
        velocity: f32,
        /// Counts/s².
        acceleration: f32,
        /// Added to the position controller's output, counts/s.
        velocity_offset: f32,
        /// Added to the velocity controller's output, per mille of rated torque.
        torque_offset_pm: f32,
        /// Length of the segment.
        duration_ns: u32,
    },
}

/// The values of a demand at one moment; those it does not have are 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Whole counts, wrapping.
    pub position: i32,
    /// Fraction of a count, 0 to below 1.
    pub fraction: f32,
    /// Counts/s, without offset.
    pub velocity: f32,
    /// Per mille of rated torque, without offset.
    pub torque_pm: f32,
}

impl Demand {
    /// The values `elapsed_ns` after the start: what the control half's interpolation approximates.
    pub fn at(&self, elapsed_ns: u32) -> Point {
        let time = |duration: u32| f64::from(elapsed_ns.min(duration)) * 1e-9;
        // At its very end a segment still has its slope; only a late successor finds it at rest.
        let running = |duration: u32| elapsed_ns <= duration;
        match *self {
            Demand::Off
            | Demand::Idle
            | Demand::Shorted
            | Demand::TurningVoltage { .. }
            | Demand::RotorVoltage { .. }
            | Demand::PhaseVoltage { .. } => Point::default(),
            Demand::Torque {
                start_pm,
                slope_pm_per_s,
                duration_ns,
            }
            | Demand::TorqueWithAngle {
                start_pm,
                slope_pm_per_s,
                duration_ns,
                ..
            } => Point {
                torque_pm: (f64::from(start_pm) + f64::from(slope_pm_per_s) * time(duration_ns))
                    as f32,
                ..Point::default()
            },
            Demand::Velocity {
                start,
                acceleration,
                duration_ns,
                ..
            } => Point {
                velocity: (f64::from(start) + f64::from(acceleration) * time(duration_ns)) as f32,
                ..Point::default()
            },
            Demand::Position {
                start,
                fraction,
                velocity,
                acceleration,
                duration_ns,
                ..
            } => {
                let t = time(duration_ns);
                let v = f64::from(velocity);
                let a = f64::from(acceleration);
                let (position, fraction) = whole(
                    i64::from(start),
                    f64::from(fraction) + (v + 0.5 * a * t) * t,
                );
                Point {
                    position,
                    fraction,
                    velocity: if running(duration_ns) {
                        (v + a * t) as f32
                    } else {
                        0.0
                    },
                    torque_pm: 0.0,
                }
            }
        }
    }

    /// Whether the values change with time.
    pub(crate) fn moves(&self) -> bool {
        match *self {
            Demand::Off
            | Demand::Idle
            | Demand::Shorted
            | Demand::TurningVoltage { .. }
            | Demand::RotorVoltage { .. }
            | Demand::PhaseVoltage { .. } => false,
            Demand::Torque { duration_ns, .. }
            | Demand::TorqueWithAngle { duration_ns, .. }
            | Demand::Velocity { duration_ns, .. }
            | Demand::Position { duration_ns, .. } => duration_ns > 0,
        }
    }
}

/// A position as the wrapped count and a fraction below 1 also after rounding to `f32`.
pub(crate) fn whole(base: i64, relative: f64) -> (i32, f32) {
    let (counts, fraction) = split(relative);
    let position = base.wrapping_add(counts);
    let fraction = fraction as f32;
    if fraction < 1.0 {
        (position as i32, fraction)
    } else {
        (position.wrapping_add(1) as i32, 0.0)
    }
}
