//! Leading the rotor around by a voltage in the stator's frame (mode 12).

use crate::Link;
use crate::session::{
    CURRENT_D, Cause, ELECTRICAL_ANGLE, Finding, Motor, RAW_ENCODER, Session, VOLTAGE_D, Watch,
};

/// The P3's mode 12, phase voltage with angle.
const PHASE_VOLTAGE: i8 = 12;
/// 0x60EA counts an electrical turn so.
pub(super) const TURN: i64 = 65_536;
/// Points of an electrical turn where the encoder is read: each 22.5°.
pub(super) const POINTS: i64 = 16;
/// Steps from one point to the next, so that the rotor follows and does not swing.
const STEPS: i64 = 8;
/// The voltage rises by at most this, every so often, until the current flows.
const RISE: f64 = 100.0;
const RISE_MS: u64 = 50;
/// Voltage that the bridge's dead time may take away, in parts of the longest vector.
const DEAD_TIME: f64 = 0.05;

/// The rotor, led by the stator's field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Led {
    /// Electrical angle of the field, 1/65,536 turn, any number of turns.
    angle: i64,
    /// Period with which the field swings the rotor, ms.
    swing_ms: u64,
    counts: i64,
    /// The last reading of the encoder, and all turns before it.
    reading: i64,
    turns: i64,
    /// Current along the field, A.
    pub(super) current_a: f64,
}

/// The manual's formula for the phase voltage (P3 l.262), 1/32,768 of the longest vector; with the
/// measured supply, because that is what the unit refers to (P7).
pub(super) fn phase_voltage(motor: &Motor, current_a: f64) -> f64 {
    32_768.0 * current_a * motor.phase_resistance_ohm / motor.longest_v()
}

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Enables mode 12 and raises the voltage at angle 0 until `current_a` flows.
    ///
    /// # Errors
    /// It never flows, or flows far too early.
    pub(super) async fn lead(&mut self, motor: &Motor, current_a: f64) -> Result<Led, Cause> {
        self.enable().await?;
        self.set_mode(PHASE_VOLTAGE).await?;
        self.write(ELECTRICAL_ANGLE, 0).await?;
        self.step("raising the voltage until the calibration current flows");
        let computed = phase_voltage(motor, current_a);
        let most = (2.0 * computed + DEAD_TIME * 32_768.0).min(32_767.0);
        let rise = RISE.min(computed / 10.0).max(1.0);
        let wanted_ma = current_a * 1e3;
        let mut voltage = 0.0;
        let flowing_ma = loop {
            voltage += rise;
            self.write(VOLTAGE_D, voltage as i64).await?;
            self.wait(RISE_MS).await?;
            let mut flowing_ma = 0.0;
            for _ in 0..4 {
                flowing_ma += self.read(CURRENT_D).await? as f64 / 4.0;
            }
            self.part(flowing_ma.max(0.0) as u32, wanted_ma as u32);
            if flowing_ma >= wanted_ma || voltage + rise > most {
                break flowing_ma;
            }
        };
        Finding {
            what: "the current of the d axis (0x3010,6)",
            seen: flowing_ma,
            low: wanted_ma,
            high: 2.0 * wanted_ma,
            unit: "mA",
            remedy: "check the motor's three wires, its terminal resistance (0x3011,5) and the \
                     current sensors' calibration",
        }
        .check()?;
        Finding {
            what: "the phase voltage at the calibration current",
            seen: voltage / computed,
            low: 0.4,
            high: f64::INFINITY,
            unit: "times the computed one",
            remedy: "correct the terminal resistance (0x3011,5), or look for a short circuit in \
                     the motor",
        }
        .check()?;
        self.measured("current of the d axis", flowing_ma, "mA");
        // The field holds the rotor like a spring: it swings with this frequency.
        let stiffness = motor.torque_constant_nm_per_a * current_a * motor.pole_pairs;
        let swings_hz = (stiffness / motor.rotor_inertia_kgm2).sqrt() / std::f64::consts::TAU;
        let swing_ms = (1e3 / swings_hz).clamp(8.0, 200.0) as u64;
        self.wait(500).await?;
        let reading = self.read(RAW_ENCODER).await?;
        Ok(Led {
            angle: 0,
            swing_ms,
            counts: motor.counts as i64,
            reading,
            turns: 0,
            current_a: flowing_ma * 1e-3,
        })
    }

    /// Leads the rotor to the electrical angle `to` and lets it come to rest there.
    pub(super) async fn lead_to(&mut self, led: &mut Led, to: i64) -> Result<f64, Cause> {
        self.lead_past(led, to).await?;
        self.wait((led.swing_ms / 2).max(8)).await?;
        self.place(led).await
    }

    /// Leads the rotor to the electrical angle `to`, on its way further. Gives where it was at each
    /// step: field angle and counts, over all turns.
    pub(super) async fn lead_past(
        &mut self,
        led: &mut Led,
        to: i64,
    ) -> Result<Vec<(i64, f64)>, Cause> {
        let step = TURN / POINTS / STEPS;
        let mut way = Vec::with_capacity(STEPS as usize);
        // A way that takes one period of the swing leaves none behind.
        while led.angle != to {
            led.angle += (to - led.angle).clamp(-step, step);
            self.write(ELECTRICAL_ANGLE, i64::from(led.angle as i16))
                .await?;
            self.wait((led.swing_ms / STEPS as u64).max(1)).await?;
            way.push((led.angle, self.place(led).await?));
        }
        Ok(way)
    }

    /// By how much the back-EMF of a rotor that makes `turns` electrical turns in `time_s` holds it
    /// back, electrical degrees: the field must make up for it.
    pub(super) fn drag_deg(motor: &Motor, led: &Led, turns: f64, time_s: f64) -> f64 {
        let emf_v = turns / time_s * std::f64::consts::TAU * motor.flux_vs();
        let voltage_v = motor.phase_resistance_ohm * led.current_a;
        (emf_v / voltage_v).clamp(0.0, 1.0).asin().to_degrees()
    }

    /// Where the rotor is, counts over all turns.
    async fn place(&mut self, led: &mut Led) -> Result<f64, Cause> {
        let reading = self.read(RAW_ENCODER).await?;
        let half = led.counts / 2;
        let moved = (reading - led.reading + half).rem_euclid(led.counts) - half;
        led.turns += (led.reading + moved - reading) / led.counts;
        led.reading = reading;
        Ok((led.turns * led.counts + reading) as f64)
    }
}
