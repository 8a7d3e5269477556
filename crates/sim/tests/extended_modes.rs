//! Velocity mode, interpolated position mode, limited jerk and option codes of the extended P3 on a
//! simulated motor.

mod plain_master;

use can::Frame;
use cia402::State;
use plain_master::{HALT, Master, NODE, RUN, bus};

/// Counts/s of a revolution per minute.
const RPM: f64 = 4096.0 / 60.0;

fn frame(id: u16, data: &[u8]) -> Frame {
    let mut bytes = [0; 8];
    bytes[..data.len()].copy_from_slice(data);
    Frame::classic(id, bytes, data.len() as u8)
}

impl Master<'_> {
    fn send(&mut self, id: u16, data: &[u8]) {
        self.client.link().bus().send(0, frame(id, data));
    }

    #[track_caller]
    fn turns_with(&mut self, rpm: f64) {
        let seen = self.true_speed() / RPM;
        assert!(
            (seen - rpm).abs() < 10.0 + 0.02 * rpm.abs(),
            "{seen} rpm, not {rpm}"
        );
    }

    #[track_caller]
    fn is_in(&mut self, state: State) {
        assert_eq!(self.status().state(), Some(state));
    }

    fn set_supply_v(&mut self, volts: f32) {
        let drive = self.client.link().bus().drive(NODE).expect("the drive");
        drive.plant().set_supply_v(volts);
    }
}

#[test]
fn velocity_mode_turns_with_its_rpm() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    assert_eq!(master.read(0x6502, 0) & 0x42, 0x42, "VL and IP");
    master.write(0x6060, 0, 2);
    // 20,000 rpm/s up, 40,000 down.
    master.write(0x6048, 1, 20_000);
    master.write(0x6049, 1, 80_000);
    master.write(0x6049, 2, 2);
    master.enable();
    master.write(0x6042, 0, 3000);
    // Enabled alone it does not move.
    master.wait_ms(50);
    master.turns_with(0.0);
    master.write(0x6040, 0, 0x7F);
    master.wait_ms(75);
    assert!((1200.0..1900.0).contains(&(master.true_speed() / RPM)));
    assert!(!master.status().target_reached());
    master.wait_ms(175);
    master.turns_with(3000.0);
    assert!(master.status().target_reached());
    let shown = master.read(0x6044, 0);
    assert!((2980..=3020).contains(&shown), "{shown}");
    // The P3's own velocity demand stays what it is: counts/s.
    assert_eq!(master.read(0x6043, 0), (3000.0 * RPM) as i64);

    // The ramp locked, filled with zero, switched off.
    master.write(0x6040, 0, 0x5F);
    master.write(0x6042, 0, -1000);
    master.wait_ms(100);
    master.turns_with(3000.0);
    master.write(0x6040, 0, 0x3F);
    master.wait_ms(250);
    master.turns_with(0.0);
    master.write(0x6040, 0, 0x7F);
    master.wait_ms(250);
    master.turns_with(-1000.0);
    let shown = master.read(0x6044, 0);
    assert!((-1010..=-990).contains(&shown), "{shown}");
    master.write(0x6040, 0, 0x6F);
    master.wait_ms(250);
    master.turns_with(0.0);

    // Tenths of rpm, and twice of what is asked for.
    master.write(0x604C, 2, 10);
    master.write(0x604B, 1, 2);
    master.write(0x6048, 1, 200_000);
    master.write(0x6042, 0, 5000);
    master.write(0x6040, 0, 0x7F);
    master.wait_ms(300);
    master.turns_with(1000.0);
    let shown = master.read(0x6044, 0);
    assert!((4950..=5050).contains(&shown), "{shown}");
    assert!(master.try_write(0x604C, 2, 0).is_err());
    assert!(master.try_write(0x604B, 2, -1).is_err());
    // Halt holds.
    master.write(0x6040, 0, 0x7F | HALT);
    master.wait_ms(300);
    master.turns_with(0.0);
    assert!(master.status().target_reached());
}

