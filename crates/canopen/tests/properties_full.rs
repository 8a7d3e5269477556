//! Rules that hold for a device with everything whatever is done to it, against models that were
//! written from CiA 301 alone; see `harness/config`.

mod harness;

use can::Frame;
use harness::config::{self, Doing, OBJECTS, Parameter, START};
use proptest::prelude::*;
use proptest::sample::select;

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 4_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

const OFF: u32 = 1 << 31;
/// COB-IDs of the PDOs after boot-up.
const OWN: [u32; 8] = [0x205, 0x305, 0x405, 0x505, 0x185, 0x285, 0x385, 0x485];

/// A PDO gets a COB-ID of its own, a type, times that fit those of [`time`], and objects.
fn configure(n: usize) -> impl Strategy<Value = Vec<Doing>> {
    let cob_id = select(vec![0, 1 << 30, 1 << 29]);
    let transmission_type = select(vec![0u8, 1, 2, 3, 252, 253, 254, 255, 254, 255]);
    let times = (
        select(vec![0u32, 0, 5, 25]),
        select(vec![0u32, 0, 1, 2, 5]),
        0u32..4,
    );
    let objects = prop::collection::vec(0..OBJECTS.len() as u8, 8);
    let all = (cob_id, transmission_type, times, objects, 0u8..8);
    all.prop_map(
        move |(bits, kind, (inhibit, timer, start), objects, count)| {
            let objects = objects.try_into().expect("eight");
            let mut doings = vec![Doing::Remap(n, OWN[n] | OFF, kind, objects, count)];
            for (parameter, value) in [
                (Parameter::Inhibit, inhibit),
                (Parameter::Timer, timer),
                (Parameter::SyncStart, start),
                (Parameter::CobId, OWN[n] | bits),
            ] {
                doings.push(Doing::Write(n, parameter, value));
            }
            doings
        },
    )
}

/// What the other services have to do.
fn services() -> impl Strategy<Value = Vec<Doing>> {
    let counter = select(vec![0u32, 0, 3, 10]);
    let period = select(vec![0u32, 0, 700, 5_000]);
    let (window, heartbeat) = (select(vec![0u32, 0, 300]), select(vec![0u32, 0, 3]));
    let guards = select(vec![0u32, 4]);
    (counter, period, window, heartbeat, guards).prop_map(
        |(counter, period, window, heartbeat, guards)| {
            [
                (0x1019, 0, counter),
                (0x1006, 0, period),
                (0x1005, 0, 0x4000_0080),
                (0x1007, 0, window),
                (0x1015, 0, guards),
                (0x1016, 1, 0x0007_0005),
                (0x100C, 0, guards),
                (0x100D, 0, 2),
                (0x1017, 0, heartbeat),
            ]
            .map(|(index, sub, value)| Doing::Parameter(index, sub, value))
            .to_vec()
        },
    )
}

/// Some hundred microseconds, exact or not, or milliseconds.
fn time() -> impl Strategy<Value = u64> {
    prop_oneof![
        (0u64..60).prop_map(|count| 100_000 * count),
        0u64..6_000_000,
        (0u64..200).prop_map(|ms| 1_000_000 * ms),
    ]
}

fn doing() -> impl Strategy<Value = Vec<Doing>> {
    let one = prop_oneof![
        6 => time().prop_map(Doing::Wait),
        1 => time().prop_map(Doing::Sleep),
        1 => Just(Doing::Poll),
        4 => (0..OBJECTS.len() as u8, any::<u64>())
            .prop_map(|(object, value)| Doing::Set(object, value)),
        5 => Just(Doing::Detect),
        2 => (0usize..4).prop_map(Doing::Trigger),
        4 => (0u8..12, 0u8..2)
            .prop_map(|(counter, length)| Doing::Receive(Frame::classic(0x80, [counter; 8], length))),
        4 => (0usize..4, 0u8..=8, any::<[u8; 8]>())
            .prop_map(|(n, length, data)| Doing::Rpdo(n, length, data)),
        3 => (0usize..4).prop_map(Doing::Request),
        1 => select(vec![0x01u8, 0x01, 0x01, 0x80, 0x02]).prop_map(Doing::Command),
        1 => Just(Doing::Receive(Frame::classic(0x707, [5; 8], 1))),
        1 => Just(Doing::Receive(
            Frame::remote_frame(can::StandardId::new(0x705).expect("11 bits"), 1).expect("a frame"),
        )),
        1 => any::<u16>().prop_map(Doing::Announce),
        1 => any::<bool>().prop_map(Doing::Take),
    ];
    prop_oneof![
        30 => one.prop_map(|doing| vec![doing]),
        1 => (0usize..8).prop_flat_map(configure),
        1 => services(),
    ]
}

fn doings() -> impl Strategy<Value = Vec<Doing>> {
    let pdos = (0..8).map(configure).collect::<Vec<_>>();
    let run = prop::collection::vec(doing(), 0..80);
    (services(), pdos, run).prop_map(|(services, pdos, run)| {
        let pdos = pdos.into_iter().flatten();
        let start = services.into_iter().chain(pdos).chain([START]);
        start.chain(run.into_iter().flatten()).collect()
    })
}

proptest! {
    #![proptest_config(config())]

    /// Any bytes as doings.
    #[test]
    fn bytes(input in prop::collection::vec(any::<u8>(), 0..400)) {
        config::run(&input);
    }

    /// A node with eight PDOs of all kinds in a busy network, whose host takes each frame at once,
    /// so that data and times are told, or when it likes.
    #[test]
    fn busy(eager in any::<bool>(), doings in doings()) {
        config::play(eager, doings.into_iter());
    }

    /// PDOs are configured in any way and order, with what is allowed and what is not.
    #[test]
    fn configuration(writes in prop::collection::vec(write(), 0..80)) {
        config::play(true, writes.into_iter());
    }
}

/// A write that has a chance, and one that has none.
fn write() -> impl Strategy<Value = Doing> {
    let cob_id = prop_oneof![
        3 => Just(OFF),
        3 => select(vec![0x185u32, 0x205, 0x3000_0185, 0x4000_0185, 0x601, 0x0800, 0x2000_0000]),
        1 => any::<u32>(),
    ];
    let entry = prop_oneof![8 => select(OBJECTS.to_vec()), 1 => Just(0), 1 => any::<u32>()];
    let parameter = prop_oneof![
        6 => cob_id.prop_map(|value| (Parameter::CobId, value)),
        2 => (0u32..256).prop_map(|value| (Parameter::Type, value)),
        1 => (0u32..3).prop_map(|value| (Parameter::Inhibit, value)),
        1 => (0u32..3).prop_map(|value| (Parameter::Timer, value)),
        1 => (0u32..256).prop_map(|value| (Parameter::SyncStart, value)),
        3 => (0u32..5).prop_map(|value| (Parameter::Count, value)),
        1 => (0u32..256).prop_map(|value| (Parameter::Count, value)),
        9 => (1u8..6, entry).prop_map(|(sub, value)| (Parameter::Entry(sub), value)),
    ];
    (select(vec![1usize, 6]), parameter)
        .prop_map(|(n, (parameter, value))| Doing::Write(n, parameter, value))
}
