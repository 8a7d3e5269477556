//! 0x3001,2 to 7: what switches and converters take their time for, and what the drive makes of it.

mod master;
use master::*;

use std::f64::consts::{PI, TAU};

const DEAD: u8 = 2;
const LEAST_DELAY: u8 = 3;
const DELAY_SPREAD: u8 = 4;
const SETTLING: u8 = 5;
const SAMPLING: u8 = 6;
const CONVERSION: u8 = 7;

const PWM_NS: f64 = 10_000.0;
const BUS: f64 = 48.0;
const DIODES: f64 = 2.0 * 0.8;
const OHM: f64 = 6.55;
const OUT_OF_RANGE: u32 = 0x0609_0030;
const PARAMETER_ERROR: u16 = 0x6320;

/// A drive whose bridge adds `own_ns` to the dead time of its timer, and whose motor stays cool.
fn drive(own_ns: f64) -> sim::DriveSettings {
    let mut settings = p3(1);
    settings.plant.bridge.dead_time_s = own_ns * 1e-9;
    settings.plant.thermal = None;
    settings
}

/// Volts that get lost in mode 12 at standstill, where phase A takes what B and C give back. What
/// dead time and diodes take off them is a vector of 4/3 along A.
fn lost_at_rest(own_ns: f64, timer_ns: u16, given: i16) -> f64 {
    let mut master = Master::with(vec![drive(own_ns)]);
    master.write_u16(1, 0x3001, DEAD, timer_ns);
    master.enable(1, 12);
    master.write_i16(1, 0x60EA, 0, 0);
    master.write_i16(1, 0x3010, 4, given);
    master.run_ms(500);
    let [a, ..] = master.drive(1).plant().truth().phase_current_a;
    f64::from(given) / 32_768.0 * BUS / 3_f64.sqrt() - OHM * f64::from(a)
}

#[test]
fn at_rest_the_dead_time_is_lost_without_a_compensation_and_only_the_diodes_with_one() {
    let theory = |lost_ns: f64, all_ns: f64| 4.0 / 3.0 * (lost_ns * BUS + all_ns * DIODES) / PWM_NS;
    for given in [2_773, 4_000, -2_773] {
        let sign = f64::from(given).signum();
        for (own_ns, timer_ns) in [(200.0, 0), (0.0, 200), (0.0, 500), (100.0, 200), (0.0, 0)] {
            let all_ns = own_ns + f64::from(timer_ns);
            // The timer's is compensated, what the drivers add is not.
            let wanted = sign * theory(own_ns, all_ns);
            let got = lost_at_rest(own_ns, timer_ns, given);
            println!("{own_ns} + {timer_ns} ns at {given}: {got:.4} V, theory {wanted:.4} V");
            let two_percent = 0.02 * theory(all_ns, all_ns);
            assert!((got - wanted).abs() < two_percent + 0.002, "{got} {wanted}");
        }
    }
}

/// Turning under load: the mean voltage of the q axis is what current and back-EMF take, and the
/// fundamental of the lost voltage, 4/π of it, which lies along the current.
#[test]
fn under_load_the_fundamental_is_lost_without_a_compensation_and_only_the_diodes_with_one() {
    let torque = 10e-3;
    let counts_per_s = 60_000.0;
    let speed = counts_per_s / 4096.0 * TAU;
    let lost = |own_ns: f64, timer_ns: u16| {
        let mut settings = drive(own_ns);
        settings.plant.motor.coulomb_friction_nm = 0.0;
        settings.plant.motor.static_friction_nm = 0.0;
        settings.plant.motor.viscous_friction_nms = 0.0;
        let motor = settings.plant.motor;
        let mut master = Master::with(vec![settings]);
        master.write_u16(1, 0x3001, DEAD, timer_ns);
        master.enable(1, 3);
        master.drive(1).plant().set_load_torque_nm(torque as f32);
        master.write_i32(1, 0x60FF, 0, counts_per_s as i32);
        master.run_ms(600);
        // Ten turns, to the period.
        let periods = (10.0 * 4096.0 / counts_per_s / 50e-6).round() as u64;
        let mut sum = [0.0; 2];
        for _ in 0..periods {
            master.run_us(50);
            let feedback = master.drive(1).core().unwrap().feedback();
            sum[0] += f64::from(feedback.voltage_v[1]) / periods as f64;
            sum[1] += f64::from(master.drive(1).plant().truth().speed_rad_s) / periods as f64;
        }
        let [volts, turning] = sum;
        assert!((turning / speed - 1.0).abs() < 1e-3, "{turning} {speed}");
        let current = torque / motor.torque_constant_nm_per_a();
        volts - motor.phase_resistance_ohm * current - motor.flux_wb * turning
    };
    let theory = |lost_ns: f64, all_ns: f64| 4.0 / PI * (lost_ns * BUS + all_ns * DIODES) / PWM_NS;
    let none = lost(0.0, 0);
    println!("nothing to lose: {none:.4} V");
    assert!(none.abs() < 0.01, "{none}");
    for (own_ns, timer_ns) in [(200.0, 0), (0.0, 200), (0.0, 500), (100.0, 200)] {
        let all_ns = own_ns + f64::from(timer_ns);
        let wanted = theory(own_ns, all_ns);
        let got = lost(own_ns, timer_ns);
        println!("{own_ns} + {timer_ns} ns: {got:.4} V, theory {wanted:.4} V");
        assert!((got - wanted).abs() < 0.02 * theory(all_ns, all_ns));
    }
}

