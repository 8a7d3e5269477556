//! The communication half: node, axis and faults.

use can::Frame;
use canopen::nmt::Reset;
use canopen::{
    Abort, Address, Changed, Events, Image, Instant, News, Node, NodeId, NodeMemory, store,
};
use control::capture::Seen;
use control::io::Signals;
use control::{Command, Feedback, Limits, Parameters};
use personalities::Personality;
use personalities::own::{Heard, OwnBehaviour};

use crate::application::Application;
use crate::axis_part::AxisPart;
use crate::body::{Body, OneAxis};
use crate::captures::CaptureOrder;
use crate::faults::CommunicationErrors;
use crate::serving::Serving;
use crate::{Hardware, Health, Host, ParameterError, PwmTiming};

/// Interval of the axis's tick, ns.
const TICK_NS: u64 = 1_000_000;
/// From the acknowledge of "start program" to the restart, which would take it off the bus.
const RESTART_TICKS: u8 = 10;

// Image, node and axis of a P3 on a microcontroller.
#[cfg(target_pointer_width = "32")]
const _: () = assert!(size_of::<Comms<[u8; personalities::p3::IMAGE_BYTES]>>() <= 3 * 1024);

/// What the drive asks of the host that carries it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Store parameters ([`Comms::stored`] makes the bytes), then call [`Comms::store_done`].
    Store(store::Request),
    /// Put parameters back to their defaults: store what [`Comms::restored`] makes, then call
    /// [`Comms::store_done`]. The defaults hold from the next start on.
    Restore(store::Request),
    /// Start over. After [`Reset::Node`] build the drive anew; after [`Reset::Communication`] call
    /// [`Comms::reset_communication`] with what is stored.
    Reset(Reset),
}

/// The node ID in stored parameters, of a drive that keeps its own there (the P3's 0x21B0). Damaged
/// ones have none.
pub fn stored_node_id(personality: &Personality, stored: &[u8]) -> Option<NodeId> {
    let object = personality.node_id?;
    let mut records = store::records(stored).ok()?;
    let record = records.find(|record| record.address == object.address)?;
    let (low, rest) = record.bytes.split_first()?;
    let is_byte = rest.iter().all(|byte| *byte == 0);
    is_byte.then(|| NodeId::new(*low)).flatten()
}

/// A communication half, the parameters with which each axis's control half begins, and what was wrong with
/// those stored.
pub type Made<M, O = (), B = OneAxis> = (
    Comms<M, O, B>,
    <B as Body>::List<Parameters<f32>>,
    Option<store::Damage>,
);

/// The communication half of a drive.
///
/// After each call of any function take frames with [`Comms::transmit`] until there are none, and
/// what the control half needs with the `take_` functions; call [`Comms::poll`] at
/// [`Comms::next_deadline`]. `O` is what only this drive does, `()` is nothing; `B` what carries it.
#[derive(Clone, Debug)]
pub struct Comms<M, O = (), B: Body = OneAxis> {
    node: Node<M>,
    pub(crate) application: Application<O, B>,
    reset: Option<Reset>,
    /// Ticks until the node starts over with another program; 0: it does not.
    restart_in: u8,
    /// The controller has been off the bus since the last poll.
    was_bus_off: bool,
    /// The host stores parameters, or puts them back.
    is_storing: bool,
    next_tick: Instant,
}

impl<M: NodeMemory, O: OwnBehaviour> Comms<M, O> {
    /// A drive with one axis; see [`Comms::build`].
    ///
    /// # Errors
    /// See [`Comms::build`].
    pub fn new(
        personality: &'static Personality,
        hardware: Hardware,
        memory: M,
        id: NodeId,
        serial: u32,
        stored: &[u8],
        health: Health,
    ) -> Result<Made<M, O>, ParameterError> {
        Comms::build(personality, hardware, memory, id, serial, stored, health)
    }
}

