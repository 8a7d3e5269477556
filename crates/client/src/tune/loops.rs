//! The velocity and the position loop, tuned to what is asked for.

use std::f64::consts::TAU;

use cia402::Mode;

use super::shaft::Shaft;
use super::steps::{COUNT, Steps};
use crate::Link;
use crate::fit::{Order2, Shape, fit_step};
use crate::session::{
    ACTUAL_TORQUE, Cause, Finding, Object, POSITION, POSITION_BANDWIDTH, POSITION_DAMPING,
    POSITION_INTEGRAL, ProcedureError, Session, TARGET_POSITION, TARGET_VELOCITY, TORQUE_OFFSET,
    VELOCITY_BANDWIDTH, VELOCITY_DAMPING, VELOCITY_OFFSET, Watch,
};

/// What a loop shall become.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// Natural frequency, Hz.
    pub bandwidth_hz: f64,
    /// Damping ratio.
    pub damping: f64,
}

/// What a loop has become.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuned {
    /// Fitted natural frequency, Hz.
    pub natural_hz: f64,
    /// Fitted damping ratio; `None` for a loop of first order, which has none.
    pub damping: Option<f64>,
    /// What the fit leaves of the response, in parts of its size.
    pub misfit: f64,
    /// What hangs on the shaft.
    pub shaft: Shaft,
    /// How often the response was measured.
    pub rounds: u32,
}

