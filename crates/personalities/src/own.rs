//! What one documented drive does that no other does, and no table tells.

use can::Frame;
use canopen::{Address, Image, NmtState, NodeId, Reset, Verdict, store};
use cia402::{Conditions, Configuration, Demand, Mode, State, Targets};

use crate::board::{Board, Lights};
use crate::{Personality, md80, p3_jpl, roboteq};

/// What a drive's own behaviour sees of an axis.
#[derive(Clone, Copy, Debug)]
pub struct AxisView {
    /// Which axis of the drive, from 0.
    pub axis: u8,
    /// State of CiA 402's machine.
    pub state: State,
    /// The mode in force.
    pub mode: Mode,
    /// The value of 0x6041.
    pub statusword: u16,
    /// A fault is latched.
    pub has_fault: bool,
    /// Position, counts.
    pub position: i32,
    /// Position demand, counts.
    pub position_demand: i32,
    /// Velocity, smooth, counts/s.
    pub velocity: f32,
    /// Velocity demand, counts/s.
    pub velocity_demand: f32,
    /// Torque, per mille of rated torque.
    pub torque_pm: f32,
    /// Torque demand, per mille of rated torque.
    pub torque_demand_pm: f32,
    /// Measured currents along d and q, A of phase amplitude.
    pub current_a: [f32; 2],
    /// Voltages along d and q, V of phase amplitude.
    pub voltage_v: [f32; 2],
    /// Electrical angle of the voltage, 1/65,536 turn.
    pub electrical_angle: i16,
    /// The encoder's reading within a turn, counts.
    pub encoder: i32,
    /// Counts per turn.
    pub counts_per_turn: u32,
    /// Motor supply, V.
    pub bus_voltage_v: f32,
    /// Amplifier, °C.
    pub amplifier_temperature_c: f32,
    /// Motor, as its sensor tells, °C.
    pub motor_temperature_c: f32,
    /// The gate driver has seen a short circuit.
    pub overcurrent: bool,
    /// The encoder's reading is valid.
    pub encoder_valid: bool,
    /// A current limit cuts the demand.
    pub current_limited: bool,
    /// The velocity limit cuts the demand.
    pub velocity_limited: bool,
    /// I²t allows no more than the continuous current.
    pub i2t_active: bool,
    /// Limits at work.
    pub conditions: Conditions,
    /// Current converters of phases A and B, converter counts, smoothed.
    pub phase_adc: [f32; 2],
    /// Their reading at no current, as the board's design says.
    pub phase_adc_zero: f32,
    /// The encoder's magnet is at its place.
    pub magnet_is_good: bool,
    /// Angle of an encoder on the output, turns from 0 to 1, if one is there and answers.
    pub output_encoder: Option<f32>,
}

/// What a drive's own behaviour wants done, beside what it answers. Carried out in the order of the
/// fields.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Orders {
    /// The actual position gets this name, counts.
    pub preset_position: Option<i32>,
    /// As if the master had written this mode; what it refuses is ignored.
    pub mode: Option<i8>,
    /// As if the master had switched the axis on up to operation enabled (`true`: shutdown, switch
    /// on and enable operation), or disabled the voltage (`false`).
    pub enable: Option<bool>,
    /// As if the master had written this controlword.
    pub controlword: Option<u16>,
    /// Latched faults end; those whose cause persists come again.
    pub reset_faults: bool,
    /// The demand of [`OwnBehaviour::demand`] is another one than before.
    pub new_demand: bool,
    /// A parameter of the motor or a controller in the image has changed.
    pub new_parameters: bool,
    /// Targets in the image have changed: as if the master had written each of them.
    pub new_targets: bool,
    /// Parameters are to be stored; [`OwnBehaviour::store_done`] tells when they are. No master gets
    /// an answer of it.
    pub store: Option<store::Request>,
}

/// What came of a frame that was heard before the node booted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heard {
    /// Nothing; [`OwnBehaviour::take_frame`] may have an answer.
    Nothing,
    /// The node boots up now, and then gets the frame.
    Boots,
}

/// A drive's own behaviour. Every function has a default, that of a drive without any, `()`.
///
/// The drive core calls these and never asks which drive it is. They are passed what they may look
/// at; what they want done they put into [`Orders`].
pub trait OwnBehaviour: core::fmt::Debug {
    /// That of a drive that has just been reset. `image` holds what was stored.
    fn new(personality: &'static Personality, image: &Image<'_>) -> Self
    where
        Self: Sized;

    /// The node must not boot up yet: it is silent, and frames go to [`OwnBehaviour::hear`].
    fn waits(&self) -> bool {
        false
    }

