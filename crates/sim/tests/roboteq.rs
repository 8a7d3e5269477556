//! Roboteq controllers of one to three channels, on a simulated bus and simulated motors.

mod master;

use master::{Master, id};
use personalities::Personality;
use personalities::roboteq::{ROBOTEQ, ROBOTEQ_2, ROBOTEQ_3};
use sim::DriveSettings;

const FSA: (u16, u8) = (0x30F1, 0);
const REACHED: u16 = 0x400;

fn controller(personality: &'static Personality) -> Master {
    Master::with(vec![DriveSettings::new(id(1), personality)])
}

/// With the state machine active.
fn with_machine(personality: &'static Personality) -> Master {
    let mut master = controller(personality);
    master.write(1, FSA.0, FSA.1, &[1]);
    master.run_ms(5);
    master
}

/// Index of channel 1, 2 or 3.
fn window(channel: u8, index: u16) -> u16 {
    index + 0x800 * u16::from(channel - 1)
}

trait Channel {
    fn word(&mut self, channel: u8, word: u16);
    fn status_of(&mut self, channel: u8) -> u16;
    fn mode(&mut self, channel: u8, mode: i8);
    fn enable_channel(&mut self, channel: u8, mode: i8);
    fn rpm(&mut self, channel: u8) -> f64;
}

impl Channel for Master {
    fn word(&mut self, channel: u8, word: u16) {
        self.write_u16(1, window(channel, 0x6040), 0, word);
    }

    fn status_of(&mut self, channel: u8) -> u16 {
        self.read(1, window(channel, 0x6041), 0) as u16
    }

    #[track_caller]
    fn mode(&mut self, channel: u8, mode: i8) {
        self.write(1, window(channel, 0x6060), 0, &[mode as u8]);
    }

    #[track_caller]
    fn enable_channel(&mut self, channel: u8, mode: i8) {
        self.mode(channel, mode);
        for word in [6, 7, 15] {
            self.word(channel, word);
        }
        assert_eq!(self.status_of(channel) & 0x6F, 0x27);
    }

    /// The shaft's true speed.
    fn rpm(&mut self, channel: u8) -> f64 {
        let plant = &self.drive(1).worlds()[usize::from(channel - 1)];
        f64::from(plant.truth().speed_rad_s) * 60.0 / core::f64::consts::TAU
    }
}

#[track_caller]
fn near(value: f64, wanted: f64, tolerance: f64) {
    assert!((value - wanted).abs() <= tolerance, "{value}, not {wanted}");
}

#[test]
fn without_the_state_machine_the_controlword_does_nothing_and_the_statusword_is_0() {
    let mut master = controller(&ROBOTEQ);
    for word in [0x00, 0x06, 0x07, 0x0F, 0x80] {
        master.word(1, word);
        master.run_ms(2);
        assert_eq!(master.status_of(1), 0);
    }
    // R24: it is driven all the same. Open loop at first: half the voltage is half the speed without
    // load, 24 V/√3 over the EMF.
    master.write_i32(1, 0x2000, 1, 500);
    master.run_ms(3000);
    near(master.rpm(1), 2145.0, 60.0);
    near(f64::from(master.read_i16(1, 0x2102, 1)), 500.0, 5.0);
}

#[test]
fn without_the_state_machine_speed_and_position_commands_act_at_once() {
    let mut master = controller(&ROBOTEQ);
    master.mode(1, 3);
    master.write_i32(1, 0x60FF, 0, 600);
    master.run_ms(1500);
    near(master.rpm(1), 600.0, 12.0);
    // S of the controller's own commands is the same variable.
    master.write_i32(1, 0x2002, 1, -600);
    master.run_ms(2000);
    near(master.rpm(1), -600.0, 12.0);
    assert_eq!(master.read(1, 0x60FF, 0), -600);
    assert_eq!(master.read_i16(1, 0x6042, 0), -600);
    master.write_i32(1, 0x60FF, 0, 0);
    master.run_ms(1500);
    master.mode(1, 1);
    let there = master.position(1) + 20_000;
    master.write_i32(1, 0x607A, 0, there);
    master.run_ms(3000);
    near(f64::from(master.position(1)), f64::from(there), 20.0);
    // And another one after it.
    master.write_i32(1, 0x607A, 0, there - 5000);
    master.run_ms(2000);
    near(f64::from(master.position(1)), f64::from(there - 5000), 20.0);
    master.mode(1, 2);
    master.write_i16(1, 0x6042, 0, 300);
    master.run_ms(1500);
    near(master.rpm(1), 300.0, 8.0);
}

#[test]
fn the_mode_at_the_start_is_configured_and_kept() {
    let mut master = controller(&ROBOTEQ);
    assert_eq!(master.read(1, 0x6061, 0) as u8, 0);
    master.write(1, 0x3027, 1, &[1]);
    master.write(1, FSA.0, FSA.1, &[1]);
    master.write_i32(1, 0x3033, 1, 5000);
    // %EESAV
    master.write(1, 0x2017, 0, &[1]);
    master.run_ms(500);
    master.send(0, &[0x81, 1]);
    master.run_ms(200);
    assert_eq!(master.status_of(1), 0x0250);
    assert_eq!(master.read(1, 0x6061, 0) as u8, 3);
    assert_eq!(master.read(1, 0x6060, 0) as u8, 3);
    assert_eq!(master.read(1, 0x6083, 0), 5000);
    assert_eq!(master.read(1, 0x6048, 1), 5000);
    assert_eq!(master.read(1, 0x6084, 0), 20_000);
}

