//! Stored parameters: what is kept, what is skipped, and what damage is seen.

mod harness;

use canopen::row::{f32, i16, u8, u16, u32};
use canopen::store::{self, Damage, Full, Loaded, Record, Request, SIGNATURE};
use canopen::{Abort, Address, Dictionary, Group, Image, NodeId, Row, dictionary};

const PARTS: &[&[Row]] = &[&[
    u32(0x1014, 0, "COB-ID EMCY")
        .rw()
        .default_plus_node(0x80)
        .store(Group::Communication),
    u16(0x1017, 0, "Producer heartbeat time")
        .rw()
        .store(Group::Communication),
    u8(0x2000, 1, "Byte").rw().store(Group::Application),
    i16(0x2000, 2, "Word")
        .rw()
        .range(-10, 10)
        .store(Group::Application),
    u32(0x2001, 1, "Run").subs(3).rw().store(Group::Application),
    u32(0x2002, 0, "Not stored").rw(),
    f32(0x2003, 0, "Gain")
        .rw()
        .range(0, 1)
        .store(Group::Application),
]];
static OBJECTS: Dictionary<{ dictionary::count(PARTS) }> = dictionary::layout(PARTS);

/// A later firmware: one object gone, one grown, one new in front, one with a narrower range.
const NEWER_PARTS: &[&[Row]] = &[&[
    u32(0x1005, 0, "New").rw().store(Group::Communication),
    u32(0x1014, 0, "COB-ID EMCY")
        .rw()
        .default_plus_node(0x80)
        .store(Group::Communication),
    u32(0x1017, 0, "Grown").rw().store(Group::Communication),
    u8(0x2000, 1, "No longer stored").rw(),
    i16(0x2000, 2, "Narrower")
        .rw()
        .range(-5, 5)
        .store(Group::Application),
    u32(0x2001, 1, "Shorter run")
        .subs(2)
        .rw()
        .store(Group::Application),
    u32(0x2003, 0, "Same size, other type")
        .rw()
        .store(Group::Application),
]];
static NEWER: Dictionary<{ dictionary::count(NEWER_PARTS) }> = dictionary::layout(NEWER_PARTS);

fn node(id: u8) -> NodeId {
    NodeId::new(id).expect("a node ID")
}

/// An image of defaults for node 5 with some values changed.
fn image(changes: &[(u16, u8, u32)]) -> Vec<u8> {
    let mut bytes = vec![0; OBJECTS.image_bytes()];
    let mut image = Image::new(&mut bytes);
    OBJECTS.table().defaults(&mut image, node(5));
    for &(index, sub, raw) in changes {
        let entry = OBJECTS.table().find(index, sub).expect("an object");
        image.set_raw(entry.field, raw);
    }
    bytes
}

fn save(bytes: &[u8], request: Request, old: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let mut out = [0xFF; 512];
    let used = store::save(
        &OBJECTS.table(),
        &Image::new(&mut bytes),
        node(5),
        request,
        old,
        &mut out,
    )
    .expect("room");
    out[..used].to_vec()
}

fn listed(stored: &[u8]) -> Vec<(u16, u8, Vec<u8>)> {
    store::records(stored)
        .expect("no damage")
        .map(|Record { address, bytes }| (address.index, address.sub, bytes.to_vec()))
        .collect()
}

const CHANGES: &[(u16, u8, u32)] = &[
    (0x1017, 0, 100),
    (0x2000, 1, 1),
    (0x2000, 2, 0xFFFE),
    (0x2001, 3, 0xDEAD_BEEF),
    (0x2002, 0, 7),
    (0x2003, 0, 0x3F00_0000),
];

/// Byte for byte what the layout says; the checksum by the reference value of CRC-32 (ISO HDLC).
#[test]
fn layout() {
    // The check value of this CRC: "123456789" gives CBF43926.
    let reference = |bytes: &[u8]| {
        let mut crc = u32::MAX;
        for byte in bytes {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = (crc >> 1) ^ (0xEDB8_8320 * (crc & 1));
            }
        }
        !crc
    };
    assert_eq!(reference(b"123456789"), 0xCBF4_3926);
    let stored = save(&image(CHANGES), Request::Communication, &[]);
    // COB-ID EMCY is at its default, so only the heartbeat time is stored.
    let body = [0x17, 0x10, 0, 2, 100, 0];
    let mut expected = b"SBP1".to_vec();
    expected.extend(6u32.to_le_bytes());
    expected.extend(reference(&body).to_le_bytes());
    expected.extend(body);
    assert_eq!(stored, expected);
}

