//! One drive function: the state machine, the mode in force and what they demand.

mod braking;
mod home;
mod present;
mod status;

use crate::arithmetic::measured;
use crate::conditions::Watch;
use crate::modes::{BUFFER_SIZE, Inputs, Motion};
use crate::option_code::{Braking, QuickStopCode};
use crate::stop::Stop;
use crate::{
    Actual, Command, Configuration, Controlword, Demand, Dialect, Mode, ModeRefused, ModeSet,
    Outcome, State, Target, Targets,
};

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

    /// The power stage cannot give torque any more (safe torque off): the motor is free at once, and
    /// switching on is disabled.
    pub fn torque_off(&mut self) {
        match self.state {
            State::ReadyToSwitchOn
            | State::SwitchedOn
            | State::OperationEnabled
            | State::QuickStopActive => {
                self.leave();
                self.state = State::SwitchOnDisabled;
            }
            State::FaultReactionActive => self.leave(),
            _ => {}
        }
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
                    Some(demand) if !ended && self.reaction_ms < braking::REACTION_LIMIT_MS => {
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
            at_once: self.dialect.set_points_at_once,
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
