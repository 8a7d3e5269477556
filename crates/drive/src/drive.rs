//! Both halves in one value.

use can::Frame;

use canopen::{Instant, NodeId, NodeMemory, store};
use control::capture::Captures;
use control::io::{Duty, Sample, Scales, Signals};
use control::{Cascade, Command, Feedback};
use personalities::Personality;
use personalities::board::{Board, Lights};
use personalities::own::OwnBehaviour;

use crate::body::{Body, List, OneAxis};
use crate::{Comms, Health, Host, Local, Made, ParameterError, PwmTiming, Request};

/// What the drive knows of the board it runs on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hardware {
    /// How the converters convert.
    pub scales: Scales,
    /// Part of the PWM period, 0 to ½, that each phase spends at least on either rail, for current
    /// sampling or the gate drivers.
    pub duty_margin: f32,
}

/// A drive: communication half and control half.
///
/// The host calls [`Drive::control_period`] (for each axis [`Drive::axis_period`]) at the control rate, [`Drive::receive`] for each frame,
/// [`Drive::poll`] at [`Drive::next_deadline`], and after each of the last two takes frames with
/// [`Drive::transmit`] and looks at [`Drive::take_request`]. `O` is what only this drive does, `()` is
/// nothing; `B` what carries it.
#[derive(Clone, Debug)]
pub struct Drive<M, O = (), B: Body = OneAxis> {
    pub(crate) comms: Comms<M, O, B>,
    axes: B::List<ControlPart>,
}

/// The control half of one axis.
#[derive(Clone, Debug)]
struct ControlPart {
    cascade: Cascade<f32>,
    captures: Captures,
    has_torque_off: bool,
    /// Safe torque off was active since the communication half last looked; until then no command
    /// reaches the loops.
    torque_lost: bool,
    signals: Signals,
}

/// A drive, and what was wrong with its stored parameters.
pub type MadeDrive<M, O = (), B = OneAxis> = (Drive<M, O, B>, Option<store::Damage>);

impl<M: NodeMemory, O: OwnBehaviour> Drive<M, O> {
    /// A drive with one axis; see [`Comms::new`].
    ///
    /// # Errors
    /// See [`Comms::new`].
    pub fn new(
        personality: &'static Personality,
        hardware: Hardware,
        memory: M,
        id: NodeId,
        serial: u32,
        stored: &[u8],
        health: Health,
    ) -> Result<(Drive<M, O>, Option<store::Damage>), ParameterError> {
        Drive::build(personality, hardware, memory, id, serial, stored, health)
    }
}

impl<M: NodeMemory, O: OwnBehaviour, B: Body> Drive<M, O, B> {
    /// See [`Comms::build`].
    ///
    /// # Errors
    /// See [`Comms::build`].
    pub fn build(
        personality: &'static Personality,
        hardware: Hardware,
        memory: M,
        id: NodeId,
        serial: u32,
        stored: &[u8],
        health: Health,
    ) -> Result<MadeDrive<M, O, B>, ParameterError> {
        let made: Made<M, O, B> =
            Comms::build(personality, hardware, memory, id, serial, stored, health)?;
        let (comms, parameters, damage) = made;
        let count = personality.axes.len();
        let axes = List::build(count, |number| {
            let axis = personality.axes.get(number);
            let (Some(axis), Some(parameters)) = (axis, parameters.as_ref().get(number)) else {
                return Err(ParameterError::Axes(count));
            };
            Ok(ControlPart {
                cascade: Cascade::new(parameters),
                captures: Captures::new(),
                has_torque_off: axis.inputs.is_some(),
                torque_lost: false,
                signals: Signals::QUIET,
            })
        })?;
        let mut drive = Drive { comms, axes };
        drive.hand_over();
        Ok((drive, damage))
    }

    /// Boots up. Call once.
    pub fn start(&mut self, now: Instant) {
        self.comms.start(now);
        self.hand_over();
    }

    /// Takes a frame from the bus.
    pub fn receive<H: Host>(&mut self, frame: &Frame, now: Instant, host: &mut H) {
        self.observe();
        self.comms.receive(frame, now, host);
        self.hand_over();
    }

    /// Does what time asks for.
    pub fn poll<H: Host>(&mut self, now: Instant, host: &mut H) {
        self.observe();
        self.comms.poll(now, host);
        self.hand_over();
    }

    /// When [`Drive::poll`] must be called next.
    #[inline]
    pub fn next_deadline(&self) -> Instant {
        self.comms.next_deadline()
    }

    /// The next frame to send, if there is one.
    #[inline]
    pub fn transmit<H: Host>(&mut self, host: &mut H) -> Option<Frame> {
        self.comms.transmit(host)
    }

    /// One control period of the first axis: from what the sensors say to what the bridge shall do.
    #[inline]
    pub fn control_period(&mut self, sample: &Sample<f32>, signals: &Signals) -> Duty<f32> {
        self.axis_period(0, sample, signals)
    }

    /// One control period of an axis; 0 is the first. Without such an axis the bridge is open.
    #[inline]
    pub fn axis_period(
        &mut self,
        axis: usize,
        sample: &Sample<f32>,
        signals: &Signals,
    ) -> Duty<f32> {
        let sample = Sample {
            encoder: self.comms.reading(axis, sample.encoder),
            ..*sample
        };
        match self.axes.as_mut().get_mut(axis) {
            Some(part) => part.period(&sample, signals),
            None => Duty {
                phase: [0.5; 3],
                enabled: false,
            },
        }
    }

