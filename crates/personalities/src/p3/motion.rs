//! Rows of the motor, the amplifier, the controllers and CiA 402, as the manual's tables group
//! them. The defaults are a P3 that is commissioned for the manual's motor, EC-max 22 283860 (P57).

use canopen::Group::Application;
use canopen::Row;
use canopen::row::{i8, i16, i32, u8, u16, u32};

use super::CIA402;
use crate::class::{CONFIGURATION, CONTROL, TARGET_POSITION, TARGET_TORQUE, TARGET_VELOCITY};

/// A parameter of the axis that is stored.
const fn limit(row: Row) -> Row {
    row.rw().store(Application).tells(CONFIGURATION)
}

/// A parameter of the controllers that is stored.
const fn parameter(row: Row) -> Row {
    row.rw().store(Application).tells(CONTROL)
}

/// A value that the drive measures or computes.
const fn feedback(row: Row) -> Row {
    row.tpdo().live()
}

/// "Motor parameters".
#[rustfmt::skip]
pub(super) const MOTOR_ROWS: &[Row] = &[
    parameter(i16(0x3011, 1, "Electrical zero").unit("cts").default(0x0DF8)),
    parameter(i8(0x3011, 2, "Electrical polarity").range(-1, 1).default(1)),
    parameter(i8(0x3011, 3, "Pole count").range(2, 126).default(2)),
    // 31.56 mNm/A of peak phase current (P58), rounded to the object's unit.
    parameter(u16(0x3011, 4, "Torque constant").unit("mNm/A").default(32)),
    parameter(u16(0x3011, 5, "Terminal resistance").unit("0.01ohm").default(1310)),
    parameter(u16(0x3011, 6, "Terminal inductance").unit("0.01mH").default(73)),
    // 4.45 gcm² × 2¹⁵.
    parameter(u32(0x3011, 7, "Rotor inertia").unit("gcm2/32768").default(145_818)),
    parameter(i16(0x3011, 8, "Max continuous current").unit("mA").range(0, 32767).default(716)),
    parameter(i16(0x3011, 9, "Peak current").unit("mA").range(0, 32767).default(2000)),
    parameter(i16(0x3011, 10, "Peak current duration").unit("ms").range(0, 32767).default(1000)),
    feedback(i16(0x3012, 1, "Raw encoder reading").unit("cts")),
    parameter(u32(0x3013, 1, "Encoder resolution").unit("cts/rev").default(4096)),
    parameter(u32(0x3013, 5, "Encoder lag factor").unit("ns")),
];

/// "Amplifier parameters", and the current sensor's objects of the calibration chapter (P6). Two
/// phases are sensed; the manual shows the first, sub-index 2 is the second.
#[rustfmt::skip]
pub(super) const AMPLIFIER_ROWS: &[Row] = &[
    feedback(u16(0x3000, 1, "Sensed bus voltage").unit("0.1V")),
    feedback(i16(0x3000, 2, "Temperature").unit("degC")),
    parameter(u32(0x3001, 1, "PWM frequency").unit("Hz").range(20_000, 100_000).default(100_000)),
    u16(0x3001, 2, "Dead time").rw().unit("ns").default(200).store(Application),
    u16(0x3001, 3, "Minimum gate driver propagation delay").rw().unit("ns").store(Application),
    u16(0x3001, 4, "Delta propagation delay").rw().unit("ns").store(Application),
    u16(0x3001, 5, "Maximum settling time of current sensor").rw().unit("ns").store(Application),
    u16(0x3001, 6, "ADC sampling time").rw().unit("ns").store(Application),
    u16(0x3001, 7, "ADC conversion time").rw().unit("ns").store(Application),
    parameter(i16(0x3001, 8, "Maximum current").unit("mA").range(0, 3500).default(3500)),
    i16(0x3001, 9, "Maximum phase voltage").rw().unit("mV").default(27_713).store(Application),
    feedback(u16(0x3008, 1, "Filtered current sense, phase A").unit("count/16")),
    feedback(u16(0x3008, 2, "Filtered current sense, phase B").unit("count/16")),
    parameter(u16(0x3009, 1, "Current sensor bias, phase A").unit("count").default(0x0729)),
    parameter(u16(0x3009, 2, "Current sensor bias, phase B").unit("count").default(2071)),
    u16(0x3022, 1, "Aux ADC 1").unit("count").tpdo(),
    u16(0x3022, 2, "Aux ADC 2").unit("count").tpdo(),
];

/// 0x3019: bandwidth and damping of each controller, and the direct gains behind them.
#[rustfmt::skip]
pub(super) const GAIN_ROWS: &[Row] = &[
    parameter(u16(0x3019, 1, "D-axis control bandwidth").unit("0.1Hz").default(20_000)),
    parameter(u16(0x3019, 2, "D-axis damping").unit("1/256").default(256)),
    parameter(u16(0x3019, 3, "Q-axis control bandwidth").unit("0.1Hz").default(20_000)),
    parameter(u16(0x3019, 4, "Q-axis damping").unit("1/256").default(256)),
    parameter(u16(0x3019, 5, "Position control bandwidth").unit("0.1Hz").default(200)),
    parameter(u16(0x3019, 6, "Position damping").unit("1/256").default(256)),
    i32(0x3019, 7, "Position proportional gain").rw().unit("acc32").store(Application),
    i32(0x3019, 8, "Position integral gain").rw().unit("acc32").store(Application),
    i32(0x3019, 9, "Position derivative gain").rw().unit("acc32").store(Application),
    parameter(u16(0x3019, 10, "Velocity control bandwidth").unit("0.1Hz").default(1000)),
    parameter(u16(0x3019, 11, "Velocity damping").unit("1/256").default(256)),
    i32(0x3019, 12, "Velocity proportional gain").rw().unit("acc32").store(Application),
    i32(0x3019, 13, "Velocity integral gain").rw().unit("acc32").store(Application),
    i32(0x3019, 14, "Velocity derivative gain").rw().unit("acc32").store(Application),
];

/// The objects of CiA 402: "States and Modes" to "Cyclic synchronous configuration".
#[rustfmt::skip]
pub(super) const AXIS_ROWS: &[Row] = &[
    u16(0x6040, 0, "Control word").rw().rpdo().asks(),
    feedback(u16(0x6041, 0, "Status word")),
    // The manual says U16 (P12); 0 to 8.
    limit(u16(0x605A, 0, "Quick stop option code").range(0, 8).default(2)),
    // The manual says U08, the standard I08; on the wire they are the same (P11).
    i8(0x6060, 0, "Set mode of operation").rw().rpdo().asks(),
    feedback(i8(0x6061, 0, "Mode of operation display")),
    u32(0x6502, 0, "Supported drive modes").constant().default(CIA402.supported_drive_modes() as i64), // P54
    u16(0x603F, 0, "Last error").tpdo(),
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
    i16(0x60EA, 0, "Electrical angle").rw().rpdo().asks().unit("1/65536turn"), // P48
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
    // l.1176, P61; there is no homing yet.
    u8(0x2402, 0, "Motor is homed").tpdo(),
];