    /// A frame from the bus while the node waits.
    fn hear(&mut self, frame: &Frame, id: NodeId, image: &mut Image<'_>, view: &AxisView) -> Heard {
        let _ = (frame, id, image, view);
        Heard::Boots
    }

    /// A frame of the behaviour's own, sent before those of the node.
    fn take_frame(&mut self) -> Option<Frame> {
        None
    }

    /// Which axis an object belongs to, from 0: of several, by the windows of 0x800 objects from
    /// 0x6000 on.
    fn axis_of(&self, object: Address) -> u8 {
        match object.index {
            0x6000..=0x9FFF => ((object.index - 0x6000) / 0x800) as u8,
            _ => 0,
        }
    }

    /// The node has entered an NMT state: at its start, or by a command.
    fn entered(&mut self, state: NmtState) {
        let _ = state;
    }

    /// A write to an object whose row asks, before it is committed; `new` are its little-endian
    /// bytes. `None`: it means what it means to every drive. View and orders are those of the axis
    /// that [`OwnBehaviour::axis_of`] tells.
    fn write(
        &mut self,
        image: &Image<'_>,
        object: Address,
        new: &[u8],
        view: &AxisView,
        orders: &mut Orders,
    ) -> Option<Verdict> {
        let _ = (image, object, new, view, orders);
        None
    }

    /// Whether there is none: then nobody prepares what [`OwnBehaviour::tick`] and
    /// [`OwnBehaviour::publish`] would see.
    fn is_nothing(&self) -> bool {
        false
    }

    /// Once per millisecond and axis, before the axis's own tick.
    fn tick(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        let _ = (image, view, orders);
    }

    /// Live objects are about to be read: refreshes those that only this drive has. Called for each
    /// axis, after what every drive shows.
    fn publish(&self, image: &mut Image<'_>, view: &AxisView) {
        let _ = (image, view);
    }

    /// What the master wants of an axis, as the objects have it: corrects what has another unit or limit
    /// at present.
    fn targets(&self, axis: u8, image: &Image<'_>, targets: &mut Targets) {
        let _ = (axis, image, targets);
    }

    /// An axis's configuration, as the objects have it: adds what has another form here.
    fn configuration(&self, axis: u8, image: &Image<'_>, configuration: &mut Configuration) {
        let _ = (axis, image, configuration);
    }

    /// A velocity demand is followed by the position that it leads to.
    fn integrates_velocity(&self, axis: u8) -> bool {
        let _ = axis;
        false
    }

    /// What the parts of the board say that no loop asks, before each tick.
    fn look_at(&mut self, axis: u8, board: &Board) {
        let _ = (axis, board);
    }

    /// What the encoder's reading `raw`, counts of a turn, is taken for: corrects what is known to be
    /// wrong with it. Once per control period.
    #[inline]
    fn reading(&self, axis: u8, raw: i32) -> i32 {
        let _ = axis;
        raw
    }

    /// What the lights of its board do, if it has any.
    fn lights(&self) -> Option<Lights> {
        None
    }

    /// A demand that takes the place of the axis's, as long as there is one.
    fn demand(&self, axis: u8) -> Option<&Demand> {
        let _ = axis;
        None
    }

    /// The greatest current of that demand, A; `None`: as the axis's.
    fn current_limit_a(&self, axis: u8) -> Option<f32> {
        let _ = axis;
        None
    }

    /// A frame from the bus, whoever it is for; the node gets it, too.
    fn heard(&mut self, frame: &Frame, id: NodeId) {
        let _ = (frame, id);
    }

    /// What was to be stored is stored (`true`), or could not be: asked for by a master or by
    /// [`Orders::store`].
    fn store_done(&mut self, stored: bool) {
        let _ = stored;
    }

    /// The node shall start over.
    fn take_reset(&mut self) -> Option<Reset> {
        None
    }

    /// The own causes of errors that are there now ([`crate::Cause::Own`]), a bit each.
    fn causes(&self) -> u32 {
        0
    }

    /// Those of an axis, where they differ between them.
    fn axis_causes(&self, axis: u8) -> u32 {
        let _ = axis;
        self.causes()
    }
}

/// No own behaviour.
impl OwnBehaviour for () {
    fn new(_: &'static Personality, _: &Image<'_>) {}

    fn is_nothing(&self) -> bool {
        true
    }
}

/// Which own behaviour a personality has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OwnKind {
    /// None.
    Nothing,
    /// [`p3_jpl::Behaviour`].
    P3Jpl,
    /// [`md80::Behaviour`].
    Md80,
    /// A Roboteq controller's.
    Roboteq,
}

