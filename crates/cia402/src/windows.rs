//! Windows with a time: errors that last, targets that are reached.

use crate::Window;

/// Counts how long a condition has held, tick by tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Lasting {
    ticks: u32,
}

impl Lasting {
    /// One millisecond more. The first tick at which the condition holds is its time 0.
    pub(crate) fn tick(&mut self, holds: bool) {
        self.ticks = if holds {
            self.ticks.saturating_add(1)
        } else {
            0
        };
    }

    /// Whether it has held for longer than `time_ms`.
    fn longer_than(self, time_ms: u16) -> bool {
        self.ticks > u32::from(time_ms) + 1 || (self.ticks > 0 && time_ms == 0)
    }

    /// Whether it has held for `time_ms`.
    fn for_at_least(self, time_ms: u16) -> bool {
        self.ticks > u32::from(time_ms)
    }
}

/// Watches an error against a window: true while the error has been outside for longer than the
/// time, false as soon as it is back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Monitor(Lasting);

impl Monitor {
    /// Nothing seen yet.
    pub(crate) const NEW: Monitor = Monitor(Lasting { ticks: 0 });

    /// One millisecond more, with the size of the error, or `None` if there is nothing to watch.
    pub(crate) fn tick(&mut self, window: Option<Window>, error: Option<f64>) -> bool {
        let outside = match (window, error) {
            (Some(window), Some(error)) => error > f64::from(window.size),
            _ => false,
        };
        self.0.tick(outside);
        window.is_some_and(|window| self.0.longer_than(window.time_ms))
    }
}

/// Watches whether a value has come to its target: true when it has been inside for the time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Arrival(Lasting);

impl Arrival {
    /// One millisecond more: whether the generator has ended, and how far the value is off.
    pub(crate) fn tick(&mut self, window: Option<Window>, ended: bool, error: f64) -> bool {
        let Some(window) = window else {
            self.0.tick(ended);
            return ended;
        };
        self.0.tick(ended && error <= f64::from(window.size));
        self.0.for_at_least(window.time_ms)
    }
}

/// Standstill: lost when the speed has exceeded the threshold for longer than the time, back as
/// soon as it is below (0x606F, 0x6070).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Standstill(Lasting);

impl Standstill {
    pub(crate) fn tick(&mut self, stands: bool, time_ms: u16) -> bool {
        self.0.tick(!stands);
        !self.0.longer_than(time_ms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_monitor_waits_for_its_time_and_lets_go_at_once() {
        let window = Some(Window {
            size: 100,
            time_ms: 3,
        });
        let mut monitor = Monitor::default();
        let mut trace = |error: f64| monitor.tick(window, Some(error));
        assert!(!trace(101.0)); // 0 ms
        assert!(!trace(101.0)); // 1 ms
        assert!(!trace(101.0)); // 2 ms
        assert!(!trace(101.0)); // 3 ms: not longer than 3 ms
        assert!(trace(101.0)); // 4 ms
        assert!(!trace(100.0)); // the border is inside
        assert!(!trace(500.0)); // and the time starts anew
    }

    #[test]
    fn without_time_a_monitor_acts_at_once() {
        let mut monitor = Monitor::default();
        assert!(monitor.tick(
            Some(Window {
                size: 0,
                time_ms: 0
            }),
            Some(1.0)
        ));
        assert!(!monitor.tick(None, Some(1e9)));
        assert!(!monitor.tick(
            Some(Window {
                size: 0,
                time_ms: 0
            }),
            None
        ));
    }

    #[test]
    fn an_arrival_must_last() {
        let window = Some(Window {
            size: 20,
            time_ms: 2,
        });
        let mut arrival = Arrival::default();
        assert!(!arrival.tick(window, false, 0.0));
        assert!(!arrival.tick(window, true, 20.0)); // 0 ms
        assert!(!arrival.tick(window, true, 21.0)); // outside again
        assert!(!arrival.tick(window, true, -0.0)); // 0 ms
        assert!(!arrival.tick(window, true, 1.0)); // 1 ms
        assert!(arrival.tick(window, true, 1.0)); // 2 ms
        assert!(Arrival::default().tick(None, true, 1e9));
    }

    #[test]
    fn standstill_is_lost_slowly() {
        let mut standstill = Standstill::default();
        assert!(standstill.tick(true, 1));
        assert!(standstill.tick(false, 1)); // 0 ms
        assert!(standstill.tick(false, 1)); // 1 ms
        assert!(!standstill.tick(false, 1)); // 2 ms
        assert!(standstill.tick(true, 1));
    }
}
