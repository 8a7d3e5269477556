//! Both readings of the manual's I²t formula, on a whole drive: when the limit comes.

mod master;

use master::*;
use personalities::{p3::P3, p3_extended::P3_EXTENDED};
use sim::DriveSettings;

/// Continuous and peak current, A, and the peak's time, s, as 0x3011 has them at first.
const CONTINUOUS_A: f64 = 0.716;
const PEAK_A: f64 = 2.0;
const PEAK_S: f64 = 1.0;
/// What a thousand per mille of rated torque takes: 0.06 Nm over the object's 32 mNm/A.
const DEMAND_A: f64 = 0.060 / 0.032;

/// Seconds from the demand to the warning, with a blocked shaft.
fn seconds(drive: DriveSettings, rule: Option<u8>) -> f64 {
    let mut master = Master::with(vec![drive]);
    if let Some(rule) = rule {
        master.write(1, 0x2113, 0, &[rule]);
    }
    // The user's own limits are those of the motor, so that the warning is looked for.
    master.write_u16(1, 0x2111, 0, 350);
    master.write_i32(1, 0x6076, 0, 60);
    master.write_u16(1, 0x6040, 0, 0x06);
    master.write_u16(1, 0x6040, 0, 0x0F);
    master.write(1, 0x6060, 0, &[4]);
    master.drive(1).plant().set_blocked(true);
    master.log.clear();
    master.write_i16(1, 0x6071, 0, 1000);
    let began = master.now();
    while master.emergency_codes(1).is_empty() {
        master.run_ms(1);
        assert!(master.now().since_ns(began) < 10_000_000_000);
    }
    assert_eq!(master.emergency_codes(1), [0x2310]);
    // The current falls to the continuous one.
    master.run_ms(50);
    let current = f64::from(master.read_i16(1, 0x6078, 0)) * 1e-3;
    assert!((current - CONTINUOUS_A).abs() < 0.03, "{current} A");
    master
        .log
        .iter()
        .find(|t| t.frame.raw_id() == 0x81)
        .unwrap()
        .at
        .since_ns(began) as f64
        * 1e-9
}

#[test]
fn the_limit_comes_when_each_rule_says() {
    let excess = DEMAND_A * DEMAND_A - CONTINUOUS_A * CONTINUOUS_A;
    let literal = PEAK_A * PEAK_S / excess;
    let dimensional = (PEAK_A * PEAK_A - CONTINUOUS_A * CONTINUOUS_A) * PEAK_S / excess;
    let extended = || DriveSettings::new(id(1), &P3_EXTENDED);
    for (drive, rule, theory) in [
        (DriveSettings::new(id(1), &P3), None, literal),
        (extended(), None, literal),
        (extended(), Some(0), literal),
        (extended(), Some(1), dimensional),
    ] {
        let name = drive.personality.name;
        let seconds = seconds(drive, rule);
        println!("{name} {rule:?}: {seconds:.4} s, theory {theory:.4} s");
        // The loops' sum is exact to a period (`control`, i2t.rs); the warning comes with the next
        // millisecond and the frame after it, the torque within a millisecond of the demand.
        let late = seconds - theory;
        assert!(
            (-0.0005..0.004).contains(&late),
            "{name} {rule:?}: {late} s"
        );
    }
}
