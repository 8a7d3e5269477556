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
