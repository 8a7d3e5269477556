//! How late the encoder is (P3 l.286 to l.290, where the procedure is left open).
//!
//! The loops compute the rotor's angle from the encoder's reading, its lag and the speed. If they
//! believe in a lag that is wrong by δ, their frame stands behind the rotor by ε = ωδ, and the
//! back-EMF, which is on the q axis, shows a part on their d axis: u_d = −ωL·i_q − ωψ·sin ε. That
//! vanishes in proportion to ε, while the speed that a torque gives falls with ε² only, so the
//! voltages tell the lag far better than the greatest speed does. An electrical zero that is off
//! by ε₀ adds to ε in one direction of rotation and takes from it in the other.
//!
//! The shaft is driven to and fro by torque, so that there is each speed with current of either
//! sign. What follows the current's sign falls out then: an inductance that is not as the data
//! sheet says, and the dead time of the bridge.
//!
//! The drive holds a voltage for a control period while the rotor turns on, and computes with the
//! current at the period's begin, which is not its mean. [`Winding::behind`] takes the winding's
//! exact answer to held voltages, so that this does not pass for a lag.

use crate::Link;
use crate::fit::{Complex, fit};
use crate::session::{
    Cause, Driven, ELECTRICAL_POLARITY, ENCODER_LAG, Finding, MAX_MOTOR_VELOCITY, Motor,
    PWM_FREQUENCY, ProcedureError, RAW_ENCODER, Run, Session, USER_POLARITY, VOLTAGE_D, VOLTAGE_Q,
    Watch, unwrapped,
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
/// that may be, the second makes the most of what is left, the third confirms it.
const SPEEDS: [f64; 3] = [0.3, 0.45, 0.45];
/// The speed stays below this part of the drive's limit (0x6080), before which torque fades.
const MOST_OF_LIMIT: f64 = 0.7;
/// The voltage must stay below this share of the longest vector, or the bridge rules the d axis.
const MOST_VOLTAGE: f64 = 0.85;
/// The rotor by itself would go from one speed to the opposite one in this time.
const LEG_S: f64 = 0.12;
/// Torque, per mille of rated.
const LEAST_PM: f64 = 200.0;
const MOST_PM: f64 = 700.0;
/// How often it goes out and back.
const CYCLES: u32 = 6;
/// Samples sooner after a change of torque do not count, s: three of them, where none is late.
const SETTLED_S: f64 = 0.002_5;
/// Samples below this part of the speed do not count.
const FAST: f64 = 0.45;
/// Nor do those above this one: the master was held up, and nearer to the drive's limit torque fades.
const TOO_FAST: f64 = 1.2;
/// No encoder is later than that, µs.
const MOST_LAG_US: f64 = 1_000.0;
/// The last round must confirm the one before, electrical degrees.
const MOST_LEFT_DEG: f64 = 2.0;
/// An electrical zero further off must be calibrated first, electrical degrees.
const MOST_ZERO_DEG: f64 = 10.0;

/// What a run to and fro says.
#[derive(Clone, Copy, Debug)]
struct Measured {
    /// By how much the encoder is later than the drive believes, s.
    late_s: f64,
    /// By how much the electrical zero is off, rad.
    zero_rad: f64,
    /// Share of the longest vector that was used.
    voltage_share: f64,
}

/// A winding behind a bridge that holds its voltage.
#[derive(Clone, Copy, Debug)]
struct Winding {
    resistance_ohm: f64,
    inductance_h: f64,
    /// How long a voltage is held, s.
    period_s: f64,
    /// How long after the currents were sampled it begins to act, s.
    delay_s: f64,
}

impl Winding {
    /// The angle by which the loops' frame stands behind the rotor, rad, from the voltage that they
    /// make and the current that they see, both in their frame, and the electrical speed, rad/s.
    ///
    /// In the stator's frame, with the rotor at ωt and the currents sampled at 0:
    /// i(T) = i(0)·e^(−T/τ) + ∫ e^(−(T−s)/τ)·(v(s) − jωψ·e^(jωs)) ds / L, where v is the voltage of
    /// the period before until the delay is over. Turning evenly, everything comes back turned by ωT.
    fn behind(&self, voltage: Complex, current: Complex, omega: f64) -> f64 {
        let (t, t1) = (self.period_s, self.delay_s);
        let rate = self.resistance_ohm / self.inductance_h;
        // ∫ e^(−rate·(T−s)) ds, in parts.
        let late = (1.0 - (-rate * (t - t1)).exp()) / rate;
        let all = (1.0 - (-rate * t).exp()) / rate;
        let held = Complex::exp(0.0, -omega * t) * (all - late) + Complex::new(late, 0.0);
        let turned = Complex::exp(0.0, omega * t);
        let decayed = Complex::new((-rate * t).exp(), 0.0);
        let induced = (turned - decayed) / Complex::new(rate, omega);
        // The frame in which the voltage is made stands for the middle of its time.
        let applied = voltage * Complex::exp(0.0, omega * (t1 + 0.5 * t)) * held;
        let driven = current * (turned - decayed) * self.inductance_h;
        ((applied - driven) / induced / Complex::new(0.0, omega.signum())).angle()
    }
}

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Calibrates the encoder's lag, 0x3013,5. Current sensors and electrical zero must be
    /// calibrated; the shaft must be free and goes to and fro with half of the no-load speed.
    ///
    /// # Errors
    /// [`ProcedureError`]; nothing has changed then, and the motor is without power.
    pub async fn calibrate_encoder_lag(&mut self) -> Result<EncoderLag, ProcedureError> {
        let done = self.encoder_lag().await;
        self.end(done).await
    }

    /// Drives the shaft to and fro at a part of the no-load speed and finds how the loops' frame
    /// stands. Gives the speed at which it turned round, too, counts/s.
    async fn frame_error(&mut self, motor: &Motor, part: f64) -> Result<(Measured, f64), Cause> {
        let user = self.read(USER_POLARITY).await? as f64;
        // As it is counted, the electrical angle may fall while the user's position rises.
        let sense = self.read(ELECTRICAL_POLARITY).await? as f64 * user;
        let limit = self.read(MAX_MOTOR_VELOCITY).await? as f64;
        // P3 l.888; a duty acts with the PWM period after the one in which it was computed.
        let pwm_s = 1.0 / self.read(PWM_FREQUENCY).await?.max(1) as f64;
        let winding = Winding {
            resistance_ohm: motor.phase_resistance_ohm,
            inductance_h: motor.phase_inductance_h,
            period_s: 5.0 * pwm_s,
            delay_s: pwm_s,
        };
        let mut turn_round = part * motor.no_load_speed();
        if limit > 0.0 {
            turn_round = turn_round.min(MOST_OF_LIMIT * limit);
        }
        let wanted = 2.0 * turn_round / LEG_S / motor.acceleration_per_permille();
        let run = Run {
            torque_pm: wanted.clamp(LEAST_PM, MOST_PM) as i64,
            turn_round,
            cycles: CYCLES,
            position: 2,
            wraps: Some(motor.counts),
            sense: user,
        };
        let most = (Run::LIMIT * turn_round) as i64;
        if limit == 0.0 || limit > most as f64 {
            self.borrow(MAX_MOTOR_VELOCITY, most).await?;
        }
        let seen = [VOLTAGE_D, VOLTAGE_Q, RAW_ENCODER];
        let driven = self.drive_to_and_fro(motor, &seen, &run).await?;
        self.give_back_one(MAX_MOTOR_VELOCITY).await?;
        let measured = evaluate(&driven, &run, motor, &winding, sense)?;
        Ok((measured, turn_round))
    }

    /// By how much the electrical zero that is written is off, electrical degrees in the sense of
    /// the electrical angle, as the back-EMF tells: friction, cogging and dead time have no part in
    /// it. The shaft must be free.
    pub(super) async fn zero_error_deg(&mut self, motor: &Motor) -> Result<f64, Cause> {
        self.step("driving the shaft to and fro to see where the back-EMF is");
        let mut lag_us = self.read(ENCODER_LAG).await? as f64;
        let mut zeros_rad = Vec::new();
        for part in SPEEDS.into_iter().chain(SPEEDS.last().copied()) {
            // With a lag that is far off, current and torque are not where they are believed.
            let (measured, _) = self.frame_error(motor, part).await?;
            zeros_rad.push(measured.zero_rad);
            lag_us = (lag_us + measured.late_s * 1e6).clamp(0.0, MOST_LAG_US);
            self.borrow(ENCODER_LAG, lag_us.round() as i64).await?;
        }
        // Only what the last two rounds agree in is more than their noise.
        let last = zeros_rad.split_off(zeros_rad.len().saturating_sub(2));
        let least = last.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest = last.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Ok(0.0f64.clamp(least, greatest).to_degrees())
    }

    async fn encoder_lag(&mut self) -> Result<EncoderLag, Cause> {
        let motor = self.ready().await?;
        let mut lag_us = 0.0;
        self.find(ENCODER_LAG, 0).await?;
        let mut last = None;
        for part in SPEEDS {
            self.step("driving the shaft to and fro to see how late the encoder is");
            let (measured, turn_round) = self.frame_error(&motor, part).await?;
            lag_us = (lag_us + measured.late_s * 1e6)
                .clamp(0.0, MOST_LAG_US)
                .round();
            self.find(ENCODER_LAG, lag_us as i64).await?;
            self.measured("lag", lag_us, "us");
            last = Some((measured, turn_round));
        }
        let Some((measured, speed)) = last else {
            return Err(Cause::Stopped);
        };
        let electrical = speed / motor.counts_per_electrical_turn() * std::f64::consts::TAU;
        let corrected = measured.late_s * electrical;
        Finding {
            what: "the angle that the last round found wrong",
            seen: corrected.to_degrees(),
            low: -MOST_LEFT_DEG,
            high: MOST_LEFT_DEG,
            unit: "electrical degrees",
            remedy: "the lag is not between 0 and 1000 us, or something drives the shaft; \
                     calibrate electrical zero and phase order first",
        }
        .check()?;
        Finding {
            what: "the error of the electrical zero, by both directions",
            seen: measured.zero_rad.to_degrees(),
            low: -MOST_ZERO_DEG,
            high: MOST_ZERO_DEG,
            unit: "electrical degrees",
            remedy: "calibrate the electrical zero first",
        }
        .check()?;
        let left_s = measured.late_s - (measured.late_s * 1e6).round() * 1e-6;
        Ok(EncoderLag {
            lag_us,
            speed,
            left_deg: (left_s * electrical).to_degrees(),
            zero_deg: measured.zero_rad.to_degrees(),
            voltage_share: measured.voltage_share,
        })
    }
}

