//! Frames that get lost or come twice between outside programs and the bus, on purpose.

mod master;
use master::*;

use canopen::Instant;
use client::{Client, block_on};
use sim::{
    Bus, BusSettings, Disturbance, Injection, Recording, RunHeader, Sender, Traffic, VirtualLink,
    replay,
};

fn settings(seed: u64, lose: &str, duplicate: &str) -> BusSettings {
    BusSettings {
        disturbance: Disturbance {
            lose: lose.parse().unwrap(),
            duplicate: duplicate.parse().unwrap(),
        },
        ..BusSettings::new(seed, vec![p3(1), p3(2)])
    }
}

/// SDO requests to both drives, one each 2 ms, and what came of them.
fn run(settings: BusSettings) -> (Bus, Vec<Traffic>) {
    let mut bus = Bus::new(settings);
    bus.run_until(Instant::ZERO.plus_ms(50));
    bus.take_traffic();
    for n in 0..2000 {
        bus.send(0, frame(0x601 + n % 2, &[0x40, 0x00, 0x10, 0]));
        bus.run_until(bus.now().plus_ms(2));
    }
    let traffic = bus.take_traffic();
    (bus, traffic)
}

#[test]
fn an_undisturbed_bus_loses_nothing() {
    let (bus, traffic) = run(settings(1, "0%", "0%"));
    assert_eq!(traffic.len(), 4000);
    assert!(traffic.iter().all(|t| t.copies == 1));
    for direction in bus.disturbed() {
        assert_eq!((direction.lost, direction.duplicated), (0, 0));
    }
}

#[test]
fn what_is_lost_and_duplicated_is_counted() {
    let (bus, traffic) = run(settings(1, "2%", "1%"));
    let [inward, outward] = bus.disturbed();
    let from = |outside: bool| {
        let is_outside = move |t: &&Traffic| matches!(t.sender, Sender::Outside(_)) == outside;
        traffic.iter().filter(is_outside)
    };
    assert_eq!(inward.frames, 2000);
    let on_the_wire = from(true).count() as u64;
    assert_eq!(on_the_wire, 2000 - inward.lost + inward.duplicated);
    // What outside programs send is disturbed before the wire, and what drives send behind it.
    assert!(from(true).all(|t| t.copies == 1));
    // Two boot-ups have been before.
    assert_eq!(outward.frames, from(false).count() as u64 + 2);
    let lost = from(false).filter(|t| t.copies == 0).count() as u64;
    let duplicated = from(false).filter(|t| t.copies == 2).count() as u64;
    assert_eq!((lost, duplicated), (outward.lost, outward.duplicated));
    for direction in [inward, outward] {
        // Of 2000 frames or about as many; four standard deviations.
        assert!((15..=66).contains(&direction.lost), "{direction}");
        assert!((2..=38).contains(&direction.duplicated), "{direction}");
    }
}

#[test]
fn the_seed_says_which() {
    let of = |seed| run(settings(seed, "5%", "5%")).1;
    assert_eq!(of(1), of(1));
    assert_ne!(of(1), of(2));
    let (bus, traffic) = run(settings(1, "100%", "0%"));
    assert_eq!(traffic, []);
    assert_eq!(bus.disturbed().map(|direction| direction.lost), [2000, 2]);
}

#[test]
fn a_master_gets_what_is_left() {
    let mut bus = Bus::new(settings(1, "0%", "100%"));
    let mut client = Client::new(VirtualLink::new(&mut bus, 1));
    let until = Instant::ZERO.plus_ms(50);
    let mut heard = 0;
    while block_on(client.receive(until)).unwrap().is_some() {
        heard += 1;
    }
    assert_eq!(heard, 4, "each boot-up twice");
}

#[test]
fn a_disturbed_run_replays_byte_for_byte() {
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("disturbance");
    std::fs::create_dir_all(&folder).unwrap();
    let log = folder.join("disturbed.log");
    let settings = settings(11, "10%", "10%");
    let mut recording = Recording::create(&log, &RunHeader::of(&settings)).unwrap();
    let mut bus = Bus::new(settings);
    for n in 0..500_u64 {
        let at = Instant::ZERO.plus_ns(30_000_000 + n * 777_777);
        bus.run_until(at);
        let frame = frame(0x601 + (n % 2) as u16, &[0x40, 0x00, 0x10, 0]);
        let injection = Injection {
            at,
            client: 1,
            frame,
        };
        recording.injection(&injection).unwrap();
        bus.send(1, frame);
    }
    let end = bus.now().plus_ms(10);
    bus.run_until(end);
    for traffic in bus.take_traffic() {
        recording.frame(&traffic).unwrap();
    }
    assert!(bus.disturbed()[0].lost > 20);
    let frames = recording.finish(end).unwrap();
    let original = std::fs::read(&log).unwrap();
    let mut again = Vec::new();
    assert_eq!(replay(&log, &mut again).unwrap().frames, frames);
    assert!(original == again);

    // Without the lines that say so it is another run.
    let run = folder.join("disturbed.log.run");
    let causes = std::fs::read_to_string(&run).unwrap();
    let lines = "\nlose 10%\nduplicate 10%\n";
    assert!(causes.contains(lines));
    std::fs::write(&run, causes.replace(lines, "\n")).unwrap();
    let mut other = Vec::new();
    replay(&log, &mut other).unwrap();
    assert!(original != other);
}
