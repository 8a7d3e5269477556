//! Ways out of motion that are not the mode's: faults, a lost connection, and the ramps on leaving
//! operation enabled.

use crate::modes::Inputs;
use crate::option_code::{Braking, QuickStopCode};
use crate::stop::Stop;
use crate::{Actual, Axis, Command, Configuration, Demand, State, Targets};

/// The motor is freed if a reaction to a fault has not brought it to rest by then, ms.
pub(super) const REACTION_LIMIT_MS: u16 = 10_000;

impl Axis {
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
    /// Whether it is a fault (code 1): then nothing follows here, and the owner calls
    /// [`Axis::fault_reaction`], unless it judges that with its other faults already.
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

    /// A command leads to another state, at once or at the end of a ramp.
    pub(super) fn go(&mut self, state: State, code: QuickStopCode, inputs: &Inputs<'_>) {
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
    pub(super) fn can_brake(&self) -> bool {
        !matches!(
            self.demand,
            Demand::Off
                | Demand::Idle
                | Demand::TorqueWithAngle { .. }
                | Demand::PhaseVoltage { .. }
                | Demand::RotorVoltage { .. }
        )
    }

    /// Operation enabled is not left after all.
    pub(super) fn stay(&mut self, inputs: &Inputs<'_>) {
        self.leaving = None;
        self.stop = None;
        let motion = self.motion.generator_mut();
        motion.resume(inputs);
        let demand = motion.begin();
        self.put(demand);
    }

    /// To rest from any motion.
    pub(super) fn braked(&self, braking: Braking, inputs: &Inputs<'_>) -> Stop {
        match self.demand {
            Demand::Position { .. } => Stop::by_position(braking, inputs),
            _ => Stop::by_velocity(braking, inputs),
        }
    }
}
