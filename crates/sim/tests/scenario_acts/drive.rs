//! Acts upon supplies, shaft, wires, processor, memory and the bus.

use crate::bench::*;
use sim::VirtualDrive;

fn bus_v(drive: &mut VirtualDrive) -> f32 {
    drive.plant().truth().bus_voltage_v
}

#[test]
fn the_motor_supply_sags_is_cut_and_comes_back() {
    let mut master = event("motor-supply", "to = \"10 V\"");
    assert_eq!(looks(&mut master, bus_v), [48.0, 10.0, 48.0]);
    let mut master = event("cut-motor-supply", "");
    assert_eq!(looks(&mut master, bus_v), [48.0, 0.0, 48.0]);
    // What it comes back to is what the scenario says that it is.
    let mut master = play(
        "[drive.1.supply]\nmotor_voltage = \"30 V\"\n[[event]]\nat = \"100 ms\"\n\
         do = \"motor-supply\"\ndrive = 1\nto = \"10 V\"\n[[event]]\nat = \"300 ms\"\n\
         do = \"restore-motor-supply\"\ndrive = \"all\"\n",
    );
    assert_eq!(looks(&mut master, bus_v), [30.0, 10.0, 30.0]);
    assert_eq!(bus_v(master.drive(2)), 48.0);
}

#[test]
fn a_sag_is_a_fault_of_the_drive() {
    let mut master = play(
        "[[event]]\nname = \"sag\"\nwhen = { state = \"operation enabled\" }\ndelay = \"20 ms\"\n\
         do = \"motor-supply\"\ndrive = 1\nto = \"10 V\"\nfor = \"600 ms\"\n",
    );
    master.enable(1, 3);
    master.run_ms(700);
    assert_eq!(master.emergency_codes(1), [0x3220]);
    assert_eq!(master.state(1), FAULT);
    assert_eq!(bus_v(master.drive(1)), 48.0);
}

#[test]
fn without_its_logic_supply_a_drive_is_silent_and_boots_when_it_returns() {
    for (act, arguments) in [("cut-logic-supply", ""), ("logic-supply", "to = \"5 V\"")] {
        let mut master = event(act, arguments);
        let is_on = looks(&mut master, |drive| drive.core().is_some());
        assert_eq!(is_on, [true, false, true], "{act}");
        let boots: Vec<u64> = master
            .log
            .iter()
            .filter(|t| t.frame.raw_id() == 0x701)
            .map(|t| t.at.0 / 1_000_000)
            .collect();
        assert!(matches!(boots[..], [320..=325]), "{boots:?}");
    }
}

#[test]
fn a_blocked_shaft_stands_still() {
    let mut master =
        play("[[event]]\nat = \"200 ms\"\ndo = \"block-shaft\"\ndrive = 1\nfor = \"100 ms\"\n");
    master.enable(1, 3);
    master.write_i32(1, 0x60FF, 0, 20_000);
    let mut speeds = [199, 250, 400].map(|ms| {
        let now_ms = master.now().0 / 1_000_000;
        master.run_ms(ms - now_ms);
        master.drive(1).plant().truth().speed_rad_s
    });
    assert!(
        speeds[0] > 25.0 && speeds[1] == 0.0 && speeds[2] > 25.0,
        "{speeds:?}"
    );
    speeds.reverse();
}