#[test]
fn a_filled_buffer_is_interpolated() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    assert_eq!(master.read(0x60C4, 1), 16);
    // Nothing to fill outside the mode.
    assert!(master.try_write(0x60C1, 1, 0).is_err());
    master.write(0x6060, 0, 7);
    master.write(0x60C2, 1, 10);
    master.enable();
    let start = master.read(0x6064, 0);
    for n in 1..=16 {
        master.write(0x60C1, 1, start + n * 100);
        assert_eq!(master.read(0x60C4, 4), n);
    }
    let full = master.try_write(0x60C1, 1, 0).expect_err("full");
    assert!(full.to_string().contains("08000022"), "{full}");
    let status = master.status();
    assert!(!status.interpolates() && !status.target_reached());
    master.write(0x6040, 0, RUN | 0x10);
    master.wait_ms(80);
    assert!(master.status().interpolates());
    let left = master.read(0x60C4, 4);
    assert!((6..=8).contains(&left), "{left}");
    let speed = master.true_speed();
    assert!((speed - 10_000.0).abs() < 500.0, "{speed}");
    // There is room again.
    for n in 17..=20 {
        master.write(0x60C1, 1, start + n * 100);
    }
    master.wait_ms(200);
    let status = master.status();
    assert!(!status.interpolates() && status.target_reached());
    assert_eq!(master.read(0x60FC, 0), start + 2000);
    assert!((master.read(0x6064, 0) - start - 2000).abs() <= 20);
    // Emptied and closed, then opened.
    master.write(0x6040, 0, RUN);
    master.write(0x60C1, 1, start);
    master.write(0x60C4, 6, 0);
    assert_eq!(master.read(0x60C4, 4), 0);
    assert!(master.try_write(0x60C1, 1, start).is_err());
    master.write(0x60C4, 6, 1);
    master.write(0x60C4, 2, 1);
    master.write(0x60C1, 1, start);
    assert!(master.try_write(0x60C1, 1, start).is_err());
    // What it does not do.
    assert!(master.try_write(0x60C0, 0, -1).is_err());
    assert!(master.try_write(0x60C4, 3, 1).is_err());
    assert!(master.try_write(0x60C4, 2, 17).is_err());
}

#[test]
fn set_points_stream_with_sync() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    master.write(0x6060, 0, 7);
    master.write(0x60C2, 1, 4);
    // RPDO 1: the set-point, applied with the next SYNC.
    master.write(0x1400, 1, 0x8000_0201);
    master.write(0x1600, 0, 0);
    master.write(0x1600, 1, 0x60C1_0120);
    master.write(0x1600, 0, 1);
    master.write(0x1400, 2, 1);
    master.write(0x1400, 1, 0x201);
    master.send(0x000, &[1, 1]);
    master.wait_ms(5);
    master.enable();
    master.write(0x6040, 0, RUN | 0x10);
    let start = master.read(0x6064, 0) as f64;
    let amplitude = 8000.0;
    let mut worst = 0.0f64;
    for n in 0..=500 {
        let angle = 2.0 * std::f64::consts::PI * f64::from(n) * 0.004;
        let target = start + amplitude * (1.0 - angle.cos());
        master.send(0x201, &(target.round() as i32).to_le_bytes());
        master.send(0x080, &[]);
        master.wait_ms(4);
        if n > 5 && n % 10 == 0 {
            // At its SYNC a set-point begins; it is there at the next one.
            let speed = amplitude * angle.sin() * 2.0 * std::f64::consts::PI;
            worst = worst.max((master.true_speed() - speed).abs());
        }
        if n == 250 {
            assert!(master.status().interpolates());
            assert_eq!(master.read(0x60C4, 4), 0);
        }
    }
    // The peak speed is 50,000 counts/s.
    assert!(worst < 8000.0, "{worst}");
    // Two whole turns of the angle: back at the start, and at its end.
    master.wait_ms(50);
    assert!((master.read(0x60FC, 0) as f64 - start).abs() <= 1.0);
    assert!((master.read(0x6064, 0) as f64 - start).abs() <= 20.0);
    let status = master.status();
    assert!(!status.interpolates() && status.target_reached());
}

/// At 100,000 counts/s in profile velocity mode, with 1,000,000 counts/s² to slow down.
fn running<'a>(bus: &'a mut sim::Bus) -> Master<'a> {
    let mut master = Master::new(bus);
    master.write(0x6060, 0, 3);
    master.write(0x6084, 0, 500_000);
    master.write(0x6085, 0, 1_000_000);
    master.write(0x60FF, 0, 100_000);
    master.enable();
    master.wait_ms(200);
    let speed = master.true_speed();
    assert!((speed - 100_000.0).abs() < 2000.0, "{speed}");
    master
}

#[test]
fn leaving_operation_enabled_slows_down_or_lets_go() {
    for (word, object, ramp, state) in [
        (0x07, 0x605C, 1, State::SwitchedOn),
        (0x07, 0x605C, 0, State::SwitchedOn),
        (0x06, 0x605B, 1, State::ReadyToSwitchOn),
        (0x06, 0x605B, 0, State::ReadyToSwitchOn),
    ] {
        let mut bus = bus();
        let mut master = running(&mut bus);
        master.write(object, 0, ramp);
        master.write(0x6040, 0, word);
        if ramp == 0 {
            master.is_in(state);
            master.wait_ms(100);
            // Friction alone takes longer than any ramp.
            let speed = master.true_speed();
            assert!(speed > 60_000.0, "{word:#x}: {speed}");
        } else {
            master.is_in(State::OperationEnabled);
            master.wait_ms(100);
            let speed = master.true_speed();
            assert!((speed - 50_000.0).abs() < 4000.0, "{word:#x}: {speed}");
            // 100 ms more, and some hundredths until the smoothed velocity says that it stands.
            master.wait_ms(200);
            master.is_in(state);
            assert!(master.true_speed().abs() < 2000.0);
        }
    }
}

