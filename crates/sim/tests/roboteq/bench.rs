//! A master of one controller's channels.
#![allow(unreachable_pub, reason = "a test's module")]

use crate::master::{Master, id};
use personalities::Personality;
use sim::DriveSettings;

pub const FSA: (u16, u8) = (0x30F1, 0);
pub const REACHED: u16 = 0x400;

/// One as it comes out of its box: its motors stop when nobody commands it for a second.
pub fn watched(personality: &'static Personality) -> Master {
    Master::with(vec![DriveSettings::new(id(1), personality)])
}

/// Without the watchdog of commands: the tests look on for longer than a second.
pub fn controller(personality: &'static Personality) -> Master {
    let mut master = watched(personality);
    master.write_u16(1, 0x3008, 0, 0);
    master
}

/// With the state machine active.
pub fn with_machine(personality: &'static Personality) -> Master {
    let mut master = controller(personality);
    master.write(1, FSA.0, FSA.1, &[1]);
    master
}

/// Index of channel 1, 2 or 3.
pub fn window(channel: u8, index: u16) -> u16 {
    index + 0x800 * u16::from(channel - 1)
}

pub trait Channel {
    fn word(&mut self, channel: u8, word: u16);
    fn status_of(&mut self, channel: u8) -> u16;
    fn mode(&mut self, channel: u8, mode: i8);
    fn enable_channel(&mut self, channel: u8, mode: i8);
    fn rpm(&mut self, channel: u8) -> f64;
}

impl Channel for Master {
    fn word(&mut self, channel: u8, word: u16) {
        self.write_u16(1, window(channel, 0x6040), 0, word);
    }

    fn status_of(&mut self, channel: u8) -> u16 {
        self.read(1, window(channel, 0x6041), 0) as u16
    }

    #[track_caller]
    fn mode(&mut self, channel: u8, mode: i8) {
        self.write(1, window(channel, 0x6060), 0, &[mode as u8]);
    }

    #[track_caller]
    fn enable_channel(&mut self, channel: u8, mode: i8) {
        self.mode(channel, mode);
        for word in [6, 7, 15] {
            self.word(channel, word);
        }
        assert_eq!(self.status_of(channel) & 0x6F, 0x27);
    }

    /// The shaft's true speed.
    fn rpm(&mut self, channel: u8) -> f64 {
        let plant = &self.drive(1).worlds()[usize::from(channel - 1)];
        f64::from(plant.truth().speed_rad_s) * 60.0 / core::f64::consts::TAU
    }
}

#[track_caller]
pub fn near(value: f64, wanted: f64, tolerance: f64) {
    assert!((value - wanted).abs() <= tolerance, "{value}, not {wanted}");
}
