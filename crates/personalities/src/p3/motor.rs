//! The motor, the amplifier and the controllers, as the manual's tables group them. The defaults
//! are a P3 that is commissioned for the manual's motor, EC-max 22 283860 (P57).

use canopen::Group::Application;
use canopen::row::{i8, i16, i32, u16, u32};
use canopen::{Address, Dictionary, Row};

use super::scaled;
use crate::class::{CONTROL, TARGET_VOLTAGE};
use crate::{
    AmplifierObjects, BridgeTimeObjects, DirectGainObjects, Figure, GainObjects, LoopObjects,
    MotionLoop, MotorObjects,
};

/// A parameter of the controllers that is stored.
pub(crate) const fn parameter(row: Row) -> Row {
    row.rw().store(Application).tells(CONTROL)
}

/// A gain, or what makes one: the drive shows those that follow from the ones written.
pub(crate) const fn gain(row: Row) -> Row {
    parameter(row).asks()
}

/// A value that the drive measures or computes.
pub(crate) const fn feedback(row: Row) -> Row {
    row.tpdo().live()
}

/// "Motor parameters".
#[rustfmt::skip]
pub(crate) const MOTOR_ROWS: &[Row] = &[
    parameter(i16(0x3011, 1, "Electrical zero").unit("cts").default(0x0DF8)),
    parameter(i8(0x3011, 2, "Electrical polarity").range(-1, 1).default(1)).asks(),
    parameter(i8(0x3011, 3, "Pole count").range(2, 126).default(2)),
    // 31.56 mNm/A of peak phase current (P58), rounded to the object's unit.
    parameter(u16(0x3011, 4, "Torque constant").unit("mNm/A").default(32)),
    parameter(u16(0x3011, 5, "Terminal resistance").unit("0.01ohm").default(1310)),
    parameter(u16(0x3011, 6, "Terminal inductance").unit("0.01mH").default(73)),
    // 4.45 gcm² × 2¹⁵.
    parameter(u32(0x3011, 7, "Rotor inertia").unit("gcm2/32768").default(145_818)),
    parameter(i16(0x3011, 8, "Max continuous current").unit("mA").range(0, 3500).default(716)),
    parameter(i16(0x3011, 9, "Peak current").unit("mA").range(0, 3500).default(2000)),
    parameter(i16(0x3011, 10, "Peak current duration").unit("ms").range(0, 32767).default(1000)),
    // Not in the manual; as in the successor. It is there for those who calibrate: the drive has no
    // procedure of its own that a current would be for.
    parameter(i16(0x3011, 11, "Calibration current").unit("mA").range(0, 32767).default(358)),
    feedback(i16(0x3012, 1, "Raw encoder reading").unit("cts")),
    parameter(u32(0x3013, 1, "Encoder resolution").unit("cts/rev").default(4096)),
    parameter(u32(0x3013, 5, "Encoder lag factor").unit("us").range(0, 10_000)),
];