/// What each request covers.
#[test]
fn groups() {
    let communication = (0x1017, 0, vec![100, 0]);
    let application = [
        (0x2000, 1, vec![1]),
        (0x2000, 2, vec![0xFE, 0xFF]),
        (0x2001, 1, vec![0; 4]),
        (0x2001, 2, vec![0; 4]),
        (0x2001, 3, vec![0xEF, 0xBE, 0xAD, 0xDE]),
        (0x2003, 0, vec![0, 0, 0, 0x3F]),
    ];
    let changed = image(CHANGES);
    let all: Vec<_> = core::iter::once(communication.clone())
        .chain(application.clone())
        .collect();
    assert_eq!(listed(&save(&changed, Request::All, &[])), all);
    assert_eq!(
        listed(&save(&changed, Request::Communication, &[])),
        core::slice::from_ref(&communication)
    );
    assert_eq!(
        listed(&save(&changed, Request::Application, &[])),
        application
    );
    let single = |index, sub| Request::Single(Address::new(index, sub));
    assert_eq!(
        listed(&save(&changed, single(0x2001, 3), &[])),
        [(0x2001, 3, vec![0xEF, 0xBE, 0xAD, 0xDE])]
    );
    // Not an object, or not one that is stored.
    for address in [(0x2001, 4), (0x2002, 0), (0x2FFF, 0)] {
        assert_eq!(
            listed(&save(&changed, single(address.0, address.1), &[])),
            []
        );
    }
}

/// What a request does not cover stays as it was stored, also where the image has moved on.
#[test]
fn the_rest_is_kept() {
    let old = save(&image(CHANGES), Request::All, &[]);
    let now = image(&[(0x1017, 0, 9), (0x2000, 1, 9), (0x2001, 1, 9)]);
    let value = |stored: &[u8], index, sub| {
        listed(stored)
            .into_iter()
            .find(|record| (record.0, record.1) == (index, sub))
            .map(|record| record.2)
    };
    let stored = save(&now, Request::Single(Address::new(0x2000, 1)), &old);
    assert_eq!(value(&stored, 0x2000, 1), Some(vec![9]));
    assert_eq!(value(&stored, 0x1017, 0), Some(vec![100, 0]));
    assert_eq!(value(&stored, 0x2001, 1), Some(vec![0; 4]));
    assert_eq!(listed(&stored).len(), 7);
    let stored = save(&now, Request::Communication, &old);
    assert_eq!(value(&stored, 0x1017, 0), Some(vec![9, 0]));
    assert_eq!(value(&stored, 0x2000, 1), Some(vec![1]));
    // A damaged store has nothing to keep.
    let mut damaged = old.clone();
    damaged[15] ^= 1;
    assert_eq!(
        listed(&save(&now, Request::Communication, &damaged)).len(),
        1
    );
}

/// COB-IDs at their default are not stored, so that they follow the node ID; others are.
#[test]
fn cob_ids_follow_the_node_id() {
    let stored = save(&image(&[]), Request::All, &[]);
    assert!(listed(&stored).iter().all(|record| record.0 != 0x1014));
    let mut bytes = vec![0; OBJECTS.image_bytes()];
    let mut at_nine = Image::new(&mut bytes);
    OBJECTS.table().defaults(&mut at_nine, node(9));
    store::load(&OBJECTS.table(), &mut at_nine, &stored).expect("no damage");
    let emcy = OBJECTS.table().find(0x1014, 0).expect("an object").field;
    assert_eq!(at_nine.raw(emcy), 0x89);
    let stored = save(&image(&[(0x1014, 0, 0x89)]), Request::All, &[]);
    assert!(listed(&stored).contains(&(0x1014, 0, vec![0x89, 0, 0, 0])));
}

/// A load gives back what was saved, and counts it.
#[test]
fn round_trip() {
    let stored = save(&image(CHANGES), Request::All, &[]);
    let mut bytes = image(&[]);
    let loaded = store::load(&OBJECTS.table(), &mut Image::new(&mut bytes), &stored);
    assert_eq!(
        loaded,
        Ok(Loaded {
            applied: 7,
            skipped: 0
        })
    );
    let kept: Vec<_> = CHANGES.iter().copied().filter(|c| c.0 != 0x2002).collect();
    assert_eq!(bytes, image(&kept));
    // An empty store is no damage and no values.
    let mut bytes = image(CHANGES);
    assert_eq!(
        store::load(&OBJECTS.table(), &mut Image::new(&mut bytes), &[]),
        Ok(Loaded {
            applied: 0,
            skipped: 0
        })
    );
    assert_eq!(bytes, image(CHANGES));
}