/// Fits the angle by which the loops' frame stood behind the rotor.
///
/// # Errors
/// The voltage came near its limit, or there were too few samples.
fn evaluate(
    driven: &[Driven],
    run: &Run,
    motor: &Motor,
    winding: &Winding,
    sense: f64,
) -> Result<Measured, Cause> {
    let volt = motor.longest_v() / 32_768.0;
    let ampere = motor.rated_torque_nm * 1e-3 / motor.torque_constant_nm_per_a;
    let per_count = std::f64::consts::TAU / motor.counts_per_electrical_turn();
    let mut longest: f64 = 0.0;
    let mut rows = Vec::with_capacity(driven.len());
    for around in driven.windows(3) {
        let [before, now, after] = around else {
            continue;
        };
        let raw = |driven: &Driven| driven.sample.values[run.position];
        let here = raw(now);
        let from = unwrapped(raw(before), here, motor.counts);
        let to = unwrapped(raw(after), here, motor.counts);
        let since = now.sample.time_s - before.sample.time_s;
        let until = after.sample.time_s - now.sample.time_s;
        // A master that was held up leaves a gap.
        if run.is_ambiguous(since) || run.is_ambiguous(until) || since <= 0.0 || until <= 0.0 {
            continue;
        }
        // Counts/s in the user's direction, of the parabola through the three.
        let ways = (here - from) / since * until + (to - here) / until * since;
        let speed = ways / (since + until) * run.sense;
        let share = speed.abs() / run.turn_round;
        if now.age_s < SETTLED_S || after.age_s == 0.0 || !(FAST..=TOO_FAST).contains(&share) {
            continue;
        }
        let electrical = speed * sense * per_count;
        let current = Complex::new(0.0, now.torque_pm * ampere * sense);
        let voltage = Complex::new(now.sample.values[0] * volt, now.sample.values[1] * volt);
        longest = longest.max(voltage.re.hypot(voltage.im) / motor.longest_v());
        let behind = winding.behind(voltage, current, electrical);
        let torque = now.torque_pm.signum() * sense;
        let (s, c) = (here / motor.counts * std::f64::consts::TAU).sin_cos();
        rows.push((
            vec![
                // The electrical zero's error, and the lag's.
                1.0,
                electrical,
                // The inductance's error: the same angle in both directions of rotation.
                torque,
                // Dead time: a voltage that changes its sign with the current.
                torque / electrical,
                // An eccentric encoder: a wave with the turn, and a little of its double.
                s,
                c,
                s * c,
                c * c - s * s,
            ],
            behind,
        ));
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
        sent: driven.len(),
        came: rows.len(),
    })?;
    Ok(Measured {
        zero_rad: fitted.coefficients[0],
        late_s: fitted.coefficients[1],
        voltage_share: longest,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_is_that_of_a_winding_simulated_in_fine_steps() {
        let winding = Winding {
            resistance_ohm: 6.55,
            inductance_h: 0.000_364_5,
            period_s: 50e-6,
            delay_s: 10e-6,
        };
        let flux = 0.007;
        for omega in [3_000.0, -3_000.0, 900.0] {
            for behind in [0.0, 0.1, -0.3] {
                // A current controller in a frame that stands behind: i_d to 0, i_q to 50 mA.
                let wanted = Complex::new(0.0, 0.05);
                let (mut integral, mut next) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
                let mut active = next;
                let mut i = Complex::new(0.0, 0.0);
                let mut seen = (integral, i);
                let steps = 500;
                let dt = winding.period_s / f64::from(steps);
                for period in 0..4_000 {
                    let theta = omega * f64::from(period) * winding.period_s;
                    let frame = theta - behind;
                    let actual = i * Complex::exp(0.0, -frame);
                    let error = wanted - actual;
                    let voltage = integral + error * 1.0 + Complex::new(0.0, omega * flux);
                    integral = integral + error * 0.1;
                    let middle = frame + omega * (winding.delay_s + 0.5 * winding.period_s);
                    next = voltage * Complex::exp(0.0, middle);
                    seen = (voltage, actual);
                    for step in 0..steps {
                        let t = f64::from(step) * dt;
                        if t >= winding.delay_s {
                            active = next;
                        }
                        let emf = Complex::exp(0.0, theta + omega * (t + 0.5 * dt))
                            * Complex::new(0.0, omega * flux);
                        let change = active - emf - i * winding.resistance_ohm;
                        i = i + change * (dt / winding.inductance_h);
                    }
                }
                let found = winding.behind(seen.0, seen.1, omega);
                assert!((found - behind).abs() < 1e-3, "{omega} {behind}: {found}");
            }
        }
    }
}
