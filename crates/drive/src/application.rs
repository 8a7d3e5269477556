//! The owner of a drive's objects: what a write means, and what a millisecond brings.

mod own;
mod writes;

use canopen::{Changed, Image, Instant, NodeId, store};
use cia402::{Actual, Axis, Configuration, Demand, Mode, Statusword, Target, Targets};
use control::capture::Seen;
use control::io::Signals;
use control::{Command, Feedback, Limits, Parameters};
use personalities::own::OwnBehaviour;
use personalities::{Personality, class};

use crate::captures::{CaptureOrder, News, homing_inputs, homing_trigger};
use crate::command::{command, limits};
use crate::configuration::{max_motor_velocity, read_configuration, read_targets};
use crate::faults::{FaultManager, Observation};
use crate::gains::Direct;
use crate::inputs::{self, Asked, Word, analog_target};
use crate::parameters::{LoopParameters, figures, read_parameters};
use crate::phasing::PhasingWatch;
use crate::probes::Probes;
use crate::publish::publish;
use crate::{Hardware, ParameterError, PwmTiming};

/// Everything about the drive that is not CANopen itself.
#[derive(Clone, Debug)]
pub(crate) struct Application<O> {
    personality: &'static Personality,
    hardware: Hardware,
    pub(crate) axis: Axis,
    configuration: Configuration,
    /// 0x6080 or its like, counts/s.
    max_motor_velocity: Option<f32>,
    loops: LoopParameters,
    parameter_error: Option<ParameterError>,
    pub(crate) faults: FaultManager,
    feedback: Feedback<f32>,
    signals: Signals,
    phasing: PhasingWatch,
    seen: Seen,
    /// What the control half has not taken yet.
    new_command: bool,
    new_limits: bool,
    new_parameters: bool,
    /// Whose gains are given.
    direct: Direct,
    /// The gains that follow from those written are in the image.
    gains_shown: bool,
    /// To be taken once its write is acknowledged.
    pub(crate) new_node_id: Option<NodeId>,
    new_shift: Option<i32>,
    new_captures: News,
    probes: Probes,
    word: Word,
    /// Safe torque off has taken the torque away since the last tick.
    torque_lost: bool,
    /// As last handed over, per mille.
    torque_limit_pm: f32,
    /// What of the parameters is to be saved, or with `restores` put back to its defaults.
    pub(crate) storage_request: Option<store::Request>,
    pub(crate) restores: bool,
    /// The program is stopped: the power stage stays off.
    is_stopped: bool,
    /// A program is to be started: with it the node starts over.
    pub(crate) restart: bool,
    /// What only this drive does.
    pub(crate) own: O,
}

impl<O: OwnBehaviour> Application<O> {
    /// Reads everything from the image. Beside it: the parameters of the loops.
    ///
    /// # Errors
    /// The [`ParameterError`] of a dictionary whose very defaults make no drive.
    pub(crate) fn new(
        personality: &'static Personality,
        hardware: Hardware,
        image: &Image<'_>,
        feedback: Feedback<f32>,
    ) -> Result<(Application<O>, Parameters<f32>), ParameterError> {
        let (parameters, loops) =
            read_parameters(image, personality, &hardware, Direct::default())?;
        let mut application = Application {
            personality,
            hardware,
            axis: Axis::new(&personality.cia402),
            configuration: read_configuration(image, &personality.axis),
            max_motor_velocity: None,
            loops,
            parameter_error: None,
            faults: FaultManager::new(personality),
            feedback,
            signals: Signals::QUIET,
            phasing: PhasingWatch::default(),
            seen: Seen::default(),
            new_command: true,
            new_limits: false,
            new_parameters: true,
            direct: Direct::default(),
            gains_shown: false,
            new_node_id: None,
            new_shift: None,
            new_captures: News::INVERTED,
            probes: Probes::default(),
            word: Word::default(),
            torque_lost: false,
            torque_limit_pm: 0.0,
            storage_request: None,
            restores: false,
            is_stopped: false,
            restart: false,
            own: O::new(personality, image),
        };
        application.configure(image);
        application.axis.initialised();
        Ok((application, parameters))
    }

    /// Takes what the control half has seen.
    pub(crate) fn observe(&mut self, feedback: &Feedback<f32>, signals: &Signals, seen: &Seen) {
        self.feedback = *feedback;
        self.signals = *signals;
        self.seen = *seen;
        if self.personality.inputs.is_none() {
            self.seen.active = 0;
            self.signals.torque_off = false;
        }
        if self.signals.torque_off {
            self.torque_lost |= self.is_powered();
            self.axis.torque_off();
            self.new_command |= self.axis.take_demand().is_some();
        }
    }

