//! A master of one MD80 with its sample motor.
#![allow(unreachable_pub, reason = "a test's module")]

pub use crate::master::*;
use personalities::md80::MD80;
use plant::{OutputEncoder, Parameters, Plant};
use sim::DriveSettings;

pub const NODE: u8 = 5;
pub const TURN: i32 = 16_384;

pub fn md80() -> DriveSettings {
    DriveSettings::new(id(NODE), &MD80)
}

/// A commissioned drive that has booted, without its bus's watchdog.
pub fn quiet() -> Master {
    let mut master = Master::with(vec![md80()]);
    master.run_ms(50);
    master.write_u16(NODE, 0x2000, 12, 0);
    master
}

pub fn real(master: &mut Master, index: u16, sub: u8) -> f32 {
    f32::from_le_bytes(master.try_read(NODE, index, sub).expect("a value"))
}

pub fn mode(master: &mut Master, mode: i8) {
    master.write(NODE, 0x6060, 0, &[mode as u8]);
}

/// "To put the drive into operational mode": 6, then 15.
pub fn enable(master: &mut Master, in_mode: i8) {
    master.write_u16(NODE, 0x6040, 0, 6);
    master.write_u16(NODE, 0x6040, 0, 15);
    assert_eq!(master.state(NODE), OPERATION_ENABLED);
    mode(master, in_mode);
    assert_eq!(master.read(NODE, 0x6061, 0) as i8, in_mode);
}

pub fn ramps(master: &mut Master, rpm_per_s: i32) {
    master.write_i32(NODE, 0x6083, 0, rpm_per_s);
    master.write_i32(NODE, 0x6084, 0, rpm_per_s);
}

/// A bit of a status word.
pub fn status_bit(master: &mut Master, sub: u8, bit: u8) -> bool {
    master.read(NODE, 0x2004, sub) as u32 & 1 << bit != 0
}

/// Whether the node has booted since the log was cleared.
pub fn booted(master: &Master) -> bool {
    let boot = 0x700 + u32::from(NODE);
    let mut frames = master.log.iter();
    frames.any(|t| t.frame.raw_id() == boot && t.frame.data() == [0])
}

/// Turns of the motor, as it really is.
pub fn motor_turns(master: &mut Master) -> f64 {
    master.drive(NODE).plant().truth().position_turns()
}

/// A drive out of the box, with what its calibration needs.
pub fn fresh(change: impl FnOnce(&mut DriveSettings)) -> Master {
    let mut settings = md80().factory();
    change(&mut settings);
    let mut master = Master::with(vec![settings]);
    master.run_ms(50);
    master.write_u16(NODE, 0x2000, 12, 0);
    master
}

pub fn configure(master: &mut Master, pole_pairs: u32) {
    master.write(NODE, 0x2000, 1, &pole_pairs.to_le_bytes());
    master.write(NODE, 0x2000, 2, &0.091_f32.to_le_bytes());
    master.write_u16(NODE, 0x2000, 5, 500);
    master.write(NODE, 0x2000, 7, &[80]);
    master.write(NODE, 0x2000, 8, &(1.0_f32 / 9.0).to_le_bytes());
    master.write_i32(NODE, 0x6075, 0, 1000);
    master.write_u16(NODE, 0x6073, 0, 20_000);
    master.write_i32(NODE, 0x6076, 0, 1000);
    master.write_u16(NODE, 0x6072, 0, 1000);
    master.write_i32(NODE, 0x6081, 0, 100);
    for (index, sub, value) in [
        (0x2001, 1, 2.0_f32),
        (0x2001, 2, 0.5),
        (0x2001, 4, 0.1),
        (0x2002, 1, 30.0),
        (0x2002, 2, 0.5),
        (0x2002, 4, 1.0),
    ] {
        master.write(NODE, index, sub, &value.to_le_bytes());
    }
}

pub fn calibrate(master: &mut Master) {
    mode(master, -1);
    master.log.clear();
    master.write(NODE, 0x2003, 3, &[1]);
}

/// Runs until it has booted or `s` seconds are over.
pub fn wait_for_boot(master: &mut Master, s: u64) -> bool {
    for _ in 0..s * 10 {
        master.run_ms(100);
        if booted(master) {
            master.run_ms(100);
            return true;
        }
    }
    false
}

pub fn plant(master: &mut Master) -> &mut Plant<f32> {
    master.drive(NODE).plant()
}

