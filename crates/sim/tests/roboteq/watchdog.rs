//! The watchdog of commands (^RWD, 0x3008): whoever commands the controller must go on commanding it.

use personalities::roboteq::{ROBOTEQ, ROBOTEQ_2};
use sim::{Place, SerialAct};

use crate::bench::{Channel, FSA, REACHED, near, watched, window};
use crate::master::{Master, id};

const RWD: (u16, u8) = (0x3008, 0);

/// Reads for so long: that is no command.
fn look_on(master: &mut Master, ms: u64) {
    for _ in 0..ms / 10 {
        let _ = master.read(1, 0x6041, 0);
        master.run_ms(10);
    }
}

/// Commands the same again and again for so long.
fn command(master: &mut Master, ms: u64, again: impl Fn(&mut Master)) {
    for _ in 0..ms / 100 {
        again(master);
        master.run_ms(100);
    }
}

fn with_machine() -> Master {
    let mut master = watched(&ROBOTEQ);
    assert_eq!(master.read(1, RWD.0, RWD.1), 1000);
    master.write(1, FSA.0, FSA.1, &[1]);
    master
}

fn flags(master: &mut Master) -> u16 {
    master.read(1, 0x2111, 0) as u16
}

#[test]
fn a_second_after_the_last_command_the_motor_stops_on_the_fault_deceleration_and_the_next_one_starts_it()
 {
    let mut master = with_machine();
    master.write_i32(1, 0x30F0, 1, 5000); // 500 RPM/s
    master.enable_channel(1, 3);
    let go = |master: &mut Master| master.write_i32(1, 0x60FF, 0, 600);
    command(&mut master, 3000, go);
    near(master.rpm(1), 600.0, 12.0);
    assert_eq!(flags(&mut master) & 1, 1);
    assert_ne!(master.status_of(1) & REACHED, 0);
    master.run_ms(850);
    near(master.rpm(1), 600.0, 12.0);
    // Queries and what configures the controller are no commands.
    look_on(&mut master, 650);
    master.write_i32(1, 0x3033, 1, 20_000);
    near(master.rpm(1), 290.0, 25.0);
    assert_eq!(master.status_of(1) & (REACHED | 0x6F), 0x27);
    assert_eq!(flags(&mut master) & 1, 0);
    look_on(&mut master, 1500);
    near(master.rpm(1), 0.0, 3.0);
    assert_eq!(
        master.status_of(1) & (REACHED | 0x6F),
        0x27,
        "it does not run as it should"
    );
    // Any command: what ran runs again. Here one of another channel's object, were there one.
    master.write_i32(1, 0x6081, 0, 900);
    master.run_ms(600);
    near(master.rpm(1), 600.0, 12.0);
    assert_eq!(flags(&mut master) & 1, 1);
}

#[test]
fn rpdos_feed_it_also_with_the_same_values() {
    let mut master = with_machine();
    master.write(1, 0x1400, 1, &0x8000_0201_u32.to_le_bytes());
    master.write(1, 0x1600, 0, &[0]);
    master.write(1, 0x1600, 1, &0x60FF_0020_u32.to_le_bytes());
    master.write(1, 0x1600, 0, &[1]);
    master.write(1, 0x1400, 1, &0x201_u32.to_le_bytes());
    master.enable_channel(1, 3);
    master.send(0, &[1, 1]);
    let go = |master: &mut Master| master.send(0x201, &500_i32.to_le_bytes());
    command(&mut master, 4000, go);
    near(master.rpm(1), 500.0, 12.0);
    master.run_ms(1800);
    near(master.rpm(1), 0.0, 3.0);
    go(&mut master);
    master.run_ms(700);
    near(master.rpm(1), 500.0, 12.0);
}

#[test]
fn the_serial_line_feeds_it_for_can_and_its_queries_do_not() {
    let mut master = watched(&ROBOTEQ_2);
    let say = |master: &mut Master, line: &[u8]| {
        master.bus.run_until(master.bus.now());
        let act = SerialAct::Bytes(line.to_vec());
        master.bus.act_on_serial(Place::of_node(id(1)), &act);
    };
    say(&mut master, b"^FSA 1\r");
    master.run_ms(5);
    for channel in [1, 2] {
        master.enable_channel(channel, 3);
        master.write_i32(1, window(channel, 0x60FF), 0, 400);
    }
    // One command of one channel is enough for both.
    command(&mut master, 3000, |master| say(master, b"!VAR 1 5\r"));
    near(master.rpm(1), 400.0, 10.0);
    near(master.rpm(2), 400.0, 10.0);
    // A line that is refused is no command.
    command(&mut master, 2000, |master| {
        say(master, b"?SW\r!S 3 5\r# C\r~RWD\r")
    });
    near(master.rpm(1), 0.0, 3.0);
    near(master.rpm(2), 0.0, 3.0);
    say(&mut master, b"!S 2 200\r");
    master.run_ms(700);
    near(master.rpm(1), 400.0, 10.0);
    near(master.rpm(2), 200.0, 10.0);
}

