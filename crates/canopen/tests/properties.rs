//! Rules that hold whatever is sent: random scripts, random frames, and PDO mapping against a model
//! that was written from CiA 301 alone.

mod harness;

use can::Frame;
use canopen::Device;
use harness::script::{self, Step, World};
use harness::{BASIC, Bench, P3_LIKE};
use proptest::prelude::*;

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 4_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Any frame, those to this node more often.
fn frame() -> impl Strategy<Value = Frame> {
    let id = prop_oneof![
        0u16..0x800,
        Just(0x605),
        Just(0x080),
        Just(0x000),
        prop::sample::select(vec![0x205u16, 0x305, 0x405, 0x505]),
    ];
    (id, any::<[u8; 8]>(), 0u8..=8, 0u8..16).prop_map(|(id, data, length, kind)| {
        let standard = can::StandardId::new(id).expect("11 bits");
        let extended = can::ExtendedId::new(id.into()).expect("29 bits");
        let frame = match kind {
            0 => Frame::remote_frame(standard, length),
            1 => Frame::data_frame(extended, &data[..usize::from(length)]),
            _ => Frame::data_frame(standard, &data[..usize::from(length)]),
        };
        frame.expect("a frame")
    })
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        8 => frame().prop_map(Step::Receive),
        2 => (0u64..10_000_000_000).prop_map(|ns| Step::Wait { ns }),
        1 => Just(Step::Poll),
        2 => Just(Step::TakeOne),
        2 => Just(Step::TakeAll),
        1 => (any::<u16>(), any::<u8>())
            .prop_map(|(code, register)| Step::Announce { code, register }),
        1 => Just(Step::Complete(Ok(()))),
        1 => Just(Step::Restart),
    ]
}

fn device() -> impl Strategy<Value = &'static Device> {
    prop_oneof![Just(&BASIC), Just(&P3_LIKE)]
}

/// A node with eight PDOs of all kinds, operational.
fn configured(device: &'static Device) -> World {
    let mut bench = Bench::operational(device);
    bench.map(0x1400, 0x205, 255, &[0x2005_0010, 0x2007_0020]);
    bench.map(0x1401, 0x305, 1, &[0x2006_0008, 0x2004_0110, 0x2004_0320]);
    bench.map(0x1402, 0x405, 3, &[0x1005_0020]);
    bench.map(0x1403, 0x505, 254, &[0x200A_0108; 8]);
    bench.map(0x1800, 0x185, 1, &[0x2008_0020, 0x2009_0020]);
    bench.map(0x1801, 0x285, 0, &[0x2007_0020]);
    bench.map(0x1802, 0x385, 240, &[0x2000_0108; 8]);
    bench.map(0x1803, 0x485, 2, &[0x2005_0010]);
    bench.write(0x1017, 0, &[7, 0]).expect("heartbeat");
    let mut world = World::new(device);
    world.node = bench.node.clone();
    world.now = bench.now;
    world
}

proptest! {
    #![proptest_config(config())]

    /// The scripts of the fuzzer, without its feedback.
    #[test]
    fn scripts(input in prop::collection::vec(any::<u8>(), 0..300)) {
        script::run(&input);
    }

    /// Random frames and doings to a node that has much to do.
    #[test]
    fn frames(device in device(), steps in prop::collection::vec(step(), 0..100)) {
        let mut world = configured(device);
        for step in steps {
            world.act(step);
        }
        world.act(Step::TakeAll);
        world.check_image();
    }

    /// A lone frame never draws more than one SDO answer, and none unless it is a request.
    #[test]
    fn one_answer(device in device(), frame in frame()) {
        let mut bench = Bench::operational(device);
        let answers = bench.frame(frame).len();
        let shortest = if device.dialect.short_requests { 4 } else { 8 };
        let request = frame.key() == 0x605
            && frame.len() >= shortest
            && frame.data()[0] >> 5 != 4;
        prop_assert_eq!(answers, usize::from(request));
    }
}

