//! CiA 402: the rows, and where the drive core finds its values in them.

use canopen::Group::Application;
use canopen::row::{i8, i16, i32, u8, u16, u32};
use canopen::{Address, Dictionary, Row};
use cia402::{Mode, ModeSet};

use super::motor::{feedback, parameter};
use super::{plain, scaled};
use crate::class::{
    CONFIGURATION, CONTROL, TARGET_ANGLE, TARGET_POSITION, TARGET_TORQUE, TARGET_VELOCITY,
};
use crate::{
    AxisObjects, ConfigurationObjects, FeedbackObjects, Figure, HomingObjects, TargetObjects,
    TargetWindow, WindowObjects,
};

/// The feature list's modes (P11).
pub(crate) const MODES: ModeSet = ModeSet::EMPTY
    .with(Mode::IDLE)
    .with(Mode::PROFILE_POSITION)
    .with(Mode::PROFILE_VELOCITY)
    .with(Mode::PROFILE_TORQUE)
    .with(Mode::HOMING)
    .with(Mode::CYCLIC_POSITION)
    .with(Mode::CYCLIC_VELOCITY)
    .with(Mode::CYCLIC_TORQUE)
    .with(Mode::CYCLIC_TORQUE_WITH_ANGLE)
    .with(Mode::PHASE_VOLTAGE_WITH_ANGLE);

/// 0x6502 for these modes.
pub(crate) const fn supported_drive_modes(modes: ModeSet) -> Row {
    let working = modes.and(ModeSet::IMPLEMENTED);
    u32(0x6502, 0, "Supported drive modes")
        .constant()
        .default(working.supported_drive_modes() as i64)
}

/// A parameter of the axis that is stored.
pub(crate) const fn limit(row: Row) -> Row {
    row.rw().store(Application).tells(CONFIGURATION)
}