#[test]
fn a_positioning_is_interrupted_and_goes_on() {
    for mode in [1, -1] {
        let mut master = with_machine();
        master.write_i32(1, 0x6081, 0, 60);
        master.enable_channel(1, mode);
        // Five turns, or what half of the range is, at one a second.
        let target = if mode == 1 { 20_480 } else { 1000 };
        let there = 20_000.0 + if mode == 1 { 480.0 } else { 0.0 };
        master.write_i32(1, 0x607A, 0, target);
        master.word(1, 0x1F);
        master.run_ms(2500);
        near(master.rpm(1), 0.0, 3.0);
        let stopped = master.position(1);
        let counts = f64::from(master.read(1, 0x2104, 1));
        near(counts, 4096.0, 400.0);
        assert_eq!(master.status_of(1) & REACHED, 0);
        assert_eq!(master.position(1), stopped);
        command(&mut master, 5000, |master| master.word(1, 0x0F));
        near(f64::from(master.read(1, 0x2104, 1)), there, 20.0);
        // It rests where it should: silence alters nothing.
        master.run_ms(2000);
        near(f64::from(master.read(1, 0x2104, 1)), there, 20.0);
        assert_ne!(master.status_of(1) & REACHED, 0);
    }
}

#[test]
fn velocity_torque_and_open_loop_stop_too() {
    for mode in [2_i8, -4, -3, 4, 0] {
        let mut master = with_machine();
        master.write(1, 0x3038, 1, &[0]);
        master.enable_channel(1, mode);
        let go = |master: &mut Master| match mode {
            2 | -4 => {
                master.word(1, 0x7F);
                master.write_i16(1, 0x6042, 0, 300);
            }
            -3 => master.write_i32(1, 0x60FF, 0, 300),
            4 => master.write_i16(1, 0x6071, 0, 1),
            _ => master.write_i32(1, 0x2000, 1, 100),
        };
        command(&mut master, 1500, go);
        assert!(master.rpm(1).abs() > 100.0, "{mode}: {}", master.rpm(1));
        master.run_ms(4000);
        near(master.rpm(1), 0.0, 4.0);
        command(&mut master, 1000, go);
        assert!(master.rpm(1).abs() > 100.0, "{mode}: {}", master.rpm(1));
        assert_eq!(master.read(1, 0x6061, 0) as i8, mode);
    }
}

/// It is where it wants to be much sooner than in a second.
#[test]
fn tracking_stops_on_its_way() {
    let mut master = with_machine();
    master.write_u16(1, RWD.0, RWD.1, 60);
    master.write_i32(1, 0x30F0, 1, 200_000);
    master.write_i32(1, 0x30F2, 1, -200_000);
    master.write_i32(1, 0x30F3, 1, 200_000);
    master.enable_channel(1, -2);
    master.write_i32(1, 0x607A, 0, 1000); // 200,000 counts
    master.run_ms(600);
    near(master.rpm(1), 0.0, 2.0);
    let stopped = master.read(1, 0x2104, 1);
    assert!((20_000..100_000).contains(&stopped), "{stopped}");
    assert_eq!(master.status_of(1) & REACHED, 0);
    assert_eq!(master.read(1, 0x6061, 0) as i8, -2);
    // Any other command lets it go on.
    for _ in 0..60 {
        master.word(1, 0x0F);
        master.run_ms(50);
    }
    near(f64::from(master.read(1, 0x2104, 1)), 200_000.0, 20.0);
    // Another mode meanwhile: the old target does not come back with it.
    master.run_ms(200);
    master.mode(1, 1);
    master.write_i32(1, 0x607A, 0, 0);
    master.run_ms(200);
    master.mode(1, -2);
    master.run_ms(200);
    near(f64::from(master.read(1, 0x2104, 1)), 200_000.0, 20.0);
}

#[test]
fn without_the_state_machine_it_is_the_same() {
    let mut master = watched(&ROBOTEQ);
    let go = |master: &mut Master| master.write_i32(1, 0x2000, 1, 200);
    command(&mut master, 2000, go);
    assert!(master.rpm(1) > 500.0);
    master.run_ms(3000);
    near(master.rpm(1), 0.0, 5.0);
    go(&mut master);
    master.run_ms(900);
    assert!(master.rpm(1) > 500.0);
    // A position too, from rest.
    master.run_ms(3000);
    master.mode(1, 1);
    let there = master.position(1) + 4096;
    let go = |master: &mut Master| master.write_i32(1, 0x607A, 0, there);
    command(&mut master, 1500, go);
    near(f64::from(master.position(1)), f64::from(there), 20.0);
}

#[test]
fn it_is_configured_kept_and_off_with_0() {
    let mut master = with_machine();
    assert_eq!(
        master.try_write(1, RWD.0, RWD.1, &65_001_u16.to_le_bytes()),
        Err(0x0609_0031)
    );
    master.write_u16(1, RWD.0, RWD.1, 200);
    master.enable_channel(1, 3);
    master.write_i32(1, 0x60FF, 0, 300);
    master.run_ms(150);
    assert!(master.rpm(1) > 150.0);
    master.run_ms(400);
    near(master.rpm(1), 0.0, 3.0);
    // It does not start by itself because nobody watches any more.
    master.write_u16(1, RWD.0, RWD.1, 0);
    master.run_ms(300);
    near(master.rpm(1), 0.0, 3.0);
    master.word(1, 0x0F);
    master.run_ms(5000);
    near(master.rpm(1), 300.0, 8.0);
    master.write(1, 0x2017, 0, &[1]);
    master.run_ms(500);
    master.send(0, &[0x81, 1]);
    master.run_ms(200);
    assert_eq!(master.read(1, RWD.0, RWD.1), 0);
}
