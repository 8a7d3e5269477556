//! Our own stack, the crate `canopen`, in plain CiA 301.

use bench::subject::{
    MAPPED, NMT_COB_ID, NMT_START, NODE_ID, Polled, SYNC_COB_ID, Subject, TPDO_COB_IDS, value_of,
};
use can::Frame;
use canopen::row::{u8, u16, u32};
use canopen::{
    Address, Device, Dialect, Dictionary, Handle, Image, Instant, Node, NodeId, Owner, Row,
    Verdict, dictionary,
};

/// What every device of this benchmark has: identity, heartbeat, four TPDOs.
const STANDARD: &[Row] = &[
    u32(0x1000, 0, "Device type").constant().default(0),
    u8(0x1001, 0, "Error register").tpdo(),
    u32(0x1005, 0, "COB-ID SYNC")
        .rw()
        .default(SYNC_COB_ID as i64),
    u16(0x1017, 0, "Producer heartbeat time").rw().default(1000),
    u32(0x1018, 1, "Identity").subs(4),
    cob_id(0),
    transmission_type(0),
    cob_id(1),
    transmission_type(1),
    cob_id(2),
    transmission_type(2),
    cob_id(3),
    transmission_type(3),
    map_count(0),
    map_entry(0, 1),
    map_count(1),
    map_entry(1, 1),
    map_count(2),
    map_entry(2, 1),
    map_count(3),
    map_entry(3, 1),
];

const fn cob_id(n: u16) -> Row {
    u32(0x1800 + n, 1, "COB-ID used by TPDO")
        .rw()
        .default_plus_node(0x180 + 0x100 * n as u32)
}

const fn transmission_type(n: u16) -> Row {
    u8(0x1800 + n, 2, "Transmission type").rw().default(1)
}

const fn map_count(n: u16) -> Row {
    u8(0x1A00 + n, 0, "Number of mapped objects").rw()
}

const fn map_entry(n: u16, sub: u8) -> Row {
    u32(0x1A00 + n, sub, "Mapped object").subs(2).rw()
}

/// Objects that the standard rows declare, the runs counted one by one.
const STANDARD_OBJECTS: usize = STANDARD.len() + 3 + 4;

/// The application's objects: u32 at ascending indices, the mapped ones refreshed before they are
/// sampled.
const fn application<const N: usize>() -> [Row; N] {
    let mut rows = [u32(MAPPED[0], 0, "Value").rw().tpdo(); N];
    let mut n = 0;
    while n < N {
        let index = MAPPED[0] + n as u16;
        let row = u32(index, 0, "Value").rw().tpdo();
        let row = row.default(value_of(index) as i64);
        rows[n] = if n < MAPPED.len() { row.live() } else { row };
        n += 1;
    }
    rows
}

static APPLICATION_50: [Row; 50 - STANDARD_OBJECTS] = application();
static APPLICATION_500: [Row; 500 - STANDARD_OBJECTS] = application();
static PARTS_50: &[&[Row]] = &[STANDARD, &APPLICATION_50];
static PARTS_500: &[&[Row]] = &[STANDARD, &APPLICATION_500];

static OBJECTS_50: Dictionary<{ dictionary::count(PARTS_50) }> = dictionary::layout(PARTS_50);
static OBJECTS_500: Dictionary<{ dictionary::count(PARTS_500) }> = dictionary::layout(PARTS_500);
static DEVICE_50: Device = Device::new(&OBJECTS_50, Dialect::STANDARD);
static DEVICE_500: Device = Device::new(&OBJECTS_500, Dialect::STANDARD);

/// The mapped objects. They lie at the same place in both dictionaries.
const HANDLES: [Handle<u32>; 8] = {
    const OBJECTS: Dictionary<{ dictionary::count(PARTS_50) }> = dictionary::layout(PARTS_50);
    let mut handles = [OBJECTS.handle(MAPPED[0], 0); 8];
    let mut n = 1;
    while n < handles.len() {
        handles[n] = OBJECTS.handle(MAPPED[n], 0);
        n += 1;
    }
    handles
};

