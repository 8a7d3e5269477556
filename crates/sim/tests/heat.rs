//! The heat of a stock drive: what ordinary use makes of it, and what a blocked shaft does.

mod master;
use master::*;

/// Temperatures of winding, housing and amplifier, °C.
fn temperatures(master: &mut Master) -> [f32; 3] {
    let truth = master.drive(1).plant().truth();
    [truth.winding_c, truth.housing_c, truth.amplifier_c]
}

#[test]
fn ordinary_use_does_not_overheat() {
    let mut master = Master::new(&[1]);
    // A minute of moves to and fro, at a third of the greatest speed.
    master.enable(1, 3);
    for n in 0..60 {
        let speed: i32 = if n % 2 == 0 { 270_000 } else { -270_000 };
        master.write_i32(1, 0x60FF, 0, speed);
        master.run_ms(1_000);
        let read = master.read(1, 0x606C, 0);
        assert!((read - speed).abs() < 27_000, "{read}");
    }
    let [winding, housing, amplifier] = temperatures(&mut master);
    println!("after a minute: winding {winding}, housing {housing}, amplifier {amplifier} °C");
    assert!(winding < 40.0 && housing < 40.0 && amplifier < 40.0);
    assert!(winding > 25.0 && amplifier > 25.0);
    assert!(master.emergencies(1).is_empty());
    // The drive tells the amplifier's, in whole degrees.
    let told = master.read(1, 0x3000, 2);
    assert!((told as f32 - amplifier).abs() <= 1.0, "{told}");
}

#[test]
fn a_blocked_shaft_heats_the_winding_until_the_drive_gives_up() {
    let mut master = Master::new(&[1]);
    master.enable(1, 4);
    master.drive(1).plant().set_blocked(true);
    // Rated torque, which the I²t limit allows for ever. The winding warms faster than the housing.
    master.write_i16(1, 0x6071, 0, 1000);
    let mut seconds = 0;
    while master.emergencies(1).is_empty() {
        master.run_ms(1_000);
        seconds += 1;
        assert!(seconds < 900);
        if seconds == 30 {
            // Most of the heat's way is before it: as if the motor had worked for minutes.
            let [winding, housing, _] = temperatures(&mut master);
            println!("after 30 s: winding {winding}, housing {housing} °C");
            assert!(winding > housing + 8.0 && housing > 28.0);
            master.drive(1).plant().set_motor_temperature_c(75.0);
        }
    }
    let [winding, ..] = temperatures(&mut master);
    println!("0x4310 after {seconds} s, at {winding} °C");
    let emergency = master.emergencies(1)[0];
    assert_eq!([emergency[1], emergency[0]], [0x43, 0x10]);
    assert!((84.0..88.0).contains(&winding), "{winding}");
}