/// The motor is off, so a torque of the load accelerates the shaft: 1 mNm for 100 ms.
#[test]
fn the_load_pulls_and_its_inertia_and_friction_count() {
    let speed = |drive: &mut VirtualDrive| drive.plant().truth().speed_rad_s;
    let mut master = event("load-torque", "to = \"-1 mNm\"");
    let [before, free, after] = looks(&mut master, speed);
    // 1 mNm / 4.45 g cm² less 2 % of friction, for 100 ms.
    assert!(before == 0.0 && (200.0..225.0).contains(&free), "{free}");
    assert!(after > free);
    let pulled = "[[event]]\nat = \"100 ms\"\ndo = \"load-torque\"\ndrive = 1\nto = \"-1 mNm\"\n";
    let mut master = play(&format!(
        "{pulled}[[event]]\nat = \"50 ms\"\ndo = \"load-inertia\"\ndrive = 1\nto = \"4.45 g cm2\"\n"
    ));
    let [_, heavy, _] = looks(&mut master, speed);
    assert!((heavy / free - 0.5).abs() < 0.02, "{heavy} {free}");
    let mut master = play(&format!(
        "{pulled}[[event]]\nat = \"50 ms\"\ndo = \"load-friction\"\ndrive = 1\nto = \"0.5 mNm\"\n\
         viscous = \"1 nNm s/rad\"\n"
    ).replace("1 nNm", "0.001 uNm"));
    let [_, rubbing, _] = looks(&mut master, speed);
    assert!((0.45..0.55).contains(&(rubbing / free)), "{rubbing} {free}");
    // And both go away again.
    let mut master = play(
        "[[event]]\nat = \"100 ms\"\ndo = \"load-inertia\"\ndrive = 1\nto = \"1 kg cm2\"\n\
         for = \"100 ms\"\n[[event]]\nat = \"100 ms\"\ndo = \"load-friction\"\ndrive = 1\n\
         to = \"1 mNm\"\nfor = \"100 ms\"\n",
    );
    master.run_ms(100);
    assert_eq!(master.drive(1).plant().parameters().load.inertia_kgm2, 1e-4);
    assert_eq!(
        master
            .drive(1)
            .plant()
            .parameters()
            .load
            .coulomb_friction_nm,
        1e-3
    );
    master.run_ms(100);
    let made = master.drive(1).made().load;
    assert_eq!(master.drive(1).plant().parameters().load, made);
    // Without torque, it is.
    let mut master = event("load-torque", "to = \"-1 mNm\"");
    master.run_ms(260);
    let at_310 = master.drive(1).plant().truth().speed_rad_s;
    master.run_ms(100);
    assert!(master.drive(1).plant().truth().speed_rad_s < at_310);
}

#[test]
fn heat_is_seen_by_the_sensors_and_goes_away_slowly() {
    let amplifier = |drive: &mut VirtualDrive| drive.plant().sample().temperature_adc;
    let mut master = event("heat-amplifier", "to = \"90 degC\"");
    let [before, hot, after] = looks(&mut master, amplifier);
    // 0.05 K a count from -50 °C; it has cooled a little.
    assert!(
        (before - 1500.0).abs() <= 1.0 && (2785.0..=2800.0).contains(&hot),
        "{hot}"
    );
    assert!((after - 1500.0).abs() <= 1.0);
    let motor = |drive: &mut VirtualDrive| drive.plant().signals().motor_temperature_adc;
    let mut master = event("heat-motor", "to = \"100 degC\"");
    let [before, hot, after] = looks(&mut master, motor);
    // 0.075 K a count from -50 °C.
    assert!(
        (before - 1000.0).abs() <= 1.0 && (1980.0..=2000.0).contains(&hot),
        "{hot}"
    );
    assert!((after - 1000.0).abs() <= 1.0);
    // Surroundings warm the amplifier, with a time constant of 60 s.
    let mut master = play(
        "[[event]]\nat = \"100 ms\"\ndo = \"heat-surroundings\"\ndrive = 1\nto = \"85 degC\"\n\
         for = \"6 s\"\n",
    );
    let before = amplifier(master.drive(1));
    // It warms itself by 6 K, too, and so it is done when the surroundings are as before.
    master.run_ms(6050);
    let warm = (amplifier(master.drive(1)) - before) * 0.05;
    assert!(
        (66.0 * (1.0 - (-0.1_f32).exp()) - warm).abs() < 0.2,
        "{warm}"
    );
    master.run_ms(3000);
    assert!(((amplifier(master.drive(1)) - before) * 0.05 - warm).abs() < 0.2);
}

#[test]
fn a_phase_that_is_open_carries_nothing() {
    let mut master = event("open-phase", "phase = \"B\"");
    master.enable(1, 4);
    master.drive(1).plant().set_blocked(true);
    master.write_i16(1, 0x6071, 0, 500);
    let current = |drive: &mut VirtualDrive| drive.plant().truth().phase_current_a[1].abs();
    let [before, open, after] = looks(&mut master, current);
    assert!(
        before > 0.02 && open == 0.0 && after > 0.02,
        "{before} {open} {after}"
    );
}

