//! Heartbeat producer (CiA 301 7.2.8.3.2.2).

use crate::Instant;

/// When the next heartbeat is due.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Heartbeat {
    period_ms: u16,
    pub(crate) due: Instant,
}

impl Heartbeat {
    pub(crate) const OFF: Heartbeat = Heartbeat {
        period_ms: 0,
        due: Instant::NEVER,
    };

    /// Takes the period from 0x1017; the first heartbeat comes one period after `now`. 0 is off.
    pub(crate) fn configure(&mut self, period_ms: u16, now: Instant) {
        self.period_ms = period_ms;
        self.due = match period_ms {
            0 => Instant::NEVER,
            period => now.plus_ms(u64::from(period)),
        };
    }

    /// Whether there is one.
    pub(crate) fn is_on(&self) -> bool {
        self.period_ms != 0
    }

    /// Whether a heartbeat is due; if so the next one is scheduled. A late call does not produce a
    /// burst: the next is due one period after the missed time, or after `now` if that is past too.
    pub(crate) fn take_due(&mut self, now: Instant) -> bool {
        // "Never" does not come, not even at the end of time.
        if now < self.due || self.due == Instant::NEVER {
            return false;
        }
        let period = u64::from(self.period_ms);
        let next = self.due.plus_ms(period);
        self.due = if next > now {
            next
        } else {
            now.plus_ms(period)
        };
        true
    }
}
