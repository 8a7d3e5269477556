//! Bit rates: how long frames take at each, and that different ones have nothing to do with each
//! other.

mod master;
use master::*;

use canopen::store;
use personalities::p3_extended::P3_EXTENDED;
use sim::{BitRate, Bus, BusSettings, DriveSettings, FlashFile, NoticeKind, Place, Sender};

/// Drives at these places, and what LSS has stored in them: node ID, and index of table 0.
fn bus(bit_rate: BitRate, drives: &[(&str, Option<u8>, Option<u8>)]) -> Bus {
    let drives = drives.iter().map(|(place, node_id, index)| {
        let configuration = store::lss::LssConfiguration {
            node_id: *node_id,
            bit_timing: index.map(|index| store::lss::BitTiming { selector: 0, index }),
        };
        let mut bytes = vec![0; 100];
        let used = store::lss::replace(&[], &configuration, &mut bytes).unwrap();
        bytes.truncate(used);
        DriveSettings {
            store: FlashFile::memory(bytes),
            ..DriveSettings::at(place.parse().unwrap(), &P3_EXTENDED)
        }
    });
    Bus::new(BusSettings {
        bit_rate,
        ..BusSettings::new(7, drives.collect())
    })
}

fn ms(bus: &mut Bus, ms: u64) {
    bus.run_until(bus.now().plus_ms(ms));
}

#[test]
fn a_frame_takes_its_bits_at_each_rate() {
    let bit_ns = [
        100_000, 50_000, 20_000, 10_000, 8_000, 4_000, 2_000, 1_250, 1_000,
    ];
    for (rate, bit_ns) in BitRate::ALL.into_iter().zip(bit_ns) {
        let mut bus = bus(rate, &[("1", None, None)]);
        ms(&mut bus, 60);
        let boot = bus.take_traffic();
        assert_eq!(boot.len(), 1, "{rate}");
        assert_eq!(boot[0].frame.raw_id(), 0x701);
        let (from, busy) = (bus.now(), bus.busy_ns());
        // Nobody answers them. An empty frame has at least 44 bits, and one of 8 bytes 108.
        let frames = [frame(0x7C5, &[]), frame(0x7C6, &[0x55; 8])];
        for frame in frames {
            bus.send(0, frame);
        }
        ms(&mut bus, 40);
        let bits = frames.map(|frame| u64::from(frame.frame_bits()));
        assert!((44..=55).contains(&bits[0]) && (108..=132).contains(&bits[1]));
        let ends: Vec<u64> = bus
            .take_traffic()
            .iter()
            .map(|t| t.at.since_ns(from))
            .collect();
        let second = bits[0] + 3 + bits[1];
        assert_eq!(ends, [bits[0] * bit_ns, second * bit_ns], "{rate}");
        assert_eq!(bus.busy_ns() - busy, (second + 3) * bit_ns, "{rate}");
        assert_eq!(bus.bit_rate(), rate);
        assert_eq!(bus.drives()[0].bit_rate(), rate);
    }
}

#[test]
fn of_two_drives_that_lss_gave_one_node_id_one_is_bus_off_for_the_same_number_of_bits() {
    let mut bits_off = Vec::new();
    for rate in [BitRate::Kbit125, BitRate::Mbit1] {
        let mut bus = bus(rate, &[("u1", Some(5), None), ("u2", Some(5), None)]);
        ms(&mut bus, 60);
        let mut told = Vec::new();
        // Each question costs one of them 7 (see `lifecycle.rs`).
        for _ in 0..30 {
            // Different serial numbers in frames of one identifier.
            bus.send(0, frame(0x605, &[0x40, 0x18, 0x10, 4, 0, 0, 0, 0]));
            // Both are ready when this has been on the wire, so both begin behind it.
            bus.send(0, frame(0x010, &[0; 8]));
            ms(&mut bus, 40);
            told.extend(bus.take_notices());
        }
        let texts: Vec<String> = told.iter().map(ToString::to_string).collect();
        let passive = texts.iter().take(2);
        assert!(
            passive
                .into_iter()
                .all(|text| text.contains("error passive: 128 transmit"))
        );
        assert_eq!(texts.len(), 4, "{texts:?}");
        assert!(
            texts[2].starts_with("node 5 (drive u2): bus-off"),
            "{texts:?}"
        );
        assert_eq!(texts[3], "node 5 (drive u2): back from bus-off");
        // The end of the other's frame is not among the 1408 recessive bits.
        let off_ns = told[3].at.since_ns(told[2].at);
        bits_off.push(off_ns / rate.bit_ns());
        assert!(matches!(told[2].kind, NoticeKind::BusOff));
    }
    assert_eq!(bits_off[0], bits_off[1]);
    assert!((1408..1408 + 132).contains(&bits_off[0]), "{bits_off:?}");
}

