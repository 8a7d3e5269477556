//! Access from within the device: judged as an SDO client's is, object by object.

mod harness;

use canopen::{Abort, Address, DataType, Device, Verdict};
use harness::{BASIC, Bench, FULL, ID, P3_LIKE, STANDARD};

/// Every object that a row declares, and what lies beside each.
fn addresses(device: &'static Device) -> Vec<(Address, Option<DataType>)> {
    let mut all = Vec::new();
    for row in device.table.rows() {
        let Address { index, sub } = row.address;
        for at in [(index, 0), (index, sub), (index, sub + 1), (index + 1, sub)] {
            let address = Address::new(at.0, at.1);
            let found = device.table.find(at.0, at.1).ok();
            all.push((address, found.map(|entry| entry.field.data_type())));
        }
    }
    all.sort_by_key(|(address, _)| *address);
    all.dedup();
    all
}

fn outcome<T>(result: Result<T, u32>) -> Result<T, Abort> {
    result.map_err(Abort)
}

#[test]
fn a_read_gives_what_an_upload_gives() {
    for device in [&BASIC, &STANDARD, &P3_LIKE, &FULL] {
        let mut bench = Bench::new(device);
        bench.owner.position = -20_000;
        let mut compared = 0;
        for (address, data_type) in addresses(device) {
            if data_type.is_some_and(|t| t.bounds().is_none() || t.size() > 4) {
                continue;
            }
            let raw = outcome(bench.read(address.index, address.sub));
            let local = bench.node.read_local(address, &mut bench.owner);
            let number = |raw| data_type.map_or(i64::from(raw), |t| t.number(raw));
            assert_eq!(local, raw.map(number), "{address}");
            compared += 1;
        }
        assert!(compared > 50, "{compared}");
    }
}

/// The same writes by both ways leave the same values behind, and are refused with the same code.
#[test]
fn a_write_does_what_a_download_does() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut accepted = 0;
        let mut refused = 0;
        for (address, data_type) in addresses(device) {
            let bounds = data_type.and_then(DataType::bounds);
            if data_type.is_some() && (bounds.is_none() || data_type.is_some_and(|t| t.size() > 4))
            {
                continue;
            }
            let (least, greatest) = bounds.unwrap_or((0, 1));
            for value in [least, -1, 0, 1, 5, 100, greatest / 2, greatest] {
                if value < least {
                    continue;
                }
                for verdict in [
                    Verdict::Accept,
                    Verdict::Refuse(Abort::DEVICE_STATE),
                    Verdict::Done,
                ] {
                    let bench = || {
                        let mut bench = Bench::new(device);
                        bench.owner.verdicts.push((address.index, verdict));
                        bench
                    };
                    let (mut outer, mut inner) = (bench(), bench());
                    let bytes = value.to_le_bytes();
                    let size = data_type.map_or(1, DataType::size);
                    let download =
                        outer.write(address.index, address.sub, &bytes[..usize::from(size)]);
                    let (node, owner) = (&mut inner.node, &mut inner.owner);
                    let local = node.write_local(address, value, inner.now, owner);
                    let events = local.as_ref().map_or(outer.events, |events| *events);
                    assert_eq!(local.map(|_| ()), outcome(download), "{address} {value}");
                    assert_eq!(events.changed, outer.events.changed, "{address} {value}");
                    assert_eq!(inner.node.bytes(), outer.node.bytes(), "{address} {value}");
                    assert_eq!(inner.owner.asked, outer.owner.asked, "{address} {value}");
                    match download {
                        Ok(()) => accepted += 1,
                        Err(_) => refused += 1,
                    }
                }
            }
        }
        assert!(accepted > 300 && refused > 300, "{accepted} {refused}");
    }
}

/// A number that the type cannot hold is one out of range; text and real numbers are no integers.
#[test]
fn what_an_object_cannot_hold_is_refused() {
    let mut bench = Bench::new(&STANDARD);
    let mut write = |index, sub, value| {
        let (node, owner) = (&mut bench.node, &mut bench.owner);
        let written = node.write_local(Address::new(index, sub), value, bench.now, owner);
        written.map(|_| ())
    };
    assert_eq!(write(0x2000, 1, 256), Err(Abort::VALUE_TOO_HIGH));
    assert_eq!(write(0x2000, 1, -1), Err(Abort::VALUE_TOO_LOW));
    assert_eq!(write(0x2000, 1, 255), Ok(()));
    let at = |data_type| {
        let mut rows = STANDARD.table.rows().iter();
        rows.find(|row| row.data_type == data_type)
            .map(|row| row.address)
    };
    let real = at(DataType::F32).expect("a real number");
    assert_eq!(write(real.index, real.sub, 1), Err(Abort::LENGTH));
    let local = bench.node.read_local(real, &mut bench.owner);
    assert_eq!(local, Err(Abort::LENGTH));
    let local = bench
        .node
        .read_local(Address::new(0x1008, 0), &mut bench.owner);
    assert_eq!(local, Err(Abort::LENGTH));
}

/// While an SDO client's write is being carried out, there is no other, whoever asks.
#[test]
fn one_thing_at_a_time() {
    let mut bench = Bench::new(&STANDARD);
    bench.owner.verdicts.push((0x1010, Verdict::Later));
    let save = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
    assert_eq!(bench.send(0x600 + u16::from(ID), &save), []);
    let (node, owner) = (&mut bench.node, &mut bench.owner);
    assert!(node.is_busy());
    let busy = node.write_local(Address::new(0x2000, 1), 1, bench.now, owner);
    assert_eq!(busy.map(|_| ()), Err(Abort::DEVICE_STATE));
    node.complete(Ok(()), bench.now);
    assert!(!node.is_busy());
    let (node, owner) = (&mut bench.node, &mut bench.owner);
    assert!(
        node.write_local(Address::new(0x2000, 1), 1, bench.now, owner)
            .is_ok()
    );
}