/// New firmware: what has moved is found; what has gone, changed its size or left its range is
/// skipped and counted. A partial save keeps what only the older one knows, a full one does not.
#[test]
fn another_layout() {
    let stored = save(&image(CHANGES), Request::All, &[]);
    let mut bytes = vec![0; NEWER.image_bytes()];
    let mut newer = Image::new(&mut bytes);
    NEWER.table().defaults(&mut newer, node(5));
    let loaded = store::load(&NEWER.table(), &mut newer, &stored);
    // 0x2000,2, 0x2001,1, 0x2001,2 and 0x2003 fit; 0x1017 has grown, 0x2000,1 is not stored, 0x2001,3 is gone.
    assert_eq!(
        loaded,
        Ok(Loaded {
            applied: 4,
            skipped: 3
        })
    );
    let raw = |image: &Image<'_>, index, sub| {
        image.raw(NEWER.table().find(index, sub).expect("an object").field)
    };
    assert_eq!(raw(&newer, 0x2000, 2), 0xFFFE);
    assert_eq!(raw(&newer, 0x1017, 0), 0);
    assert_eq!(raw(&newer, 0x2000, 1), 0);
    let out_of_range = save(&image(&[(0x2000, 2, 7)]), Request::All, &[]);
    store::load(&NEWER.table(), &mut newer, &out_of_range).expect("no damage");
    assert_eq!(raw(&newer, 0x2000, 2), 0xFFFE, "7 is over 5");

    let mut out = [0; 512];
    let mut known = |request| {
        let used =
            store::save(&NEWER.table(), &newer, node(5), request, &stored, &mut out).expect("room");
        listed(&out[..used])
            .iter()
            .filter(|record| (record.0, record.1) == (0x2001, 3))
            .count()
    };
    assert_eq!(known(Request::Communication), 1);
    assert_eq!(known(Request::Application), 1);
    assert_eq!(known(Request::Single(Address::new(0x1005, 0))), 1);
    assert_eq!(known(Request::All), 0);
}

/// A value that no write could have given is skipped: a NaN under a range.
#[test]
fn not_a_number() {
    let stored = save(
        &image(&[(0x2003, 0, f32::NAN.to_bits())]),
        Request::All,
        &[],
    );
    let mut bytes = image(&[]);
    let loaded = store::load(&OBJECTS.table(), &mut Image::new(&mut bytes), &stored);
    assert_eq!(loaded.map(|loaded| loaded.skipped), Ok(1));
    assert_eq!(bytes, image(&[]));
}

/// A power cut while a store is written leaves its beginning and then erased flash, or nothing
/// after it: at every byte either damage is seen, or all is there. The image is never half loaded.
#[test]
fn power_cut() {
    let stored = save(&image(CHANGES), Request::All, &[]);
    let untouched = image(&[]);
    let mut whole = untouched.clone();
    store::load(&OBJECTS.table(), &mut Image::new(&mut whole), &stored).expect("no damage");
    for cut in 1..=stored.len() {
        let mut erased = stored.clone();
        erased[cut..].fill(0xFF);
        erased.extend([0xFF; 32]);
        for torn in [&stored[..cut], &erased] {
            let mut bytes = untouched.clone();
            let loaded = store::load(&OBJECTS.table(), &mut Image::new(&mut bytes), torn);
            match loaded {
                Ok(_) => assert_eq!(bytes, whole, "cut at {cut}"),
                Err(_) => assert_eq!(bytes, untouched, "cut at {cut}"),
            }
            // The last byte of this store is 0x3F, so any cut shows.
            assert_eq!(loaded.is_ok(), cut == stored.len(), "cut at {cut}");
        }
    }
}

/// A flipped bit anywhere is seen.
#[test]
fn flipped_bits() {
    let stored = save(&image(CHANGES), Request::All, &[]);
    for bit in 0..stored.len() * 8 {
        let mut flipped = stored.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        let mut bytes = image(&[]);
        store::load(&OBJECTS.table(), &mut Image::new(&mut bytes), &flipped)
            .expect_err("a flipped bit");
        assert_eq!(bytes, image(&[]));
    }
}

