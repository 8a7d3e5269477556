//! A device of your own: a private dictionary, no personality, no operating system needed.
//!
//! It is a small pump: one speed set-point in, one measured speed out, a command object that may be
//! refused. Everything it is stands in this file. Run it with
//! `cargo run -p servobus-canopen --example own_drive`; on a microcontroller the two marked places
//! are your CAN driver and your timer, and nothing else changes.

use can::Frame;
use canopen::row::{i16, i32, u8, u16, u32};
use canopen::{
    Abort, Address, Device, Dialect, Dictionary, Handle, Image, Instant, Node, NodeId, Owner, Row,
    Verdict, dictionary,
};

/// The dictionary, one object a line. It is sorted, checked and laid out by the compiler.
#[rustfmt::skip]
const ROWS: &[&[Row]] = &[&[
    u32(0x1000, 0, "Device type").constant(),
    u8 (0x1001, 0, "Error register").tpdo(),
    u32(0x1005, 0, "COB-ID SYNC").rw().default(0x80),
    u16(0x1017, 0, "Producer heartbeat time").rw().default(10).unit("ms"),
    u32(0x1018, 1, "Vendor ID").constant(),
    // One PDO each way, mapped already: event-driven set-point, feedback with every SYNC.
    u32(0x1400, 1, "COB-ID RPDO 1").rw().default_plus_node(0x200),
    u8 (0x1400, 2, "Transmission type").rw().default(255),
    u8 (0x1600, 0, "Mapped objects").rw().default(1),
    u32(0x1600, 1, "Mapped object").rw().default(0x2001_0010),
    u32(0x1800, 1, "COB-ID TPDO 1").rw().default_plus_node(0x180),
    u8 (0x1800, 2, "Transmission type").rw().default(1),
    u8 (0x1A00, 0, "Mapped objects").rw().default(1),
    u32(0x1A00, 1, "Mapped object").rw().default(0x2002_0020),
    // The pump itself. `asks`: the owner judges each write. `live`: it is asked for the value.
    u8 (0x2000, 0, "Valve open").rw().range(0, 1).asks(),
    i16(0x2001, 0, "Target speed").rw().rpdo().range(-3000, 3000).unit("rpm"),
    i32(0x2002, 0, "Measured speed").tpdo().live().unit("mrpm"),
]];
const OBJECTS: Dictionary<{ dictionary::count(ROWS) }> = dictionary::layout(ROWS);
static TABLE: Dictionary<{ dictionary::count(ROWS) }> = OBJECTS;
static PUMP: Device = Device::new(&TABLE, Dialect::STANDARD);

/// Handles cost nothing at run time; a wrong type or index does not compile.
const TARGET_RPM: Handle<i16> = OBJECTS.handle(0x2001, 0);
const MEASURED_MRPM: Handle<i32> = OBJECTS.handle(0x2002, 0);

/// What the objects mean. The node passes the owner in and never keeps it.
struct Pump {
    speed_mrpm: i32,
}

impl Owner for Pump {
    /// A write is judged before it is committed: here no valve moves under a running pump.
    fn write(&mut self, _image: &Image<'_>, object: Address, _new: &[u8]) -> Verdict {
        match object.index {
            0x2000 if self.speed_mrpm != 0 => Verdict::Refuse(Abort::DEVICE_STATE),
            _ => Verdict::Accept,
        }
    }

    /// Called before a live object is read by SDO or sampled for a TPDO.
    fn publish(&mut self, image: &mut Image<'_>) {
        image.set(MEASURED_MRPM, self.speed_mrpm);
    }
}

/// What the master sends, and when, in milliseconds.
#[rustfmt::skip]
const SCRIPT: &[(u64, u16, &[u8], &str)] = &[
    (1, 0x605, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0], "read the device type"),
    (2, 0x605, &[0x2F, 0x00, 0x20, 0, 1, 0, 0, 0], "open the valve"),
    (3, 0x000, &[0x01, 0x05], "NMT: start node 5"),
    (4, 0x205, &[0xE8, 0x03], "RPDO 1: 1000 rpm"),
    (14, 0x080, &[], "SYNC: ask for feedback"),
    (15, 0x605, &[0x2F, 0x00, 0x20, 0, 0, 0, 0, 0], "close the valve: refused"),
    (24, 0x080, &[], "SYNC"),
];

fn main() {
    let id = NodeId::new(5).expect("1 to 127");
    let mut pump = Pump { speed_mrpm: 0 };
    let mut node = Node::new(&PUMP, [0u8; OBJECTS.image_bytes()], id);
    node.start(Instant::ZERO);
    for ms in 0..=30 {
        let now = Instant::ZERO.plus_ms(ms); // on a microcontroller: your timer
        for (_, id, data, what) in SCRIPT.iter().filter(|entry| entry.0 == ms) {
            let mut bytes = [0; 8];
            bytes[..data.len()].copy_from_slice(data);
            let frame = Frame::classic(*id, bytes, data.len() as u8);
            println!("{ms:3} ms  in   {:22} {what}", frame.to_string());
            node.receive(&frame, now, &mut pump);
        }
        node.poll(now, &mut pump); // needed at `node.next_deadline()` only; more often does no harm
        while let Some(frame) = node.transmit(&mut pump) {
            println!("{ms:3} ms  out  {frame}"); // on a microcontroller: your CAN driver
        }
        // The application: a first-order lag of 10 ms toward the target.
        let target_mrpm = i32::from(node.image().get(TARGET_RPM)) * 1000;
        pump.speed_mrpm += (target_mrpm - pump.speed_mrpm) / 10;
    }
}
