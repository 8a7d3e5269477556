//! Broken cables: nodes that are cut off, wires that stay at one level, nobody who acknowledges.

mod master;
use master::*;

use canopen::Instant;
use personalities::p3_extended::P3_EXTENDED;
use sim::{
    BitPlace, Bus, BusSettings, DriveSettings, ErrorState, NoticeKind, Participant, Place, Sender,
    WhichFrames, WireAct, WireFault,
};

fn drive(node: u8) -> Participant {
    Participant::Drive(Place::of_node(id(node)))
}

fn count(master: &Master, raw: u32) -> usize {
    let frames = master.log.iter();
    frames.filter(|t| t.frame.raw_id() == raw).count()
}

/// Transmit and receive error counter.
fn errors(master: &mut Master, node: u8) -> (u16, u16) {
    let counters = master.drive(node).error_counters();
    (counters.transmit, counters.receive)
}

/// Writes to the extended drive, which wants eight bytes and a size.
fn write_plain(master: &mut Master, node: u8, index: u16, value: &[u8]) {
    let [low, high] = index.to_le_bytes();
    let mut data = [
        0x23 | (4 - value.len() as u8) << 2,
        low,
        high,
        0,
        0,
        0,
        0,
        0,
    ];
    data[4..4 + value.len()].copy_from_slice(value);
    master.log.clear();
    master.send(0x600 + u16::from(node), &data);
    master.run_ms(3);
    let done = frame(0x580 + u16::from(node), &[0x60, low, high, 0, 0, 0, 0, 0]);
    assert!(
        master.log.iter().any(|t| t.frame == done),
        "{:?}",
        master.log
    );
}

#[test]
fn who_is_cut_off_is_error_passive_when_it_sends_and_comes_back() {
    let mut master = Master::with(vec![p3(1), DriveSettings::new(id(2), &P3_EXTENDED), p3(3)]);
    write_plain(&mut master, 2, 0x1017, &[10, 0]);
    master.run_ms(20);
    master.bus.act(WireAct::Disconnect(drive(2))).unwrap();
    master.log.clear();
    master.run_ms(100);
    assert_eq!(count(&master, 0x702), 0);
    assert_eq!(errors(&mut master, 2), (128, 0));
    assert_eq!(
        master.drive(2).error_counters().state(),
        ErrorState::Passive
    );
    assert_eq!(errors(&mut master, 1), (0, 0));
    let passive = |kind: &NoticeKind| matches!(kind, NoticeKind::ErrorPassive(_));
    let notices = master.bus.take_notices();
    assert_eq!(notices.len(), 1);
    assert!(passive(&notices[0].kind) && notices[0].who == Some(drive(2)));
    // It hears nothing meanwhile.
    master.send(0x602, &[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]);
    master.run_ms(5);
    assert_eq!((count(&master, 0x602), count(&master, 0x582)), (1, 0));
    master.bus.act(WireAct::Connect(drive(2))).unwrap();
    master.run_ms(200);
    assert!(count(&master, 0x702) >= 18);
    // It tells that it was error passive, while it is, and that it is not any more.
    assert_eq!(master.emergency_codes(2), [0x8120, 0]);
    let (transmit, _) = errors(&mut master, 2);
    assert!(transmit < 128, "{transmit}");
}

/// Cut off and connected at every bit of its frames and of others': whatever is broken is repaired.
#[test]
fn plugging_at_any_moment_heals() {
    for bit in 0..130_u64 {
        for connect in [false, true] {
            let mut master = Master::new(&[1, 2]);
            if connect {
                master.bus.act(WireAct::Disconnect(drive(1))).unwrap();
            }
            master.send(0x7F0, &[0x55; 8]);
            master.send(0x601, &[0x40, 0x41, 0x60, 0]);
            master.run_us(bit);
            let act = if connect {
                WireAct::Connect
            } else {
                WireAct::Disconnect
            };
            master.bus.act(act(drive(1))).unwrap();
            master.run_ms(3);
            assert_eq!(count(&master, 0x7F0), 1, "bit {bit}");
            let (_, receive) = errors(&mut master, 2);
            assert!(receive <= 9, "{receive}");
            if !connect {
                assert_eq!(count(&master, 0x581), 0);
                master.bus.act(WireAct::Connect(drive(1))).unwrap();
            }
            master.log.clear();
            assert_eq!(master.state(1), SWITCH_ON_DISABLED);
            assert_eq!(master.state(2), SWITCH_ON_DISABLED);
        }
    }
}

