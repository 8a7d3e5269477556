//! Where the drive core finds its values in a dictionary, and in which units they stand there.

mod amplifier;
mod axis;
mod gains;
mod homing;
mod inputs;
mod limits;
mod motor;

pub use amplifier::{AmplifierObjects, BridgeTimeObjects};
pub use axis::{AxisObjects, FeedbackObjects, TargetObjects};
pub use gains::{DirectGainObjects, GainObjects, LoopObjects, MotionLoop, PidObjects};
pub use homing::{HomingObjects, HomingSearchObjects};
pub use inputs::{AnalogObjects, InputFunction, InputObjects, ProbeEdgeObjects, ProbeObjects};
pub use limits::{ConfigurationObjects, TargetWindow, VlObjects, WindowObjects};
pub use motor::MotorObjects;

use canopen::Field;

/// An object and its unit: internal value = object × `scale`.
///
/// Internal units: counts, counts/s, counts/s², per mille of rated torque, and SI units for
/// everything electrical and mechanical.
#[derive(Clone, Copy, Debug)]
pub struct Scaled {
    /// The object.
    pub field: Field,
    /// Internal units per unit of the object.
    pub scale: f32,
    /// Units of the object per internal unit, so that no division is needed to publish.
    pub per_unit: f32,
}

impl Scaled {
    /// An object whose unit is `scale` internal units.
    pub const fn new(field: Field, scale: f32) -> Scaled {
        Scaled {
            field,
            scale,
            per_unit: 1.0 / scale,
        }
    }

    /// An object in internal units.
    pub const fn plain(field: Field) -> Scaled {
        Scaled::new(field, 1.0)
    }
}

/// A figure that the drive needs, and that not every drive has an object for.
#[derive(Clone, Copy, Debug)]
pub enum Figure {
    /// The object that holds it.
    Object(Scaled),
    /// There is none: it is always this, in internal units.
    Fixed(f32),
}

impl Figure {
    /// An object in internal units.
    pub const fn plain(field: Field) -> Figure {
        Figure::Object(Scaled::plain(field))
    }
}

impl From<Scaled> for Figure {
    fn from(object: Scaled) -> Figure {
        Figure::Object(object)
    }
}