/// "Amplifier parameters", and the current sensor's objects of the calibration chapter (P6). Two
/// phases are sensed; the manual shows the first, sub-index 2 is the second.
#[rustfmt::skip]
pub(crate) const AMPLIFIER_ROWS: &[Row] = &[
    feedback(u16(0x3000, 1, "Sensed bus voltage").unit("0.1V")),
    feedback(i16(0x3000, 2, "Temperature").unit("degC")),
    parameter(u32(0x3001, 1, "PWM frequency").unit("Hz").range(20_000, 100_000).default(100_000)),
    // A tenth of the shortest PWM period: more is more than a compensation can make up for.
    parameter(u16(0x3001, 2, "Dead time").unit("ns").range(0, 1000).default(200)),
    // The manual states no figures of its board: 0 is none that matters.
    parameter(u16(0x3001, 3, "Minimum gate driver propagation delay").unit("ns")),
    parameter(u16(0x3001, 4, "Delta propagation delay").unit("ns")),
    parameter(u16(0x3001, 5, "Maximum settling time of current sensor").unit("ns")),
    parameter(u16(0x3001, 6, "ADC sampling time").unit("ns")),
    parameter(u16(0x3001, 7, "ADC conversion time").unit("ns")),
    parameter(i16(0x3001, 8, "Maximum current").unit("mA").range(0, 3500).default(3500)),
    // At first and at most what 48 V allow.
    parameter(i16(0x3001, 9, "Maximum phase voltage").unit("mV").range(1, 27_713).default(27_713)),
    feedback(u16(0x3008, 1, "Filtered current sense, phase A").unit("count/16")),
    feedback(u16(0x3008, 2, "Filtered current sense, phase B").unit("count/16")),
    parameter(u16(0x3009, 1, "Current sensor bias, phase A").unit("count").default(0x0729)),
    parameter(u16(0x3009, 2, "Current sensor bias, phase B").unit("count").default(2071)),
    // P6: the text sets the d axis's voltage of mode 12 (l.262); the others are as in the successor.
    // Sub-index 1, the mechanical angle, is 0x3012,1 in another unit, and 2 is not known.
    feedback(u16(0x3010, 3, "Motor thermistor").unit("count")),
    feedback(i16(0x3010, 4, "D-axis phase voltage").unit("1/32768")).rw().rpdo().asks().tells(TARGET_VOLTAGE),
    feedback(i16(0x3010, 5, "Q-axis phase voltage").unit("1/32768")).rw().rpdo().asks().tells(TARGET_VOLTAGE),
    feedback(i16(0x3010, 6, "D-axis current").unit("mA")),
    feedback(u16(0x3022, 1, "Aux ADC 1").unit("count")),
    feedback(u16(0x3022, 2, "Aux ADC 2").unit("count")),
];

/// 0x3019: bandwidth and damping of each controller, and the direct gains behind them.
#[rustfmt::skip]
pub(crate) const GAIN_ROWS: &[Row] = &[
    parameter(u16(0x3019, 1, "D-axis control bandwidth").unit("0.1Hz").range(1, 65_535).default(20_000)),
    parameter(u16(0x3019, 2, "D-axis damping").unit("1/256").range(1, 65_535).default(256)),
    parameter(u16(0x3019, 3, "Q-axis control bandwidth").unit("0.1Hz").range(1, 65_535).default(20_000)),
    parameter(u16(0x3019, 4, "Q-axis damping").unit("1/256").range(1, 65_535).default(256)),
    gain(u16(0x3019, 5, "Position control bandwidth").unit("0.1Hz").range(1, 65_535).default(200)),
    gain(u16(0x3019, 6, "Position damping").unit("1/256").range(1, 65_535).default(256)),
    gain(i32(0x3019, 7, "Position proportional gain").unit("1/s*2^-15").range(0, i32::MAX as i64)),
    gain(i32(0x3019, 8, "Position integral gain").unit("1/s2*2^-15").range(0, i32::MAX as i64)),
    gain(i32(0x3019, 9, "Position derivative gain").unit("2^-15").range(0, i32::MAX as i64)),
    gain(u16(0x3019, 10, "Velocity control bandwidth").unit("0.1Hz").range(1, 65_535).default(1000)),
    gain(u16(0x3019, 11, "Velocity damping").unit("1/256").range(1, 65_535).default(256)),
    gain(i32(0x3019, 12, "Velocity proportional gain").unit("A/(turn/s)*2^-15").range(0, i32::MAX as i64)),
    gain(i32(0x3019, 13, "Velocity integral gain").unit("A/turn*2^-15").range(0, i32::MAX as i64)),
    gain(i32(0x3019, 14, "Velocity derivative gain").unit("mA/(turn/s2)*2^-15").range(0, i32::MAX as i64)),
];

