//! An axis on a rail with switches, index pulses and hard stops.

use cia402::{Captured, Edge, HomingInputs, Mode, Statusword, Switch, Trigger};

use crate::rig::{self, Rig, STANDARD};

/// Where the rail's switches are, in places of the rail. Each is active from its first to below its
/// second place.
#[derive(Clone, Copy)]
pub(crate) struct Rail {
    pub(crate) negative_limit: (i32, i32),
    pub(crate) positive_limit: (i32, i32),
    pub(crate) home: (i32, i32),
    /// Places of the index pulses, this and every turn.
    pub(crate) index: i32,
    /// The rail's ends.
    pub(crate) stops: (i32, i32),
}

pub(crate) const TURN: i32 = 4096;

pub(crate) const FAR: i32 = 1_000_000;

/// A switch that is nowhere.
pub(crate) const NOWHERE: (i32, i32) = (FAR, FAR);

pub(crate) const NEGATIVE_LIMIT: i32 = -30_011;

pub(crate) const POSITIVE_LIMIT: i32 = 30_023;

pub(crate) const RAIL: Rail = Rail {
    negative_limit: (-FAR, NEGATIVE_LIMIT),
    positive_limit: (POSITIVE_LIMIT, FAR),
    home: (FAR, FAR),
    index: 1_003,
    stops: (-FAR, FAR),
};

pub(crate) struct Machine {
    pub(crate) rig: Rig,
    pub(crate) rail: Rail,
    pub(crate) trigger: Option<Trigger>,
    pub(crate) levels: [bool; 3],
    pub(crate) place: i32,
    /// Velocity when home was attained, or the last one before if that is 0 already.
    pub(crate) final_velocity: Option<f64>,
    pub(crate) last_velocity: f64,
    /// The first direction in which it moved.
    pub(crate) first_direction: f64,
}

impl Machine {
    /// In mode 6, standing at a place of the rail.
    pub(crate) fn at(rail: Rail, place: i32) -> Machine {
        let mut rig = Rig::new(&STANDARD);
        rig.configuration.homing.switch_velocity = 20_000.0;
        rig.configuration.homing.zero_velocity = 2_000.0;
        rig.configuration.homing.acceleration = 400_000.0;
        rig.configuration.homing.counts_per_turn = TURN as u32;
        rig.configuration.homing.stop_torque_pm = 300.0;
        rig.configuration.homing.stop_time_ms = 50;
        rig.configuration.homing.back_off = 100;
        rig.configuration.homing.timeout_ms = 60_000;
        rig.place(place);
        let mut machine = Machine {
            rig,
            rail,
            trigger: None,
            levels: [false; 3],
            place,
            final_velocity: None,
            last_velocity: 0.0,
            first_direction: 0.0,
        };
        machine.levels = machine.levels_at(place);
        machine.show();
        machine.rig.word(0x06);
        machine.rig.word(0x0F);
        machine.rig.mode(Mode::HOMING).unwrap();
        machine
    }

    pub(crate) fn levels_at(&self, place: i32) -> [bool; 3] {
        let within = |(from, to): (i32, i32)| (from..to).contains(&place);
        [
            within(self.rail.negative_limit),
            within(self.rail.positive_limit),
            within(self.rail.home),
        ]
    }

    pub(crate) fn show(&mut self) {
        let [negative_limit, positive_limit, home] = self.levels;
        self.rig.actual.homing = HomingInputs {
            negative_limit,
            positive_limit,
            home,
            ..self.rig.actual.homing
        };
    }

    /// The place on the rail, whatever it is called.
    pub(crate) fn place_now(&self) -> i32 {
        self.rig.actual.position - self.rig.renamed
    }

