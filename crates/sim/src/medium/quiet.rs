//! What becomes of a controller by time alone: while the wire is recessive, and by frames that are
//! good as a whole. Nothing here looks at bits.

use canopen::Instant;

use super::protocol::{
    INTEGRATION_BITS, INTERMISSION_BITS, Protocol, RECOVERY_SEQUENCES, SUSPEND_BITS, State,
};
use crate::medium::ErrorCounters;

impl Protocol {
    /// It starts, and must find out first whether the wire is free.
    pub(crate) fn start(&mut self, now: Instant) {
        *self = Protocol::new();
        self.state = State::Integrating(0);
        self.since = now;
    }

    /// It is without power from now on.
    pub(crate) fn stop(&mut self) {
        *self = Protocol::new();
    }

    /// Whether it has power.
    #[inline]
    pub(crate) fn is_on(&self) -> bool {
        self.state != State::Off
    }

    /// Whether it may send now.
    #[inline]
    pub(crate) fn is_idle(&self) -> bool {
        self.state == State::Idle
    }

    /// Whether it waits for recessive bits, or for nothing at all.
    #[inline]
    pub(crate) fn is_at_rest(&self) -> bool {
        matches!(
            self.state,
            State::Off
                | State::Idle
                | State::Integrating(_)
                | State::Suspended(_)
                | State::BusOff { .. }
        )
    }

    /// Whether it has taken part in a frame that began then and was good for all.
    #[inline]
    pub(crate) fn follows(&self, began: Instant) -> bool {
        self.state == State::Idle && self.since <= began
    }

    /// When it comes out of its state if the wire stays recessive; never: it does not.
    pub(crate) fn rests_until(&self, bit_ns: u64) -> Instant {
        let bits = match self.state {
            State::Integrating(run) => INTEGRATION_BITS - u64::from(run),
            State::Suspended(run) => SUSPEND_BITS - u64::from(run),
            State::BusOff { sequences, run } => {
                (RECOVERY_SEQUENCES - u64::from(sequences)) * INTEGRATION_BITS - u64::from(run)
            }
            _ => return Instant::NEVER,
        };
        self.since.plus_ns(bits * bit_ns)
    }

    /// The wire has been recessive up to now. Whether it has recovered from bus-off by that.
    pub(crate) fn rest(&mut self, now: Instant, bit_ns: u64) -> bool {
        if self.state == State::Idle || self.state == State::Off {
            return false;
        }
        let until = self.rests_until(bit_ns);
        if now >= until && until != Instant::NEVER {
            let recovered = matches!(self.state, State::BusOff { .. });
            if recovered {
                self.counters = ErrorCounters::default();
            }
            (self.state, self.since) = (State::Idle, until);
            return recovered;
        }
        let bits = now.since_ns(self.since) / bit_ns;
        self.since = self.since.plus_ns(bits * bit_ns);
        match &mut self.state {
            State::Integrating(run) | State::Suspended(run) => *run += bits as u8,
            State::BusOff { sequences, run } => {
                let all = u64::from(*run) + bits;
                *sequences += (all / INTEGRATION_BITS) as u8;
                *run = (all % INTEGRATION_BITS) as u8;
            }
            _ => {}
        }
        false
    }

    /// A frame begins that is good as a whole, or traffic that is looked at bit by bit: nothing
    /// comes from time alone now.
    pub(crate) fn hold(&mut self, now: Instant) {
        match self.state {
            State::Idle | State::Off => {}
            // It receives what others send meanwhile.
            State::Suspended(_) => (self.state, self.since) = (State::Idle, now),
            _ => self.since = Instant::NEVER,
        }
    }

    /// A frame that was good as a whole has ended; `sent`: it was its transmitter. What follows is
    /// recessive.
    #[inline]
    pub(crate) fn finish(&mut self, sent: bool, ended: Instant, bit_ns: u64) {
        if self.state != State::Idle {
            self.finish_elsewhere(ended, bit_ns);
        } else {
            self.transmitter = sent;
            if !sent {
                self.counters.received();
                return;
            }
            self.counters.transmitted();
            if self.counters.is_passive() {
                self.state = State::Suspended(0);
                self.since = ended.plus_ns(u64::from(INTERMISSION_BITS) * bit_ns);
            }
        }
    }

    /// The same for who has not taken part in the frame: what it has read of its end.
    fn finish_elsewhere(&mut self, ended: Instant, bit_ns: u64) {
        // Acknowledge delimiter and end of frame, as far as it was there.
        let bits = match self.since {
            Instant::NEVER => 8,
            since => (ended.since_ns(since) / bit_ns).min(8) as u8,
        };
        match self.state {
            State::Integrating(_) => (self.state, self.since) = (State::Integrating(bits), ended),
            State::BusOff { sequences, .. } => {
                let run = bits;
                (self.state, self.since) = (State::BusOff { sequences, run }, ended);
            }
            _ => {}
        }
    }

    /// Puts it where it is so many bits after the end of a frame that was good as a whole.
    pub(crate) fn in_intermission(&mut self, bits: u8) {
        if matches!(self.state, State::Idle | State::Suspended(_)) {
            self.state = State::Intermission(bits);
        }
        self.since = Instant::NEVER;
    }

    /// It is looked at bit by bit from now on.
    pub(crate) fn observe(&mut self) {
        self.since = Instant::NEVER;
    }

    /// It is at rest, and nobody looks at its bits any more.
    pub(crate) fn release(&mut self, now: Instant) {
        self.since = now;
    }

    /// It is at rest, and comes to a wire that is quiet.
    pub(crate) fn leave(&mut self, now: Instant) {
        self.since = self.since.min(now);
    }
}
