//! Plays the events of a scenario: what is waited for, what is due, what has happened.

use std::collections::BTreeSet;
use std::sync::Arc;

use can::Frame;
use canopen::Instant;

use super::Scenario;
use super::acts::Act;
use super::check::watched_place;
use super::conditions::{Before, Condition};
use super::event::{Event, Target, Times, Trigger};
use crate::drive::VirtualDrive;
use crate::medium::Sender;

/// The events of a scenario while a bus runs.
///
/// An event with a time is due from the start. The others are set off by what [`Runner::see`] and
/// [`Runner::look`] are shown; what is due is then taken with [`Runner::take_due`], ends of acts
/// before acts, and of several events at one time the first in the file.
#[derive(Debug)]
pub(crate) struct Runner {
    events: Arc<[Event]>,
    states: Vec<State>,
    queue: BTreeSet<Due>,
}

/// How far an event has come.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    before: Before,
    /// How often its condition was seen.
    seen: u32,
    /// How often it was set off.
    set_off: u32,
    /// How often it has happened.
    happened: u32,
}

/// Something that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Due {
    at: Instant,
    what: What,
    event: usize,
    /// Which happening of the event.
    number: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum What {
    End,
    Act,
}

/// Something to be done now.
#[derive(Clone, Debug)]
pub(crate) struct Doing {
    /// `event "sag" (line 14)`.
    pub(crate) title: String,
    pub(super) target: Target,
    pub(super) axis: Option<u8>,
    pub(super) act: Act,
    pub(super) lasts_ns: u64,
}

impl Runner {
    pub(crate) fn new(scenario: &Scenario) -> Runner {
        let events = Arc::clone(&scenario.events);
        let mut runner = Runner {
            states: vec![State::default(); events.len()],
            queue: BTreeSet::new(),
            events,
        };
        for n in 0..runner.events.len() {
            if let Trigger::At(at) = runner.events[n].trigger {
                runner.set_off(n, Instant(at));
            }
        }
        runner
    }

    /// When something is due next.
    pub(crate) fn next_due(&self) -> Instant {
        self.queue.first().map_or(Instant::NEVER, |due| due.at)
    }

    /// When the drives must be looked at next beside the times of all other events: at each control
    /// boundary of those whose shaft an event waits for.
    pub(crate) fn next_look(&self, drives: &[VirtualDrive]) -> Instant {
        let mut next = Instant::NEVER;
        for (n, event) in self.events.iter().enumerate() {
            let Some(place) = watched_place(event).filter(|_| self.waits(n)) else {
                continue;
            };
            for drive in drives.iter().filter(|drive| drive.place() == place) {
                next = next.min(drive.next_control());
            }
        }
        next
    }

    /// A frame has ended on the wire.
    pub(crate) fn see(&mut self, frame: &Frame, senders: &[Sender], now: Instant) {
        for n in 0..self.events.len() {
            if !self.waits(n) {
                continue;
            }
            let Trigger::When(when) = &self.events[n].trigger else {
                continue;
            };
            let seen = match &when.condition {
                Condition::Frame(pattern) => pattern.matches(frame, senders),
                Condition::Emergency(place, code) => {
                    let id = frame.raw_id();
                    let is_emergency = !frame.is_extended() && id & 0x780 == 0x080 && id != 0x080;
                    let of_drive = senders.contains(&Sender::Drive(*place));
                    is_emergency && of_drive && frame.data().starts_with(&code.to_le_bytes())
                }
                Condition::Drive(..) => false,
            };
            if seen {
                self.seen(n, now);
            }
        }
    }

    /// Looks at the drives.
    pub(crate) fn look(&mut self, drives: &[VirtualDrive], now: Instant) {
        for n in 0..self.events.len() {
            let Trigger::When(when) = &self.events[n].trigger else {
                continue;
            };
            let Condition::Drive(place, axis, sight) = when.condition else {
                continue;
            };
            let drive = drives.iter().find(|drive| drive.place() == place);
            if let Some(drive) = drive.filter(|_| self.waits(n))
                && self.states[n]
                    .before
                    .look(sight, drive, usize::from(axis.max(1) - 1))
            {
                self.seen(n, now);
            }
        }
    }

    /// The next thing to be done now.
    pub(crate) fn take_due(&mut self, now: Instant) -> Option<Doing> {
        let due = *self.queue.first().filter(|due| due.at <= now)?;
        self.queue.pop_first();
        let events = Arc::clone(&self.events);
        let event = events.get(due.event)?;
        let title = format!("{} (line {})", event.name, event.line);
        if due.what == What::End {
            return Some(Doing {
                title: format!("{title} is over"),
                target: event.target.value,
                axis: event.axis.as_ref().map(|axis| axis.value),
                act: event.undo.clone()?,
                lasts_ns: 0,
            });
        }
        let state = &mut self.states[due.event];
        state.happened += 1;
        let number = state.happened;
        if let Some(lasts_ns) = event.lasts_ns
            && event.undo.is_some()
        {
            // It goes on if it still lasts from the last time.
            self.queue
                .retain(|other| other.event != due.event || other.what != What::End);
            self.queue.insert(Due {
                at: due.at.plus_ns(lasts_ns),
                what: What::End,
                event: due.event,
                number,
            });
        }
        let more = match event.times {
            Times::Always => true,
            Times::Number(times) => number < times,
        };
        if let Some(every_ns) = event.every_ns.filter(|_| more) {
            self.queue.insert(Due {
                at: due.at.plus_ns(every_ns),
                what: What::Act,
                event: due.event,
                number,
            });
        }
        for (n, other) in events.iter().enumerate() {
            if other.trigger == Trigger::After(due.event) && self.waits(n) {
                self.set_off(n, now);
            }
        }
        Some(Doing {
            title,
            target: event.target.value,
            axis: event.axis.as_ref().map(|axis| axis.value),
            act: event.act.clone(),
            lasts_ns: event.lasts_ns.unwrap_or(0),
        })
    }

    /// Whether an event can still be set off.
    fn waits(&self, n: usize) -> bool {
        let (event, state) = (&self.events[n], &self.states[n]);
        match (event.every_ns, event.times) {
            // Repeats follow by themselves.
            (Some(_), _) => state.set_off == 0,
            (None, Times::Always) => true,
            (None, Times::Number(times)) => state.set_off < times,
        }
    }

    fn seen(&mut self, n: usize, now: Instant) {
        let Trigger::When(when) = &self.events[n].trigger else {
            return;
        };
        let nth = when.nth;
        let state = &mut self.states[n];
        state.seen = state.seen.saturating_add(1);
        if state.seen >= nth {
            self.set_off(n, now);
        }
    }

    fn set_off(&mut self, n: usize, now: Instant) {
        let state = &mut self.states[n];
        state.set_off = state.set_off.saturating_add(1);
        self.queue.insert(Due {
            at: now.plus_ns(self.events[n].delay_ns),
            what: What::Act,
            event: n,
            number: state.set_off,
        });
    }
}