/// Where the controllers find the motor's parameters.
pub(crate) const fn motor<const N: usize>(objects: &Dictionary<N>) -> MotorObjects {
    MotorObjects {
        electrical_zero: Figure::plain(objects.need(0x3011, 1)),
        electrical_polarity: Figure::plain(objects.need(0x3011, 2)),
        electrical_polarity_at: Some(Address::new(0x3011, 2)),
        poles: Figure::plain(objects.need(0x3011, 3)),
        torque_constant: Figure::Object(scaled(objects, 0x3011, 4, 1e-3)),
        terminal_resistance: Figure::Object(scaled(objects, 0x3011, 5, 0.01)),
        terminal_inductance: Figure::Object(scaled(objects, 0x3011, 6, 1e-5)),
        // gcm² × 2¹⁵.
        rotor_inertia: Some(Figure::Object(scaled(objects, 0x3011, 7, 1e-7 / 32768.0))),
        continuous_current: Figure::Object(scaled(objects, 0x3011, 8, 1e-3)),
        peak_current: Figure::Object(scaled(objects, 0x3011, 9, 1e-3)),
        peak_time: Figure::Object(scaled(objects, 0x3011, 10, 1e-3)),
        user_continuous_current: Some(scaled(objects, 0x2111, 0, 0.01)), // P31
        user_peak_current: Some(scaled(objects, 0x2110, 0, 0.01)),
        user_peak_time: Some(scaled(objects, 0x2112, 0, 1e-3)),
        encoder_resolution: Figure::plain(objects.need(0x3013, 1)),
        // The manual leaves the unit open. Steps of a microsecond are what a calibration can walk
        // through: below, 50 steps change nothing that is measurable.
        encoder_lag: Figure::Object(scaled(objects, 0x3013, 5, 1e-6)),
        i2t_rule: None, // P30
        may_be_unset: false,
    }
}

/// Where the controllers find the amplifier's parameters.
pub(crate) const fn amplifier<const N: usize>(objects: &Dictionary<N>) -> AmplifierObjects {
    AmplifierObjects {
        pwm_frequency_hz: Figure::plain(objects.need(0x3001, 1)),
        pwm_per_control: 5, // l.888
        times: BridgeTimeObjects {
            dead_time: Figure::plain(objects.need(0x3001, 2)),
            propagation: Figure::plain(objects.need(0x3001, 3)),
            propagation_spread: Figure::plain(objects.need(0x3001, 4)),
            settling: Figure::plain(objects.need(0x3001, 5)),
            sampling: Figure::plain(objects.need(0x3001, 6)),
            conversion: Figure::plain(objects.need(0x3001, 7)),
        },
        max_current: Figure::Object(scaled(objects, 0x3001, 8, 1e-3)),
        max_of_rated_current: None,
        max_phase_voltage: Figure::Object(scaled(objects, 0x3001, 9, 1e-3)),
        current_zero: [
            Figure::plain(objects.need(0x3009, 1)),
            Figure::plain(objects.need(0x3009, 2)),
        ],
        gains: GainObjects {
            current_d: controller(objects, 1),
            current_q: controller(objects, 3),
            velocity: MotionLoop::Tuned(LoopObjects {
                direct: direct(objects, 10, 1e-3),
                ..controller(objects, 10)
            }),
            position: MotionLoop::Tuned(LoopObjects {
                direct: direct(objects, 5, 1.0),
                ..controller(objects, 5)
            }),
            // The manual knows velocity feed-forward only (change AR); so the position lags while the
            // speed changes.
            acceleration_feed_forward: 0.0,
        },
    }
}

/// Bandwidth in 0.1 Hz at `sub` of 0x3019, damping × 256 behind it.
const fn controller<const N: usize>(objects: &Dictionary<N>, sub: u8) -> LoopObjects {
    LoopObjects {
        bandwidth: Figure::Object(scaled(objects, 0x3019, sub, 0.1)),
        damping: Some(Figure::Object(scaled(
            objects,
            0x3019,
            sub + 1,
            1.0 / 256.0,
        ))),
        direct: None,
    }
}

/// Direct gains behind bandwidth and damping at `sub`, acc32_t (S16.15). A derivative gain has a unit
/// of its own where it is small.
const fn direct<const N: usize>(
    objects: &Dictionary<N>,
    sub: u8,
    derivative: f32,
) -> Option<DirectGainObjects> {
    const ACC32: f32 = 1.0 / 32_768.0;
    Some(DirectGainObjects {
        first: Address::new(0x3019, sub),
        proportional: scaled(objects, 0x3019, sub + 2, ACC32),
        integral: scaled(objects, 0x3019, sub + 3, ACC32),
        derivative: scaled(objects, 0x3019, sub + 4, ACC32 * derivative),
    })
}