/// The objects of CiA 402, "States and Modes" to "Cyclic synchronous configuration", that both P3s
/// have alike.
#[rustfmt::skip]
pub(crate) const ROWS: &[Row] = &[
    u16(0x6040, 0, "Control word").rw().rpdo().asks(),
    feedback(u16(0x6041, 0, "Status word")),
    // The manual says U08, the standard I08; on the wire they are the same (P11).
    i8(0x6060, 0, "Set mode of operation").rw().rpdo().asks(),
    feedback(i8(0x6061, 0, "Mode of operation display")),
    feedback(i32(0x6064, 0, "Actual position").unit("cts")).rw().asks(), // P25
    feedback(i32(0x606C, 0, "Actual velocity").unit("cts/s")),
    feedback(i16(0x6078, 0, "Actual current").unit("mA")), // P24
    limit(i32(0x6076, 0, "Rated torque").unit("mNm").range(1, i32::MAX as i64).default(23)).tells(CONTROL),
    // P23; not while the motor is under power.
    parameter(i8(0x607E, 0, "User polarity").range(-1, 1).default(1)).asks(),
    // P22, P57: the motor's full speed at 48 V is about 13,000 rpm, 890,000 cts/s.
    limit(i32(0x6080, 0, "No-load speed").unit("cts/s").range(0, i32::MAX as i64).default(900_000)),
    // P21; rated torque over the rotor's inertia is 33 million cts/s².
    limit(u32(0x60C5, 0, "Max acceleration").unit("cts/s2").range(0, i32::MAX as i64)).default(20_000_000),
    limit(u32(0x60C6, 0, "Max deceleration").unit("cts/s2").range(0, i32::MAX as i64)).default(20_000_000),
    // P48: it can be written in modes 11 and 12 only, and shows the frame's angle in all.
    feedback(i16(0x60EA, 0, "Electrical angle").unit("1/65536turn")).rw().rpdo().asks().tells(TARGET_ANGLE),
    i16(0x6071, 0, "Target torque").rw().rpdo().range(-1000, 1000).unit("permille").tells(TARGET_TORQUE),
    feedback(i16(0x3023, 1, "Internal torque demand").unit("permille")),
    feedback(i16(0x6077, 0, "Actual torque").unit("permille")),
    i16(0x60B2, 0, "Torque offset").rw().rpdo().range(-1000, 1000).unit("permille"),
    limit(i16(0x6072, 0, "Max application torque").unit("permille").range(0, 1000).default(1000)).rpdo(), // P27
    i32(0x60FF, 0, "Target velocity").rw().rpdo().unit("cts/s").tells(TARGET_VELOCITY),
    feedback(i32(0x6043, 0, "Internal velocity demand").unit("cts/s")),
    feedback(i32(0x3023, 2, "Velocity error").unit("cts/s")),
    i32(0x60B1, 0, "Velocity offset").rw().rpdo().unit("cts/s"),
    limit(i32(0x607F, 0, "Velocity controller max velocity").unit("cts/s")).range(0, i32::MAX as i64).default(900_000).rpdo(),
    limit(u32(0x6083, 0, "Max acceleration of profiles").unit("cts/s2").default(2_000_000)).rpdo(),
    limit(u32(0x6084, 0, "Max deceleration of profiles").unit("cts/s2").default(2_000_000)).rpdo(),
    i32(0x607A, 0, "Target position").rw().rpdo().unit("cts").tells(TARGET_POSITION),
    feedback(i32(0x60FC, 0, "Internal position demand").unit("cts")),
    feedback(i32(0x60F4, 0, "Position following error").unit("cts")),
    i32(0x60B0, 0, "Position offset").rw().rpdo().unit("cts"),
    limit(i32(0x607D, 1, "Position minimum").unit("cts")),
    limit(i32(0x607D, 2, "Position maximum").unit("cts")),
    limit(i32(0x6081, 0, "Position controller max velocity").unit("cts/s")).range(0, i32::MAX as i64).default(200_000).rpdo(),
    limit(u8(0x60C2, 1, "Interpolation time period value").default(1)),
    limit(i8(0x60C2, 2, "Interpolation time period scale").range(-6, 0).default(-3)),
    // l.1176, P61.
    feedback(u8(0x2402, 0, "Motor is homed")),
    // P38.
    limit(i32(0x607C, 0, "Home offset").unit("cts")).rpdo(),
];

/// What the faithful drive has otherwise than the standard.
#[rustfmt::skip]
pub(super) const P3_ROWS: &[Row] = &[
    supported_drive_modes(MODES), // P54
    // The manual says U16 (P12); 0 to 8.
    limit(u16(0x605A, 0, "Quick stop option code").range(0, 8).default(2)),
    // P17.
    u16(0x603F, 0, "Last error").tpdo(),
    // "Homing Immediate" alone (l.156, P38).
    limit(i8(0x6098, 0, "Homing method").range(37, 37).default(37)).rpdo(),
];

