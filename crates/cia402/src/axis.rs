//! One drive function: the state machine, the mode in force and what they demand.

use crate::arithmetic::{measured, within};
use crate::modes::{Bits, Inputs, Limited, Motion};
use crate::path::Present;
use crate::quick_stop::{OptionCode, QuickStop};
use crate::windows::Monitor;
use crate::{
    Actual, Configuration, Controlword, Demand, Dialect, Mode, ModeSet, State, Statusword, Target,
    Targets,
};

/// What a write of the controlword led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// The state before the write.
    pub before: State,
    /// The state after it.
    pub after: State,
    /// Transition 15 was taken: the owner clears its latched faults, and calls [`Axis::fault`]
    /// again for each cause that is still there.
    pub fault_reset: bool,
}

/// Why a mode of operation was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModeRefused {
    /// The drive does not have it: abort code 0x06090030.
    Unsupported(Mode),
    /// Not in this state: abort code 0x08000022.
    NotNow(State),
}

/// What the axis notices and the drive's fault manager judges. All are conditions of the present
/// moment; latching is the manager's business.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Conditions {
    /// The following error exceeds its warning window (0x6065, 0x6066).
    pub following_warning: bool,
    /// The following error exceeds its fault window (P3: 0x2120, 0x2121).
    pub following_fault: bool,
    /// The velocity error exceeds its warning window (P3: 0x606D, 0x606E).
    pub velocity_warning: bool,
    /// The velocity error exceeds its fault window (P3: 0x2104, 0x2105).
    pub velocity_fault: bool,
    /// The target is beyond the position limits.
    pub position_limited: bool,
    /// The demand is held back by the velocity limit.
    pub velocity_limited: bool,
    /// The demand is held back by the acceleration or deceleration limit.
    pub acceleration_limited: bool,
    /// The target torque exceeds the limit, or the controllers are at one of theirs.
    pub torque_limited: bool,
}

/// One drive function.
///
/// Calls come as things happen: [`write_controlword`](Axis::write_controlword),
/// [`write_mode`](Axis::write_mode) and [`set_point`](Axis::set_point) when objects are received,
/// [`fault`](Axis::fault) when a fault is noticed, [`tick`](Axis::tick) once per millisecond. After
/// any of them [`take_demand`](Axis::take_demand) yields the new demand, if there is one, for the
/// next control boundary.
#[derive(Clone, Debug)]
pub struct Axis {
    dialect: &'static Dialect,
    state: State,
    controlword: Controlword,
    mode: Mode,
    /// At work in operation enabled.
    motion: Motion,
    /// At work in quick stop active.
    quick_stop: Option<QuickStop>,
    demand: Demand,
    /// `demand` has not been taken yet.
    fresh: bool,
    following_warning: Monitor,
    following_fault: Monitor,
    velocity_warning: Monitor,
    velocity_fault: Monitor,
    conditions: Conditions,
    /// From [`Actual`], as last seen.
    voltage: bool,
    warning: bool,
    limited: bool,
}

impl Axis {
    /// An axis that is not ready to switch on.
    pub const fn new(dialect: &'static Dialect) -> Axis {
        Axis {
            dialect,
            state: State::NotReadyToSwitchOn,
            controlword: Controlword(0),
            mode: Mode::IDLE,
            motion: Motion::IDLE,
            quick_stop: None,
            demand: Demand::Off,
            fresh: false,
            following_warning: Monitor::NEW,
            following_fault: Monitor::NEW,
            velocity_warning: Monitor::NEW,
            velocity_fault: Monitor::NEW,
            conditions: Conditions::NONE,
            voltage: false,
            warning: false,
            limited: false,
        }
    }

    /// Transitions 0 and 1: the self-test has passed. Elsewhere it changes nothing.
    pub fn initialised(&mut self) {
        if self.state == State::NotReadyToSwitchOn {
            self.state = State::SwitchOnDisabled;
        }
    }