#[test]
fn a_short_circuit_drives_off_whoever_sends() {
    for fault in [WireFault::Recessive, WireFault::Dominant] {
        let mut master = Master::with(vec![p3(1), DriveSettings::new(id(2), &P3_EXTENDED)]);
        master.write_u16(1, 0x1017, 0, 5);
        master.write(1, 0x2405, 0, &[1]);
        write_plain(&mut master, 2, 0x1017, &[5, 0]);
        write_plain(&mut master, 2, 0x2405, &[1]);
        master.run_ms(20);
        master.log.clear();
        master.send(0x7F0, &[0; 8]);
        master.send(0x7F1, &[0; 8]);
        master.run_us(30);
        let for_ns = 50_000_000;
        master.bus.act(WireAct::Break { fault, for_ns }).unwrap();
        master.run_ms(49);
        assert_eq!(master.log.len(), 0, "{fault:?}");
        let notices = master.bus.take_notices();
        let off: Vec<_> = notices
            .iter()
            .filter(|notice| matches!(notice.kind, NoticeKind::BusOff))
            .map(|notice| notice.who.unwrap())
            .collect();
        assert_eq!(off[0], Participant::Outside, "it was sending");
        let states = [1, 2].map(|node| master.drive(node).error_counters().state());
        match fault {
            // The drives try their heartbeats, go off, come back after 1408 bits and try again.
            WireFault::Recessive => {
                assert!(
                    off.contains(&drive(1)) && off.contains(&drive(2)),
                    "{off:?}"
                );
                // Its first frame, then after each recovery the next one.
                assert_eq!(
                    (master.bus.take_dropped(), master.bus.outside_waiting()),
                    (vec![0, 0], 0)
                );
            }
            // The wire is never free, so nobody else begins, and nobody comes back.
            WireFault::Dominant => {
                assert_eq!(off, [Participant::Outside]);
                assert_eq!(states, [ErrorState::Passive; 2]);
                assert_eq!(
                    (master.bus.take_dropped(), master.bus.outside_waiting()),
                    (vec![0], 1)
                );
            }
        }
        master.run_ms(60);
        let notices = master.bus.take_notices();
        assert!(notices.iter().any(|n| matches!(n.kind, NoticeKind::BusOn)));
        assert_eq!(count(&master, 0x7F0), 0, "dropped");
        assert!(count(&master, 0x701) > 5 && count(&master, 0x702) > 5);
        let codes = [1, 2].map(|node| master.emergency_codes(node));
        match fault {
            WireFault::Recessive => {
                // What they sent of it while the cable was broken is lost.
                assert_eq!(master.read(1, 0x1003, 1), 0x8140, "{codes:?}");
                assert_eq!(master.state(1), FAULT);
            }
            WireFault::Dominant => {
                assert_eq!(codes, [vec![], vec![0x8120, 0]]);
            }
        }
    }
}

/// The gateway is there from the start, but alone it is not acknowledged.
#[test]
fn frames_wait_for_a_drive_that_boots() {
    let mut bus = Bus::new(BusSettings::new(7, vec![p3(1)]));
    bus.run_until(Instant::ZERO.plus_ms(1));
    bus.send(0, frame(0x601, &[0x40, 0x00, 0x10, 0]));
    bus.run_until(Instant::ZERO.plus_ms(19));
    assert_eq!(bus.take_traffic(), []);
    assert_eq!(bus.outside_error_counters().transmit, 128);
    assert_eq!(bus.outside_waiting(), 1);
    bus.run_until(Instant::ZERO.plus_ms(60));
    let ids: Vec<u32> = bus
        .take_traffic()
        .iter()
        .map(|t| t.frame.raw_id())
        .collect();
    assert!(
        ids.contains(&0x701) && ids.contains(&0x601) && ids.contains(&0x581),
        "{ids:X?}"
    );
}

/// A receiver that is not the only one goes in the middle of a frame: played on bit by bit, the frame
/// ends when it would have ended, without an error.
#[test]
fn a_frame_that_is_looked_into_half_way_goes_on_as_it_was() {
    let sent = frame(0x7F0, &[0x0F; 8]);
    for bit in 0..sent.wire_bits() {
        let mut master = Master::new(&[1, 2, 3]);
        master.send(0x7F0, &[0x0F; 8]);
        let from = master.now();
        master.run_us(u64::from(bit));
        master.bus.act(WireAct::Disconnect(drive(3))).unwrap();
        master.run_ms(1);
        assert_eq!(master.log.len(), 1, "bit {bit}");
        let took = master.log[0].at.since_ns(from);
        assert_eq!(took, u64::from(sent.frame_bits()) * 1000, "bit {bit}");
        for node in [1, 2] {
            assert_eq!(errors(&mut master, node), (0, 0), "bit {bit}");
        }
        assert_eq!(master.bus.outside_error_counters(), Default::default());
    }
}