#[test]
fn another_bit_rate_is_deaf_and_mute() {
    let drives = [
        ("1", None, Some(3)),
        ("2", None, None),
        ("3", None, Some(3)),
    ];
    let mut bus = bus(BitRate::Mbit1, &drives);
    ms(&mut bus, 60);
    let rates: Vec<BitRate> = bus.drives().iter().map(|drive| drive.bit_rate()).collect();
    assert_eq!(rates, [BitRate::Kbit250, BitRate::Mbit1, BitRate::Kbit250]);
    let boot = bus.take_traffic();
    let place = Place::of_node(id(2));
    assert_eq!(boot.len(), 1, "{boot:?}");
    assert_eq!(boot[0].sender, Sender::Drive(place));
    let told: Vec<String> = bus.take_notices().iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 2);
    assert!(told[0].starts_with("node 1: it starts with 250 kbit/s, and the bus has 1 Mbit/s"));
    for node in 1..=3 {
        bus.send(0, frame(0x600 + node, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]));
    }
    bus.send(0, frame(0, &[0x02, 0]));
    ms(&mut bus, 20);
    let heard: Vec<u32> = bus
        .take_traffic()
        .iter()
        .map(|t| t.frame.raw_id())
        .collect();
    let answers: Vec<u32> = heard
        .into_iter()
        .filter(|id| id >> 7 == 0x580 >> 7)
        .collect();
    assert_eq!(answers, [0x582]);
    let state = |bus: &mut Bus, node| {
        bus.drive(id(node))
            .unwrap()
            .core()
            .unwrap()
            .comms()
            .node()
            .state()
    };
    assert_eq!(state(&mut bus, 2), canopen::NmtState::Stopped);
    assert_eq!(state(&mut bus, 1), canopen::NmtState::PreOperational);
    // Those of one rate hear each other.
    let errors = bus.drive(id(3)).unwrap().error_counters();
    assert_eq!((errors.receive, errors.transmit), (0, 0));
}

#[test]
fn the_faithful_p3_ignores_what_lss_would_have_stored() {
    let mut bus = bus(BitRate::Mbit1, &[("1", Some(9), Some(3))]);
    assert_eq!(bus.drive(id(1)).unwrap().personality().name, "p3-extended");
    ms(&mut bus, 60);
    assert!(bus.drive(id(9)).is_some(), "the extended one does not");
    let stored = bus.drives()[0].stored().to_vec();
    let p3 = DriveSettings {
        store: FlashFile::memory(stored),
        ..p3(1)
    };
    let mut bus = Bus::new(BusSettings::new(7, vec![p3]));
    ms(&mut bus, 60);
    assert_eq!(bus.drives()[0].node(), Some(id(1)));
    assert_eq!(bus.drives()[0].bit_rate(), BitRate::Mbit1);
    bus.send(0, frame(0x7E5, &[94, 0, 0, 0, 0, 0, 0, 0]));
    bus.send(0, frame(0x7E5, &[4, 1, 0, 0, 0, 0, 0, 0]));
    bus.send(0, frame(0x7E5, &[94, 0, 0, 0, 0, 0, 0, 0]));
    ms(&mut bus, 20);
    assert!(bus.take_traffic().iter().all(|t| t.frame.raw_id() != 0x7E4));
}
