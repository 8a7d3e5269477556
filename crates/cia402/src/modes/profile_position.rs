//! Mode 1, profile position: set-points handed over by a handshake, moved to by a profile.

use crate::path::Path;
use crate::profile::ProfileLimits;
use crate::windows::Arrival;
use crate::{Controlword, Demand, Target};

use super::{Bits, Generator, Inputs, Limited};

/// A set-point with everything that belongs to it, as it was at the rising edge of bit 4.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SetPoint {
    target: i32,
    relative: bool,
    /// Bit 9: the set-point before this one is passed without stopping.
    pass: bool,
    profile_velocity: f32,
    acceleration: f32,
    deceleration: f32,
    jerk: f32,
}

impl SetPoint {
    fn of(word: Controlword, inputs: &Inputs<'_>) -> SetPoint {
        SetPoint {
            target: inputs.targets.position,
            relative: word.relative(),
            pass: word.change_on_set_point(),
            profile_velocity: inputs.configuration.profile_velocity,
            acceleration: inputs.configuration.acceleration,
            deceleration: inputs.configuration.deceleration,
            jerk: inputs.configuration.jerk,
        }
    }
}

/// A set-point on its way: the target in the path's counts, and what limits cut.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Move {
    target: i64,
    limits: ProfileLimits,
    jerk: f32,
    cut: Limited,
}

/// In which direction the active target is passed on the way to the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Passing {
    Upwards,
    Downwards,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProfilePosition {
    path: Path,
    begun: bool,
    /// The set-point in process or reached.
    active: Option<Move>,
    /// The next one: the buffer of a "set of set-points".
    next: Option<SetPoint>,
    passing: Option<Passing>,
    /// The profile must be planned anew at the next tick.
    plan: bool,
    acknowledge: bool,
    reached: bool,
    arrival: Arrival,
    /// The controlword's bit 4 as last written.
    new_set_point: bool,
}

impl ProfilePosition {
    pub(crate) fn new(inputs: &Inputs<'_>) -> ProfilePosition {
        ProfilePosition {
            path: Path::stop(&inputs.present, inputs.configuration.slow_down(inputs.mode)),
            begun: false,
            active: None,
            next: None,
            passing: None,
            plan: false,
            acknowledge: false,
            reached: false,
            arrival: Arrival::default(),
            new_set_point: false,
        }
    }

    /// The target of a set-point that follows `preceding`, in the path's counts.
    fn target(&self, set_point: &SetPoint, preceding: Option<&Move>, inputs: &Inputs<'_>) -> Move {
        // The path's counts do not wrap; this is where its 32-bit count 0 lies.
        let position = self.path.position();
        let zero = position.saturating_sub(i64::from(position as i32));
        let target = if set_point.relative {
            // CiA 402: relative to the preceding target; before the first one, to the demand.
            let base = preceding.map_or(position, |preceding| preceding.target);
            base.saturating_add(i64::from(set_point.target))
        } else {
            zero.saturating_add(i64::from(set_point.target))
        };
        let wanted = target.saturating_sub(zero);
        let within = inputs.configuration.position(wanted);
        let (limits, velocity, rates) = inputs.configuration.profile(
            set_point.profile_velocity,
            set_point.acceleration,
            set_point.deceleration,
        );
        Move {
            target: zero.saturating_add(within.value),
            limits,
            jerk: set_point.jerk,
            cut: Limited {
                above: within.above(&wanted),
                below: within.below(&wanted),
                velocity: velocity.limited,
                acceleration: rates.limited,
                torque: false,
            },
        }
    }

    fn start(&mut self, set_point: &SetPoint, inputs: &Inputs<'_>) {
        self.active = Some(self.target(set_point, self.active.as_ref(), inputs));
        self.plan = true;
        self.reached = false;
        self.arrival = Arrival::default();
    }

    /// Whether a set-point is in process.
    fn busy(&self) -> bool {
        self.active.is_some() && !self.reached
    }

    /// The target behind the active one, if that is to be passed without stopping (bit 9) and lies
    /// on the way. If the axis must turn round, it stops at the active target all the same.
    fn beyond(&self, active: &Move, inputs: &Inputs<'_>) -> Option<(Passing, i64)> {
        let next = self.next.filter(|next| next.pass)?;
        let target = self.target(&next, Some(active), inputs).target;
        let position = self.path.position();
        if position <= active.target && active.target < target {
            Some((Passing::Upwards, target))
        } else if position >= active.target && active.target > target {
            Some((Passing::Downwards, target))
        } else {
            None
        }
    }

