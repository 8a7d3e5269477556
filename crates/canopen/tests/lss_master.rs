//! The LSS master: every job with slaves and without.

mod harness;

use can::Frame;
use canopen::lss::{
    Answer, BitTiming, Busy, Identity, Job, Known, Master, Outcome, Part, Refusal, Reply, ScanEnd,
    Service, Settings, State,
};
use canopen::{Instant, NodeId};
use harness::lss::{Pair, Wire, identity};

const IDENTITY: Identity = Identity {
    vendor: 0x0102_0304,
    product: 0x0506_0708,
    revision: 0x090A_0B0C,
    serial: 0x0D0E_0F10,
};

/// No node ID.
const NONE: u8 = 0xFF;

/// Settings whose times are easy to add up.
const QUICK: Settings = Settings {
    answer_ms: 10,
    store_ms: 100,
    scan_ms: 5,
    settle_ms: 1,
    gap_ms: 1,
    attempts: 1,
};

/// Every job with a slave, and without: what it sends, how it ends and when.
#[test]
fn jobs_of_a_master() {
    let refused = |service, error| {
        Outcome::Refused(Refusal {
            service,
            error,
            specific: 0,
        })
    };
    let five = NodeId::new(5);
    let low = Identity {
        serial: 0,
        ..IDENTITY
    };
    let high = Identity {
        serial: u32::MAX,
        ..IDENTITY
    };
    let none = Identity {
        serial: 1,
        ..IDENTITY
    };
    let found = Outcome::Scanned(ScanEnd::Found(IDENTITY));
    let known = Known {
        vendor: Some(IDENTITY.vendor),
        product: Some(IDENTITY.product),
        revision: Some(IDENTITY.revision),
        serial: Some(IDENTITY.serial),
    };
    let wrong = Known {
        product: Some(1),
        ..known
    };
    let lost = Outcome::Scanned(ScanEnd::Lost {
        part: Part::Product,
        tried: Identity {
            product: 1,
            revision: 0,
            serial: 0,
            ..IDENTITY
        },
    });
    let nobody = Outcome::Scanned(ScanEnd::Nobody);
    let (waiting, configuration) = (State::Waiting, State::Configuration);
    // Active node ID, state, job; outcome with the slave and how long; without and how long.
    let rows: &[(u8, State, Job, Outcome, u64, Outcome, u64)] = &[
        (
            5,
            waiting,
            Job::Switch(configuration),
            Outcome::Done,
            1,
            Outcome::Done,
            1,
        ),
        (
            5,
            waiting,
            Job::Select(IDENTITY),
            Outcome::Done,
            4,
            Outcome::TimedOut,
            14,
        ),
        (
            5,
            waiting,
            Job::Select(none),
            Outcome::TimedOut,
            14,
            Outcome::TimedOut,
            14,
        ),
        (
            5,
            configuration,
            Job::Select(IDENTITY),
            Outcome::Done,
            4,
            Outcome::TimedOut,
            14,
        ),
        (
            5,
            configuration,
            Job::ConfigureNodeId(five),
            Outcome::Done,
            0,
            Outcome::TimedOut,
            10,
        ),
        (
            5,
            configuration,
            Job::ConfigureNodeId(None),
            Outcome::Done,
            0,
            Outcome::TimedOut,
            10,
        ),
        (
            5,
            waiting,
            Job::ConfigureNodeId(five),
            Outcome::TimedOut,
            10,
            Outcome::TimedOut,
            10,
        ),
        (
            5,
            configuration,
            Job::ConfigureBitTiming(BitTiming::Kbit20),
            Outcome::Done,
            0,
            Outcome::TimedOut,
            10,
        ),
        (
            5,
            configuration,
            Job::ActivateBitTiming { delay_ms: 9 },
            Outcome::Done,
            1,
            Outcome::Done,
            1,
        ),
        (
            5,
            configuration,
            Job::Store,
            Outcome::Done,
            0,
            Outcome::TimedOut,
            100,
        ),
        (
            5,
            configuration,
            Job::InquireIdentity,
            Outcome::Identity(IDENTITY),
            0,
            Outcome::TimedOut,
            10,
        ),
        (
            5,
            configuration,
            Job::InquireNodeId,
            Outcome::NodeId(five),
            0,
            Outcome::TimedOut,
            10,
        ),
        (
            NONE,
            configuration,
            Job::InquireNodeId,
            Outcome::NodeId(None),
            0,
            Outcome::TimedOut,
            10,
        ),
        (
            5,
            waiting,
            Job::Identify { low, high },
            Outcome::Present(true),
            6,
            Outcome::Present(false),
            10,
        ),
        (
            5,
            waiting,
            Job::Identify {
                low: none,
                high: none,
            },
            Outcome::Present(false),
            10,
            Outcome::Present(false),
            10,
        ),
        (
            NONE,
            waiting,
            Job::IdentifyNonConfigured,
            Outcome::Present(true),
            1,
            Outcome::Present(false),
            5,
        ),
        (
            5,
            waiting,
            Job::IdentifyNonConfigured,
            Outcome::Present(false),
            5,
            Outcome::Present(false),
            5,
        ),
        (NONE, waiting, Job::Fastscan(known), found, 5, nobody, 5),
        (NONE, waiting, Job::Fastscan(wrong), lost, 7, nobody, 5),
        (5, waiting, Job::Fastscan(known), nobody, 5, nobody, 5),
    ];
    let address = Part::ALL.map(|part| IDENTITY.get(part));
    for (active, state, job, outcome, took_ms, without, without_ms) in rows {
        let mut here = Wire::of(&[(address, *active)], QUICK);
        here.run(Job::Switch(*state));
        assert_eq!(here.run(*job), (*outcome, *took_ms), "{job:?}");
        let mut alone = Wire::of(&[], QUICK);
        assert_eq!(alone.run(*job), (*without, *without_ms), "{job:?}");
    }
    // A refusal ends a job at once.
    let mut here = Wire::new(vec![Pair::new(address, 5, &[])], QUICK);
    here.run(Job::Switch(configuration));
    let job = Job::ConfigureBitTiming(BitTiming::Kbit20);
    let expected = (refused(Service::ConfigureBitTiming, 1), 0);
    assert_eq!(here.run(job), expected);
}

