//! What a drive's document offers a master that brings it and a motor together.

use canopen::Address;

/// What there is for that beside the objects of motor and controllers. The default is a drive whose
/// motor the master calibrates and tunes step by step.
#[derive(Clone, Copy, Debug)]
pub struct Commissioning {
    /// Calibrations that the drive does by itself.
    pub calibrations: &'static [OwnCalibration],
    /// For a drive that a master does not calibrate step by step: what there is instead.
    pub calibrating: Option<&'static str>,
    /// For a drive whose controllers a master does not tune step by step: what there is instead.
    pub tuning: Option<&'static str>,
}

impl Commissioning {
    /// By the master, step by step.
    pub const BY_MASTER: Commissioning = Commissioning {
        calibrations: &[],
        calibrating: None,
        tuning: None,
    };
}

/// A calibration that the drive does by itself once a master has told it to.
#[derive(Clone, Copy, Debug)]
pub struct OwnCalibration {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it finds.
    pub what: &'static str,
    /// The object that begins it when 1 is written: a BOOLEAN.
    pub command: Address,
    /// The mode of operation that it wants.
    pub mode: i8,
    /// A command without effect that is refused while it is at work.
    pub probe: Address,
    /// What is set up before it.
    pub set_up: &'static [SetUp],
    /// Objects that hold what it finds.
    pub results: &'static [Address],
    /// Status words that tell how it ended.
    pub status: &'static [Address],
    /// The bit of one of them that says it has failed.
    pub failed: Option<(Address, u8)>,
    /// At its end the drive stores what it has found, and starts over.
    pub restarts: bool,
    /// It takes no longer, s.
    pub longest_s: u16,
}

/// A parameter that a calibration builds on.
#[derive(Clone, Copy, Debug)]
pub struct SetUp {
    /// Its name on the command line.
    pub name: &'static str,
    /// Where it is.
    pub object: Address,
    /// It must not be 0.
    pub needed: bool,
}
