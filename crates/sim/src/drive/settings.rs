//! What a virtual drive is made of.

use canopen::NodeId;
use personalities::Personality;
use plant::Parameters;

use crate::flash_file::FlashFile;
use crate::place::Place;
use crate::{commissioned, world};

/// What a virtual drive is.
#[derive(Debug)]
pub struct DriveSettings {
    /// Which drive of its bus; that says its node ID, unless LSS has stored another in it.
    pub place: Place,
    /// Which drive it is.
    pub personality: &'static Personality,
    /// Motor, load and board of its first axis.
    pub plant: Parameters,
    /// Those of its other axes, the second one first; one that is missing is as the first.
    pub others: Vec<Parameters>,
    /// Its non-volatile memory.
    pub store: FlashFile,
}

/// How much of the motor's friction a virtual drive's shaft has, unless its file says otherwise. The
/// friction of the motor's figures is a twentieth of its rated torque and no object of the drive
/// tells of it; with this share a master that computes with the drive's own torque constant and
/// inertia finds the acceleration that it computed, also for a tenth of rated torque, and a motor
/// without power coasts long enough to be seen. `plant::VIRTUAL_P3` and what `plant::Spread` draws
/// have all of it; see `docs/plant.md`.
const FRICTION_SHARE: f64 = 0.02;

impl DriveSettings {
    /// A drive with its usual motor, turning freely, and in memory what it has stored as it is delivered:
    /// for most nothing, for one that knows no motor by itself what a commissioning has left.
    pub fn new(node: NodeId, personality: &'static Personality) -> DriveSettings {
        DriveSettings::at(Place::of_node(node), personality)
    }

    /// The same at any place: a drive at [`Place::unconfigured`] has no node ID until LSS gives it
    /// one. Without LSS it stays mute.
    pub fn at(place: Place, personality: &'static Personality) -> DriveSettings {
        let mut plant = world::of(personality);
        let stored = commissioned::stored(personality);
        plant.motor.coulomb_friction_nm *= FRICTION_SHARE;
        plant.motor.static_friction_nm *= FRICTION_SHARE;
        plant.motor.viscous_friction_nms *= FRICTION_SHARE;
        DriveSettings {
            place,
            personality,
            plant,
            others: Vec::new(),
            store: FlashFile::memory(stored),
        }
    }

    /// As out of the box: with nothing stored.
    pub fn factory(mut self) -> DriveSettings {
        self.store = FlashFile::memory(Vec::new());
        self
    }

    /// Motor, load and board of each axis, the first one first. Those that are as the first have noise
    /// of their own.
    pub fn plants(&self) -> Vec<Parameters> {
        let others = self.others.iter().copied();
        let like_first = (1_u32..).map(|axis| Parameters {
            noise_seed: self.plant.noise_seed ^ axis.wrapping_mul(0x9E37_79B9),
            ..self.plant
        });
        core::iter::once(self.plant)
            .chain(others)
            .chain(like_first.skip(self.others.len()))
            .take(self.personality.axes.len().max(1))
            .collect()
    }
}
