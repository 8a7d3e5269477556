//! Several channels, and what they share: PDOs, commands, modes, scenarios.

use personalities::roboteq::{ROBOTEQ, ROBOTEQ_2, ROBOTEQ_3};
use sim::DriveSettings;

use crate::bench::{Channel, REACHED, controller, near, with_machine};
use crate::master::{Master, id};

#[test]
fn three_channels_have_their_own_machines_modes_motors_and_loads() {
    let mut master = with_machine(&ROBOTEQ_3);
    for channel in 1..=3 {
        assert_eq!(master.status_of(channel), 0x0250);
    }
    master.enable_channel(1, 3);
    master.enable_channel(2, 1);
    assert_eq!(master.status_of(3), 0x0250);
    master.write_i32(1, 0x60FF, 0, 500);
    master.write_i32(1, 0x687A, 0, 8192);
    master.word(2, 0x1F);
    master.run_ms(2000);
    near(master.rpm(1), 500.0, 12.0);
    near(f64::from(master.read(1, 0x6864, 0)), 8192.0, 20.0);
    near(master.rpm(3), 0.0, 0.1);
    assert_eq!(master.read(1, 0x7064, 0), 0);
    // A load on one shaft is on no other.
    master.drive(1).plants()[2].set_blocked(true);
    master.enable_channel(3, 4);
    master.write_i16(1, 0x7071, 0, 5);
    master.run_ms(500);
    near(f64::from(master.read_i16(1, 0x7077, 0)), 5.0, 1.0);
    near(master.rpm(1), 500.0, 12.0);
    // The loop error of one stops that one (^CLERD 2: 500 ms beyond 250 of MXRPM's 1000).
    master.write_i32(1, 0x60FF, 0, 1000);
    master.run_ms(500);
    master.drive(1).plants()[0].set_blocked(true);
    master.run_ms(900);
    assert_eq!(master.status_of(1), 0x0218);
    assert_eq!(master.status_of(2) & 0x6F, 0x27);
    assert_eq!(master.status_of(3) & 0x6F, 0x27);
    assert_eq!(master.read(1, 0x1001, 0) as u8, 0x21);
    assert_eq!(master.read(1, 0x2122, 2), 0);
}

#[test]
fn windows_that_a_controller_does_not_have_are_no_objects() {
    let mut master = with_machine(&ROBOTEQ_2);
    assert!(master.try_read(1, 0x6841, 0).is_ok());
    assert_eq!(master.try_read(1, 0x7041, 0), Err(0x0602_0000));
    assert_eq!(master.try_write(1, 0x2000, 3, &[0; 4]), Err(0x0609_0011));
}

#[test]
fn bit_30_of_a_tpdo_stays_set() {
    let mut master = controller(&ROBOTEQ);
    assert_eq!(master.read(1, 0x1800, 1) as u32, 0x4000_0181);
    for cob_id in [0x181_u32, 0x8000_0181] {
        assert_eq!(
            master.try_write(1, 0x1800, 1, &cob_id.to_le_bytes()),
            Err(0x0609_0030)
        );
    }
    master.write(1, 0x1800, 1, &0xC000_0181_u32.to_le_bytes());
    master.write(1, 0x1800, 1, &0x4000_0191_u32.to_le_bytes());
    // RPDOs have no such bit.
    master.write(1, 0x1400, 1, &0x8000_0201_u32.to_le_bytes());
}

#[test]
fn user_variables_go_from_rpdo_to_tpdo() {
    let mut master = controller(&ROBOTEQ);
    master.send(0, &[1, 1]);
    master.run_ms(10);
    // Variables 9 and 10 come by RPDO 1; nothing sends them.
    master.send(0x201, &[1, 2, 3, 4, 5, 6, 7, 8]);
    master.run_ms(10);
    assert_eq!(master.read(1, 0x2106, 9), 0x0403_0201);
    assert_eq!(master.read(1, 0x2106, 10), 0x0807_0605);
    // Variable 1 is in TPDO 1, which is sent when it changes.
    master.log.clear();
    master.write_i32(1, 0x2005, 1, 77);
    master.run_ms(10);
    let sent = master.log.iter().find(|t| t.frame.raw_id() == 0x181);
    assert_eq!(
        sent.expect("TPDO 1").frame.data(),
        [77, 0, 0, 0, 0, 0, 0, 0]
    );
}

#[test]
fn bit_10_is_set_by_another_mode_and_kept_by_the_same_target() {
    let mut master = with_machine(&ROBOTEQ);
    master.enable_channel(1, 1);
    master.write_i32(1, 0x607A, 0, 4096);
    master.word(1, 0x1F);
    assert_eq!(master.status_of(1) & REACHED, 0);
    master.word(1, 0x0F);
    master.run_ms(1500);
    assert_ne!(master.status_of(1) & REACHED, 0);
    // R18: the same value again alters nothing.
    master.word(1, 0x1F);
    for _ in 0..30 {
        assert_ne!(master.status_of(1) & REACHED, 0);
        master.run_ms(1);
    }
    master.mode(1, 3);
    assert_ne!(master.status_of(1) & REACHED, 0);
    master.write_i32(1, 0x60FF, 0, 800);
    assert_eq!(master.status_of(1) & REACHED, 0);
}