#[test]
fn a_fault_is_reacted_to() {
    // 0x605E, counts/s after 50 ms.
    for (option, speed) in [(0, 90_000.0), (1, 75_000.0), (2, 50_000.0), (3, 0.0)] {
        let mut bus = bus();
        let mut master = running(&mut bus);
        master.write(0x605E, 0, option);
        // Position wrapped: a fault with which the motor can be controlled.
        master.write(0x2410, 11, 1);
        master.wait_ms(5);
        let position = i64::from(i32::MAX) - 10_000;
        master.write(0x6064, 0, position);
        let mut codes = Vec::new();
        while codes.is_empty() {
            codes = master.wait_ms(1);
        }
        assert_eq!(codes, [0x73A0]);
        master.wait_ms(2);
        let state = master.status().state();
        if option == 0 {
            assert_eq!(state, Some(State::Fault));
        } else {
            assert_eq!(state, Some(State::FaultReactionActive), "{option}");
        }
        master.wait_ms(48);
        let seen = master.true_speed();
        assert!((seen - speed).abs() < 12_000.0, "{option}: {seen}");
        master.wait_ms(250);
        master.is_in(State::Fault);
    }
}

#[test]
fn over_voltage_lets_the_motor_go_at_once() {
    let mut bus = bus();
    let mut master = running(&mut bus);
    master.write(0x2384, 6, 500);
    master.set_supply_v(52.0);
    // It must last 450 ms.
    let codes = master.wait_ms(480);
    assert_eq!(codes, [0x3210]);
    master.is_in(State::Fault);
    assert!(master.true_speed() > 80_000.0, "not braked");
}

#[test]
fn a_lost_master_is_reacted_to() {
    for (option, state) in [
        (0, State::OperationEnabled),
        (1, State::Fault),
        (2, State::SwitchOnDisabled),
        (3, State::QuickStopActive),
    ] {
        let mut bus = bus();
        let mut master = running(&mut bus);
        master.write(0x6007, 0, option);
        master.write(0x605A, 0, 6);
        // Node 100 is to be heard every 50 ms.
        master.write(0x1016, 1, (100 << 16) | 50);
        for _ in 0..5 {
            master.send(0x764, &[5]);
            assert_eq!(master.wait_ms(40), [0u16; 0]);
        }
        master.is_in(State::OperationEnabled);
        assert_eq!(master.wait_ms(30), [0x8130], "{option}");
        master.wait_ms(200);
        master.is_in(state);
        let speed = master.true_speed();
        match option {
            0 => assert!((speed - 100_000.0).abs() < 2000.0, "{speed}"),
            2 => assert!(speed > 10_000.0, "{speed}"),
            _ => assert!(speed.abs() < 2000.0, "{option}: {speed}"),
        }
        assert_eq!(master.read(0x603F, 0), 0x8130, "{option}");
        // Back, and on.
        for _ in 0..3 {
            master.send(0x764, &[5]);
            master.wait_ms(40);
        }
        if option == 1 {
            // The fault stays until it is reset.
            master.is_in(State::Fault);
            assert_eq!(master.read(0x603F, 0), 0x8130);
            master.write(0x6040, 0, 0x80);
            master.is_in(State::SwitchOnDisabled);
        }
        assert_eq!(master.read(0x603F, 0), 0, "{option}");
    }
}

#[test]
fn limited_jerk_takes_its_time() {
    let mut bus = bus();
    let mut master = Master::new(&mut bus);
    for refused in [-1, 1, 2, 4] {
        let error = master
            .try_write(0x6086, 0, refused)
            .expect_err("no such type");
        assert!(error.to_string().contains("06090030"), "{error}");
    }
    assert_eq!(master.read(0x6086, 0), 0);
    master.write(0x6060, 0, 1);
    // 100,000 counts/s, 1,000,000 counts/s², 10,000,000 counts/s³.
    master.write(0x6081, 0, 100_000);
    master.write(0x6083, 0, 1_000_000);
    master.write(0x6084, 0, 1_000_000);
    master.write(0x60A4, 1, 10_000_000);
    master.enable();
    let start = master.read(0x6064, 0);
    for (profile_type, target, ms) in [
        (0, start + 40_000, 500), // L/v + v/a
        (3, start, 600),          // and a/j
    ] {
        master.write(0x6086, 0, profile_type);
        master.write(0x607A, 0, target);
        master.write(0x6040, 0, RUN);
        master.write(0x6040, 0, RUN | 0x10);
        master.wait_ms(ms / 2);
        let speed = master.true_speed().abs();
        assert!((speed - 100_000.0).abs() < 2000.0, "{speed}");
        master.wait_ms(ms / 2 - 30);
        assert_ne!(master.read(0x60FC, 0), target);
        master.wait_ms(35);
        assert_eq!(master.read(0x60FC, 0), target);
        master.wait_ms(100);
        assert!(master.status().target_reached());
    }
}
