//! The slave: one device as it answers LSS.

use super::request::node_id_byte;
use super::{
    Answer, BitTiming, BitTimings, Bound, Identity, Part, Refusal, Request, Service, Test,
};
use crate::{Instant, NodeId};

/// State of an LSS slave. The number is the mode of "switch state global".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// Can be selected, identified and found.
    Waiting = 0,
    /// Can be configured, asked and identified.
    Configuration = 1,
}

/// What the owner of a slave has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Store these two for the next power-on, then call [`Slave::complete`].
    StoreConfiguration {
        /// Pending node ID.
        node_id: Option<NodeId>,
        /// Pending bit timing.
        bit_timing: BitTiming,
    },
    /// The device has been unconfigured and is no more: boot with this node ID.
    NodeIdConfigured(NodeId),
    /// Send nothing from now on, LSS or other; `delay_ms` later comes
    /// [`Event::SwitchBitTiming`]. CiA 305 calls the time switch_delay.
    Silence {
        /// Length of each of the two delays, in milliseconds.
        delay_ms: u16,
    },
    /// The first delay is over: change the bit timing of the controller, and stay silent.
    SwitchBitTiming(BitTiming),
    /// The second delay is over: sending is allowed again.
    SpeakAgain,
}

/// What comes of a request: an answer to send or something to do, never both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// To be sent: [`Answer::frame`].
    Answer(Answer),
    /// To be done.
    Event(Event),
}

/// Why nothing was stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreError {
    /// The device cannot store (error 1).
    NotSupported,
    /// The memory cannot be written (error 2).
    Access,
    /// A maker's own reason (error 255).
    Specific(u8),
}

/// A change of bit timing under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    None,
    /// First delay.
    Before {
        switch_at: Instant,
        delay_ms: u16,
        timing: BitTiming,
    },
    /// Second delay.
    After {
        speak_at: Instant,
    },
}

/// An LSS slave (CiA 305). It works in every NMT state, and without a node ID.
///
/// The owner hands every request on 0x7E5 to [`Slave::receive`], calls [`Slave::poll`] when
/// [`Slave::next_deadline`] has come, and [`Slave::reset_communication`] upon that NMT command.
#[derive(Clone, Copy, Debug)]
pub struct Slave {
    identity: Identity,
    supported: BitTimings,
    state: State,
    node_id: Option<NodeId>,
    pending_node_id: Option<NodeId>,
    bit_timing: BitTiming,
    pending_bit_timing: BitTiming,
    /// How many numbers of "switch state selective" agreed in a row.
    selected: u8,
    /// How many numbers of "identify remote slave" agreed in a row.
    identified: u8,
    /// LSSPos: the number that fastscan asks next.
    position: Part,
    storing: bool,
    change: Change,
}

impl Slave {
    /// A slave in state waiting, as after power-on. `node_id` and `bit_timing` are what is stored
    /// (or set by switches) and become active; `supported` is what the device can change to.
    pub const fn new(
        identity: Identity,
        node_id: Option<NodeId>,
        bit_timing: BitTiming,
        supported: BitTimings,
    ) -> Slave {
        Slave {
            identity,
            supported,
            state: State::Waiting,
            node_id,
            pending_node_id: node_id,
            bit_timing,
            pending_bit_timing: bit_timing,
            selected: 0,
            identified: 0,
            position: Part::Vendor,
            storing: false,
            change: Change::None,
        }
    }

    /// Its state.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Its LSS address.
    pub const fn identity(&self) -> Identity {
        self.identity
    }

    /// The active node ID; `None` is 0xFF.
    pub const fn node_id(&self) -> Option<NodeId> {
        self.node_id
    }

    /// The node ID that becomes active next.
    pub const fn pending_node_id(&self) -> Option<NodeId> {
        self.pending_node_id
    }

    /// The active bit timing.
    pub const fn bit_timing(&self) -> BitTiming {
        self.bit_timing
    }

    /// The bit timing that becomes active next.
    pub const fn pending_bit_timing(&self) -> BitTiming {
        self.pending_bit_timing
    }