/// R19: every state's statusword.
#[test]
fn statuswords_of_all_states() {
    let mut master = with_machine(&ROBOTEQ);
    assert_eq!(master.status_of(1), 0x0250);
    master.mode(1, 3);
    for (word, status) in [
        (0x06, 0x0231),
        (0x07, 0x0233),
        (0x06, 0x0231),
        (0x07, 0x0233),
    ] {
        master.word(1, word);
        assert_eq!(
            master.status_of(1) & !(REACHED | 0x1000),
            status,
            "{word:04X}"
        );
    }
    master.word(1, 0x0F);
    assert_eq!(master.status_of(1) & !(REACHED | 0x1000), 0x0237);
    master.write_i32(1, 0x60FF, 0, 1000);
    master.run_ms(1500);
    master.word(1, 0x02);
    assert_eq!(master.status_of(1) & !REACHED, 0x0217);
    // R3: no way back into operation; at rest switch on disabled follows.
    master.word(1, 0x0F);
    assert_eq!(master.status_of(1) & !REACHED, 0x0217);
    master.run_ms(2000);
    assert_eq!(master.status_of(1), 0x0250);
    // A fault: the emergency stop. It frees the motor, or brakes it, and stays until it is reset.
    for word in [6, 7, 15] {
        master.word(1, word);
    }
    master.write(1, 0x200C, 0, &[1]);
    master.run_ms(10);
    assert_eq!(master.status_of(1), 0x0218);
    assert_eq!(master.read(1, 0x2112, 0) as u16, 0x10);
    master.word(1, 0x80);
    master.run_ms(5);
    assert_eq!(master.status_of(1), 0x0218, "its cause is there");
    master.write(1, 0x200D, 0, &[1]);
    master.word(1, 0x00);
    master.word(1, 0x80);
    // R4: the reset leads to switch on disabled.
    assert_eq!(master.status_of(1), 0x0250);
}

#[test]
fn halt_and_quick_stop_are_on_the_fault_deceleration() {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x30F0, 1, 5000); // 500 RPM/s
    master.write_i32(1, 0x6083, 0, 50_000);
    master.write_i32(1, 0x6084, 0, 50_000);
    master.enable_channel(1, 3);
    master.write_i32(1, 0x60FF, 0, 1000);
    master.run_ms(800);
    near(master.rpm(1), 1000.0, 20.0);
    master.word(1, 0x10F);
    master.run_ms(1000);
    near(master.rpm(1), 500.0, 15.0);
    assert_eq!(master.status_of(1) & REACHED, 0);
    master.run_ms(1200);
    near(master.rpm(1), 0.0, 3.0);
    assert_ne!(master.status_of(1) & REACHED, 0);
    master.word(1, 0x0F);
    master.run_ms(800);
    near(master.rpm(1), 1000.0, 20.0);
    master.word(1, 0x02);
    master.run_ms(1000);
    near(master.rpm(1), 500.0, 15.0);
}

#[test]
fn velocity_mode_has_its_ramp_bits_limits_and_fault_deceleration() {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x30F0, 1, 2500); // 250 RPM/s
    master.write_i32(1, 0x6046, 1, 100);
    master.write_i32(1, 0x6046, 2, 800);
    master.write_i32(1, 0x6048, 1, 10_000); // 1000 RPM in 2 s
    master.write_u16(1, 0x6048, 2, 2);
    master.enable_channel(1, 2);
    master.word(1, 0x7F);
    master.write_i16(1, 0x6042, 0, 20);
    master.run_ms(800);
    near(master.rpm(1), 100.0, 5.0);
    master.write_i16(1, 0x6042, 0, 2000);
    master.run_ms(700);
    near(master.rpm(1), 450.0, 15.0);
    near(f64::from(master.read_i16(1, 0x6043, 0)), 450.0, 10.0);
    // Bit 5: locked.
    master.word(1, 0x5F);
    let locked = master.rpm(1);
    master.run_ms(500);
    near(master.rpm(1), locked, 8.0);
    master.word(1, 0x7F);
    master.run_ms(1500);
    near(master.rpm(1), 800.0, 15.0);
    near(f64::from(master.read_i16(1, 0x6044, 0)), 800.0, 15.0);
    assert_ne!(master.status_of(1) & REACHED, 0);
    // Bit 4: to rest on EDEC.
    master.word(1, 0x6F);
    master.run_ms(1000);
    near(master.rpm(1), 550.0, 15.0);
    // Bit 6: to rest on SDC.
    master.word(1, 0x7F);
    master.run_ms(1500);
    master.word(1, 0x3F);
    master.run_ms(600);
    near(master.rpm(1), 0.0, 5.0);
}

