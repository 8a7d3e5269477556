//! How late the encoder is (P3 l.286 to l.290, where the procedure is left open).
//!
//! The loops compute the rotor's angle from the encoder's reading, its lag and the speed. If they
//! believe in a lag that is wrong by δ, their frame stands behind the rotor by ε = ωδ, and the
//! back-EMF, which is on the q axis, shows a part on their d axis: u_d = −ωL·i_q − ωψ·sin ε. That
//! vanishes in proportion to ε, while the speed that a torque gives falls with ε² only, so the
//! voltages tell the lag far better than the greatest speed does. An electrical zero that is off
//! by ε₀ adds to ε in one direction of rotation and takes from it in the other; the mean of both
//! knows nothing of it.

use cia402::Mode;

use crate::Link;
use crate::fit::fit;
use crate::session::{
    ACTUAL_CURRENT, Cause, ELECTRICAL_POLARITY, ENCODER_LAG, Finding, MAX_MOTOR_VELOCITY, Motor,
    ProcedureError, RAW_ENCODER, Session, TARGET_TORQUE, USER_POLARITY, VELOCITY, VOLTAGE_D,
    VOLTAGE_Q, Watch,
};

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderLag {
    /// Lag, µs.
    pub lag_us: f64,
    /// Speed at which it was measured, counts/s.
    pub speed: f64,
    /// What is left of the angle error at that speed with the lag as it is written, electrical
    /// degrees.
    pub left_deg: f64,
    /// By how much the electrical zero is off, electrical degrees.
    pub zero_deg: f64,
    /// Share of the supply that the voltage used.
    pub voltage_share: f64,
}

/// Speeds of the measurement, in parts of the no-load speed. The first is slow enough for any lag
/// that may be, the second makes the most of what is left.
const SPEEDS: [f64; 3] = [0.15, 0.5, 0.5];
/// The voltage must stay below this share of the longest vector, or the bridge rules the d axis.
const MOST_VOLTAGE: f64 = 0.85;
/// Torque rises by so much, so often (per mille of rated).
const RISE_PM: i64 = 50;
const RISE_MS: u64 = 50;
const MOST_PM: i64 = 1_000;
/// Samples of a measurement, one each millisecond, after so long at speed.
const SAMPLES: usize = 400;
const SETTLE_MS: u64 = 200;
/// No encoder is later than that, µs.
const MOST_LAG_US: f64 = 1_000.0;
/// The lag must leave no more, electrical degrees.
const MOST_LEFT_DEG: f64 = 1.0;
/// An electrical zero further off must be calibrated first, electrical degrees.
const MOST_ZERO_DEG: f64 = 10.0;