/// A bus on which drive 1 has gone off while it sent a heartbeat; the cable is good again.
fn drive_1_off() -> Master {
    let mut master = Master::new(&[1, 2]);
    master.write_u16(1, 0x1017, 0, 5);
    master.run_ms(10);
    master.log.clear();
    while count(&master, 0x701) == 0 {
        master.run_us(10);
    }
    master.run_us(4_800);
    let break_it = WireAct::Break {
        fault: WireFault::Recessive,
        for_ns: 1_200_000,
    };
    master.bus.act(break_it).unwrap();
    master.run_us(1_200);
    assert_eq!(master.drive(1).error_counters().state(), ErrorState::BusOff);
    master
}

/// Who has gone off has given its frame up: the same frame is then another's.
#[test]
fn the_frame_of_who_is_off_is_the_one_s_who_sends_it() {
    let mut master = drive_1_off();
    let beat = master.log.last().unwrap().frame;
    master.log.clear();
    // It does not destroy the frame, but that is looked at bit by bit.
    let flip = WireAct::Flip {
        frames: WhichFrames::NEXT,
        bit: BitPlace::EndOfFrame(7),
        seen_by: Some(drive(2)),
    };
    master.bus.act(flip).unwrap();
    master.bus.send(0, beat);
    master.run_us(400);
    assert_eq!(master.drive(1).error_counters().state(), ErrorState::BusOff);
    assert_eq!(master.log.len(), 1);
    let traffic = &master.log[0];
    assert_eq!((traffic.frame, traffic.sender), (beat, Sender::Outside(0)));
}

/// A controller comes back without its processor, and that is told.
#[test]
fn who_comes_back_while_its_processor_hangs_is_told_of() {
    let mut master = drive_1_off();
    let now = master.now();
    master.drive(1).hang(now);
    master.bus.take_notices();
    master.run_ms(15);
    let active = ErrorState::Active;
    assert_eq!(master.drive(1).error_counters().state(), active);
    let notices = master.bus.take_notices();
    let told: Vec<_> = notices.iter().map(|n| (n.who, &n.kind)).collect();
    assert!(
        matches!(told[..], [(Some(who), NoticeKind::BusOn)] if who == drive(1)),
        "{notices:?}"
    );
    // The watchdog bites then.
    master.run_ms(60);
    assert_eq!(master.emergency_codes(1), [0x6010]);
}

/// What is told of once is told again of a controller that has been without power meanwhile.
#[test]
fn a_drive_that_was_off_is_told_of_again_when_it_is_error_passive() {
    let mut master = Master::new(&[1, 2]);
    master.bus.act(WireAct::Disconnect(drive(1))).unwrap();
    for _ in 0..2 {
        // Its boot-up message, or what it would answer, is not acknowledged.
        master.drive(1).plant().set_logic_supply_v(0.0);
        master.run_ms(1);
        master.drive(1).plant().set_logic_supply_v(24.0);
        master.run_ms(60);
        let notices = master.bus.take_notices();
        assert_eq!(notices.len(), 1, "{notices:?}");
        assert!(matches!(notices[0].kind, NoticeKind::ErrorPassive(_)));
    }
}

/// A cable that breaks again meanwhile is good when both are mended; while it is dominant somewhere,
/// it is dominant.
#[test]
fn a_cable_that_breaks_twice_is_broken_until_both_are_over() {
    use WireFault::{Dominant, Recessive};
    for (first, second, broken_us) in [
        ((Recessive, 5_000), (Dominant, 1_000), 5_000),
        ((Recessive, 5_000), (Recessive, 1_000), 5_000),
        ((Dominant, 5_000), (Recessive, 1_000), 5_000),
        ((Dominant, 2_000), (Recessive, 8_000), 9_000),
    ] {
        let mut master = Master::new(&[1, 2]);
        let from = master.now();
        for (fault, us) in [first, second] {
            let for_ns = us * 1_000;
            master.bus.act(WireAct::Break { fault, for_ns }).unwrap();
            master.run_us(1_000);
        }
        // So many that those which bus-off drops are not all.
        for _ in 0..40 {
            master.send(0x7F0, &[0; 8]);
        }
        master.run_ms(60);
        let first_us = master.log[0].at.since_ns(from) / 1_000;
        let frame_us = u64::from(frame(0x7F0, &[0; 8]).frame_bits());
        let began_us = first_us - frame_us;
        // At most what it takes to come back from bus-off.
        assert!(
            (broken_us..broken_us + 2_000).contains(&began_us),
            "{first:?} {second:?}: {began_us}"
        );
    }
}
