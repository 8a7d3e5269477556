//! The objects of CiA 301 7.5.2 that concern no service.

use canopen::store::{self, RESTORE_SIGNATURE, Request, SIGNATURE};
use canopen::{Address, Device, Image, Node, NodeId, Owner, Verdict};

use crate::harness::{Bench, FULL, ID, Stand, Streams};
use crate::master::{Master, characters, initiate, number};

/// An owner that notes what 0x1010 and 0x1011 ask for.
#[derive(Debug, Default)]
struct Storing {
    asked: Vec<Request>,
}

impl Owner for Storing {
    fn write(&mut self, _: &Image<'_>, object: Address, new: &[u8]) -> Verdict {
        let value = u32::from_le_bytes(new.try_into().expect("four bytes"));
        let request = match object.index {
            0x1010 => Request::from_write(object.sub, value),
            0x1011 => Request::from_restore(object.sub, value),
            other => panic!("{other:04X} asks"),
        };
        match request {
            Ok(request) => {
                self.asked.push(request);
                Verdict::Done
            }
            Err(abort) => Verdict::Refuse(abort),
        }
    }

    fn publish(&mut self, _: &mut Image<'_>) {}
}

/// What a store of `request` would be, of the node's values.
fn saved(master: &mut Master, request: Request, old: &[u8]) -> Vec<u8> {
    let mut out = vec![0; 8192];
    let id = master.bench.node.id();
    let image = master.bench.node.image();
    let used = store::save(&FULL.table, &image, id, request, old, &mut out).expect("room");
    out.truncate(used);
    out
}

/// A node with other values than the defaults in every kind of object.
fn changed() -> Master {
    let mut master = Master::new();
    for (index, sub, command, value) in [
        (0x1017, 0, 0x2B, 500),
        (0x1020, 1, 0x23, 12_345),
        (0x1020, 2, 0x23, 67_890),
        (0x1800, 2, 0x2F, 7),
        (0x2000, 1, 0x2F, 11),
        (0x2000, 3, 0x23, 33),
        (0x2004, 1, 0x2B, 9),
        (0x200B, 0, 0x2F, 77),
    ] {
        let answer = master.ask(&initiate(command, Address::new(index, sub), value));
        assert_eq!(answer[0], 0x60, "{index:04X}: {answer:02X?}");
    }
    for (object, value) in LONG_VALUES {
        assert_eq!(master.download(*object, value, true), Ok(()), "{object}");
    }
    master
}

const LONG_VALUES: &[(Address, &[u8])] = &[
    (Address::new(0x2000, 9), &(-5_000_000_000_i64).to_le_bytes()),
    (Address::new(0x2000, 10), &u64::MAX.to_le_bytes()),
    (Address::new(0x2000, 11), &0.1_f64.to_le_bytes()),
    (Address::new(0x2004, 8), &0x1_0000_0000_i64.to_le_bytes()),
    (Address::new(0x2010, 1), b"a text that is kept"),
    (Address::new(0x2011, 1), b"twenty octets, not 0"),
];

/// A node with `stored` loaded before its start.
fn restarted(stored: &[u8], id: u8) -> (Master, Result<store::Loaded, store::Damage>) {
    let id = NodeId::new(id).expect("a node ID");
    let memory = vec![0; FULL.table.image_bytes()];
    let mut bench = Bench::unstarted_with(&FULL, Streams::default());
    bench.node = Node::new(&FULL, memory, id);
    let loaded = store::load(&FULL.table, &mut bench.node.image(), stored);
    bench.node.start(bench.now);
    bench.frames();
    let master = Master {
        bench,
        request: 0x600 + u32::from(id.get()),
        reply: 0x580 + u32::from(id.get()),
    };
    (master, loaded)
}

fn value(master: &mut Master, index: u16, sub: u8) -> u32 {
    number(master.ask(&initiate(0x40, Address::new(index, sub), 0)))
}

pub(crate) fn device_type_and_identity() {
    Master::new().play(
        "> 40 00 10 00 00 00 00 00
         < 43 00 10 00 92 01 02 00
         > 40 18 10 00 00 00 00 00
         < 4F 18 10 00 04 00 00 00
         > 40 18 10 01 00 00 00 00
         < 43 18 10 01 08 04 00 00
         > 40 18 10 04 00 00 00 00
         < 43 18 10 04 78 56 34 12
         > 40 18 10 05 00 00 00 00
         < 80 18 10 05 11 00 09 06",
    );
}

pub(crate) fn names_and_versions() {
    let mut master = Master::new();
    for (index, text) in [(0x1008, "Full device"), (0x1009, ""), (0x100A, "1.0")] {
        let object = Address::new(index, 0);
        assert_eq!(master.upload(object), Ok(text.as_bytes().to_vec()));
        let answer = master.ask(&initiate(0x23, object, 0));
        assert_eq!(answer, initiate(0x80, object, 0x0601_0002));
    }
}

pub(crate) fn no_errors_in_the_history() {
    Master::new().play(
        "> 40 03 10 00 00 00 00 00
         < 4F 03 10 00 00 00 00 00
         > 40 03 10 01 00 00 00 00
         < 80 03 10 01 24 00 00 08
         > 40 03 10 08 00 00 00 00
         < 80 03 10 08 24 00 00 08
         > 40 03 10 09 00 00 00 00
         < 80 03 10 09 11 00 09 06",
    );
}

fn announce(master: &mut Master, code: u16) {
    let now = master.bench.now;
    master.bench.node.announce(code, 1, [0; 5], now);
    let emergencies = master.bench.frames();
    assert!(emergencies.iter().all(|frame| frame.raw_id() == 0x85));
}

pub(crate) fn the_newest_error_first() {
    let mut master = Master::new();
    for n in 1..=12_u16 {
        announce(&mut master, 0x1000 + n);
        let count = value(&mut master, 0x1003, 0);
        assert_eq!(count, u32::from(n.min(8)));
        for sub in 1..=count as u8 {
            let expected = 0x1001 + u32::from(n) - u32::from(sub);
            assert_eq!(value(&mut master, 0x1003, sub), expected, "{sub} of {n}");
        }
    }
    // The end of an error is none.
    announce(&mut master, 0);
    assert_eq!(value(&mut master, 0x1003, 0), 8);
    assert_eq!(value(&mut master, 0x1003, 1), 0x100C);
}

pub(crate) fn clearing_the_history() {
    let mut master = Master::new();
    announce(&mut master, 0x4210);
    announce(&mut master, 0x3210);
    master.play(
        "> 2F 03 10 00 01 00 00 00
         < 80 03 10 00 30 00 09 06
         > 2F 03 10 00 02 00 00 00
         < 80 03 10 00 30 00 09 06
         > 23 03 10 01 00 00 00 00
         < 80 03 10 01 02 00 01 06
         > 40 03 10 00 00 00 00 00
         < 4F 03 10 00 02 00 00 00
         > 2F 03 10 00 00 00 00 00
         < 60 03 10 00 00 00 00 00
         > 40 03 10 00 00 00 00 00
         < 4F 03 10 00 00 00 00 00
         > 40 03 10 01 00 00 00 00
         < 80 03 10 01 24 00 00 08",
    );
    announce(&mut master, 0x8110);
    assert_eq!(value(&mut master, 0x1003, 0), 1);
    assert_eq!(value(&mut master, 0x1003, 1), 0x8110);
}

fn storing(device: &'static Device) -> Bench<Storing> {
    Bench::with(device, Storing::default())
}

pub(crate) fn the_signature_to_store() {
    the_signature(0x1010, b"save", SIGNATURE);
}

pub(crate) fn the_signature_to_restore() {
    the_signature(0x1011, b"load", RESTORE_SIGNATURE);
}

fn the_signature(index: u16, signature: &[u8; 4], number: u32) {
    assert_eq!(number.to_le_bytes(), *signature);
    let mut bench = storing(&FULL);
    let reversed = number.swap_bytes();
    for sub in 1..=3 {
        assert_eq!(bench.read(index, sub), Ok(1), "on command");
        for wrong in [0, 1, reversed, number ^ 0x20, number + 1] {
            let refused = bench.write(index, sub, &wrong.to_le_bytes());
            assert_eq!(refused, Err(0x0800_0020), "{wrong:08X}");
        }
    }
    assert_eq!(bench.owner.asked, []);
    for (sub, request) in [
        (1, Request::All),
        (2, Request::Communication),
        (3, Request::Application),
    ] {
        assert_eq!(bench.write(index, sub, signature), Ok(()));
        assert_eq!(bench.owner.asked.pop(), Some(request));
        assert_eq!(bench.read(index, sub), Ok(1), "it is no value");
    }
    assert_eq!(bench.write(index, 4, signature), Err(0x0609_0011));
    assert_eq!(bench.write(index, 0, &[3]), Err(0x0601_0002));
    assert_eq!(bench.write(index, 1, &signature[..3]), Err(0x0607_0013));
}

/// Defaults are there after the next start, not before; of what was restored only.
pub(crate) fn restored_defaults() {
    for (request, communication, application) in [
        (Request::All, false, false),
        (Request::Communication, false, true),
        (Request::Application, true, false),
    ] {
        let mut master = changed();
        let stored = saved(&mut master, Request::All, &[]);
        let mut out = vec![0; 8192];
        let used = store::restore(&FULL.table, request, &stored, &mut out).expect("room");
        assert_eq!(value(&mut master, 0x1017, 0), 500, "as long as it runs");
        let (mut master, _) = restarted(&out[..used], ID);
        let text = Address::new(0x2010, 1);
        let is = (
            value(&mut master, 0x1017, 0) == 500,
            master.upload(text) == Ok(b"a text that is kept".to_vec()),
        );
        assert_eq!(is, (communication, application), "{request:?}");
    }
}

pub(crate) fn stored_values_come_back() {
    let mut master = changed();
    let stored = saved(&mut master, Request::All, &[]);
    let (mut master, loaded) = restarted(&stored, ID);
    assert_eq!(loaded.map(|loaded| loaded.skipped), Ok(0));
    for (index, sub, expected) in [
        (0x1017, 0, 500),
        (0x1800, 2, 7),
        (0x2000, 1, 11),
        (0x2000, 3, 33),
        (0x2004, 1, 9),
        // Not stored.
        (0x200B, 0, 0),
    ] {
        assert_eq!(value(&mut master, index, sub), expected, "{index:04X}");
    }
    for (object, value) in LONG_VALUES {
        assert_eq!(master.upload(*object), Ok(value.to_vec()), "{object}");
    }
}

pub(crate) fn groups() {
    for (request, communication, application) in [
        (Request::All, true, true),
        (Request::Communication, true, false),
        (Request::Application, false, true),
    ] {
        let stored = saved(&mut changed(), request, &[]);
        let (mut master, _) = restarted(&stored, ID);
        let text = Address::new(0x2010, 1);
        let is = (
            value(&mut master, 0x1017, 0) == 500,
            value(&mut master, 0x2000, 1) == 11,
            master.upload(text) == Ok(b"a text that is kept".to_vec()),
        );
        assert_eq!(is, (communication, application, application), "{request:?}");
    }
    // What a command does not cover stays as it was stored.
    let all = saved(&mut changed(), Request::All, &[]);
    let again = saved(&mut Master::new(), Request::Communication, &all);
    let (mut master, _) = restarted(&again, ID);
    assert_eq!(value(&mut master, 0x1017, 0), 0);
    for (object, value) in LONG_VALUES {
        assert_eq!(master.upload(*object), Ok(value.to_vec()), "{object}");
    }
}

/// COB-IDs that depend on the node ID go on doing so.
pub(crate) fn another_node_id() {
    let stored = saved(&mut changed(), Request::All, &[]);
    let (mut master, _) = restarted(&stored, 9);
    for (index, sub, expected) in [
        (0x1014, 0, 0x89),
        (0x1400, 1, 0x209),
        (0x1800, 1, 0x189),
        (0x1200, 1, 0x609),
        (0x1017, 0, 500),
    ] {
        assert_eq!(value(&mut master, index, sub), expected, "{index:04X}");
    }
}

/// A stored value that the dictionary does not allow is not used, nor is a damaged store.
pub(crate) fn values_that_are_not_used() {
    let mut master = changed();
    let mut stored = saved(&mut master, Request::All, &[]);
    // The greatest value of 0x2004,8 becomes one more; then the checksum is wrong.
    let at = stored
        .windows(4)
        .position(|bytes| bytes == [0x04, 0x20, 8, 8]);
    let at = at.expect("a record") + 4;
    stored[at] = 1;
    let (mut damaged, loaded) = restarted(&stored, ID);
    assert!(loaded.is_err());
    assert_eq!(value(&mut damaged, 0x1017, 0), 0);
    assert_eq!(damaged.upload(Address::new(0x2010, 1)), Ok(vec![]));
    // With the right checksum all others are used.
    let body = crc(&stored[12..]);
    stored[8..12].copy_from_slice(&body.to_le_bytes());
    let (mut master, loaded) = restarted(&stored, ID);
    assert_eq!(loaded.map(|loaded| loaded.skipped), Ok(1));
    assert_eq!(master.upload(Address::new(0x2004, 8)), Ok(vec![0; 8]));
    assert_eq!(value(&mut master, 0x1017, 0), 500);
}

/// CRC-32 as Ethernet has it.
fn crc(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xEDB8_8320 * (crc & 1));
        }
    }
    !crc
}