    /// Acts upon writes that were committed.
    pub(crate) fn changed(&mut self, image: &Image<'_>, changed: Changed) {
        if changed.has(class::CONTROL) {
            self.configure_loops(image);
            self.configure(image);
        } else if changed.has(class::CONFIGURATION) {
            self.configure(image);
        }
        let targets = [
            // Before the torque, which is meant at this angle.
            (class::TARGET_ANGLE, Target::Angle),
            (class::TARGET_VOLTAGE, Target::PhaseVoltage),
            (class::TARGET_POSITION, Target::Position),
            (class::TARGET_VELOCITY, Target::Velocity),
            (class::TARGET_VL_VELOCITY, Target::VlVelocity),
            (class::TARGET_TORQUE, Target::Torque),
        ];
        for (class, target) in targets {
            if changed.has(class) {
                let targets = self.targets(image);
                let actual = self.actual();
                self.axis
                    .set_point(target, &self.configuration, &targets, &actual);
            }
        }
        if changed.has(class::TOUCH_PROBE)
            && let Some(inputs) = &self.personality.inputs
        {
            let function = image.raw(inputs.probes.function) as u16;
            self.new_captures.add(self.probes.write(function));
        }
        self.take_demand();
    }

    /// What the master wants, or an analog input in its stead.
    fn targets(&self, image: &Image<'_>) -> Targets {
        let targets = read_targets(image, &self.personality.axis);
        match &self.personality.inputs {
            Some(inputs) => analog_target(
                image,
                &inputs.analog,
                &self.signals,
                self.axis.mode(),
                targets,
            ),
            None => targets,
        }
    }

    /// What inputs ask for.
    fn asked(&self, image: &Image<'_>) -> Asked {
        self.personality
            .inputs
            .as_ref()
            .map_or(Asked::default(), |inputs| {
                Asked::by(image, inputs, self.seen.active, self.signals.torque_off)
            })
    }

    /// Inputs act as bits of the controlword do.
    fn obey_inputs(&mut self, image: &Image<'_>) {
        let asked = self.asked(image);
        if !self.is_stopped && self.word.ask(asked) {
            self.pass_controlword(image);
        }
    }

    /// A SYNC was received; what came with it has been acted upon.
    pub(crate) fn sync(&mut self, image: &Image<'_>, now: Instant) {
        self.faults.sync(now);
        if self.axis.mode() == Mode::INTERPOLATED_POSITION {
            let targets = self.targets(image);
            let actual = self.actual();
            self.axis.sync(&self.configuration, &targets, &actual);
            self.take_demand();
        }
    }

    /// Once per millisecond.
    pub(crate) fn tick(&mut self, image: &Image<'_>, now: Instant) {
        self.obey_inputs(image);
        let targets = self.targets(image);
        let actual = self.actual();
        self.axis.tick(&self.configuration, &targets, &actual);
        // Homing may have renamed all positions.
        self.take_demand();
        let actual = self.actual();
        // In a frame that the master turns, a current says nothing of the rotor.
        let follows_rotor = matches!(
            self.demand(),
            Demand::Torque { .. } | Demand::Velocity { .. } | Demand::Position { .. }
        );
        let phasing_error = self.phasing.tick(
            if follows_rotor {
                self.feedback.current_q_a
            } else {
                0.0
            },
            self.feedback.velocity,
            self.loops.rotor_amperes_per_acceleration,
            self.loops.continuous_a,
        );
        let seen = Observation {
            now,
            motor_temperature_c: self.motor_temperature_c(),
            phasing_error,
            conditions: self.axis.conditions(),
            feedback: &self.feedback,
            signals: &self.signals,
            parameters_are_valid: self.parameter_error.is_none(),
            enabled: self.is_powered(),
            active_inputs: self.seen.active,
            torque_lost: core::mem::take(&mut self.torque_lost),
            // "Ignored in Idle/Homing modes" (l.998).
            ignores_switches: matches!(self.axis.mode(), Mode::IDLE | Mode::HOMING),
            connection_matters: self.is_powered()
                && self.configuration.abort_connection_option == 1,
            own_causes: self.own.causes(),
        };
        let judgement = self.faults.judge(image, &seen);
        if judgement.frees {
            self.axis.fault();
        } else if judgement.is_fault {
            self.axis
                .fault_reaction(&self.configuration, &targets, &actual);
        } else if judgement.connection_lost {
            // A fault it is not: that was judged with the others.
            let before = self.axis.state();
            self.axis
                .connection_lost(&self.configuration, &targets, &actual);
            if self.axis.state() != before {
                self.word.hold();
            }
        }
        self.take_demand();
        // It is a part of the supply and moves with it.
        self.new_command |= matches!(self.demand(), Demand::PhaseVoltage { .. });
    }

