//! The P3 of 2016 on a simulated bus and motor: what its manual says that tables do not tell.

mod master;

use can::Frame;
use master::*;
use sim::DriveSettings;

const PER_TURN: f64 = 4096.0;

fn jpl(node: u8) -> DriveSettings {
    DriveSettings::new(id(node), &personalities::p3_jpl::P3_JPL)
}

/// A bus of drives that have had their power for 50 ms, and no message yet.
fn quiet(nodes: &[u8]) -> Master {
    Master::with(nodes.iter().map(|node| jpl(*node)).collect())
}

/// The same in operational.
fn operational(nodes: &[u8]) -> Master {
    let mut master = quiet(nodes);
    master.send(0, &[0x01, 0]);
    master.run_ms(5);
    master.log.clear();
    master
}

/// Frames of the drives in the log: identifier and data.
fn answers(master: &Master) -> Vec<(u32, Vec<u8>)> {
    let from_drives =
        |frame: &Frame| !matches!(frame.raw_id(), 0 | 0x080 | 0x601..=0x67F | 1..=0x1F);
    master
        .log
        .iter()
        .filter(|traffic| from_drives(&traffic.frame))
        .map(|traffic| (traffic.frame.raw_id(), traffic.frame.data().to_vec()))
        .collect()
}

/// What comes of one frame within 10 ms.
fn of(master: &mut Master, id: u16, data: &[u8]) -> Vec<(u32, Vec<u8>)> {
    master.log.clear();
    master.send(id, data);
    master.run_ms(10);
    let sent = u32::from(id);
    answers(master)
        .into_iter()
        .filter(|(id, _)| *id != sent)
        .collect()
}

/// A property over BarrettCAN.
fn property(master: &mut Master, node: u8, number: u8) -> i32 {
    let frames = of(master, u16::from(node), &[number]);
    let [(identifier, data)] = frames.as_slice() else {
        panic!("{frames:02X?}")
    };
    assert_eq!(*identifier, 0x406 | u32::from(node) << 5);
    assert_eq!(data[..2], [0x80 | number, 0]);
    match data[2..] {
        [v0, v1] => i16::from_le_bytes([v0, v1]).into(),
        [v0, v1, v2, v3] => i32::from_le_bytes([v0, v1, v2, v3]),
        _ => panic!("{data:02X?}"),
    }
}

#[test]
fn it_waits_in_barrett_can() {
    let mut master = quiet(&[1, 2]);
    assert_eq!(answers(&master), [], "no boot-up");
    master.run_ms(2000);
    assert_eq!(answers(&master), [], "and no heartbeat");
    // No SDO, no PDO, no LSS.
    for (id, data) in [
        (0x601u16, &[0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0][..]),
        (0x601, &[0x22, 0x60, 0x60, 0x00, 0x01]),
        (0x080, &[]),
        (0x201, &[0, 0, 0, 0]),
        (0x7E5, &[0x04, 1, 0, 0, 0, 0, 0, 0]),
        // An SDO request and a heartbeat of node 32 look like messages of others to group 0.
        (0x620, &[0x40]),
        (0x720, &[0x05]),
    ] {
        assert_eq!(of(&mut master, id, data), [], "{id:03X}");
    }
    // Firmware 145, node IDs, ready, THERM about 25 °C in Q8.8, 4096 counts a turn.
    assert_eq!(property(&mut master, 1, 0), 145);
    assert_eq!(property(&mut master, 1, 3), 1);
    assert_eq!(property(&mut master, 2, 3), 2);
    assert_eq!(property(&mut master, 1, 5), 2);
    let therm = property(&mut master, 1, 20);
    assert!((24 * 256..26 * 256).contains(&therm), "{therm}");
    assert_eq!(property(&mut master, 1, 68), 4096);
    assert_eq!(property(&mut master, 1, 50), 0x8000);
    // The supply is 48 V.
    let supply = property(&mut master, 1, 21);
    assert!((supply - 48 * 256).abs() < 64, "{supply}");
    // Two bytes, or four of a property with two numbers.
    assert_eq!(of(&mut master, 1, &[90]), [(0x426, vec![0xDA, 0, 2, 0])]);
    assert_eq!(
        of(&mut master, 1, &[68]),
        [(0x426, vec![0xC4, 0, 0, 0x10, 0, 0])]
    );
    // To a group: all answer.
    let mut all = of(&mut master, 0x400, &[3]);
    all.sort_unstable();
    assert_eq!(
        all,
        [(0x426, vec![0x83, 0, 1, 0]), (0x446, vec![0x83, 0, 2, 0])]
    );
    // A set, a number that is no property, a frame without one, too long a frame: nothing.
    for data in [&[0x88, 0, 3, 0][..], &[109], &[127], &[], &[3, 0]] {
        assert_eq!(of(&mut master, 1, data), [], "{data:02X?}");
    }
    assert_eq!(property(&mut master, 1, 8), 0, "the mode was not set");
}

