//! What takes a drive's processor away: its logic supply, and a program that hangs until the watchdog
//! resets it.

use canopen::Instant;
use drive::Health;

use crate::drive::VirtualDrive;

/// How long the watchdog waits for a processor that does not answer. The P3's manual tells nothing of
/// it but the emergency that follows (0x6010).
const WATCHDOG_NS: u64 = 20_000_000;

/// Whether there is a processor that works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Processor {
    /// It works, or boots.
    Alive,
    /// It hangs: it hears nothing, computes nothing, and the bridge goes on with the last duty. The
    /// watchdog bites then.
    Hung { until: Instant },
    /// It has no supply.
    Off,
}

impl VirtualDrive {
    /// Lets the processor hang from now on. 20 ms later the watchdog resets it. False, and nothing is
    /// done, if it does not work.
    pub fn hang(&mut self, now: Instant) -> bool {
        if self.why_idle().is_some() {
            return false;
        }
        self.processor = Processor::Hung {
            until: now.plus_ns(WATCHDOG_NS),
        };
        true
    }

    /// What the processor does, if it does not work.
    pub(crate) fn why_idle(&self) -> Option<&'static str> {
        match self.processor {
            // It may have lost its supply at this very moment.
            _ if !self.plants[0].logic_powered() => Some("has no supply"),
            Processor::Off => Some("has no supply"),
            Processor::Hung { .. } => Some("hangs already"),
            Processor::Alive if self.is_booting() => Some("boots"),
            Processor::Alive => None,
        }
    }

    /// Everything that does not survive a logic supply that fails: also what the last reset was.
    pub(crate) fn lose_supply(&mut self) {
        self.lose_program();
        self.health.watchdog_reset = false;
    }

    /// Whether the processor neither hears nor computes.
    pub(crate) fn is_lifeless(&self) -> bool {
        self.processor != Processor::Alive
    }

    /// When the state of the processor must be looked at next.
    pub(crate) fn next_power(&self) -> Instant {
        match (self.processor, self.plants[0].logic_powered()) {
            (Processor::Off, true) | (Processor::Alive | Processor::Hung { .. }, false) => {
                Instant::ZERO
            }
            (Processor::Hung { until }, true) => until,
            (Processor::Off, false) | (Processor::Alive, true) => Instant::NEVER,
        }
    }

    /// Follows the logic supply and the watchdog.
    pub(crate) fn follow_power(&mut self, now: Instant) {
        match (self.processor, self.plants[0].logic_powered()) {
            (Processor::Off, true) => {
                self.processor = Processor::Alive;
                self.boots_at = now.plus_ns(self.latency.boot_ns());
            }
            (Processor::Alive | Processor::Hung { .. }, false) => {
                self.lose_supply();
                self.processor = Processor::Off;
                self.boots_at = Instant::NEVER;
            }
            (Processor::Hung { until }, true) if now >= until => {
                self.lose_program();
                self.processor = Processor::Alive;
                self.health = Health {
                    watchdog_reset: true,
                    ..self.health
                };
                self.boots_at = now.plus_ns(self.latency.boot_ns());
            }
            _ => {}
        }
    }
}
