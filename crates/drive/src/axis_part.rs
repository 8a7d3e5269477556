//! One axis of a drive: what a write to its objects means, and what a millisecond brings it.

mod handing_over;
mod own;
mod writes;

use canopen::{Changed, Image, Instant};
use cia402::{Actual, Axis, Configuration, Demand, Mode, Target, Targets};
use control::Feedback;
use control::capture::Seen;
use control::io::Signals;
use personalities::own::OwnBehaviour;
use personalities::{AxisPersonality, Personality, class};

use crate::captures::{News, homing_inputs};
use crate::configuration::{max_motor_velocity, read_configuration, read_targets};
use crate::faults::{AxisFaults, Happened, Observation};
use crate::gains::Direct;
use crate::inputs::{Asked, Word, analog_target};
use crate::parameters::{LoopParameters, figures, read_parameters};
use crate::phasing::PhasingWatch;
use crate::probes::Probes;
use crate::{Hardware, ParameterError, PwmTiming};

/// What a drive has once and its axes need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Common<'a, O> {
    pub(crate) hardware: &'a Hardware,
    pub(crate) own: &'a O,
    /// The program is stopped: the power stage stays off.
    pub(crate) is_stopped: bool,
}

/// What the communication half has for one axis. It is made, and looked into, by the drive core.
#[derive(Clone, Debug)]
pub struct AxisPart {
    personality: &'static Personality,
    its: &'static AxisPersonality,
    /// Which axis of the drive, from 0.
    number: u8,
    pub(crate) axis: Axis,
    configuration: Configuration,
    /// 0x6080 or its like, counts/s.
    max_motor_velocity: Option<f32>,
    loops: LoopParameters,
    parameter_error: Option<ParameterError>,
    pub(crate) faults: AxisFaults,
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
    /// By how much positions become greater; 0: they keep their names.
    new_shift: i32,
    new_captures: News,
    probes: Probes,
    word: Word,
    /// Safe torque off has taken the torque away since the last tick.
    torque_lost: bool,
    /// As last handed over, per mille.
    torque_limit_pm: f32,
}

impl AxisPart {
    /// Reads everything of axis `number` (0 is the first) from the image.
    ///
    /// # Errors
    /// The [`ParameterError`] of a dictionary whose very defaults make no drive.
    pub(crate) fn new(
        personality: &'static Personality,
        number: usize,
        hardware: &Hardware,
        image: &Image<'_>,
    ) -> Result<AxisPart, ParameterError> {
        let axes = personality.axes;
        let its = axes.get(number).ok_or(ParameterError::Axes(axes.len()))?;
        let (_, loops) = read_parameters(image, its, hardware, Direct::default())?;
        let mut part = AxisPart {
            personality,
            its,
            number: number as u8,
            axis: Axis::new(&personality.cia402),
            configuration: read_configuration(image, &its.objects),
            max_motor_velocity: None,
            loops,
            parameter_error: None,
            faults: AxisFaults::default(),
            feedback: Feedback::silent(),
            signals: Signals::QUIET,
            phasing: PhasingWatch::default(),
            seen: Seen::default(),
            new_command: true,
            new_limits: false,
            new_parameters: true,
            direct: Direct::default(),
            gains_shown: false,
            new_shift: 0,
            new_captures: News::INVERTED,
            probes: Probes::default(),
            word: Word::default(),
            torque_lost: false,
            torque_limit_pm: 0.0,
        };
        part.configure(&(), image);
        part.axis.initialised();
        Ok(part)
    }

    /// Takes what the control half has seen.
    #[inline]
    pub(crate) fn observe<O: OwnBehaviour>(
        &mut self,
        own: &O,
        feedback: &Feedback<f32>,
        signals: &Signals,
        seen: &Seen,
    ) {
        self.feedback = *feedback;
        self.signals = *signals;
        self.seen = *seen;
        if self.its.inputs.is_none() {
            self.seen.active = 0;
            self.signals.torque_off = false;
        }
        if self.signals.torque_off {
            self.torque_lost |= self.is_powered(own);
            self.axis.torque_off();
            self.new_command |= self.axis.take_demand().is_some();
        }
    }

