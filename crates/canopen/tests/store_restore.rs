//! Restoring defaults (CiA 301 7.5.2.14) and the records of LSS (CiA 305) among those of objects.

use canopen::row::{u8, u16, u32};
use canopen::store::lss::{self, BitTiming, LssConfiguration};
use canopen::store::{self, Damage, Full, Loaded, RESTORE_SIGNATURE, Record, Request};
use canopen::{Abort, Address, Dictionary, Group, Image, NodeId, Row, dictionary};

const PARTS: &[&[Row]] = &[&[
    u16(0x1017, 0, "Producer heartbeat time")
        .rw()
        .store(Group::Communication),
    u8(0x2000, 1, "Byte").rw().store(Group::Application),
    u32(0x2000, 2, "No longer stored").rw(),
    u32(0x2001, 0, "Communication, in the manufacturer's area")
        .rw()
        .store(Group::Communication),
]];
static OBJECTS: Dictionary<{ dictionary::count(PARTS) }> = dictionary::layout(PARTS);

const CONFIGURATION: LssConfiguration = LssConfiguration {
    node_id: Some(17),
    bit_timing: Some(BitTiming {
        selector: 0,
        index: 3,
    }),
};

/// A store with `records` as the format says.
fn stored(records: &[(u16, u8, &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    for (index, sub, bytes) in records {
        body.extend(index.to_le_bytes());
        body.extend([*sub, bytes.len() as u8]);
        body.extend(*bytes);
    }
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&body);
    let mut stored = b"SBP1".to_vec();
    stored.extend((body.len() as u32).to_le_bytes());
    stored.extend(crc.to_le_bytes());
    stored.extend(body);
    stored
}

/// All that may stand in a store.
fn mixed() -> Vec<u8> {
    stored(&[
        (0x0001, 1, &[17]),
        (0x0001, 2, &[0, 3]),
        (0x1017, 0, &[100, 0]),
        (0x1F00, 0, &[1]),
        (0x2000, 1, &[9]),
        (0x2000, 2, &[1, 2, 3, 4]),
        (0x2001, 0, &[5, 0, 0, 0]),
        (0x2F00, 7, &[8, 8, 8]),
    ])
}

fn addresses(stored: &[u8]) -> Vec<(u16, u8)> {
    let records = store::records(stored).expect("no damage");
    let address = |Record { address, .. }| (address.index, address.sub);
    records.map(address).collect()
}

fn restored(request: Request, old: &[u8]) -> Vec<u8> {
    let mut out = [0; 256];
    let used = store::restore(&OBJECTS.table(), request, old, &mut out).expect("room");
    out[..used].to_vec()
}

#[test]
fn what_a_write_asks() {
    assert_eq!(RESTORE_SIGNATURE, 0x6461_6F6C);
    for (sub, request) in [
        (1, Request::All),
        (2, Request::Communication),
        (3, Request::Application),
    ] {
        assert_eq!(Request::from_restore(sub, RESTORE_SIGNATURE), Ok(request));
        for wrong in [0, store::SIGNATURE, RESTORE_SIGNATURE ^ 0x20] {
            assert_eq!(Request::from_restore(sub, wrong), Err(Abort::CANNOT_STORE));
        }
    }
    for sub in [0, 4, 127] {
        assert_eq!(
            Request::from_restore(sub, RESTORE_SIGNATURE),
            Err(Abort::NO_SUB_INDEX)
        );
    }
}

/// What each request leaves; an object of another firmware goes with the area that it lies in.
#[test]
fn groups() {
    let lss = [(0x0001, 1), (0x0001, 2)];
    for (request, left) in [
        (Request::All, &[][..]),
        (
            Request::Communication,
            &[(0x2000, 1), (0x2000, 2), (0x2F00, 7)],
        ),
        (
            Request::Application,
            &[(0x1017, 0), (0x1F00, 0), (0x2001, 0)],
        ),
        (
            Request::Single(Address::new(0x2000, 1)),
            &[
                (0x1017, 0),
                (0x1F00, 0),
                (0x2000, 2),
                (0x2001, 0),
                (0x2F00, 7),
            ],
        ),
    ] {
        let stored = restored(request, &mixed());
        assert_eq!(addresses(&stored), [&lss, left].concat(), "{request:?}");
        assert_eq!(lss::read(&stored), Ok(CONFIGURATION));
        let mut short = vec![0; stored.len() - 1];
        let full = Full {
            capacity: short.len(),
        };
        assert_eq!(
            store::restore(&OBJECTS.table(), request, &mixed(), &mut short),
            Err(full)
        );
    }
    for old in [&[][..], &[1, 2, 3], &mixed()[..40]] {
        assert_eq!(restored(Request::Communication, old), stored(&[]));
    }
}

/// Until the drive loads the store nothing has changed for it; then it has its defaults.
#[test]
fn defaults_come_with_the_next_load() {
    let table = OBJECTS.table();
    let mut bytes = vec![0; OBJECTS.image_bytes()];
    let mut image = Image::new(&mut bytes);
    let node = NodeId::new(1).expect("a node ID");
    table.defaults(&mut image, node);
    let heartbeat = table.find(0x1017, 0).expect("an object").field;
    let count = |applied, skipped| Ok(Loaded { applied, skipped });
    // Not applied: LSS (not even counted), two unknown objects and one that is not stored.
    assert_eq!(store::load(&table, &mut image, &mixed()), count(3, 3));
    assert_eq!(image.raw(heartbeat), 100);
    let after = restored(Request::Communication, &mixed());
    assert_eq!(image.raw(heartbeat), 100);
    table.defaults(&mut image, node);
    assert_eq!(store::load(&table, &mut image, &after), count(1, 2));
    assert_eq!(image.raw(heartbeat), 0);
}

/// Whatever is saved, what LSS has stored stays, once.
#[test]
fn a_save_keeps_what_lss_has_stored() {
    let table = OBJECTS.table();
    let mut bytes = vec![0; OBJECTS.image_bytes()];
    let image = Image::new(&mut bytes);
    let node = NodeId::new(1).expect("a node ID");
    for request in [
        Request::All,
        Request::Communication,
        Request::Application,
        Request::Single(Address::new(0x2000, 1)),
    ] {
        let mut out = [0; 256];
        let used = store::save(&table, &image, node, request, &mixed(), &mut out).expect("room");
        let now = addresses(&out[..used]);
        assert_eq!(lss::read(&out[..used]), Ok(CONFIGURATION));
        assert_eq!(now.iter().filter(|address| address.0 == 1).count(), 2);
        assert_eq!(now.contains(&(0x2F00, 7)), request != Request::All);
    }
}

#[test]
fn lss_replaces_its_own_records_only() {
    let replaced = |old: &[u8], configuration| {
        let mut out = [0; 256];
        let used = lss::replace(old, &configuration, &mut out).expect("room");
        out[..used].to_vec()
    };
    let other = LssConfiguration {
        node_id: Some(255),
        bit_timing: None,
    };
    let now = replaced(&mixed(), other);
    assert_eq!(lss::read(&now), Ok(other));
    let objects = &addresses(&mixed())[2..];
    assert_eq!(addresses(&now), [&[(0x0001, 1)], objects].concat());
    assert_eq!(replaced(&now, CONFIGURATION), mixed());
    let none = replaced(&now, LssConfiguration::default());
    assert_eq!(addresses(&none), objects);
    assert_eq!(lss::read(&none), Ok(LssConfiguration::default()));
    assert_eq!(
        replaced(b"damaged", CONFIGURATION),
        stored(&[(0x0001, 1, &[17]), (0x0001, 2, &[0, 3])])
    );
    let mut short = [0; 22];
    assert_eq!(
        lss::replace(&[], &CONFIGURATION, &mut short),
        Err(Full { capacity: 22 })
    );
}

#[test]
fn lss_records_that_say_nothing() {
    assert_eq!(lss::read(&[]), Ok(LssConfiguration::default()));
    assert_eq!(lss::read(b"other"), Err(Damage::NotParameters));
    for records in [
        &[(0x0001, 1, &[0][..])][..],
        &[(0x0001, 1, &[128])],
        &[(0x0001, 1, &[1, 0])],
        &[(0x0001, 1, &[])],
        &[(0x0001, 2, &[3])],
        &[(0x0001, 3, &[3])],
    ] {
        assert_eq!(
            lss::read(&stored(records)),
            Ok(LssConfiguration::default()),
            "{records:?}"
        );
    }
}
