//! What is looked at before any power is applied.

use super::{
    AMPLIFIER_CURRENT, CONTINUOUS_CURRENT, Cause, DEVICE_TYPE, ENCODER_RESOLUTION, Finding,
    INDUCTANCE, MAX_SUPPLY, MAX_TEMPERATURE, MIN_SUPPLY, PEAK_CURRENT, POLES, POSITION,
    RATED_TORQUE, RESISTANCE, ROTOR_INERTIA, SUPPLY, Session, TEMPERATURE, TORQUE_CONSTANT, Watch,
};
use crate::Link;

/// What the drive's objects say of motor and supply, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motor {
    pub(crate) pole_pairs: f64,
    pub(crate) counts: f64,
    pub(crate) phase_resistance_ohm: f64,
    pub(crate) phase_inductance_h: f64,
    /// Per ampere of phase current amplitude.
    pub(crate) torque_constant_nm_per_a: f64,
    pub(crate) rotor_inertia_kgm2: f64,
    pub(crate) continuous_a: f64,
    pub(crate) rated_torque_nm: f64,
    pub(crate) supply_v: f64,
}

impl Motor {
    /// Longest voltage vector, V of phase amplitude.
    pub(crate) fn longest_v(&self) -> f64 {
        self.supply_v / 3f64.sqrt()
    }

    pub(crate) fn counts_per_electrical_turn(&self) -> f64 {
        self.counts / self.pole_pairs
    }

    pub(crate) fn flux_vs(&self) -> f64 {
        self.torque_constant_nm_per_a / (1.5 * self.pole_pairs)
    }

    /// Acceleration of one per mille of rated torque, counts/s², by the data sheet.
    pub(crate) fn acceleration_per_permille(&self) -> f64 {
        self.rated_torque_nm * 1e-3 / self.rotor_inertia_kgm2 * self.counts / std::f64::consts::TAU
    }

    /// Speed at which the back-EMF would need all of the supply, counts/s.
    pub(crate) fn no_load_speed(&self) -> f64 {
        self.longest_v() / (self.flux_vs() * self.pole_pairs) * self.counts / std::f64::consts::TAU
    }
}

