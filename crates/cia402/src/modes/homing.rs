//! Mode 6, homing: the way to a place that the axis knows again, which gets position 0x607C.

use crate::arithmetic::{magnitude, measured};
use crate::homing::{Direction, Edge, From, Goal, Switch};
use crate::path::{Path, TICK_S};
use crate::ramp::{ramp, velocity_segment};
use crate::{Controlword, Demand, HomingConfiguration, HomingError, HomingMethod, Trigger};

use super::{Bits, Generator, Inputs, Limited};

/// The next index pulse is at most a turn away; the rest is for the edge of the pulse.
const MOST_TURNS: f64 = 1.25;
/// The share of the torque limit from which on an axis counts as pressing.
const PRESSES: f64 = 0.9;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Status {
    /// Not started, or interrupted.
    Waiting,
    Running,
    Attained,
    Failed(HomingError),
}

/// A part of the way.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// Where the way begins is not decided yet.
    Begin,
    /// A leg of a search, by its number.
    Leg { from: From, number: u8 },
    /// On to the index pulse; from where on it is counted.
    Index { direction: Direction, since: i32 },
    /// Towards a hard stop.
    Press(Direction),
    /// Back from a hard stop that was at `since`.
    BackOff { direction: Direction, since: i32 },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Homing {
    status: Status,
    goal: Goal,
    stage: Stage,
    /// The stage begins when the axis stands.
    settles: bool,
    /// Demand at the present tick, counts/s.
    velocity: f64,
    /// The position held at rest, and its fraction.
    hold: Option<(i32, f64)>,
    trigger: Trigger,
    trigger_is_new: bool,
    /// By how much all positions become greater, until taken.
    shift: Option<i32>,
    /// Where homing began.
    start: i32,
    elapsed_ms: u32,
    pressed_ms: u16,
    velocity_limited: bool,
}

impl Homing {
    pub(crate) fn new(inputs: &Inputs<'_>) -> Homing {
        let present = inputs.present;
        Homing {
            status: Status::Waiting,
            goal: Goal::Here,
            stage: Stage::Begin,
            settles: false,
            velocity: present.velocity,
            hold: (present.velocity == 0.0).then_some((present.position, present.fraction)),
            trigger: Trigger {
                edge: None,
                index: false,
                serial: 0,
            },
            trigger_is_new: false,
            shift: None,
            start: present.position,
            elapsed_ms: 0,
            pressed_ms: 0,
            velocity_limited: false,
        }
    }

    /// Whether the axis is on its way.
    pub(crate) fn is_running(&self) -> bool {
        self.status == Status::Running
    }

    /// Why homing has failed, if it has.
    pub(crate) fn error(&self) -> Option<HomingError> {
        match self.status {
            Status::Failed(error) => Some(error),
            _ => None,
        }
    }

    /// The trigger, if it changed since the last call.
    pub(crate) fn take_trigger(&mut self) -> Option<Trigger> {
        core::mem::take(&mut self.trigger_is_new).then_some(self.trigger)
    }

    pub(crate) fn trigger(&self) -> Trigger {
        self.trigger
    }

    /// By how much positions become greater, once home is attained.
    pub(crate) fn take_shift(&mut self) -> Option<i32> {
        self.shift.take()
    }

    /// Whether the torque is held back, because the axis is to press against a stop.
    pub(crate) fn presses(&self) -> bool {
        let backs_off = matches!(self.stage, Stage::BackOff { .. }) && self.hold.is_none();
        matches!(self.goal, Goal::HardStop { .. }) && (self.is_running() || backs_off)
    }

