//! When a node must and may send, kept beside it: heartbeats and SYNCs at their periods, TPDOs no
//! more often than their inhibit times and no more rarely than their event timers.

use canopen::{Instant, NmtState};

use super::model::{Parameter, Pdo, Services};

/// Something that comes at a period.
#[derive(Clone, Copy, Debug)]
struct Rhythm {
    period_ns: u64,
    due: Instant,
}

impl Rhythm {
    const OFF: Rhythm = Rhythm {
        period_ns: 0,
        due: Instant::NEVER,
    };

    fn new(period_ns: u64, now: Instant) -> Rhythm {
        match period_ns {
            0 => Rhythm::OFF,
            ns => Rhythm {
                period_ns,
                due: now.plus_ns(ns),
            },
        }
    }

    /// It has come; late by more than a period, the next is a period from now.
    fn came(&mut self, now: Instant, in_time: bool) {
        assert!(now >= self.due, "too early");
        assert!(!in_time || now == self.due, "too late");
        self.go_on(now);
    }

    fn go_on(&mut self, now: Instant) {
        let next = self.due.plus_ns(self.period_ns);
        self.due = if next > now {
            next
        } else {
            now.plus_ns(self.period_ns)
        };
    }
}

/// What is due when.
#[derive(Debug)]
pub struct Clock {
    heartbeat: Rhythm,
    sync: Rhythm,
    /// SYNCs are due but not sent.
    is_stopped: bool,
    /// From when on a TPDO's event timer counts.
    timer_from: [Instant; 4],
    /// When a TPDO was last sent by an event.
    last: [Option<Instant>; 4],
}

impl Default for Clock {
    fn default() -> Clock {
        Clock {
            heartbeat: Rhythm::OFF,
            sync: Rhythm::OFF,
            is_stopped: false,
            timer_from: [Instant::NEVER; 4],
            last: [None; 4],
        }
    }
}

impl Clock {
    /// A parameter of another service was written.
    pub fn parameter(&mut self, index: u16, services: &Services, now: Instant) {
        let value = |index| u64::from(services.get(index));
        match index {
            0x1017 => self.heartbeat = Rhythm::new(1_000_000 * value(0x1017), now),
            0x1005 | 0x1006 => {
                let produces = value(0x1005) >> 30 & 1;
                let period_ns = 1_000 * value(0x1006) * produces;
                if period_ns != self.sync.period_ns {
                    self.sync = Rhythm::new(period_ns, now);
                }
            }
            _ => {}
        }
    }

    pub fn entered(&mut self, state: NmtState, now: Instant) {
        self.is_stopped = state == NmtState::Stopped;
        self.timer_from = [now; 4];
    }

    /// A parameter of TPDO `n` was written.
    pub fn configured(&mut self, n: usize, parameter: Parameter, now: Instant) {
        self.timer_from[n] = now;
        if matches!(parameter, Parameter::CobId | Parameter::Inhibit) {
            self.last[n] = None;
        }
    }

    pub fn heartbeat(&mut self, now: Instant, in_time: bool) {
        self.heartbeat.came(now, in_time);
    }

    pub fn sync(&mut self, now: Instant, in_time: bool) {
        self.sync.came(now, in_time);
    }

    /// All that was due has been done, and perhaps not seen.
    pub fn passed(&mut self, now: Instant) {
        for rhythm in [&mut self.heartbeat, &mut self.sync] {
            if rhythm.due <= now && rhythm.due != Instant::NEVER {
                rhythm.go_on(now);
            }
        }
    }

    /// When something is due next.
    pub fn next(&self) -> Instant {
        self.heartbeat.due.min(self.sync.due)
    }

    fn by_event(pdo: &Pdo) -> bool {
        pdo.transmission_type >= 254
    }

    /// TPDO `n` was sent.
    pub fn sent(&mut self, n: usize, pdo: &Pdo, now: Instant) {
        if !Clock::by_event(pdo) {
            return;
        }
        if let Some(last) = self.last[n] {
            let gap = now.since_ns(last);
            assert!(
                gap >= 100_000 * u64::from(pdo.inhibit),
                "TPDO {n} {gap} ns after the last"
            );
        }
        self.last[n] = Some(now);
        self.timer_from[n] = now;
    }

    /// TPDO `n` was perhaps sent.
    pub fn unknown(&mut self, n: usize) {
        self.last[n] = None;
        self.timer_from[n] = Instant::NEVER;
    }

    /// TPDO `n` is not overdue after a poll.
    pub fn check_timer(&self, n: usize, pdo: &Pdo, now: Instant) {
        let is_sent = pdo.exists() && pdo.bits != 0 && Clock::by_event(pdo);
        if !is_sent || pdo.timer_ms == 0 || now == Instant::NEVER {
            return;
        }
        let timer = self.timer_from[n].plus_ms(pdo.timer_ms.into());
        let free = self.last[n].map_or(Instant::ZERO, |last| {
            last.plus_us(100 * u64::from(pdo.inhibit))
        });
        assert!(now < timer.max(free), "TPDO {n} is overdue");
    }
}