/// The owner of the mapped objects: its values go into the image before they are sampled or read.
#[derive(Debug)]
struct Process {
    values: [u32; 8],
}

impl Owner for Process {
    fn write(&mut self, _: &Image<'_>, _: Address, _: &[u8]) -> Verdict {
        Verdict::Accept
    }

    #[inline(always)]
    fn publish(&mut self, image: &mut Image<'_>) {
        for (handle, value) in HANDLES.iter().zip(self.values) {
            image.set(*handle, value);
        }
    }
}

/// A node of 50 or 500 objects.
#[derive(Debug)]
pub(crate) struct Servobus {
    node: Node<Vec<u8>>,
    process: Process,
    now: Instant,
    application_objects: u16,
}

impl Servobus {
    /// A node with 50 objects, operational.
    pub(crate) fn with_50_objects() -> Self {
        Self::new(&DEVICE_50, APPLICATION_50.len() as u16)
    }

    /// A node with 500 objects, operational.
    pub(crate) fn with_500_objects() -> Self {
        Self::new(&DEVICE_500, APPLICATION_500.len() as u16)
    }

    fn new(device: &'static Device, application_objects: u16) -> Self {
        let memory = vec![0; device.table.image_bytes()];
        let id = NodeId::new(NODE_ID).expect("a node ID from 1 to 127");
        let mut subject = Self {
            node: Node::new(device, memory, id),
            process: Process {
                values: MAPPED.map(value_of),
            },
            now: Instant::ZERO,
            application_objects,
        };
        subject.node.start(subject.now);
        assert!(subject.waiting().is_some(), "the boot-up frame");
        for (n, pair) in (0..).zip(MAPPED.chunks(2)) {
            let id = u32::from(TPDO_COB_IDS[usize::from(n)]);
            subject.download(0x1800 + n, 1, id | 1 << 31, 0x23);
            for (sub, index) in (1..).zip(pair) {
                subject.download(0x1A00 + n, sub, u32::from(*index) << 16 | 32, 0x23);
            }
            subject.download(0x1A00 + n, 0, 2, 0x2F);
            subject.download(0x1800 + n, 1, id, 0x23);
        }
        let start = Self::received(NMT_COB_ID, &NMT_START);
        subject.exchange(&start, 0, |_| {});
        assert_eq!(subject.node.state(), canopen::NmtState::Operational);
        subject
    }

    fn download(&mut self, index: u16, sub: u8, value: u32, command: u8) {
        let [low, high] = index.to_le_bytes();
        let [v0, v1, v2, v3] = value.to_le_bytes();
        let data = [command, low, high, sub, v0, v1, v2, v3];
        let request = Self::received(0x600 + u16::from(NODE_ID), &data);
        let mut answer = None;
        self.exchange(&request, 1, |frame| answer = Some(frame));
        let answer = answer.expect("an answer");
        assert_eq!(answer.bytes(), [0x60, low, high, sub, 0, 0, 0, 0]);
    }
}

impl Subject for Servobus {
    type Received = Frame;
    type Sent = Frame;

    fn received(cob_id: u16, data: &[u8]) -> Frame {
        let mut bytes = [0; 8];
        bytes[..data.len()].copy_from_slice(data);
        Frame::classic(cob_id, bytes, data.len() as u8)
    }

    fn content(sent: &Frame) -> (u16, &[u8]) {
        (sent.raw_id() as u16, sent.data())
    }

    fn application_objects(&self) -> u16 {
        self.application_objects
    }

    #[inline(always)]
    fn exchange(&mut self, received: &Frame, due: usize, mut taken: impl FnMut(Frame)) {
        self.node.receive(received, self.now, &mut self.process);
        for _ in 0..due {
            if let Some(frame) = self.node.transmit(&mut self.process) {
                taken(frame);
            }
        }
    }

    #[inline(always)]
    fn publish(&mut self, values: &[u32; 8]) {
        self.process.values = *values;
    }

    fn waiting(&mut self) -> Option<Frame> {
        self.node.transmit(&mut self.process)
    }
}

impl Polled for Servobus {
    #[inline(always)]
    fn poll(&mut self) {
        self.node.poll(self.now, &mut self.process);
    }
}
