//! One drive function: the state machine, the mode in force and what they demand.

use crate::arithmetic::{measured, within};
use crate::conditions::Watch;
use crate::modes::{BUFFER_SIZE, Bits, Homing, Inputs, Limited, Motion};
use crate::option_code::{Braking, QuickStopCode};
use crate::path::Present;
use crate::stop::Stop;
use crate::{
    Actual, Command, Conditions, Configuration, Controlword, Demand, Dialect, HomingError, Mode,
    ModeRefused, ModeSet, Outcome, State, Statusword, Target, Targets, Trigger,
};

/// The motor is freed if a reaction to a fault has not brought it to rest by then, ms.
const REACTION_LIMIT_MS: u16 = 10_000;

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
    /// At work in quick stop active, in fault reaction active, or in operation enabled as the halt
    /// or on the way out of it.
    stop: Option<Stop>,
    /// 0x605A as the last quick stop began.
    quick_stop_code: QuickStopCode,
    /// In operation enabled: the stop leads there when it has ended (0x605B, 0x605C).
    leaving: Option<State>,
    /// How long the fault reaction has lasted, ms.
    reaction_ms: u16,
    /// The motor stood at the last tick of a halt whose demand had come to its end.
    halted: bool,
    demand: Demand,
    /// `demand` has not been taken yet.
    fresh: bool,
    watch: Watch,
    /// From [`Actual`], as last seen.
    voltage: bool,
    warning: bool,
    limited: bool,
    /// Homing has given positions a meaning.
    homed: bool,
    /// By how much all positions became greater, until the owner takes it.
    shift: Option<i32>,
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
            stop: None,
            quick_stop_code: QuickStopCode::DEFAULT,
            leaving: None,
            reaction_ms: 0,
            halted: false,
            demand: Demand::Off,
            fresh: false,
            watch: Watch::NEW,
            voltage: false,
            warning: false,
            limited: false,
            homed: false,
            shift: None,
        }
    }

    /// Transitions 0 and 1: the self-test has passed. Elsewhere it changes nothing.
    pub fn initialised(&mut self) {
        if self.state == State::NotReadyToSwitchOn {
            self.state = State::SwitchOnDisabled;
        }
    }

    /// 0x6040 was written. Transitions act at once, before the write is acknowledged; several may
    /// follow from one write. Transitions 5 and 8 of a moving axis wait for the end of the
    /// slow-down ramp if 0x605C or 0x605B asks for one; the state is operation enabled until then.
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
        let code = match before {
            State::QuickStopActive => self.quick_stop_code,
            _ => QuickStopCode::of(configuration),
        };
        let step = before.written(previous, now, code.stays(), self.dialect);
        let inputs = self.inputs(configuration, targets, actual);
        if step.state != before {
            self.go(step.state, code, &inputs);
        } else if self.leaving.is_some() && now.command() == Command::EnableOperation {
            self.stay(&inputs);
        }
        if self.state == State::OperationEnabled && self.leaving.is_none() {
            let motion = self.motion.generator_mut();
            if self.stop.is_some() {
                motion.halted(&inputs);
            }
            motion.controlword(previous, now, &inputs);
            self.halt_or_resume(&inputs);
            self.name_home();
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
        if self.state == State::OperationEnabled && self.stop.is_none() {
            let inputs = self.inputs(configuration, targets, actual);
            if let Some(demand) = self.motion.generator_mut().set_point(target, &inputs) {
                self.put(demand);
            }
        }
    }

    /// A SYNC was received, and what came with it is in force.
    pub fn sync(&mut self, configuration: &Configuration, targets: &Targets, actual: &Actual) {
        self.observe(actual);
        if self.state == State::OperationEnabled && self.stop.is_none() {
            let inputs = self.inputs(configuration, targets, actual);
            if let Some(demand) = self.motion.generator_mut().sync(&inputs) {
                self.put(demand);
            }
        }
    }

    /// A set-point for the buffer of interpolated position mode (0x60C1). Whether it was taken: if
    /// not, the buffer is full or closed, or the mode not at work.
    pub fn push_set_point(
        &mut self,
        position: i32,
        configuration: &Configuration,
        targets: &Targets,
        actual: &Actual,
    ) -> bool {
        let inputs = self.inputs(configuration, targets, actual);
        self.motion.generator_mut().push(position, &inputs)
    }

    /// Empties the buffer of interpolated position mode and opens or closes it (0x60C4,6).
    pub fn clear_buffer(&mut self, open: bool) {
        self.motion.generator_mut().clear(open);
    }

    /// Set-points in the buffer of interpolated position mode.
    pub fn buffered(&self) -> u8 {
        self.motion.generator().buffered()
    }

    /// Set-points that the buffer of interpolated position mode holds at most (0x60C4,1).
    pub const BUFFER_SIZE: u8 = BUFFER_SIZE;

    /// Every position has become `offset` counts greater, because the actual position got another
    /// name (the P3's 0x6064). The axis stays where it is, and a move ends where it would have.
    /// The owner renames the position in the control half at the same moment.
    pub fn preset_position(&mut self, offset: i32) {
        self.motion.generator_mut().shift(offset);
        if let Some(stop) = &mut self.stop {
            stop.shift(offset);
        }
        if let Demand::Position { start, .. } = &mut self.demand {
            *start = start.wrapping_add(offset);
        }
    }

    /// While homing runs, positions have no meaning; where it succeeds, they get one.
    fn name_home(&mut self) {
        let Motion::Homing(homing) = &mut self.motion else {
            return;
        };
        self.homed &= !homing.is_running();
        if let Some(shift) = homing.take_shift() {
            self.preset_position(shift);
            self.shift = Some(self.shift.unwrap_or(0).wrapping_add(shift));
            self.homed = true;
        }
    }

    /// By how much all positions have become greater because home was attained, since the last call.
    /// The axis counts so already; the owner renames the position in the control half before it
    /// passes the next demand on.
    pub fn take_position_shift(&mut self) -> Option<i32> {
        self.shift.take()
    }

    /// What the control half shall capture for homing, if that changed since the last call.
    pub fn take_trigger(&mut self) -> Option<Trigger> {
        match &mut self.motion {
            Motion::Homing(homing) => homing.take_trigger(),
            _ => None,
        }
    }

    /// Whether homing has been done since the start, and not begun anew without success.
    pub fn is_homed(&self) -> bool {
        self.homed
    }

    fn homing(&self) -> Option<&Homing> {
        match &self.motion {
            Motion::Homing(homing) => Some(homing),
            _ => None,
        }
    }

    /// Why homing has failed, in mode 6 until it is started again.
    pub fn homing_error(&self) -> Option<HomingError> {
        self.homing().and_then(Homing::error)
    }

    /// Greatest torque at present, per mille: that of the configuration, or less while the axis is to
    /// press against a hard stop.
    pub fn torque_limit_pm(&self, configuration: &Configuration) -> f32 {
        let stop = configuration.homing.stop_torque_pm;
        let presses = self.homing().is_some_and(Homing::presses);
        if presses && stop < configuration.max_torque_pm {
            stop
        } else {
            configuration.max_torque_pm
        }
    }

    /// A fault was noticed after which the motor cannot be controlled: transition 13. The motor is
    /// free at once, also in the midst of a reaction to another fault; transition 14 follows with
    /// the next tick.
    pub fn fault(&mut self) {
        if self.state != State::Fault {
            self.leave();
            self.state = State::FaultReactionActive;
        }
    }

    /// A fault was noticed with which the motor can still be braked: transition 13, and the
    /// reaction that 0x605E asks for. Transition 14 follows at rest, after 10 s at the latest.
    pub fn fault_reaction(
        &mut self,
        configuration: &Configuration,
        targets: &Targets,
        actual: &Actual,
    ) {
        if matches!(self.state, State::FaultReactionActive | State::Fault) {
            return;
        }
        let braking = Braking::of_fault(configuration);
        match braking.filter(|_| self.dialect.ramps_on_stop) {
            Some(braking) if self.can_brake() => {
                let inputs = self.inputs(configuration, targets, actual);
                self.leave_motion();
                self.begin_stop(self.braked(braking, &inputs));
                self.state = State::FaultReactionActive;
            }
            _ => self.fault(),
        }
    }

    /// The connection to the master was lost: 0x6007 says what follows, if the axis is under power.
    /// Whether it is a fault; the owner then calls [`Axis::fault_reaction`].
    pub fn connection_lost(
        &mut self,
        configuration: &Configuration,
        targets: &Targets,
        actual: &Actual,
    ) -> bool {
        if !self.is_powered() {
            return false;
        }
        let command = match configuration.abort_connection_option {
            1 => return true,
            2 => Command::DisableVoltage,
            3 => Command::QuickStop,
            _ => return false,
        };
        let code = QuickStopCode::of(configuration);
        let state = self.state.after(command, code.stays());
        if state != self.state {
            let inputs = self.inputs(configuration, targets, actual);
            self.go(state, code, &inputs);
        }
        false
    }

    /// One millisecond has passed.
    pub fn tick(&mut self, configuration: &Configuration, targets: &Targets, actual: &Actual) {
        self.observe(actual);
        let inputs = self.inputs(configuration, targets, actual);
        self.watch.tick(&self.demand, &inputs);
        match self.state {
            State::OperationEnabled => match (&mut self.stop, self.leaving) {
                (Some(stop), Some(state)) => {
                    let demand = stop.tick(&inputs);
                    if stop.stopped() {
                        self.leave(); // 5, 8
                        self.state = state;
                    } else {
                        self.put(demand);
                    }
                }
                (Some(halt), None) => {
                    let demand = halt.tick(&inputs);
                    self.halted = halt.stopped() && configuration.stands(measured(actual.velocity));
                    self.motion.generator_mut().halted(&inputs);
                    self.put(demand);
                }
                (None, _) => {
                    if let Some(demand) = self.motion.generator_mut().tick(&inputs) {
                        self.put(demand);
                    }
                }
            },
            State::QuickStopActive => {
                if let Some(stop) = &mut self.stop {
                    let demand = stop.tick(&inputs);
                    if stop.stopped() && !self.quick_stop_code.stays() {
                        self.leave(); // 12
                        self.state = State::SwitchOnDisabled;
                    } else {
                        self.put(demand);
                    }
                }
            }
            State::FaultReactionActive => {
                self.reaction_ms = self.reaction_ms.saturating_add(1);
                let demand = self.stop.as_mut().map(|stop| stop.tick(&inputs));
                let ended = self.stop.as_ref().is_none_or(Stop::stopped);
                match demand {
                    Some(demand) if !ended && self.reaction_ms < REACTION_LIMIT_MS => {
                        self.put(demand);
                    }
                    _ => {
                        self.leave(); // 14
                        self.state = State::Fault;
                    }
                }
            }
            _ => {}
        }
        self.name_home();
    }

    /// Whether the bridge is switched on.
    pub fn is_powered(&self) -> bool {
        self.demand != Demand::Off
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
        let bits = match (self.state, &self.stop) {
            (State::OperationEnabled, None) => self.motion.generator().bits(),
            // CiA 402: halted, bit 10 says that the axis stands.
            (State::OperationEnabled, Some(_)) => Bits {
                target_reached: self.halted,
                ..self.motion.generator().bits()
            },
            // CiA 402: with codes 5 to 8, at rest.
            (State::QuickStopActive, Some(stop)) => Bits {
                target_reached: stop.stopped(),
                specific: false,
            },
            _ => Bits::default(),
        };
        let following = self.state == State::OperationEnabled
            && matches!(self.mode, Mode::PROFILE_POSITION | Mode::CYCLIC_POSITION)
            && self.watch.following();
        let homing_failed = self.state == State::OperationEnabled && self.homing_error().is_some();
        Statusword(
            self.state.pattern()
                | flag(Statusword::VOLTAGE, self.voltage)
                | flag(Statusword::WARNING, self.warning)
                | flag(Statusword::REMOTE, self.dialect.remote_bit)
                | flag(Statusword::TARGET_REACHED, bits.target_reached)
                | flag(Statusword::INTERNAL_LIMIT, self.conditions().limited())
                | flag(Statusword::MODE_12, bits.specific)
                | flag(Statusword::MODE_13, following || homing_failed),
        )
    }

    /// What the axis notices at present.
    pub fn conditions(&self) -> Conditions {
        let limited = match self.state {
            State::OperationEnabled if self.stop.is_none() => self.motion.generator().limited(),
            _ => Limited::default(),
        };
        let limits = Limited {
            torque: limited.torque || (self.is_powered() && self.limited),
            ..limited
        };
        Conditions {
            homing_failed: self.homing_error().is_some(),
            ..self.watch.conditions(limits)
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
            mode: self.mode,
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
            acceleration: 0.0,
            torque_pm: measured(actual.torque_pm),
            torque_is_demand: false,
            angle: actual.electrical_angle,
            left_ns: 0,
        };
        // A demand not yet taken is not yet in the control half's answers.
        let start = self.demand.at(0);
        let either = |own: f32, told: f32| measured(if self.fresh { own } else { told });
        let slope = |rate: f32, duration_ns: u32| {
            if duration_ns > 0 { measured(rate) } else { 0.0 }
        };
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
            Demand::TorqueWithAngle { angle, .. } => Present {
                torque_pm: either(start.torque_pm, actual.demand_torque_pm),
                angle,
                left_ns: match (self.fresh, self.demand) {
                    (true, Demand::TorqueWithAngle { duration_ns, .. }) => duration_ns,
                    _ => actual.demand_left_ns,
                },
                ..motor
            },
            Demand::PhaseVoltage { angle, .. } => Present { angle, ..motor },
            Demand::Velocity {
                acceleration,
                duration_ns,
                ..
            } => Present {
                velocity: demand_velocity,
                acceleration: slope(acceleration, duration_ns),
                ..motor
            },
            Demand::Position {
                acceleration,
                duration_ns,
                ..
            } => Present {
                position: if self.fresh {
                    start.position
                } else {
                    actual.demand_position
                },
                fraction: within(either(start.fraction, actual.demand_fraction), 0.0, 1.0),
                velocity: demand_velocity,
                acceleration: slope(acceleration, duration_ns),
                left_ns: if self.fresh { 0 } else { actual.demand_left_ns },
                ..motor
            },
        }
    }

    /// A command leads to another state, at once or at the end of a ramp.
    fn go(&mut self, state: State, code: QuickStopCode, inputs: &Inputs<'_>) {
        let ramps = self.dialect.ramps_on_stop
            && match state {
                State::SwitchedOn => inputs.configuration.disable_option != 0,
                State::ReadyToSwitchOn => inputs.configuration.shutdown_option == 1,
                _ => false,
            };
        let moving = inputs.present.velocity != 0.0;
        if self.state != State::OperationEnabled || !ramps || !moving || !self.can_brake() {
            self.enter(state, code, inputs);
        } else if self.leaving.replace(state).is_none() {
            self.begin_stop(self.braked(Braking::SlowDownRamp, inputs));
        }
    }

    /// Whether the controllers hold the motor: not without torque, and not in a frame that the
    /// master turns, where the drive may not know the rotor yet.
    fn can_brake(&self) -> bool {
        !matches!(
            self.demand,
            Demand::Off
                | Demand::Idle
                | Demand::TorqueWithAngle { .. }
                | Demand::PhaseVoltage { .. }
        )
    }

    /// Operation enabled is not left after all.
    fn stay(&mut self, inputs: &Inputs<'_>) {
        self.leaving = None;
        self.stop = None;
        let motion = self.motion.generator_mut();
        motion.resume(inputs);
        let demand = motion.begin();
        self.put(demand);
    }

    /// To rest from any motion.
    fn braked(&self, braking: Braking, inputs: &Inputs<'_>) -> Stop {
        match self.demand {
            Demand::Position { .. } => Stop::by_position(braking, inputs),
            _ => Stop::by_velocity(braking, inputs),
        }
    }

    /// Everything that happens on entering a state by a command.
    fn enter(&mut self, state: State, code: QuickStopCode, inputs: &Inputs<'_>) {
        self.state = state;
        match state {
            State::OperationEnabled => {
                if self.dialect.mode_display_cleared_on_enable {
                    self.mode = Mode::IDLE;
                }
                self.start_mode(inputs);
            }
            State::QuickStopActive if !code.frees(self.dialect) => {
                self.leave_motion();
                self.quick_stop_code = code;
                self.begin_stop(if self.dialect.ramps_on_stop {
                    self.braked(code.braking(), inputs)
                } else {
                    Stop::in_place(inputs)
                });
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
        self.motion = Motion::start(
            self.controlword,
            &Inputs {
                mode: self.mode,
                ..*inputs
            },
        );
        self.watch = Watch::NEW;
        if self.leaving.is_some() {
            return;
        }
        self.stop = None;
        if !self.halt_or_resume(inputs) {
            self.put(self.motion.generator().begin());
        }
    }

    /// Obeys controlword bit 8 in operation enabled. Whether a halt is at work.
    fn halt_or_resume(&mut self, inputs: &Inputs<'_>) -> bool {
        let wanted = self.dialect.halt_bit && self.controlword.halt();
        match (wanted, self.stop.is_some()) {
            (true, false) => {
                let braking = Braking::of_halt(inputs.configuration);
                self.begin_stop(match self.mode {
                    Mode::PROFILE_POSITION | Mode::INTERPOLATED_POSITION => {
                        Stop::by_position(braking, inputs)
                    }
                    Mode::PROFILE_VELOCITY | Mode::VELOCITY | Mode::HOMING => {
                        Stop::by_velocity(braking, inputs)
                    }
                    // This mode's ramp is the torque slope.
                    Mode::PROFILE_TORQUE if braking != Braking::Limit => Stop::by_torque(inputs),
                    Mode::PROFILE_TORQUE => Stop::by_velocity(braking, inputs),
                    // The cyclic modes do not look at the bit.
                    _ => return false,
                });
                true
            }
            (false, true) => {
                self.stop = None;
                let motion = self.motion.generator_mut();
                motion.resume(inputs);
                let demand = motion.begin();
                self.put(demand);
                false
            }
            (wanted, _) => wanted,
        }
    }

    fn begin_stop(&mut self, stop: Stop) {
        self.put(stop.begin());
        self.stop = Some(stop);
        self.halted = false;
    }

    /// The mode has no say any more.
    fn leave_motion(&mut self) {
        self.motion = Motion::IDLE;
        self.stop = None;
        self.leaving = None;
        self.reaction_ms = 0;
    }

    /// The motor is free, and nothing is left of its motion.
    fn leave(&mut self) {
        self.leave_motion();
        self.watch = Watch::NEW;
        self.put(Demand::Off);
    }

    fn put(&mut self, demand: Demand) {
        if demand != self.demand || demand.moves() {
            self.demand = demand;
            self.fresh = true;
        }
    }
}