/// The own behaviour of any personality, chosen at run time.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "a virtual drive has one of them, and nothing here allocates"
)]
pub enum AnyOwn {
    /// None.
    Nothing(()),
    /// The P3 of 2016.
    P3Jpl(p3_jpl::Behaviour),
    /// The MD80.
    Md80(md80::Behaviour),
    /// A Roboteq controller's.
    Roboteq(roboteq::own::Roboteq),
}

impl AnyOwn {
    fn inner(&self) -> &dyn OwnBehaviour {
        match self {
            AnyOwn::Nothing(nothing) => nothing,
            AnyOwn::P3Jpl(jpl) => jpl,
            AnyOwn::Md80(md80) => md80,
            AnyOwn::Roboteq(own) => own,
        }
    }

    fn inner_mut(&mut self) -> &mut dyn OwnBehaviour {
        match self {
            AnyOwn::Nothing(nothing) => nothing,
            AnyOwn::P3Jpl(jpl) => jpl,
            AnyOwn::Md80(md80) => md80,
            AnyOwn::Roboteq(own) => own,
        }
    }
}

impl OwnBehaviour for AnyOwn {
    fn new(personality: &'static Personality, image: &Image<'_>) -> AnyOwn {
        match personality.own {
            OwnKind::Nothing => AnyOwn::Nothing(()),
            OwnKind::P3Jpl => AnyOwn::P3Jpl(p3_jpl::Behaviour::new(personality, image)),
            OwnKind::Md80 => AnyOwn::Md80(md80::Behaviour::new(personality, image)),
            OwnKind::Roboteq => AnyOwn::Roboteq(OwnBehaviour::new(personality, image)),
        }
    }

    fn waits(&self) -> bool {
        self.inner().waits()
    }

    fn hear(&mut self, frame: &Frame, id: NodeId, image: &mut Image<'_>, view: &AxisView) -> Heard {
        self.inner_mut().hear(frame, id, image, view)
    }

    fn take_frame(&mut self) -> Option<Frame> {
        self.inner_mut().take_frame()
    }

    fn entered(&mut self, state: NmtState) {
        self.inner_mut().entered(state);
    }

    fn axis_of(&self, object: Address) -> u8 {
        self.inner().axis_of(object)
    }

    fn write(
        &mut self,
        image: &Image<'_>,
        object: Address,
        new: &[u8],
        view: &AxisView,
        orders: &mut Orders,
    ) -> Option<Verdict> {
        self.inner_mut().write(image, object, new, view, orders)
    }

    #[inline]
    fn is_nothing(&self) -> bool {
        matches!(self, AnyOwn::Nothing(()))
    }

    fn tick(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        self.inner_mut().tick(image, view, orders);
    }

    fn publish(&self, image: &mut Image<'_>, view: &AxisView) {
        self.inner().publish(image, view);
    }

    fn targets(&self, axis: u8, image: &Image<'_>, targets: &mut Targets) {
        self.inner().targets(axis, image, targets);
    }

    fn configuration(&self, axis: u8, image: &Image<'_>, configuration: &mut Configuration) {
        self.inner().configuration(axis, image, configuration);
    }

    fn integrates_velocity(&self, axis: u8) -> bool {
        self.inner().integrates_velocity(axis)
    }

    fn axis_causes(&self, axis: u8) -> u32 {
        self.inner().axis_causes(axis)
    }

    fn look_at(&mut self, axis: u8, board: &Board) {
        self.inner_mut().look_at(axis, board);
    }

    // Once per control period: only the one that corrects anything is asked.
    #[inline]
    fn reading(&self, axis: u8, raw: i32) -> i32 {
        match self {
            AnyOwn::Md80(md80) => md80.reading(axis, raw),
            _ => raw,
        }
    }

    fn lights(&self) -> Option<Lights> {
        self.inner().lights()
    }

    fn demand(&self, axis: u8) -> Option<&Demand> {
        self.inner().demand(axis)
    }

    fn current_limit_a(&self, axis: u8) -> Option<f32> {
        self.inner().current_limit_a(axis)
    }

    fn heard(&mut self, frame: &Frame, id: NodeId) {
        self.inner_mut().heard(frame, id);
    }

    fn store_done(&mut self, stored: bool) {
        self.inner_mut().store_done(stored);
    }

    fn take_reset(&mut self) -> Option<Reset> {
        self.inner_mut().take_reset()
    }

    fn causes(&self) -> u32 {
        self.inner().causes()
    }
}
