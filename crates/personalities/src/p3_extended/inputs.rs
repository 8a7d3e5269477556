//! Digital and analog inputs, outputs, safe torque off, touch probes and the terminating resistor.

use canopen::Group::Application;
use canopen::row::{i32, u8, u16, u32};
use canopen::{Dictionary, Row};

use crate::class::TOUCH_PROBE;
use crate::p3::axis::limit;
use crate::p3::motor::feedback;
use crate::{AnalogObjects, InputObjects, ProbeEdgeObjects, ProbeObjects};

/// Objects of CiA 402, and from 0x2431 on what the standard leaves to makers.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    // Bits 0 to 3: negative limit, positive limit, home switch, interlock (shown only); 16 to 19: general
    // inputs.
    feedback(u32(0x60FD, 0, "Digital inputs")),
    u32(0x60FE, 1, "Physical outputs").rw().rpdo().range(0, OUTPUTS),
    u32(0x60FE, 2, "Output bit mask").rw().range(0, OUTPUTS).store(Application),
    // The bits of 0x60FD: active when low, as limit switches usually are that open.
    limit(u32(0x2431, 1, "Inverted digital inputs").range(0, 0x000F_000F)),
    limit(u8(0x2431, 2, "Function of general input 1").range(0, 4)),
    limit(u8(0x2431, 3, "Function of general input 2").range(0, 4)),
    limit(u8(0x2431, 4, "Function of general input 3").range(0, 4)),
    limit(u8(0x2431, 5, "Function of general input 4").range(0, 4)),
    // Contacts bounce, sensors do not.
    limit(u16(0x2431, 6, "Filter time of the switches").unit("us").default(1000)),
    limit(u16(0x2431, 7, "Filter time of the general inputs").unit("us")),
    limit(u8(0x2432, 1, "Analog command target").range(0, 2)),
    limit(u16(0x2432, 2, "Analog command offset").range(0, 4095).default(2048)),
    limit(i32(0x2432, 3, "Analog command scale")),
    limit(u16(0x2432, 4, "Analog command dead band").range(0, 4095).default(20)),
    feedback(u16(0x2432, 5, "Analog input 1")),
    feedback(u16(0x2432, 6, "Analog input 2")),
    limit(u8(0x2433, 1, "Safe torque off fault").range(0, 1)),
    feedback(u8(0x2433, 2, "Safe torque off is active")),
    u16(0x60B8, 0, "Touch probe function").rw().rpdo().asks().tells(TOUCH_PROBE),
    feedback(u16(0x60B9, 0, "Touch probe status")),
    feedback(i32(0x60BA, 0, "Touch probe 1 positive edge").unit("cts")),
    feedback(i32(0x60BB, 0, "Touch probe 1 negative edge").unit("cts")),
    feedback(i32(0x60BC, 0, "Touch probe 2 positive edge").unit("cts")),
    feedback(i32(0x60BD, 0, "Touch probe 2 negative edge").unit("cts")),
    feedback(u16(0x60D5, 0, "Touch probe 1 positive edge counter")),
    feedback(u16(0x60D6, 0, "Touch probe 1 negative edge counter")),
    feedback(u16(0x60D7, 0, "Touch probe 2 positive edge counter")),
    feedback(u16(0x60D8, 0, "Touch probe 2 negative edge counter")),
    // As the maker's P4 has it.
    u8(0x21B2, 0, "CAN termination").rw().range(0, 1).store(Application),
];

/// Bit 0 is the brake, 16 to 19 are general outputs.
const OUTPUTS: i64 = 0x000F_0001;

/// Where the drive finds them.
pub(super) const fn objects<const N: usize>(objects: &Dictionary<N>) -> InputObjects {
    InputObjects {
        active: objects.handle(0x60FD, 0),
        inverted: objects.need(0x2431, 1),
        filter_us: [objects.need(0x2431, 6), objects.need(0x2431, 7)],
        functions: [
            objects.need(0x2431, 2),
            objects.need(0x2431, 3),
            objects.need(0x2431, 4),
            objects.need(0x2431, 5),
        ],
        outputs: (objects.need(0x60FE, 1), objects.need(0x60FE, 2)),
        analog: AnalogObjects {
            target: objects.need(0x2432, 1),
            offset: objects.need(0x2432, 2),
            scale: objects.need(0x2432, 3),
            dead_band: objects.need(0x2432, 4),
            readings: [objects.handle(0x2432, 5), objects.handle(0x2432, 6)],
        },
        torque_off: objects.handle(0x2433, 2),
        probes: ProbeObjects {
            function: objects.need(0x60B8, 0),
            status: objects.handle(0x60B9, 0),
            edges: [
                edge(objects, 0x60BA, 0x60D5),
                edge(objects, 0x60BB, 0x60D6),
                edge(objects, 0x60BC, 0x60D7),
                edge(objects, 0x60BD, 0x60D8),
            ],
        },
    }
}

const fn edge<const N: usize>(
    objects: &Dictionary<N>,
    position: u16,
    count: u16,
) -> ProbeEdgeObjects {
    ProbeEdgeObjects {
        position: objects.handle(position, 0),
        count: objects.handle(count, 0),
    }
}