#[test]
fn a_short_circuit_trips_the_gate_drivers() {
    for between in ["A-B", "B-C", "A-C", "A-ground", "B-supply"] {
        let mut master = play(&format!(
            "[[event]]\nat = \"500 ms\"\ndo = \"short-circuit\"\ndrive = 1\n\
             between = \"{between}\"\nfor = \"50 ms\"\n"
        ));
        master.enable(1, 3);
        // Between two phases a current flows only while their duties differ, and a pulse below the
        // blanking time of 1 µs is not seen: so it must turn fast.
        master.write_i32(1, 0x60FF, 0, 500_000);
        let now_ms = master.now().0 / 1_000_000;
        master.run_ms(499 - now_ms);
        assert!(master.emergencies(1).is_empty());
        let speed = master.drive(1).plant().truth().speed_rad_s;
        assert!(speed > 300.0, "{speed}");
        master.run_ms(100);
        assert_eq!(master.emergency_codes(1), [0x2320], "{between}");
        assert_eq!(master.state(1), FAULT);
    }
}

#[test]
fn a_stalled_processor_loses_frames() {
    let mut master = event("stall-processor", "");
    for node in [1, 2] {
        master.write(node, 0x2404, 0, &[1]);
    }
    let now_ms = master.now().0 / 1_000_000;
    master.run_ms(110 - now_ms);
    for _ in 0..40 {
        master.send(0x080, &[]);
    }
    master.run_ms(20);
    master.run_ms(200);
    assert_eq!(master.emergency_codes(1), [0x8110], "CAN overrun");
    assert!(master.emergencies(2).is_empty());
}

#[test]
fn the_watchdog_resets_a_processor_that_hangs() {
    let mut master = event("hang-processor", "");
    master.run_ms(60);
    assert_eq!(master.try_read(2, 0x6041, 0).map(|_| ()), Ok(()));
    master.run_ms(60);
    let ids: Vec<u32> = master.log.iter().map(|t| t.frame.raw_id()).collect();
    assert!(ids.contains(&0x701), "{ids:X?}");
    assert_eq!(master.emergency_codes(1), [0x6010], "watchdog");
}

/// What is told has happened.
#[test]
fn a_processor_that_does_not_work_is_neither_stalled_nor_made_to_hang() {
    let event =
        |ms: u64, act: &str| format!("[[event]]\nat = \"{ms} ms\"\ndo = \"{act}\"\ndrive = 1\n");
    let stall = "stall-processor\"\nfor = \"5 ms";
    let text = [
        event(1, "hang-processor"),
        event(100, "hang-processor"),
        event(110, "hang-processor"),
        event(111, stall),
        // The watchdog has bitten at 120 ms.
        event(125, stall),
        event(200, "cut-logic-supply"),
        event(200, "hang-processor"),
        event(210, stall),
        event(220, "restore-logic-supply"),
        event(300, stall),
        event(301, "hang-processor"),
    ];
    let mut master = play(&text.concat());
    master.run_ms(300);
    let notices = master.bus.take_notices();
    let told: Vec<String> = notices.iter().map(ToString::to_string).collect();
    let expected = [
        "processor of node 1 is not made to hang: it boots",
        "processor of node 1 hangs",
        "processor of node 1 is not made to hang: it hangs already",
        "processor of node 1 is not stalled: it hangs already",
        "processor of node 1 is not stalled: it boots",
        "logic supply of node 1 to 0 V",
        "processor of node 1 is not made to hang: it has no supply",
        "processor of node 1 is not stalled: it has no supply",
        "logic supply of node 1 to 24 V",
        "processor of node 1 stalled for 5 ms",
        "processor of node 1 hangs",
    ];
    assert_eq!(told.len(), expected.len(), "{told:#?}");
    for (told, expected) in told.iter().zip(expected) {
        assert!(told.ends_with(expected), "{told}");
    }
}

/// A shorter stall in a longer one does not end it, and a reset does.
#[test]
fn a_stall_lasts_on_but_not_over_a_reset() {
    let stall = |ms: u64, for_ms: u64| {
        format!(
            "[[event]]\nat = \"{ms} ms\"\ndo = \"stall-processor\"\ndrive = 1\n\
             for = \"{for_ms} ms\"\n"
        )
    };
    let mut master = play(&[stall(60, 100), stall(70, 10)].concat());
    master.run_ms(40);
    assert_eq!(master.try_read_within(1, 0x6041, 0, 69), None);
    assert!(master.try_read_within(1, 0x6041, 0, 3).is_some());
    for (reset, ms) in [("hang-processor", 80), ("cut-logic-supply", 60)] {
        let reset = match reset {
            "cut-logic-supply" => "cut-logic-supply\"\nfor = \"5 ms",
            other => other,
        };
        let reset = format!("[[event]]\nat = \"60 ms\"\ndo = \"{reset}\"\ndrive = 1\n");
        let mut master = play(&[stall(55, 1000), reset].concat());
        master.run_ms(ms);
        assert!(master.try_read_within(1, 0x6041, 0, 5).is_some());
    }
}

