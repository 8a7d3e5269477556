//! A scenario with one act, and looks at its drive before, during and after.
#![allow(unreachable_pub, reason = "a test's module")]

pub use crate::master::*;

use canopen::Instant;
use sim::scenario::{ACTS, Scenario};
use sim::{Bus, BusSettings, DriveSettings, VirtualDrive};

/// A bus with P3s 1 and 2 on which `text` is played; the drives have booted at 50 ms, and the log
/// is empty.
pub fn play(text: &str) -> Master {
    play_upon(text, vec![p3(1), p3(2)])
}

/// The same with other drives.
pub fn play_upon(text: &str, drives: Vec<DriveSettings>) -> Master {
    let scenario = Scenario::read("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let mut settings = BusSettings::new(7, drives);
    let set_up = scenario.set_up(&mut settings, Instant::NEVER);
    set_up.unwrap_or_else(|error| panic!("{error}"));
    let mut master = Master {
        bus: Bus::new(settings),
        log: Vec::new(),
    };
    master.run_ms(50);
    master.log.clear();
    master
}

/// One event at 100 ms upon drive 1, for 200 ms if it lasts.
pub fn event(act: &str, arguments: &str) -> Master {
    play(&one(act, arguments))
}

/// Its text.
pub fn one(act: &str, arguments: &str) -> String {
    let lasts = match ACTS.iter().find(|kind| kind.name == act) {
        Some(kind) if kind.shown().iter().any(|[key, ..]| key == "for") => "for = \"200 ms\"",
        Some(_) => "",
        None => panic!("{act}"),
    };
    format!("[[event]]\nat = \"100 ms\"\ndo = \"{act}\"\ndrive = 1\n{lasts}\n{arguments}\n")
}

/// Three looks at drive 1, at 99 ms, 200 ms and 400 ms: before, during and after.
pub fn looks<T>(master: &mut Master, mut look: impl FnMut(&mut VirtualDrive) -> T) -> [T; 3] {
    [99, 200, 400].map(|ms| {
        let now_ms = master.now().0 / 1_000_000;
        master.run_ms(ms - now_ms);
        look(master.drive(1))
    })
}
