//! 0x2000,5, 0x2001 and 0x2002: the controllers' figures, in the units of the page.

use crate::bench::*;

/// In operation with its shaft held, room for torque, and these gains: velocity's P, I, its limit, position's.
fn held(in_mode: i8, gains: [f32; 6]) -> Master {
    let mut master = quiet();
    let [vp, vi, vl, pp, pi, pl] = gains;
    for (index, sub, value) in [
        (0x2001, 1, vp),
        (0x2001, 2, vi),
        (0x2001, 4, vl),
        (0x2002, 1, pp),
        (0x2002, 2, pi),
        (0x2002, 4, pl),
    ] {
        master.write(NODE, index, sub, &value.to_le_bytes());
    }
    master.write_u16(NODE, 0x6072, 0, 8000);
    plant(&mut master).set_blocked(true);
    enable(&mut master, in_mode);
    master
}

/// The mean of 16 readings, per mille of 1 Nm.
fn torque(master: &mut Master) -> f32 {
    let read = |_| f32::from(master.read_i16(NODE, 0x6077, 0));
    (0..16).map(read).sum::<f32>() / 16.0
}

#[track_caller]
fn near(value: f32, wanted: f32, tolerance: f32) {
    assert!((value - wanted).abs() <= tolerance, "{value}, not {wanted}");
}

#[test]
fn velocity_gains_are_newton_metres_for_each_radian_per_second() {
    // 10 RPM are 1.047 rad/s.
    let mut master = held(9, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    master.write_i32(NODE, 0x60FF, 0, 10);
    master.run_ms(200);
    near(torque(&mut master), 2094.0, 60.0);
    // An integral of 3 Nm/s for each rad/s, up to 0.5 Nm.
    let mut master = held(9, [1.0, 3.0, 0.5, 0.0, 0.0, 0.0]);
    master.write_i32(NODE, 0x60FF, 0, -10);
    master.run_ms(60);
    let begun = torque(&mut master);
    assert!((-1400.0..-1100.0).contains(&begun), "{begun}");
    master.run_ms(1000);
    near(torque(&mut master), -1547.0, 60.0);
}

#[test]
fn position_gains_are_radians_per_second_for_each_radian() {
    // 261 increments are 0.1 rad: 3 rad/s are 28.7 RPM.
    let mut master = held(8, [0.1, 0.0, 0.0, 30.0, 0.0, 0.0]);
    let here = master.position(NODE);
    master.write_i32(NODE, 0x607A, 0, here + 261);
    master.run_ms(200);
    near(master.read(NODE, 0x606B, 0) as f32, 28.7, 1.0);
    // And an integral up to 1 rad/s, 9.5 RPM.
    let mut master = held(8, [0.1, 0.0, 0.0, 30.0, 20.0, 1.0]);
    let here = master.position(NODE);
    master.write_i32(NODE, 0x607A, 0, here - 261);
    master.run_ms(2000);
    near(master.read(NODE, 0x606B, 0) as f32, -38.2, 1.0);
}

/// Until a step of current has come 63 % of its way, µs.
fn rise_us(bandwidth_hz: u16) -> u32 {
    let mut master = held(9, [8.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    master.write_u16(NODE, 0x2000, 5, bandwidth_hz);
    master.run_ms(20);
    let current = |master: &mut Master| {
        let feedback = master.drive(NODE).core().expect("a drive").feedback();
        (feedback.current_q_a, feedback.demand_current_a)
    };
    // The request and its answer take a millisecond; the step comes in between.
    let [low, high] = 0x60FF_u16.to_le_bytes();
    // Far beyond the torque limit, so that the demand is there at once.
    let [a, b, c, d] = 900_i32.to_le_bytes();
    master.send(0x600 + u16::from(NODE), &[0x23, low, high, 0, a, b, c, d]);
    let mut since = None;
    for us in (0..20_000).step_by(25) {
        master.run_us(25);
        let (is, shall) = current(&mut master);
        if shall > 9.0 {
            let begun = *since.get_or_insert(us);
            if is > 0.632 * shall {
                return us - begun;
            }
        }
    }
    panic!("no step");
}

#[test]
fn the_torque_bandwidth_is_the_current_controllers() {
    // 1/(2π·f), seen each 25 µs.
    for (hz, us) in [(100, 1592.0), (500, 318.0), (2500, 64.0)] {
        let rise = rise_us(hz);
        near(rise as f32, us, 0.05 * us + 25.0);
    }
}
