//! 0x2005: the encoder on the output.

use crate::bench::*;
use plant::OutputEncoder;

#[test]
fn an_output_encoder_is_shown_and_calibrated() {
    let mut settings = md80();
    settings.plant.output_encoder = Some(OutputEncoder {
        zero_turns: 0.3,
        reversed: true,
        ..OutputEncoder::ideal(1.0 / 9.0)
    });
    let mut master = Master::with(vec![settings]);
    master.run_ms(50);
    master.write_u16(NODE, 0x2000, 12, 0);
    master.write(NODE, 0x2000, 8, &(1.0_f32 / 9.0).to_le_bytes());
    master.write_i32(NODE, 0x2005, 1, 1);
    // In REPORT it has no calibration (M29).
    master.write_i32(NODE, 0x2005, 3, 3);
    mode(&mut master, -1);
    assert!(!status_bit(&mut master, 2, 2));
    assert_eq!(master.try_write(NODE, 0x2003, 4, &[1]), Err(0x0800_0022));
    master.write_i32(NODE, 0x2005, 3, 1);
    master.run_ms(5);
    assert!(status_bit(&mut master, 2, 2), "not calibrated");
    mode(&mut master, -1);
    master.log.clear();
    master.write(NODE, 0x2003, 4, &[1]);
    let done = wait_for_boot(&mut master, 40);
    assert!(done, "{:x}", master.read(NODE, 0x2004, 2));
    assert_eq!(master.read(NODE, 0x2004, 2), 0);
    master.write_u16(NODE, 0x2000, 12, 0);
    // It agrees with the motor's encoder, also while that moves.
    ramps(&mut master, 200);
    enable(&mut master, 3);
    master.write_i32(NODE, 0x60FF, 0, 60);
    master.run_ms(1500);
    let velocity = real(&mut master, 0x2005, 5);
    assert!((velocity - std::f32::consts::TAU).abs() < 0.5, "{velocity}");
    master.write_i32(NODE, 0x60FF, 0, 0);
    master.run_ms(1500);
    let by_motor = master.position(NODE) as f32 / TURN as f32;
    let by_encoder = real(&mut master, 0x2005, 4) / std::f32::consts::TAU;
    assert!(
        (by_motor - by_encoder).abs() < 0.01,
        "{by_motor} {by_encoder}"
    );
}

#[test]
fn an_output_encoder_that_does_not_answer_is_a_fault() {
    let mut master = quiet();
    master.log.clear();
    master.write_i32(NODE, 0x2005, 1, 1);
    master.write_i32(NODE, 0x2005, 3, 3);
    master.run_ms(5);
    assert!(status_bit(&mut master, 2, 0) && status_bit(&mut master, 2, 6));
    assert_eq!(master.emergency_codes(NODE), [0x7306]);
    assert_eq!(master.state(NODE), FAULT);
}
