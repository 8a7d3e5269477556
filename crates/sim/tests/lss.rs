//! LSS on a simulated bus: our own master against virtual drives, in virtual time.

use std::path::PathBuf;

use canopen::lss::{BitTiming, Identity, Known, State};
use canopen::nmt::Command;
use canopen::{Address, DataType, Instant, NmtState, NodeId};
use client::{Client, Value, block_on};
use personalities::p3_extended::P3_EXTENDED;
use sim::{
    BitRate, Bus, BusSettings, DriveSettings, FlashFile, Place, Recording, RunHeader, Sender,
    VirtualLink, replay,
};

fn id(node: u8) -> NodeId {
    NodeId::new(node).unwrap()
}

fn place(text: &str) -> Place {
    text.parse().unwrap()
}

fn settings(bit_rate: BitRate, places: &[&str]) -> BusSettings {
    let drives = places
        .iter()
        .map(|text| DriveSettings::at(place(text), &P3_EXTENDED));
    BusSettings {
        bit_rate,
        ..BusSettings::new(3, drives.collect())
    }
}

/// These drives, which have booted.
fn booted(settings: BusSettings) -> Bus {
    let mut bus = Bus::new(settings);
    bus.run_until(Instant::ZERO.plus_ms(60));
    bus
}

/// The same drives after the power was off.
fn power_cycle(bus: &Bus) -> Bus {
    let drives = bus.drives().iter().map(|drive| DriveSettings {
        store: FlashFile::memory(drive.stored().to_vec()),
        ..DriveSettings::at(drive.place(), drive.personality())
    });
    booted(BusSettings {
        bit_rate: bus.bit_rate(),
        ..BusSettings::new(3, drives.collect())
    })
}

type Master<'a> = Client<VirtualLink<'a>>;

fn master(bus: &mut Bus) -> Master<'_> {
    let _ = bus.take_traffic();
    Client::new(VirtualLink::new(bus, 1))
}

fn wait_ms(master: &mut Master<'_>, ms: u64) {
    let until = master.now().plus_ms(ms);
    while block_on(master.receive(until)).unwrap().is_some() {}
}

/// 0x1018,4.
fn serial_of(master: &mut Master<'_>, node: u8) -> Option<u32> {
    let object = Address::new(0x1018, 4);
    match block_on(master.read(id(node), object, DataType::U32)) {
        Ok(Value::Integer(value)) => u32::try_from(value).ok(),
        Ok(other) => panic!("{other:?}"),
        Err(_) => None,
    }
}

fn nodes(bus: &Bus) -> Vec<Option<u8>> {
    let ids = bus.drives().iter().map(|drive| drive.node());
    ids.map(|id| id.map(NodeId::get)).collect()
}

fn identity(serial: u32) -> Identity {
    Identity {
        vendor: 0x408,
        product: 0x5033,
        revision: 0x0002_0000,
        serial,
    }
}

#[test]
fn five_drives_get_their_node_ids_and_keep_them() {
    let mut bus = booted(settings(BitRate::Mbit1, &["u1", "u2", "u3", "u4", "u5"]));
    assert_eq!(bus.take_traffic(), [], "no boot-up without a node ID");
    let ids = [10, 11, 12, 13, 14].map(id);
    let mut master = master(&mut bus);
    let found = block_on(
        master
            .lss()
            .find_unconfigured(Known::default(), &mut |_| ()),
    )
    .unwrap();
    let serials: Vec<u32> = found.devices.iter().map(|device| device.serial).collect();
    let own: Vec<u32> = master
        .link()
        .bus()
        .drives()
        .iter()
        .map(|d| d.serial())
        .collect();
    assert_eq!(serials, own);
    assert!(
        found
            .devices
            .iter()
            .all(|device| *device == identity(device.serial))
    );
    assert_eq!(found.doubtful, []);

    let assign = master.lss();
    let mut assign = assign;
    let done = block_on(assign.assign(&ids, Known::default(), true, &mut |_| ())).unwrap();
    assert!(!done.more);
    for (n, assigned) in done.assigned.iter().enumerate() {
        assert_eq!((assigned.node, assigned.booted), (ids[n], true));
        assert_eq!(assigned.identity.serial, serials[n]);
    }
    for (node, serial) in (10..).zip(&serials) {
        assert_eq!(serial_of(&mut master, node), Some(*serial));
    }
    drop(master);

    let mut bus = power_cycle(&bus);
    assert_eq!(nodes(&bus), [10, 11, 12, 13, 14].map(Some));
    assert_eq!(bus.take_traffic().len(), 5, "boot-ups");
    let mut master = self::master(&mut bus);
    for (node, serial) in (10..).zip(&serials) {
        assert_eq!(serial_of(&mut master, node), Some(*serial));
    }
    let found = block_on(
        master
            .lss()
            .find_unconfigured(Known::default(), &mut |_| ()),
    )
    .unwrap();
    assert_eq!(found.devices, []);
}