    fn begin_procedure(&mut self, inputs: &Inputs<'_>) {
        let homing = &inputs.configuration.homing;
        self.trigger.serial = inputs.actual.homing.captured.serial;
        self.start = inputs.actual.position;
        self.elapsed_ms = 0;
        self.pressed_ms = 0;
        self.stage = Stage::Begin;
        self.settles = true;
        let Some(method) = HomingMethod::new(homing.method) else {
            return self.fail(HomingError::NoMethod);
        };
        self.goal = method.goal();
        let needed: &[f32] = match self.goal {
            Goal::Here => &[],
            Goal::Index(_) => &[homing.zero_velocity, homing.acceleration],
            Goal::Switch { .. } | Goal::HardStop { .. } => &[
                homing.switch_velocity,
                homing.zero_velocity,
                homing.acceleration,
            ],
        };
        if needed.iter().any(|value| magnitude(*value) == 0.0) {
            return self.fail(HomingError::NoSpeed);
        }
        self.status = Status::Running;
        // At rest the present position is home at once.
        if self.goal == Goal::Here && self.stands(inputs) {
            self.attain(inputs.actual.position, homing);
        }
    }

    fn fail(&mut self, error: HomingError) {
        self.status = Status::Failed(error);
    }

    fn attain(&mut self, home: i32, homing: &HomingConfiguration) {
        self.status = Status::Attained;
        self.shift = Some(homing.offset.wrapping_sub(home));
    }

    fn stands(&self, inputs: &Inputs<'_>) -> bool {
        let speed = measured(inputs.actual.velocity);
        self.velocity == 0.0 && inputs.configuration.stands(speed)
    }

    fn arm(&mut self, edge: Option<(Switch, Edge)>, index: bool) {
        self.trigger = Trigger {
            edge,
            index,
            serial: self.trigger.serial.wrapping_add(1),
        };
        self.trigger_is_new = true;
    }

    /// The next stage begins when the axis has come to rest.
    fn turn(&mut self, stage: Stage) {
        self.stage = stage;
        self.settles = true;
    }

    /// The axis stands: what is looked for in the stage that begins.
    fn begin_stage(&mut self, inputs: &Inputs<'_>) {
        let seen = &inputs.actual.homing;
        if self.stage == Stage::Begin {
            self.stage = match self.goal {
                Goal::Here => Stage::Begin,
                Goal::Index(direction) => Stage::Index {
                    direction,
                    since: inputs.actual.position,
                },
                Goal::HardStop { direction, .. } => Stage::Press(direction),
                Goal::Switch { search, .. } => Stage::Leg {
                    from: if seen.is_active(search.switch) {
                        From::On
                    } else {
                        From::Off
                    },
                    number: 0,
                },
            };
        }
        match (self.stage, self.goal) {
            (Stage::Leg { from, number }, Goal::Switch { search, index }) => {
                let legs = search.legs(from);
                let is_last = usize::from(number) + 1 >= legs.len();
                if let Some(leg) = legs.get(usize::from(number)) {
                    self.arm(Some((search.switch, leg.until)), index && is_last);
                }
            }
            (Stage::Index { .. }, _) => self.arm(None, true),
            _ => {}
        }
    }

    /// One millisecond more of the way: the speed to go on with, counts/s.
    fn advance(&mut self, inputs: &Inputs<'_>) -> Result<f64, HomingError> {
        let homing = &inputs.configuration.homing;
        let seen = &inputs.actual.homing;
        if self.goal == Goal::Here {
            if self.stands(inputs) {
                self.attain(inputs.actual.position, homing);
            }
            return Ok(0.0);
        }
        self.elapsed_ms = self.elapsed_ms.saturating_add(1);
        if homing.timeout_ms != 0 && self.elapsed_ms > homing.timeout_ms {
            return Err(HomingError::TimedOut);
        }
        let way = inputs.actual.position.wrapping_sub(self.start);
        if homing.range != 0 && way.unsigned_abs() > homing.range {
            return Err(HomingError::OutOfRange);
        }
        if seen.negative_limit && seen.positive_limit {
            return Err(HomingError::BothLimits);
        }
        if self.settles {
            if !self.stands(inputs) {
                return Ok(0.0);
            }
            self.settles = false;
            self.begin_stage(inputs);
        }
        match self.stage {
            Stage::Leg { from, number } => self.search(from, number, inputs),
            Stage::Index { direction, since } => self.find_index(direction, since, inputs),
            Stage::Press(direction) => self.press(direction, inputs),
            Stage::Begin | Stage::BackOff { .. } => Ok(0.0),
        }
    }

