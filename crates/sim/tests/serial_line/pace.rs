//! The time that bytes take, and both ends of the line.

use personalities::roboteq::ROBOTEQ;
use sim::SerialAct;

use crate::bench::{controller, hear, place, say, send};
use crate::master::Master;

/// A byte at 115,200 bit/s.
const BYTE_NS: u64 = 86_806;

/// Each byte takes its time, in both directions.
#[test]
fn bytes_come_at_the_pace_of_the_line() {
    let mut master = controller(&ROBOTEQ);
    let began = master.now();
    send(&mut master.bus, b"?VNM\r");
    master.run_ms(10);
    let sent = master.bus.take_serial();
    let text: Vec<u8> = sent.iter().map(|byte| byte.byte).collect();
    assert_eq!(text, b"VNM=262400\r");
    // Five bytes to come, and one of the answer.
    assert_eq!(sent[0].at.since_ns(began), 6 * BYTE_NS);
    for pair in sent.windows(2) {
        assert_eq!(pair[1].at.since_ns(pair[0].at), BYTE_NS);
    }
    // Sixteen queries at once are answered one after the other, and none is lost.
    let began = master.now();
    send(&mut master.bus, &b"?VNM\r".repeat(800));
    let mut count = 0;
    while count < 800 * 11 {
        master.run_ms(20);
        count += master.bus.take_serial().len();
        assert!(master.now().since_ns(began) < 2_000_000_000, "{count}");
    }
    let took = master.now().since_ns(began);
    assert!(took >= 800 * 11 * BYTE_NS, "{took}");
}

#[test]
fn repeated_queries_come_by_themselves_until_the_other_end_hangs_up() {
    let mut master = controller(&ROBOTEQ);
    assert_eq!(say(&mut master, "# C\r?SW\r# 20\r"), "SW=0\r");
    let began = master.now();
    let mut times = Vec::new();
    while master.now().since_ns(began) < 1_000_000_000 {
        master.run_ms(10);
        let sent = master.bus.take_serial();
        times.extend(
            sent.iter()
                .filter(|byte| byte.byte == b'\r')
                .map(|byte| byte.at),
        );
    }
    assert!((49..=50).contains(&times.len()), "{}", times.len());
    for pair in times.windows(2) {
        assert_eq!(pair[1].since_ns(pair[0]), 20_000_000);
    }
    master.bus.act_on_serial(place(), &SerialAct::HangUp);
    assert_eq!(hear(&mut master, 100), "");
    // Half a line has gone with its sender.
    send(&mut master.bus, b"!CW 1 1");
    master.run_ms(2);
    master.bus.act_on_serial(place(), &SerialAct::HangUp);
    assert_eq!(say(&mut master, "5\r"), "-\r");
    // What it had sent as a whole is obeyed, though it went at once; what that has to say nobody hears.
    send(&mut master.bus, b"!TC 1 7\r?TC\r!TC 1 8");
    master.bus.act_on_serial(place(), &SerialAct::HangUp);
    assert_eq!(say(&mut master, "?TC\r"), "TC=7\r");
}

/// While it boots or is off it hears nothing, and a drive without a line never does.
#[test]
fn who_does_not_run_hears_nothing() {
    let mut master = controller(&ROBOTEQ);
    master.send(0, &[0x81, 1]);
    master.run_us(500);
    send(&mut master.bus, b"!CW 1 15\r");
    assert_eq!(hear(&mut master, 60), "");
    assert_eq!(say(&mut master, "?CW\r"), "?CW\rCW=0\r");
    let mut p3 = Master::new(&[1]);
    assert_eq!(p3.bus.serial_room(place()), 0);
    send(&mut p3.bus, b"?SW\r");
    assert_eq!(hear(&mut p3, 20), "");
}

/// Garbage does no harm while the drive works on.
#[test]
fn garbage_on_the_line_does_not_disturb_the_drive() {
    let mut master = controller(&ROBOTEQ);
    let mut random = 0x1234_5678_9ABC_DEF1_u64;
    for _ in 0..40 {
        let bytes: Vec<u8> = (0..100)
            .map(|_| {
                random ^= random << 13;
                random ^= random >> 7;
                random ^= random << 17;
                (random >> 40) as u8
            })
            .collect();
        send(&mut master.bus, &bytes);
        master.run_ms(20);
        master.bus.take_serial();
        assert_eq!(master.read(1, 0x1000, 0), 0x192);
    }
    hear(&mut master, 50);
    say(&mut master, "\r");
    assert_eq!(say(&mut master, "?VNM\r"), "VNM=262400\r");
}
