//! Objects: PDOs, properties, what is not implemented, what is saved, and whatever else comes.

use crate::bench::{answers, of, operational, property, quiet};

/// J20: PDOs in operational only.
#[test]
fn pdos_in_operational_only() {
    let mut master = quiet(&[1]);
    of(&mut master, 0, &[0x80, 1]);
    master.write(1, 0x1A00, 1, &[16, 0, 0x63, 0x60]);
    master.write(1, 0x1A00, 0, &[1]);
    master.write(1, 0x1800, 2, &[0]);
    assert_eq!(of(&mut master, 0x080, &[]), []);
    of(&mut master, 0, &[0x01, 1]);
    let frames = of(&mut master, 0x080, &[]);
    assert_eq!(frames.len(), 1);
    assert_eq!((frames[0].0, frames[0].1.len()), (0x181, 2));
}

/// J14: reads 0, writes are acknowledged, nothing happens.
#[test]
fn what_is_not_implemented() {
    let mut master = operational(&[1]);
    for (index, sub, bytes) in [
        (0x6040, 0, &[0x0F, 0x00][..]),
        (0x606F, 0, &[1, 2, 3, 4]),
        (0x2A10, 0, &[3]),
        (0x2A10, 1, &[1]),
        (0x2A10, 2, &[1]),
        (0x2A12, 0, &[3]),
        (0x2A12, 1, &[1]),
        (0x2A12, 2, &[1]),
    ] {
        let [low, high] = index_bytes(index);
        let mut request = vec![0x22, low, high, sub];
        request.extend(bytes);
        let mut echoed = vec![0x60, low, high, sub];
        echoed.extend(bytes);
        echoed.resize(8, 0);
        assert_eq!(of(&mut master, 0x601, &request), [(0x581, echoed)]);
        assert_eq!(master.read(1, index, sub), 0, "{index:04X},{sub}");
    }
    for (index, sub) in [
        (0x603F, 0),
        (0x6041, 0),
        (0x2A01, 0),
        (0x2A01, 1),
        (0x2A11, 0),
        (0x2A11, 1),
        (0x2A11, 2),
    ] {
        assert_eq!(master.read(1, index, sub), 0);
        assert_eq!(master.try_write(1, index, sub, &[0, 0]), Err(0x0601_0002));
    }
    assert_eq!(master.read(1, 0x6061, 0), 0);
    let truth = master.drive(1).plant().truth();
    assert_eq!(truth.speed_rad_s, 0.0);
}

fn index_bytes(index: u16) -> [u8; 2] {
    index.to_le_bytes()
}

/// By PDO it is the same.
#[test]
fn what_is_not_implemented_by_pdo() {
    let mut master = operational(&[1]);
    for (sub, entry) in [
        (1, [16, 0, 0x40, 0x60]),
        (2, [32, 0, 0x6F, 0x60]),
        (3, [8, 1, 0x10, 0x2A]),
        (4, [8, 2, 0x12, 0x2A]),
    ] {
        master.write(1, 0x1600, sub, &entry);
    }
    master.write(1, 0x1600, 0, &[4]);
    for word in [0x06, 0x07, 0x0F, 0x80] {
        master.send(0x201, &[word, 0, 1, 2, 3, 4, 1, 1]);
        master.run_ms(5);
        for (index, sub) in [(0x6040, 0), (0x606F, 0), (0x2A10, 1), (0x2A12, 2)] {
            assert_eq!(master.read(1, index, sub), 0, "{index:04X},{sub}");
        }
        assert_eq!(master.read(1, 0x6041, 0), 0);
        let core = master.drive(1).core().expect("it has booted");
        assert!(!core.comms().axis().is_powered());
    }
}