    /// Whether active and pending node ID are 0xFF. Only such a slave takes part in fastscan.
    pub const fn is_unconfigured(&self) -> bool {
        self.node_id.is_none() && self.pending_node_id.is_none()
    }

    /// Whether the device must send nothing, because its bit timing changes.
    pub const fn is_silent(&self) -> bool {
        !matches!(self.change, Change::None)
    }

    /// Takes a request ([`Request::from_frame`]). A request that the state does not allow is
    /// answered by silence, and so is everything while a bit timing changes.
    pub fn receive(&mut self, request: Request, now: Instant) -> Option<Reply> {
        if self.is_silent() {
            return None;
        }
        match (self.state, request) {
            (_, Request::SwitchGlobal(state)) => self.switch_global(state).map(Reply::Event),
            (_, Request::Identify(bound, number)) => self.identify(bound, number),
            (_, Request::IdentifyNonConfigured) => self
                .is_unconfigured()
                .then_some(Reply::Answer(Answer::NonConfigured)),
            (State::Waiting, Request::SwitchSelective(part, number)) => {
                self.switch_selective(part, number)
            }
            (
                State::Waiting,
                Request::Fastscan {
                    number,
                    test,
                    sub,
                    next,
                },
            ) => self.fastscan(number, test, sub, next),
            (State::Configuration, request) => self.configure(request, now),
            (State::Waiting, _) => None,
        }
    }

    /// Tells how [`Event::StoreConfiguration`] went; gives the answer to send. `None` if nobody
    /// waits for it any more: the slave has left configuration, or is silent.
    pub fn complete(&mut self, stored: Result<(), StoreError>) -> Option<Answer> {
        if !self.storing {
            return None;
        }
        self.storing = false;
        let (error, specific) = match stored {
            Ok(()) => (0, 0),
            Err(StoreError::NotSupported) => (1, 0),
            Err(StoreError::Access) => (2, 0),
            Err(StoreError::Specific(code)) => (255, code),
        };
        (!self.is_silent()).then(|| verdict(Service::Store, error, specific))
    }

    /// Lets time pass. Call again until it gives nothing.
    pub fn poll(&mut self, now: Instant) -> Option<Event> {
        if now < self.next_deadline() {
            return None;
        }
        match self.change {
            Change::None => None,
            Change::Before {
                delay_ms, timing, ..
            } => {
                self.bit_timing = timing;
                // From now, not from when it was due: the second delay follows the change.
                self.change = Change::After {
                    speak_at: now.plus_ms(u64::from(delay_ms)),
                };
                Some(Event::SwitchBitTiming(timing))
            }
            Change::After { .. } => {
                self.change = Change::None;
                Some(Event::SpeakAgain)
            }
        }
    }

    /// When [`Slave::poll`] has something to do.
    pub const fn next_deadline(&self) -> Instant {
        match self.change {
            Change::None => Instant::NEVER,
            Change::Before { switch_at, .. } => switch_at,
            Change::After { speak_at } => speak_at,
        }
    }

    /// NMT "reset communication": the pending node ID becomes active and the state waiting. Gives
    /// the node ID to boot with, `None` if the device is unconfigured from now on.
    pub fn reset_communication(&mut self) -> Option<NodeId> {
        self.enter(State::Waiting);
        self.node_id = self.pending_node_id;
        self.node_id
    }

    fn enter(&mut self, state: State) {
        self.state = state;
        self.selected = 0;
        self.position = Part::Vendor;
        if state == State::Waiting {
            self.identified = 0;
            self.storing = false;
        }
    }

    fn switch_global(&mut self, state: State) -> Option<Event> {
        let left = self.state == State::Configuration && state == State::Waiting;
        if self.state != state || state == State::Waiting {
            self.enter(state);
        }
        // An unconfigured device waits in NMT initialisation for just this.
        match (self.node_id, self.pending_node_id) {
            (None, Some(id)) if left => {
                self.node_id = Some(id);
                Some(Event::NodeIdConfigured(id))
            }
            _ => None,
        }
    }