/// J9: each NMT message but "reset node" ends it; one heartbeat tells the state.
#[test]
fn the_first_nmt_message_ends_it() {
    for (command, state) in [(0x01, 0x05), (0x80, 0x7F), (0x02, 0x04), (0x82, 0x7F)] {
        for target in [1, 0] {
            let mut master = quiet(&[1]);
            assert_eq!(
                of(&mut master, 0, &[command, target]),
                [(0x701, vec![state])],
                "{command:02X}"
            );
            assert_eq!(of(&mut master, 1, &[3]), [], "BarrettCAN is over");
            master.run_ms(500);
            assert_eq!(answers(&master), [], "0x1017 is 0");
        }
    }
    // Not for it, no command, too long: it goes on waiting.
    let mut master = quiet(&[1]);
    for data in [&[0x01, 2][..], &[0x03, 1], &[0x01], &[0x01, 1, 0]] {
        assert_eq!(of(&mut master, 0, data), [], "{data:02X?}");
    }
    assert_eq!(of(&mut master, 0, &[0x81, 1]), []);
    master.run_ms(50);
    assert_eq!(property(&mut master, 1, 3), 1, "reset, it waits again");
    of(&mut master, 0, &[0x80, 1]);
    assert_eq!(master.read(1, 0x1000, 0), 0x0002_0192);
    // Changes of state are not told, until a heartbeat is on.
    assert_eq!(of(&mut master, 0, &[0x01, 1]), []);
    assert_eq!(of(&mut master, 0, &[0x81, 1]), []);
    master.run_ms(50);
    assert_eq!(property(&mut master, 1, 3), 1, "a reset leads back");
}

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

#[test]
fn modes_are_chosen_without_a_state_machine() {
    let mut master = operational(&[1]);
    for mode in [1, 3, 4, 6, 7, 0] {
        master.write(1, 0x6060, 0, &[mode]);
        assert_eq!(master.read(1, 0x6061, 0), i32::from(mode));
        assert_eq!(master.read(1, 0x3F00, 8), i32::from(mode));
    }
    // 5 is reserved; the others are not listed.
    master.write(1, 0x6060, 0, &[1]);
    for mode in [2, 5, 8, 9, 10, 0xFF, 0x80] {
        assert_eq!(master.try_write(1, 0x6060, 0, &[mode]), Err(0x0609_0030));
        assert_eq!(master.try_write(1, 0x3F60, 0, &[mode]), Err(0x0609_0030));
        assert_eq!(master.read(1, 0x6061, 0), 1);
    }
}

/// A streamed position, in the low 16 bits of the objects, as the example has it (l.280).
#[test]
fn position_follows_at_once() {
    let mut master = operational(&[1]);
    for (index, sub, value) in [
        (0x1600, 1, &[0x10, 0x00, 0x7A, 0x60][..]),
        (0x1600, 0, &[1]),
        (0x1A00, 1, &[0x10, 0x00, 0x63, 0x60]),
        (0x1A00, 0, &[1]),
        (0x1800, 2, &[0]),
    ] {
        master.write(1, index, sub, value);
    }
    master.write_i32(1, 0x3F63, 0, 0);
    assert!(master.position(1).abs() <= 1);
    // The motor is free until a mode is chosen, whatever target comes.
    master.send(0x201, &[0x00, 0x10]);
    master.run_ms(100);
    assert!(master.position(1).abs() <= 2);
    master.write(1, 0x6060, 0, &[1]);
    master.run_ms(20);
    assert!(master.position(1).abs() <= 2, "nothing jumps");
    let mut target = 0i16;
    for (n, step) in [100; 20].into_iter().chain([-150; 30]).enumerate() {
        target += step;
        // J5: two bytes, or four.
        let [low, high] = target.to_le_bytes();
        let data = [low, high, 0x55, 0xAA];
        master.send(0x201, &data[..if n % 2 == 0 { 2 } else { 4 }]);
        master.run_ms(4);
    }
    assert_eq!(target, -2500);
    master.run_ms(300);
    assert!((master.position(1) - -2500).abs() <= 3, "sign extended");
    assert_eq!(master.read(1, 0x607A, 0), -2500);
    assert_eq!(master.read(1, 0x6062, 0), -2500);
    let frames = of(&mut master, 0x080, &[]);
    let [(0x181, data)] = frames.as_slice() else {
        panic!("{frames:02X?}")
    };
    let shown = i16::from_le_bytes([data[0], data[1]]);
    assert!((i32::from(shown) - -2500).abs() <= 3, "{shown}");
    // Held against the hand; idle lets go.
    master.drive(1).plant().set_load_torque_nm(0.01);
    master.run_ms(500);
    assert!((master.position(1) - -2500).abs() <= 60);
    master.write(1, 0x6060, 0, &[0]);
    master.run_ms(100);
    assert!((master.position(1) - -2500).abs() > 1000);
}