/// Natural frequencies that can be asked for, Hz: below, the steps last too long; above, a
/// millisecond between two samples is too long.
const LEAST_HZ: f64 = 2.0;
const MOST_HZ: f64 = 150.0;
const LEAST_DAMPING: f64 = 0.4;
const MOST_DAMPING: f64 = 2.0;
/// Rounds that may be made.
const ROUNDS: u32 = 8;
/// The loop is as asked if it is that near.
const NEAR: f64 = 0.03;
const NEAR_DAMPING: f64 = 0.08;
/// What was reached in the last round must be that near.
const REACHED: f64 = 0.06;
/// A response of so many counts stands out of the encoder's steps.
const CLEAR_COUNTS: f64 = 120.0;
/// Torque of a step, per mille of rated.
const MOST_STEP_PM: f64 = 800.0;
/// A fit may leave this part of the response.
const MISFIT: f64 = 0.15;

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Tunes the velocity loop: 0x3019,10 and 0x3019,11, until the closed loop has the natural
    /// frequency and damping that are asked for. The shaft turns some turns, load and all.
    ///
    /// # Errors
    /// [`ProcedureError`]; nothing has changed then, and the motor is without power.
    pub async fn tune_velocity(&mut self, asked: Asked) -> Result<Tuned, ProcedureError> {
        let done = self.velocity_loop(asked).await;
        self.end(done).await
    }

    /// Tunes the position loop: 0x3019,5 and 0x3019,6. Tune the velocity loop first; it must be
    /// more than three times as fast.
    ///
    /// # Errors
    /// [`ProcedureError`]; nothing has changed then, and the motor is without power.
    pub async fn tune_position(&mut self, asked: Asked) -> Result<Tuned, ProcedureError> {
        let done = self.position_loop(asked).await;
        self.end(done).await
    }

    async fn velocity_loop(&mut self, asked: Asked) -> Result<Tuned, Cause> {
        check(asked)?;
        let motor = self.ready().await?;
        let shaft = self.identify(&motor, 0.0).await?;
        self.tell_shaft(&shaft);
        // The drive's rule knows the rotor's inertia only: 2ζω and ω² must grow with the inertia.
        let root = shaft.inertia_ratio.sqrt();
        let mut set = Asked {
            bandwidth_hz: asked.bandwidth_hz * root,
            damping: asked.damping * root,
        };
        self.start_recording(
            &[POSITION, ACTUAL_TORQUE],
            &[TARGET_VELOCITY, TORQUE_OFFSET],
        )
        .await?;
        let omega = TAU * asked.bandwidth_hz;
        let hold_ms = hold_ms(asked);
        let speed_per_ms = Steps::speed_per_ms(&motor, hold_ms);
        // A step of torque T moves the shaft by T/Jω², at most with T/Jωe; the direction stays.
        let by_speed = 0.5 * 1e3 * speed_per_ms as f64 * std::f64::consts::E / omega;
        let wanted = CLEAR_COUNTS.min(by_speed) * omega * omega;
        let size = (2.0 * wanted / shaft.acceleration_per_permille).clamp(10.0, MOST_STEP_PM);
        let steps = Steps {
            speed_per_ms,
            size: size as i64,
            hold_ms,
            count: count(0.5 * size * shaft.acceleration_per_permille / omega.powi(2)),
            position: false,
        };
        let mut rounds = 0;
        loop {
            rounds += 1;
            self.part(rounds - 1, ROUNDS);
            self.set(VELOCITY_BANDWIDTH, VELOCITY_DAMPING, set).await?;
            self.step("measuring the velocity loop");
            let response = self
                .measure(Mode::CYCLIC_VELOCITY, TORQUE_OFFSET, &steps)
                .await?;
            let found = fitted(&response, Shape::Step, omega)?;
            let natural_hz = found.omega / TAU;
            self.measured("natural frequency", natural_hz, "Hz");
            self.measured("damping", found.damping, "");
            let misfit = found.rms / found.size.abs();
            let (off, off_damping) = (
                natural_hz / asked.bandwidth_hz - 1.0,
                found.damping / asked.damping - 1.0,
            );
            let near = off.abs() < NEAR && off_damping.abs() < NEAR_DAMPING;
            if near || rounds == ROUNDS {
                judge(natural_hz, asked, misfit)?;
                return Ok(Tuned {
                    natural_hz,
                    damping: Some(found.damping),
                    misfit,
                    shaft,
                    rounds,
                });
            }
            set = corrected(set, off, off_damping);
        }
    }

    async fn position_loop(&mut self, asked: Asked) -> Result<Tuned, Cause> {
        check(asked)?;
        let motor = self.ready().await?;
        let shaft = self.identify(&motor, 0.0).await?;
        self.tell_shaft(&shaft);
        let root = shaft.inertia_ratio.sqrt();
        let velocity_hz = self.read(VELOCITY_BANDWIDTH).await? as f64 * 0.1 / root;
        Finding {
            what: "the velocity loop's bandwidth with this load",
            seen: velocity_hz,
            low: 3.3 * asked.bandwidth_hz,
            high: f64::INFINITY,
            unit: "Hz",
            remedy: "tune the velocity loop first, or ask for less",
        }
        .check()?;
        self.start_recording(
            &[POSITION, ACTUAL_TORQUE],
            &[TARGET_POSITION, VELOCITY_OFFSET],
        )
        .await?;
        let omega = TAU * asked.bandwidth_hz;
        let hold_ms = hold_ms(asked);
        let speed_per_ms = Steps::speed_per_ms(&motor, hold_ms);
        // A step of velocity moves the shaft by its size over ω.
        let size = (2.0 * CLEAR_COUNTS * omega).min(1e3 * speed_per_ms as f64);
        let steps = Steps {
            speed_per_ms,
            size: size as i64,
            hold_ms,
            count: count(0.5 * size / omega),
            position: true,
        };
        let mut set = asked;
        let mut rounds = 0;
        loop {
            rounds += 1;
            self.part(rounds - 1, ROUNDS);
            self.set(POSITION_BANDWIDTH, POSITION_DAMPING, set).await?;
            // Proportional only, the loop is of first order; with an integral it is of second.
            let has_integral = self
                .read_if_there(POSITION_INTEGRAL)
                .await?
                .is_some_and(|gain| gain != 0);
            let shape = match has_integral {
                true => Shape::Pulse,
                false => Shape::Lag,
            };
            self.step("measuring the position loop");
            let mut response = self
                .measure(Mode::CYCLIC_POSITION, VELOCITY_OFFSET, &steps)
                .await?;
            if shape == Shape::Lag {
                // The velocity loop's share is over by then, what is left goes by e^(-ωt).
                response.retain(|(t, _)| *t >= 4.0 / (TAU * velocity_hz));
            }
            let found = fitted(&response, shape, omega)?;
            let natural_hz = found.omega / TAU;
            self.measured("natural frequency", natural_hz, "Hz");
            let misfit = found.rms / found.size.abs();
            let off = natural_hz / asked.bandwidth_hz - 1.0;
            let off_damping = match has_integral {
                true => found.damping / asked.damping - 1.0,
                false => 0.0,
            };
            let near = off.abs() < NEAR && off_damping.abs() < NEAR_DAMPING;
            if near || rounds == ROUNDS {
                judge(natural_hz, asked, misfit)?;
                return Ok(Tuned {
                    natural_hz,
                    damping: has_integral.then_some(found.damping),
                    misfit,
                    shaft,
                    rounds,
                });
            }
            set = corrected(set, off, off_damping);
        }
    }

    fn tell_shaft(&mut self, shaft: &Shaft) {
        self.measured("inertia", shaft.inertia_ratio, "times the rotor's");
        self.measured("friction", shaft.friction_pm, "per mille of rated torque");
        self.measured("load", shaft.load_pm, "per mille of rated torque");
    }

    async fn set(&mut self, bandwidth: Object, damping: Object, to: Asked) -> Result<(), Cause> {
        let tenths = (to.bandwidth_hz * 10.0).round().clamp(1.0, 65_535.0);
        let parts = (to.damping * 256.0).round().clamp(1.0, 65_535.0);
        self.find(bandwidth, tenths as i64).await?;
        self.find(damping, parts as i64).await
    }

    /// Gives power, makes the steps, and takes it away again.
    async fn measure(
        &mut self,
        mode: Mode,
        stepped: Object,
        steps: &Steps,
    ) -> Result<Vec<(f64, f64)>, Cause> {
        self.borrow(stepped, 0).await?;
        self.enable().await?;
        let origin = self.read(POSITION).await?;
        match steps.position {
            true => self.borrow(TARGET_POSITION, origin).await?,
            false => self.borrow(TARGET_VELOCITY, 0).await?,
        }
        self.set_mode(mode.0).await?;
        let response = self.step_response(steps, origin).await?;
        self.power_off().await?;
        Ok(response)
    }
}

