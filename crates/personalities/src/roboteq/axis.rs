//! One motor channel: the rows of CiA 402, and where the drive core finds its values in them.

use canopen::Group::Application;
use canopen::row::{i8, i16, i32, u8, u16, u32};
use canopen::{Dictionary, Row};
use cia402::{Mode, ModeSet};

use super::motor::{self, MOTOR};
use crate::class::{
    CONFIGURATION, PER_AXIS, TARGET_POSITION, TARGET_TORQUE, TARGET_VELOCITY, TARGET_VL_VELOCITY,
};
use crate::p3::{plain, scaled};
use crate::{
    AxisObjects, AxisPersonality, ConfigurationObjects, FeedbackObjects, Figure, TargetObjects,
    TargetWindow,
};

/// What the axis is put into for the document's modes: see [`super::mode`].
pub(super) const MODES: ModeSet = ModeSet::EMPTY
    .with(Mode::IDLE)
    .with(Mode::PROFILE_POSITION)
    .with(Mode::VELOCITY)
    .with(Mode::PROFILE_VELOCITY)
    .with(Mode::PROFILE_TORQUE)
    .with(Mode::CYCLIC_POSITION);

/// Index of channel `n`'s objects, 0 for the first.
pub(super) const fn base(n: u8) -> u16 {
    0x6000 + 0x800 * n as u16
}

/// The default of MAC and MDEC (R11), 0.1 RPM/s.
const RATE: i64 = 20_000;

/// "R": a command that may come by PDO. It asks, because with the state machine off it acts by itself.
const fn command(row: Row) -> Row {
    row.rw().rpdo().asks()
}

/// The same of what a ramp or a limit is: the watchdog of commands must hear of it.
const fn parameter(row: Row, n: u8) -> Row {
    command(row).tells(CONFIGURATION + n * PER_AXIS)
}

/// "T".
const fn feedback(row: Row) -> Row {
    row.tpdo().live()
}

/// A parameter that is stored.
const fn configuration(row: Row, n: u8) -> Row {
    row.rw()
        .store(Application)
        .tells(CONFIGURATION + n * PER_AXIS)
}

/// How many rows a channel has.
pub(super) const ROWS: usize = 50;