/// Below this the bridge of a P3 does not work (P3 l.56).
const LEAST_SUPPLY_V: f64 = 12.0;
const GREATEST_SUPPLY_V: f64 = 60.0;
/// How far below its limit the amplifier shall be.
const COOLER_BY_K: f64 = 5.0;
/// A shaft may take so long to run out, ms, and stands still below a speed, turn/s.
const RUN_OUT_MS: u64 = 20_000;
const LOOK_MS: u64 = 100;
const STANDING: f64 = 0.03;
/// Limit where the drive has none, °C.
const WARM_C: f64 = 85.0;

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Reads what the procedures need to know and checks that the motor may get power: supply,
    /// temperature, currents, figures of the motor, standstill.
    ///
    /// # Errors
    /// [`Cause::NotReady`] with what was seen and expected.
    pub(crate) async fn ready(&mut self) -> Result<Motor, Cause> {
        self.step("checking supply, temperature and limits");
        let profile = self.read(DEVICE_TYPE).await? & 0xFFFF;
        ready(Finding {
            what: "the device profile (0x1000)",
            seen: profile as f64,
            low: 402.0,
            high: 402.0,
            unit: "",
            remedy: "this is no drive of CiA 402; choose its node with --node",
        })?;
        let supply_v = self.read_own(SUPPLY).await? as f64 * 0.1;
        self.read_own(POLES).await?;
        let limit = |tenths: i64, otherwise: f64| match tenths {
            0 => otherwise,
            tenths => tenths as f64 * 0.1,
        };
        let low = limit(self.read(MIN_SUPPLY).await?, LEAST_SUPPLY_V);
        let high = limit(self.read(MAX_SUPPLY).await?, GREATEST_SUPPLY_V);
        ready(Finding {
            what: "the motor supply (0x3000,1)",
            seen: supply_v,
            low: low.max(LEAST_SUPPLY_V),
            high,
            unit: "V",
            remedy: "switch the motor supply on, or correct it",
        })?;
        let warm = match self.read(MAX_TEMPERATURE).await? {
            0 => WARM_C,
            limit => limit as f64,
        };
        ready(Finding {
            what: "the amplifier's temperature (0x3000,2)",
            seen: self.read(TEMPERATURE).await? as f64,
            low: -40.0,
            high: warm - COOLER_BY_K,
            unit: "degC",
            remedy: "let it cool down",
        })?;
        let motor = self.motor(supply_v).await?;
        self.standstill(&motor).await?;
        Ok(motor)
    }

    /// Waits until the shaft stands still: it may run out from what was before. The way within a
    /// time is looked at, because the speed of a noisy encoder is never 0.
    async fn standstill(&mut self, motor: &Motor) -> Result<(), Cause> {
        let until = self.client.now().plus_ms(RUN_OUT_MS);
        let mut before = self.read(POSITION).await?;
        loop {
            self.wait(LOOK_MS).await?;
            let now = self.read(POSITION).await?;
            let way = f64::from((now as i32).wrapping_sub(before as i32));
            let speed = way / motor.counts / (LOOK_MS as f64 * 1e-3);
            if speed.abs() <= STANDING {
                return Ok(());
            }
            if self.client.now() >= until {
                return ready(Finding {
                    what: "the speed of the shaft",
                    seen: speed,
                    low: -STANDING,
                    high: STANDING,
                    unit: "turn/s",
                    remedy: "wait until it stands still, and see that nothing drives it",
                });
            }
            before = now;
        }
    }

    async fn motor(&mut self, supply_v: f64) -> Result<Motor, Cause> {
        let poles = self.read(POLES).await?;
        ready(Finding {
            what: "the pole count (0x3011,3)",
            seen: if poles % 2 == 0 {
                poles as f64
            } else {
                f64::NAN
            },
            low: 2.0,
            high: 126.0,
            unit: "",
            remedy: "write the even number of poles of the motor's data sheet",
        })?;
        let mut figure = [0.0; 6];
        for (place, (object, remedy)) in figure.iter_mut().zip([
            (ENCODER_RESOLUTION, "write the counts of one turn"),
            (
                RESISTANCE,
                "write the data sheet's resistance between two terminals",
            ),
            (
                INDUCTANCE,
                "write the data sheet's inductance between two terminals",
            ),
            (TORQUE_CONSTANT, "write the data sheet's torque constant"),
            (ROTOR_INERTIA, "write the data sheet's rotor inertia"),
            (RATED_TORQUE, "write the torque at the continuous current"),
        ]) {
            let value = self.read(object).await? as f64;
            ready(Finding {
                what: object.name,
                seen: value,
                low: 1.0,
                high: f64::INFINITY,
                unit: object.unit,
                remedy,
            })?;
            *place = value;
        }
        let continuous_ma = self.read(CONTINUOUS_CURRENT).await? as f64;
        let peak_ma = self.read(PEAK_CURRENT).await? as f64;
        let amplifier_ma = self.read(AMPLIFIER_CURRENT).await? as f64;
        ready(Finding {
            what: "the motor's continuous current (0x3011,8)",
            seen: continuous_ma,
            low: 1.0,
            high: peak_ma.min(amplifier_ma),
            unit: "mA",
            remedy: "write the data sheet's current; it may exceed neither the peak current \
                     (0x3011,9) nor the amplifier's (0x3001,8)",
        })?;
        let [
            counts,
            resistance,
            inductance,
            torque_constant,
            inertia,
            rated,
        ] = figure;
        Ok(Motor {
            pole_pairs: poles as f64 / 2.0,
            counts,
            phase_resistance_ohm: resistance * 0.01 / 2.0,
            phase_inductance_h: inductance * 1e-5 / 2.0,
            torque_constant_nm_per_a: torque_constant * 1e-3,
            rotor_inertia_kgm2: inertia / 32768.0 * 1e-7,
            continuous_a: continuous_ma * 1e-3,
            rated_torque_nm: rated * 1e-3,
            supply_v,
        })
    }
}

fn ready(finding: Finding) -> Result<(), Cause> {
    finding.check().map_err(Cause::NotReady)
}
