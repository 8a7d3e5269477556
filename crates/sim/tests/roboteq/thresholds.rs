//! Figures that decide: by how much, for how long, with which unit; and what has no answer.

use personalities::roboteq::ROBOTEQ;
use plant::EncoderFault;

use crate::bench::{Channel, REACHED, controller, near, with_machine};
use crate::master::{Master, OPERATION_ENABLED};

fn fault_flags(master: &mut Master) -> u16 {
    master.read(1, 0x2112, 0) as u16
}

/// No SYNC producer, no identifiers of 29 bits: refused, and nothing is sent.
#[test]
fn what_it_does_not_support_is_refused() {
    let mut master = controller(&ROBOTEQ);
    for (index, sub, value) in [
        (0x1005, 0, 0x4000_0080u32),
        (0x1005, 0, 0x2000_0080),
        (0x1400, 1, 0x2000_0201),
        (0x1800, 1, 0x6000_0181),
        (0x1014, 0, 0x2000_0081),
    ] {
        let before = master.try_read(1, index, sub);
        let result = master.try_write(1, index, sub, &value.to_le_bytes());
        assert_eq!(result, Err(0x0609_0030), "{index:04X},{sub}");
        assert_eq!(master.try_read(1, index, sub), before, "{index:04X},{sub}");
    }
    master.log.clear();
    master.run_ms(100);
    let syncs = master.log.iter().filter(|t| t.frame.raw_id() == 0x80);
    assert_eq!(syncs.count(), 0);
}

/// 0x30F4,3: the greatest temperature, °C. A sensor that does not answer counts in every state.
#[test]
fn heat_and_the_encoder_are_faults_in_every_state() {
    let mut master = with_machine(&ROBOTEQ);
    assert_eq!(master.read(1, 0x30F4, 3), 85);
    master.drive(1).plant().set_amplifier_temperature_c(84.0);
    master.run_ms(200);
    assert_eq!(fault_flags(&mut master), 0);
    master.drive(1).plant().set_amplifier_temperature_c(87.0);
    master.run_ms(200);
    assert_eq!(fault_flags(&mut master), 1);
    assert_eq!(master.state(1), 0x08, "from switch on disabled");
    assert_eq!(master.emergency_codes(1), [0x4210]);

    let mut master = with_machine(&ROBOTEQ);
    master
        .drive(1)
        .plant()
        .set_encoder_fault(EncoderFault::NoAnswer);
    master.run_ms(200);
    assert_eq!(fault_flags(&mut master), 1 << 5);
    assert_eq!(master.state(1), 0x08, "from switch on disabled");
    assert_eq!(master.emergency_codes(1), [0x7305]);
}

/// ^CLERD: 1 is 250 ms beyond 100, 2 is 500 ms beyond 250, 3 is 1000 ms beyond 500, of 1000 at MXRPM; 0
/// looks for nothing.
#[test]
fn closed_loop_error_detection() {
    // MXRPM is 3000: a held shaft is off by the whole of what is wanted.
    for (detection, time_ms, limit) in [(1u8, 250, 100), (2, 500, 250), (3, 1000, 500), (0, 0, 0)] {
        for part in [limit * 9 / 10, limit * 11 / 10] {
            let mut master = with_machine(&ROBOTEQ);
            master.write(1, 0x3038, 1, &[detection]);
            master.write_i32(1, 0x6083, 0, 500_000);
            master.drive(1).plant().set_blocked(true);
            master.enable_channel(1, 3);
            master.write_i32(1, 0x60FF, 0, 3 * if detection == 0 { 900 } else { part });
            if detection == 0 || part < limit {
                master.run_ms(1500);
                assert_eq!(master.state(1), OPERATION_ENABLED, "{detection}: {part}");
                continue;
            }
            master.run_ms(time_ms - 20);
            assert_eq!(master.state(1), OPERATION_ENABLED, "{detection}: too early");
            master.run_ms(150);
            assert_ne!(master.state(1), OPERATION_ENABLED, "{detection}: too late");
            assert_eq!(master.emergency_codes(1), [0x8400], "{detection}");
        }
    }
}

