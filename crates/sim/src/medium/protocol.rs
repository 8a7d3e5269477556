//! What one controller does on the wire, bit for bit: the media access control of ISO 11898-1 with
//! its fault confinement. [`Protocol::level`] is what it sends in the next bit, [`Protocol::read`]
//! takes what the wire had.

use can::{BitStream, Frame};
use canopen::Instant;

use super::counters::{Counted, ErrorCounters};
use super::decoder::{Decoder, Field, Meaning};

/// Recessive bits after which a controller knows that the wire is free.
pub(super) const INTEGRATION_BITS: u64 = 11;
/// So many times that are needed to come back from bus-off.
pub(super) const RECOVERY_SEQUENCES: u64 = 128;
/// Error flags and overload flags.
const FLAG_BITS: u8 = 6;
/// Error delimiters and overload delimiters.
const DELIMITER_BITS: u8 = 8;
pub(super) const INTERMISSION_BITS: u8 = 3;
/// What an error passive transmitter waits behind intermission.
pub(super) const SUSPEND_BITS: u64 = 8;
/// Dominant bits behind a flag that count as one more error.
const ENDLESS_BITS: u8 = 8;

/// What kind of error a controller has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// It has read another bit than it has sent.
    Bit,
    /// Six equal bits where there must be a stuff bit.
    Stuff,
    /// The CRC does not fit the frame.
    Crc,
    /// A dominant bit where there must be a recessive one.
    Form,
    /// Nobody has acknowledged the frame.
    Acknowledge,
}

/// What a bit has brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// A frame is received.
    Received(Frame),
    /// The frame is sent.
    Sent(Frame),
    /// There is an error in a frame, found as its transmitter or as a receiver.
    Error {
        kind: ErrorKind,
        field: Field,
        transmitter: bool,
    },
    /// It is error active again after bus-off.
    Recovered,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// It has no power, or no node is behind it.
    Off,
    /// It waits for recessive bits, of which it has read so many.
    Integrating(u8),
    /// It may send.
    Idle,
    /// In a frame.
    Frame,
    /// It sends an active error flag or an overload flag, so many bits of it so far.
    Flag { sent: u8, overload: bool },
    /// It sends a passive error flag and waits for six equal bits. Without an acknowledge that
    /// is an error to be counted only if somebody sends a dominant bit.
    PassiveFlag {
        last: bool,
        run: u8,
        unacknowledged: bool,
    },
    /// Behind its flag, while others still send theirs: so many dominant bits.
    Behind { dominant: u8, overload: bool },
    /// Recessive bits of the delimiter.
    Delimiter(u8),
    /// Recessive bits of intermission.
    Intermission(u8),
    /// It has sent, is error passive and waits: recessive bits so far.
    Suspended(u8),
    /// It takes no part: sequences of recessive bits so far, and bits of the present one.
    BusOff { sequences: u8, run: u8 },
}

/// The protocol side of one controller.
#[derive(Clone, Debug)]
pub(crate) struct Protocol {
    pub(crate) counters: ErrorCounters,
    pub(super) state: State,
    /// Since when it is in this state, where only recessive bits have come since; never: there is
    /// traffic that is looked at bit by bit or is good as a whole.
    pub(super) since: Instant,
    /// The frame that it sends or has last sent, as its bits.
    sending: Option<(Frame, BitStream)>,
    /// Whether it sends the frame that is on the wire, or has sent the last one.
    pub(super) transmitter: bool,
    /// Number of the next bit of the frame that it sends.
    at: u16,
    decoder: Decoder,
}

impl Protocol {
    /// One without power.
    pub(crate) fn new() -> Protocol {
        Protocol {
            counters: ErrorCounters::default(),
            state: State::Off,
            since: Instant::ZERO,
            sending: None,
            transmitter: false,
            at: 0,
            decoder: Decoder::NEW,
        }
    }

    /// Begins to send with the next bit, which must be free for it.
    pub(crate) fn begin(&mut self, frame: Frame) {
        debug_assert!(self.is_idle());
        self.state = State::Frame;
        self.sending = Some((frame, frame.bit_stream()));
        self.transmitter = true;
        self.at = 0;
        self.decoder = Decoder::NEW;
    }

    /// The frame that it sends, or that it has just sent, also if others have destroyed it.
    pub(crate) fn sends(&self) -> Option<Frame> {
        let (frame, _) = self.sending.filter(|_| self.transmitter)?;
        Some(frame)
    }