/// J13: Q16.16 rad/s at the shaft, which turns as fast.
#[test]
fn velocity_in_radians() {
    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[3]);
    for rad_per_s in [100.0, -250.5] {
        let target = (rad_per_s * 65_536.0) as i32;
        master.write_i32(1, 0x60FF, 0, target);
        master.run_ms(800);
        let truth = f64::from(master.drive(1).plant().truth().speed_rad_s);
        assert!((truth - rad_per_s).abs() < 2.0, "{truth}");
        let demand = f64::from(master.read(1, 0x606B, 0)) / 65_536.0;
        assert!((demand - rad_per_s).abs() < 0.01, "{demand}");
        let shown = f64::from(master.read(1, 0x606C, 0)) / 65_536.0;
        assert!((shown - rad_per_s).abs() < 4.0, "{shown}");
        let counts = f64::from(master.read(1, 0x6069, 0));
        let expected = rad_per_s * PER_TURN / std::f64::consts::TAU;
        assert!((counts - expected).abs() < 2500.0, "{counts}");
        // Counts/ms, in two's complement.
        let property = master.read(1, 0x3F00, 44);
        assert!(
            (f64::from(property) - expected / 1000.0).abs() < 3.0,
            "{property}"
        );
    }
    // The ramp is 0x6083: 100,000 counts/s².
    master.write_i32(1, 0x60FF, 0, 0);
    master.run_ms(800);
    master.write_i32(1, 0x6083, 0, 100_000);
    master.write_i32(1, 0x60FF, 0, 100 << 16);
    master.run_ms(300);
    let turns = f64::from(master.drive(1).plant().truth().speed_rad_s) / std::f64::consts::TAU;
    let counts = turns * PER_TURN;
    assert!((counts - 30_000.0).abs() < 1500.0, "{counts}");
}

/// J15: 0x6074 drives mode 4. Per mille of 23 mNm on a rotor of 4.45 gcm².
#[test]
fn torque_accelerates() {
    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[4]);
    for effort in [100i16, -200] {
        let before = f64::from(master.drive(1).plant().truth().speed_rad_s);
        master.write_i16(1, 0x6074, 0, effort);
        master.run_ms(50);
        let after = f64::from(master.drive(1).plant().truth().speed_rad_s);
        let expected = f64::from(effort) * 23e-6 / 4.45e-7 * 0.05;
        let gained = after - before;
        assert!(
            (gained - expected).abs() < 0.08 * expected.abs(),
            "{gained} {expected}"
        );
        let shown = master.read(1, 0x3F00, 42);
        assert!((shown - i32::from(effort)).abs() < 30, "{shown}");
    }
    master.write_i16(1, 0x6074, 0, 0);
    master.run_ms(5);
    assert!(master.read(1, 0x3F00, 22).abs() < 30, "mA");
}

/// J15: mode 7 goes to each written target by the trapezoid of 0x6083, 0x6084 and MV.
#[test]
fn the_trapezoid() {
    let mut master = operational(&[1]);
    master.write_i32(1, 0x3F63, 0, 0);
    // A target of before does not count.
    master.write_i32(1, 0x607A, 0, 20_000);
    master.write_i32(1, 0x6083, 0, 400_000);
    master.write_i32(1, 0x6084, 0, 400_000);
    master.write(1, 0x6060, 0, &[7]);
    master.run_ms(100);
    assert!(master.position(1).abs() <= 3);
    // 40,000 counts at 400,000 counts/s²: 2·√(40,000/400,000) = 632 ms, at most 126,491 counts/s.
    master.write_i32(1, 0x607A, 0, 40_000);
    let mut fastest = 0;
    let mut took = 0;
    while (master.position(1) - 40_000).abs() > 40 {
        fastest = fastest.max(master.read(1, 0x6069, 0));
        took += 1;
        master.run_ms(1);
        assert!(took < 2000);
    }
    println!("the way took {took} readings, fastest {fastest} counts/s");
    assert!((110_000..140_000).contains(&fastest), "{fastest}");
    master.run_ms(200);
    assert!(
        (master.position(1) - 40_000).abs() <= 5,
        "no overshoot left"
    );
    // The same target again changes nothing; another one in mid-way is gone to at once.
    master.write_i32(1, 0x607A, 0, 40_000);
    master.run_ms(100);
    assert!((master.position(1) - 40_000).abs() <= 5);
    master.write_i32(1, 0x607A, 0, 80_000);
    master.run_ms(200);
    master.write_i32(1, 0x607A, 0, 30_000);
    master.run_ms(1500);
    assert!((master.position(1) - 30_000).abs() <= 5);
    // Through position mode and back.
    master.write(1, 0x6060, 0, &[1]);
    master.write(1, 0x6060, 0, &[7]);
    master.write_i32(1, 0x607A, 0, 31_000);
    master.run_ms(500);
    assert!((master.position(1) - 31_000).abs() <= 5);
}