    /// 0x6040 was written. Transitions act at once, before the write is acknowledged; several may
    /// follow from one write.
    pub fn write_controlword(
        &mut self,
        word: u16,
        configuration: &Configuration,
        targets: &Targets,
        actual: &Actual,
    ) -> Outcome {
        self.observe(actual);
        let now = Controlword(word);
        let previous = core::mem::replace(&mut self.controlword, now);
        let before = self.state;
        let code = match &self.quick_stop {
            Some(stop) => stop.code(),
            None => OptionCode::of(configuration),
        };
        let step = before.written(previous, now, code.stays(), self.dialect);
        let inputs = self.inputs(configuration, targets, actual);
        if step.state != before {
            self.enter(step.state, code, &inputs);
        }
        if self.state == State::OperationEnabled {
            self.motion
                .generator_mut()
                .controlword(previous, now, &inputs);
        }
        Outcome {
            before,
            after: self.state,
            fault_reset: step.fault_reset,
        }
    }

    /// 0x6060 was written. In operation enabled the new mode takes over at once from where the
    /// axis stands, without a jump: from the demand if the old mode had one of the same kind, else
    /// from the motor. The mode in force again changes nothing and is no error.
    pub fn write_mode(
        &mut self,
        mode: i8,
        configuration: &Configuration,
        targets: &Targets,
        actual: &Actual,
    ) -> Result<(), ModeRefused> {
        self.observe(actual);
        let mode = Mode(mode);
        if mode != Mode::IDLE && !self.modes().contains(mode) {
            return Err(ModeRefused::Unsupported(mode));
        }
        let enabled = self.state == State::OperationEnabled;
        if mode != Mode::IDLE && !enabled && self.dialect.modes_only_when_enabled {
            return Err(ModeRefused::NotNow(self.state));
        }
        if mode != self.mode {
            self.mode = mode;
            if enabled {
                let inputs = self.inputs(configuration, targets, actual);
                self.start_mode(&inputs);
            }
        }
        Ok(())
    }

    /// A target object was received, by SDO or with the SYNC that applies it. Offsets take effect
    /// with the next target. Targets of other modes are ignored, so the caller may report all.
    pub fn set_point(
        &mut self,
        target: Target,
        configuration: &Configuration,
        targets: &Targets,
        actual: &Actual,
    ) {
        self.observe(actual);
        if self.state == State::OperationEnabled {
            let inputs = self.inputs(configuration, targets, actual);
            if let Some(demand) = self.motion.generator_mut().set_point(target, &inputs) {
                self.put(demand);
            }
        }
    }

    /// Every position has become `offset` counts greater, because the actual position got another
    /// name (the P3's 0x6064). The axis stays where it is, and a move ends where it would have.
    /// The owner renames the position in the control half at the same moment.
    pub fn preset_position(&mut self, offset: i32) {
        self.motion.generator_mut().shift(offset);
        if let Some(stop) = &mut self.quick_stop {
            stop.shift(offset);
        }
        if let Demand::Position { start, .. } = &mut self.demand {
            *start = start.wrapping_add(offset);
        }
    }

    /// A fault was noticed: transition 13. The motor is free at once; transition 14 follows with
    /// the next tick.
    pub fn fault(&mut self) {
        if !matches!(self.state, State::FaultReactionActive | State::Fault) {
            self.leave();
            self.state = State::FaultReactionActive;
        }
    }

    /// One millisecond has passed.
    pub fn tick(&mut self, configuration: &Configuration, targets: &Targets, actual: &Actual) {
        self.observe(actual);
        let inputs = self.inputs(configuration, targets, actual);
        self.watch(&inputs);
        match self.state {
            State::OperationEnabled => {
                if let Some(demand) = self.motion.generator_mut().tick(&inputs) {
                    self.put(demand);
                }
            }
            State::QuickStopActive => {
                if let Some(stop) = &mut self.quick_stop {
                    let demand = stop.tick(&inputs);
                    if stop.stopped() && !stop.code().stays() {
                        self.leave(); // 12
                        self.state = State::SwitchOnDisabled;
                    } else {
                        self.put(demand);
                    }
                }
            }
            State::FaultReactionActive => self.state = State::Fault, // 14
            _ => {}
        }
    }