/// J1: the acknowledge of every object that can be written holds what was written, and zeros behind it.
#[test]
fn every_acknowledge_echoes() {
    let mut master = operational(&[1]);
    let rows = personalities::p3_jpl::OBJECTS.table().rows();
    let mut written = 0;
    for row in rows.iter().filter(|row| row.writable()) {
        for sub in row.address.sub..row.address.sub + row.count {
            let index = row.address.index;
            if index == 0x1010 {
                continue; // J2
            }
            let before = master.try_read(1, index, sub).expect("a value");
            let [low, high] = index_bytes(index);
            let mut request = vec![0x22, low, high, sub];
            request.extend(&before[..usize::from(row.data_type.size())]);
            let mut echoed = request.clone();
            echoed[0] = 0x60;
            echoed.resize(8, 0);
            let answer = of(&mut master, 0x601, &request);
            assert_eq!(answer, [(0x581, echoed)], "{index:04X},{sub}");
            written += 1;
        }
    }
    assert_eq!(written, 6 + 1 + 4 * (2 + 5 + 4 + 5) + 6 + 2 + 8);
}

/// Every property of 0x3F00 can be read, none written.
#[test]
fn properties_over_sdo() {
    let mut master = operational(&[1]);
    for number in 0..=127 {
        master.read(1, 0x3F00, number);
        assert_eq!(
            master.try_write(1, 0x3F00, number, &[0, 0, 0, 0]),
            Err(0x0601_0002),
            "J18"
        );
    }
    // The manual's example (l.334), and J8: the answer names what was asked for.
    assert_eq!(
        of(&mut master, 0x601, &[0x40, 0x00, 0x3F, 0x32]),
        [(0x581, vec![0x42, 0x00, 0x3F, 0x32, 0x00, 0x80, 0, 0])]
    );
    let therm = of(&mut master, 0x601, &[0x40, 0x00, 0x3F, 0x14]);
    assert_eq!(therm[0].1[..4], [0x42, 0x00, 0x3F, 0x14]);
    assert_eq!(master.read(1, 0x3F00, 3), 1);
    let serial = master.read(1, 0x1018, 4);
    assert_eq!(master.read(1, 0x3F00, 2), serial);
    master.write_i32(1, 0x3F63, 0, -70_000);
    assert_eq!(master.read(1, 0x3F00, 48), master.position(1));
    assert_eq!(master.position(1), -70_000);
    assert_eq!(master.read(1, 0x6063, 0), -70_000);
    assert_eq!(master.read(1, 0x3F63, 0), -70_000);
    let before = master.read(1, 0x3F00, 63);
    master.run_ms(3000);
    assert_eq!(master.read(1, 0x3F00, 63), before + 3, "UPSECS");
    assert_eq!(master.read(1, 0x3F00, 82), 2, "ACCEL");
}

/// J2: the save's acknowledge says 1; the signature is asked for.
#[test]
fn save() {
    let mut master = operational(&[1]);
    master.write(1, 0x1018, 5, &[7, 0, 0, 0]);
    master.write(1, 0x1018, 6, &[9, 0, 0, 0]);
    assert_eq!(master.try_write(1, 0x1010, 1, b"evas"), Err(0x0800_0020));
    assert_eq!(master.try_write(1, 0x1010, 1, b"SAVE"), Err(0x0800_0020));
    master.log.clear();
    master.send(0x601, &[0x22, 0x10, 0x10, 1, 0x73, 0x61, 0x76, 0x65]);
    master.run_ms(1000);
    assert_eq!(
        answers(&master),
        [(0x581, vec![0x60, 0x10, 0x10, 1, 1, 0, 0, 0])]
    );
    assert_eq!(master.read(1, 0x1010, 1), 1);
    master.send(0, &[0x81, 1]);
    master.run_ms(50);
    assert_eq!(property(&mut master, 1, 1), 9, "ROLE");
    master.send(0, &[0x01, 1]);
    master.run_ms(5);
    assert_eq!(master.read(1, 0x1018, 5), 7);
}

