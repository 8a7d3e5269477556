//! The manual's table "Faults and Warnings" and the objects it names (P6).

use canopen::Group::Application;
use canopen::row::{u8, u16, u32};
use canopen::{Dictionary, Row};

use super::{plain, scaled};
use crate::class::{CONFIGURATION, CONTROL};
use crate::{Cause, FaultRow, Kind, States, Switch};

pub(crate) const fn threshold(row: Row) -> Row {
    row.rw().store(Application).tells(CONFIGURATION)
}

/// Thresholds, time-outs and switches. 0 disables. Beyond what the hardware bears none is accepted:
/// 3.5 A, 56 V, 85 °C; 155 °C in the motor's winding.
#[rustfmt::skip]
pub(crate) const OBJECT_ROWS: &[Row] = &[
    threshold(u8(0x2403, 0, "Encoder magnet distance fault").range(0, 1)),
    threshold(u16(0x2110, 0, "User peak current").unit("0.01A").range(0, 350)).tells(CONTROL),
    threshold(u16(0x2111, 0, "User continuous current").unit("0.01A").range(0, 350)).tells(CONTROL),
    threshold(u16(0x2112, 0, "User peak current time").unit("ms")).tells(CONTROL),
    threshold(u16(0x2384, 6, "Amplifier max voltage").unit("0.1V").range(0, 560).default(520)),
    threshold(u16(0x2384, 7, "Amplifier min voltage").unit("0.1V").range(0, 480).default(180)),
    threshold(u8(0x2384, 9, "Amplifier max temperature").unit("degC").range(0, 85).default(85)),
    threshold(u8(0x220A, 0, "Motor max temperature").unit("degC").range(0, 155).default(85)),
    threshold(u8(0x2404, 0, "CAN overrun fault").range(0, 1)),
    threshold(u16(0x2406, 0, "SYNC loss fault timeout").unit("ms")),
    threshold(u8(0x2405, 0, "Recovered from bus-off fault").range(0, 1)),
    threshold(u16(0x606D, 0, "Velocity tracking warning window").unit("cts/s")),
    threshold(u16(0x606E, 0, "Velocity tracking warning timeout").unit("ms")),
    threshold(u16(0x2104, 0, "Velocity tracking fault window").unit("cts/s")),
    threshold(u16(0x2105, 0, "Velocity tracking fault timeout").unit("ms")),
    // P20: 1 is the greatest and 2 the least velocity, other than in the standard.
    threshold(u32(0x6046, 1, "Max velocity limit").unit("cts/s")),
    threshold(u32(0x6046, 2, "Min velocity limit").unit("cts/s")),
    threshold(u32(0x6065, 0, "Position tracking warning window").unit("cts")),
    threshold(u16(0x6066, 0, "Position tracking warning timeout").unit("ms")),
    threshold(u32(0x2120, 0, "Position tracking fault window").unit("cts")),
    threshold(u16(0x2121, 0, "Position tracking fault timeout").unit("ms")),
];

/// One row of a table.
pub(crate) const fn row(
    cause: Cause,
    code: u16,
    kind: Kind,
    register_bit: u8,
    status_bit: u8,
    states: States,
    switch: Switch,
) -> FaultRow {
    FaultRow {
        cause,
        code,
        kind,
        register_bit,
        status_bit,
        states,
        switch,
    }
}

use Kind::{Fault, Warning};
use States::{All, OperationEnabled};
use Switch::{Always, Off};

/// What makes the errors possible that the manual marks `x` and names no object for.
#[derive(Clone, Copy)]
pub(crate) struct UnnamedSwitches {
    pub(crate) watchdog_reset: Switch,
    pub(crate) parameter_error: Switch,
    pub(crate) encoder_feedback: Switch,
    pub(crate) short_circuit: Switch,
    pub(crate) motor_phasing: Switch,
    pub(crate) positive_limit_switch: Switch,
    pub(crate) negative_limit_switch: Switch,
    pub(crate) home_switch: Switch,
    pub(crate) positive_soft_stop: Switch,
    pub(crate) negative_soft_stop: Switch,
    pub(crate) position_wrapped: Switch,
    pub(crate) homing: Switch,
}

/// In the faithful drive four of them are always on, and the others off (P46).
pub(super) const UNNAMED: UnnamedSwitches = UnnamedSwitches {
    watchdog_reset: Always,
    parameter_error: Always,
    encoder_feedback: Always,
    short_circuit: Always,
    motor_phasing: Off,
    positive_limit_switch: Off,
    negative_limit_switch: Off,
    home_switch: Off,
    positive_soft_stop: Off,
    negative_soft_stop: Off,
    position_wrapped: Off,
    homing: Off,
};