/// Where the axis finds its objects.
pub(crate) const fn axis<const N: usize>(objects: &Dictionary<N>) -> AxisObjects {
    AxisObjects {
        base: 0x6000,
        statusword: Some(objects.handle(0x6041, 0)),
        mode_display: objects.need(0x6061, 0),
        targets: TargetObjects {
            position: plain(objects, 0x607A, 0),
            velocity: plain(objects, 0x60FF, 0),
            torque: Some(plain(objects, 0x6071, 0)),
            vl_velocity: None,
            interpolation_data: None,
            interpolation_clear: None,
            position_offset: Some(plain(objects, 0x60B0, 0)),
            velocity_offset: Some(plain(objects, 0x60B1, 0)),
            torque_offset: Some(plain(objects, 0x60B2, 0)),
            angle: Some(objects.need(0x60EA, 0)),
            voltage_d: Some((Address::new(0x3010, 4), objects.need(0x3010, 4))),
            voltage_q: Some((Address::new(0x3010, 5), objects.need(0x3010, 5))),
        },
        feedback: FeedbackObjects {
            position: plain(objects, 0x6064, 0),
            velocity: plain(objects, 0x606C, 0),
            torque: Some(plain(objects, 0x6077, 0)),
            current_a: Some(scaled(objects, 0x6078, 0, 1e-3)), // mA, P24
            position_demand: Some(plain(objects, 0x60FC, 0)),  // P28
            velocity_demand: [Some(plain(objects, 0x6043, 0)), None],
            torque_demand: [Some(plain(objects, 0x3023, 1)), None],
            vl_velocity: None,
            interpolation_buffered: None,
            following_error: Some(plain(objects, 0x60F4, 0)),
            velocity_error: Some(plain(objects, 0x3023, 2)),
            bus_voltage_v: Some(scaled(objects, 0x3000, 1, 0.1)), // P37
            temperature_c: Some(plain(objects, 0x3000, 2)),       // P37
            raw_encoder: Some(plain(objects, 0x3012, 1)),
            // Q12.4 (l.255).
            current_sense: [
                Some(scaled(objects, 0x3008, 1, 0.0625)),
                Some(scaled(objects, 0x3008, 2, 0.0625)),
            ],
            current_d_a: Some(scaled(objects, 0x3010, 6, 1e-3)),
            motor_thermistor: Some(plain(objects, 0x3010, 3)),
            auxiliary_adc: [
                Some(plain(objects, 0x3022, 1)),
                Some(plain(objects, 0x3022, 2)),
            ],
        },
        configuration: ConfigurationObjects {
            profile_velocity: plain(objects, 0x6081, 0),
            acceleration: plain(objects, 0x6083, 0),
            deceleration: plain(objects, 0x6084, 0),
            quick_stop_deceleration: None,
            max_velocity: [
                Some(plain(objects, 0x607F, 0)),
                Some(plain(objects, 0x6080, 0)),
            ],
            max_motor_velocity: Some(plain(objects, 0x6080, 0)), // P22
            max_acceleration: Some(plain(objects, 0x60C5, 0)),
            max_deceleration: Some(plain(objects, 0x60C6, 0)),
            position_limits: Some((plain(objects, 0x607D, 1), plain(objects, 0x607D, 2))),
            max_torque: plain(objects, 0x6072, 0),
            jerk: None,
            vl: None,
            torque_slope: None,
            interpolation_period: Some((objects.need(0x60C2, 1), objects.need(0x60C2, 2))),
            interpolation_buffer: None,
            quick_stop_option: Some(objects.need(0x605A, 0)),
            shutdown_option: None,
            disable_option: None,
            halt_option: None,
            fault_reaction_option: None,
            abort_connection_option: None,
            following_warning: window(objects, 0x6065, 0x6066), // P19
            following_fault: window(objects, 0x2120, 0x2121),
            velocity_warning: window(objects, 0x606D, 0x606E), // P29
            velocity_fault: window(objects, 0x2104, 0x2105),
            position_window: TargetWindow::Fixed {
                size: 20,
                time_ms: 0,
            }, // P53
            // The table has no window for velocity either: 10 rpm and 2 % of the target. Under way
            // the reported velocity trembles by up to 1.4 % of the speed.
            velocity_window: TargetWindow::Fixed {
                size: 683,
                time_ms: 0,
            },
            velocity_window_percent: 2,
            velocity_threshold: 683.0,
        },
        homing: Some(HomingObjects {
            method: objects.need(0x6098, 0),
            offset: plain(objects, 0x607C, 0),
            is_homed: objects.handle(0x2402, 0),
            search: None,
        }),
        rated_torque_nm: Figure::Object(scaled(objects, 0x6076, 0, 1e-3)),
        polarity: Some(objects.need(0x607E, 0)),
        gear: None,
    }
}

const fn window<const N: usize>(
    objects: &Dictionary<N>,
    size: u16,
    time_ms: u16,
) -> Option<WindowObjects> {
    Some(WindowObjects {
        size: plain(objects, size, 0),
        time_ms: objects.need(time_ms, 0),
    })
}