/// "Reset communication" puts the communication parameters back, and nothing else.
pub(crate) fn reset_communication() {
    for is_stored in [false, true] {
        let mut master = changed();
        let stored = match is_stored {
            true => saved(&mut master, Request::All, &[]),
            false => Vec::new(),
        };
        let answer = master.ask(&initiate(0x2B, Address::new(0x1017, 0), 999));
        assert_eq!(answer[0], 0x60);
        let bench = &mut master.bench;
        let id = bench.node.id();
        bench.node.restart_communication(&stored, id);
        bench.node.start(bench.now);
        bench.frames();
        let expected = if is_stored { 500 } else { 0 };
        assert_eq!(value(&mut master, 0x1017, 0), expected);
        for (index, sub, expected) in [(0x2000, 1, 11), (0x200B, 0, 77)] {
            assert_eq!(value(&mut master, index, sub), expected);
        }
        for (object, value) in LONG_VALUES {
            assert_eq!(master.upload(*object), Ok(value.to_vec()), "{object}");
        }
    }
}

/// Date and time by which a tool knows its configuration; stored like all others.
pub(crate) fn verify_configuration() {
    let mut master = changed();
    assert_eq!(value(&mut master, 0x1020, 0), 2);
    assert_eq!(value(&mut master, 0x1020, 1), 12_345);
    assert_eq!(value(&mut master, 0x1020, 2), 67_890);
    let stored = saved(&mut master, Request::All, &[]);
    let (mut master, _) = restarted(&stored, ID);
    assert_eq!(value(&mut master, 0x1020, 1), 12_345);
    assert_eq!(value(&mut master, 0x1020, 2), 67_890);
    verified_after_a_communication_reset(false);
    verified_after_a_communication_reset(true);
    verified_after_a_receive_pdo();
}

