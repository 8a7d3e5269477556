//! Mode 7, interpolated position: a buffer of set-points, passed one after the other on straight
//! lines, each in one interpolation period.

use crate::path::{Path, TICK_NS};
use crate::windows::Arrival;
use crate::{Controlword, Demand};

use super::line::{JITTER_DIVISOR, Offsets, towards};
use super::{Bits, Generator, Inputs, Limited};

/// Set-points that the buffer holds at most (0x60C4,1).
pub(crate) const BUFFER_SIZE: u8 = 16;

/// First in, first out (0x60C4,3 = 0).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Buffer {
    records: [i32; BUFFER_SIZE as usize],
    first: u8,
    held: u8,
    /// 0x60C4,6: closed, it takes nothing.
    open: bool,
}

impl Buffer {
    const EMPTY: Buffer = Buffer {
        records: [0; BUFFER_SIZE as usize],
        first: 0,
        held: 0,
        open: true,
    };

    /// Whether there was room.
    fn push(&mut self, record: i32, size: u8) -> bool {
        if !self.open || self.held >= size.min(BUFFER_SIZE) {
            return false;
        }
        let place = (self.first + self.held) % BUFFER_SIZE;
        if let Some(free) = self.records.get_mut(usize::from(place)) {
            *free = record;
            self.held += 1;
        }
        true
    }

