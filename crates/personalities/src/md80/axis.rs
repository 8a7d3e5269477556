//! "Profile Specific Area": the rows, and where the drive core finds its values in them.

use canopen::Group::Application;
use canopen::row::{i8, i16, i32, u16, u32};
use canopen::{Dictionary, Row};
use cia402::{Mode, ModeSet};

use super::internal::COUNTS_PER_TURN;
use super::settings::parameter;
use crate::class::{CONFIGURATION, TARGET_POSITION, TARGET_VELOCITY};
use crate::p3::motor::feedback;
use crate::p3::{plain, scaled};
use crate::{
    AxisObjects, ConfigurationObjects, FeedbackObjects, Figure, TargetObjects, TargetWindow,
};

/// −1, in which system commands are given: the axis rests (M3).
pub(super) const SERVICE: Mode = Mode(-1);

/// The page's modes.
pub(super) const MODES: ModeSet = ModeSet::EMPTY
    .with(SERVICE)
    .with(Mode::IDLE)
    .with(Mode::PROFILE_POSITION)
    .with(Mode::PROFILE_VELOCITY)
    .with(Mode::CYCLIC_POSITION)
    .with(Mode::CYCLIC_VELOCITY);

const fn limit(row: Row) -> Row {
    row.rw().tells(CONFIGURATION)
}

/// One that is kept ("NVM: yes").
const fn kept(row: Row) -> Row {
    limit(row).store(Application)
}

/// The page's objects. M11: some are signed that have no negative values, and are so here.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    u16(0x6040, 0, "Control Word").rw().rpdo().asks(),
    feedback(u16(0x6041, 0, "Status Word")),
    i8(0x6060, 0, "Modes Of Operation").rw().rpdo().asks(),
    feedback(i8(0x6061, 0, "Modes Of Operation Display")),
    // M21: no PDO, while 0x606B has one.
    i32(0x6062, 0, "Position Demand Value").unit("inc").live(),
    feedback(i32(0x6064, 0, "Position Actual Value").unit("inc")),
    limit(i32(0x6067, 0, "Position Window").unit("inc").range(0, i32::MAX as i64)).tpdo(),
    feedback(i32(0x606B, 0, "Velocity Demand Value").unit("RPM")),
    feedback(i32(0x606C, 0, "Velocity Actual Value").unit("RPM")),
    limit(i32(0x606D, 0, "Velocity Window").unit("RPM").range(0, i32::MAX as i64)).tpdo(),
    kept(u16(0x6072, 0, "Max Torque").unit("permille").range(0, 32_767)).rpdo(),
    parameter(u16(0x6073, 0, "Max Current").unit("permille").range(0, 50_000)).rpdo(),
    parameter(i32(0x6075, 0, "Motor Rated Current").unit("mA").range(0, 1_000_000)),
    parameter(i32(0x6076, 0, "Motor Rated Torque").unit("mNm").range(0, 1_000_000)),
    // M9: the page's text speaks of velocity.
    feedback(i16(0x6077, 0, "Torque Actual Value").unit("permille")),
    // M10: "RX" of a read-only object.
    feedback(u32(0x6079, 0, "DC Link Circuit Voltage").unit("mV")),
    i32(0x607A, 0, "Target Position").rw().rpdo().unit("inc").tells(TARGET_POSITION),
    // M15: both 0 is no limit.
    kept(i32(0x607D, 1, "Min Position Limit").unit("inc")).rpdo(),
    kept(i32(0x607D, 2, "Max Position Limit").unit("inc")).rpdo(),
    // M24: neither this nor the accelerations are kept, while the profile velocity is.
    limit(u32(0x6080, 0, "Max Motor Speed").unit("RPM").default(1000)).rpdo(),
    kept(u32(0x6081, 0, "Profile Velocity").unit("RPM")).rpdo(),
    limit(u32(0x6083, 0, "Profile Acceleration").unit("RPM/s")).rpdo(),
    limit(u32(0x6084, 0, "Profile Deceleration").unit("RPM/s")).rpdo(),
    i32(0x60FF, 0, "Target Velocity").rw().rpdo().unit("RPM").tells(TARGET_VELOCITY),
    // M5: with bits of modes 2 and 10, which the drive has not, and without that of mode 9, which it has.
    i32(0x6502, 0, "Supported Drive Modes").constant().default(647),
];

/// M17: not on the page, which has a quick stop and a warning of clipped acceleration all the same.
#[rustfmt::skip]
pub(super) const MORE_ROWS: &[Row] = &[
    limit(u32(0x6085, 0, "Quick Stop Deceleration").unit("RPM/s").default(10_000)).rpdo(),
    limit(u32(0x60C5, 0, "Max Acceleration").unit("RPM/s")).rpdo(),
    limit(u32(0x60C6, 0, "Max Deceleration").unit("RPM/s")).rpdo(),
];

/// Counts/s of 1 RPM.
const RPM: f32 = COUNTS_PER_TURN as f32 / 60.0;

/// Where the axis finds its objects.
pub(super) const fn axis<const N: usize>(objects: &Dictionary<N>) -> AxisObjects {
    AxisObjects {
        base: 0x6000,
        statusword: objects.optional(0x6041, 0),
        mode_display: objects.need(0x6061, 0),
        targets: TargetObjects {
            ..TargetObjects::only(plain(objects, 0x607A, 0), scaled(objects, 0x60FF, 0, RPM))
        },
        feedback: FeedbackObjects {
            torque: Some(plain(objects, 0x6077, 0)),
            position_demand: Some(plain(objects, 0x6062, 0)),
            velocity_demand: [Some(scaled(objects, 0x606B, 0, RPM)), None],
            bus_voltage_v: Some(scaled(objects, 0x6079, 0, 1e-3)),
            ..FeedbackObjects::only(plain(objects, 0x6064, 0), scaled(objects, 0x606C, 0, RPM))
        },
        configuration: ConfigurationObjects {
            quick_stop_deceleration: Some(scaled(objects, 0x6085, 0, RPM)),
            max_velocity: [Some(scaled(objects, 0x6080, 0, RPM)), None],
            max_motor_velocity: Some(scaled(objects, 0x6080, 0, RPM)),
            max_acceleration: Some(scaled(objects, 0x60C5, 0, RPM)),
            max_deceleration: Some(scaled(objects, 0x60C6, 0, RPM)),
            position_limits: Some((plain(objects, 0x607D, 1), plain(objects, 0x607D, 2))),
            position_window: TargetWindow::Size(plain(objects, 0x6067, 0)),
            velocity_window: TargetWindow::Size(scaled(objects, 0x606D, 0, RPM)),
            // The smallest speed that the drive shows.
            velocity_threshold: RPM,
            ..ConfigurationObjects::only(
                scaled(objects, 0x6081, 0, RPM),
                scaled(objects, 0x6083, 0, RPM),
                scaled(objects, 0x6084, 0, RPM),
                plain(objects, 0x6072, 0),
            )
        },
        homing: None,
        rated_torque_nm: Figure::Object(scaled(objects, 0x6076, 0, 1e-3)),
        polarity: None,
        gear: Some(objects.need(0x2000, 8)),
    }
}