/// A configuration is verified by 1 and stored; then an application parameter is changed and all
/// of it verified by 2, if `is_changed`. A communication reset puts 1 back, and knows of the change.
fn verified_after_a_communication_reset(is_changed: bool) {
    let mut master = changed();
    let verify = |master: &mut Master, value| {
        let answer = master.ask(&initiate(0x23, Address::new(0x1020, 1), value));
        assert_eq!(answer[0], 0x60);
    };
    verify(&mut master, 1);
    let stored = saved(&mut master, Request::All, &[]);
    if is_changed {
        let answer = master.ask(&initiate(0x2F, Address::new(0x2000, 1), 12));
        assert_eq!(answer[0], 0x60);
        verify(&mut master, 2);
    }
    let bench = &mut master.bench;
    bench.node.restart_communication(&stored, bench.node.id());
    bench.node.start(bench.now);
    bench.frames();
    assert_eq!(value(&mut master, 0x1020, 1), 1);
    let parameter = if is_changed { 12 } else { 11 };
    assert_eq!(value(&mut master, 0x2000, 1), parameter);
    master.bench.node.withdraw_verification();
    let (date, time) = if is_changed { (0, 0) } else { (1, 67_890) };
    assert_eq!(value(&mut master, 0x1020, 1), date);
    assert_eq!(value(&mut master, 0x1020, 2), time);
}

