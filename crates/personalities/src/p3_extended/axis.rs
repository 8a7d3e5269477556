//! CiA 402: what the standard has and the faithful P3 has not, or otherwise.

use canopen::row::{i16, i32, u16, u32};
use canopen::{Address, Dictionary, Row};
use cia402::{Mode, ModeSet};

use super::{homing, modes};
use crate::p3::axis::{limit, supported_drive_modes};
use crate::p3::motor::feedback;
use crate::p3::{self, plain};
use crate::{
    AxisObjects, ConfigurationObjects, FeedbackObjects, TargetObjects, TargetWindow, WindowObjects,
};

/// The P3's, and those of frequency converters and of interpolation.
pub(super) const MODES: ModeSet = p3::axis::MODES
    .with(Mode::VELOCITY)
    .with(Mode::INTERPOLATED_POSITION);

/// The rows beside [`p3::axis::ROWS`].
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    supported_drive_modes(MODES),
    // Heartbeat or guarding lost, bus-off: 0 nothing, 1 fault, 2 disable voltage, 3 quick stop.
    limit(i16(0x6007, 0, "Abort connection option code").range(0, 3).default(1)),
    // The present error (P17).
    u16(0x603F, 0, "Error code").tpdo(),
    limit(i16(0x605A, 0, "Quick stop option code").range(0, 8).default(2)),
    limit(i16(0x605B, 0, "Shutdown option code").range(0, 1)),
    limit(i16(0x605C, 0, "Disable operation option code").range(0, 1).default(1)),
    limit(i16(0x605D, 0, "Halt option code").range(1, 4).default(1)),
    limit(i16(0x605E, 0, "Fault reaction option code").range(0, 4).default(2)),
    // 20 counts at once are what the faithful drive has for good (P53).
    limit(u32(0x6067, 0, "Position window").unit("cts").default(20)).rpdo(),
    limit(u16(0x6068, 0, "Position window time").unit("ms")).rpdo(),
    // The demands under the standard's indices, too (P28).
    feedback(i32(0x606B, 0, "Velocity demand value").unit("cts/s")),
    feedback(i16(0x6074, 0, "Torque demand").unit("permille")),
    // As 0x6084; 0: as 0x6084.
    limit(u32(0x6085, 0, "Quick stop deceleration").unit("cts/s2").default(2_000_000)).rpdo(),
    // 0: at once, as the faithful drive.
    limit(u32(0x6087, 0, "Torque slope").unit("permille/s")).rpdo(),
];

/// Where the axis finds its objects.
pub(super) const fn axis<const N: usize>(objects: &Dictionary<N>) -> AxisObjects {
    let p3 = p3::axis::axis(objects);
    let [velocity_demand, _] = p3.feedback.velocity_demand;
    let [torque_demand, _] = p3.feedback.torque_demand;
    AxisObjects {
        targets: TargetObjects {
            vl_velocity: Some(objects.need(0x6042, 0)),
            interpolation_data: Some(Address::new(0x60C1, 1)),
            interpolation_clear: Some(Address::new(0x60C4, 6)),
            ..p3.targets
        },
        feedback: FeedbackObjects {
            vl_velocity: Some(objects.need(0x6044, 0)),
            interpolation_buffered: Some(objects.need(0x60C4, 4)),
            velocity_demand: [velocity_demand, Some(plain(objects, 0x606B, 0))],
            torque_demand: [torque_demand, Some(plain(objects, 0x6074, 0))],
            ..p3.feedback
        },
        configuration: ConfigurationObjects {
            quick_stop_deceleration: Some(plain(objects, 0x6085, 0)),
            jerk: Some((objects.need(0x6086, 0), plain(objects, 0x60A4, 1))),
            vl: Some(modes::vl(objects)),
            torque_slope: Some(plain(objects, 0x6087, 0)),
            interpolation_buffer: Some(objects.need(0x60C4, 2)),
            shutdown_option: Some(objects.need(0x605B, 0)),
            disable_option: Some(objects.need(0x605C, 0)),
            halt_option: Some(objects.need(0x605D, 0)),
            fault_reaction_option: Some(objects.need(0x605E, 0)),
            abort_connection_option: Some(objects.need(0x6007, 0)),
            position_window: TargetWindow::Objects(WindowObjects {
                size: plain(objects, 0x6067, 0),
                time_ms: objects.need(0x6068, 0),
            }),
            ..p3.configuration
        },
        homing: Some(homing::objects(objects)),
        ..p3
    }
}
