//! Whether a target was reached, judged by what the drive says on the bus.

use can::Frame;
use canopen::{Instant, NodeId};
use cia402::{State, Statusword};
use client::Value;
use client::axis::Goal;
use client::pdo::Pdo;

/// What a drive's cyclic feedback (TPDO1) said.
#[derive(Clone, Copy, Debug)]
pub(super) struct Feedback {
    pub(super) at: Instant,
    pub(super) frame: Frame,
    pub(super) statusword: Statusword,
    pub(super) position: i32,
    /// Actual current or torque.
    third: i16,
}

impl Feedback {
    fn read(pdo: &Pdo, at: Instant, frame: &Frame) -> Option<Feedback> {
        match pdo.values(frame)?[..] {
            [
                Value::Integer(word),
                Value::Integer(position),
                Value::Integer(third),
            ] => Some(Feedback {
                at,
                frame: *frame,
                statusword: Statusword(word as u16),
                position: position as i32,
                third: third as i16,
            }),
            _ => None,
        }
    }
}

/// What shows that a target is reached, besides the actual value in its window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sign {
    /// Statusword bit 10.
    TargetReached,
    /// Cyclic position mode has no bit 10: the drive follows (bit 12) without following error
    /// (bit 13).
    Follows,
    /// Statusword bit 10, and the shaft stands at this position.
    TargetReachedAt(i32),
}

/// How far a shaft may stray that is held, counts.
const STANDSTILL_COUNTS: u32 = 2;

/// Watches one drive's feedback for its goal.
#[derive(Clone, Debug)]
pub(super) struct Watch<'a> {
    pdo: &'a Pdo,
    goal: Goal,
    sign: Sign,
    /// For how long it must hold, ns.
    hold_ns: u64,
    /// Since when it has held.
    since: Option<Instant>,
    pub(super) last: Option<Feedback>,
}

impl<'a> Watch<'a> {
    pub(super) fn new(pdo: &'a Pdo, goal: Goal, sign: Sign, hold_ms: u64) -> Watch<'a> {
        Watch {
            pdo,
            goal,
            sign,
            hold_ns: hold_ms * 1_000_000,
            since: None,
            last: None,
        }
    }

    /// Whose feedback it watches.
    pub(super) fn node(&self) -> NodeId {
        self.pdo.node
    }

    /// Takes a frame; others than the drive's feedback change nothing.
    pub(super) fn see(&mut self, at: Instant, frame: &Frame) {
        let Some(feedback) = Feedback::read(self.pdo, at, frame) else {
            return;
        };
        self.last = Some(feedback);
        if self.holds(&feedback) {
            self.since.get_or_insert(at);
        } else {
            self.since = None;
        }
    }

    fn holds(&self, feedback: &Feedback) -> bool {
        let word = feedback.statusword;
        let actual = match self.goal {
            Goal::Torque { .. } => i64::from(feedback.third),
            _ => i64::from(feedback.position),
        };
        let shown = match self.sign {
            Sign::TargetReached => word.target_reached(),
            Sign::Follows => word.follows_command() && !word.following_error(),
            Sign::TargetReachedAt(position) => {
                let stands = Goal::Position {
                    target: position,
                    window: STANDSTILL_COUNTS,
                };
                word.target_reached() && stands.holds(i64::from(feedback.position))
            }
        };
        word.state() == Some(State::OperationEnabled) && shown && self.goal.holds(actual)
    }

    /// Since when the goal has been held, once that is long enough.
    pub(super) fn reached(&self) -> Option<Instant> {
        let (since, last) = (self.since?, self.last?);
        (last.at.since_ns(since) >= self.hold_ns).then_some(since)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::cast::{Actor, MOVER};

    const GOAL: Goal = Goal::Position {
        target: 1000,
        window: 20,
    };

    /// Feeds (ms, statusword, position) and gives the time at which the target was reached.
    fn reached(sign: Sign, feedback: &[(u64, i64, i64)]) -> Option<u64> {
        let actor = Actor::of(MOVER);
        let mut watch = Watch::new(&actor.feedback, GOAL, sign, 2);
        for (ms, word, position) in feedback {
            let values = [*word, *position, 0].map(Value::Integer);
            let frame = actor.feedback.frame(&values).unwrap();
            watch.see(Instant::ZERO.plus_ms(*ms), &frame);
            watch.see(
                Instant::ZERO.plus_ms(*ms),
                &Frame::classic(0x181, [0xFF; 8], 7),
            );
        }
        watch.reached().map(|at| at.0 / 1_000_000)
    }

    #[test]
    fn a_target_must_hold() {
        // 0x0437: operation enabled, voltage, target reached.
        let sign = Sign::TargetReached;
        assert_eq!(reached(sign, &[(1, 0x437, 980), (2, 0x437, 1020)]), None);
        assert_eq!(reached(sign, &[(1, 0x437, 980), (3, 0x437, 1020)]), Some(1));
        assert_eq!(
            reached(
                sign,
                &[
                    (1, 0x437, 1000),
                    (2, 0x437, 1021),
                    (3, 0x437, 1000),
                    (5, 0x437, 1000)
                ]
            ),
            Some(3)
        );
    }

    #[test]
    fn a_value_in_its_window_is_not_enough() {
        let held = |word| [(1, word, 1000), (4, word, 1000)];
        // No bit 10; not in operation enabled.
        assert_eq!(reached(Sign::TargetReached, &held(0x0037)), None);
        assert_eq!(reached(Sign::TargetReached, &held(0x0431)), None);
        // Bit 12 without and with bit 13.
        assert_eq!(reached(Sign::Follows, &held(0x1037)), Some(1));
        assert_eq!(reached(Sign::Follows, &held(0x3037)), None);
        // The shaft does not stand where it should.
        assert_eq!(reached(Sign::TargetReachedAt(1002), &held(0x0437)), Some(1));
        assert_eq!(reached(Sign::TargetReachedAt(1003), &held(0x0437)), None);
    }
}