/// A commissioned drive in another world.
pub fn made(change: impl FnOnce(&mut Parameters)) -> Master {
    let mut settings = md80();
    change(&mut settings.plant);
    let mut master = Master::with(vec![settings]);
    master.run_ms(50);
    master.write_u16(NODE, 0x2000, 12, 0);
    master
}

/// With an encoder on its output, which is in use; calibrated or not.
pub fn with_output(calibrated: bool, change: impl FnOnce(&mut OutputEncoder)) -> Master {
    let mut encoder = OutputEncoder::ideal(1.0 / 9.0);
    change(&mut encoder);
    let mut master = made(|plant| plant.output_encoder = Some(encoder));
    master.write(NODE, 0x2000, 8, &(1.0_f32 / 9.0).to_le_bytes());
    master.write_i32(NODE, 0x2005, 1, 1);
    master.write_i32(NODE, 0x2005, 3, 1);
    master.run_ms(5);
    if calibrated {
        mode(&mut master, -1);
        master.log.clear();
        master.write(NODE, 0x2003, 4, &[1]);
        assert!(wait_for_boot(&mut master, 40));
        master.write_u16(NODE, 0x2000, 12, 0);
        mode(&mut master, 0);
    }
    master
}

pub fn output() -> Master {
    with_output(true, |_| {})
}

pub fn reset_node(master: &mut Master) {
    master.log.clear();
    master.send(0, &[0x81, NODE]);
    master.run_ms(100);
    assert!(booted(master));
}

pub fn velocity(master: &mut Master, rpm: i32) {
    ramps(master, 600);
    enable(master, 3);
    master.write_i32(NODE, 0x60FF, 0, rpm);
}

/// A calibration of a drive out of the box, or that of the output encoder.
pub fn calibrated(master: &mut Master, sub: u8) {
    mode(master, -1);
    master.write(NODE, 0x2003, sub, &[1]);
    master.run_ms(20_000);
}

impl Master {
    /// All bytes of an object, in one message or in segments.
    pub fn upload(&mut self, index: u16, sub: u8) -> Vec<u8> {
        let [low, high] = index.to_le_bytes();
        let answer = self.exchange(&[0x40, low, high, sub, 0, 0, 0, 0]);
        assert_eq!(answer[0] & 0xE0, 0x40, "{index:04X},{sub}: {answer:02X?}");
        if answer[0] & 2 != 0 {
            let unused = usize::from(answer[0] >> 2 & 3);
            return answer[4..8 - unused].to_vec();
        }
        let mut bytes = Vec::new();
        let mut toggle = 0;
        loop {
            let answer = self.exchange(&[0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            let unused = usize::from(answer[0] >> 1 & 7);
            bytes.extend(&answer[1..8 - unused]);
            if answer[0] & 1 != 0 {
                return bytes;
            }
            toggle ^= 0x10;
        }
    }

    /// A request to the drive's SDO server, and what it answers.
    fn exchange(&mut self, request: &[u8; 8]) -> [u8; 8] {
        self.log.clear();
        self.send(0x600 + u16::from(NODE), request);
        self.run_ms(5);
        let answers = 0x580 + u32::from(NODE);
        let mut frames = self.log.iter();
        let answer = frames.find(|t| t.frame.raw_id() == answers);
        answer.expect("an answer").frame.bytes()
    }
}

impl Master {
    /// Writes an object in segments; the abort code if it is refused.
    pub fn download(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let [a, b, ..] = (bytes.len() as u32).to_le_bytes();
        let answer = self.exchange(&[0x21, low, high, sub, a, b, 0, 0]);
        let refused = |answer: &[u8; 8]| {
            let [.., a, b, c, d] = *answer;
            (answer[0] == 0x80).then_some(u32::from_le_bytes([a, b, c, d]))
        };
        if let Some(code) = refused(&answer) {
            return Err(code);
        }
        assert_eq!(answer[0], 0x60);
        let mut toggle = 0;
        let mut parts = bytes.chunks(7).peekable();
        while let Some(part) = parts.next() {
            let unused = (7 - part.len()) as u8;
            let is_last = u8::from(parts.peek().is_none());
            let mut request = [0; 8];
            request[0] = toggle | unused << 1 | is_last;
            request[1..=part.len()].copy_from_slice(part);
            let answer = self.exchange(&request);
            if let Some(code) = refused(&answer) {
                return Err(code);
            }
            assert_eq!(answer[0], 0x20 | toggle);
            toggle ^= 0x10;
        }
        Ok(())
    }
}