    /// The buffered set-point, if there is one, comes into process.
    fn take_next(&mut self, inputs: &Inputs<'_>) {
        if let Some(next) = self.next.take() {
            self.start(&next, inputs);
        }
        self.release();
    }

    /// The acknowledge falls when bit 4 is 0 and there is room for one more set-point.
    fn release(&mut self) {
        if !self.new_set_point && self.next.is_none() {
            self.acknowledge = false;
        }
    }
}

impl Generator for ProfilePosition {
    fn begin(&self) -> Demand {
        self.path.begin()
    }

    /// Where there is no handshake: the target, unless the axis is on its way there already.
    fn set_point(&mut self, target: Target, inputs: &Inputs<'_>) -> Option<Demand> {
        let set_point = SetPoint::of(Controlword(0), inputs);
        let is_new = self.active != Some(self.target(&set_point, None, inputs));
        if inputs.at_once && target == Target::Position && is_new {
            self.start(&set_point, inputs);
        }
        None
    }

    fn controlword(&mut self, before: Controlword, now: Controlword, inputs: &Inputs<'_>) {
        if inputs.at_once {
            return;
        }
        self.new_set_point = now.new_set_point();
        if now.new_set_point() && !before.new_set_point() {
            let set_point = SetPoint::of(now, inputs);
            if now.change_immediately() || !self.busy() {
                self.next = None;
                self.start(&set_point, inputs);
                self.acknowledge = true;
            } else if self.next.is_none() {
                self.next = Some(set_point);
                self.plan |= set_point.pass;
                self.acknowledge = true;
            }
            // Else the buffer is full: the set-point is lost, and bit 12, still 1, has said so.
        }
        self.release();
    }

    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        if !self.begun {
            self.path
                .resume(&inputs.present, inputs.configuration.slow_down(inputs.mode));
            self.begun = true;
        }
        if let Some(active) = self.active
            && !self.plan
        {
            let ended = self.path.ended() && self.path.arrives();
            let error = (active.target as i32).wrapping_sub(inputs.actual.position);
            self.reached = self.arrival.tick(
                inputs.configuration.position_window,
                ended,
                f64::from(error).abs(),
            );
            let passed = match self.passing {
                Some(Passing::Upwards) => self.path.position() >= active.target,
                Some(Passing::Downwards) => self.path.position() <= active.target,
                None => false,
            };
            if self.reached || passed {
                self.take_next(inputs);
            }
        }
        if let Some(active) = self.active
            && self.plan
        {
            self.plan = false;
            let beyond = self.beyond(&active, inputs);
            self.passing = beyond.map(|(direction, _)| direction);
            self.path.go(
                beyond.map_or(active.target, |(_, target)| target),
                active.limits,
                active.jerk,
            );
        }
        Some(self.path.tick())
    }

    /// Set-points are taken all the same; they count from where the axis has come to.
    fn halted(&mut self, inputs: &Inputs<'_>) {
        self.path
            .restart(&inputs.present, inputs.configuration.slow_down(inputs.mode));
    }

    fn resume(&mut self, inputs: &Inputs<'_>) {
        self.halted(inputs);
        self.begun = false;
        self.passing = None;
        self.plan = self.active.is_some();
    }

    fn shift(&mut self, offset: i32) {
        self.path.shift(offset);
        // A move goes on to the same place. A buffered set-point counts in the new positions.
        if let Some(active) = &mut self.active {
            active.target = active.target.saturating_add(i64::from(offset));
        }
    }

    fn bits(&self) -> Bits {
        Bits {
            target_reached: self.reached,
            specific: self.acknowledge,
        }
    }

    fn limited(&self) -> Limited {
        let moving = self.busy() && !self.path.ended();
        self.active.map_or(Limited::default(), |active| Limited {
            above: active.cut.above,
            below: active.cut.below,
            velocity: active.cut.velocity && moving,
            acceleration: active.cut.acceleration && moving,
            torque: false,
        })
    }
}
