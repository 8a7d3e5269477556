//! What the manual has of CiA 402: the rows, and where the drive core finds its values in them.

use canopen::Group::Application;
use canopen::row::{i8, i16, i32, u16, u32};
use canopen::{Dictionary, Row};
use cia402::{Mode, ModeSet};

use super::motor::RATED_TORQUE_NM;
use super::properties::{self, MAX_TORQUE, MAX_VELOCITY, MECHANICAL};
use crate::class::{CONFIGURATION, TARGET_POSITION, TARGET_TORQUE, TARGET_VELOCITY};
use crate::p3::{plain, scaled};
use crate::{
    AxisObjects, ConfigurationObjects, FeedbackObjects, Figure, TargetObjects, TargetWindow,
};

/// What the axis is put into for the manual's modes: see `behaviour.rs`.
pub(super) const MODES: ModeSet = ModeSet::EMPTY
    .with(Mode::IDLE)
    .with(Mode::CYCLIC_POSITION)
    .with(Mode::PROFILE_VELOCITY)
    .with(Mode::PROFILE_TORQUE)
    .with(Mode::PROFILE_POSITION);

const fn feedback(row: Row) -> Row {
    row.tpdo().live()
}

const fn target(row: Row) -> Row {
    row.rw().rpdo().tpdo()
}

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    // 0 to 7 as 0x6060; taken when the drive first goes operational.
    i8(0x3F60, 0, "Default mode").rw().asks().store(Application),
    // J11: of 0x6063 and 0x6064; "0x2280" is no object.
    feedback(i32(0x3F63, 0, "Set actual position").unit("cts")).rw().rpdo().asks(),
    // J14: these three are not implemented. They read 0.
    u16(0x603F, 0, "Error codes (not implemented)").tpdo(),
    target(u16(0x6040, 0, "Control word (not implemented)")).asks(),
    u16(0x6041, 0, "Status word (not implemented)").tpdo(),
    target(i8(0x6060, 0, "Set mode of operation")).asks(),
    feedback(i8(0x6061, 0, "Read mode of operation")),
    feedback(i32(0x6062, 0, "Position demand value").unit("cts")),
    feedback(i32(0x6063, 0, "Position actual internal value").unit("cts")),
    feedback(i32(0x6064, 0, "Position actual value").unit("cts")),
    feedback(i32(0x6069, 0, "Velocity sensor actual value").unit("cts/s")),
    feedback(i32(0x606B, 0, "Velocity demand value").unit("rad/s/65536")), // J13
    feedback(i32(0x606C, 0, "Velocity actual value").unit("rad/s/65536")), // J13
    target(u32(0x606F, 0, "Digital outputs (not implemented)")).asks(),
    // J15: the target of mode 4. No unit: per mille of rated torque, as 0x6071 of 2019.
    target(i16(0x6074, 0, "Demanded torque").unit("permille")).tells(TARGET_TORQUE),
    // Asks, because in mode 7 each write starts a trajectory.
    target(i32(0x607A, 0, "Profile target position").unit("cts")).asks().tells(TARGET_POSITION),
    // J21: signed, without a unit; as in 2019.
    rate(i32(0x6083, 0, "Profile acceleration")),
    rate(i32(0x6084, 0, "Profile deceleration")),
    // J13: as 0x606B and 0x606C.
    target(i32(0x60FF, 0, "Velocity target").unit("rad/s/65536")).tells(TARGET_VELOCITY),
];

const fn rate(row: Row) -> Row {
    target(row)
        .unit("cts/s2")
        .range(1, i32::MAX as i64)
        .default(2_000_000)
        .store(Application)
        .tells(CONFIGURATION)
}

/// Counts/s of 2⁻¹⁶ rad/s: 4096 counts a turn.
pub(super) const Q16_RAD_PER_S: f32 = 4096.0 / core::f32::consts::TAU / 65_536.0;

/// Where the axis finds its objects. The manual prints no more of them; what a property holds is taken
/// from there.
pub(super) const fn axis<const N: usize>(objects: &Dictionary<N>) -> AxisObjects {
    // Counts/ms.
    let max_velocity = properties::object(objects, MAX_VELOCITY, 1000.0);
    AxisObjects {
        base: 0x6000,
        statusword: None,
        mode_display: objects.need(0x6061, 0),
        targets: TargetObjects {
            torque: Some(plain(objects, 0x6074, 0)),
            ..TargetObjects::only(
                plain(objects, 0x607A, 0),
                scaled(objects, 0x60FF, 0, Q16_RAD_PER_S),
            )
        },
        feedback: FeedbackObjects {
            position_demand: Some(plain(objects, 0x6062, 0)),
            velocity_demand: [Some(scaled(objects, 0x606B, 0, Q16_RAD_PER_S)), None],
            bus_voltage_v: Some(scaled(objects, 0x2201, 0, 1.0 / 256.0)),
            temperature_c: Some(scaled(objects, 0x2202, 0, 1.0 / 256.0)),
            raw_encoder: Some(properties::object(objects, MECHANICAL, 1.0)),
            ..FeedbackObjects::only(
                plain(objects, 0x6064, 0),
                scaled(objects, 0x606C, 0, Q16_RAD_PER_S),
            )
        },
        configuration: ConfigurationObjects {
            max_velocity: [Some(max_velocity), None],
            max_motor_velocity: Some(max_velocity),
            // Nothing shows whether a target is reached.
            position_window: TargetWindow::Fixed {
                size: 20,
                time_ms: 0,
            },
            velocity_window: TargetWindow::Fixed {
                size: 683,
                time_ms: 0,
            },
            velocity_window_percent: 2,
            velocity_threshold: 683.0,
            ..ConfigurationObjects::only(
                max_velocity,
                plain(objects, 0x6083, 0),
                plain(objects, 0x6084, 0),
                properties::object(objects, MAX_TORQUE, 1.0),
            )
        },
        homing: None,
        rated_torque_nm: Figure::Fixed(RATED_TORQUE_NM),
        polarity: None,
        gear: None,
    }
}