/// Each kind of damage says what is wrong.
#[test]
fn damage() {
    let stored = save(&image(CHANGES), Request::All, &[]);
    let kind = |bytes: &[u8]| store::records(bytes).map(|_| ()).expect_err("damage");
    for not_ours in [
        &[0xFF; 64][..],
        b"SBP",
        b"SBP1\0\0\0\0\0\0\0",
        b"SBP2\0\0\0\0\0\0\0\0",
    ] {
        assert_eq!(kind(not_ours), Damage::NotParameters);
    }
    let found = stored.len() as u32 - 12 - 1;
    assert_eq!(
        kind(&stored[..stored.len() - 1]),
        Damage::Truncated {
            expected: found + 1,
            found
        }
    );
    let mut huge = stored.clone();
    huge[4..8].fill(0xFF);
    assert_eq!(
        kind(&huge),
        Damage::Truncated {
            expected: u32::MAX,
            found: found + 1
        }
    );
    let mut flipped = stored.clone();
    flipped[12] ^= 1;
    assert!(matches!(kind(&flipped), Damage::Checksum { stored, computed } if stored != computed));
    // A checksum that is right over records that are not: size 5 with one byte there. The CRC-32
    // of 00 20 01 05 AA is computed by the layout's own rule.
    let body = [0x00, 0x20, 0x01, 0x05, 0xAA];
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&body);
    let mut run_past = b"SBP1\x05\0\0\0".to_vec();
    run_past.extend(crc.to_le_bytes());
    run_past.extend(body);
    assert_eq!(kind(&run_past), Damage::Record { at: 12 });
    assert_eq!(
        Damage::Record { at: 12 }.to_string(),
        "the record at byte 12 runs past the end"
    );
}

/// A buffer that is too small is said to be, at every size; the exact size is enough.
#[test]
fn full() {
    let mut bytes = image(CHANGES);
    let needed = save(&bytes, Request::All, &[]).len();
    for capacity in 0..=needed {
        let mut out = vec![0; capacity];
        let used = store::save(
            &OBJECTS.table(),
            &Image::new(&mut bytes),
            node(5),
            Request::All,
            &[],
            &mut out,
        );
        let expected = if capacity == needed {
            Ok(needed)
        } else {
            Err(Full { capacity })
        };
        assert_eq!(used, expected);
    }
}

/// The signature is "save" in lower case, and nothing else (P39).
#[test]
fn signature() {
    assert_eq!(SIGNATURE, 0x6576_6173);
    for (sub, request) in [
        (1, Request::All),
        (2, Request::Communication),
        (3, Request::Application),
    ] {
        assert_eq!(Request::from_write(sub, 0x6576_6173), Ok(request));
        for wrong in [0, 1, 0x4556_4153, 0x6173_7665, 0x6576_6172] {
            assert_eq!(Request::from_write(sub, wrong), Err(Abort::CANNOT_STORE));
        }
    }
    assert_eq!(Request::from_write(0, SIGNATURE), Err(Abort::NO_SUB_INDEX));
    assert_eq!(Request::from_write(4, SIGNATURE), Err(Abort::NO_SUB_INDEX));
}

/// A node that was configured, saved and built anew from its store behaves as before, under
/// another node ID, too.
#[test]
fn a_node_from_its_store() {
    use harness::{Bench, STANDARD, devices};
    let mut bench = Bench::new(&STANDARD);
    bench.map(0x1800, 0x185, 2, &[0x2007_0020, 0x2000_0108]);
    bench.map(0x1400, 0x234, 255, &[0x2007_0020]);
    bench.write(0x1017, 0, &[50, 0]).expect("heartbeat");
    bench.write(0x2000, 1, &[0x77]).expect("a value");
    let mut stored = [0; 2048];
    let mut bytes = bench.node.bytes().to_vec();
    let used = store::save(
        &devices::OBJECTS.table(),
        &Image::new(&mut bytes),
        bench.node.id(),
        Request::All,
        &[],
        &mut stored,
    )
    .expect("room");
    let mut node = canopen::Node::new(&STANDARD, vec![0; devices::IMAGE_BYTES], node(9));
    store::load(
        &devices::OBJECTS.table(),
        &mut node.image(),
        &stored[..used],
    )
    .expect("no damage");
    bench.node = node;
    bench.node.start(bench.now);
    assert_eq!(bench.drain(), [(0x709, vec![0])]);
    assert_eq!(bench.send(0, &[0x01, 9]), []);
    assert_eq!(bench.send(0x234, &[1, 2, 3, 4]), []);
    assert_eq!(bench.sync(), []);
    // The TPDO's COB-ID was the default, so it moved with the node ID; the RPDO's was not.
    assert_eq!(bench.sync(), [(0x189, vec![1, 2, 3, 4, 0x77])]);
    assert_eq!(bench.after_ms(50), [(0x709, vec![0x05])]);
}
