//! What the current sensors read without current (P3 l.238 to l.256).

use crate::Link;
use crate::session::{
    CURRENT_BIAS_A, CURRENT_BIAS_B, CURRENT_SENSE_A, CURRENT_SENSE_B, Cause, Finding,
    ProcedureError, Session, Watch,
};

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentSensor {
    /// Readings of phases A and B at no current, converter counts.
    pub bias: [f64; 2],
    /// How far single readings lay from their mean at most, converter counts.
    pub spread: f64,
}

/// A reading is 12 bits and a fraction of 4 (l.255).
const FRACTION: f64 = 16.0;
/// A bias further from the middle than this is a broken sensor or an open wire. The manual's own
/// example is 10.5 % away.
const MIDDLE: f64 = 2048.0;
const FARTHEST: f64 = 0.25 * MIDDLE;
/// Readings of a mean, their distance, and how many means may be tried.
const READINGS: usize = 10;
const EVERY_MS: u64 = 25;
const MEANS: u32 = 20;
/// Two means agree if they are closer than this, counts.
const AGREE: f64 = 0.1;
/// Single readings are filtered; what moves more than this is not noise.
const QUIET: f64 = 8.0;

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Calibrates the current sensors: 0x3009,1 and 0x3009,2.
    ///
    /// # Errors
    /// [`ProcedureError`]; nothing has changed then, and the motor is without power.
    pub async fn calibrate_current_sensor(&mut self) -> Result<CurrentSensor, ProcedureError> {
        let done = self.current_sensor().await;
        self.end(done).await
    }

    async fn current_sensor(&mut self) -> Result<CurrentSensor, Cause> {
        self.ready().await?;
        self.enable().await?;
        self.set_mode(0).await?;
        // The manual waits a second; here until the filter has settled, and at least half of one.
        self.step("letting the current sensors settle");
        let mut before: Option<[f64; 2]> = None;
        let mut drift = 0.0;
        for mean in 0..MEANS {
            self.part(mean, MEANS);
            let (now, spread) = self.mean_readings().await?;
            if let Some(before) = before {
                let [a, b] = [0, 1].map(|n: usize| (before[n] - now[n]).abs());
                drift = a.max(b);
            }
            if mean >= 2 && drift <= AGREE {
                return self.judge_readings(now, spread).await;
            }
            before = Some(now);
        }
        Err(Finding {
            what: "the drift of the current sensors (0x3008)",
            seen: drift,
            low: 0.0,
            high: AGREE,
            unit: "counts per 250 ms",
            remedy: "see that the shaft is not turned, and let the amplifier come to its \
                     temperature",
        }
        .into())
    }

    async fn mean_readings(&mut self) -> Result<([f64; 2], f64), Cause> {
        let mut readings = [Vec::new(), Vec::new()];
        for _ in 0..READINGS {
            self.wait(EVERY_MS).await?;
            for (all, object) in readings.iter_mut().zip([CURRENT_SENSE_A, CURRENT_SENSE_B]) {
                all.push(self.read(object).await? as f64 / FRACTION);
            }
        }
        let mean = |all: &Vec<f64>| all.iter().sum::<f64>() / READINGS as f64;
        let means = [mean(&readings[0]), mean(&readings[1])];
        let mut spread = 0.0f64;
        for (all, mean) in readings.iter().zip(means) {
            for reading in all {
                spread = spread.max((reading - mean).abs());
            }
        }
        Ok((means, spread))
    }

    async fn judge_readings(
        &mut self,
        bias: [f64; 2],
        spread: f64,
    ) -> Result<CurrentSensor, Cause> {
        self.must_be_enabled().await?;
        for (what, seen) in [
            ("the current sense of phase A (0x3008,1)", bias[0]),
            ("the current sense of phase B (0x3008,2)", bias[1]),
        ] {
            Finding {
                what,
                seen,
                low: MIDDLE - FARTHEST,
                high: MIDDLE + FARTHEST,
                unit: "counts",
                remedy: "the sensor or its wiring is broken, or a current flows",
            }
            .check()?;
        }
        Finding {
            what: "the spread of the current sense (0x3008)",
            seen: spread,
            low: 0.0,
            high: QUIET,
            unit: "counts",
            remedy: "see that the shaft is not turned, and look for what disturbs the sensor",
        }
        .check()?;
        self.measured("bias of phase A", bias[0], "counts");
        self.measured("bias of phase B", bias[1], "counts");
        self.find(CURRENT_BIAS_A, bias[0].round() as i64).await?;
        self.find(CURRENT_BIAS_B, bias[1].round() as i64).await?;
        Ok(CurrentSensor { bias, spread })
    }
}