    /// What the control half sees each period.
    pub(crate) fn period(&mut self) {
        self.rig.period();
        let (low, high) = self.rail.stops;
        let named = f64::from(self.rig.renamed);
        let (low, high) = (f64::from(low) + named, f64::from(high) + named);
        let held = self.rig.unwrapped.clamp(low, high);
        let stopped = held != self.rig.unwrapped;
        self.rig.unwrapped = held;
        if stopped {
            self.rig.actual.position = held as i32;
            self.rig.actual.velocity = 0.0;
        }
        self.rig.actual.torque_pm = if stopped {
            self.rig.axis.torque_limit_pm(&self.rig.configuration)
        } else {
            0.0
        };
        let place = self.place_now();
        let before = core::mem::replace(&mut self.place, place);
        let levels = self.levels_at(place);
        let old = core::mem::replace(&mut self.levels, levels);
        self.show();
        let Some(trigger) = self.trigger else { return };
        let captured = &mut self.rig.actual.homing.captured;
        let position = self.rig.actual.position;
        let waits_for_index = trigger.index && (trigger.edge.is_none() || captured.edge.is_some());
        if waits_for_index && captured.index.is_none() {
            let turns = |place: i32| (place - self.rail.index).div_euclid(TURN);
            if place > before && turns(place) != turns(before) {
                captured.index = Some(position - (place - self.rail.index).rem_euclid(TURN));
            } else if place < before && turns(place - 1) != turns(before - 1) {
                captured.index = Some(position + (self.rail.index - place).rem_euclid(TURN));
            }
        }
        if let Some((switch, edge)) = trigger.edge
            && captured.edge.is_none()
        {
            let number = match switch {
                Switch::NegativeLimit => 0,
                Switch::PositiveLimit => 1,
                Switch::Home => 2,
            };
            let changed = (old[number], levels[number]);
            let wanted = match edge {
                Edge::Rising => (false, true),
                Edge::Falling => (true, false),
            };
            if changed == wanted {
                captured.edge = Some(position);
            }
        }
    }

    pub(crate) fn arm(&mut self) {
        if let Some(trigger) = self.rig.axis.take_trigger() {
            self.trigger = Some(trigger);
            self.rig.actual.homing.captured = Captured {
                serial: trigger.serial,
                ..Captured::default()
            };
        }
    }

    pub(crate) fn run_ms(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.rig.tick();
            self.arm();
            for _ in 0..1_000_000 / rig::PERIOD_NS {
                self.period();
            }
            let velocity = self.rig.sample().velocity;
            if self.first_direction == 0.0 {
                self.first_direction = if velocity == 0.0 {
                    0.0
                } else {
                    velocity.signum()
                };
            }
            if self.final_velocity.is_none() && velocity != 0.0 {
                self.last_velocity = velocity;
            }
            if self.status().homing_attained() && self.final_velocity.is_none() {
                self.final_velocity = Some(self.last_velocity);
            }
        }
    }

    pub(crate) fn start(&mut self) {
        self.rig.word(0x1F);
        self.arm();
    }

    pub(crate) fn status(&self) -> Statusword {
        self.rig.axis.statusword()
    }

    /// Bits 10, 12 and 13 as digits.
    pub(crate) fn bits(&self) -> (u8, u8, u8) {
        let status = self.status();
        let digit = |n| u8::from(status.bit(n));
        (digit(10), digit(12), digit(13))
    }

    /// Until it is done or has failed, and stands.
    pub(crate) fn finish(&mut self) {
        for _ in 0..30_000 {
            self.run_ms(1);
            if matches!(self.bits(), (1, ..)) {
                return;
            }
        }
        panic!("no end: {:?}", self.status());
    }

    /// The place that got the position 0x607C.
    pub(crate) fn home(&self) -> i32 {
        self.rig.configuration.homing.offset - self.rig.renamed
    }
}

pub(crate) fn home(method: i8, rail: Rail, place: i32) -> Machine {
    let mut machine = Machine::at(rail, place);
    machine.rig.configuration.homing.method = method;
    machine.rig.configuration.homing.offset = 123_456;
    assert_eq!(machine.bits(), (1, 0, 0), "not started");
    machine.start();
    machine.finish();
    machine
}

/// The first index pulse from a place on, in a direction.
pub(crate) fn index_from(place: i32, direction: f64) -> i32 {
    let turns = |x: i32| (x - RAIL.index).div_euclid(TURN);
    if direction > 0.0 {
        RAIL.index + (turns(place) + 1) * TURN
    } else {
        RAIL.index + turns(place - 1) * TURN
    }
}