/// Steps of a mean for a response of so many counts: more where it is not far from the noise.
fn count(counts: f64) -> usize {
    match counts {
        counts if counts > 50.0 => COUNT,
        counts if counts > 15.0 => 3 * COUNT,
        _ => 6 * COUNT,
    }
}

/// Long enough for a response to end.
fn hold_ms(asked: Asked) -> usize {
    let rate = TAU * asked.bandwidth_hz * asked.damping.min(1.0);
    ((9.0 / rate * 1e3) as usize).max(40)
}

fn check(asked: Asked) -> Result<(), Cause> {
    let bandwidth = Finding {
        what: "the bandwidth that is asked for",
        seen: asked.bandwidth_hz,
        low: LEAST_HZ,
        high: MOST_HZ,
        unit: "Hz",
        remedy: "ask for one of these",
    };
    let damping = Finding {
        what: "the damping that is asked for",
        seen: asked.damping,
        low: LEAST_DAMPING,
        high: MOST_DAMPING,
        unit: "",
        remedy: "ask for one of these",
    };
    for finding in [bandwidth, damping] {
        finding.check().map_err(Cause::NotReady)?;
    }
    Ok(())
}

fn fitted(response: &[(f64, f64)], shape: Shape, omega: f64) -> Result<Order2, Cause> {
    fit_step(response, shape, omega, 1.5e-3).ok_or(Cause::Samples {
        sent: response.len(),
        came: response.len(),
    })
}

fn judge(natural_hz: f64, asked: Asked, misfit: f64) -> Result<(), Cause> {
    Finding {
        what: "what the fitted model leaves of the response",
        seen: misfit * 100.0,
        low: 0.0,
        high: MISFIT * 100.0,
        unit: "%",
        remedy: "the load is elastic or has play, or the loop is not stable; ask for a lower \
                 bandwidth",
    }
    .check()?;
    Finding {
        what: "the natural frequency that could be reached",
        seen: natural_hz,
        low: asked.bandwidth_hz * (1.0 - REACHED),
        high: asked.bandwidth_hz * (1.0 + REACHED),
        unit: "Hz",
        remedy: "ask for a lower bandwidth or damping",
    }
    .check()?;
    Ok(())
}

/// The next try, not further away than half or twice.
fn corrected(set: Asked, off: f64, off_damping: f64) -> Asked {
    let factor = |off: f64| (1.0 + off).recip().clamp(0.6, 1.6);
    Asked {
        bandwidth_hz: set.bandwidth_hz * factor(off),
        damping: set.damping * factor(0.7 * off_damping),
    }
}
