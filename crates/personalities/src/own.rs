//! What one documented drive does that no other does, and no table tells.

use can::Frame;
use canopen::{Address, Image, NodeId, Reset, Verdict, store};
use cia402::{Demand, Mode, State};

use crate::Personality;

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

    /// Once per millisecond and axis, before the axis's own tick.
    fn tick(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        let _ = (image, view, orders);
    }

    /// Live objects are about to be read: refreshes those that only this drive has. Called for each
    /// axis, after what every drive shows.
    fn publish(&self, image: &mut Image<'_>, view: &AxisView) {
        let _ = (image, view);
    }

    /// A demand that takes the place of the axis's, as long as there is one.
    fn demand(&self, axis: u8) -> Option<&Demand> {
        let _ = axis;
        None
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
}

/// No own behaviour.
impl OwnBehaviour for () {
    fn new(_: &'static Personality, _: &Image<'_>) {}
}

/// Which own behaviour a personality has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OwnKind {
    /// None.
    Nothing,
}

/// The own behaviour of any personality, chosen at run time.
#[derive(Clone, Debug)]
pub enum AnyOwn {
    /// None.
    Nothing(()),
}

impl AnyOwn {
    fn inner(&self) -> &dyn OwnBehaviour {
        match self {
            AnyOwn::Nothing(nothing) => nothing,
        }
    }

    fn inner_mut(&mut self) -> &mut dyn OwnBehaviour {
        match self {
            AnyOwn::Nothing(nothing) => nothing,
        }
    }
}

impl OwnBehaviour for AnyOwn {
    fn new(personality: &'static Personality, _: &Image<'_>) -> AnyOwn {
        match personality.own {
            OwnKind::Nothing => AnyOwn::Nothing(()),
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

    fn tick(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        self.inner_mut().tick(image, view, orders);
    }

    fn publish(&self, image: &mut Image<'_>, view: &AxisView) {
        self.inner().publish(image, view);
    }

    fn demand(&self, axis: u8) -> Option<&Demand> {
        self.inner().demand(axis)
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