impl<M: NodeMemory, O: OwnBehaviour, B: Body> Comms<M, O, B> {
    /// A drive that is silent until [`Comms::start`]. `stored` are the bytes last made by
    /// [`Comms::stored`], empty if there are none; `serial` its serial number. What the host knows
    /// of the reason for this start is in `health`.
    ///
    /// Damaged stored parameters are not used; the drive starts with its defaults and announces a
    /// parameter error. Returned beside it: the parameters with which each axis's control half begins,
    /// and what was wrong with those stored.
    ///
    /// # Errors
    /// [`ParameterError`] if the personality's own defaults make no drive, or the body has no room for
    /// its axes.
    pub fn build(
        personality: &'static Personality,
        hardware: Hardware,
        memory: M,
        id: NodeId,
        serial: u32,
        stored: &[u8],
        health: Health,
    ) -> Result<Made<M, O, B>, ParameterError> {
        let mut node = Node::new(&personality.device, memory, id);
        let table = personality.device.table;
        let mut image = node.image();
        if let Some(handle) = personality.serial_number {
            image.set(handle, serial);
        }
        // On the defaults first: stored parameters that make no drive are a parameter error, not
        // the end of it.
        let (mut application, parameters) = Application::new(personality, hardware, &image)?;
        let damage = store::load(&table, &mut image, stored).err();
        application.faults.report(Health {
            store_damaged: health.store_damaged || damage.is_some(),
            ..health
        });
        show_id(personality, &mut image, id);
        application.loaded(&image);
        application.own = O::new(personality, &image);
        application.changed(&image, Changed::EVERYTHING);
        application.show_gains(&mut image);
        let comms = Comms {
            node,
            application,
            reset: None,
            restart_in: 0,
            was_bus_off: false,
            is_storing: false,
            next_tick: Instant::NEVER,
        };
        Ok((comms, parameters, damage))
    }

    /// Boots up, unless the drive's own behaviour waits for something. Call once.
    pub fn start(&mut self, now: Instant) {
        self.next_tick = now.plus_ns(TICK_NS);
        if !self.application.own.waits() {
            self.boot(now);
        }
    }

    fn boot(&mut self, now: Instant) {
        let events = self.node.start(now);
        self.handle(events, now);
    }

    /// What the control half of an axis (0 is the first) has seen and captured, and the board says;
    /// call for each before [`Comms::receive`] and [`Comms::poll`], so that they act upon the present.
    #[inline]
    pub fn observe(
        &mut self,
        axis: usize,
        feedback: &Feedback<f32>,
        signals: &Signals,
        seen: &Seen,
    ) {
        self.application.observe(axis, feedback, signals, seen);
    }

    /// Takes a frame from the bus. What it means is in force when this returns: the state machine
    /// has moved before the acknowledge can be sent.
    pub fn receive<H: Host>(&mut self, frame: &Frame, now: Instant, host: &mut H) {
        let id = self.node.id();
        self.application.own.heard(frame, id);
        if self.application.own.waits() {
            let (id, view) = (self.node.id(), self.application.view(0));
            let own = &mut self.application.own;
            match own.hear(frame, id, &mut self.node.image(), &view) {
                Heard::Nothing => return,
                Heard::Boots => self.boot(now),
            }
        }
        let mut serving = Serving {
            application: &mut self.application,
            host,
        };
        let events = self.node.receive(frame, now, &mut serving);
        self.handle(events, now);
    }

    /// Does what time asks for.
    pub fn poll<H: Host>(&mut self, now: Instant, host: &mut H) {
        if now >= self.next_tick {
            // After a pause there is one tick, not a burst.
            let due = self.next_tick.plus_ns(TICK_NS);
            self.next_tick = if due > now { due } else { now.plus_ns(TICK_NS) };
            match self.restart_in {
                0 => {}
                1 => {
                    self.restart_in = 0;
                    self.reset = Some(Reset::Node);
                }
                _ => self.restart_in -= 1,
            }
            self.report_communication();
            self.application.tick_own(&mut self.node.image());
            self.application.tick(&self.node.image(), now);
            self.announce(now);
            let mut serving = Serving {
                application: &mut self.application,
                host,
            };
            self.node.detect_events(now, &mut serving);
        }
        let leaves_state = self.application.personality.errors.bus_off_leaves_state;
        let mut serving = Serving {
            application: &mut self.application,
            host,
        };
        let mut events = self.node.poll(now, &mut serving);
        if core::mem::take(&mut self.was_bus_off) && leaves_state {
            self.node
                .communication_error(now, &mut serving, &mut events);
        }
        self.handle(events, now);
    }

    /// When [`Comms::poll`] must be called next.
    #[inline]
    pub fn next_deadline(&self) -> Instant {
        self.next_tick.min(self.node.next_deadline())
    }

    /// The next frame to send, if there is one. After the acknowledge of another node ID (the P3's
    /// 0x21B0) the node has it ([`Node::id`]). Until the next reset of the processor it is the one to
    /// call [`Comms::reset_communication`] with; then [`stored_node_id`] counts.
    #[inline]
    pub fn transmit<H: Host>(&mut self, host: &mut H) -> Option<Frame> {
        if let Some(frame) = self.application.own.take_frame() {
            return Some(frame);
        }
        let frame = self.node.transmit(&mut Serving {
            application: &mut self.application,
            host,
        });
        if self.application.new_node_id.is_some() {
            self.follow(frame.as_ref());
        }
        frame
    }

