//! Barrett P3, as "P3 CANopen Manual" revision AV of 2019-10-22 describes it.
//!
//! Where the manual is silent or contradicts itself, the rows say in a comment what is built; the
//! numbers P1 to P61 name the decisions, which the drive's page in the documentation lists.

mod communication;
mod faults;
mod motion;

use canopen::{AcknowledgeData, Address, Dictionary, RangeAbort, Row, RpdoSync, UploadReply};
use canopen::{Device, dictionary};
use cia402::{Mode, ModeSet};

use crate::{
    AmplifierObjects, AxisObjects, ConfigurationObjects, FeedbackObjects, GainObjects, LoopObjects,
    MotorObjects, Personality, Scaled, TargetObjects, WindowObjects,
};

const ROWS: &[&[Row]] = &[
    communication::ROWS,
    communication::PDO_ROWS,
    motion::MOTOR_ROWS,
    motion::AMPLIFIER_ROWS,
    motion::GAIN_ROWS,
    motion::AXIS_ROWS,
    faults::OBJECT_ROWS,
];

/// The object dictionary.
pub static OBJECTS: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// Bytes of a P3's image.
pub const IMAGE_BYTES: usize = OBJECTS_CONST.image_bytes();

/// The same dictionary as a constant, to resolve handles in.
const OBJECTS_CONST: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);

/// The P3's CANopen.
pub const CANOPEN: canopen::Dialect = canopen::Dialect {
    short_requests: true,                     // P1, P55
    upload_reply: UploadReply::Unsized,       // P2
    acknowledge_data: AcknowledgeData::Zeros, // J1
    range_abort: RangeAbort::Invalid,         // P27
    reconfigure_while_valid: true,            // P49
    rpdo_sync: RpdoSync::Nth,                 // P50
    tpdo_type_0_is_cyclic: true,              // P13
    tpdo_in_pre_operational: true,            // P14
    boots_to_operational: true,               // l.346, P33
    history_clearable: false,                 // P40
};

/// The P3's CiA 402.
pub const CIA402: cia402::Dialect = cia402::Dialect {
    reset_and_command_in_one_write: true, // P8
    modes_only_when_enabled: true,        // P10
    mode_display_cleared_on_enable: true, // P10
    ramps_on_stop: false,                 // P12, l.185
    halt_bit: false,                      // P42
    remote_bit: false,                    // P42
    // The feature list's modes (P11); homing and modes 11 and 12 are not built yet.
    modes: ModeSet::EMPTY
        .with(Mode::IDLE)
        .with(Mode::PROFILE_POSITION)
        .with(Mode::PROFILE_VELOCITY)
        .with(Mode::PROFILE_TORQUE)
        .with(Mode::CYCLIC_POSITION)
        .with(Mode::CYCLIC_VELOCITY)
        .with(Mode::CYCLIC_TORQUE),
};

const fn plain(index: u16, sub: u8) -> Scaled {
    Scaled::plain(OBJECTS_CONST.need(index, sub))
}

const fn scaled(index: u16, sub: u8, scale: f32) -> Scaled {
    Scaled::new(OBJECTS_CONST.need(index, sub), scale)
}

const fn window(size: u16, time_ms: u16) -> Option<WindowObjects> {
    Some(WindowObjects {
        size: plain(size, 0),
        time_ms: OBJECTS_CONST.need(time_ms, 0),
    })
}

