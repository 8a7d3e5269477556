//! Virtual time that keeps pace with the clock on the wall.

use std::time::Duration;

use canopen::Instant;

/// Says what the virtual time is, given that it runs `speed` times as fast as real time.
#[derive(Clone, Copy, Debug)]
pub struct Pacer {
    speed: f64,
    started: std::time::Instant,
    from: Instant,
}

impl Pacer {
    /// Virtual time is `from` now. `speed` is positive and finite.
    pub fn start(speed: f64, from: Instant) -> Pacer {
        Pacer {
            speed,
            started: std::time::Instant::now(),
            from,
        }
    }

    /// The virtual time now.
    pub fn now(&self) -> Instant {
        let ns = self.started.elapsed().as_secs_f64() * self.speed * 1e9;
        self.from.plus_ns(ns as u64)
    }

    /// How long to wait, in real time, until the virtual time is `until`; 0 if it is past.
    pub fn wait_for(&self, until: Instant) -> Duration {
        let ns = until.since_ns(self.now()) as f64 / self.speed;
        Duration::from_nanos(ns as u64)
    }
}