    /// Takes the node ID that was written, once the acknowledge is on its way with the old one.
    #[cold]
    fn follow(&mut self, sent: Option<&Frame>) {
        if sent.is_none_or(|frame| self.node.is_sdo_answer(frame))
            && let Some(id) = self.application.new_node_id.take()
        {
            self.node.rename(id);
        }
    }

    /// A new command for the control half of an axis; 0 is the first.
    #[inline]
    pub fn take_command(&mut self, axis: usize) -> Option<Command<f32>> {
        self.application.take_command(axis)
    }

    /// New limits for the command in force.
    pub fn take_limits(&mut self, axis: usize) -> Option<Limits<f32>> {
        self.application.take_limits(axis)
    }

    /// New parameters for the control half of an axis.
    pub fn take_parameters(&mut self, axis: usize) -> Option<Parameters<f32>> {
        self.application.take_parameters(axis, &self.node.image())
    }

    /// By how much all positions of an axis become greater, captured ones as well, because the present
    /// one got another name or home was found; in force before the next command.
    pub fn take_position_shift(&mut self, axis: usize) -> Option<i32> {
        self.application.axis_mut(axis)?.take_position_shift()
    }

    /// What the control half of an axis shall capture.
    pub fn take_captures(&mut self, axis: usize) -> Option<CaptureOrder> {
        let image = self.node.image();
        self.application.axis_mut(axis)?.take_captures(&image)
    }

    /// The outputs that are to be active, in the order of 0x60FE.
    pub fn outputs(&mut self) -> u32 {
        let image = self.node.image();
        let axes = self.application.personality.axes.iter();
        let inputs = axes.filter_map(|axis| axis.inputs.as_ref());
        inputs.fold(0, |active, inputs| {
            let (outputs, mask) = inputs.outputs;
            active | image.raw(outputs) & image.raw(mask)
        })
    }

    /// Whether the drive's terminating resistor is to be on the bus.
    pub fn is_terminated(&mut self) -> bool {
        let image = self.node.image();
        self.application
            .personality
            .termination
            .is_some_and(|object| image.raw(object.field()) != 0)
    }

    /// What the drive asks of its host.
    pub fn take_request(&mut self) -> Option<Request> {
        if let Some(reset) = self.reset.take() {
            return Some(Request::Reset(reset));
        }
        let Some(request) = self.application.storage_request.take() else {
            return self.application.own.take_reset().map(Request::Reset);
        };
        self.is_storing = true;
        Some(match self.application.restores {
            true => Request::Restore(request),
            false => Request::Store(request),
        })
    }

    /// Makes the bytes to be stored for `request` in `out`, keeping what else `old` holds. Returns
    /// their number.
    ///
    /// # Errors
    /// [`store::Full`] if `out` is too small.
    pub fn stored(
        &mut self,
        request: store::Request,
        old: &[u8],
        out: &mut [u8],
    ) -> Result<usize, store::Full> {
        let (table, id) = (self.application.personality.device.table, self.node.id());
        self.node.withdraw_verification();
        self.application.before_store(&mut self.node.image());
        let used = store::save(&table, &self.node.image(), id, request, old, out);
        self.application.show_gains(&mut self.node.image());
        used
    }

    /// Makes the bytes to be stored for [`Request::Restore`] in `out`: `old` without what goes back
    /// to its defaults. Returns their number.
    ///
    /// # Errors
    /// [`store::Full`] if `out` is too small.
    pub fn restored(
        &self,
        request: store::Request,
        old: &[u8],
        out: &mut [u8],
    ) -> Result<usize, store::Full> {
        store::restore(
            &self.application.personality.device.table,
            request,
            old,
            out,
        )
    }

    /// The host has stored, or could not.
    pub fn store_done(&mut self, result: Result<(), Abort>, now: Instant) {
        self.is_storing = false;
        self.application.own.store_done(result.is_ok());
        self.node.complete(result, now);
    }

    /// An object's value, asked for by another way than CAN.
    ///
    /// # Errors
    /// What an SDO upload would be answered; [`Abort::LENGTH`] for an object that is no integer.
    pub fn read_local<H: Host>(&mut self, object: Address, host: &mut H) -> Result<i64, Abort> {
        let application = &mut self.application;
        self.node
            .read_local(object, &mut Serving { application, host })
    }