    /// What it sends in the next bit: `true` is recessive.
    pub(crate) fn level(&self) -> bool {
        match self.state {
            State::Flag { .. } => false,
            State::Frame if self.transmitter => {
                let stream = self.sending.as_ref().map(|(_, stream)| stream);
                stream
                    .and_then(|stream| stream.bit(self.at))
                    .unwrap_or(true)
            }
            State::Frame => self.decoder.field() != Field::AckSlot || !self.decoder.is_crc_right(),
            _ => true,
        }
    }

    /// The wire had this level, `true` if recessive. `waiting` is the frame that it would send.
    pub(crate) fn read(&mut self, bit: bool, waiting: Option<Frame>) -> Option<Event> {
        self.since = Instant::NEVER;
        match self.state {
            State::Off => {}
            State::Integrating(run) => {
                self.state = match run + 1 {
                    _ if !bit => State::Integrating(0),
                    run if u64::from(run) == INTEGRATION_BITS => State::Idle,
                    run => State::Integrating(run),
                };
            }
            State::BusOff { sequences, run } => return self.read_bus_off(bit, sequences, run),
            State::Idle | State::Suspended(_) if !bit => self.receive(),
            State::Idle => {}
            State::Suspended(run) => {
                self.state = match run + 1 {
                    run if u64::from(run) == SUSPEND_BITS => State::Idle,
                    run => State::Suspended(run),
                };
            }
            State::Frame => return self.read_frame(bit),
            State::Flag { sent, overload } => self.read_flag(bit, sent, overload),
            State::PassiveFlag {
                last,
                run,
                unacknowledged,
            } => self.read_passive_flag(bit, last, run, unacknowledged),
            State::Behind { dominant, overload } => self.read_behind(bit, dominant, overload),
            State::Delimiter(n) if bit => {
                self.state = match n + 1 {
                    DELIMITER_BITS => State::Intermission(0),
                    n => State::Delimiter(n),
                };
            }
            // The last bit of a delimiter is as good as the first ones of intermission.
            State::Delimiter(n) if n + 1 == DELIMITER_BITS => self.overload(),
            State::Delimiter(_) => {
                return self.error(ErrorKind::Form, Field::ErrorDelimiter, true);
            }
            State::Intermission(n) if bit => {
                self.state = match n + 1 {
                    INTERMISSION_BITS if self.transmitter && self.counters.is_passive() => {
                        State::Suspended(0)
                    }
                    INTERMISSION_BITS => State::Idle,
                    n => State::Intermission(n),
                };
            }
            State::Intermission(n) if n + 1 < INTERMISSION_BITS => self.overload(),
            // Somebody's start of frame. Who wants to send goes on with its identifier.
            State::Intermission(_) => {
                let suspends = self.transmitter && self.counters.is_passive();
                self.receive();
                if let Some(frame) = waiting.filter(|_| !suspends) {
                    self.sending = Some((frame, frame.bit_stream()));
                    self.transmitter = true;
                    self.at = 1;
                }
            }
        }
        None
    }

    /// Start of frame, sent by another.
    fn receive(&mut self) {
        self.state = State::Frame;
        self.transmitter = false;
        self.decoder = Decoder::NEW;
        self.decoder.read(false);
    }

    fn read_bus_off(&mut self, bit: bool, sequences: u8, run: u8) -> Option<Event> {
        let (mut sequences, mut run) = (sequences, if bit { run + 1 } else { 0 });
        if u64::from(run) == INTEGRATION_BITS {
            (sequences, run) = (sequences + 1, 0);
        }
        if u64::from(sequences) == RECOVERY_SEQUENCES {
            self.state = State::Idle;
            self.counters = ErrorCounters::default();
            return Some(Event::Recovered);
        }
        self.state = State::BusOff { sequences, run };
        None
    }

