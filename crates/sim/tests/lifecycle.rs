//! Boot, resets, stored parameters, and what happens on a wire that is shared badly.

mod master;
use master::*;

use canopen::Instant;
use sim::{FlashFile, NoticeKind, Participant, Place, Sender};

fn heartbeats(master: &Master, node: u8) -> Vec<u8> {
    let id = 0x700 + u32::from(node);
    let frames = master.log.iter().filter(|t| t.frame.raw_id() == id);
    frames.map(|t| t.frame.data()[0]).collect()
}

/// A place for a store's file, of this test alone.
fn folder(name: &str) -> std::path::PathBuf {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

#[test]
fn reset_node_starts_everything_over() {
    // The second one acknowledges what the first does not hear.
    let mut master = Master::new(&[1, 2]);
    master.enable(1, 3);
    master.write_i32(1, 0x60FF, 0, 100_000);
    master.run_ms(300);
    assert!(master.position(1) > 10_000);
    master.log.clear();
    master.send(0, &[0x81, 1]);
    master.run_ms(2);
    // While it boots the bridge is off and it is deaf.
    assert!(master.drive(1).core().is_none());
    master.run_ms(10);
    let current = master.drive(1).plant().truth().phase_current_a;
    assert!(current.iter().all(|a| a.abs() < 0.01), "{current:?}");
    master.send(0x601, &[0x40, 0x41, 0x60, 0]);
    master.run_ms(30);
    assert_eq!(heartbeats(&master, 1), [0]);
    assert!(!master.log.iter().any(|t| t.frame.raw_id() == 0x581));
    assert_eq!(master.status(1) & 0x4F, SWITCH_ON_DISABLED);
    assert_eq!(master.read(1, 0x60FF, 0), 0);
    // The rotor, braked by hand: the position is the raw reading of the encoder.
    master.drive(1).plant().set_blocked(true);
    master.send(0, &[0x81, 1]);
    master.run_ms(50);
    let position = master.position(1);
    assert!((0..4096).contains(&position));
    assert_eq!(position, i32::from(master.read_i16(1, 0x3012, 1)));
}

#[test]
fn reset_communication_keeps_the_application() {
    let mut master = Master::new(&[1]);
    master.enable(1, 3);
    master.write_i32(1, 0x60FF, 0, 50_000);
    master.write_u16(1, 0x1017, 0, 100);
    master.write_i32(1, 0x6083, 0, 1_234_567);
    master.run_ms(300);
    let position = master.position(1);
    master.log.clear();
    master.send(0, &[0x82, 1]);
    master.run_ms(50);
    assert_eq!(heartbeats(&master, 1), [0]);
    assert_eq!(master.read(1, 0x1017, 0), 0, "a communication parameter");
    assert_eq!(
        master.read(1, 0x6083, 0),
        1_234_567,
        "an application parameter"
    );
    // The motion goes on.
    assert_eq!(master.state(1), OPERATION_ENABLED);
    assert!(master.position(1) > position);
    assert!((master.read(1, 0x606C, 0) - 50_000).abs() < 1_000);
}

#[test]
fn reset_communication_is_no_set_point() {
    // Modes whose target was never written: the axis holds and stays where it is.
    for mode in [8, 9, 10] {
        let mut master = Master::new(&[1]);
        master.enable(1, mode);
        master.run_ms(20);
        let position = master.position(1);
        assert!(position > 1000, "its reading at rest is 3576: {position}");
        master.send(0, &[0x82, 1]);
        master.run_ms(200);
        assert_eq!(master.state(1), OPERATION_ENABLED);
        assert!((master.position(1) - position).abs() <= 3, "mode {mode}");
    }
}

#[test]
fn what_is_stored_is_there_after_a_reset() {
    // Communication, application, and what each way of storing keeps of them.
    for (sub, value, communication, application) in [
        (1, SAVE, true, true),
        (2, SAVE, true, false),
        (3, SAVE, false, true),
        (4, [0, 0x17, 0x10, 0], true, false),
        (4, [7, 0x19, 0x30, 0], false, false),
        (4, [0, 0x83, 0x60, 0], false, true),
    ] {
        let mut master = Master::new(&[1]);
        master.write_u16(1, 0x1017, 0, 50);
        master.write_i32(1, 0x6083, 0, 777_777);
        let before = master.now();
        master.write(1, 0x1010, sub, &value);
        let ms = master.now().since_ns(before) / 1_000_000;
        assert!(
            (5..8).contains(&ms),
            "the answer comes when it is written: {ms} ms"
        );
        master.send(0, &[0x81, 1]);
        master.run_ms(60);
        let kept = (
            master.read(1, 0x1017, 0) == 50,
            master.read(1, 0x6083, 0) == 777_777,
        );
        assert_eq!(
            kept,
            (communication, application),
            "1010,{sub} {value:02X?}"
        );
    }
    let mut master = Master::new(&[1]);
    for (sub, value) in [
        (1, *b"SAVE"),
        (2, [0; 4]),
        (4, [0, 0x41, 0x60, 0]),
        (4, [0, 0xFF, 0xFF, 0]),
        (4, [0, 0, 0, 1]),
    ] {
        assert_eq!(
            master.try_write(1, 0x1010, sub, &value),
            Err(0x0800_0020),
            "{value:02X?}"
        );
    }
    assert_eq!(master.read(1, 0x1010, 1), 1);
    assert!(master.drive(1).stored().is_empty());
}

/// Where the set in the second slot ends. The slot's header has its length at 8, and the set begins
/// in the third chunk of 64 bytes.
fn end_of_second_set(flash: &[u8]) -> usize {
    let slot = 0x4000;
    let length = flash[slot + 8..slot + 12].try_into().unwrap();
    slot + 128 + u32::from_le_bytes(length) as usize
}

/// Behind the set the word of the flash is filled up as erased, and what the file does not have is
/// erased: whatever is cut there is no damage.
#[test]
fn a_store_without_what_fills_it_up_is_whole() {
    let folder = folder("filling");
    let file = folder.join("p3-node1.flash");
    let store = || FlashFile::file(&folder, "p3", Place::of_node(id(1))).unwrap();
    let settings = || {
        let mut settings = p3(1);
        settings.store = store();
        vec![settings]
    };
    {
        let mut master = Master::with(settings());
        master.write_i32(1, 0x6083, 0, 777_777);
        master.write(1, 0x1010, 1, &SAVE);
    }
    let good = std::fs::read(&file).unwrap();
    let end = end_of_second_set(&good);
    // As much as the length of a P3's parameters leaves of a word of four.
    assert_eq!(good.len(), end.next_multiple_of(4));
    let filling = &good[end..];
    assert_eq!(filling, [0xFF; 3]);
    let set = store().bytes().to_vec();
    for cut in 0..=filling.len() {
        std::fs::write(&file, &good[..good.len() - cut]).unwrap();
        assert_eq!(store().bytes(), set);
        let mut master = Master::with(settings());
        assert!(master.bus.take_notices().is_empty(), "cut by {cut}");
        assert_eq!(master.read(1, 0x6083, 0), 777_777);
        assert_eq!(master.state(1), SWITCH_ON_DISABLED);
        assert!(!folder.join("p3-node1.flash.corrupt").exists());
    }
}

#[test]
fn a_damaged_store_is_kept_beside_and_the_drive_starts_on_its_defaults() {
    let folder = folder("damaged");
    let file = folder.join("p3-node1.flash");
    let settings = || {
        let mut settings = p3(1);
        settings.store = FlashFile::file(&folder, "p3", Place::of_node(id(1))).unwrap();
        vec![settings]
    };
    {
        let mut master = Master::with(settings());
        master.write_i32(1, 0x6083, 0, 777_777);
        master.write(1, 0x1010, 1, &SAVE);
    }
    {
        let mut master = Master::with(settings());
        assert_eq!(master.read(1, 0x6083, 0), 777_777);
        assert!(master.bus.take_notices().is_empty());
    }
    let good = std::fs::read(&file).unwrap();
    let end = end_of_second_set(&good);
    let mut bad = good.clone();
    bad[end - 1] ^= 1;
    let cuts = [1, 2, 3, 8].map(|bytes| good[..end - bytes].to_vec());
    let damaged = [bad, b"no parameters at all".to_vec()];
    for damaged in damaged.into_iter().chain(cuts) {
        let aside = folder.join("p3-node1.flash.corrupt");
        let _ = std::fs::remove_file(&aside);
        std::fs::write(&file, &damaged).unwrap();
        let mut master = Master::with(settings());
        assert_eq!(std::fs::read(&aside).unwrap(), damaged);
        let store = FlashFile::file(&folder, "p3", Place::of_node(id(1))).unwrap();
        assert_eq!(store.bytes(), [0u8; 0]);
        let notices = master.bus.take_notices();
        let [notice] = notices.as_slice() else {
            panic!("{notices:?}")
        };
        assert!(
            matches!(&notice.kind, NoticeKind::StoreDamaged { kept: Ok(Some(kept)), .. } if *kept == aside)
        );
        let text = notice.to_string();
        assert!(
            text.contains("node 1") && text.contains(".corrupt") && text.contains("0x6320"),
            "{text}"
        );
        assert_eq!(master.read(1, 0x6083, 0), 2_000_000);
        assert_eq!(master.state(1), FAULT);
        assert_eq!(master.read(1, 0x603F, 0), 0x6320);
        assert_eq!(master.read(1, 0x1001, 0), 0x01);
        // A reset is enough, and saving makes a good file again.
        master.write_u16(1, 0x6040, 0, 0x86);
        master.run_ms(5);
        assert_eq!(master.state(1), READY_TO_SWITCH_ON);
        master.write(1, 0x1010, 1, &SAVE);
        let saved = FlashFile::file(&folder, "p3", Place::of_node(id(1))).unwrap();
        assert!(!saved.bytes().is_empty() && !saved.is_damaged());
    }
    {
        let mut master = Master::with(settings());
        assert!(master.bus.take_notices().is_empty());
        assert_eq!(master.state(1), SWITCH_ON_DISABLED);
        master.write_i32(1, 0x6083, 0, 888_888);
        master.write(1, 0x1010, 1, &SAVE);
    }
    // Two sets: damage to the newest costs that one. It is the one in the first slot.
    let newest = 128 + 20;
    let mut bytes = std::fs::read(&file).unwrap();
    let second = bytes[0x4000..].to_vec();
    bytes[newest] ^= 1;
    std::fs::write(&file, &bytes).unwrap();
    let mut master = Master::with(settings());
    let notices = master.bus.take_notices();
    let [notice] = notices.as_slice() else {
        panic!("{notices:?}")
    };
    let text = notice.to_string();
    assert!(
        matches!(
            &notice.kind,
            NoticeKind::StoreFellBack { kept: Ok(Some(_)) }
        ) && text.contains("it starts on those stored before"),
        "{text}"
    );
    assert_eq!(master.read(1, 0x6083, 0), 2_000_000);
    assert_eq!(master.state(1), SWITCH_ON_DISABLED);
    assert_eq!(std::fs::read(&file).unwrap()[0x4000..], second);
}

#[test]
fn stored_parameters_that_make_no_drive_are_a_parameter_error() {
    let mut master = Master::new(&[1]);
    master.write_u16(1, 0x3019, 3, 1_000);
    master.write(1, 0x1010, 1, &SAVE);
    master.log.clear();
    master.send(0, &[0x81, 1]);
    master.run_ms(60);
    assert_eq!(heartbeats(&master, 1), [0]);
    assert_eq!(master.emergencies(1), [[0x20, 0x63, 0x01, 0, 0, 0, 0, 0]]);
    assert_eq!(master.state(1), FAULT);
    assert_eq!(master.read(1, 0x3019, 3), 1_000);
    master.write_u16(1, 0x3019, 3, 20_000);
    master.write_u16(1, 0x6040, 0, 0x86);
    master.run_ms(5);
    assert_eq!(master.state(1), READY_TO_SWITCH_ON);
}

/// A SYNC, and a long frame behind it, at whose end both answers begin in the same bit. Without it
/// the faster drive's frame would be heard by the slower one, which would wait.
fn sync(master: &mut Master) {
    master.send(0x80, &[]);
    master.send(0x010, &[0x55; 8]);
}

/// Two drives that answer SYNC with one identifier and different data.
fn quarrel() -> Master {
    let mut master = Master::new(&[1, 2, 3]);
    for node in [1, 2] {
        // The serial number differs from drive to drive, always.
        master.write(node, 0x1A00, 0, &[0]);
        master.write(node, 0x1A00, 1, &[0x20, 0x00, 0x64, 0x60]);
        master.write(node, 0x1A00, 0, &[1]);
        master.write(node, 0x1800, 1, &[0x90, 0x01, 0, 0]);
        master.write_i32(node, 0x6064, 0, i32::from(node));
    }
    master.log.clear();
    master
}

/// How often SYNC comes until one is bus-off: the first one takes both to 128 in sixteen collisions,
/// each of which costs both 8. From then on who reads a dominant bit for its recessive one only
/// marks the error for itself, the other's frame comes through, and its own after it: 8 − 1 more
/// with each SYNC. 128 + 8 − 1 + 17 · 7 = 254 after the eighteenth; the next 8 are too many.
const SYNCS: usize = 19;

#[test]
fn of_two_senders_of_one_identifier_one_is_driven_off_the_bus() {
    let mut master = quarrel();
    for n in 1..SYNCS as u16 {
        sync(&mut master);
        master.run_ms(5);
        // 1 is …01 and 2 is …10: it is the second one that reads a dominant bit.
        let sent: Vec<i32> = [1, 2]
            .map(|node| i32::from(master.drive(node).error_counters().transmit))
            .into();
        assert_eq!(
            sent,
            [128 - i32::from(n), 128 + 7 * i32::from(n)],
            "SYNC {n}"
        );
    }
    assert_eq!(master.drive(3).error_counters().receive, 0);
    let frames = master.log.iter().filter(|t| t.frame.raw_id() == 0x190);
    let values: Vec<u8> = frames.map(|t| t.frame.bytes()[0]).collect();
    assert_eq!(values, [1, 2].repeat(SYNCS - 1));
    master.log.clear();
    sync(&mut master);
    let off_at = loop {
        master.run_us(1);
        if master.drive(2).error_counters().is_bus_off() {
            break master.now();
        }
    };
    assert_eq!(master.drive(2).error_counters().transmit, 262);
    assert!(!master.drive(1).error_counters().is_bus_off());
    master.run_ms(1);
    let notices = master.bus.take_notices();
    let told = |kind: fn(&NoticeKind) -> bool| -> Vec<Option<Participant>> {
        let these = notices.iter().filter(|notice| kind(&notice.kind));
        these.map(|notice| notice.who).collect()
    };
    let drive = |node| Some(Participant::Drive(Place::of_node(id(node))));
    assert_eq!(told(|kind| matches!(kind, NoticeKind::BusOff)), [drive(2)]);
    assert_eq!(
        told(|kind| matches!(kind, NoticeKind::ErrorPassive(_))),
        [drive(2), drive(1)],
        "each once"
    );
    // It comes back after 128 · 11 recessive bits and is as good as new; nobody was told, since
    // 0x2405 is 0. Of the other's frame 8 recessive bits are behind the acknowledge.
    let frames = master.log.iter().filter(|t| t.frame.raw_id() == 0x190);
    let ends: Vec<Instant> = frames.map(|t| t.at).collect();
    let [end] = ends[..] else { panic!("{ends:?}") };
    assert!(end > off_at);
    let back_at = Instant(end.0 + (1408 - 8) * 1000);
    master.run_us((back_at.since_ns(master.now()) - 1) / 1000);
    assert!(master.drive(2).error_counters().is_bus_off());
    master.run_us(2);
    assert_eq!(master.drive(2).error_counters(), Default::default());
    master.run_ms(5);
    for node in [1, 2, 3] {
        assert_eq!(master.state(node), SWITCH_ON_DISABLED);
        assert!(master.emergencies(node).is_empty());
    }
}

#[test]
fn the_same_frame_from_two_senders_is_one_frame() {
    let mut master = quarrel();
    // The same data: they cannot notice each other.
    master.write_i32(2, 0x6064, 0, 1);
    master.run_ms(2);
    master.log.clear();
    sync(&mut master);
    master.run_ms(5);
    let frames = master.log.iter().filter(|t| t.frame.raw_id() == 0x190);
    assert_eq!(frames.count(), 1);
    assert_eq!(master.drive(1).error_counters().transmit, 0);
}

#[test]
fn recovery_from_bus_off_is_a_fault_where_it_is_asked_for() {
    let mut master = quarrel();
    for node in [1, 2] {
        master.write(node, 0x2405, 0, &[1]);
    }
    master.log.clear();
    for _ in 0..SYNCS {
        sync(&mut master);
        master.run_ms(5);
    }
    let told = master.emergencies(2);
    assert_eq!(told, [[0x40, 0x81, 0x11, 0, 0, 0, 0, 0]]);
    assert_eq!(master.state(2), FAULT);
    assert!(master.emergencies(1).is_empty());
    assert_eq!(master.state(1), SWITCH_ON_DISABLED);
}

#[test]
fn frames_faster_than_the_drive_can_take_them_are_lost_and_may_be_a_fault() {
    for enabled in [0, 1] {
        let mut master = Master::new(&[1]);
        master.write(1, 0x2404, 0, &[enabled]);
        master.log.clear();
        // Shortest possible frames, back to back: 47 µs each, so a drive that needs 8 to 12 µs a
        // frame keeps up.
        for _ in 0..500 {
            master.send(0x7FF, &[]);
        }
        master.run_ms(40);
        assert_eq!(
            master
                .log
                .iter()
                .filter(|t| t.sender == Sender::Outside(0))
                .count(),
            500
        );
        assert!(master.emergencies(1).is_empty());
        // A processor that is held up cannot.
        let until = master.now().plus_ms(2);
        master.drive(1).stall_until(until);
        for _ in 0..40 {
            master.send(0x7FF, &[]);
        }
        master.run_ms(10);
        if enabled == 1 {
            assert_eq!(master.emergencies(1), [[0x10, 0x81, 0x11, 0, 0, 0, 0, 0]]);
            assert_eq!(master.state(1), FAULT);
            assert_eq!(master.read(1, 0x1002, 0), 1 << 10);
        } else {
            assert!(master.emergencies(1).is_empty());
            assert_eq!(master.state(1), SWITCH_ON_DISABLED);
        }
    }
}