/// 0x3F60 is taken with the first start, saved or not; what the master chooses stays.
#[test]
fn default_mode() {
    let mut master = quiet(&[1]);
    of(&mut master, 0, &[0x80, 1]);
    master.write(1, 0x3F60, 0, &[1]);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x6061, 0), 1);
    assert_eq!(master.read(1, 0x6060, 0), 1);
    // Not anew.
    master.write(1, 0x6060, 0, &[0]);
    of(&mut master, 0, &[0x80, 1]);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    // A mode chosen before operational stays.
    assert_eq!(master.try_write(1, 0x1010, 1, &SAVE), Ok(()));
    of(&mut master, 0, &[0x81, 1]);
    master.run_ms(50);
    of(&mut master, 0, &[0x80, 1]);
    assert_eq!(master.read(1, 0x3F60, 0), 1, "it was saved");
    master.write(1, 0x6060, 0, &[3]);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x6061, 0), 3);
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

/// J16, J17: no emergency; 0x1001 keeps a temperature error until a reset, and the motor stays free.
#[test]
fn a_temperature_error_lasts_until_a_reset() {
    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[3]);
    master.write_i32(1, 0x60FF, 0, 50 << 16);
    master.run_ms(300);
    assert_eq!(master.read(1, 0x1001, 0), 0);
    let warm = master.read(1, 0x2202, 0);
    assert!((20 * 256..40 * 256).contains(&warm), "Q8.8: {warm}");
    master.log.clear();
    master.drive(1).plant().set_amplifier_temperature_c(95.0);
    master.run_ms(500);
    assert_eq!(answers(&master), [], "no emergency");
    // The manual's example (l.316).
    let read = of(&mut master, 0x601, &[0x40, 0x01, 0x10, 0x00, 0x00]);
    assert_eq!(read, [(0x581, vec![0x42, 0x01, 0x10, 0x00, 0x09, 0, 0, 0])]);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    assert_eq!(master.try_write(1, 0x6060, 0, &[1]), Err(0x0800_0022));
    assert_eq!(master.try_write(1, 0x6060, 0, &[0]), Ok(()));
    // It cools, and nothing changes.
    master.drive(1).plant().set_amplifier_temperature_c(25.0);
    master.run_ms(1000);
    assert_eq!(master.read(1, 0x1001, 0), 0x09);
    assert!(master.read(1, 0x3F00, 10) > 85 * 256, "PTEMP");
    of(&mut master, 0, &[0x82, 1]);
    assert_eq!(master.read(1, 0x1001, 0), 0x09, "nor with communication");
    of(&mut master, 0, &[0x81, 1]);
    master.run_ms(50);
    of(&mut master, 0, &[0x01, 1]);
    assert_eq!(master.read(1, 0x1001, 0), 0);
    master.write(1, 0x6060, 0, &[1]);
    assert_eq!(master.read(1, 0x6061, 0), 1);
    // The motor's winding counts, too.
    master.drive(1).plant().set_motor_temperature_c(120.0);
    master.run_ms(300);
    assert_eq!(master.read(1, 0x1001, 0), 0x09);
}