/// Each request is made as often as the settings say; a sequence is repeated as a whole.
#[test]
fn attempts() {
    let low = IDENTITY;
    for attempts in 0..=4 {
        let settings = Settings { attempts, ..QUICK };
        let times = u64::from(attempts.max(1));
        for (job, outcome, attempt_ms) in [
            (Job::Select(IDENTITY), Outcome::TimedOut, 14),
            (Job::InquireNodeId, Outcome::TimedOut, 10),
            (Job::Store, Outcome::TimedOut, 100),
            (
                Job::Identify { low, high: low },
                Outcome::Present(false),
                10,
            ),
            (
                Job::Fastscan(Known::NOTHING),
                Outcome::Scanned(ScanEnd::Nobody),
                5,
            ),
        ] {
            let mut nobody = Wire::of(&[], settings);
            assert_eq!(nobody.run(job), (outcome, attempt_ms * times), "{job:?}");
        }
    }
    // Every other delivery of a request is lost: the first of each.
    let address = Part::ALL.map(|part| IDENTITY.get(part));
    let mut wire = Wire::of(
        &[(address, 5)],
        Settings {
            attempts: 2,
            ..QUICK
        },
    );
    wire.run(Job::Switch(State::Configuration));
    let mut count = 0;
    let outcome = wire.run_losing(Job::InquireIdentity, &mut || {
        count += 1;
        // Request lost; request and answer arrive.
        count % 3 == 1
    });
    assert_eq!(outcome, (Outcome::Identity(IDENTITY), 40));
}