    pub(crate) fn take_command(&mut self) -> Option<Command<f32>> {
        core::mem::take(&mut self.new_command).then(|| {
            command(
                self.demand(),
                self.axis.mode(),
                &self.limited_configuration(),
                self.max_motor_velocity,
                &self.loops,
                self.feedback.bus_voltage_v,
            )
        })
    }

    /// Limits that changed while the demand goes on.
    pub(crate) fn take_limits(&mut self) -> Option<Limits<f32>> {
        core::mem::take(&mut self.new_limits).then(|| {
            limits(
                self.demand(),
                self.axis.mode(),
                &self.limited_configuration(),
                self.max_motor_velocity,
                &self.loops,
            )
        })
    }

    pub(crate) fn take_parameters(&mut self, image: &Image<'_>) -> Option<Parameters<f32>> {
        core::mem::take(&mut self.new_parameters).then_some(())?;
        // They were read without an error when they changed.
        read_parameters(image, self.personality, &self.hardware, self.direct)
            .ok()
            .map(|(parameters, _)| parameters)
    }

    pub(crate) fn take_position_shift(&mut self) -> Option<i32> {
        self.new_shift.take()
    }

    pub(crate) fn take_captures(&mut self, image: &Image<'_>) -> Option<CaptureOrder> {
        let news = core::mem::take(&mut self.new_captures);
        (news != News::default()).then(|| {
            let inputs = self.personality.inputs.as_ref();
            let homing = self.axis.trigger().map(homing_trigger);
            CaptureOrder {
                inverted: inputs.map_or(0, |inputs| image.raw(inputs.inverted)),
                filter: inputs.map_or([0; 2], |inputs| {
                    inputs.filter_us.map(|object| {
                        let ns = image.raw(object).saturating_mul(1000);
                        let periods = self.loops.timing.control_periods(ns);
                        u16::try_from(periods).unwrap_or(u16::MAX)
                    })
                }),
                triggers: [
                    homing.filter(|_| news.has(News::HOMING)),
                    news.has(News::PROBE_1).then(|| self.probes.trigger(0)),
                    news.has(News::PROBE_2).then(|| self.probes.trigger(1)),
                ],
            }
        })
    }

    pub(crate) fn timing(&self) -> PwmTiming {
        self.loops.timing
    }

    pub(crate) fn parameter_error(&self) -> Option<ParameterError> {
        self.parameter_error
    }

    fn configure(&mut self, image: &Image<'_>) {
        let objects = &self.personality.axis;
        self.configuration = self.read_configuration(image);
        self.max_motor_velocity = max_motor_velocity(image, objects);
        self.new_limits = true;
        self.new_captures.add(News::INVERTED);
    }

    fn read_configuration(&self, image: &Image<'_>) -> Configuration {
        let mut configuration = read_configuration(image, &self.personality.axis);
        configuration.homing.counts_per_turn = self.loops.counts_per_turn;
        configuration
    }

    /// With what the axis itself takes back of its torque.
    fn limited_configuration(&self) -> Configuration {
        Configuration {
            max_torque_pm: self.axis.torque_limit_pm(&self.configuration),
            ..self.configuration
        }
    }

    fn configure_loops(&mut self, image: &Image<'_>) {
        self.gains_shown = false;
        match read_parameters(image, self.personality, &self.hardware, self.direct) {
            Ok((_, loops)) => {
                self.loops = loops;
                self.new_parameters = true;
                self.parameter_error = None;
            }
            Err(error) => {
                // Those that were not fetched yet are gone with the objects.
                self.new_parameters = false;
                self.parameter_error = Some(error);
            }
        }
    }

    fn take_demand(&mut self) {
        if let Some(shift) = self.axis.take_position_shift() {
            self.rename(shift);
        }
        if self.axis.take_trigger().is_some() {
            self.new_captures.add(News::HOMING);
        }
        let limit = self.axis.torque_limit_pm(&self.configuration);
        if limit != self.torque_limit_pm {
            self.torque_limit_pm = limit;
            self.new_limits = true;
        }
        self.new_command |= self.axis.take_demand().is_some();
    }

