//! What the axis asks of the loops.

use crate::{Mask as _, Real};

/// One segment: where the demand starts and how it moves until the next one.
///
/// The axis sends one every millisecond or so; the loops interpolate at the control rate. The
/// segment starts at the next control period: the demand of that period is the start itself.
/// All quantities are in the user's direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<R: Real> {
    /// Whether the bridge switches.
    pub enabled: R::Mask,
    /// Whether the position loop is closed; it then feeds the velocity loop.
    pub position_loop: R::Mask,
    /// Whether the velocity loop is closed without the position loop. Neither: torque mode.
    pub velocity_loop: R::Mask,
    /// Position demand, whole counts, wrapping. Position loop only.
    pub position: R::Count,
    /// Position demand beyond the whole counts, 0 to 1.
    pub fraction: R,
    /// Slope of the position demand, or the velocity demand itself, counts/s.
    pub velocity: R,
    /// Slope of `velocity`, counts/s².
    pub acceleration: R,
    /// Added to the velocity demand, counts/s.
    pub velocity_offset: R,
    /// q-axis current demand in torque mode, feed-forward in the others, A of phase amplitude.
    pub current: R,
    /// Slope of `current`, A/s.
    pub current_slope: R,
    /// Added to `current` while the segment lasts: what its acceleration needs, A.
    pub acceleration_current: R,
    /// Control periods for which the slopes hold. Afterwards the demand stays: the velocity of a
    /// position demand and the current of an acceleration become 0 two periods later, so that a
    /// successor may be late by these; any other velocity or current stays what it has become.
    pub periods: R::Count,
    /// Greatest current, A, not negative.
    pub current_limit: R,
    /// Greatest velocity, counts/s, positive. It bounds the velocity demand; in torque mode it
    /// bounds the speed by taking back torque in that direction, never by braking.
    pub velocity_limit: R,
    /// Where the electrical frame comes from.
    pub frame: FrameSource<R>,
    /// All low sides are closed: the phases are shorted, and brake a motor that turns. For a frame
    /// whose voltage is given.
    pub shorted: R::Mask,
}

/// The limits of a [`Command`], to change them while its segment goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<R: Real> {
    /// See [`Command::current_limit`].
    pub current_a: R,
    /// See [`Command::velocity_limit`].
    pub velocity: R,
}

/// For calibration and the P3's modes 11 and 12: an electrical angle and a voltage from outside.
/// [`FrameSource::rotor`] is the ordinary case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameSource<R: Real> {
    /// The frame stands at `angle` instead of at the rotor (P3 modes 11 and 12, object 0x60EA).
    pub angle_given: R::Mask,
    /// Electrical angle of the d axis from phase A; 2³² are one turn.
    pub angle: R::Count,
    /// What is added to `angle` after each control period: a frame that turns by itself.
    pub turn: R::Count,
    /// `voltage_d_v` and `voltage_q_v` are applied and no loop is closed (P3 mode 12). The vector
    /// gives way only where its current exceeds the limit: the command's, the amplifier's or I²t's.
    pub voltage_given: R::Mask,
    /// Voltage of the d axis, V of phase amplitude.
    pub voltage_d_v: R,
    /// Voltage of the q axis, V of phase amplitude.
    pub voltage_q_v: R,
}

impl<R: Real> FrameSource<R> {
    /// The frame stands at the rotor and the current loop makes the voltage.
    pub fn rotor() -> Self {
        Self {
            angle_given: R::Mask::splat(false),
            angle: R::count(0),
            turn: R::count(0),
            voltage_given: R::Mask::splat(false),
            voltage_d_v: R::splat(0.0),
            voltage_q_v: R::splat(0.0),
        }
    }
}

impl<R: Real> Command<R> {
    /// Bridge off, no demand, no limits.
    pub fn idle() -> Self {
        let off = R::Mask::splat(false);
        let zero = R::splat(0.0);
        Self {
            enabled: off,
            position_loop: off,
            velocity_loop: off,
            position: R::count(0),
            fraction: zero,
            velocity: zero,
            acceleration: zero,
            velocity_offset: zero,
            current: zero,
            current_slope: zero,
            acceleration_current: zero,
            periods: R::count(0),
            current_limit: R::splat(f32::MAX),
            velocity_limit: R::splat(f32::MAX),
            frame: FrameSource::rotor(),
            shorted: off,
        }
    }
}

impl<R: Real> Default for Command<R> {
    fn default() -> Self {
        Self::idle()
    }
}