/// A receive PDO changes a parameter as an SDO does; one that changes none leaves 0x1020 alone.
fn verified_after_a_receive_pdo() {
    let mut stand = Stand::operational();
    stand.map(0x1400, 0x205, 255, &[0x2000_0108]);
    stand.map(0x1401, 0x305, 255, &[0x200A_0108]);
    stand.must(0x1020, 1, 1);
    for (key, index, sub, verified) in [(0x305, 0x200A, 1, 1), (0x205, 0x2000, 1, 0)] {
        stand.send(key, &[7]);
        stand.node.withdraw_verification();
        assert_eq!(stand.get(index, sub), 7);
        assert_eq!(stand.get(0x1020, 1), verified, "0x{index:04X}");
    }
}

/// The device hands out its own EDS.
pub(crate) fn store_eds() {
    let eds = characters(3000);
    let mut master = Master::reading(&eds);
    let object = Address::new(0x1021, 0);
    assert_eq!(master.upload(object), Ok(eds.clone()));
    let blocks = master.upload_blocks(object, true, |_| 127, |_| false);
    assert_eq!(blocks, Ok(eds));
    let answer = master.ask(&initiate(0x21, object, 9));
    assert_eq!(answer, initiate(0x80, object, 0x0601_0002));
    let format = Address::new(0x1022, 0);
    assert_eq!(
        master.ask(&initiate(0x40, format, 0)),
        initiate(0x4F, format, 0)
    );
}
