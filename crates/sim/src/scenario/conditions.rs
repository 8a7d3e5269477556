//! What an event waits for, and how that is seen.

use canopen::nmt::NmtState;
use cia402::State;

use super::frames::{FramePattern, place};
use super::problem::Findings;
use super::quantity::Quantity;
use super::section::{Read, Section, Value};
use crate::drive::VirtualDrive;
use crate::place::Place;

/// How a condition is written.
const FORM: &str = "write { frame = { id = 0x181 } }, { drive = 1, state = \"fault\" } or the like";

/// One row for each kind of condition: key, how its value is written, what it means.
pub const CONDITIONS: &[(&str, &str, &str)] = &[
    (
        "frame",
        "{ id = 0x181, mask = 0x7FF, data = \"27 ??\", from = 1 }",
        "A frame has ended on the wire. `data` are its first bytes, `??` is any byte; `from` is a drive or \"outside\". All four may be left out.",
    ),
    (
        "emergency",
        "0x3220",
        "The drive has sent an emergency message with this error code on 0x080 + node ID.",
    ),
    (
        "position",
        "\"2.5 turns\"",
        "The shaft passes this position, counted from 0 where it starts (unless `load.start` says where that is); `direction` is \"up\", \"down\" or \"either\" (the default).",
    ),
    (
        "speed_above",
        "\"100 rad/s\"",
        "The shaft turns faster than this, in either direction.",
    ),
    (
        "speed_below",
        "\"10 rad/s\"",
        "It turns slower than this, in either direction.",
    ),
    (
        "current_above",
        "\"1 A\"",
        "The amplitude of the phase currents is above this.",
    ),
    ("current_below", "\"50 mA\"", "It is below this."),
    (
        "state",
        "\"operation enabled\"",
        "The drive enters this state of CiA 402. `axis` is the one of several that is looked at, here and above.",
    ),
    ("nmt", "\"operational\"", "The node enters this NMT state."),
];

/// Which way a position is passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    Up,
    Down,
    Either,
}

/// What is looked at in a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sight {
    Position {
        turns: f64,
        direction: Direction,
    },
    /// Above or below, rad/s.
    Speed {
        rad_s: f64,
        above: bool,
    },
    /// Above or below, A.
    Current {
        a: f64,
        above: bool,
    },
    State(State),
    Nmt(NmtState),
}

impl Sight {
    /// Whether it must be looked at in each control period.
    pub(super) fn is_of_the_shaft(self) -> bool {
        !matches!(self, Sight::State(_) | Sight::Nmt(_))
    }
}

/// What an event waits for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Condition {
    Frame(FramePattern),
    /// An emergency message with this error code, of this drive.
    Emergency(Place, u16),
    /// Something is seen in this axis of a drive, from 1.
    Drive(Place, u8, Sight),
}

/// The condition of an event.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct When {
    pub(super) condition: Condition,
    /// The axis that it names, and where.
    pub(super) axis: Option<Read<u8>>,
    /// The drive that it names, and where.
    pub(super) drive: Option<Read<Place>>,
    /// It counts from this time on.
    pub(super) nth: u32,
}

const STATES: [(&str, State); 8] = {
    let mut list = [("", State::Fault); 8];
    let mut n = 0;
    while n < 8 {
        list[n] = (State::ALL[n].name(), State::ALL[n]);
        n += 1;
    }
    list
};

const NMT_STATES: [(&str, NmtState); 3] = [
    ("pre-operational", NmtState::PreOperational),
    ("operational", NmtState::Operational),
    ("stopped", NmtState::Stopped),
];

const DIRECTIONS: [(&str, Direction); 3] = [
    ("up", Direction::Up),
    ("down", Direction::Down),
    ("either", Direction::Either),
];