/// The over-current bit: while I²t holds the current back, and latched after a short circuit.
#[test]
fn over_current() {
    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[4]);
    master.drive(1).plant().set_blocked(true);
    // Twice rated torque: MT.
    master.write_i16(1, 0x6074, 0, 2000);
    master.run_ms(100);
    assert_eq!(master.read(1, 0x1001, 0), 0);
    master.run_ms(2000);
    assert_eq!(master.read(1, 0x1001, 0), 0x03);
    assert_eq!(master.read(1, 0x3F00, 4), 0x03, "ERROR");
    let current = master.read(1, 0x3F00, 22);
    assert!((650..790).contains(&current), "{current} mA are left");
    master.write_i16(1, 0x6074, 0, 0);
    master.run_ms(5000);
    assert_eq!(master.read(1, 0x1001, 0), 0, "it ends with its cause");
    assert_eq!(master.read(1, 0x6061, 0), 4);
    assert_eq!(master.emergencies(1), [[0; 8]; 0]);

    let mut master = operational(&[1]);
    master.write(1, 0x6060, 0, &[3]);
    master.write_i32(1, 0x60FF, 0, 100 << 16);
    master.run_ms(300);
    master
        .drive(1)
        .plant()
        .set_short(Some(plant::Short::ToNegative(plant::Phase::A)));
    master.run_ms(50);
    assert_eq!(master.read(1, 0x1001, 0), 0x03);
    assert_eq!(master.read(1, 0x6061, 0), 0);
    master.drive(1).plant().set_short(None);
    master.run_ms(500);
    assert_eq!(master.read(1, 0x1001, 0), 0x03, "latched");
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

/// Every NMT message in every state, BarrettCAN among them.
#[test]
fn every_nmt_message_in_every_state() {
    const BARRETT_CAN: u8 = 0;
    let lead = |from: u8| -> &'static [u8] {
        match from {
            BARRETT_CAN => &[],
            0x05 => &[0x01],
            0x04 => &[0x02],
            _ => &[0x80],
        }
    };
    for from in [BARRETT_CAN, 0x05, 0x04, 0x7F] {
        for (command, to) in [
            (0x01, 0x05),
            (0x02, 0x04),
            (0x80, 0x7F),
            (0x81, BARRETT_CAN),
            (0x82, 0x7F),
        ] {
            let mut master = quiet(&[1]);
            for command in lead(from) {
                of(&mut master, 0, &[*command, 1]);
            }
            let frames = of(&mut master, 0, &[command, 1]);
            // Told by a heartbeat at the start only, and communication starts with a reset of it.
            let starts = from == BARRETT_CAN || command == 0x82;
            let told = (starts && to != BARRETT_CAN).then(|| (0x701, vec![to]));
            assert_eq!(frames, Vec::from_iter(told), "{from:02X} {command:02X}");
            master.run_ms(50);
            let answers_property = !of(&mut master, 1, &[3]).is_empty();
            assert_eq!(
                answers_property,
                to == BARRETT_CAN,
                "{from:02X} {command:02X}"
            );
            let answers_sdo = !of(&mut master, 0x601, &[0x40, 0x00, 0x10, 0x00]).is_empty();
            assert_eq!(
                answers_sdo,
                matches!(to, 0x05 | 0x7F),
                "{from:02X} {command:02X}"
            );
            let core = master.drive(1).core().expect("it has booted");
            assert_eq!(core.comms().node().state() as u8, to);
        }
    }
}

/// From every mode to every mode, turning: the motor is free in 0 and 6 and under power in the others.
#[test]
fn every_mode_from_every_mode() {
    const MODES: [u8; 6] = [0, 1, 3, 4, 6, 7];
    for from in MODES {
        for to in MODES {
            let mut master = operational(&[1]);
            master.write_i32(1, 0x60FF, 0, 30 << 16);
            master.write_i16(1, 0x6074, 0, 30);
            master.write(1, 0x6060, 0, &[from]);
            master.run_ms(100);
            let before = f64::from(master.drive(1).plant().truth().speed_rad_s);
            master.write(1, 0x6060, 0, &[to]);
            assert_eq!(master.read(1, 0x6061, 0), i32::from(to));
            assert_eq!(master.read(1, 0x6060, 0), i32::from(to));
            let core = master.drive(1).core().expect("it has booted");
            let is_free = matches!(to, 0 | 6);
            assert_eq!(core.comms().axis().is_powered(), !is_free, "{from} {to}");
            master.run_ms(200);
            let after = f64::from(master.drive(1).plant().truth().speed_rad_s);
            match to {
                // It coasts.
                0 | 6 => assert!(after.abs() <= before.abs() + 0.5, "{from} {to}: {after}"),
                // It stands, where no target has come.
                1 | 7 => assert!(after.abs() < 2.0, "{from} {to}: {after}"),
                3 => assert!((after - 30.0).abs() < 2.0, "{from} {to}: {after}"),
                _ => assert!(after > before.min(29.0), "{from} {to}: {after}"),
            }
        }
    }
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