    /// The demand, if it changed since the last call.
    pub fn take_demand(&mut self) -> Option<Demand> {
        core::mem::take(&mut self.fresh).then_some(self.demand)
    }

    /// The demand in force, taken or not.
    pub fn demand(&self) -> &Demand {
        &self.demand
    }

    /// The present state.
    pub fn state(&self) -> State {
        self.state
    }

    /// The mode in force.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// The value of 0x6061.
    pub fn mode_display(&self) -> i8 {
        self.mode.0
    }

    /// The modes that [`write_mode`](Axis::write_mode) accepts, and idle.
    pub fn modes(&self) -> ModeSet {
        self.dialect.modes()
    }

    /// The controlword as last written.
    pub fn controlword(&self) -> Controlword {
        self.controlword
    }

    /// The value of 0x6041.
    pub fn statusword(&self) -> Statusword {
        let flag = |bit: u16, on: bool| if on { bit } else { 0 };
        let bits = match (self.state, &self.quick_stop) {
            (State::OperationEnabled, _) => self.motion.generator().bits(),
            // CiA 402: with codes 5 to 8, at rest.
            (State::QuickStopActive, Some(stop)) => Bits {
                target_reached: stop.stopped(),
                specific: false,
            },
            _ => Bits::default(),
        };
        let following = self.state == State::OperationEnabled
            && matches!(self.mode, Mode::PROFILE_POSITION | Mode::CYCLIC_POSITION)
            && (self.conditions.following_warning || self.conditions.following_fault);
        let conditions = self.conditions();
        let limit = conditions.position_limited
            || conditions.velocity_limited
            || conditions.acceleration_limited
            || conditions.torque_limited;
        Statusword(
            self.state.pattern()
                | flag(Statusword::VOLTAGE, self.voltage)
                | flag(Statusword::WARNING, self.warning)
                | flag(Statusword::REMOTE, self.dialect.remote_bit)
                | flag(Statusword::TARGET_REACHED, bits.target_reached)
                | flag(Statusword::INTERNAL_LIMIT, limit)
                | flag(Statusword::MODE_12, bits.specific)
                | flag(Statusword::MODE_13, following),
        )
    }

    /// What the axis notices at present.
    pub fn conditions(&self) -> Conditions {
        let limited = match self.state {
            State::OperationEnabled => self.motion.generator().limited(),
            _ => Limited::default(),
        };
        let powered = matches!(self.state, State::OperationEnabled | State::QuickStopActive);
        Conditions {
            position_limited: limited.position,
            velocity_limited: limited.velocity,
            acceleration_limited: limited.acceleration,
            torque_limited: limited.torque || (powered && self.limited),
            ..self.conditions
        }
    }

    /// Takes note of what the statusword shows.
    fn observe(&mut self, actual: &Actual) {
        self.voltage = actual.voltage;
        self.warning = actual.warning;
        self.limited = actual.limited;
    }

