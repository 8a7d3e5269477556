//! What hangs on the shaft: inertia, friction, load, from steps of torque.

use crate::Link;
use crate::fit::fit;
use crate::session::{
    ACTUAL_TORQUE, Cause, Finding, MAX_MOTOR_VELOCITY, Motor, POSITION, Run, Sample, Session, Watch,
};

/// The mechanics as the drive's loops see them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaft {
    /// Acceleration of one per mille of rated torque, counts/s².
    pub acceleration_per_permille: f64,
    /// Dry friction, per mille of rated torque.
    pub friction_pm: f64,
    /// Torque that opposes positive motion and helps negative, per mille of rated torque.
    pub load_pm: f64,
    /// Inertia over that of the rotor by the data sheet.
    pub inertia_ratio: f64,
}

/// Part of the no-load speed at which the torque turns round.
const SPEED_PART: f64 = 0.15;
/// The rotor by itself would come to that speed in about this time.
const RISE_S: f64 = 0.03;
/// Torque, per mille of rated.
const LEAST_PM: f64 = 120.0;
const MOST_PM: f64 = 700.0;
/// From here on the distance of two samples is a gap, s.
const GAP_S: f64 = 0.001_5;

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Drives the shaft to and fro by torque and computes from its way what hangs on it. Ends
    /// without power.
    ///
    /// # Errors
    /// The shaft does not move, or not in the direction of the torque.
    pub(crate) async fn identify(
        &mut self,
        motor: &Motor,
        friction_nm: f64,
    ) -> Result<Shaft, Cause> {
        self.step("driving the shaft to and fro to see what hangs on it");
        let turn_round = SPEED_PART * motor.no_load_speed();
        let friction_pm = friction_nm / motor.rated_torque_nm * 1e3;
        let by_inertia = turn_round / RISE_S / motor.acceleration_per_permille();
        let torque = by_inertia.max(LEAST_PM).max(2.5 * friction_pm).min(MOST_PM);
        let old_limit = self.read(MAX_MOTOR_VELOCITY).await?;
        let limit = (3.0 * turn_round) as i64;
        if old_limit == 0 || old_limit > limit {
            self.borrow(MAX_MOTOR_VELOCITY, limit).await?;
        }
        let mut run = Run {
            torque_pm: torque as i64,
            turn_round,
            cycles: 1,
            position: 0,
            wraps: None,
            sense: 1.0,
        };
        let seen = [POSITION, ACTUAL_TORQUE];
        let shaft = loop {
            let found = match self.drive_to_and_fro(motor, &seen, &run).await {
                Ok(driven) => {
                    let samples: Vec<Sample> =
                        driven.into_iter().map(|driven| driven.sample).collect();
                    mechanics(&samples, motor, run.torque_pm as f64)
                }
                Err(cause) => Err(cause),
            };
            match found {
                // Cogging and dry friction may hold the rotor, or let it go by fits and starts.
                Err(Cause::Implausible(_)) if run.torque_pm < MOST_PM as i64 => {
                    run.torque_pm = (2 * run.torque_pm).min(MOST_PM as i64);
                }
                found => break found?,
            }
        };
        self.give_back_one(MAX_MOTOR_VELOCITY).await?;
        Ok(shaft)
    }
}