#[test]
fn only_the_modes_of_table_1_are_taken_in_any_state() {
    let mut master = with_machine(&ROBOTEQ);
    for mode in i8::MIN..=i8::MAX {
        let result = master.try_write(1, 0x6060, 0, &[mode as u8]);
        match mode {
            -4..=4 => {
                assert_eq!(result, Ok(()), "{mode}");
                assert_eq!(master.read(1, 0x6061, 0) as i8, mode);
            }
            _ => assert_eq!(result, Err(0x0609_0030), "{mode}"),
        }
    }
    assert_eq!(master.read(1, 0x6502, 0), 0x0F);
    assert_eq!(master.read(1, 0x67FE, 0), 0x0004_0100);
}

#[test]
fn speeds_are_cut_to_their_types() {
    let mut master = with_machine(&ROBOTEQ);
    // R10.
    master.write_i32(1, 0x60FF, 0, 600_000);
    master.run_ms(2);
    assert_eq!(master.read(1, 0x60FF, 0), 500_000);
    assert_eq!(master.read_i16(1, 0x6042, 0), i16::MAX);
    master.write_i32(1, 0x60FF, 0, -600_000);
    master.run_ms(2);
    assert_eq!(master.read(1, 0x60FF, 0), -500_000);
    assert_eq!(master.read_i16(1, 0x6042, 0), i16::MIN);
}

/// An event, a condition and a world name the axis; without one they mean the first.
#[test]
fn a_scenario_names_the_axis() {
    use sim::scenario::Scenario;
    use sim::{Bus, BusSettings};
    let text = "
        [drive.1]
        personality = \"roboteq-2\"
        [drive.1.axis.2.load]
        inertia = \"100 gcm2\"
        [[event]]
        do = \"block-shaft\"
        drive = 1
        axis = 2
        when = { axis = 2, state = \"operation enabled\" }
        [[event]]
        do = \"motor-supply\"
        drive = 1
        to = \"20 V\"
        at = \"900 ms\"
    ";
    let scenario = Scenario::read("axes.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let drives = vec![DriveSettings::new(id(1), &ROBOTEQ_2)];
    let mut settings = BusSettings::new(7, drives);
    scenario
        .set_up(&mut settings, canopen::Instant::ZERO.plus_ms(60_000))
        .unwrap_or_else(|error| panic!("{error}"));
    let mut master = Master {
        bus: Bus::new(settings),
        log: Vec::new(),
    };
    master.run_ms(50);
    master.write_u16(1, 0x3008, 0, 0);
    let inertia = |master: &mut Master, axis: usize| {
        master.drive(1).worlds()[axis]
            .parameters()
            .load
            .inertia_kgm2
    };
    assert_eq!(inertia(&mut master, 0), 0.0);
    near(inertia(&mut master, 1), 100e-7, 1e-9);
    // With the state machine off both are in operation; the second is blocked, the first turns.
    for channel in [1, 2] {
        master.write_i32(1, 0x2000, channel, 200);
    }
    master.run_ms(700);
    assert!(master.rpm(1) > 300.0);
    near(master.rpm(2), 0.0, 1.0);
    master.run_ms(300);
    for axis in 0..2 {
        let volts = master.drive(1).worlds()[axis].truth().bus_voltage_v;
        near(f64::from(volts), 20.0, 0.01);
    }
    let wrong = text.replace("axis = 2, state", "axis = 3, state");
    let scenario = Scenario::read("axes.toml", &wrong).unwrap_or_else(|error| panic!("{error}"));
    let drives = vec![DriveSettings::new(id(1), &ROBOTEQ_2)];
    let mut settings = BusSettings::new(7, drives);
    let refused = scenario.set_up(&mut settings, canopen::Instant::ZERO.plus_ms(60_000));
    let said = refused.expect_err("no axis 3").to_string();
    assert!(said.contains("drive 1 has no axis 3"), "{said}");
}

/// The supply is all channels': each stops, there is one emergency, and the error lasts until the last
/// channel is reset.
#[test]
fn a_fault_of_the_supply_is_one_error_of_all_channels() {
    let mut master = with_machine(&ROBOTEQ_3);
    for channel in 1..=3 {
        master.enable_channel(channel, 3);
    }
    let supply = |master: &mut Master, volts: f32| {
        for plant in master.drive(1).plants() {
            plant.set_supply_v(volts);
        }
    };
    let codes = |master: &mut Master| -> Vec<u16> {
        let emergencies = master.log.iter().filter(|t| t.frame.raw_id() == 0x81);
        let codes = emergencies.map(|t| u16::from_le_bytes([t.frame.data()[0], t.frame.data()[1]]));
        let codes = codes.collect();
        master.log.clear();
        codes
    };
    master.log.clear();
    supply(&mut master, 8.0);
    master.run_ms(100);
    assert_eq!(codes(&mut master), [0x3220]);
    for channel in 1..=3 {
        assert_eq!(master.status_of(channel), 0x0218);
    }
    assert_eq!(master.read(1, 0x2112, 0) as u16, 4);
    supply(&mut master, 24.0);
    master.run_ms(100);
    for (channel, ends) in [(1, false), (2, false), (3, true)] {
        assert_eq!(master.read(1, 0x1001, 0) as u8, 0x05);
        master.word(channel, 0x00);
        master.word(channel, 0x80);
        master.run_ms(5);
        assert_eq!(master.status_of(channel), 0x0250);
        let expected: &[u16] = if ends { &[0] } else { &[] };
        assert_eq!(codes(&mut master), expected);
    }
    assert_eq!(master.read(1, 0x1001, 0) as u8, 0);
}