    /// What the trigger in force has captured.
    fn captured(&self, inputs: &Inputs<'_>) -> (Option<i32>, Option<i32>) {
        let captured = &inputs.actual.homing.captured;
        match captured.serial == self.trigger.serial {
            true => (captured.edge, captured.index),
            false => (None, None),
        }
    }

    fn search(&mut self, from: From, number: u8, inputs: &Inputs<'_>) -> Result<f64, HomingError> {
        let Goal::Switch { search, index } = self.goal else {
            return Ok(0.0);
        };
        let homing = &inputs.configuration.homing;
        let legs = search.legs(from);
        let Some(leg) = legs.get(usize::from(number)) else {
            return Ok(0.0);
        };
        let is_last = usize::from(number) + 1 >= legs.len();
        match self.captured(inputs).0 {
            Some(since) if is_last && index => {
                self.stage = Stage::Index {
                    direction: leg.direction,
                    since,
                };
                return self.find_index(leg.direction, since, inputs);
            }
            Some(home) if is_last => {
                self.attain(home, homing);
                return Ok(0.0);
            }
            Some(_) => {
                self.turn(Stage::Leg {
                    from,
                    number: number.saturating_add(1),
                });
                return Ok(0.0);
            }
            None => {}
        }
        if leg.direction.limit() != search.switch
            && let Err(error) = free(leg.direction, inputs)
        {
            // The first leg of 7 to 14 may lead away from the switch.
            let may_turn = from == From::Off && number == 0 && !search.legs(From::Limit).is_empty();
            if !may_turn {
                return Err(error);
            }
            self.turn(Stage::Leg {
                from: From::Limit,
                number: 0,
            });
            return Ok(0.0);
        }
        // The first leg finds the switch, the second comes back to it.
        let speed = match number {
            0 => homing.switch_velocity,
            _ => homing.zero_velocity,
        };
        Ok(leg.direction.sign() * magnitude(speed))
    }

    fn find_index(
        &mut self,
        direction: Direction,
        since: i32,
        inputs: &Inputs<'_>,
    ) -> Result<f64, HomingError> {
        let homing = &inputs.configuration.homing;
        if let (_, Some(home)) = self.captured(inputs) {
            self.attain(home, homing);
            return Ok(0.0);
        }
        free(direction, inputs)?;
        let way = f64::from(inputs.actual.position.wrapping_sub(since)) * direction.sign();
        if way > MOST_TURNS * f64::from(homing.counts_per_turn) {
            return Err(HomingError::NoIndex);
        }
        Ok(direction.sign() * magnitude(homing.zero_velocity))
    }

    /// One millisecond more of going `direction`; whether the axis has pressed for long enough.
    fn is_stopped(&mut self, inputs: &Inputs<'_>) -> bool {
        let homing = &inputs.configuration.homing;
        let torque = measured(inputs.actual.torque_pm).abs();
        let presses = inputs.actual.limited || torque >= PRESSES * magnitude(homing.stop_torque_pm);
        let stands = inputs
            .configuration
            .stands(measured(inputs.actual.velocity));
        self.pressed_ms = match presses && stands && self.velocity != 0.0 {
            true => self.pressed_ms.saturating_add(1),
            false => 0,
        };
        self.pressed_ms > homing.stop_time_ms
    }

    fn press(&mut self, direction: Direction, inputs: &Inputs<'_>) -> Result<f64, HomingError> {
        let homing = &inputs.configuration.homing;
        free(direction, inputs)?;
        if !self.is_stopped(inputs) {
            return Ok(direction.sign() * magnitude(homing.switch_velocity));
        }
        self.pressed_ms = 0;
        let since = inputs.actual.position;
        if since.wrapping_sub(self.start).unsigned_abs() < homing.least_way {
            return Err(HomingError::TooNear);
        }
        let direction = direction.opposite();
        if let Goal::HardStop { index: true, .. } = self.goal {
            self.turn(Stage::Index { direction, since });
        } else {
            self.attain(since, homing);
            self.stage = Stage::BackOff { direction, since };
        }
        Ok(0.0)
    }