/// One direction at one speed.
#[derive(Clone, Copy, Debug)]
struct Measured {
    /// Electrical angle by which the loops' frame stands behind the rotor in the direction of the
    /// turn, rad.
    behind_rad: f64,
    /// Electrical speed, rad/s, above 0.
    electrical_rad_s: f64,
    /// Counts/s, user direction.
    speed: f64,
    voltage_share: f64,
}

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Calibrates the encoder's lag, 0x3013,5. Current sensors and electrical zero must be
    /// calibrated; the shaft must be free and turns both ways at half of the no-load speed.
    ///
    /// # Errors
    /// [`ProcedureError`]; nothing has changed then, and the motor is without power.
    pub async fn calibrate_encoder_lag(&mut self) -> Result<EncoderLag, ProcedureError> {
        let done = self.encoder_lag().await;
        self.end(done).await
    }

    async fn encoder_lag(&mut self) -> Result<EncoderLag, Cause> {
        let motor = self.ready().await?;
        // As it is counted, the electrical angle may fall while the user's position rises.
        let sense = self.read(ELECTRICAL_POLARITY).await? * self.read(USER_POLARITY).await?;
        let old_limit = self.read(MAX_MOTOR_VELOCITY).await? as f64;
        let mut lag_us = 0.0;
        self.find(ENCODER_LAG, 0).await?;
        self.write(TARGET_TORQUE, 0).await?;
        self.start_recording(&[VOLTAGE_D, VOLTAGE_Q, RAW_ENCODER], &[])
            .await?;
        self.enable().await?;
        self.set_mode(Mode::PROFILE_TORQUE.0).await?;
        let mut last = None;
        for part in SPEEDS {
            let mut speed = part * motor.no_load_speed();
            if old_limit > 0.0 {
                speed = speed.min(0.9 * old_limit);
            }
            self.borrow(MAX_MOTOR_VELOCITY, speed as i64).await?;
            let forward = self.behind(&motor, sense, 1).await?;
            let backward = self.behind(&motor, sense, -1).await?;
            let behind = 0.5 * (forward.behind_rad + backward.behind_rad);
            let speed = 0.5 * (forward.electrical_rad_s + backward.electrical_rad_s);
            lag_us += behind / speed * 1e6;
            Finding {
                what: "the lag of the encoder",
                seen: lag_us,
                low: -MOST_LEFT_DEG.to_radians() / speed * 1e6,
                high: MOST_LAG_US,
                unit: "us",
                remedy: "calibrate the electrical zero and the phase order first, and check the \
                         motor's inductance (0x3011,6)",
            }
            .check()?;
            let written = lag_us.max(0.0).round();
            lag_us = written;
            self.write(TARGET_TORQUE, 0).await?;
            self.find(ENCODER_LAG, written as i64).await?;
            self.measured("lag", written, "us");
            last = Some((forward, backward));
        }
        let Some((forward, backward)) = last else {
            return Err(Cause::Stopped);
        };
        // The last round measured with the lag of the round before; what it changed is known.
        let half = 0.5 * (forward.behind_rad - backward.behind_rad);
        let speed = 0.5 * (forward.electrical_rad_s + backward.electrical_rad_s);
        let behind = 0.5 * (forward.behind_rad + backward.behind_rad);
        let found = EncoderLag {
            lag_us,
            speed: 0.5 * (forward.speed.abs() + backward.speed.abs()),
            left_deg: (behind - (behind / speed * 1e6).round() * 1e-6 * speed).to_degrees(),
            zero_deg: half.to_degrees(),
            voltage_share: forward.voltage_share.max(backward.voltage_share),
        };
        Finding {
            what: "the error of the electrical zero, by both directions",
            seen: found.zero_deg,
            low: -MOST_ZERO_DEG,
            high: MOST_ZERO_DEG,
            unit: "electrical degrees",
            remedy: "calibrate the electrical zero first",
        }
        .check()?;
        Finding {
            what: "the angle that the last round corrected",
            seen: behind.to_degrees(),
            low: -2.0 * MOST_LEFT_DEG,
            high: 2.0 * MOST_LEFT_DEG,
            unit: "electrical degrees",
            remedy: "the measurement does not settle; see that nothing drives the shaft",
        }
        .check()?;
        Ok(found)
    }

    /// Brings the shaft to the speed of 0x6080 in a direction and measures there.
    async fn behind(
        &mut self,
        motor: &Motor,
        sense: i64,
        direction: i64,
    ) -> Result<Measured, Cause> {
        self.step(match direction > 0 {
            true => "turning forward",
            false => "turning backward",
        });
        let limit = self.read(MAX_MOTOR_VELOCITY).await?;
        let wanted = 0.8 * limit as f64;
        let mut torque = 0;
        let reached = loop {
            torque += RISE_PM;
            self.write(TARGET_TORQUE, direction * torque).await?;
            self.wait(RISE_MS).await?;
            let speed = (self.read(VELOCITY).await? * direction) as f64;
            self.part(speed.max(0.0) as u32, limit as u32);
            if speed >= wanted || torque >= MOST_PM {
                break speed;
            }
        };
        Finding {
            what: "the speed at the greatest torque",
            seen: reached / motor.counts * 60.0,
            low: wanted / motor.counts * 60.0,
            high: f64::INFINITY,
            unit: "rpm",
            remedy: "the rotor is blocked or loaded, or the electrical zero is wrong; free the \
                     shaft and calibrate",
        }
        .check()?;
        self.wait(SETTLE_MS).await?;
        let speed = self.mean(VELOCITY, 16).await?;
        let samples = self.record(SAMPLES, 1, |_, _| Some(Vec::new())).await?;
        let current_a = self.mean(ACTUAL_CURRENT, 16).await? * 1e-3;
        let speed = 0.5 * (speed + self.mean(VELOCITY, 16).await?);

        let electrical =
            speed * sense as f64 * motor.pole_pairs / motor.counts * std::f64::consts::TAU;
        let turns = electrical.signum();
        let volt = motor.longest_v() / 32_768.0;
        let current_a = current_a * sense as f64;
        let inductive = electrical * motor.phase_inductance_h * current_a;
        let resistive = motor.phase_resistance_ohm * current_a;
        let mut longest: f64 = 0.0;
        let mut rows = Vec::with_capacity(samples.len());
        for sample in &samples {
            let (d, q) = (sample.values[0] * volt, sample.values[1] * volt);
            longest = longest.max(d.hypot(q) / motor.longest_v());
            let behind = (-(d + inductive)).atan2((q - resistive) * turns) * turns;
            let (s, c) = (sample.values[2] / motor.counts * std::f64::consts::TAU).sin_cos();
            // An eccentric encoder adds a wave of the shaft's turn, and a little of its double.
            rows.push((vec![1.0, s, c, s * c, c * c - s * s], behind * turns));
        }
        Finding {
            what: "the voltage at that speed",
            seen: longest * 100.0,
            low: 0.0,
            high: MOST_VOLTAGE * 100.0,
            unit: "% of the supply's",
            remedy: "raise the supply, lower 0x6080, or check the torque constant (0x3011,4)",
        }
        .check()?;
        let fitted = fit(&rows).ok_or(Cause::Samples {
            sent: rows.len(),
            came: rows.len(),
        })?;
        Ok(Measured {
            behind_rad: fitted.coefficients[0],
            electrical_rad_s: electrical.abs(),
            speed,
            voltage_share: longest,
        })
    }

    async fn mean(&mut self, object: crate::session::Object, readings: u32) -> Result<f64, Cause> {
        let mut sum = 0.0;
        for _ in 0..readings {
            sum += self.read(object).await? as f64;
            self.wait(2).await?;
        }
        Ok(sum / f64::from(readings))
    }
}