const STORED: &str = "[drive.1.stored]\n\"0x6065\" = 1234\n";

#[test]
fn spoiled_parameters_are_noticed_at_the_next_start() {
    // One set: nothing is left but the defaults.
    let mut master = play(&format!(
        "{STORED}[[event]]\nat = \"100 ms\"\ndo = \"spoil-store\"\ndrive = 1\nbytes = 3\n"
    ));
    assert_eq!(master.read(1, 0x6065, 0), 1234);
    master.run_ms(60);
    assert_eq!(master.read(1, 0x6065, 0), 1234, "not before the next start");
    master.log.clear();
    master.send(0x000, &[0x81, 1]);
    master.run_ms(60);
    assert_eq!(master.emergency_codes(1), [0x6320], "parameter error");
    assert_ne!(master.read(1, 0x6065, 0), 1234);
    // Two sets: the newest is lost, and the one before is there; both, and it is the defaults.
    for (sets, expected) in [("newest", Some(1234)), ("both", None)] {
        let mut master = play(&format!(
            "{STORED}[[event]]\nat = \"200 ms\"\ndo = \"spoil-store\"\ndrive = 1\n\
             sets = \"{sets}\"\n"
        ));
        master.write_i32(1, 0x6065, 0, 999);
        master.write(1, 0x1010, 1, &SAVE);
        master.run_ms(200);
        master.log.clear();
        master.send(0x000, &[0x81, 1]);
        master.run_ms(60);
        let value = master.read(1, 0x6065, 0);
        match expected {
            Some(expected) => assert_eq!(value, expected),
            None => assert!(value != 999 && value != 1234, "{value}"),
        }
    }
    // Nothing is stored, and that is said.
    let mut master = event("spoil-store", "");
    master.run_ms(60);
    let told = master.bus.take_notices().pop().unwrap().to_string();
    assert!(told.contains("nothing is stored in node 1"), "{told}");
}

#[test]
fn a_power_cut_in_a_save_leaves_the_set_before() {
    let mut master = play(&format!(
        "{STORED}[[event]]\nat = \"60 ms\"\ndo = \"cut-power-in-save\"\ndrive = 1\nsteps = 40\n"
    ));
    master.run_ms(20);
    master.write_i32(1, 0x6065, 0, 999);
    master.log.clear();
    master.send(0x601, &[0x22, 0x10, 0x10, 1, b's', b'a', b'v', b'e']);
    master.run_ms(60);
    let ids: Vec<u32> = master.log.iter().map(|t| t.frame.raw_id()).collect();
    assert!(!ids.contains(&0x581), "no acknowledge: {ids:X?}");
    assert!(ids.contains(&0x701), "{ids:X?}");
    assert_eq!(master.read(1, 0x6065, 0), 1234);
    // The next save succeeds.
    master.write_i32(1, 0x6065, 0, 999);
    master.write(1, 0x1010, 1, &SAVE);
    master.send(0x000, &[0x81, 1]);
    master.run_ms(60);
    assert_eq!(master.read(1, 0x6065, 0), 999);
}

#[test]
fn sync_is_held_back_and_let_pass() {
    let mut master = play("[[event]]\nat = \"100 ms\"\ndo = \"stop-sync\"\nfor = \"200 ms\"\n");
    let mut passed = |until_ms: u64| {
        master.log.clear();
        while master.now().0 < until_ms * 1_000_000 {
            master.send(0x080, &[]);
            master.send(0x123, &[1]);
            master.run_ms(10);
        }
        let count = |id| master.log.iter().filter(|t| t.frame.raw_id() == id).count();
        (count(0x080), count(0x123))
    };
    assert_eq!(passed(100), (5, 5));
    assert_eq!(passed(300), (0, 20));
    assert_eq!(passed(350), (5, 5));
}