/// Rows of the manual's table.
pub(crate) const COUNT: usize = 27;

/// The table in the manual's order.
#[rustfmt::skip]
pub(crate) const fn table<const N: usize>(objects: &Dictionary<N>, x: UnnamedSwitches) -> [FaultRow; COUNT] {
    [
        row(Cause::WatchdogReset, 0x6010, Fault, 0, 0, All, x.watchdog_reset),
        row(Cause::ParameterError, 0x6320, Fault, 0, 1, All, x.parameter_error),
        row(Cause::EncoderFeedback, 0x7320, Fault, 0, 2, All, x.encoder_feedback),
        row(Cause::MagnetDistance, 0x7321, Fault, 0, 3, All, by(objects, 0x2403, 0)),
        row(Cause::CurrentLimit, 0x2310, Warning, 1, 4, OperationEnabled, by(objects, 0x2111, 0)),
        row(Cause::ShortCircuit, 0x2320, Fault, 1, 5, OperationEnabled, x.short_circuit),
        row(Cause::BusOverVoltage, 0x3210, Fault, 2, 6, All, by_scaled(objects, 0x2384, 6, 0.1)),
        row(Cause::BusUnderVoltage, 0x3220, Fault, 2, 7, All, by_scaled(objects, 0x2384, 7, 0.1)),
        row(Cause::AmplifierTemperature, 0x4210, Fault, 3, 8, OperationEnabled, by(objects, 0x2384, 9)),
        row(Cause::MotorTemperature, 0x4310, Fault, 3, 9, OperationEnabled, by(objects, 0x220A, 0)),
        row(Cause::CanOverrun, 0x8110, Fault, 4, 10, All, by(objects, 0x2404, 0)),
        row(Cause::SyncLoss, 0x8180, Fault, 4, 11, All, by_scaled(objects, 0x2406, 0, 1e-3)),
        row(Cause::BusOffRecovered, 0x8140, Fault, 4, 12, All, by(objects, 0x2405, 0)),
        row(Cause::MotorPhasing, 0x7122, Fault, 7, 13, OperationEnabled, x.motor_phasing),
        row(Cause::PositiveLimitSwitch, 0x7380, Fault, 7, 14, OperationEnabled, x.positive_limit_switch),
        row(Cause::NegativeLimitSwitch, 0x7381, Fault, 7, 15, OperationEnabled, x.negative_limit_switch),
        row(Cause::HomeSwitch, 0x7382, Fault, 7, 16, OperationEnabled, x.home_switch),
        row(Cause::PositiveSoftStop, 0x7383, Warning, 7, 17, OperationEnabled, x.positive_soft_stop),
        row(Cause::NegativeSoftStop, 0x7384, Warning, 7, 18, OperationEnabled, x.negative_soft_stop),
        row(Cause::PositionWrapped, 0x73A0, Fault, 7, 19, All, x.position_wrapped),
        row(Cause::VelocityTrackingWarning, 0x8411, Warning, 7, 20, OperationEnabled, by(objects, 0x606D, 0)),
        row(Cause::VelocityTrackingFault, 0x8414, Fault, 7, 21, OperationEnabled, by(objects, 0x2104, 0)),
        row(Cause::VelocityLimit, 0x8418, Warning, 7, 22, OperationEnabled, either(objects, 0x6046, 1, 0x6046, 2)),
        row(Cause::AccelerationLimit, 0x8480, Warning, 7, 23, OperationEnabled, either(objects, 0x60C5, 0, 0x60C6, 0)),
        row(Cause::PositionTrackingWarning, 0x8611, Warning, 7, 24, OperationEnabled, by(objects, 0x6065, 0)),
        row(Cause::Homing, 0x8613, Fault, 7, 25, OperationEnabled, x.homing),
        row(Cause::PositionTrackingFault, 0x8614, Fault, 7, 26, OperationEnabled, by(objects, 0x2120, 0)),
    ]
}

const fn by<const N: usize>(objects: &Dictionary<N>, index: u16, sub: u8) -> Switch {
    Switch::Object(plain(objects, index, sub))
}

const fn by_scaled<const N: usize>(
    objects: &Dictionary<N>,
    index: u16,
    sub: u8,
    scale: f32,
) -> Switch {
    Switch::Object(scaled(objects, index, sub, scale))
}

const fn either<const N: usize>(
    objects: &Dictionary<N>,
    index: u16,
    sub: u8,
    other: u16,
    other_sub: u8,
) -> Switch {
    Switch::Either(plain(objects, index, sub), plain(objects, other, other_sub))
}
