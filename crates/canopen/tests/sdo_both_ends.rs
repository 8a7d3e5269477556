//! The SDO client against the SDO server over a wire that loses and doubles frames: right data or an
//! error, never wrong data, and both are usable afterwards.

mod harness;

use std::collections::VecDeque;
use std::sync::LazyLock;

use can::Frame;
use canopen::sdo_client::{Channel, Done, Failure, Method, SdoClient, Settings};
use canopen::{Abort, Address, Device, Instant, NodeId};
use harness::full::with_blocks_of;
use harness::{Bench, ID, Streams};
use proptest::prelude::*;

const STREAM: Address = Address::new(0x2020, 0);
const TEXT: Address = Address::new(0x2010, 3);
const WIDE: Address = Address::new(0x2000, 10);
const LONG: Address = Address::new(0x2000, 3);
const OBJECTS: [Address; 4] = [STREAM, TEXT, WIDE, LONG];
const METHODS: [Method; 3] = [Method::Expedited, Method::Segmented, Method::Block];

/// What happens to a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Arrives,
    Lost,
    Doubled,
}

/// Devices whose servers want blocks of 1, 2, 5 and 127 segments.
static DEVICES: LazyLock<[Device; 4]> = LazyLock::new(|| [1, 2, 5, 127].map(with_blocks_of));

/// Both ends and what is between them.
struct Pair<F> {
    bench: Bench<Streams>,
    client: SdoClient,
    fates: F,
    to_node: VecDeque<Frame>,
    to_client: VecDeque<Frame>,
    /// What an upload gave.
    taken: Vec<u8>,
}

impl<F: Iterator<Item = Fate>> Pair<F> {
    fn new(device: &'static Device, settings: Settings, fates: F) -> Pair<F> {
        let node = NodeId::new(ID).expect("a node ID");
        Pair {
            bench: Bench::with(device, Streams::default()),
            client: SdoClient::new(Channel::of(node), settings),
            fates,
            to_node: VecDeque::new(),
            to_client: VecDeque::new(),
            taken: Vec::new(),
        }
    }

    fn copies(&mut self) -> usize {
        match self.fates.next() {
            None | Some(Fate::Arrives) => 1,
            Some(Fate::Lost) => 0,
            Some(Fate::Doubled) => 2,
        }
    }

    /// One frame each way; whether there was any.
    fn step(&mut self, data: &[u8]) -> bool {
        let bench = &mut self.bench;
        bench.now = bench.now.plus_us(100);
        bench.node.poll(bench.now, &mut bench.owner);
        self.client.poll(bench.now);
        let mut source = data;
        let sent = self.client.transmit(bench.now, &mut source);
        let answered = bench.node.transmit(&mut bench.owner);
        if let Some(frame) = sent {
            for _ in 0..self.copies() {
                self.to_node.push_back(frame);
            }
        }
        if let Some(frame) = answered {
            for _ in 0..self.copies() {
                self.to_client.push_back(frame);
            }
        }
        let arrived = self.to_node.pop_front();
        if let Some(frame) = arrived {
            let bench = &mut self.bench;
            bench.node.receive(&frame, bench.now, &mut bench.owner);
        }
        let heard = self.to_client.pop_front();
        if let Some(frame) = heard {
            let taken = &mut self.taken;
            let mut sink = |offset: u32, bytes: &[u8]| {
                taken.truncate(offset as usize);
                assert_eq!(taken.len(), offset as usize, "a gap");
                taken.extend_from_slice(bytes);
                Ok(())
            };
            self.client.receive(&frame, self.bench.now, &mut sink);
        }
        sent.is_some() || answered.is_some() || arrived.is_some() || heard.is_some()
    }

    /// Runs the transfer that the client has begun to its end.
    fn run(&mut self, data: &[u8]) -> Result<Done, Failure> {
        for _ in 0..200_000 {
            if self.step(data) {
                continue;
            }
            if let Some(outcome) = self.client.outcome() {
                return outcome;
            }
            let next = self
                .client
                .next_deadline()
                .min(self.bench.node.next_deadline());
            assert_ne!(next, Instant::NEVER, "nothing will happen");
            self.bench.now = self.bench.now.max(next);
        }
        panic!("no end");
    }

    /// Lets what is under way arrive, and time pass.
    fn settle(&mut self) {
        while self.step(&[]) {}
        for _ in 0..4 {
            self.bench.now = self.bench.now.plus_ms(1000);
            while self.step(&[]) {}
        }
        assert!(self.bench.owner.is_balanced(), "a stream is still open");
    }