    /// After home is attained: away from the stop, so that nothing presses any more.
    fn back_off(&mut self, inputs: &Inputs<'_>) -> f64 {
        let Stage::BackOff { direction, since } = self.stage else {
            return 0.0;
        };
        let homing = &inputs.configuration.homing;
        let way = f64::from(inputs.actual.position.wrapping_sub(since)) * direction.sign();
        let is_free = free(direction, inputs).is_ok();
        if way >= f64::from(homing.back_off) || !is_free || self.is_stopped(inputs) {
            self.stage = Stage::Begin;
            return 0.0;
        }
        direction.sign() * magnitude(homing.zero_velocity)
    }
}

/// Nothing is in the way: the limit switch at that end is not active.
fn free(direction: Direction, inputs: &Inputs<'_>) -> Result<(), HomingError> {
    match inputs.actual.homing.is_active(direction.limit()) {
        false => Ok(()),
        true => Err(match direction {
            Direction::Negative => HomingError::NegativeLimit,
            Direction::Positive => HomingError::PositiveLimit,
        }),
    }
}

impl Generator for Homing {
    fn begin(&self) -> Demand {
        match self.hold {
            Some((position, fraction)) => Path::hold(i64::from(position), fraction),
            None => velocity_segment(self.velocity, self.velocity),
        }
    }

    /// Bit 4: 1 starts, 0 interrupts.
    fn controlword(&mut self, before: Controlword, now: Controlword, inputs: &Inputs<'_>) {
        match (before.start_homing(), now.start_homing()) {
            (false, true) => self.begin_procedure(inputs),
            (_, false) if self.is_running() => self.status = Status::Waiting,
            _ => {}
        }
    }

    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        let configuration = inputs.configuration;
        let wanted = match self.status {
            Status::Running => self.advance(inputs),
            Status::Attained => Ok(self.back_off(inputs)),
            Status::Waiting | Status::Failed(_) => Ok(0.0),
        };
        let wanted = wanted.unwrap_or_else(|error| {
            self.fail(error);
            0.0
        });
        let target = configuration.velocity(wanted);
        self.velocity_limited = target.limited;
        if target.value != 0.0 {
            self.hold = None;
        } else if self.hold.is_none() && self.stands(inputs) {
            self.hold = Some((inputs.actual.position, 0.0));
        }
        if self.hold.is_some() {
            return Some(self.begin());
        }
        let rate = configuration.homing.acceleration;
        let up = configuration.acceleration(rate).value;
        let down = configuration
            .deceleration(rate, configuration.deceleration)
            .value;
        let next = ramp(self.velocity, target.value, up, down, TICK_S);
        let demand = velocity_segment(self.velocity, next);
        self.velocity = next;
        Some(demand)
    }

    /// The procedure goes on where it was.
    fn resume(&mut self, inputs: &Inputs<'_>) {
        let present = inputs.present;
        self.velocity = present.velocity;
        self.hold = (present.velocity == 0.0).then_some((present.position, present.fraction));
    }

    fn shift(&mut self, offset: i32) {
        self.start = self.start.wrapping_add(offset);
        if let Some((position, _)) = &mut self.hold {
            *position = position.wrapping_add(offset);
        }
        if let Stage::Index { since, .. } | Stage::BackOff { since, .. } = &mut self.stage {
            *since = since.wrapping_add(offset);
        }
    }

    /// CiA 402: bits 10 and 12; bit 13 is [`Homing::error`].
    fn bits(&self) -> Bits {
        Bits {
            target_reached: match self.status {
                Status::Waiting => true,
                Status::Running => false,
                Status::Attained | Status::Failed(_) => self.hold.is_some(),
            },
            specific: self.status == Status::Attained,
        }
    }

    fn limited(&self) -> Limited {
        Limited {
            velocity: self.velocity_limited,
            ..Limited::default()
        }
    }
}
