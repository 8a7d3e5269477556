//! What the line does is what the motor does.

use personalities::roboteq::{ROBOTEQ, ROBOTEQ_2};

use crate::bench::{controller, hear, rpm, say, send};

/// Switched on, moved and watched by serial line alone; then stopped by CAN.
#[test]
fn the_line_moves_the_same_motor_as_can_does() {
    let mut master = controller(&ROBOTEQ_2);
    assert_eq!(say(&mut master, "?SW\r"), "SW=0:0\r");
    assert_eq!(say(&mut master, "^FSA 1\r"), "+\r");
    assert_eq!(say(&mut master, "?SW 2\r"), format!("SW={}\r", 0x0250));
    for line in [
        "!ROM 2 3\r",
        "!CW 2 6\r",
        "!CW 2 7\r",
        "!CW 2 15\r",
        "!S 2 600\r",
    ] {
        assert_eq!(say(&mut master, line), "+\r", "{line}");
    }
    master.run_ms(1000);
    // R10: one command, two objects.
    assert_eq!(master.read(1, 0x68FF, 0), 600);
    assert_eq!(master.read(1, 0x6842, 0), 600);
    let speed = rpm(&mut master, 1);
    assert!((speed - 600.0).abs() < 10.0, "{speed}");
    assert!(rpm(&mut master, 0).abs() < 1.0);
    let told = say(&mut master, "?F 2\r");
    let told: f64 = told
        .trim_start_matches("F=")
        .trim_end()
        .parse()
        .expect("a speed");
    assert!((told - 600.0).abs() < 15.0, "{told}");
    let status = say(&mut master, "?SW 2\r");
    let word: u16 = status
        .trim_start_matches("SW=")
        .trim_end()
        .parse()
        .expect("a word");
    assert_eq!(word & 0x6F, 0x27, "{status}");
    // CAN stops it.
    master.write_i32(1, 0x68FF, 0, 0);
    master.run_ms(1000);
    assert!(rpm(&mut master, 1).abs() < 10.0);
    assert_eq!(say(&mut master, "!CW 2 7\r"), "+\r");
    assert_eq!(master.read(1, 0x6841, 0) & 0x6F, 0x23);
    master.write_u16(1, 0x6840, 0, 0);
    assert_eq!(say(&mut master, "?SW 2\r"), format!("SW={}\r", 0x0250));
}

/// Without the state machine and in open loop: `!G` alone turns the motor.
#[test]
fn g_is_the_voltage_in_open_loop() {
    let mut master = controller(&ROBOTEQ);
    assert_eq!(say(&mut master, "!G 300\r"), "+\r");
    assert_eq!(say(&mut master, "!G 1 1001\r"), "-\r");
    master.run_ms(2000);
    let speed = rpm(&mut master, 0);
    assert!(speed > 300.0, "{speed}");
    assert_eq!(say(&mut master, "!EX\r"), "+\r");
    assert_eq!(say(&mut master, "?FF\r"), "FF=16\r");
    assert_eq!(say(&mut master, "!G 0\r!MG\r"), "+\r+\r");
    master.run_ms(1500);
    assert_eq!(say(&mut master, "?FF\r"), "FF=0\r");
}

/// What is stored is there after a reset; echo and history are as at first.
#[test]
fn eesav_stores_and_answers_when_it_is_done() {
    let mut master = controller(&ROBOTEQ_2);
    assert_eq!(say(&mut master, "^MAC 2 4321\r^EDEC 1 987\r"), "+\r+\r");
    let began = master.now();
    send(&mut master.bus, b"%EESAV\r?SW 1\r");
    // Meanwhile another store is refused, by CAN as by the line itself.
    let mut plus = Vec::new();
    while plus.is_empty() {
        master.run_ms(1);
        assert!(master.now().since_ns(began) < 2_000_000_000, "no answer");
        plus = master.bus.take_serial();
    }
    assert_eq!(plus[0].byte, b'+');
    let took = plus[0].at.since_ns(began);
    assert!(took > 5_000_000, "flash is not written in {took} ns");
    assert_eq!(hear(&mut master, 10).trim_start_matches('\r'), "SW=0\r");
    // NMT reset.
    assert_eq!(say(&mut master, "?A 1\r!CW 1"), "A=0\r");
    master.send(0, &[0x81, 1]);
    master.run_ms(60);
    assert_eq!(say(&mut master, "~MAC\r"), "~MAC\rMAC=20000:4321\r");
    assert_eq!(say(&mut master, "~EDEC 1\r#\r"), "~EDEC 1\rEDEC=987\r#\r");
}