impl When {
    /// Reads the inline table; `of_event` is the drive that the event acts upon.
    pub(super) fn read(
        value: Value<'_>,
        of_event: Option<&Read<Place>>,
        findings: &mut Findings<'_>,
    ) -> Option<When> {
        let mut section = Section::of(value, "a condition", FORM, findings)?;
        let nth = section.whole("nth", 1..=u64::from(u32::MAX), findings);
        let axis = section.whole("axis", 1..=9, findings);
        let axis = axis.map(|read| read.map(|axis| axis as u8));
        let named = section.take("drive");
        let form = "write a drive, as in 1 or \"u1\"";
        let named = named.and_then(|value| place(value, form, findings));
        let kinds: Vec<&str> = CONDITIONS.iter().map(|(key, ..)| *key).collect();
        let present: Vec<&str> = section
            .entries()
            .iter()
            .filter_map(|(key, ..)| kinds.iter().find(|kind| *kind == key).copied())
            .collect();
        let condition = match present[..] {
            [] => {
                let known = usize::from(named.is_some()) + usize::from(axis.is_some());
                let unknown = section.entries().len() > known;
                if !unknown {
                    let what = "this condition says nothing";
                    findings.push(&section.span, what, FORM);
                }
                for (kind, ..) in CONDITIONS {
                    section.take(kind);
                }
                section.take("direction");
                None
            }
            [kind] => self::condition(kind, &mut section, findings),
            [first, second, ..] => {
                let span = section.key_span(second).unwrap_or(section.span.clone());
                let what = format!("a condition is one thing, and '{first}' is there already");
                findings.push(&span, what, "write an event for each, or leave one out");
                return None;
            }
        };
        let span = section.span.clone();
        let has_kind = condition.is_some();
        section.finish(&if has_kind { kinds } else { vec![] }, findings);
        let kind = condition?;
        if let Kind::Frame(pattern) = kind {
            if let Some(named) = named {
                let what = "a frame has no drive";
                findings.push(
                    &named.span,
                    what,
                    "write from = … in the frame, or leave it out",
                );
                return None;
            }
            return Some(When {
                axis: None,
                drive: pattern.drive(),
                condition: Condition::Frame(pattern),
                nth: nth.map_or(1, |nth| nth.value as u32),
            });
        }
        let Some(drive) = named.or_else(|| of_event.cloned()) else {
            let what = "which drive this condition looks at is missing";
            findings.push(&span, what, "add drive, as in { drive = 1, … }");
            return None;
        };
        let condition = match kind {
            Kind::Frame(_) => return None,
            Kind::Emergency(code) => Condition::Emergency(drive.value, code),
            Kind::Sight(sight) => {
                let axis = axis.as_ref().map_or(1, |axis| axis.value);
                Condition::Drive(drive.value, axis, sight)
            }
        };
        Some(When {
            condition,
            axis,
            drive: Some(drive),
            nth: nth.map_or(1, |nth| nth.value as u32),
        })
    }
}

enum Kind {
    Frame(FramePattern),
    Emergency(u16),
    Sight(Sight),
}

fn condition(
    kind: &'static str,
    section: &mut Section<'_>,
    findings: &mut Findings<'_>,
) -> Option<Kind> {
    let level = |section: &mut Section<'_>, quantity, findings: &mut Findings<'_>| {
        section.quantity(kind, quantity, 0.0..=1e9, findings)
    };
    let sight = match kind {
        "frame" => {
            let value = section.take(kind)?;
            return FramePattern::read(value, true, findings).map(Kind::Frame);
        }
        "emergency" => {
            let code = section.whole(kind, 0..=0xFFFF, findings)?;
            return Some(Kind::Emergency(code.value as u16));
        }
        "position" => {
            let direction = section.word("direction", &DIRECTIONS, findings);
            let turns = section.quantity(kind, Quantity::Position, -2e9..=2e9, findings)?;
            Sight::Position {
                turns: turns.value,
                direction: direction.map_or(Direction::Either, |read| read.value),
            }
        }
        "speed_above" | "speed_below" => Sight::Speed {
            rad_s: level(section, Quantity::Speed, findings)?.value,
            above: kind == "speed_above",
        },
        "current_above" | "current_below" => Sight::Current {
            a: level(section, Quantity::Current, findings)?.value,
            above: kind == "current_above",
        },
        "state" => Sight::State(section.word(kind, &STATES, findings)?.value),
        "nmt" => Sight::Nmt(section.word(kind, &NMT_STATES, findings)?.value),
        _ => unreachable!("a condition without a reader: {kind}"),
    };
    Some(Kind::Sight(sight))
}

/// What was seen at the last look.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Before {
    turns: Option<f64>,
    held: bool,
}

impl Before {
    /// Whether the condition has come true since the last look. A position must have been on the
    /// other side; all else also counts if it is true at the first look.
    pub(super) fn look(&mut self, sight: Sight, drive: &VirtualDrive, axis: usize) -> bool {
        let Some(world) = drive.worlds().get(axis) else {
            return false;
        };
        let holds = match sight {
            Sight::Position { turns, direction } => {
                let now = world.truth().position_turns();
                let Some(before) = self.turns.replace(now) else {
                    return false;
                };
                let up = before < turns && turns <= now;
                let down = before > turns && turns >= now;
                return match direction {
                    Direction::Up => up,
                    Direction::Down => down,
                    Direction::Either => up || down,
                };
            }
            Sight::Speed { rad_s, above } => {
                let speed = f64::from(world.truth().speed_rad_s).abs();
                if above { speed > rad_s } else { speed < rad_s }
            }
            Sight::Current { a, above } => {
                let phases = world.truth().phase_current_a;
                let squares: f64 = phases.iter().map(|i| f64::from(*i).powi(2)).sum();
                let amplitude = (squares * 2.0 / 3.0).sqrt();
                if above { amplitude > a } else { amplitude < a }
            }
            Sight::State(state) => drive
                .core()
                .and_then(|core| core.comms().axes().nth(axis))
                .is_some_and(|axis| axis.state() == state),
            Sight::Nmt(state) => drive
                .core()
                .is_some_and(|core| core.comms().node().state() == state),
        };
        let entered = holds && !self.held;
        self.held = holds;
        entered
    }
}
