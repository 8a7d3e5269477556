//! The response of a closed loop to small steps, again and again, while the shaft turns.

use crate::Link;
use crate::session::{Cause, Finding, Motor, Sample, Session, Watch};

/// How the steps are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steps {
    /// Speed on which they ride, whole counts per millisecond.
    pub(super) speed_per_ms: i64,
    /// Size of a step, in the unit of the stepped object.
    pub(super) size: i64,
    /// How long each lasts, ms.
    pub(super) hold_ms: usize,
    /// How many there are, a multiple of [`COUNT`].
    pub(super) count: usize,
    /// The target is a position, not a velocity.
    pub(super) position: bool,
}

/// Steps of a mean. The shaft turns a twelfth of a turn more with each than whole turns, so that
/// what repeats with the turn (cogging, eccentricity) falls out of the mean.
pub(super) const COUNT: usize = 12;
/// Steps before those that count.
const FIRST: usize = 2;
/// The shaft comes to its speed in so long, ms.
const RUN_UP_MS: usize = 150;
/// Samples before a step that belong to its response.
const BEFORE: usize = 8;

impl Steps {
    /// A speed on which steps of `hold_ms` can ride: at least four turns per second, so that dry
    /// friction does not change its sign, and not a quarter of the motor's.
    pub(super) fn speed_per_ms(motor: &Motor, hold_ms: usize) -> i64 {
        let most = 0.25 * motor.no_load_speed() / motor.counts;
        let turn = 1.0 / COUNT as f64;
        let speed = |whole: u32| (f64::from(whole) + turn) / (hold_ms as f64 * 1e-3);
        let chosen = (0..100).map(speed).find(|speed| *speed >= 4.0);
        let chosen = match chosen {
            Some(speed) if speed <= most => speed,
            _ => most,
        };
        ((chosen * motor.counts * 1e-3).round() as i64).max(1)
    }
}

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Makes the steps and gives their mean response: time since the step, s, and counts beside the
    /// even motion. The drive is enabled, in its mode, and its PDOs are set: RPDO 4 carries target
    /// and stepped object, TPDO 4 begins with the position.
    ///
    /// # Errors
    /// The drive left operation enabled, or the shaft did not keep its speed.
    pub(super) async fn step_response(
        &mut self,
        steps: &Steps,
        origin: i64,
    ) -> Result<Vec<(f64, f64)>, Cause> {
        let run = RUN_UP_MS + (FIRST + steps.count) * steps.hold_ms;
        let full = steps.speed_per_ms as f64;
        // The way of an even run-up, of the speed behind it, and of an even run-out.
        let way = |n: usize| {
            let (n, up, end) = (n as f64, RUN_UP_MS as f64, run as f64);
            let even = full * (n.min(end) - 0.5 * up);
            match (n < up, n > end) {
                (true, _) => 0.5 * full * n * n / up,
                (_, true) => even + full * (n - end - 0.5 * (n - end).powi(2) / up),
                _ => even,
            }
        };
        let command = |n: usize, _: Option<&Sample>| {
            let out = (n.saturating_sub(run) as f64 / RUN_UP_MS as f64).min(1.0);
            let up = (n as f64 / RUN_UP_MS as f64).min(1.0);
            let target = match steps.position {
                true => origin + way(n).round() as i64,
                false => (1e3 * full * (up - out)) as i64,
            };
            let half = steps.size / 2;
            let stepped = match n.checked_sub(RUN_UP_MS) {
                _ if n > run => 0,
                Some(after) if (after / steps.hold_ms).is_multiple_of(2) => half,
                Some(_) => -half,
                None => 0,
            };
            Some(vec![target, stepped])
        };
        let rest = match steps.position {
            true => origin + way(run + RUN_UP_MS).round() as i64,
            false => 0,
        };
        let samples = self.record(run + RUN_UP_MS, 1, &[rest, 0], command).await?;
        let mut sums = vec![(0.0, 0.0); steps.hold_ms];
        for sample in &samples {
            let n = sample.number;
            // What was commanded with SYNC n acts from SYNC n + 1 on.
            let Some(after) = (n + BEFORE).checked_sub(RUN_UP_MS + 1) else {
                continue;
            };
            let (number, place) = (after / steps.hold_ms, after % steps.hold_ms);
            if (FIRST..FIRST + steps.count).contains(&number) {
                let sign = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
                let beside = sample.values[0] - origin as f64 - way(n);
                let sum = &mut sums[place];
                *sum = (sum.0 + sign * beside, sum.1 + 1.0);
            }
        }
        let travelled = match (samples.first(), samples.last()) {
            (Some(first), Some(last)) => last.values[0] - first.values[0],
            _ => 0.0,
        };
        Finding {
            what: "the way of the shaft",
            seen: travelled / way(run + RUN_UP_MS) * 100.0,
            low: 80.0,
            high: 120.0,
            unit: "% of the commanded one",
            remedy: "the shaft is blocked, or the loop is far from stable; free the shaft, or \
                     ask for a lower bandwidth",
        }
        .check()?;
        Ok(sums
            .iter()
            .enumerate()
            .filter(|(_, sum)| sum.1 > 0.0)
            .map(|(place, sum)| ((place as f64 - BEFORE as f64) * 1e-3, sum.0 / sum.1))
            .collect())
    }
}