#[test]
fn the_timer_is_told_and_told_again_after_a_reset() {
    let mut master = Master::new(&[1]);
    let dead_ns = |master: &mut Master| master.drive(1).core().unwrap().timing().dead_time_ns;
    assert_eq!(dead_ns(&mut master), 200);
    for refused in [1_001_u16, 65_535] {
        let answer = master.try_write(1, 0x3001, DEAD, &refused.to_le_bytes());
        assert_eq!(answer, Err(OUT_OF_RANGE));
        assert_eq!(master.read(1, 0x3001, DEAD), 200);
    }
    master.write_u16(1, 0x3001, DEAD, 300);
    assert_eq!(dead_ns(&mut master), 300);
    master.write(1, 0x1010, 1, &SAVE);
    master.run_ms(50);
    master.write_u16(1, 0x3001, DEAD, 400);
    master.send(0, &[0x81, 1]);
    master.run_ms(50);
    assert_eq!(dead_ns(&mut master), 300);
}

/// Volts of the d axis at speed. A frame that stands behind the rotor has a part of the back-EMF in
/// it: 22.7 V at 703,100 counts/s, of which a degree shows 0.39 V.
fn d_axis_volts(lag_us: f64, told_us: i32, times: &[(u8, u16)]) -> f64 {
    let mut settings = p3(1);
    settings.plant.encoder.lag_s = lag_us * 1e-6;
    let mut master = Master::with(vec![settings]);
    master.write_i32(1, 0x3013, 5, told_us);
    for (sub, ns) in times {
        master.write_u16(1, 0x3001, *sub, *ns);
    }
    master.enable(1, 3);
    // Under load the currents have a direction, and the dead time's compensation with them.
    master.drive(1).plant().set_load_torque_nm(5e-3);
    master.write_i32(1, 0x60FF, 0, 703_100);
    master.run_ms(1_500);
    assert!((master.read(1, 0x606C, 0) - 703_100).abs() < 5_000);
    assert!(master.emergencies(1).is_empty());
    let mut sum = 0.0;
    for _ in 0..4_000 {
        master.run_us(50);
        let feedback = master.drive(1).core().unwrap().feedback();
        sum += f64::from(feedback.voltage_v[0]) / 4_000.0;
    }
    sum
}

/// Drivers that switch late make the encoder's reading look old: the two are told alike.
#[test]
fn the_drivers_delay_turns_the_field_back_to_the_rotor() {
    let electromotive_v = 0.021_04 * 703_100.0 / 4096.0 * TAU;
    let part = electromotive_v * (9e-6 * 703_100.0 / 4096.0 * TAU).sin();
    let none = d_axis_volts(0.0, 0, &[]);
    let late = d_axis_volts(9.0, 0, &[]);
    let told = d_axis_volts(9.0, 0, &[(LEAST_DELAY, 9_000)]);
    // The least delay, and half of what the greatest is longer.
    let spread = d_axis_volts(9.0, 0, &[(LEAST_DELAY, 8_900), (DELAY_SPREAD, 200)]);
    let lag = d_axis_volts(9.0, 9, &[]);
    println!("{part:.4} V: {none:.4} {late:.4} {told:.4} {spread:.4} {lag:.4}");
    assert!((none - late - part).abs() < 0.02 * part);
    for same in [told, spread, lag] {
        assert!((same - none).abs() < 0.02 * part);
    }
}