#[test]
fn a_node_id_is_pending_until_its_communication_is_reset() {
    let mut bus = booted(settings(BitRate::Mbit1, &["5"]));
    let serial = bus.drives()[0].serial();
    let mut master = master(&mut bus);
    let set = |master: &mut Master<'_>, node: Option<u8>, stores: bool| {
        let mut lss = master.lss();
        block_on(async {
            lss.select(identity(serial)).await.unwrap();
            lss.set_node_id(node.map(id)).await.unwrap();
            if stores {
                lss.store().await.unwrap();
            }
            lss.switch(State::Waiting).await.unwrap();
        });
    };
    let reset = |master: &mut Master<'_>, command, node| {
        block_on(master.nmt(command, Some(id(node)))).unwrap();
        wait_ms(master, 60);
    };
    set(&mut master, Some(6), false);
    assert_eq!(serial_of(&mut master, 5), Some(serial));
    let deceleration = Address::new(0x6084, 0);
    let value = Value::Integer(123_456);
    let bytes = value.encode(DataType::U32).unwrap();
    block_on(master.download(id(5), deceleration, bytes)).unwrap();
    reset(&mut master, Command::ResetCommunication, 5);
    assert_eq!(serial_of(&mut master, 5), None);
    assert_eq!(serial_of(&mut master, 6), Some(serial));
    // Communication has started over, and nothing else.
    let kept = block_on(master.read(id(6), deceleration, DataType::U32)).unwrap();
    assert_eq!(kept, value);
    // It was not stored: a reset of the node brings the old one back.
    reset(&mut master, Command::ResetNode, 6);
    assert_eq!(serial_of(&mut master, 5), Some(serial));
    set(&mut master, Some(7), true);
    assert_eq!(serial_of(&mut master, 5), Some(serial));
    reset(&mut master, Command::ResetNode, 5);
    assert_eq!(serial_of(&mut master, 7), Some(serial));
    // A reset of communication with nothing pending changes nothing.
    reset(&mut master, Command::ResetCommunication, 7);
    assert_eq!(serial_of(&mut master, 7), Some(serial));
    // None at all.
    set(&mut master, None, true);
    reset(&mut master, Command::ResetCommunication, 7);
    assert_eq!(serial_of(&mut master, 7), None);
    let found = block_on(
        master
            .lss()
            .find_unconfigured(Known::default(), &mut |_| ()),
    )
    .unwrap();
    assert_eq!(found.devices, [identity(serial)]);
    drop(master);
    assert_eq!(nodes(&bus), [None]);
    assert_eq!(
        nodes(&power_cycle(&bus)),
        [None],
        "although it is set up as 5"
    );
}

#[test]
fn it_answers_in_every_nmt_state_and_while_stopped_only_lss() {
    let mut bus = booted(settings(BitRate::Mbit1, &["5"]));
    let serial = bus.drives()[0].serial();
    let mut master = master(&mut bus);
    for (command, state) in [
        (Command::EnterPreOperational, NmtState::PreOperational),
        (Command::Start, NmtState::Operational),
        (Command::Stop, NmtState::Stopped),
    ] {
        block_on(master.nmt(command, None)).unwrap();
        wait_ms(&mut master, 5);
        let core = master.link().bus().drives()[0].core().unwrap();
        assert_eq!(core.comms().node().state(), state);
        let mut lss = master.lss();
        block_on(async {
            lss.select(identity(serial)).await.unwrap();
            assert_eq!(lss.inquire_identity().await, Ok(identity(serial)));
            assert_eq!(lss.inquire_node_id().await, Ok(Some(id(5))));
            lss.switch(State::Waiting).await.unwrap();
        });
    }
    assert_eq!(serial_of(&mut master, 5), None);
}

/// Gives drives 1 and 2 a heartbeat of 10 ms, and 250 kbit/s with two delays of `delay_ms`.
fn activate(master: &mut Master<'_>, serials: &[u32], delay_ms: u16, stores: bool) {
    for node in [1, 2] {
        let object = Address::new(0x1017, 0);
        let heartbeat = Value::Integer(10).encode(DataType::U16).unwrap();
        block_on(master.download(id(node), object, heartbeat)).unwrap();
    }
    wait_ms(master, 30);
    let mut lss = master.lss();
    block_on(async {
        for serial in serials {
            lss.select(identity(*serial)).await.unwrap();
            lss.set_bit_timing(BitTiming::Kbit250).await.unwrap();
            if stores {
                lss.store().await.unwrap();
            }
        }
        // All of them at once; to select one sends the others to waiting.
        lss.switch(State::Configuration).await.unwrap();
        lss.activate_bit_timing(delay_ms).await.unwrap();
    });
}