/// R24: with the state machine off a fault that is over is reset after a second, by itself.
#[test]
fn without_the_state_machine_a_fault_ends_by_itself() {
    let mut master = controller(&ROBOTEQ);
    master.write(1, 0x6060, 0, &[3]);
    master.write_i32(1, 0x60FF, 0, 300);
    master.run_ms(800);
    near(master.rpm(1), 300.0, 15.0);
    let plant = master.drive(1).plant();
    plant.set_encoder_fault(EncoderFault::NoAnswer);
    master.run_ms(100);
    let plant = master.drive(1).plant();
    plant.set_encoder_fault(EncoderFault::None);
    plant.set_blocked(true);
    master.run_ms(50);
    master.drive(1).plant().set_blocked(false);
    master.run_ms(650);
    near(master.rpm(1), 0.0, 5.0);
    master.run_ms(900);
    near(master.rpm(1), 300.0, 15.0);
}

/// A tracked position counts as reached within 20 counts.
#[test]
fn a_tracked_position_is_reached_within_20_counts() {
    let mut master = with_machine(&ROBOTEQ);
    master.write(1, 0x3038, 1, &[0]);
    // A command of 1 is 20 counts.
    master.enable_channel(1, -2);
    master.write_i32(1, 0x607A, 0, 0);
    master.run_ms(500);
    assert_ne!(master.status_of(1) & REACHED, 0);
    master.drive(1).plant().set_blocked(true);
    for (command, reached) in [(3, false), (-3, false), (0, true)] {
        master.write_i32(1, 0x607A, 0, command);
        master.run_ms(20);
        assert_eq!(master.status_of(1) & REACHED != 0, reached, "{command}");
    }
}

/// 0x210C, BA: what the power stage takes from the supply, 0.1 A.
#[test]
fn battery_current_is_the_power_over_the_voltage() {
    let mut master = with_machine(&ROBOTEQ);
    master.write(1, 0x3038, 1, &[0]);
    master.enable_channel(1, 3);
    master.write_i32(1, 0x60FF, 0, 2000);
    master.run_ms(1500);
    master.drive(1).plant().set_load_torque_nm(0.08);
    master.run_ms(1000);
    let truth = master.drive(1).worlds()[0].truth();
    let [a, b, c] = truth.phase_current_a.map(f64::from);
    // 4.83 Ω are between two terminals.
    let heat = (a * a + b * b + c * c) * 4.83 / 2.0;
    let mechanical = f64::from(truth.speed_rad_s) * 0.08;
    let amperes = (heat + mechanical) / f64::from(truth.bus_voltage_v);
    let shown = f64::from(master.read_i16(1, 0x210C, 1)) * 0.1;
    println!("{amperes} A, shown {shown} A");
    assert!(amperes > 1.0);
    near(shown, amperes, 0.15 * amperes + 0.05);
}

/// 0x2122, FM: bit 0 says that the current is limited, bit 1 that it is and the motor stands.
#[test]
fn a_stall_is_a_limited_current_at_rest() {
    let mut master = with_machine(&ROBOTEQ);
    master.write(1, 0x3038, 1, &[0]);
    master.write_u16(1, 0x302A, 1, 3);
    master.write_i32(1, 0x6083, 0, 500_000);
    master.enable_channel(1, 3);
    master.write_i32(1, 0x60FF, 0, 2500);
    master.run_ms(150);
    assert!(master.rpm(1) > 100.0);
    assert_eq!(master.read(1, 0x2122, 1) & 3, 1, "limited, turning");
    master.drive(1).plant().set_blocked(true);
    master.run_ms(100);
    assert_eq!(master.read(1, 0x2122, 1) & 3, 3, "stalled");
}
