//! Classes of change that dictionary rows tell (`Row::tells`), and the drive acts upon.
//!
//! These are the numbers of the first axis; rows of each further axis tell [`PER_AXIS`] more.

/// From the classes of an axis to those of the next.
pub const PER_AXIS: u8 = 10;

/// A target position was written.
pub const TARGET_POSITION: u8 = 1;
/// A target velocity was written.
pub const TARGET_VELOCITY: u8 = 2;
/// A target of velocity mode was written.
pub const TARGET_VL_VELOCITY: u8 = 8;
/// A target torque was written.
pub const TARGET_TORQUE: u8 = 3;
/// An electrical angle was written.
pub const TARGET_ANGLE: u8 = 6;
/// A phase voltage was written.
pub const TARGET_VOLTAGE: u8 = 7;
/// A limit, rate, window or option code of the axis was written.
pub const CONFIGURATION: u8 = 4;
/// A parameter of the motor, the amplifier or a controller was written.
pub const CONTROL: u8 = 5;
/// The touch probe function was written.
pub const TOUCH_PROBE: u8 = 9;