#[test]
fn a_bit_rate_is_activated_in_silence() {
    let mut bus = booted(settings(BitRate::Mbit1, &["1", "2"]));
    let serials: Vec<u32> = bus.drives().iter().map(|drive| drive.serial()).collect();
    let mut master = master(&mut bus);
    activate(&mut master, &serials, 40, true);
    drop(master);
    let from = bus.now();
    // The request has gone, up to 2 ms ago; now there are 80 ms of nothing.
    bus.run_until(from.plus_ms(38));
    assert_eq!(bus.bit_rate(), BitRate::Mbit1);
    bus.run_until(from.plus_ms(78));
    assert_eq!(bus.take_traffic(), []);
    assert_eq!(bus.bit_rate(), BitRate::Kbit250);
    bus.run_until(from.plus_ms(120));
    let after = bus.take_traffic();
    assert!(after.len() >= 8, "heartbeats again: {}", after.len());
    assert!(after.windows(2).all(|pair| {
        let bits = u64::from(pair[1].frame.wire_bits());
        pair[1].at.since_ns(pair[0].at) >= bits * 4_000
    }));
    let mut master = self::master(&mut bus);
    assert_eq!(serial_of(&mut master, 1), Some(serials[0]));
    block_on(master.lss().switch(State::Waiting)).unwrap();
    // It was stored, and the bus starts with it.
    drop(master);
    let mut bus = power_cycle(&bus);
    assert_eq!(bus.bit_rate(), BitRate::Kbit250);
    let mut master = self::master(&mut bus);
    assert_eq!(serial_of(&mut master, 2), Some(serials[1]));
    block_on(master.nmt(Command::ResetNode, None)).unwrap();
    wait_ms(&mut master, 60);
    assert_eq!(serial_of(&mut master, 2), Some(serials[1]));
}

#[test]
fn who_is_not_in_configuration_is_left_behind() {
    let mut bus = booted(settings(BitRate::Mbit1, &["1", "2"]));
    let serials: Vec<u32> = bus.drives().iter().map(|drive| drive.serial()).collect();
    let mut master = master(&mut bus);
    block_on(async {
        let mut lss = master.lss();
        lss.select(identity(serials[1])).await.unwrap();
        lss.set_bit_timing(BitTiming::Kbit250).await.unwrap();
        lss.activate_bit_timing(20).await.unwrap();
    });
    wait_ms(&mut master, 60);
    assert_eq!(serial_of(&mut master, 1), None);
    assert_eq!(serial_of(&mut master, 2), Some(serials[1]));
    let bus = master.link().bus();
    assert_eq!(bus.drives()[0].bit_rate(), BitRate::Mbit1);
    assert_eq!(bus.drives()[1].bit_rate(), BitRate::Kbit250);
    // Not stored: the processor's reset brings the old rate back, and now it is the one left behind.
    block_on(master.nmt(Command::ResetNode, Some(id(2)))).unwrap();
    wait_ms(&mut master, 60);
    assert_eq!(serial_of(&mut master, 2), None);
    let told = master.link().bus().take_notices();
    assert!(
        told.iter()
            .any(|notice| notice.to_string().contains("it starts with 1 Mbit/s"))
    );
}

#[test]
fn a_rate_that_table_0_lacks_is_stored_as_found_out() {
    let mut bus = booted(settings(BitRate::Kbit100, &["u1"]));
    let mut master = master(&mut bus);
    let mut lss = master.lss();
    // A frame takes 1.3 ms.
    lss.settings.settle_ms = 6;
    let done = block_on(lss.assign(&[id(4)], Known::default(), true, &mut |_| ())).unwrap();
    assert_eq!(done.assigned.len(), 1);
    drop(master);
    let stored = canopen::store::lss::read(bus.drives()[0].stored()).unwrap();
    assert_eq!(stored.bit_timing.map(|timing| timing.index), Some(9));
    let bus = power_cycle(&bus);
    assert_eq!(nodes(&bus), [Some(4)]);
    assert_eq!(bus.drives()[0].bit_rate(), BitRate::Kbit100);
}

