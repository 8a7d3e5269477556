//! Whether the shaft is free, as the calibration needs it (P3 l.284).

use crate::Link;
use crate::session::{Cause, Finding, Motor, Session, Watch};

/// Inertia over the rotor's by the data sheet. Motors of one kind differ by less; a coupled load is
/// rarely smaller than the rotor.
const LEAST_RATIO: f64 = 0.55;
const GREATEST_RATIO: f64 = 1.6;
/// Torque from outside, per mille of rated.
const LOAD_PM: f64 = 80.0;
/// Friction, per mille of rated.
const FRICTION_PM: f64 = 250.0;

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Drives the shaft by torque, with the electrical zero that has just been found, and checks
    /// that it moves as a rotor does that carries nothing. Gives its inertia over the rotor's.
    ///
    /// # Errors
    /// Something hangs on the shaft, or the torque does not act as it should.
    pub(super) async fn free_shaft(
        &mut self,
        motor: &Motor,
        friction_nm: f64,
    ) -> Result<f64, Cause> {
        let shaft = self.identify(motor, friction_nm).await?;
        self.measured("inertia", shaft.inertia_ratio, "times the rotor's");
        self.measured("friction", shaft.friction_pm, "per mille of rated torque");
        Finding {
            what: "the inertia at the shaft",
            seen: shaft.inertia_ratio,
            low: LEAST_RATIO,
            high: GREATEST_RATIO,
            unit: "times the rotor's (0x3011,7)",
            remedy: "a load is coupled to the shaft: free it; or correct inertia and torque \
                     constant",
        }
        .check()?;
        Finding {
            what: "the torque from outside on the shaft",
            seen: shaft.load_pm,
            low: -LOAD_PM,
            high: LOAD_PM,
            unit: "per mille of rated torque",
            remedy: "the shaft carries a load; free it",
        }
        .check()?;
        Finding {
            what: "the friction at the shaft",
            seen: shaft.friction_pm,
            low: -50.0,
            high: FRICTION_PM,
            unit: "per mille of rated torque",
            remedy: "a load is coupled to the shaft; free it",
        }
        .check()?;
        Ok(shaft.inertia_ratio)
    }
}
