//! Homing of an extended P3 on a bus, on a rail with bouncing switches and hard stops.

mod master;

use std::ops::{Deref, DerefMut};

use master::{FAULT, Master, OPERATION_ENABLED, id};
use personalities::p3_extended::P3_EXTENDED;
use plant::{Stops, Switch, Switches};
use sim::DriveSettings;

const TURN: f64 = 4096.0;
/// The encoder's reading at the shaft's start.
const START: f64 = 3_576.0;

/// Contacts that bounce for 0.7 ms and open 30 counts behind where they close.
fn contact(switch: Switch) -> Switch {
    Switch {
        hysteresis_turns: 30.0 / TURN,
        bounce_s: 0.7e-3,
        active_low: true,
        ..switch
    }
}

/// Stops at −8 and 8 turns, limit switches at −6 and 6, a home switch from 1.2 to 2.1.
fn rail() -> Line {
    let mut settings = DriveSettings::new(id(1), &P3_EXTENDED);
    settings.plant.load.stops = Some(Stops::between(-8.0, 8.0));
    settings.plant.switches = Switches {
        negative_limit: Some(contact(Switch::below(-6.0))),
        positive_limit: Some(contact(Switch::above(6.0))),
        home: Some(contact(Switch::between(1.2, 2.1))),
    };
    let mut master = Line(Master::with(vec![settings]));
    master.set(0x2431, 1, 0b111, 4);
    master
}

/// A master of one drive that speaks plain CiA 301.
struct Line(Master);

impl Deref for Line {
    type Target = Master;

    fn deref(&self) -> &Master {
        &self.0
    }
}

impl DerefMut for Line {
    fn deref_mut(&mut self) -> &mut Master {
        &mut self.0
    }
}

impl Line {
    /// An SDO request of eight bytes, as CiA 301 wants it, and the data of its answer.
    #[track_caller]
    fn sdo(&mut self, request: [u8; 8]) -> i32 {
        self.send(0x601, &request);
        let until = self.now().plus_ms(20);
        loop {
            assert!(self.bus.run_to_frame(until), "an answer");
            let new = self.bus.take_traffic();
            self.log.extend(new.iter().copied());
            if let Some(answer) = new.iter().find(|t| t.frame.raw_id() == 0x581) {
                let [command, _, _, _, data @ ..] = answer.frame.bytes();
                assert_ne!(command, 0x80, "{request:02X?}: {data:02X?}");
                return i32::from_le_bytes(data);
            }
        }
    }

    /// An expedited download of so many bytes.
    #[track_caller]
    fn set(&mut self, index: u16, sub: u8, value: i32, bytes: usize) {
        let [low, high] = index.to_le_bytes();
        let mut request = [0x23 | (4 - bytes as u8) << 2, low, high, sub, 0, 0, 0, 0];
        request[4..4 + bytes].copy_from_slice(&value.to_le_bytes()[..bytes]);
        self.sdo(request);
    }

    #[track_caller]
    fn get(&mut self, index: u16, sub: u8) -> i32 {
        let [low, high] = index.to_le_bytes();
        self.sdo([0x40, low, high, sub, 0, 0, 0, 0])
    }

    fn word(&mut self, word: i32) {
        self.set(0x6040, 0, word, 2);
    }

    fn enable(&mut self, mode: i32) {
        self.set(0x6060, 0, mode, 1);
        self.word(0x06);
        self.word(0x0F);
        assert_eq!(self.get(0x6041, 0) as u16 & 0x6F, OPERATION_ENABLED);
    }

    /// Starts homing and waits for its end: bits 10, 12 and 13.
    fn home(&mut self) -> (bool, bool, bool) {
        self.word(0x1F);
        for _ in 0..30_000 {
            self.run_ms(1);
            if self.homing().0 {
                break;
            }
        }
        self.homing()
    }

    /// Bits 10, 12 and 13.
    fn homing(&mut self) -> (bool, bool, bool) {
        let status = self.get(0x6041, 0);
        (
            status & 1 << 10 != 0,
            status & 1 << 12 != 0,
            status & 1 << 13 != 0,
        )
    }

    /// Where the position is 0, counts from the shaft's start.
    fn zero(&mut self) -> f64 {
        let position = self.drive(1).core().unwrap().feedback().position;
        let place = self.drive(1).plant().truth().position_turns() * TURN;
        place - f64::from(position)
    }
}

#[test]
fn methods_find_their_switches_in_spite_of_bounces() {
    // Method, and what the diagram and the hysteresis make the home point: place and direction.
    let open = 30.0;
    for (method, edge, direction) in [
        (17, -6.0 * TURN + open, 1.0),
        (18, 6.0 * TURN - open, -1.0),
        (23, 1.2 * TURN - open, -1.0),
        (24, 1.2 * TURN, 1.0),
        (25, 2.1 * TURN, -1.0),
        (26, 2.1 * TURN + open, 1.0),
        (29, 1.2 * TURN, 1.0),
        (30, 1.2 * TURN - open, -1.0),
    ] {
        let mut master = rail();
        master.set(0x6098, 0, method, 1);
        master.enable(6);
        assert_eq!(master.home(), (true, true, false), "method {method}");
        let off = (master.zero() - edge) * direction;
        // The first of the bounces may be missed by some periods.
        assert!((-2.0..6.0).contains(&off), "method {method}: {off}");
        assert!(master.emergencies(1).is_empty());
    }
}

#[test]
fn hard_stops_and_index_give_the_same_home_point_each_time() {
    let mut places = Vec::new();
    for offset in [0, 777, -3_333] {
        let mut master = rail();
        // Behind the limit switches.
        master.set(0x2431, 1, 0, 4);
        master.set(0x6098, 0, -1, 1);
        master.set(0x607C, 0, offset, 4);
        // The switches read "pressed" without their inversion, so they are taken off.
        let plant = master.drive(1).plant();
        for switch in [
            plant::SwitchName::NegativeLimit,
            plant::SwitchName::PositiveLimit,
        ] {
            plant.hold_switch(switch, Some(true));
        }
        master.enable(6);
        assert_eq!(master.home(), (true, true, false));
        places.push(master.zero() + f64::from(offset));
    }
    // −8 turns, then the first index: the encoder's count 0.
    let index = (((-8.0 * TURN + START) / TURN).ceil()) * TURN - START;
    for place in places {
        assert!((place - index).abs() < 1.5, "{place} {index}");
    }
}

#[test]
fn a_limit_switch_stops_a_move_where_it_is_looked_for() {
    let mut master = rail();
    master.set(0x2410, 6, 1, 1);
    master.set(0x60FF, 0, 100_000, 4);
    master.enable(3);
    master.run_ms(1_500);
    assert_eq!(master.emergencies(1)[0], [0x80, 0x73, 0x81, 0, 0, 0, 0, 0]);
    assert_eq!(master.get(0x603F, 0), 0x7380);
    assert_eq!(master.get(0x1002, 0), 1 << 14);
    assert_eq!(master.get(0x6041, 0) as u16 & 0x4F, FAULT);
}