    /// All positions become `shift` counts greater, at once also those that are shown before the control half has been seen again.
    fn rename(&mut self, shift: i32) {
        self.new_shift = Some(self.new_shift.unwrap_or(0).wrapping_add(shift));
        self.faults.position_renamed();
        self.seen.rename(shift);
        for position in [
            &mut self.feedback.position,
            &mut self.feedback.demand_position,
            &mut self.feedback.next_position,
        ] {
            *position = position.wrapping_add(shift);
        }
    }

    pub(crate) fn personality(&self) -> &'static Personality {
        self.personality
    }

    /// The program has been stopped (0x1F51): nothing moves until the next start.
    pub(crate) fn program_stops(&mut self) {
        self.is_stopped = true;
    }

    /// The program is to start (0x1F51).
    pub(crate) fn program_starts(&mut self) {
        self.restart = true;
    }

    /// Whether the power stage is on.
    pub(crate) fn is_powered(&self) -> bool {
        *self.demand() != Demand::Off
    }

    /// The axis's demand, or that of the drive's own behaviour.
    pub(crate) fn demand(&self) -> &Demand {
        self.own.demand(0).unwrap_or_else(|| self.axis.demand())
    }

    fn actual(&self) -> Actual {
        let feedback = &self.feedback;
        // The demand that counts is the next period's. The position moves along with it, so that
        // their difference stays the following error of one moment.
        let moved = match self.demand() {
            Demand::Position { .. } => feedback
                .next_position
                .wrapping_sub(feedback.demand_position),
            _ => 0,
        };
        Actual {
            position: feedback.position.wrapping_add(moved),
            velocity: feedback.velocity_reported,
            torque_pm: feedback.current_q_a * self.loops.pm_per_ampere,
            demand_position: feedback.next_position,
            demand_fraction: feedback.next_fraction,
            demand_velocity: feedback.next_velocity,
            demand_torque_pm: feedback.next_current_a * self.loops.pm_per_ampere,
            electrical_angle: (feedback.electrical_angle >> 16) as i16,
            demand_left_ns: self
                .loops
                .timing
                .control_periods_ns(feedback.next_periods_left),
            limited: feedback.current_limited
                || feedback.velocity_limited
                || feedback.voltage_limited,
            voltage: feedback.bus_voltage_v > self.personality.supply.present_v,
            warning: self.faults.has_warning(),
            homing: homing_inputs(&self.seen),
        }
    }

    /// The stored parameters are in the image.
    pub(crate) fn loaded(&mut self, image: &Image<'_>) {
        self.direct = Direct::of_stored(image, &self.personality.amplifier.gains);
    }

    /// The image is about to be stored.
    pub(crate) fn before_store(&mut self, image: &mut Image<'_>) {
        let gains = &self.personality.amplifier.gains;
        self.direct.before_store(image, gains);
        self.gains_shown = false;
    }

    /// Writes the gains that follow from those written into the image, if they have changed. A write
    /// to one of them keeps what is shown of the others.
    pub(crate) fn show_gains(&mut self, image: &mut Image<'_>) {
        if !core::mem::replace(&mut self.gains_shown, true) {
            let figures = figures(image, self.personality);
            let gains = &self.personality.amplifier.gains;
            self.direct.show(image, gains, &figures);
        }
    }

    /// Writes what the drive shows into the image.
    pub(crate) fn publish(&mut self, image: &mut Image<'_>) {
        publish(
            image,
            &self.personality.axis,
            &self.axis,
            &self.feedback,
            &self.signals,
            self.loops.pm_per_ampere,
            self.configuration.vl.counts_per_s,
        );
        if let Some(homing) = &self.personality.axis.homing {
            image.set(homing.is_homed, u8::from(self.axis.is_homed()));
            if let Some(search) = &homing.search {
                let error = self.axis.homing_error();
                image.set(search.error, error.map_or(0, cia402::HomingError::number));
            }
        }
        if let Some(inputs) = &self.personality.inputs {
            inputs::show(image, inputs, self.seen.active, &self.signals);
            if self.signals.torque_off {
                let status = self.axis.statusword().0 | Statusword::TORQUE_OFF;
                image.set(self.personality.axis.statusword, status);
            }
            self.probes.publish(image, &inputs.probes, &self.seen);
        }
        self.own.publish(image, &self.view());
    }
}