    /// [`Drive::axis_period`], and whether it has left the control half as it was. It then leaves it so
    /// as long as sensors and board say the same and no other function of this drive is called.
    pub fn repeated_period(
        &mut self,
        axis: usize,
        sample: &Sample<f32>,
        signals: &Signals,
    ) -> (Duty<f32>, bool) {
        let state = |drive: &Self| {
            let part = drive.axes.as_ref().get(axis)?;
            Some((part.cascade, part.captures))
        };
        let before = state(self);
        let duty = self.axis_period(axis, sample, signals);
        (duty, before == state(self))
    }

    /// What parts of the board say that the loops of an axis do not ask; before [`Drive::poll`], or not at
    /// all if its own behaviour has no use for it.
    pub fn look_at(&mut self, axis: usize, board: &Board) {
        self.comms.look_at(axis, board);
    }

    /// What the lights of its board do, if it has any.
    pub fn lights(&self) -> Option<Lights> {
        self.comms.lights()
    }

    /// What the drive asks of its host.
    pub fn take_request(&mut self) -> Option<Request> {
        self.comms.take_request()
    }

    /// See [`Comms::stored`].
    ///
    /// # Errors
    /// See [`Comms::stored`].
    pub fn stored(
        &mut self,
        request: store::Request,
        old: &[u8],
        out: &mut [u8],
    ) -> Result<usize, store::Full> {
        self.comms.stored(request, old, out)
    }

    /// See [`Comms::restored`].
    ///
    /// # Errors
    /// See [`Comms::restored`].
    pub fn restored(
        &self,
        request: store::Request,
        old: &[u8],
        out: &mut [u8],
    ) -> Result<usize, store::Full> {
        self.comms.restored(request, old, out)
    }

    /// See [`Comms::store_done`].
    pub fn store_done(&mut self, result: Result<(), canopen::Abort>, now: Instant) {
        self.comms.store_done(result, now);
    }

    /// See [`Comms::report`].
    pub fn report(&mut self, event: Health) {
        self.comms.report(event);
    }

    /// See [`Comms::reset_communication`]; the answer to [`canopen::Reset::Communication`].
    pub fn reset_communication(&mut self, stored: &[u8], id: NodeId, now: Instant) {
        self.comms.reset_communication(stored, id, now);
        self.hand_over();
    }

    /// The rate of the bridge and the loops.
    pub fn timing(&self) -> PwmTiming {
        self.comms.timing()
    }

    /// See [`Comms::outputs`].
    pub fn outputs(&mut self) -> u32 {
        self.comms.outputs()
    }

    /// See [`Comms::is_terminated`].
    pub fn is_terminated(&mut self) -> bool {
        self.comms.is_terminated()
    }

    /// Its objects, for a command line at `now`.
    pub fn local<'a, H: Host>(
        &'a mut self,
        now: Instant,
        host: &'a mut H,
    ) -> Local<'a, M, O, B, H> {
        self.observe();
        Local::new(self, now, host)
    }

    /// The communication half.
    pub fn comms(&self) -> &Comms<M, O, B> {
        &self.comms
    }

    /// The first axis's loops.
    pub fn cascade(&self) -> &Cascade<f32> {
        &self.axes.first().cascade
    }

    /// What the first axis's loops have seen and do.
    pub fn feedback(&self) -> Feedback<f32> {
        self.cascade().feedback()
    }

    /// What each axis's loops have seen and do.
    pub fn feedbacks(&self) -> impl Iterator<Item = Feedback<f32>> {
        let axes = self.axes.as_ref().iter();
        axes.map(|part| part.cascade.feedback())
    }

    pub(crate) fn observe(&mut self) {
        for (axis, part) in self.axes.as_mut().iter_mut().enumerate() {
            self.comms.observe(
                axis,
                &part.cascade.feedback(),
                &part.signals,
                &part.captures.seen(),
            );
            part.torque_lost = false;
        }
    }

    pub(crate) fn hand_over(&mut self) {
        for (axis, part) in self.axes.as_mut().iter_mut().enumerate() {
            part.take(&mut self.comms, axis);
        }
    }
}

impl ControlPart {
    #[inline]
    fn period(&mut self, sample: &Sample<f32>, signals: &Signals) -> Duty<f32> {
        self.signals = Signals {
            // However short, the communication half gets to know of it.
            torque_off: signals.torque_off || self.torque_lost,
            ..*signals
        };
        if signals.torque_off && self.has_torque_off {
            self.torque_lost = true;
            self.cascade.load(&Command::idle());
        }
        let duty = self.cascade.period(sample);
        let (encoder, position) = (self.cascade.encoder(), self.cascade.position());
        self.captures.period(signals.inputs, encoder, position);
        duty
    }

    /// Gives the control half what the communication half has for it; in force from the next
    /// control period on.
    fn take<M: NodeMemory, O: OwnBehaviour, B: Body>(
        &mut self,
        comms: &mut Comms<M, O, B>,
        axis: usize,
    ) {
        if let Some(parameters) = comms.take_parameters(axis) {
            self.cascade.set_parameters(&parameters);
            let encoder = &parameters.encoder;
            self.captures
                .set_encoder(encoder.counts_per_turn, encoder.user_polarity);
        }
        if let Some(offset) = comms.take_position_shift(axis) {
            self.cascade.rename(offset);
            self.captures.rename(offset);
        }
        if let Some(order) = comms.take_captures(axis) {
            self.captures.set_inverted(order.inverted);
            let [switches, general] = order.filter;
            self.captures.set_filter(switches, general);
            for (latch, trigger) in order.triggers.into_iter().enumerate() {
                if let Some(trigger) = trigger {
                    self.captures.set_trigger(latch, trigger);
                }
            }
        }
        // A command carries the limits; they come apart only while it stays in force.
        let limits = comms.take_limits(axis);
        match (comms.take_command(axis), limits) {
            (Some(command), _) => self.cascade.load(&command),
            (None, Some(limits)) => self.cascade.set_limits(&limits),
            (None, None) => {}
        }
    }
}