#[test]
fn an_lss_session_replays_byte_for_byte() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("lss");
    std::fs::create_dir_all(&folder).unwrap();
    let log = folder.join("session.log");
    let settings = settings(BitRate::Kbit500, &["1", "2", "u1", "u2"]);
    let mut recording = Recording::create(&log, &RunHeader::of(&settings)).unwrap();
    let mut bus = Bus::new(settings);
    let link = VirtualLink::new(&mut bus, 1).record(&mut recording);
    let mut master = Client::new(link);
    wait_ms(&mut master, 60);
    let ids = [id(8), id(9)];
    let done = block_on(
        master
            .lss()
            .assign(&ids, Known::default(), true, &mut |_| ()),
    )
    .unwrap();
    assert_eq!(done.assigned.len(), 2);
    let serials: Vec<u32> = master
        .link()
        .bus()
        .drives()
        .iter()
        .map(|d| d.serial())
        .collect();
    activate(&mut master, &serials, 10, true);
    wait_ms(&mut master, 100);
    assert_eq!(master.link().bus().bit_rate(), BitRate::Kbit250);
    assert_eq!(serial_of(&mut master, 9), Some(serials[3]));
    block_on(master.nmt(Command::ResetNode, None)).unwrap();
    wait_ms(&mut master, 100);
    assert_eq!(serial_of(&mut master, 8), Some(serials[2]));
    drop(master);
    let end = bus.now();
    assert_eq!(nodes(&bus), [1, 2, 8, 9].map(Some));
    let frames = recording.finish(end).unwrap();
    assert!(frames > 500, "{frames}");
    let head = std::fs::read_to_string(folder.join("session.log.run")).unwrap();
    let head: Vec<&str> = head.lines().take(7).collect();
    assert_eq!(head[1..3], ["seed 3", "bit-rate 500k"]);
    assert_eq!(head[5..7], ["drive u1 p3-extended", "drive u2 p3-extended"]);
    let mut again = Vec::new();
    let replayed = replay(&log, &mut again).unwrap();
    assert_eq!((replayed.frames, replayed.end), (frames, end));
    assert!(std::fs::read(&log).unwrap() == again);
}

#[test]
fn the_answer_to_a_store_comes_after_the_flash_is_written() {
    let mut bus = booted(settings(BitRate::Mbit1, &["u1"]));
    let request = |bytes: [u8; 2]| {
        let mut data = [0; 8];
        data[..2].copy_from_slice(&bytes);
        can::Frame::classic(0x7E5, data, 8)
    };
    for bytes in [[4, 1], [17, 33], [23, 0]] {
        bus.send(1, request(bytes));
    }
    let asked = bus.now();
    bus.run_until(asked.plus_ms(5));
    assert!(bus.drives()[0].stored().is_empty());
    bus.run_until(asked.plus_ms(8));
    let answers: Vec<[u8; 8]> = bus
        .take_traffic()
        .iter()
        .filter(|t| t.sender == Sender::Drive(place("u1")))
        .map(|t| t.frame.bytes())
        .collect();
    assert_eq!(
        answers,
        [[17, 0, 0, 0, 0, 0, 0, 0], [23, 0, 0, 0, 0, 0, 0, 0]]
    );
    let stored = canopen::store::lss::read(bus.drives()[0].stored()).unwrap();
    assert_eq!(stored.node_id, Some(33));
    // Parameters that are saved later leave it alone.
    bus.send(1, request([4, 0]));
    bus.run_until(bus.now().plus_ms(50));
    assert_eq!(nodes(&bus), [Some(33)]);
    let save = [0x23, 0x10, 0x10, 1, 0x73, 0x61, 0x76, 0x65];
    bus.send(1, can::Frame::classic(0x600 + 33, save, 8));
    bus.run_until(bus.now().plus_ms(20));
    assert!(bus.drives()[0].stored().len() > 50);
    assert_eq!(nodes(&power_cycle(&bus)), [Some(33)]);
}

/// The power fails while what LSS has given is written: no answer comes, and the drive starts on what
/// it had before.
#[test]
fn a_power_cut_in_a_store_leaves_what_was_there() {
    let mut bus = booted(settings(BitRate::Mbit1, &["u1"]));
    let store_33 = |bus: &mut Bus| {
        for bytes in [[4, 1], [17, 33], [23, 0]] {
            let mut data = [0; 8];
            data[..2].copy_from_slice(&bytes);
            bus.send(1, can::Frame::classic(0x7E5, data, 8));
        }
        bus.run_until(bus.now().plus_ms(60));
        let traffic = bus.take_traffic();
        let answers = traffic.iter().map(|t| (t.sender, t.frame.bytes()[0]));
        let own = answers.filter(|(sender, _)| *sender == Sender::Drive(place("u1")));
        own.map(|(_, command)| command).collect::<Vec<u8>>()
    };
    bus.drive_at(place("u1")).unwrap().cut_power_in_save(5, 1);
    assert_eq!(store_33(&mut bus), [17]);
    let told: Vec<String> = bus.take_notices().iter().map(ToString::to_string).collect();
    assert!(
        told.len() == 1 && told[0].contains("failed while it saved"),
        "{told:?}"
    );
    assert_eq!(nodes(&bus), [None]);
    let drive = bus.drive_at(place("u1")).unwrap();
    assert!(drive.stored().is_empty());
    assert_eq!(drive.spoil_store(1, true, 1), 0);
    assert_eq!(store_33(&mut bus), [17, 23]);
    assert_eq!(nodes(&power_cycle(&bus)), [Some(33)]);
}