/// What a save keeps over a reset, and what it does not: every object that can be written.
#[test]
fn a_save_keeps_configuration_and_nothing_else() {
    let mut master = quiet(&[1]);
    of(&mut master, 0, &[0x80, 1]);
    /// Index, sub-index, another value than at first, whether it is kept.
    type Other = (u16, u8, i32, bool);
    let rows = personalities::p3_jpl::OBJECTS.table().rows();
    let others: Vec<Other> = rows
        .iter()
        .filter(|row| row.writable() && row.address.index != 0x1010)
        .flat_map(|row| (0..row.count).map(move |step| (row, row.address.sub + step)))
        .map(|(row, sub)| {
            let index = row.address.index;
            let kept = row.group != canopen::Group::None;
            let value = match (index, sub) {
                (0x1005, _) => 0x90,
                (0x1014, _) => 0xA1,
                (0x1400..=0x1403, 1) => i32::from(index - 0x1400) + 0x211,
                (0x1800..=0x1803, 1) => i32::from(index - 0x1800) + 0x191,
                (0x1400..=0x1403 | 0x1800..=0x1803, 2) => 7,
                (0x1600..=0x1603, 1..) => 0x607A_0010,
                (0x1A00..=0x1A03, 1..) => 0x6063_0010,
                (0x3F60 | 0x6060, _) => 3,
                (0x2A10..=0x2A12 | 0x6040 | 0x606F, _) => 0,
                _ => 2,
            };
            (index, sub, value, kept)
        })
        .collect();
    // The entries of a mapping before their number.
    let is_count =
        |(index, sub, ..): &&Other| *sub == 0 && matches!(index, 0x1600..=0x1603 | 0x1A00..=0x1A03);
    let (counts, first): (Vec<_>, Vec<_>) = others.iter().partition(is_count);
    for (index, sub, value, _) in first.into_iter().chain(counts) {
        let table = personalities::p3_jpl::OBJECTS.table();
        let size = table.find(index, sub).unwrap().field.data_type().size();
        master.write(1, index, sub, &value.to_le_bytes()[..usize::from(size)]);
    }
    assert_eq!(master.try_write(1, 0x1010, 1, b"save"), Ok(()));
    of(&mut master, 0, &[0x81, 1]);
    master.run_ms(50);
    of(&mut master, 0, &[0x80, 1]);
    let mut kept_ones = 0;
    for (index, sub, value, kept) in others {
        let now = master.read(1, index, sub);
        if index == 0x3F63 {
            assert_ne!(now, value, "a position is none that is kept");
        } else if kept {
            assert_eq!(now, value, "{index:04X},{sub} is kept");
            kept_ones += 1;
        } else {
            assert_eq!(now, 0, "{index:04X},{sub} is not kept");
        }
    }
    assert_eq!(kept_ones, 10 + 4 * (2 + 5 + 4 + 5));
}

/// Whatever comes, in BarrettCAN and later: it does not fall over, and answers what is right.
#[test]
fn garbage() {
    let mut random = 0x9E37_79B9_7F4A_7C15_u64;
    let mut next = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random
    };
    for starts in [false, true] {
        let mut master = quiet(&[1]);
        if starts {
            of(&mut master, 0, &[0x01, 1]);
        }
        for _ in 0..20_000 {
            let dice = next();
            let id = match dice % 4 {
                0 => 0x601,
                1 => 0x001,
                2 => 0x201,
                _ => (dice >> 8) as u16 & 0x7FF,
            };
            // NMT would lead elsewhere.
            if id == 0 {
                continue;
            }
            let data = next().to_le_bytes();
            let length = (dice >> 32) as usize % 9;
            let mut data = data[..length].to_vec();
            // Objects that there are, more often than not.
            if id == 0x601 && length > 3 && dice & 0x100 != 0 {
                let rows = personalities::p3_jpl::OBJECTS.table().rows();
                let row = rows[(dice >> 16) as usize % rows.len()];
                data[1..3].copy_from_slice(&row.address.index.to_le_bytes());
                data[3] = row.address.sub;
                data[0] = if dice & 0x200 != 0 { 0x22 } else { 0x40 };
            }
            master.send(id, &data);
            master.run_us(200);
            master.log.clear();
        }
        master.run_ms(2000);
        if starts {
            assert_eq!(master.read(1, 0x1000, 0), 0x0002_0192);
            assert_eq!(master.read(1, 0x6041, 0), 0);
        } else {
            assert_eq!(property(&mut master, 1, 3), 1);
        }
    }
}
