//! Positions at edges of digital inputs and at the encoder's index, exact to the control period.

/// How many latches a drive has: homing, touch probe 1, touch probe 2.
pub const LATCHES: usize = 3;

/// What a latch waits for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trigger {
    /// The inputs to look at, a bit each in the order of [`crate::io::Signals::inputs`]; 0: none.
    pub inputs: u32,
    /// An input's becoming active counts.
    pub rising: bool,
    /// An input's becoming inactive counts.
    pub falling: bool,
    /// The index pulse counts: with `inputs` only after their edge, without them at any time.
    pub index: bool,
    /// Every edge is captured, not the first alone.
    pub continuous: bool,
    /// Tells triggers apart: what a latch shows belongs to the trigger of this number.
    pub serial: u8,
}

/// What a latch has captured since its trigger was set: positions in the user's direction, as they
/// are called now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Latched {
    /// Of the trigger.
    pub serial: u8,
    /// How many rising edges there were, wrapping; what was captured is that of the last one, or of
    /// the first if the trigger is not continuous.
    pub rising_count: u16,
    /// The same of falling edges.
    pub falling_count: u16,
    /// The same of index pulses.
    pub index_count: u16,
    /// Position at a rising edge, counts.
    pub rising: i32,
    /// Position at a falling edge, counts.
    pub falling: i32,
    /// Position of an index pulse, counts: exact, however fast the rotor turns.
    pub index: i32,
}

/// What the captures tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seen {
    /// The inputs that are active, in the order of [`crate::io::Signals::inputs`].
    pub active: u32,
    /// What each latch has captured.
    pub latches: [Latched; LATCHES],
}

impl Seen {
    /// All positions have become `offset` counts greater.
    pub fn rename(&mut self, offset: i32) {
        for latched in &mut self.latches {
            latched.each_position(|position| position.wrapping_add(offset));
        }
    }
}

impl Latched {
    fn each_position(&mut self, name: impl Fn(i32) -> i32) {
        self.rising = name(self.rising);
        self.falling = name(self.falling);
        self.index = name(self.index);
    }
}

/// The inputs there are: bits 0 to 3 are switches, 16 to 19 the general inputs.
const SWITCHES: u32 = 0x0000_000F;
const GENERAL: u32 = 0x000F_0000;
const INPUTS: usize = 8;

/// An input that has changed and may be bouncing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Change {
    /// Position when it first left its old level.
    position: i32,
    /// The first index pulse since.
    index: Option<i32>,
    /// Periods since its level last changed.
    quiet: u16,
}

/// The captures of one drive, beside its loops. Looks at the inputs once per control period.
///
/// The position of an edge is the encoder's reading of the first period in which the input has
/// changed: at a speed of v counts/s it is late by less than v times the period. An input that
/// bounces has changed when it has kept its new level for the filter time, and the position is that
/// of its first bounce all the same. The index is the encoder's count 0; where it was passed follows
/// from the readings before and after.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Captures {
    inverted: u32,
    /// Of the switches and of the general inputs, control periods.
    filter: [u16; 2],
    counts_per_turn: i32,
    polarity: i32,
    triggers: [Trigger; LATCHES],
    latches: [Latched; LATCHES],
    started: bool,
    /// As read in the last period.
    levels: u32,
    /// Active, after the filter.
    active: u32,
    /// The inputs that may be bouncing.
    changing: u32,
    changes: [Change; INPUTS],
    encoder: i32,
    /// An index pulse may count.
    wants_index: bool,
}

impl Captures {
    /// Nothing is waited for. Set the encoder before the first period.
    pub fn new() -> Captures {
        Captures {
            inverted: 0,
            filter: [0; 2],
            counts_per_turn: 0,
            polarity: 1,
            triggers: [Trigger::default(); LATCHES],
            latches: [Latched::default(); LATCHES],
            started: false,
            levels: 0,
            active: 0,
            changing: 0,
            changes: [Change::default(); INPUTS],
            encoder: 0,
            wants_index: false,
        }
    }

    /// The encoder's counts per turn, and the user's direction against its own, 1 or −1. Another
    /// direction negates what was captured, as it does the position.
    pub fn set_encoder(&mut self, counts_per_turn: i32, polarity: i32) {
        if polarity != self.polarity {
            self.each_position(i32::wrapping_neg);
        }
        self.counts_per_turn = counts_per_turn;
        self.polarity = polarity;
    }

    /// The inputs that are active when their level is low, a bit each. A change of these is no edge.
    pub fn set_inverted(&mut self, inverted: u32) {
        let turned = (self.inverted ^ inverted) & (SWITCHES | GENERAL);
        self.levels ^= turned;
        self.active ^= turned;
        self.changing &= !turned;
        self.inverted = inverted;
    }

    /// For how many control periods a switch, and a general input, must keep its level after a
    /// change; 0: it need not.
    pub fn set_filter(&mut self, switches: u16, general: u16) {
        self.filter = [switches, general];
    }

    /// Sets a trigger, 0 to [`LATCHES`] − 1, and forgets what its latch has captured.
    pub fn set_trigger(&mut self, latch: usize, trigger: Trigger) {
        if let (Some(old), Some(latched)) =
            (self.triggers.get_mut(latch), self.latches.get_mut(latch))
        {
            *old = trigger;
            *latched = Latched {
                serial: trigger.serial,
                ..Latched::default()
            };
            self.wants_index = self.triggers.iter().any(|trigger| trigger.index);
        }
    }