/// One PDO as CiA 301 7.5.2.35 to 7.5.2.38 describes it, and P49 for the P3.
struct Model {
    lenient: bool,
    transmit: bool,
    cob_id: u32,
    transmission_type: u8,
    count: u8,
    entries: [u32; 8],
}

/// What may be mapped in the model's world: (entry, receive, transmit).
const OBJECTS: &[(u32, bool, bool)] = &[
    (0x2000_0108, true, true),
    (0x2000_0210, true, true),
    (0x2000_0320, true, true),
    (0x2000_0620, true, true),
    (0x2005_0010, true, true),
    (0x0005_0008, true, false),
    (0x0007_0020, true, false),
    (0x2001_0010, false, true),
    (0x200B_0008, false, false),
];

/// Entries whose index, sub-index or length is wrong, and what they get.
const WRONG: &[(u32, u32)] = &[
    (0x2FFF_0008, 0x0602_0000),
    (0x2000_0908, 0x0609_0011),
    (0x2000_0120, 0x0604_0041),
    (0x2000_0300, 0x0604_0041),
];

impl Model {
    fn judge_entry(&self, entry: u32) -> Result<(), u32> {
        if let Some((_, abort)) = WRONG.iter().find(|wrong| wrong.0 == entry) {
            return Err(*abort);
        }
        let object = OBJECTS.iter().find(|object| object.0 == entry);
        let (_, receive, transmit) = object.ok_or(0x0602_0000u32)?;
        if *(if self.transmit { transmit } else { receive }) {
            Ok(())
        } else {
            Err(0x0604_0041)
        }
    }

    fn exists(&self) -> bool {
        self.cob_id & 1 << 31 == 0
    }

    fn write(&mut self, what: &Write) -> Result<(), u32> {
        match *what {
            Write::CobId(cob_id) => {
                let off = cob_id & 1 << 31 != 0 || (self.lenient && cob_id == 0);
                let id = cob_id & 0x7FF;
                let restricted = id < 0x80
                    || (0x101..=0x180).contains(&id)
                    || (0x581..=0x5FF).contains(&id)
                    || (0x601..=0x67F).contains(&id)
                    || (0x6E0..=0x6FF).contains(&id)
                    || id >= 0x701;
                let moves = self.exists() && id != self.cob_id & 0x7FF && !self.lenient;
                if !off && (restricted || cob_id & 0x3FFF_F800 != 0 || moves) {
                    return Err(0x0609_0030);
                }
                self.cob_id = cob_id;
            }
            Write::Type(transmission_type) => {
                if (241..=253).contains(&transmission_type) {
                    return Err(0x0609_0030);
                }
                self.transmission_type = transmission_type;
            }
            Write::Count(count) => {
                if self.exists() && !self.lenient {
                    return Err(0x0601_0000);
                }
                if count > 8 {
                    return Err(0x0604_0042);
                }
                let mut bits = 0;
                for entry in &self.entries[..usize::from(count)] {
                    self.judge_entry(*entry)?;
                    bits += entry & 0xFF;
                    if bits > 64 {
                        return Err(0x0604_0042);
                    }
                }
                self.count = count;
            }
            Write::Entry(sub, entry) => {
                if (self.exists() && !self.lenient) || self.count != 0 {
                    return Err(0x0601_0000);
                }
                if entry != 0 {
                    self.judge_entry(entry)?;
                }
                self.entries[usize::from(sub) - 1] = entry;
            }
        }
        Ok(())
    }

    /// Bytes that the PDO carries; `None` if it is off.
    fn length(&self) -> Option<usize> {
        let bits: u32 = self.entries[..usize::from(self.count)]
            .iter()
            .map(|entry| entry & 0xFF)
            .sum();
        (self.exists() && self.cob_id & 0x7FF != 0).then_some(bits.div_ceil(8) as usize)
    }
}

