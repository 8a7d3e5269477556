//! "Manufacturer Specific Area": 0x2000 to 0x2006.

use canopen::Group::Application;
use canopen::row::{bool, f32, string, u8, u16, u32};
use canopen::{Address, Row};

use crate::class::{CONFIGURATION, CONTROL};
use crate::p3::motor::feedback;

/// A parameter that is kept ("NVM: yes").
const fn kept(row: Row) -> Row {
    row.rw().store(Application)
}

/// One of which the controllers are made.
pub(super) const fn parameter(row: Row) -> Row {
    kept(row).tells(CONTROL)
}

/// "Write a non-zero value to start a specific action": any, although it is a BOOLEAN (M28).
const fn command(sub: u8, name: &'static str) -> Row {
    let row = bool(0x2003, sub, name).rw().asks();
    Row {
        minimum: None,
        maximum: None,
        ..row
    }
}

/// M16: the page says RW; it is read only in practice, and a write of 0 does nothing.
const fn status(sub: u8, name: &'static str) -> Row {
    u32(0x2004, sub, name).rw().asks().live()
}

/// Index of "Motor Settings".
pub(super) const MOTOR_SETTINGS: u16 = 0x2000;

/// M12: defaults of 0 lie outside the ranges and say "not configured".
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    parameter(u32(0x2000, 1, "Pole Pairs").range(2, 255).unset()),
    parameter(f32(0x2000, 2, "Torque constant").unit("Nm/A")).asks(),
    parameter(f32(0x2000, 3, "Phase Inductance").unit("H")).asks(),
    parameter(f32(0x2000, 4, "Phase Resistance").unit("Ohm")).asks(),
    // M13: 2000 on other pages of the maker.
    parameter(u16(0x2000, 5, "Torque Bandwidth").unit("Hz").range(50, 2500).unset()),
    kept(string(0x2000, 6, "Motor Name", 20)),
    kept(u8(0x2000, 7, "Motor Shutdown Temperature").unit("degC").range(10, 80).unset()),
    parameter(f32(0x2000, 8, "Gear Ratio").default_value(canopen::Default::Real(1.0))).asks(),
    kept(u8(0x2000, 9, "Calibration Mode").range(0, 1)),
    // M14: in force after a save and the start that follows it.
    kept(u32(0x2000, 10, "Can ID").range(1, 31).default(1)),
    // Not on the page; its bit of "Communication Status" is.
    kept(u16(0x2000, 12, "Can Watchdog").unit("ms").range(0, 2000).default(250)),
    parameter(f32(0x2001, 1, "Kp")).asks(),
    parameter(f32(0x2001, 2, "Ki")).asks(),
    parameter(f32(0x2001, 3, "Kd")).asks(),
    parameter(f32(0x2001, 4, "Integral Limit").unit("Nm")).asks(),
    parameter(f32(0x2002, 1, "Kp")).asks(),
    parameter(f32(0x2002, 2, "Ki")).asks(),
    parameter(f32(0x2002, 3, "Kd")).asks(),
    parameter(f32(0x2002, 4, "Integral Limit").unit("rad/s")).asks(),
    command(1, "Blink LEDs"),
    command(2, "Reset Controller"),
    command(3, "Run Calibration"),
    command(4, "Run Output Encoder Calibration"),
    command(5, "Set Zero"),
    command(6, "Calibrate Current PI Gains"),
    status(1, "Main Encoder Status"),
    status(2, "Output Encoder Status"),
    status(3, "Calibration Status"),
    status(4, "Bridge Status"),
    status(5, "Hardware Status"),
    // "DEPRECATED"; in the EDS "Homing Status".
    status(6, "DEPRECATED"),
    status(7, "Motion Status"),
    status(8, "Communication Status"),
    // 0, the default, is no encoder; the maker's own files write it.
    kept(u32(0x2005, 1, "Type").range(0, 3)).tells(CONFIGURATION),
    kept(u32(0x2005, 2, "Calibration Mode").range(0, 1)),
    kept(u32(0x2005, 3, "Mode").range(0, 3)).tells(CONFIGURATION),
    feedback(f32(0x2005, 4, "Position").unit("rad")),
    feedback(f32(0x2005, 5, "Velocity").unit("rad/s")),
    feedback(f32(0x2006, 1, "Motor Temperature").unit("degC")),
    feedback(f32(0x2006, 2, "Mosfet Temperature").unit("degC")),
];

/// The range of a REAL32 object, inclusive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RealRange {
    /// The object.
    pub object: Address,
    /// The least value.
    pub least: f32,
    /// The greatest value.
    pub greatest: f32,
}

const fn range(index: u16, sub: u8, least: f32, greatest: f32) -> RealRange {
    RealRange {
        object: Address::new(index, sub),
        least,
        greatest,
    }
}

/// Ranges of REAL32 objects. The page says those of inductance and resistance; the others are our
/// own, so that no controller gets a sign or a size that it cannot have.
pub const REAL_RANGES: &[RealRange] = &[
    range(0x2000, 2, 1e-6, 1000.0),
    range(0x2000, 3, 5e-9, 0.1),
    range(0x2000, 4, 5e-3, 20.0),
    range(0x2000, 8, 1e-4, 1e4),
    range(0x2001, 1, 0.0, 1e6),
    range(0x2001, 2, 0.0, 1e6),
    range(0x2001, 3, 0.0, 1e6),
    range(0x2001, 4, 0.0, 1e6),
    range(0x2002, 1, 0.0, 1e6),
    range(0x2002, 2, 0.0, 1e6),
    range(0x2002, 3, 0.0, 1e6),
    range(0x2002, 4, 0.0, 1e6),
];
