//! Driving the shaft to and fro by torque.

use cia402::Mode;

use super::{Cause, Finding, Motor, Object, Sample, Session, TARGET_TORQUE, Watch};
use crate::Link;

/// A run to and fro.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Run {
    /// Torque either way, per mille of rated torque.
    pub(crate) torque_pm: i64,
    /// Speed at which it turns round, counts/s.
    pub(crate) turn_round: f64,
    /// How often it goes out and back.
    pub(crate) cycles: u32,
    /// Which of the recorded objects tells where the shaft is.
    pub(crate) position: usize,
    /// Counts after which that begins again; `None` if it does not.
    pub(crate) wraps: Option<f64>,
    /// Sense of that object against the torque: 1 or −1.
    pub(crate) sense: f64,
}

impl Run {
    /// Part of the speed at which it turns round that the drive shall be limited to, so that a shaft
    /// does not run away while a master is held up. Far enough off for the torque not to fade before
    /// (P22).
    pub(crate) const LIMIT: f64 = 1.5;

    /// Whether the shaft may make half a turn or more in so long: nobody knows then how many it has
    /// made.
    pub(crate) fn is_ambiguous(&self, pause_s: f64) -> bool {
        let way = Run::LIMIT * self.turn_round * pause_s;
        self.wraps.is_some_and(|turn| way >= 0.5 * turn)
    }
}

/// A sample with the torque that was commanded at its time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Driven {
    /// What was recorded.
    pub(crate) sample: Sample,
    /// Per mille of rated torque.
    pub(crate) torque_pm: f64,
    /// Since when this torque, s; 0 at the sample with whose SYNC it began to act.
    pub(crate) age_s: f64,
}

/// Samples, one each millisecond, that one direction of torque may take.
const LONGEST: usize = 1_000;

/// Where a run to and fro is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Leg {
    Out,
    Back,
    Home,
}

impl<L: Link, W: Watch> Session<'_, L, W> {
    /// Drives the shaft to and fro in mode 10 and records `seen` each millisecond. Ends without
    /// power, nearly at rest.
    ///
    /// # Errors
    /// The shaft does not come to its speed, or runs against the torque.
    pub(crate) async fn drive_to_and_fro(
        &mut self,
        motor: &Motor,
        seen: &[Object],
        run: &Run,
    ) -> Result<Vec<Driven>, Cause> {
        self.borrow(TARGET_TORQUE, 0).await?;
        self.start_recording(seen, &[TARGET_TORQUE]).await?;
        self.enable().await?;
        self.set_mode(Mode::CYCLIC_TORQUE.0).await?;
        let mut speedometer = Speedometer::new(run);
        let (mut leg, mut left, mut cycles) = (Leg::Out, LONGEST, run.cycles.max(1));
        let mut lost = None;
        let mut torques: Vec<i64> = Vec::new();
        let command = |_: usize, seen: Option<&Sample>| {
            let speed = speedometer.speed(seen);
            let next = match leg {
                Leg::Out if speed >= run.turn_round => Leg::Back,
                Leg::Back if speed <= -run.turn_round => {
                    cycles -= 1;
                    if cycles == 0 { Leg::Home } else { Leg::Out }
                }
                Leg::Home if speed >= 0.0 => return None,
                same => same,
            };
            left = if next == leg { left - 1 } else { LONGEST };
            leg = next;
            let runs_away = leg == Leg::Out && cycles == run.cycles && speed <= -run.turn_round;
            if left == 0 || runs_away {
                lost = Some((leg, speed));
                return None;
            }
            let sign = if leg == Leg::Back { -1 } else { 1 };
            torques.push(sign * run.torque_pm);
            Some(vec![sign * run.torque_pm])
        };
        let most = (2 * run.cycles as usize + 2) * LONGEST;
        let samples = self.record(most, 1, &[0], command).await?;
        self.power_off().await?;
        self.stop_recording().await?;
        if let Some((leg, speed)) = lost {
            let wanted = match leg {
                Leg::Back => -run.turn_round,
                Leg::Out | Leg::Home => run.turn_round,
            };
            return Err(Finding {
                what: "the speed that the torque gives the shaft",
                seen: speed / motor.counts * 60.0 * wanted.signum(),
                low: wanted.abs() / motor.counts * 60.0,
                high: f64::INFINITY,
                unit: "rpm",
                remedy: "the shaft is blocked or loaded, or the electrical zero is wrong; free \
                         the shaft and calibrate",
            }
            .into());
        }
        let mut since_s = 0.0;
        let mut before = 0;
        Ok(samples
            .into_iter()
            .map(|sample| {
                // What was commanded with a SYNC acts from the next one on.
                let n = sample.number.checked_sub(1);
                let torque = n.and_then(|n| torques.get(n)).copied();
                let torque = torque.unwrap_or(0);
                if torque != before {
                    since_s = sample.time_s;
                }
                before = torque;
                Driven {
                    age_s: sample.time_s - since_s,
                    sample,
                    torque_pm: torque as f64,
                }
            })
            .collect())
    }
}

/// Where the shaft is and how fast, from the last samples.
#[derive(Debug)]
struct Speedometer {
    run: Run,
    /// Time and place, the oldest first.
    last: Vec<(f64, f64)>,
    /// What they gave.
    speed: f64,
}

impl Speedometer {
    fn new(run: &Run) -> Speedometer {
        Speedometer {
            run: *run,
            last: Vec::new(),
            speed: 0.0,
        }
    }

    /// Counts/s over the last four samples, in the torque's sense.
    fn speed(&mut self, seen: Option<&Sample>) -> f64 {
        if let Some(sample) = seen {
            let mut place = sample.values[self.run.position] * self.run.sense;
            let pause_s = self.last.last().map_or(0.0, |(t, _)| sample.time_s - t);
            if self.run.is_ambiguous(pause_s) {
                self.last.clear();
            }
            if let (Some((_, before)), Some(turn)) = (self.last.last(), self.run.wraps) {
                place = unwrapped(place, *before, turn);
            }
            self.last.push((sample.time_s, place));
            if self.last.len() > 4 {
                self.last.remove(0);
            }
        }
        match (self.last.first(), self.last.last()) {
            (Some(from), Some(to)) if to.0 > from.0 => {
                self.speed = (to.1 - from.1) / (to.0 - from.0);
            }
            // As far as is known.
            _ => {}
        }
        self.speed
    }
}

/// `place`, moved by whole turns to the nearest one of `before`.
pub(crate) fn unwrapped(place: f64, before: f64, turn: f64) -> f64 {
    place + ((before - place) / turn).round() * turn
}
