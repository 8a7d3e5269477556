//! A master of one controller, and of its serial line.
#![allow(unreachable_pub, reason = "a test's module")]

use crate::master::{Master, id};
use personalities::Personality;
use sim::{Bus, DriveSettings, Place, SerialAct};

pub fn place() -> Place {
    Place::of_node(id(1))
}

/// One that does not send back what it gets, nor stops when it hears nothing for a second: these tests
/// look for longer. The watchdog has tests of its own.
pub fn controller(personality: &'static Personality) -> Master {
    let mut master = Master::with(vec![DriveSettings::new(id(1), personality)]);
    assert_eq!(say(&mut master, "^ECHOF 1\r"), "^ECHOF 1\r+\r");
    assert_eq!(say(&mut master, "^RWD 0\r"), "+\r");
    master
}

pub fn send(bus: &mut Bus, bytes: &[u8]) {
    bus.run_until(bus.now());
    bus.act_on_serial(place(), &SerialAct::Bytes(bytes.to_vec()));
}

/// What came back until nothing has come for so many ms.
pub fn hear(master: &mut Master, quiet_ms: u64) -> String {
    let mut heard = Vec::new();
    let mut quiet = 0;
    while quiet < quiet_ms {
        master.run_ms(1);
        let sent = master.bus.take_serial();
        quiet = if sent.is_empty() { quiet + 1 } else { 0 };
        heard.extend(sent.iter().map(|byte| byte.byte));
    }
    String::from_utf8(heard).expect("text")
}

/// A line, and what came back.
pub fn say(master: &mut Master, line: &str) -> String {
    send(&mut master.bus, line.as_bytes());
    hear(master, 10)
}

pub fn rpm(master: &mut Master, axis: usize) -> f64 {
    let speed = master.drive(1).worlds()[axis].truth().speed_rad_s;
    f64::from(speed) * 60.0 / core::f64::consts::TAU
}