    fn value(&mut self, object: Address) -> Vec<u8> {
        let table = &self.bench.node.device().table;
        let field = table.find(object.index, object.sub).expect("it").field;
        let mut bytes = self.bench.node.image().bytes(field).to_vec();
        if object == TEXT {
            bytes.truncate(bytes.iter().position(|byte| *byte == 0).unwrap_or(255));
        }
        bytes
    }

    fn upload(&mut self, object: Address, method: Method) -> Result<Done, Failure> {
        self.taken.clear();
        self.client.upload(object, method).expect("an idle client");
        self.run(&[])
    }

    fn download(&mut self, object: Address, method: Method, data: &[u8]) -> Result<Done, Failure> {
        let count = data.len() as u32;
        self.client
            .download(object, count, method)
            .expect("an idle client");
        self.run(data)
    }
}

/// Bytes without 0, so that they are a text, too.
fn bytes(count: usize, salt: u8) -> Vec<u8> {
    (0..count)
        .map(|n| (n as u8).wrapping_mul(13).wrapping_add(salt) ^ (n >> 6) as u8 | 1)
        .collect()
}

/// As many bytes as the object can have.
fn fitting(object: Address, count: usize, salt: u8) -> Vec<u8> {
    match object {
        STREAM => bytes(count, salt),
        TEXT => bytes(count.min(255), salt),
        WIDE => bytes(8, salt),
        _ => bytes(4, salt),
    }
}

struct Case {
    device: usize,
    settings: Settings,
    object: Address,
    method: Method,
    is_upload: bool,
    count: usize,
    says_size: bool,
}

impl Case {
    /// Runs the transfer and says how it ended for the client.
    fn run(&self, fates: impl Iterator<Item = Fate>) -> Result<Done, Failure> {
        let mut pair = Pair::new(&DEVICES[self.device], self.settings, fates);
        let (old, new) = (
            fitting(self.object, self.count, 1),
            fitting(self.object, self.count, 2),
        );
        pair.bench.owner.contents.clone_from(&old);
        pair.bench.owner.says_size = self.says_size;
        let table = &pair.bench.node.device().table;
        let field = table
            .find(self.object.index, self.object.sub)
            .expect("it")
            .field;
        pair.bench.node.image().set_bytes(field, &old);
        let outcome = if self.is_upload {
            self.upload(&mut pair, &old)
        } else {
            self.download(&mut pair, &old, &new)
        };
        self.is_usable(pair);
        outcome
    }

    fn upload<F: Iterator<Item = Fate>>(
        &self,
        pair: &mut Pair<F>,
        old: &[u8],
    ) -> Result<Done, Failure> {
        let outcome = pair.upload(self.object, self.method);
        if let Ok(done) = outcome {
            assert_eq!(pair.taken, old, "wrong data");
            assert_eq!(done.bytes as usize, old.len());
        } else {
            assert!(
                old.starts_with(&pair.taken) || !self.is_checked(),
                "wrong data"
            );
        }
        outcome
    }

    fn download<F: Iterator<Item = Fate>>(
        &self,
        pair: &mut Pair<F>,
        old: &[u8],
        new: &[u8],
    ) -> Result<Done, Failure> {
        let outcome = pair.download(self.object, self.method, new);
        // What the server has taken: the last acknowledge may be lost, so that only it knows.
        let owner = &pair.bench.owner;
        if self.object == STREAM {
            assert!(owner.ended.iter().all(|ended| ended == new), "wrong data");
            let is_known = outcome.is_err() || !owner.ended.is_empty();
            assert!(is_known, "the client believes in vain");
        } else {
            let value = pair.value(self.object);
            assert!(
                value == new || (outcome.is_err() && value == old),
                "wrong data"
            );
        }
        outcome
    }

    /// Whether the client can know of a part that fails before the end.
    fn is_checked(&self) -> bool {
        self.method != Method::Block
    }

    /// Both ends serve as if nothing had been, once the wire is good.
    fn is_usable<F: Iterator<Item = Fate>>(&self, pair: Pair<F>) {
        let mut pair = Pair {
            bench: pair.bench,
            client: pair.client,
            fates: std::iter::empty(),
            to_node: pair.to_node,
            to_client: pair.to_client,
            taken: pair.taken,
        };
        pair.settle();
        for object in OBJECTS {
            let data = fitting(object, 30, 3);
            for method in [Method::Segmented, Method::Block] {
                let done = pair.download(object, method, &data);
                assert!(done.is_ok(), "{object} {method:?}: {done:?}");
                if object == STREAM {
                    assert_eq!(pair.bench.owner.taken, data);
                    pair.bench.owner.contents.clone_from(&data);
                }
                let done = pair.upload(object, method);
                assert!(done.is_ok(), "{object} {method:?}: {done:?}");
                assert_eq!(pair.taken, data);
            }
        }
        pair.settle();
    }
}