/// The rows of channel `n`, 0 for the first.
#[rustfmt::skip]
pub(super) const fn rows(n: u8) -> [Row; ROWS] {
    let axis = base(n);
    let class = n * PER_AXIS;
    let channel = n + 1;
    [
        // R5: 16 bits, as in the standard.
        command(u16(axis + 0x40, 0, "Control word (CW)")),
        feedback(u16(axis + 0x41, 0, "Status word (SW)")),
        command(i16(axis + 0x42, 0, "vl target velocity (S)").unit("RPM")).tells(TARGET_VL_VELOCITY + class),
        feedback(i16(axis + 0x43, 0, "vl velocity demand (RMP)").unit("RPM")),
        feedback(i16(axis + 0x44, 0, "vl velocity actual value (F)").unit("RPM")), // R6
        parameter(u32(axis + 0x46, 1, "vl velocity min amount (SPL)").unit("RPM"), n),
        parameter(u32(axis + 0x46, 2, "vl velocity max amount (SPL)").unit("RPM"), n).default(1000),
        parameter(u32(axis + 0x48, 1, "vl acceleration, delta speed (SAC)").unit("0.1RPM"), n).default(RATE),
        parameter(u16(axis + 0x48, 2, "vl acceleration, delta time (SAC)").unit("s"), n).default(1),
        parameter(u32(axis + 0x49, 1, "vl deceleration, delta speed (SDC)").unit("0.1RPM"), n).default(RATE),
        parameter(u16(axis + 0x49, 2, "vl deceleration, delta time (SDC)").unit("s"), n).default(1),
        command(i8(axis + 0x60, 0, "Modes of operation (ROM)")),
        feedback(i8(axis + 0x61, 0, "Modes of operation display (AOM)")), // R15
        feedback(i32(axis + 0x64, 0, "Position actual value (F)")),
        feedback(i32(axis + 0x6C, 0, "Velocity actual value (F)").unit("RPM")),
        command(i16(axis + 0x71, 0, "Target torque (TC)").unit("0.1A")).tells(TARGET_TORQUE + class), // R12
        feedback(i16(axis + 0x77, 0, "Torque actual value (A)").unit("0.1A")),
        command(i32(axis + 0x7A, 0, "Target position (POS)")).tells(TARGET_POSITION + class),
        parameter(u32(axis + 0x81, 0, "Profile velocity (PSP)").unit("RPM"), n).default(1000),
        parameter(u32(axis + 0x83, 0, "Profile acceleration (PAC)").unit("0.1RPM/s"), n).default(RATE),
        parameter(u32(axis + 0x84, 0, "Profile deceleration (PDC)").unit("0.1RPM/s"), n).default(RATE), // R7
        parameter(u32(axis + 0x87, 0, "Torque slope (TSL)").unit("0.1mA/s"), n).default(RATE), // R9
        command(i32(axis + 0xFF, 0, "Target velocity (S)").unit("RPM")).tells(TARGET_VELOCITY + class), // R8
        // R21: its bits know no negative modes.
        u32(axis + 0x502, 0, "Supported drive modes (SDM)").constant().default(0x0F),
        u32(axis + 0x7FE, 0, "Version number (VNM)").constant().default(0x0004_0100),
        // The controller's own commands.
        i32(0x2000, channel, "Motor command (G)").wo().rpdo().asks().range(-1000, 1000),
        i32(0x2001, channel, "Position (P)").wo().rpdo().asks(),
        i32(0x2002, channel, "Speed (S)").unit("RPM").wo().rpdo().asks(),
        i32(0x2006, channel, "Acceleration (AC)").unit("0.1RPM/s").wo().rpdo().asks(),
        i32(0x2007, channel, "Deceleration (DC)").unit("0.1RPM/s").wo().rpdo().asks(),
        // And its queries.
        feedback(i16(0x2100, channel, "Motor current (A)").unit("0.1A")),
        feedback(i32(0x2101, channel, "Motor command (M)")),
        feedback(i16(0x2102, channel, "Applied power (P)").unit("permille")),
        feedback(i32(0x2103, channel, "Encoder speed (S)").unit("RPM")),
        feedback(i32(0x2104, channel, "Encoder counter (C)").unit("cts")),
        feedback(i16(0x2107, channel, "Relative encoder speed (SR)").unit("permille")),
        feedback(i16(0x210C, channel, "Battery current (BA)").unit("0.1A")),
        feedback(i32(0x2110, channel, "Feedback (F)")),
        feedback(i32(0x2114, channel, "Closed loop error (E)")),
        feedback(u16(0x2122, channel, "Motor status flags (FM)")),
        // What a serial line sets with ^, in our numbers.
        configuration(u8(0x3027, channel, "Operating mode at the start (^MMOD)").range(0, 6), n),
        configuration(u32(0x3033, channel, "Default acceleration (^MAC)").unit("0.1RPM/s").range(0, 500_000).default(RATE), n),
        configuration(u32(0x3034, channel, "Default deceleration (^MDEC)").unit("0.1RPM/s").range(0, 500_000).default(RATE), n),
        configuration(u32(0x3035, channel, "Default position velocity (^MVEL)").unit("RPM").range(0, 30_000).default(1000), n),
        configuration(u32(0x30F0, channel, "Fault deceleration (^EDEC)").unit("0.1RPM/s").range(0, 500_000).default(RATE), n),
        configuration(u16(0x3036, channel, "Speed at a command of 1000 (^MXRPM)").unit("RPM").range(10, 65_000).default(3000), n),
        configuration(u16(0x302A, channel, "Current limit (^ALIM)").unit("0.1A").range(1, 40).default(30), n),
        configuration(i32(0x30F2, channel, "Position at a command of -1000 (^ELL)").unit("cts").default(-20_000), n),
        configuration(i32(0x30F3, channel, "Position at a command of 1000 (^EHL)").unit("cts").default(20_000), n),
        configuration(u8(0x3038, channel, "Closed loop error detection (^CLERD)").range(0, 3).default(2), n),
    ]
}