/// Converters that are ready after three PWM periods only: the timer takes the duty three periods
/// later, and the drive turns the voltage on by what the rotor moves in them.
#[test]
fn slow_converters_delay_the_duty_and_the_angle_knows() {
    let mut master = Master::new(&[1]);
    let late = |master: &mut Master| master.drive(1).core().unwrap().timing().late_periods;
    for (ns, periods) in [(0, 0), (9_999, 0), (10_000, 1), (35_000, 3), (49_999, 4)] {
        master.write_u16(1, 0x3001, CONVERSION, ns);
        assert_eq!(late(&mut master), periods, "{ns}");
    }
    let none = d_axis_volts(0.0, 0, &[]);
    let slow = d_axis_volts(0.0, 0, &[(CONVERSION, 35_000)]);
    // Not told, 30 µs would show as much as 30 µs of lag.
    let untold = d_axis_volts(30.0, 0, &[]);
    println!("{none:.3} {slow:.3} {untold:.3} V");
    assert!((slow - none).abs() < 0.05 * (untold - none).abs());
}

/// The pulse in which the converters look takes a part of the supply: 200 ns of dead time, and 200 of
/// settling with 50 of sampling before and after its middle are 7 % of the PWM period at either end.
#[test]
fn the_pulse_for_the_converters_takes_its_part_of_the_voltage() {
    let top_speed = |times: &[(u8, u16)]| {
        let mut master = Master::new(&[1]);
        for (sub, ns) in times {
            master.write_u16(1, 0x3001, *sub, *ns);
        }
        master.write_i32(1, 0x607F, 0, 2_000_000);
        master.write_i32(1, 0x6080, 0, 2_000_000);
        master.enable(1, 3);
        master.write_i32(1, 0x60FF, 0, 2_000_000);
        master.run_ms(1_500);
        f64::from(master.read(1, 0x606C, 0))
    };
    let all = top_speed(&[]);
    let less = top_speed(&[(SETTLING, 200), (SAMPLING, 50)]);
    let ratio = less / all;
    println!("{all} {less} counts/s: {ratio:.4}");
    assert!((ratio - 0.86).abs() < 0.01, "{ratio}");
    let starts = |sampling: u16| {
        let mut master = Master::new(&[1]);
        master.write_u16(1, 0x3001, LEAST_DELAY, 80);
        master.write_u16(1, 0x3001, DELAY_SPREAD, 40);
        master.write_u16(1, 0x3001, SAMPLING, sampling);
        master.drive(1).core().unwrap().timing().sampling_starts_ns
    };
    // What is held at its end is the middle of the pulse, 100 ns late.
    assert_eq!([0, 100, 350].map(starts), [100, 0, -250]);
}

#[test]
fn times_that_cannot_be_are_a_parameter_error() {
    for (times, healed) in [
        // Drivers further apart than the dead time would close both switches.
        (&[(DELAY_SPREAD, 201)][..], (DEAD, 201)),
        (&[(DEAD, 50), (DELAY_SPREAD, 51)], (DELAY_SPREAD, 50)),
        // 200 + 2 · 2,401 ns are more than half of 10 µs.
        (&[(SETTLING, 2_401)], (SETTLING, 2_400)),
        (&[(SAMPLING, 2_401)], (SAMPLING, 2_400)),
        // The next control period begins after 50 µs.
        (&[(CONVERSION, 50_000)], (CONVERSION, 49_999)),
        (&[(LEAST_DELAY, 65_535)], (LEAST_DELAY, 0)),
    ] {
        let mut master = Master::new(&[1]);
        let before = master.drive(1).core().unwrap().timing();
        for (sub, ns) in times {
            master.write_u16(1, 0x3001, *sub, *ns);
        }
        master.run_ms(10);
        assert_eq!(master.emergency_codes(1), [PARAMETER_ERROR], "{times:?}");
        let last = times.len() > 1;
        let timing = master.drive(1).core().unwrap().timing();
        assert!(last || timing == before, "the timer goes on as before");
        let (sub, ns) = healed;
        master.write_u16(1, 0x3001, sub, ns);
        master.run_ms(10);
        let core = master.drive(1).core().unwrap();
        assert_eq!(core.comms().parameter_error(), None, "{times:?}");
    }
}