/// One job at a time, and one that is given up leaves nothing behind.
#[test]
fn a_busy_master() {
    let mut master = Master::new(QUICK);
    assert_eq!(master.next_deadline(), Instant::NEVER);
    assert_eq!(master.transmit(), None);
    master.start(Job::Store, Instant::ZERO).expect("idle");
    assert_eq!(master.start(Job::Store, Instant::ZERO), Err(Busy));
    master.cancel();
    assert_eq!((master.transmit(), master.take_outcome()), (None, None));
    assert_eq!(master.next_deadline(), Instant::NEVER);
    // The answer to what was given up is the answer to nothing.
    master.receive(&Answer::Done(Service::Store).frame(), Instant::ZERO);
    assert_eq!(master.take_outcome(), None);
    assert_eq!(master.start(Job::InquireNodeId, Instant::ZERO), Ok(()));
}

/// What is not the answer to the question of the moment does not disturb it.
#[test]
fn other_answers() {
    let mut master = Master::new(QUICK);
    let now = Instant::ZERO;
    master
        .start(Job::ConfigureNodeId(NodeId::new(5)), now)
        .expect("idle");
    for other in [
        Answer::Done(Service::Store),
        Answer::Selected,
        Answer::Identified,
        Answer::NodeId(5),
    ] {
        master.receive(&other.frame(), now);
        assert_eq!(master.take_outcome(), None, "{other:?}");
    }
    master.receive(&Answer::Done(Service::ConfigureNodeId).frame(), now);
    assert_eq!(master.take_outcome(), Some(Outcome::Done));
    master.start(Job::InquireNodeId, now).expect("idle");
    master.receive(&Answer::NodeId(0x80).frame(), now);
    assert_eq!(master.take_outcome(), Some(Outcome::NoNodeId(0x80)));
}

/// A fastscan of one device takes a question for each bit, one for each number and the first.
#[test]
fn a_scan_asks_133_questions() {
    let mut wire = Wire::of(&[([0, 0, 0, 0], NONE)], QUICK);
    let (outcome, took_ms) = wire.run(Job::Fastscan(Known::NOTHING));
    assert_eq!(
        outcome,
        Outcome::Scanned(ScanEnd::Found(Identity::default()))
    );
    assert_eq!((wire.master.scanned(), took_ms), (133, 133));
    let mut wire = Wire::of(&[([u32::MAX; 4], NONE)], QUICK);
    let (outcome, took_ms) = wire.run(Job::Fastscan(Known::NOTHING));
    assert_eq!(
        outcome,
        Outcome::Scanned(ScanEnd::Found(identity([u32::MAX; 4])))
    );
    assert_eq!((wire.master.scanned(), took_ms), (133, 128 * 5 + 5));
}

/// A device that answers late is taken for the answer to the next question; the scan notices.
#[test]
fn late_answers_do_not_make_up_a_device() {
    let address = [0x0000_0408, 3, 0x0001_0002, 0x8000_0BBC];
    let mut pair = Pair::new(address, NONE, &[]);
    let mut master = Master::new(QUICK);
    let mut now = Instant::ZERO;
    // Each answer comes 7 ms after the question, which waits for 5 ms.
    let mut under_way: Vec<(Instant, Frame)> = Vec::new();
    master
        .start(Job::Fastscan(Known::NOTHING), now)
        .expect("idle");
    let outcome = loop {
        while let Some(frame) = master.transmit() {
            if let Some(Reply::Answer(answer)) = pair.receive(frame.bytes(), now) {
                under_way.push((now.plus_ms(7), answer.frame()));
            }
        }
        if let Some(outcome) = master.take_outcome() {
            break outcome;
        }
        let next = under_way.first().map_or(Instant::NEVER, |(at, _)| *at);
        now = next.min(master.next_deadline());
        if next == now {
            let (_, frame) = under_way.remove(0);
            master.receive(&frame, now);
        }
        master.poll(now);
    };
    assert!(
        matches!(
            outcome,
            Outcome::Scanned(ScanEnd::Nobody | ScanEnd::Lost { .. })
        ),
        "{outcome:?}"
    );
}