/// Lengths at which something changes.
const LENGTHS: [usize; 16] = [
    0, 1, 3, 4, 5, 7, 8, 14, 15, 21, 22, 888, 889, 890, 1778, 20_000,
];

#[test]
fn every_length_by_every_method_both_ways() {
    let mut transfers = 0;
    for device in 0..4 {
        for object in OBJECTS {
            for method in METHODS {
                for (is_upload, says_size) in [(false, true), (true, true), (true, false)] {
                    for count in LENGTHS {
                        let length = fitting(object, count, 1).len();
                        if method == Method::Expedited && !(1..=4).contains(&length) {
                            continue;
                        }
                        let case = Case {
                            device,
                            settings: Settings::DEFAULT,
                            object,
                            method,
                            is_upload,
                            count,
                            says_size,
                        };
                        let unsized_stream = object == STREAM && is_upload && !says_size;
                        let is_possible = method != Method::Expedited || !unsized_stream;
                        let succeeded = case.run(std::iter::empty()).is_ok();
                        assert_eq!(succeeded, is_possible, "{object}, {method:?}, {count}");
                        transfers += u32::from(succeeded);
                    }
                }
            }
        }
    }
    assert!(transfers > 1500, "{transfers}");
}

/// Each frame of a transfer lost or doubled once, with three attempts.
#[test]
fn any_one_frame_may_be_lost_or_doubled() {
    for is_upload in [true, false] {
        for method in METHODS {
            for fate in [Fate::Lost, Fate::Doubled] {
                let case = Case {
                    device: 2,
                    settings: Settings {
                        attempts: 3,
                        block_size: 5,
                        ..Settings::DEFAULT
                    },
                    object: if method == Method::Expedited {
                        LONG
                    } else {
                        STREAM
                    },
                    method,
                    is_upload,
                    count: 100,
                    says_size: true,
                };
                for place in 0..60 {
                    let fates = std::iter::repeat_n(Fate::Arrives, place);
                    let outcome = case.run(fates.chain([fate]));
                    // The second copy of a request is one out of place, which the server has to
                    // abort (CiA 301 7.2.4.3.17); what is lost is made good.
                    let is_surprised = matches!(
                        outcome,
                        Err(Failure::Aborted(
                            Abort::TOGGLE | Abort::COMMAND | Abort::SEQUENCE_NUMBER
                        ))
                    );
                    assert!(
                        outcome.is_ok() || (fate == Fate::Doubled && is_surprised),
                        "{method:?} {fate:?} upload {is_upload}, {place}: {outcome:?}"
                    );
                }
            }
        }
    }
}

fn settings() -> impl Strategy<Value = Settings> {
    let block_size = prop_oneof![1..8u8, 1..=127u8];
    (0..4u32, block_size, any::<bool>(), any::<u8>()).prop_map(
        |(attempts, block_size, crc, switch_threshold)| Settings {
            attempts,
            block_size,
            crc,
            switch_threshold,
            ..Settings::DEFAULT
        },
    )
}

fn fates() -> impl Strategy<Value = Vec<Fate>> {
    let bad = |weight| {
        prop_oneof![
            weight => Just(Fate::Arrives),
            1 => Just(Fate::Lost),
            1 => Just(Fate::Doubled),
        ]
    };
    prop_oneof![
        proptest::collection::vec(bad(3), 0..400),
        proptest::collection::vec(bad(40), 0..1500),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn right_data_or_an_error(
        device in 0..4usize,
        settings in settings(),
        object in proptest::sample::select(&OBJECTS[..]),
        method in proptest::sample::select(&METHODS[1..]),
        is_upload in any::<bool>(),
        count in prop_oneof![0..20usize, 0..3000usize],
        says_size in any::<bool>(),
        fates in fates(),
    ) {
        // Without a checksum, a block upload whose size is not said cannot be told from a shorter
        // one, and in blocks of one segment the second copy of one is as good as the next.
        let few = device == 0 || settings.block_size == 1;
        let settings = Settings { crc: settings.crc || few, ..settings };
        let says_size = says_size || !settings.crc;
        let case = Case { device, settings, object, method, is_upload, count, says_size };
        let _either = case.run(fates.into_iter());
    }
}