    /// Acts upon writes that were committed.
    pub(crate) fn changed<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
        changed: Changed,
    ) {
        let classes = self.number.wrapping_mul(class::PER_AXIS);
        let has = |class: u8| changed.has(class + classes);
        if has(class::CONTROL) {
            self.configure_loops(common, image);
            self.configure(common.own, image);
        } else if has(class::CONFIGURATION) {
            self.configure(common.own, image);
        }
        self.take_targets(common, image, |class| changed.has(class + classes));
        if changed.has(class::TOUCH_PROBE + classes)
            && let Some(inputs) = &self.its.inputs
        {
            let function = image.raw(inputs.probes.function) as u16;
            self.new_captures.add(self.probes.write(function));
        }
        self.take_demand();
    }

    /// Hands over the targets of the classes that were written.
    fn take_targets<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
        has: impl Fn(u8) -> bool,
    ) {
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
            if has(class) {
                let targets = self.targets(common.own, image);
                let actual = self.actual(common.own);
                self.axis
                    .set_point(target, &self.configuration, &targets, &actual);
            }
        }
    }

    /// What the master wants, or an analog input in its stead.
    fn targets<O: OwnBehaviour>(&self, own: &O, image: &Image<'_>) -> Targets {
        let mut targets = read_targets(image, &self.its.objects);
        own.targets(self.number, image, &mut targets);
        match &self.its.inputs {
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
        self.its.inputs.as_ref().map_or(Asked::default(), |inputs| {
            Asked::by(image, inputs, self.seen.active, self.signals.torque_off)
        })
    }

    /// Inputs act as bits of the controlword do.
    pub(crate) fn obey_inputs<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
    ) {
        let asked = self.asked(image);
        if !common.is_stopped && self.word.ask(asked) {
            self.pass_controlword(common, image);
        }
    }

    /// A SYNC was received; what came with it has been acted upon.
    pub(crate) fn sync<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
        now: Instant,
    ) {
        self.faults.sync(now);
        if self.axis.mode() == Mode::INTERPOLATED_POSITION {
            let targets = self.targets(common.own, image);
            let actual = self.actual(common.own);
            self.axis.sync(&self.configuration, &targets, &actual);
            self.take_demand();
        }
    }

    /// Once per millisecond.
    pub(crate) fn tick<O: OwnBehaviour>(
        &mut self,
        common: &Common<'_, O>,
        image: &Image<'_>,
        now: Instant,
        happened: &Happened,
    ) {
        let targets = self.targets(common.own, image);
        let actual = self.actual(common.own);
        self.axis.tick(&self.configuration, &targets, &actual);
        // Homing may have renamed all positions.
        self.take_demand();
        let actual = self.actual(common.own);
        // In a frame that the master turns, a current says nothing of the rotor.
        let follows_rotor = matches!(
            self.demand(common.own),
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
            motor_temperature_c: self.motor_temperature_c(common.hardware),
            phasing_error,
            conditions: self.axis.conditions(),
            feedback: &self.feedback,
            signals: &self.signals,
            parameters_are_valid: self.parameter_error.is_none(),
            enabled: self.is_powered(common.own),
            active_inputs: self.seen.active,
            torque_lost: core::mem::take(&mut self.torque_lost),
            // "Ignored in Idle/Homing modes" (l.998).
            ignores_switches: matches!(self.axis.mode(), Mode::IDLE | Mode::HOMING),
            connection_matters: self.is_powered(common.own)
                && self.configuration.abort_connection_option == 1,
            own_causes: common.own.axis_causes(self.number),
        };
        let judgement = self.faults.judge(self.personality, image, &seen, happened);
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
        let integrates = common.own.integrates_velocity(self.number);
        self.new_command |=
            integrates && matches!(self.demand(common.own), Demand::Velocity { .. });
        // It is a part of the supply and moves with it.
        self.new_command |= matches!(
            self.demand(common.own),
            Demand::PhaseVoltage { .. } | Demand::RotorVoltage { .. }
        );
    }

    pub(crate) fn timing(&self) -> PwmTiming {
        self.loops.timing
    }

    pub(crate) fn parameter_error(&self) -> Option<ParameterError> {
        self.parameter_error
    }

    fn configure<O: OwnBehaviour>(&mut self, own: &O, image: &Image<'_>) {
        let objects = &self.its.objects;
        self.configuration = self.read_configuration(own, image);
        self.max_motor_velocity = max_motor_velocity(image, objects);
        self.new_limits = true;
        self.new_captures.add(News::INVERTED);
    }

    fn read_configuration<O: OwnBehaviour>(&self, own: &O, image: &Image<'_>) -> Configuration {
        let mut configuration = read_configuration(image, &self.its.objects);
        configuration.homing.counts_per_turn = self.loops.counts_per_turn;
        own.configuration(self.number, image, &mut configuration);
        configuration
    }

    /// With what the axis itself takes back of its torque.
    fn limited_configuration(&self) -> Configuration {
        Configuration {
            max_torque_pm: self.axis.torque_limit_pm(&self.configuration),
            ..self.configuration
        }
    }

    fn configure_loops<O: OwnBehaviour>(&mut self, common: &Common<'_, O>, image: &Image<'_>) {
        self.gains_shown = false;
        match read_parameters(image, self.its, common.hardware, self.direct) {
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
        self.new_shift = self.new_shift.wrapping_add(shift);
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

    /// Whether the power stage is on.
    pub(crate) fn is_powered<O: OwnBehaviour>(&self, own: &O) -> bool {
        *self.demand(own) != Demand::Off
    }

    /// The axis's demand, or that of the drive's own behaviour.
    pub(crate) fn demand<'a, O: OwnBehaviour>(&'a self, own: &'a O) -> &'a Demand {
        own.demand(self.number)
            .unwrap_or_else(|| self.axis.demand())
    }

    fn actual<O: OwnBehaviour>(&self, own: &O) -> Actual {
        let feedback = &self.feedback;
        // The demand that counts is the next period's. The position moves along with it, so that
        // their difference stays the following error of one moment.
        let moved = match self.demand(own) {
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
        self.direct = Direct::of_stored(image, &self.its.amplifier.gains);
    }

    /// The image is about to be stored.
    pub(crate) fn before_store(&mut self, image: &mut Image<'_>) {
        let gains = &self.its.amplifier.gains;
        self.direct.before_store(image, gains);
        self.gains_shown = false;
    }

    /// Writes the gains that follow from those written into the image, if they have changed. A write
    /// to one of them keeps what is shown of the others.
    pub(crate) fn show_gains(&mut self, image: &mut Image<'_>) {
        if !core::mem::replace(&mut self.gains_shown, true) {
            let figures = figures(image, self.its);
            let gains = &self.its.amplifier.gains;
            self.direct.show(image, gains, &figures);
        }
    }
}