    fn read_frame(&mut self, bit: bool) -> Option<Event> {
        let (sent, field) = (self.level(), self.decoder.field());
        let meaning = self.decoder.read(bit);
        let at = self.at;
        self.at = at.saturating_add(1);
        if let Some((frame, stream)) = self.sending.filter(|_| self.transmitter) {
            if bit != sent {
                if field == Field::AckSlot {
                    return None;
                }
                if !sent || !stream.is_arbitrated(at) {
                    return self.error(ErrorKind::Bit, field, true);
                }
                // A stuff bit cannot be lost to another frame, and does not count (c, exception).
                if meaning == Meaning::StuffError {
                    return self.error(ErrorKind::Stuff, field, false);
                }
                // Another has a lower identifier.
                self.transmitter = false;
            } else if field == Field::AckSlot {
                return self.error(ErrorKind::Acknowledge, field, true);
            } else if meaning == Meaning::End {
                self.counters.transmitted();
                self.state = State::Intermission(0);
                return Some(Event::Sent(frame));
            } else {
                return None;
            }
        }
        match meaning {
            Meaning::Nothing if field == Field::AckSlot && !sent => {
                if bit {
                    return self.error(ErrorKind::Bit, field, true);
                }
                self.counters.received();
                None
            }
            Meaning::Nothing => None,
            Meaning::StuffError => self.error(ErrorKind::Stuff, field, true),
            Meaning::FormError => self.error(ErrorKind::Form, field, true),
            Meaning::CrcError => self.error(ErrorKind::Crc, field, true),
            Meaning::End => {
                let frame = self.decoder.frame();
                if bit {
                    self.state = State::Intermission(0);
                } else {
                    self.overload();
                }
                frame.map(Event::Received)
            }
        }
    }

    fn overload(&mut self) {
        self.state = State::Flag {
            sent: 0,
            overload: true,
        };
    }

    /// An error in a frame or in a delimiter: counts it, and marks it from the next bit on.
    fn error(&mut self, kind: ErrorKind, field: Field, counts: bool) -> Option<Event> {
        // The error that makes it error passive is marked by an active flag yet.
        let was_passive = self.counters.is_passive();
        let unacknowledged = kind == ErrorKind::Acknowledge && was_passive;
        if counts && !unacknowledged {
            let error = if self.transmitter {
                Counted::Transmit
            } else {
                Counted::Receive
            };
            self.counters.count(error);
        }
        self.flag(was_passive, unacknowledged);
        Some(Event::Error {
            kind,
            field,
            transmitter: self.transmitter,
        })
    }

    fn flag(&mut self, passive: bool, unacknowledged: bool) {
        self.state = if passive {
            State::PassiveFlag {
                last: true,
                run: 0,
                unacknowledged,
            }
        } else {
            State::Flag {
                sent: 0,
                overload: false,
            }
        };
        self.leave_if_bus_off();
    }

    /// An error that is no new one in a frame but counts (b, d, e, f).
    fn aggravate(&mut self) {
        self.counters.count(if self.transmitter {
            Counted::Transmit
        } else {
            Counted::ReceiveGrave
        });
        self.leave_if_bus_off();
    }

    fn leave_if_bus_off(&mut self) {
        if self.counters.is_bus_off() {
            // It has given the frame up: another may send the same one.
            self.sending = None;
            self.state = State::BusOff {
                sequences: 0,
                run: 0,
            };
        }
    }

    fn read_flag(&mut self, bit: bool, sent: u8, overload: bool) {
        if bit {
            // It sends dominant and reads recessive (d, e).
            let was_passive = self.counters.is_passive();
            self.flag(was_passive, false);
            self.aggravate();
            return;
        }
        self.state = match sent + 1 {
            FLAG_BITS => State::Behind {
                dominant: 0,
                overload,
            },
            sent => State::Flag { sent, overload },
        };
    }

    fn read_passive_flag(&mut self, bit: bool, last: bool, run: u8, unacknowledged: bool) {
        let run = if run > 0 && bit == last { run + 1 } else { 1 };
        self.state = if run == FLAG_BITS {
            State::Behind {
                dominant: 0,
                overload: false,
            }
        } else {
            State::PassiveFlag {
                last: bit,
                run,
                unacknowledged: unacknowledged && bit,
            }
        };
        if unacknowledged && !bit {
            self.aggravate();
        }
    }

    fn read_behind(&mut self, bit: bool, dominant: u8, overload: bool) {
        if bit {
            self.state = State::Delimiter(1);
            return;
        }
        let first = dominant == 0;
        let dominant = dominant + 1;
        let endless = dominant.is_multiple_of(ENDLESS_BITS);
        self.state = State::Behind {
            // From the first time on only the eighth counts.
            dominant: if endless { ENDLESS_BITS } else { dominant },
            overload,
        };
        if first && !overload && !self.transmitter {
            // Others found the error later than this receiver, or do not find it (b).
            self.aggravate();
        }
        if endless {
            self.aggravate();
        }
    }
}