const AXIS: AxisObjects = AxisObjects {
    base: 0x6000,
    statusword: OBJECTS_CONST.handle(0x6041, 0),
    mode_display: OBJECTS_CONST.need(0x6061, 0),
    targets: TargetObjects {
        position: plain(0x607A, 0),
        velocity: plain(0x60FF, 0),
        torque: plain(0x6071, 0),
        position_offset: Some(plain(0x60B0, 0)),
        velocity_offset: Some(plain(0x60B1, 0)),
        torque_offset: Some(plain(0x60B2, 0)),
    },
    feedback: FeedbackObjects {
        position: plain(0x6064, 0),
        velocity: plain(0x606C, 0),
        torque: plain(0x6077, 0),
        current_a: Some(scaled(0x6078, 0, 1e-3)), // mA, P24
        position_demand: Some(plain(0x60FC, 0)),  // P28
        velocity_demand: Some(plain(0x6043, 0)),
        torque_demand: Some(plain(0x3023, 1)),
        following_error: Some(plain(0x60F4, 0)),
        velocity_error: Some(plain(0x3023, 2)),
        bus_voltage_v: Some(scaled(0x3000, 1, 0.1)), // P37
        temperature_c: Some(plain(0x3000, 2)),       // P37
        raw_encoder: Some(plain(0x3012, 1)),
        // Q12.4 (l.255).
        current_sense: [
            Some(scaled(0x3008, 1, 0.0625)),
            Some(scaled(0x3008, 2, 0.0625)),
        ],
    },
    configuration: ConfigurationObjects {
        profile_velocity: plain(0x6081, 0),
        acceleration: plain(0x6083, 0),
        deceleration: plain(0x6084, 0),
        quick_stop_deceleration: None,
        max_velocity: &[plain(0x607F, 0), plain(0x6080, 0)],
        max_motor_velocity: Some(plain(0x6080, 0)), // P22
        max_acceleration: Some(plain(0x60C5, 0)),
        max_deceleration: Some(plain(0x60C6, 0)),
        position_limits: Some((plain(0x607D, 1), plain(0x607D, 2))),
        max_torque: plain(0x6072, 0),
        torque_slope: None,
        interpolation_period: Some((OBJECTS_CONST.need(0x60C2, 1), OBJECTS_CONST.need(0x60C2, 2))),
        quick_stop_option: Some(OBJECTS_CONST.need(0x605A, 0)),
        following_warning: window(0x6065, 0x6066), // P19
        following_fault: window(0x2120, 0x2121),
        velocity_warning: window(0x606D, 0x606E), // P29
        velocity_fault: window(0x2104, 0x2105),
        position_window: (20, 0), // P53
        // The table has no window for velocity either: 10 rpm.
        velocity_window: (683, 0),
        velocity_threshold: 683.0,
    },
    rated_torque_nm: scaled(0x6076, 0, 1e-3),
    polarity: Some(OBJECTS_CONST.need(0x607E, 0)),
};

const MOTOR: MotorObjects = MotorObjects {
    electrical_zero: OBJECTS_CONST.need(0x3011, 1),
    electrical_polarity: OBJECTS_CONST.need(0x3011, 2),
    poles: OBJECTS_CONST.need(0x3011, 3),
    torque_constant: scaled(0x3011, 4, 1e-3),
    terminal_resistance: scaled(0x3011, 5, 0.01),
    terminal_inductance: scaled(0x3011, 6, 1e-5),
    // gcm² × 2¹⁵.
    rotor_inertia: scaled(0x3011, 7, 1e-7 / 32768.0),
    continuous_current: scaled(0x3011, 8, 1e-3),
    peak_current: scaled(0x3011, 9, 1e-3),
    peak_time: scaled(0x3011, 10, 1e-3),
    user_continuous_current: Some(scaled(0x2111, 0, 0.01)), // P31
    user_peak_current: Some(scaled(0x2110, 0, 0.01)),
    user_peak_time: Some(scaled(0x2112, 0, 1e-3)),
    encoder_resolution: OBJECTS_CONST.need(0x3013, 1),
    // The manual leaves the unit open; nanoseconds here.
    encoder_lag: scaled(0x3013, 5, 1e-9),
    i2t_is_literal: true, // P30
};

const AMPLIFIER: AmplifierObjects = AmplifierObjects {
    pwm_frequency_hz: OBJECTS_CONST.need(0x3001, 1),
    pwm_per_control: 5, // l.888
    max_current: scaled(0x3001, 8, 1e-3),
    current_zero: [OBJECTS_CONST.need(0x3009, 1), OBJECTS_CONST.need(0x3009, 2)],
    gains: GainObjects {
        current_d: controller(1),
        current_q: controller(3),
        velocity: controller(10),
        position: controller(5),
        // The manual knows velocity feed-forward only (change AR); so the position lags while the
        // speed changes.
        acceleration_feed_forward: 0.0,
    },
};

/// Bandwidth in 0.1 Hz at `sub` of 0x3019, damping × 256 behind it.
const fn controller(sub: u8) -> LoopObjects {
    LoopObjects {
        bandwidth: scaled(0x3019, sub, 0.1),
        damping: scaled(0x3019, sub + 1, 1.0 / 256.0),
    }
}

// A fault manager keeps a bit for each row.
const _: () = assert!(faults::TABLE.len() <= 32);

/// The drive.
pub static P3: Personality = Personality {
    name: "p3",
    title: "Barrett P3 (manual of 2019)",
    device: Device::new(&OBJECTS, CANOPEN),
    cia402: CIA402,
    axis: AXIS,
    motor: MOTOR,
    amplifier: AMPLIFIER,
    faults: faults::TABLE,
    error_code: OBJECTS_CONST.optional(0x603F, 0),
    status_register: OBJECTS_CONST.optional(0x1002, 0),
    serial_number: OBJECTS_CONST.optional(0x1018, 4),
    stores_single_entry: Some(Address::new(0x1010, 4)), // P4
    presets_position: Some(Address::new(0x6064, 0)),    // P25
};
