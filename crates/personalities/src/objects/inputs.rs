//! Digital and analog inputs, touch probes.

use canopen::{Field, Handle};

/// Digital inputs.
#[derive(Clone, Copy, Debug)]
pub struct InputObjects {
    /// 0x60FD: the inputs that are active.
    pub active: Handle<u32>,
    /// The inputs that are active when their level is low, a bit each.
    pub inverted: Field,
    /// How long switches, and general inputs, must keep a new level, µs.
    pub filter_us: [Field; 2],
    /// What each general input does, an [`InputFunction`].
    pub functions: [Field; 4],
    /// 0x60FE,1 and 2: the outputs, and which of them are driven.
    pub outputs: (Field, Field),
    /// A target by voltage.
    pub analog: AnalogObjects,
    /// Whether safe torque off is active, 0 or 1.
    pub torque_off: Handle<u8>,
    /// Touch probes.
    pub probes: ProbeObjects,
}

/// What a general input does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputFunction {
    /// Nothing but to be seen in 0x60FD.
    None,
    /// While active, bit 2 of the controlword is 0: quick stop.
    QuickStop,
    /// While not active, bit 3 of the controlword is 0: operation cannot be enabled.
    Enable,
    /// While active, bit 4 of the controlword is 1: the edge hands over a set-point.
    Start,
    /// While active, bit 8 of the controlword is 1: halt.
    Halt,
}

impl InputFunction {
    /// By its number, 0 to 4 in the order above; others are none.
    pub const fn of(number: u32) -> InputFunction {
        match number {
            1 => InputFunction::QuickStop,
            2 => InputFunction::Enable,
            3 => InputFunction::Start,
            4 => InputFunction::Halt,
            _ => InputFunction::None,
        }
    }
}

/// A target torque or velocity from analog input 1.
#[derive(Clone, Copy, Debug)]
pub struct AnalogObjects {
    /// 0: none, 1: the target torque of mode 4, 2: the target velocity of mode 3.
    pub target: Field,
    /// The reading at a target of 0, converter counts.
    pub offset: Field,
    /// The target at 2048 converter counts beyond offset and dead band, in the target's unit.
    pub scale: Field,
    /// The target is 0 up to this distance from the offset, converter counts.
    pub dead_band: Field,
    /// Both readings, converter counts.
    pub readings: [Handle<u16>; 2],
}

/// Touch probes 1 and 2.
#[derive(Clone, Copy, Debug)]
pub struct ProbeObjects {
    /// 0x60B8.
    pub function: Field,
    /// 0x60B9.
    pub status: Handle<u16>,
    /// Positive and negative edge of probe 1, then those of probe 2.
    pub edges: [ProbeEdgeObjects; 4],
}

/// What one edge of a touch probe shows.
#[derive(Clone, Copy, Debug)]
pub struct ProbeEdgeObjects {
    /// 0x60BA to 0x60BD, counts.
    pub position: Handle<i32>,
    /// 0x60D5 to 0x60D8.
    pub count: Handle<u16>,
}