    fn switch_selective(&mut self, part: Part, number: u32) -> Option<Reply> {
        let agrees = number == self.identity.get(part);
        self.selected = agreed(self.selected, part.number(), agrees);
        if self.selected < 4 {
            return None;
        }
        self.enter(State::Configuration);
        Some(Reply::Answer(Answer::Selected))
    }

    fn identify(&mut self, bound: Bound, number: u32) -> Option<Reply> {
        let Identity {
            vendor,
            product,
            revision,
            serial,
        } = self.identity;
        let agrees = match bound {
            Bound::Vendor => number == vendor,
            Bound::Product => number == product,
            Bound::RevisionLow => number <= revision,
            Bound::RevisionHigh => number >= revision,
            Bound::SerialLow => number <= serial,
            Bound::SerialHigh => number >= serial,
        };
        self.identified = agreed(self.identified, bound as u8, agrees);
        if self.identified < 6 {
            return None;
        }
        self.identified = 0;
        Some(Reply::Answer(Answer::Identified))
    }

    fn fastscan(&mut self, number: u32, test: Test, sub: Part, next: Part) -> Option<Reply> {
        if !self.is_unconfigured() {
            return None;
        }
        match test {
            Test::Reset => self.position = Part::Vendor,
            Test::Bits { bit } => {
                // "bit" is at most 31; a shift by it keeps the bits that count.
                let differs = (number ^ self.identity.get(sub)) >> (bit & 31);
                if sub != self.position || differs != 0 {
                    return None;
                }
                self.position = next;
                if bit == 0 && next < sub {
                    self.enter(State::Configuration);
                }
            }
        }
        Some(Reply::Answer(Answer::Identified))
    }

    /// The services of state configuration.
    fn configure(&mut self, request: Request, now: Instant) -> Option<Reply> {
        let answer = match request {
            Request::ConfigureNodeId(byte) => {
                let id = NodeId::new(byte);
                let valid = id.is_some() || byte == super::UNCONFIGURED;
                if valid {
                    self.pending_node_id = id;
                }
                verdict(Service::ConfigureNodeId, u8::from(!valid), 0)
            }
            Request::ConfigureBitTiming { table, index } => {
                let timing = BitTiming::from_index(index)
                    .filter(|timing| table == 0 && self.supported.has(*timing));
                if let Some(timing) = timing {
                    self.pending_bit_timing = timing;
                }
                verdict(Service::ConfigureBitTiming, u8::from(timing.is_none()), 0)
            }
            Request::ActivateBitTiming { delay_ms } => return self.activate(delay_ms, now),
            Request::Store => {
                // Repeated while the first is under way: that one's answer is the answer.
                let event = Event::StoreConfiguration {
                    node_id: self.pending_node_id,
                    bit_timing: self.pending_bit_timing,
                };
                let first = !self.storing;
                self.storing = true;
                return first.then_some(Reply::Event(event));
            }
            Request::InquireIdentity(part) => Answer::Identity(part, self.identity.get(part)),
            Request::InquireNodeId => Answer::NodeId(node_id_byte(self.node_id)),
            _ => return None,
        };
        Some(Reply::Answer(answer))
    }

    fn activate(&mut self, delay_ms: u16, now: Instant) -> Option<Reply> {
        if self.supported.is_empty() {
            return None;
        }
        self.change = Change::Before {
            switch_at: now.plus_ms(u64::from(delay_ms)),
            delay_ms,
            timing: self.pending_bit_timing,
        };
        Some(Reply::Event(Event::Silence { delay_ms }))
    }
}

/// How many numbers of a sequence agreed in a row, after the one with this `number` came. A frame
/// that CAN delivers twice does not break the row (CAN promises "at least once" only).
const fn agreed(so_far: u8, number: u8, agrees: bool) -> u8 {
    let in_turn = number == 0 || so_far == number || so_far == number + 1;
    if agrees && in_turn { number + 1 } else { 0 }
}

const fn verdict(service: Service, error: u8, specific: u8) -> Answer {
    match error {
        0 => Answer::Done(service),
        error => Answer::Refused(Refusal {
            service,
            error,
            specific,
        }),
    }
}