/// What a PDO receives here is SYNC first of all.
const SYNC: u16 = 0x080;

#[derive(Clone, Debug)]
enum Write {
    CobId(u32),
    Type(u8),
    Count(u8),
    Entry(u8, u32),
}

fn write() -> impl Strategy<Value = Write> {
    let good: Vec<u32> = OBJECTS.iter().map(|object| object.0).collect();
    let wrong: Vec<u32> = WRONG.iter().map(|wrong| wrong.0).collect();
    let entry = prop_oneof![
        8 => prop::sample::select(good),
        1 => prop::sample::select(wrong),
        1 => Just(0),
    ];
    prop_oneof![
        2 => prop_oneof![Just(0x8000_0000u32), Just(0xC000_0185), Just(0x8000_0285)]
            .prop_map(Write::CobId),
        2 => prop_oneof![Just(0x0000_0185u32), Just(0x4000_0285), Just(0), Just(0x605)]
            .prop_map(Write::CobId),
        1 => prop_oneof![any::<u32>(), 0u32..0x800].prop_map(Write::CobId),
        1 => any::<u8>().prop_map(Write::Type),
        2 => Just(Write::Count(0)),
        3 => (0u8..10).prop_map(Write::Count),
        1 => any::<u8>().prop_map(Write::Count),
        8 => (1u8..=8, entry).prop_map(|(sub, entry)| Write::Entry(sub, entry)),
    ]
}

proptest! {
    #![proptest_config(config())]

    /// Each write ends as in the model, the values are the model's, and in the end the PDO is as
    /// long as the model says.
    #[test]
    fn mapping(
        device in device(),
        transmit in any::<bool>(),
        writes in prop::collection::vec(write(), 0..60),
    ) {
        let index = if transmit { 0x1801u16 } else { 0x1401 };
        let mut bench = Bench::operational(device);
        let mut model = Model {
            lenient: device.dialect.reconfigure_while_valid,
            transmit,
            cob_id: if transmit { 0x285 } else { 0x305 },
            transmission_type: 255,
            count: 0,
            entries: [0; 8],
        };
        for what in &writes {
            let expected = model.write(what);
            let got = match *what {
                Write::CobId(cob_id) => bench.write(index, 1, &cob_id.to_le_bytes()),
                Write::Type(transmission_type) => bench.write(index, 2, &[transmission_type]),
                Write::Count(count) => bench.write(index + 0x200, 0, &[count]),
                Write::Entry(sub, entry) => {
                    bench.write(index + 0x200, sub, &entry.to_le_bytes())
                }
            };
            prop_assert_eq!(got, expected, "{:?}", what);
            prop_assert_eq!(bench.read(index, 1), Ok(model.cob_id));
            prop_assert_eq!(bench.read(index, 2), Ok(u32::from(model.transmission_type)));
            prop_assert_eq!(bench.read(index + 0x200, 0), Ok(u32::from(model.count)));
            for (entry, sub) in model.entries.iter().zip(1..) {
                prop_assert_eq!(bench.read(index + 0x200, sub), Ok(*entry));
            }
        }
        bench.write(index, 2, &[1]).expect("a type");
        let id = (model.cob_id & 0x7FF) as u16;
        if transmit {
            let sent = bench.sync();
            match model.length() {
                None | Some(0) => prop_assert_eq!(sent, []),
                Some(length) => {
                    prop_assert_eq!(sent.len(), 1);
                    prop_assert_eq!((sent[0].0, sent[0].1.len()), (id, length));
                }
            }
        } else if let Some(length) = model.length().filter(|length| *length > 0 && id != SYNC) {
            bench.send(id, &[0; 8][..length - 1]);
            prop_assert!(bench.node.errors().has(canopen::CommunicationErrors::RPDO_TOO_SHORT));
            bench.send(id, &[0; 8][..length]);
            prop_assert!(!bench.node.errors().has(canopen::CommunicationErrors::RPDO_TOO_SHORT));
        }
    }
}