/// Counts/s of one RPM.
pub(super) const PER_RPM: f32 = motor::COUNTS / 60.0;
/// Counts/s² of 0.1 RPM/s.
pub(super) const PER_RATE: f32 = PER_RPM * 0.1;
/// Per mille of rated torque of 0.1 A.
pub(super) const PER_TENTH_AMPERE: f32 = 100.0 / motor::RATED_A;

/// Where channel `n` finds its objects.
pub(super) const fn channel<const N: usize>(objects: &Dictionary<N>, n: u8) -> AxisPersonality {
    AxisPersonality {
        objects: axis(objects, n),
        motor: MOTOR,
        amplifier: motor::AMPLIFIER,
        presets_position: None,
        inputs: None,
    }
}

const fn axis<const N: usize>(objects: &Dictionary<N>, n: u8) -> AxisObjects {
    let base = base(n);
    let current_limit = scaled(objects, 0x302A, n + 1, PER_TENTH_AMPERE);
    AxisObjects {
        base,
        statusword: Some(objects.handle(base + 0x41, 0)),
        mode_display: objects.need(base + 0x61, 0),
        targets: TargetObjects {
            torque: Some(scaled(objects, base + 0x71, 0, PER_TENTH_AMPERE)),
            vl_velocity: Some(objects.need(base + 0x42, 0)),
            ..TargetObjects::only(
                plain(objects, base + 0x7A, 0),
                scaled(objects, base + 0xFF, 0, PER_RPM),
            )
        },
        feedback: FeedbackObjects {
            torque: Some(scaled(objects, base + 0x77, 0, PER_TENTH_AMPERE)),
            current_a: Some(scaled(objects, 0x2100, n + 1, 0.1)),
            velocity_demand: [Some(scaled(objects, base + 0x43, 0, PER_RPM)), None],
            vl_velocity: Some(objects.need(base + 0x44, 0)),
            bus_voltage_v: Some(scaled(objects, 0x210D, 2, 0.1)),
            temperature_c: Some(plain(objects, 0x210F, 2)),
            ..FeedbackObjects::only(
                plain(objects, base + 0x64, 0),
                scaled(objects, base + 0x6C, 0, PER_RPM),
            )
        },
        configuration: ConfigurationObjects {
            quick_stop_deceleration: Some(scaled(objects, 0x30F0, n + 1, PER_RATE)),
            vl: None, // its unit and ramps: see `own/`
            torque_slope: Some(scaled(objects, base + 0x87, 0, 1e-3 * PER_TENTH_AMPERE)),
            quick_stop_option: None, // always 2 (R3)
            halt_option: None,       // always 2 (R16): see `own/`
            position_window: TargetWindow::Fixed {
                size: 20,
                time_ms: 0,
            },
            // 10 RPM and 2 % of the target.
            velocity_window: TargetWindow::Fixed {
                size: 683,
                time_ms: 0,
            },
            velocity_window_percent: 2,
            velocity_threshold: 683.0,
            ..ConfigurationObjects::only(
                scaled(objects, base + 0x81, 0, PER_RPM),
                scaled(objects, base + 0x83, 0, PER_RATE),
                scaled(objects, base + 0x84, 0, PER_RATE),
                current_limit,
            )
        },
        homing: None,
        rated_torque_nm: Figure::Fixed(motor::RATED_NM),
        polarity: None,
        gear: None,
    }
}