    fn pop(&mut self) -> Option<i32> {
        let record = (self.held > 0)
            .then(|| self.records.get(usize::from(self.first)))
            .flatten()?;
        self.first = (self.first + 1) % BUFFER_SIZE;
        self.held -= 1;
        Some(*record)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// Not interpolating: to rest, and held there.
    Waiting { path: Path, begun: bool },
    /// On the way to a set-point. `late` counts the ticks since it was reached with no other there.
    Following { late: u8 },
    /// The velocity limit keeps the demand from its set-point within one period.
    Limited,
    /// The buffer has run empty: held at the last set-point.
    Held,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InterpolatedPosition {
    stage: Stage,
    buffer: Buffer,
    /// Controlword bit 4.
    enabled: bool,
    /// The set-point last taken from the buffer.
    target: i32,
    /// Since the last SYNC, ms.
    since_sync_ms: u16,
    arrival: Arrival,
    reached: bool,
    limited: Limited,
}

impl InterpolatedPosition {
    pub(crate) fn new(word: Controlword, inputs: &Inputs<'_>) -> InterpolatedPosition {
        InterpolatedPosition {
            stage: InterpolatedPosition::waiting(inputs),
            buffer: Buffer::EMPTY,
            enabled: word.enables_interpolation(),
            target: inputs.present.position,
            since_sync_ms: u16::MAX,
            arrival: Arrival::default(),
            reached: false,
            limited: Limited::default(),
        }
    }

    fn waiting(inputs: &Inputs<'_>) -> Stage {
        Stage::Waiting {
            path: Path::stop(&inputs.present, inputs.configuration.slow_down(inputs.mode)),
            begun: false,
        }
    }

    /// Whether SYNC is the clock. It is the drive's own if no SYNC has come for two periods.
    fn has_sync(&self, inputs: &Inputs<'_>) -> bool {
        let period_ms = inputs.configuration.interpolation_ns() / TICK_NS;
        u32::from(self.since_sync_ms) <= period_ms.saturating_mul(2).saturating_add(1)
    }

    /// Whether the next set-point may come into process, `early_ns` before the last one is reached.
    fn is_due(&self, early_ns: u32, inputs: &Inputs<'_>) -> bool {
        self.enabled
            && match self.stage {
                Stage::Waiting { .. } | Stage::Held => true,
                Stage::Following { .. } => inputs.present.left_ns <= early_ns,
                Stage::Limited => false,
            }
    }

    /// The next set-point, if there is one, comes into process. `catches_up`: if more are waiting,
    /// what is left of the last period is not waited for.
    fn take_next(&mut self, catches_up: bool, inputs: &Inputs<'_>) -> Option<Demand> {
        let record = i64::from(self.buffer.pop()?);
        let cut = inputs.configuration.position(record);
        self.limited = Limited {
            above: cut.above(&record),
            below: cut.below(&record),
            ..Limited::default()
        };
        self.target = cut.value as i32;
        self.arrival = Arrival::default();
        self.reached = false;
        // What is left of the last period is added, so that the set-points keep their times.
        let left_ns = match self.stage {
            Stage::Following { .. } if !catches_up || self.buffer.held == 0 => {
                inputs.present.left_ns
            }
            _ => 0,
        };
        let period_ns = inputs.configuration.interpolation_ns();
        Some(self.on(period_ns.saturating_add(left_ns), inputs))
    }

    /// On to the set-point in process.
    fn on(&mut self, period_ns: u32, inputs: &Inputs<'_>) -> Demand {
        let (demand, limited) = towards(self.target, period_ns, Offsets::NONE, inputs);
        self.stage = if limited {
            Stage::Limited
        } else {
            Stage::Following { late: 0 }
        };
        demand
    }
}

impl Generator for InterpolatedPosition {
    fn begin(&self) -> Demand {
        match &self.stage {
            Stage::Waiting { path, .. } => path.begin(),
            _ => Demand::Idle,
        }
    }

    fn controlword(&mut self, _before: Controlword, now: Controlword, inputs: &Inputs<'_>) {
        let enabled = now.enables_interpolation();
        if self.enabled && !enabled && !matches!(self.stage, Stage::Waiting { .. }) {
            self.stage = InterpolatedPosition::waiting(inputs);
        }
        self.enabled = enabled;
    }

    /// A set-point that comes with a SYNC is in the buffer already.
    fn sync(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        let period_ns = inputs.configuration.interpolation_ns();
        // One SYNC a set-point: it sets the pace, so that none pile up. Not if it is much faster.
        let is_beat = u32::from(self.since_sync_ms).saturating_mul(2) >= period_ns / TICK_NS;
        self.since_sync_ms = 0;
        self.is_due(period_ns / JITTER_DIVISOR, inputs)
            .then(|| self.take_next(is_beat, inputs))
            .flatten()
    }

    fn tick(&mut self, inputs: &Inputs<'_>) -> Option<Demand> {
        self.since_sync_ms = self.since_sync_ms.saturating_add(1);
        let error = self.target.wrapping_sub(inputs.actual.position);
        self.reached = self.arrival.tick(
            inputs.configuration.position_window,
            self.stage == Stage::Held,
            f64::from(error).abs(),
        );
        if !self.has_sync(inputs)
            && self.is_due(TICK_NS / 2, inputs)
            && let Some(demand) = self.take_next(false, inputs)
        {
            return Some(demand);
        }
        match &mut self.stage {
            Stage::Waiting { path, begun } => {
                if !*begun {
                    path.resume(&inputs.present, inputs.configuration.slow_down(inputs.mode));
                    *begun = true;
                }
                Some(path.tick())
            }
            Stage::Following { late } => {
                if inputs.present.left_ns > 0 {
                    return None;
                }
                // What is buffered does not wait for a late SYNC, and a successor may be late by a
                // tick.
                *late = late.saturating_add(1);
                let is_late = *late > 1;
                let next = self
                    .enabled
                    .then(|| self.take_next(false, inputs))
                    .flatten();
                if next.is_none() && is_late {
                    self.stage = Stage::Held;
                }
                next
            }
            Stage::Limited => Some(self.on(TICK_NS, inputs)),
            Stage::Held => None,
        }
    }

    /// On to the next set-point, from where the axis stands.
    fn resume(&mut self, inputs: &Inputs<'_>) {
        self.stage = InterpolatedPosition::waiting(inputs);
        self.arrival = Arrival::default();
        self.reached = false;
    }

    fn push(&mut self, record: i32, inputs: &Inputs<'_>) -> bool {
        self.buffer
            .push(record, inputs.configuration.interpolation_buffer)
    }

    fn clear(&mut self, open: bool) {
        self.buffer = Buffer {
            open,
            ..Buffer::EMPTY
        };
    }

    fn buffered(&self) -> u8 {
        self.buffer.held
    }

    /// Buffered set-points count in the new positions.
    fn shift(&mut self, offset: i32) {
        self.target = self.target.wrapping_add(offset);
        if let Stage::Waiting { path, .. } = &mut self.stage {
            path.shift(offset);
        }
    }

    fn bits(&self) -> Bits {
        Bits {
            target_reached: self.reached,
            specific: matches!(self.stage, Stage::Following { .. } | Stage::Limited),
        }
    }

    fn limited(&self) -> Limited {
        Limited {
            velocity: self.stage == Stage::Limited,
            ..self.limited
        }
    }
}
