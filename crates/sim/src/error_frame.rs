//! Errors on the wire as the controller of outside programs sees them, told as the driver of a real
//! one tells them: SocketCAN's error messages (linux/can/error.h).

use bus::ErrorFrame;
use bus::recording::Content;
use canopen::Instant;

use crate::medium::{ErrorCounters, ErrorKind, ErrorState, Field};

// Classes (`CAN_ERR_*`).
const CONTROLLER: u32 = 0x004;
const PROTOCOL: u32 = 0x008;
const NO_ACKNOWLEDGE: u32 = 0x020;
const BUS_OFF: u32 = 0x040;
const BUS_ERROR: u32 = 0x080;
const RESTARTED: u32 = 0x100;
const COUNTERS: u32 = 0x200;

// Byte 1 (`CAN_ERR_CRTL_*`).
const RECEIVE_PASSIVE: u8 = 0x10;
const TRANSMIT_PASSIVE: u8 = 0x20;
const ACTIVE_AGAIN: u8 = 0x40;

// Byte 2 (`CAN_ERR_PROT_*`).
const BIT: u8 = 0x01;
const FORM: u8 = 0x02;
const STUFF: u8 = 0x04;
const WHILE_SENDING: u8 = 0x80;

/// An error message of the controller that outside programs share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorSeen {
    /// When the bit ended at which it was noticed.
    pub at: Instant,
    /// What it says.
    pub frame: ErrorFrame,
}

impl ErrorSeen {
    /// As recordings have it.
    pub fn content(&self) -> Content {
        Content::Error(self.frame)
    }

    fn new(at: Instant, class: u32, counters: ErrorCounters, particulars: [u8; 3]) -> ErrorSeen {
        let byte = |counter: u16| u8::try_from(counter).unwrap_or(u8::MAX);
        let [state, kind, place] = particulars;
        let (transmit, receive) = (byte(counters.transmit), byte(counters.receive));
        ErrorSeen {
            at,
            frame: ErrorFrame {
                class: class | COUNTERS,
                data: [0, state, kind, place, 0, 0, transmit, receive],
            },
        }
    }

    /// An error in a frame.
    pub(crate) fn in_frame(
        at: Instant,
        kind: ErrorKind,
        field: Field,
        sends: bool,
        counters: ErrorCounters,
    ) -> ErrorSeen {
        let class = match kind {
            ErrorKind::Acknowledge => NO_ACKNOWLEDGE | BUS_ERROR,
            _ => PROTOCOL | BUS_ERROR,
        };
        let bits = match kind {
            ErrorKind::Bit => BIT,
            ErrorKind::Form => FORM,
            ErrorKind::Stuff => STUFF,
            // That it is the CRC tells the place.
            ErrorKind::Crc | ErrorKind::Acknowledge => 0,
        };
        let bits = bits | if sends { WHILE_SENDING } else { 0 };
        ErrorSeen::new(at, class, counters, [0, bits, place(kind, field)])
    }

    /// Its error state has changed.
    pub(crate) fn state(at: Instant, counters: ErrorCounters) -> ErrorSeen {
        match counters.state() {
            ErrorState::BusOff => ErrorSeen::new(at, BUS_OFF, counters, [0; 3]),
            ErrorState::Active => ErrorSeen::new(at, CONTROLLER, counters, [ACTIVE_AGAIN, 0, 0]),
            ErrorState::Passive => {
                let transmit = if counters.transmit >= 128 {
                    TRANSMIT_PASSIVE
                } else {
                    0
                };
                let receive = if counters.receive >= 128 {
                    RECEIVE_PASSIVE
                } else {
                    0
                };
                ErrorSeen::new(at, CONTROLLER, counters, [transmit | receive, 0, 0])
            }
        }
    }

    /// It is back from bus-off.
    pub(crate) fn restarted(at: Instant) -> ErrorSeen {
        ErrorSeen::new(at, RESTARTED, ErrorCounters::default(), [0; 3])
    }
}

/// Byte 3 (`CAN_ERR_PROT_LOC_*`).
fn place(kind: ErrorKind, field: Field) -> u8 {
    match field {
        _ if kind == ErrorKind::Crc => 0x08,
        Field::Start => 0x03,
        Field::Arbitration => 0x02,
        Field::Control => 0x0B,
        Field::Data => 0x0A,
        Field::Crc => 0x08,
        Field::CrcDelimiter => 0x18,
        Field::AckSlot => 0x19,
        Field::AckDelimiter => 0x1B,
        Field::End(_) => 0x1A,
        // The kernel's list has no delimiters of error frames.
        Field::ErrorDelimiter => 0x00,
    }
}