    fn inputs<'a>(
        &self,
        configuration: &'a Configuration,
        targets: &'a Targets,
        actual: &'a Actual,
    ) -> Inputs<'a> {
        Inputs {
            configuration,
            targets,
            actual,
            present: self.present(configuration, actual),
        }
    }

    /// Where the axis stands: the demand where there is one, else the motor.
    fn present(&self, configuration: &Configuration, actual: &Actual) -> Present {
        let velocity = measured(actual.velocity);
        let motor = Present {
            position: actual.position,
            fraction: 0.0,
            velocity: if configuration.stands(velocity) {
                0.0
            } else {
                velocity
            },
            torque_pm: measured(actual.torque_pm),
            torque_is_demand: false,
            left_ns: 0,
        };
        // A demand not yet taken is not yet in the control half's answers.
        let start = self.demand.at(0);
        let either = |own: f32, told: f32| measured(if self.fresh { own } else { told });
        let demand_velocity = either(start.velocity, actual.demand_velocity);
        match self.demand {
            Demand::Off => Present {
                velocity: 0.0,
                torque_pm: 0.0,
                ..motor
            },
            Demand::Idle => Present {
                torque_pm: 0.0,
                ..motor
            },
            Demand::Torque { .. } => Present {
                torque_pm: either(start.torque_pm, actual.demand_torque_pm),
                torque_is_demand: true,
                ..motor
            },
            Demand::Velocity { .. } => Present {
                velocity: demand_velocity,
                ..motor
            },
            Demand::Position { .. } => Present {
                position: if self.fresh {
                    start.position
                } else {
                    actual.demand_position
                },
                fraction: within(either(start.fraction, actual.demand_fraction), 0.0, 1.0),
                velocity: demand_velocity,
                left_ns: if self.fresh { 0 } else { actual.demand_left_ns },
                ..motor
            },
        }
    }

    /// Everything that happens on entering a state by a command.
    fn enter(&mut self, state: State, code: OptionCode, inputs: &Inputs<'_>) {
        self.state = state;
        match state {
            State::OperationEnabled => {
                self.quick_stop = None;
                if self.dialect.mode_display_cleared_on_enable {
                    self.mode = Mode::IDLE;
                }
                self.start_mode(inputs);
            }
            State::QuickStopActive if !code.frees(self.dialect) => {
                let by_position = matches!(self.demand, Demand::Position { .. });
                let stop = QuickStop::new(code, self.dialect, by_position, inputs);
                self.motion = Motion::IDLE;
                self.put(stop.begin());
                self.quick_stop = Some(stop);
            }
            State::QuickStopActive => {
                self.leave(); // 12
                self.state = State::SwitchOnDisabled;
            }
            _ => self.leave(),
        }
    }

    /// The mode in force starts anew; its statusword bits are cleared (P3 l.474).
    fn start_mode(&mut self, inputs: &Inputs<'_>) {
        self.motion = Motion::start(self.mode, inputs);
        self.forget();
        self.put(self.motion.generator().begin());
    }

    /// The motor is free, and nothing is left of its motion.
    fn leave(&mut self) {
        self.motion = Motion::IDLE;
        self.quick_stop = None;
        self.forget();
        self.put(Demand::Off);
    }

    fn forget(&mut self) {
        self.following_warning = Monitor::NEW;
        self.following_fault = Monitor::NEW;
        self.velocity_warning = Monitor::NEW;
        self.velocity_fault = Monitor::NEW;
        self.conditions = Conditions::NONE;
    }

    fn put(&mut self, demand: Demand) {
        if demand != self.demand || demand.moves() {
            self.demand = demand;
            self.fresh = true;
        }
    }

    /// Following error and velocity error against their windows.
    fn watch(&mut self, inputs: &Inputs<'_>) {
        let position_error = match self.demand {
            Demand::Position { .. } => {
                let error = inputs.present.position.wrapping_sub(inputs.actual.position);
                Some((f64::from(error) + inputs.present.fraction).abs())
            }
            _ => None,
        };
        let velocity_error = match self.demand {
            Demand::Velocity { .. } => {
                Some((inputs.present.velocity - measured(inputs.actual.velocity)).abs())
            }
            _ => None,
        };
        let configuration = inputs.configuration;
        self.conditions = Conditions {
            following_warning: self
                .following_warning
                .tick(configuration.following_warning, position_error),
            following_fault: self
                .following_fault
                .tick(configuration.following_fault, position_error),
            velocity_warning: self
                .velocity_warning
                .tick(configuration.velocity_warning, velocity_error),
            velocity_fault: self
                .velocity_fault
                .tick(configuration.velocity_fault, velocity_error),
            ..Conditions::NONE
        };
    }
}

impl Conditions {
    const NONE: Conditions = Conditions {
        following_warning: false,
        following_fault: false,
        velocity_warning: false,
        velocity_fault: false,
        position_limited: false,
        velocity_limited: false,
        acceleration_limited: false,
        torque_limited: false,
    };
}