    /// What is active and what has been captured, as of the last period.
    pub fn seen(&self) -> Seen {
        Seen {
            active: self.active,
            latches: self.latches,
        }
    }

    /// All positions have become `offset` counts greater, those captured as well.
    pub fn rename(&mut self, offset: i32) {
        self.each_position(|position| position.wrapping_add(offset));
    }

    /// Gives every position another name, those of inputs that are still bouncing as well.
    fn each_position(&mut self, name: impl Fn(i32) -> i32) {
        for latched in &mut self.latches {
            latched.each_position(&name);
        }
        for change in &mut self.changes {
            change.position = name(change.position);
            change.index = change.index.map(&name);
        }
    }

    /// One control period: the levels of the inputs, the encoder's reading within one turn, and the
    /// position that belongs to it.
    #[inline]
    pub fn period(&mut self, levels: u32, encoder: i32, position: i32) {
        let levels = (levels ^ self.inverted) & (SWITCHES | GENERAL);
        if levels != self.levels || self.changing != 0 || self.wants_index || !self.started {
            self.look(levels, encoder, position);
        }
        self.levels = levels;
        self.encoder = encoder;
    }

    fn look(&mut self, levels: u32, encoder: i32, position: i32) {
        if !core::mem::replace(&mut self.started, true) {
            self.active = levels;
            return;
        }
        let index = self
            .past_index(encoder)
            .map(|past| position.wrapping_sub(past.wrapping_mul(self.polarity)));
        // Within one period the order of edge and index is not known; the index is then taken to be
        // before the edge.
        for (trigger, latched) in self.triggers.iter().zip(&mut self.latches) {
            let waits =
                trigger.inputs != 0 && latched.rising_count == 0 && latched.falling_count == 0;
            if let Some(index) = index
                && trigger.index
                && !waits
            {
                latched.index(index, trigger);
            }
        }
        if levels == self.active && self.changing == 0 {
            return;
        }
        let [switches, general] = self.filter;
        let bits = (0..4).chain(16..20).map(|bit| 1u32 << bit);
        for (bit, change) in bits.zip(&mut self.changes) {
            if self.changing & bit == 0 {
                if (levels ^ self.active) & bit == 0 {
                    continue;
                }
                self.changing |= bit;
                *change = Change {
                    position,
                    ..Change::default()
                };
            } else {
                change.index = change.index.or(index);
                change.quiet = match (levels ^ self.levels) & bit {
                    0 => change.quiet.saturating_add(1),
                    _ => 0,
                };
            }
            let filter = if bit & SWITCHES != 0 {
                switches
            } else {
                general
            };
            if change.quiet < filter {
                continue;
            }
            self.changing &= !bit;
            if (levels ^ self.active) & bit == 0 {
                continue;
            }
            self.active ^= bit;
            let rises = levels & bit != 0;
            for (trigger, latched) in self.triggers.iter().zip(&mut self.latches) {
                if trigger.inputs & bit != 0 {
                    latched.edge(rises, change, trigger);
                }
            }
        }
    }

    /// How many of the encoder's counts the rotor has gone beyond its count 0, if it has come to it
    /// or passed it since the last reading.
    fn past_index(&self, encoder: i32) -> Option<i32> {
        let turn = self.counts_per_turn;
        let jump = encoder.wrapping_sub(self.encoder);
        let moved = if jump > turn / 2 {
            jump.wrapping_sub(turn)
        } else if jump < -(turn / 2) {
            jump.wrapping_add(turn)
        } else {
            jump
        };
        if moved > 0 && encoder < moved {
            Some(encoder)
        } else if moved < 0 && encoder == 0 {
            Some(0)
        } else if moved < 0 && encoder.wrapping_sub(moved) > turn {
            Some(encoder.wrapping_sub(turn))
        } else {
            None
        }
    }
}

impl Default for Captures {
    fn default() -> Captures {
        Captures::new()
    }
}

impl Latched {
    fn edge(&mut self, rises: bool, change: &Change, trigger: &Trigger) {
        let is_first = self.rising_count == 0 && self.falling_count == 0;
        let (wanted, place, count) = if rises {
            (trigger.rising, &mut self.rising, &mut self.rising_count)
        } else {
            (trigger.falling, &mut self.falling, &mut self.falling_count)
        };
        if !wanted {
            return;
        }
        capture(place, count, change.position, trigger.continuous);
        if let Some(index) = change.index
            && trigger.index
            && is_first
        {
            self.index(index, trigger);
        }
    }

    fn index(&mut self, position: i32, trigger: &Trigger) {
        capture(
            &mut self.index,
            &mut self.index_count,
            position,
            trigger.continuous,
        );
    }
}

fn capture(place: &mut i32, count: &mut u16, position: i32, continuous: bool) {
    if *count == 0 || continuous {
        *place = position;
    }
    *count = count.wrapping_add(1);
    // The first stays the first, however many follow.
    if *count == 0 && !continuous {
        *count = 1;
    }
}