/// Fits the way of the shaft to the torque that drove it, both integrated twice: no difference is
/// taken of anything that was measured. `torque_pm` is what was asked for, either way.
fn mechanics(samples: &[Sample], motor: &Motor, torque_pm: f64) -> Result<Shaft, Cause> {
    let (mut once, mut twice) = ([0.0; 3], [0.0; 3]);
    let mut rows = Vec::with_capacity(samples.len());
    let origin = samples.first().map_or(0.0, |s| s.values[0]);
    for (place, sample) in samples.iter().enumerate() {
        let speed = speed_at(samples, place);
        let direction = if speed == 0.0 { 0.0 } else { speed.signum() };
        let now = [sample.values[1], direction, 1.0];
        if place > 0 {
            let before = &samples[place - 1];
            let dt = sample.time_s - before.time_s;
            let was = [before.values[1], speed_at(samples, place - 1).signum(), 1.0];
            // A change of torque acts from a SYNC on: over a gap the torque at its end has acted.
            let weight = if dt < GAP_S { 0.5 } else { 1.0 };
            for n in 0..3 {
                let mean = weight * now[n] + (1.0 - weight) * was[n];
                twice[n] += once[n] * dt + 0.5 * mean * dt * dt;
                once[n] += mean * dt;
            }
        }
        rows.push((
            vec![1.0, sample.time_s + 1e-3, twice[0], twice[1], twice[2]],
            sample.values[0] - origin,
        ));
    }
    // The first row has no time behind it: all of its integrals are 0, which is as it should be.
    let found = fit(&rows).ok_or(Cause::Samples {
        sent: rows.len(),
        came: rows.len(),
    })?;
    let per_permille = found.coefficients[2];
    let ratio = motor.acceleration_per_permille() / per_permille;
    Finding {
        what: "the inertia at the shaft",
        seen: ratio,
        low: 0.01,
        high: 1e4,
        unit: "times the rotor's (0x3011,7)",
        remedy: "the shaft does not follow the torque; calibrate the electrical zero first",
    }
    .check()?;
    let friction_pm = -found.coefficients[3] / per_permille;
    // A rotor that stood for a while has moved by something else than these three.
    Finding {
        what: "the friction at the shaft",
        seen: friction_pm,
        low: -0.1 * torque_pm,
        high: torque_pm,
        unit: "per mille of rated torque",
        remedy: "the shaft moves by fits and starts; free it, or calibrate the electrical zero first",
    }
    .check()?;
    Ok(Shaft {
        acceleration_per_permille: per_permille,
        friction_pm,
        load_pm: -found.coefficients[4] / per_permille,
        inertia_ratio: ratio,
    })
}

/// Speed about a sample, counts/s.
fn speed_at(samples: &[Sample], place: usize) -> f64 {
    let from = place.saturating_sub(2);
    let to = (place + 2).min(samples.len() - 1);
    let dt = samples[to].time_s - samples[from].time_s;
    if dt > 0.0 {
        (samples[to].values[0] - samples[from].values[0]) / dt
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTOR: Motor = Motor {
        pole_pairs: 1.0,
        counts: 4096.0,
        phase_resistance_ohm: 6.55,
        phase_inductance_h: 0.000_364_5,
        torque_constant_nm_per_a: 0.032,
        rotor_inertia_kgm2: 4.45e-7,
        continuous_a: 0.716,
        rated_torque_nm: 0.023,
        supply_v: 48.0,
    };

    #[test]
    fn the_figures_of_a_shaft_come_out_of_its_way() {
        for (ratio, friction, load) in [(1.0, 40.0, 0.0), (3.0, 10.0, 30.0), (0.9, 0.0, -20.0)] {
            let per_permille = MOTOR.acceleration_per_permille() / ratio;
            let (mut x, mut v) = (517.0, 0.0f64);
            let mut samples = Vec::new();
            let (mut torque, mut leg) = (150.0, 0);
            for n in 0..20_000 {
                if n % 10 == 0 {
                    samples.push(Sample {
                        number: samples.len(),
                        time_s: f64::from(n) * 1e-4,
                        values: vec![f64::floor(x), torque],
                    });
                }
                let turn_round = 130_000.0;
                if leg == 0 && v > turn_round {
                    (torque, leg) = (-150.0, 1);
                } else if leg == 1 && v < -turn_round {
                    (torque, leg) = (150.0, 2);
                } else if leg == 2 && v >= 0.0 {
                    break;
                }
                let rubs = if v == 0.0 { 0.0 } else { v.signum() * friction };
                v += (torque - rubs - load) * per_permille * 1e-4;
                x += v * 1e-4;
            }
            let shaft = mechanics(&samples, &MOTOR, 150.0).unwrap();
            assert!(
                (shaft.inertia_ratio / ratio - 1.0).abs() < 0.02,
                "{shaft:?}"
            );
            assert!((shaft.friction_pm - friction).abs() < 4.0, "{shaft:?}");
            assert!((shaft.load_pm - load).abs() < 4.0, "{shaft:?}");
        }
    }
}