    /// Writes an object by another way than CAN. What it means is in force when this returns.
    ///
    /// # Errors
    /// What an SDO download would be answered; [`Abort::LENGTH`] for an object that is no integer of at
    /// most 32 bits.
    pub fn write_local<H: Host>(
        &mut self,
        object: Address,
        value: i64,
        now: Instant,
        host: &mut H,
    ) -> Result<(), Abort> {
        let application = &mut self.application;
        let mut serving = Serving { application, host };
        let events = self.node.write_local(object, value, now, &mut serving)?;
        self.handle(events, now);
        Ok(())
    }

    /// Asks for all parameters to be stored, by another way than CAN: the next
    /// [`Comms::take_request`].
    ///
    /// # Errors
    /// [`Abort::DEVICE_STATE`] while others are being stored.
    pub fn store_local(&mut self) -> Result<(), Abort> {
        let asked = self.application.storage_request.is_some();
        if asked || self.is_storing || self.node.is_busy() {
            return Err(Abort::DEVICE_STATE);
        }
        self.application.storage_request = Some(store::Request::All);
        self.application.restores = false;
        Ok(())
    }

    /// The host saw something that concerns the drive's health.
    pub fn report(&mut self, event: Health) {
        self.was_bus_off |= event.bus_off_recovered;
        self.application.faults.report(event);
    }

    /// Tells the fault manager what the node has noticed.
    fn report_communication(&mut self) {
        let errors = self.node.errors();
        self.application
            .faults
            .report_communication(CommunicationErrors::of(errors));
    }

    /// Starts communication over with the node ID `id`, which LSS may have changed: the
    /// communication parameters are those stored, everything else stays. A download to the host's
    /// program memory is over; the host knows.
    pub fn reset_communication(&mut self, stored: &[u8], id: NodeId, now: Instant) {
        self.node.restart_communication(stored, id);
        show_id(self.application.personality, &mut self.node.image(), id);
        let events = self.node.start(now);
        // No parameter of the axis has changed, and no set-point has come.
        let changed = Changed::NOTHING;
        self.handle(Events { changed, ..events }, now);
    }

    /// The rate of the bridge and the loops, as the parameters of the first axis say.
    pub fn timing(&self) -> PwmTiming {
        self.application.first().timing()
    }

    /// Why the present parameters make no controllers, if so; the last good ones are in force.
    pub fn parameter_error(&self) -> Option<ParameterError> {
        let mut axes = self.application.axes().iter();
        axes.find_map(AxisPart::parameter_error)
    }

    /// The first axis.
    pub fn axis(&self) -> &cia402::Axis {
        &self.application.first().axis
    }

    /// All axes.
    pub fn axes(&self) -> impl Iterator<Item = &cia402::Axis> {
        self.application.axes().iter().map(|part| &part.axis)
    }

    /// The node.
    pub fn node(&self) -> &Node<M> {
        &self.node
    }

    /// The values of the dictionary, as last published.
    pub fn image(&mut self) -> Image<'_> {
        self.node.image()
    }

    fn handle(&mut self, events: Events, now: Instant) {
        if !events.changed.is_empty() {
            self.application.changed(&self.node.image(), events.changed);
            self.application.show_gains(&mut self.node.image());
        }
        if events.sync {
            self.application.sync(&self.node.image(), now);
        }
        if events.reset.is_some() {
            self.reset = events.reset;
        }
        if let Some(state) = events.entered {
            self.application.own.entered(state);
        }
        if events.news.has(News::ERRORS) {
            self.report_communication();
        }
        if core::mem::take(&mut self.application.restart) {
            self.restart_in = RESTART_TICKS;
        }
        self.announce(now);
    }

    /// Sends what the fault manager has to say, and keeps the error objects.
    fn announce(&mut self, now: Instant) {
        while let Some(news) = self.application.announce() {
            self.node
                .announce(news.code, news.register, news.vendor, now);
            let status = self.application.status_register();
            let mut image = self.node.image();
            if let Some(handle) = self.application.personality.status_register {
                image.set(handle, status);
            }
            if let (Some(handle), Some(code)) =
                (self.application.personality.error_code, news.shown)
            {
                image.set(handle, code);
            }
        }
    }
}

/// Shows the node ID where the drive has an object for it.
fn show_id(personality: &Personality, image: &mut Image<'_>, id: NodeId) {
    if let Some(object) = personality.node_id {
        image.set_raw(object.field, u32::from(id.get()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bar of 3 KiB is for 32-bit targets and asserted there, above. Pointers and the padding
    /// behind them make a 64-bit drive a good tenth larger.
    #[test]
    fn a_p3_is_small_even_with_64_bit_pointers() {
        let bytes = size_of::<Comms<[u8; personalities::p3::IMAGE_BYTES]>>();
        assert!(bytes <= 3 * 1024 + 512, "{bytes}");
    }
}