#[test]
fn torque_is_in_tenths_of_an_ampere() {
    let mut master = with_machine(&ROBOTEQ);
    master.drive(1).plant().set_blocked(true);
    master.enable_channel(1, 4);
    master.write_i32(1, 0x6087, 0, 100_000); // 10 A/s
    master.write_i16(1, 0x6071, 0, 10);
    master.run_ms(300);
    near(f64::from(master.read_i16(1, 0x6077, 0)), 10.0, 1.0);
    near(f64::from(master.read_i16(1, 0x2100, 1)), 10.0, 1.0);
    let torque = f64::from(master.drive(1).plant().truth().torque_nm);
    near(torque, 0.0462, 2e-3);
    // The slope: 1 A more in 0.1 s.
    master.write_i16(1, 0x6071, 0, 20);
    master.run_ms(50);
    near(f64::from(master.read_i16(1, 0x6077, 0)), 15.0, 1.0);
    // ALIM: 3 A. The statusword says so.
    master.write_i16(1, 0x6071, 0, 3000);
    master.run_ms(400);
    near(f64::from(master.read_i16(1, 0x6077, 0)), 30.0, 1.0);
    assert_ne!(master.status_of(1) & 0x800, 0);
}

#[test]
fn positions_of_the_relative_and_tracking_modes_are_scaled() {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x30F2, 1, -10_000);
    master.write_i32(1, 0x30F3, 1, 30_000);
    master.enable_channel(1, -1);
    assert_eq!(master.read(1, 0x6061, 0) as i8, -1);
    assert_eq!(master.read(1, 0x6064, 0), -500);
    master.write_i32(1, 0x607A, 0, 250); // 15,000 counts
    master.word(1, 0x1F);
    assert_ne!(master.status_of(1) & 0x1000, 0, "acknowledged");
    master.word(1, 0x0F);
    assert_eq!(master.status_of(1) & 0x1000, 0);
    master.run_ms(2500);
    assert_eq!(master.read(1, 0x6064, 0), 250);
    assert_eq!(master.read(1, 0x2110, 1), 250);
    near(f64::from(master.read(1, 0x2104, 1)), 15_000.0, 20.0);
    assert_ne!(master.status_of(1) & REACHED, 0);
    for beyond in [1001, -1001] {
        assert!(
            master
                .try_write(1, 0x607A, 0, &i32::to_le_bytes(beyond))
                .is_err()
        );
    }
    // Tracking: no profile, as fast as the controllers can.
    master.mode(1, -2);
    master.write_i32(1, 0x607A, 0, -250); // 5,000 counts
    master.run_ms(10);
    assert_eq!(master.status_of(1) & REACHED, 0);
    master.run_ms(1500);
    near(f64::from(master.read(1, 0x2104, 1)), 5000.0, 20.0);
    assert_eq!(master.read(1, 0x6064, 0), -250);
    assert_ne!(master.status_of(1) & REACHED, 0);
    // Count position has counts again.
    master.mode(1, 1);
    near(f64::from(master.read(1, 0x6064, 0)), 5000.0, 20.0);
}

#[test]
fn a_held_shaft_makes_up_for_what_it_lost_where_the_position_is_the_feedback() {
    // -3 goes on from where it should be, 3 from where it is.
    let travelled = |mode: i8| {
        let mut master = with_machine(&ROBOTEQ);
        master.write(1, 0x3038, 1, &[0]); // or the loop error stops it
        master.enable_channel(1, mode);
        let from = master.drive(1).plant().truth().position_turns();
        master.write_i32(1, 0x60FF, 0, 600);
        master.run_ms(1000);
        master.drive(1).plant().set_blocked(true);
        master.run_ms(300);
        master.drive(1).plant().set_blocked(false);
        master.run_ms(2700);
        near(master.rpm(1), 600.0, 15.0);
        master.drive(1).plant().truth().position_turns() - from
    };
    let (by_position, by_speed) = (travelled(-3), travelled(3));
    // 4 s at 10 turns/s, less the ramp of 0.3 s.
    near(by_position, 38.5, 0.5);
    assert!(by_position - by_speed > 2.0, "{by_speed}");
}

#[test]
fn open_loop_runs_with_the_state_machine_in_operation_enabled_only() {
    let mut master = with_machine(&ROBOTEQ);
    master.write_i32(1, 0x2000, 1, 300);
    master.run_ms(500);
    near(master.rpm(1), 0.0, 1.0);
    master.enable_channel(1, 0);
    master.run_ms(2000);
    near(master.rpm(1), 1290.0, 60.0);
    // Halt takes the voltage back on EDEC, disabling frees the motor.
    master.word(1, 0x10F);
    master.run_ms(3000);
    near(master.rpm(1), 0.0, 10.0);
    master.word(1, 0x0F);
    master.run_ms(2000);
    near(master.rpm(1), 1290.0, 60.0);
    master.word(1, 0x00);
    master.run_ms(2);
    assert_eq!(master.read_i16(1, 0x2102, 1), 0);
    for beyond in [1001, -1001] {
        assert!(
            master
                .try_write(1, 0x2000, 1, &i32::to_le_bytes(beyond))
                .is_err()
        );
    }
}

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
