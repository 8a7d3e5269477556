//! Error counters and the states that follow from them (ISO 11898-1, fault confinement). The rules
//! are lettered as the standard's list has them.

/// From here on a participant is error passive.
const PASSIVE_FROM: u16 = 128;
/// From here on the wire is called heavily disturbed.
const WARNING_FROM: u16 = 96;
/// Beyond this transmit error counter a participant is bus-off.
const BUS_OFF_BEYOND: u16 = 255;
/// What a receive error counter beyond 127 becomes with a good frame: the standard leaves 119 to
/// 127 open.
const RECEIVE_AFTER_PASSIVE: u16 = 119;
/// A receive error counter stays here: the standard ends counting at error passive, and controllers
/// have eight bits for it.
const MOST_RECEIVE: u16 = 255;

/// How far a participant may disturb others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ErrorState {
    /// It destroys what it finds wrong.
    #[default]
    Active,
    /// It finds many errors, so it only marks them for itself, and waits before it sends again.
    Passive,
    /// It takes no part until it has seen 128 times 11 recessive bits.
    BusOff,
}

/// A participant's error counters (ISO 11898-1, fault confinement).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ErrorCounters {
    /// Transmit error counter. 256 to 263 while it is bus-off.
    pub transmit: u16,
    /// Receive error counter, at most 255.
    pub receive: u16,
}

/// An error as the counters see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Counted {
    /// A receiver has found one (a).
    Receive,
    /// A receiver has found one by a dominant bit right behind its error flag (b), or was disturbed
    /// while it sent an active flag (e), or sees dominant bits without end (f).
    ReceiveGrave,
    /// A transmitter has found one (c), or was disturbed in its active flag (d), or sees dominant
    /// bits without end (f).
    Transmit,
}

impl ErrorCounters {
    /// The state that follows from them.
    #[inline]
    pub fn state(&self) -> ErrorState {
        if self.transmit > BUS_OFF_BEYOND {
            ErrorState::BusOff
        } else if self.transmit >= PASSIVE_FROM || self.receive >= PASSIVE_FROM {
            ErrorState::Passive
        } else {
            ErrorState::Active
        }
    }

    /// Whether it takes no part.
    #[inline]
    pub fn is_bus_off(&self) -> bool {
        self.state() == ErrorState::BusOff
    }

    /// Whether it is error passive.
    #[inline]
    pub fn is_passive(&self) -> bool {
        self.state() == ErrorState::Passive
    }

    /// Whether one of them has come to 96, the error warning limit.
    pub fn is_warning(&self) -> bool {
        self.transmit >= WARNING_FROM || self.receive >= WARNING_FROM
    }

    /// A frame was sent, acknowledge and end of frame included (g).
    #[inline]
    pub(crate) fn transmitted(&mut self) {
        self.transmit = self.transmit.saturating_sub(1);
    }

    /// A frame was received up to the acknowledge, and acknowledged (h).
    #[inline]
    pub(crate) fn received(&mut self) {
        self.receive = match self.receive {
            0 => 0,
            less @ 1..PASSIVE_FROM => less - 1,
            _ => RECEIVE_AFTER_PASSIVE,
        };
    }

    /// There was an error.
    pub(crate) fn count(&mut self, error: Counted) {
        match error {
            Counted::Receive => self.receive = (self.receive + 1).min(MOST_RECEIVE),
            Counted::ReceiveGrave => self.receive = (self.receive + 8).min(MOST_RECEIVE),
            Counted::Transmit if !self.is_bus_off() => self.transmit += 8,
            Counted::Transmit => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn counters(transmit: u16, receive: u16) -> ErrorCounters {
        ErrorCounters { transmit, receive }
    }

    #[test]
    fn states_by_their_limits() {
        use ErrorState::{Active, BusOff, Passive};
        for (transmit, receive, state, warning) in [
            (0, 0, Active, false),
            (95, 95, Active, false),
            (96, 0, Active, true),
            (0, 96, Active, true),
            (127, 127, Active, true),
            (128, 0, Passive, true),
            (0, 128, Passive, true),
            (255, 255, Passive, true),
            (256, 0, BusOff, true),
            (263, 255, BusOff, true),
        ] {
            let counters = counters(transmit, receive);
            assert_eq!(counters.state(), state, "{counters:?}");
            assert_eq!(counters.is_warning(), warning, "{counters:?}");
        }
    }

    #[test]
    fn each_event_counts_as_the_standard_says() {
        let event = |from: (u16, u16), what: Option<Counted>, sent: bool| {
            let mut counters = counters(from.0, from.1);
            match what {
                Some(error) => counters.count(error),
                None if sent => counters.transmitted(),
                None => counters.received(),
            }
            (counters.transmit, counters.receive)
        };
        for (from, what, sent, to) in [
            ((0, 0), None, true, (0, 0)),
            ((1, 5), None, true, (0, 5)),
            ((128, 5), None, true, (127, 5)),
            ((5, 0), None, false, (5, 0)),
            ((5, 1), None, false, (5, 0)),
            ((5, 127), None, false, (5, 126)),
            ((5, 128), None, false, (5, 119)),
            ((5, 255), None, false, (5, 119)),
            ((0, 0), Some(Counted::Receive), false, (0, 1)),
            ((0, 127), Some(Counted::Receive), false, (0, 128)),
            ((0, 255), Some(Counted::Receive), false, (0, 255)),
            ((0, 0), Some(Counted::ReceiveGrave), false, (0, 8)),
            ((0, 250), Some(Counted::ReceiveGrave), false, (0, 255)),
            ((0, 3), Some(Counted::Transmit), false, (8, 3)),
            ((248, 3), Some(Counted::Transmit), false, (256, 3)),
            ((256, 3), Some(Counted::Transmit), false, (256, 3)),
        ] {
            assert_eq!(event(from, what, sent), to, "{from:?} {what:?} sent {sent}");
        }
    }

    proptest! {
        #[test]
        fn counters_stay_in_their_ranges(events in prop::collection::vec(0_u8..5, 0..2_000)) {
            let mut counters = ErrorCounters::default();
            for event in events {
                match event {
                    0 => counters.transmitted(),
                    1 => counters.received(),
                    2 => counters.count(Counted::Receive),
                    3 => counters.count(Counted::ReceiveGrave),
                    _ => counters.count(Counted::Transmit),
                }
                prop_assert!(counters.transmit <= 263 && counters.receive <= 255);
            }
        }
    }
}
