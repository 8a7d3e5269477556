//! What a slave sends on 0x7E4.

use can::Frame;

use super::request::bytes;
use super::{Part, UNCONFIGURED};

/// Identifier of all answers.
const COB_ID: u16 = 0x7E4;

const SELECTED: u8 = 68;
const IDENTIFIED: u8 = 79;
const NON_CONFIGURED: u8 = 80;
const INQUIRE_IDENTITY: u8 = 90;
const INQUIRE_NODE_ID: u8 = 94;

/// A service whose answer says whether it was done. The number is the command specifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Service {
    /// Configure node-ID.
    ConfigureNodeId = 17,
    /// Configure bit timing parameters.
    ConfigureBitTiming = 19,
    /// Store configuration.
    Store = 23,
}

/// Why a slave did not do what it was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// By which service.
    pub service: Service,
    /// Error code, never 0. 1: node ID out of range, bit timing not supported, storing not
    /// supported. 2, store only: the store failed. 255: see `specific`.
    pub error: u8,
    /// The maker's error code, if `error` is 255.
    pub specific: u8,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let text = match (self.service, self.error) {
            (Service::ConfigureNodeId, 1) => "node ID out of range (error 1)",
            (Service::ConfigureBitTiming, 1) => "bit rate not supported (error 1)",
            (Service::Store, 1) => "storing is not supported (error 1)",
            (Service::Store, 2) => "the store cannot be written (error 2)",
            (_, 255) => {
                return write!(f, "maker's own error {} (error 255)", self.specific);
            }
            (_, error) => return write!(f, "reserved error {error}"),
        };
        f.write_str(text)
    }
}

impl core::error::Error for Refusal {}

/// An answer. Reserved bytes are written as zeros and not looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Switch state selective: this slave is in configuration now.
    Selected,
    /// It is done.
    Done(Service),
    /// It is not done.
    Refused(Refusal),
    /// Identify slave: there is one that meets what was asked.
    Identified,
    /// Identify non-configured slave: there is one.
    NonConfigured,
    /// One number of the identity.
    Identity(Part, u32),
    /// The active node ID, 1 to 127 or 0xFF. Not checked.
    NodeId(u8),
}

impl Answer {
    /// From eight data bytes; `None` if they are no answer.
    pub const fn from_bytes(data: [u8; 8]) -> Option<Answer> {
        let [command, b1, b2, b3, b4, ..] = data;
        let service = match command {
            SELECTED => return Some(Answer::Selected),
            IDENTIFIED => return Some(Answer::Identified),
            NON_CONFIGURED => return Some(Answer::NonConfigured),
            INQUIRE_IDENTITY..=93 => {
                let number = u32::from_le_bytes([b1, b2, b3, b4]);
                return match Part::from_number(command - INQUIRE_IDENTITY) {
                    Some(part) => Some(Answer::Identity(part, number)),
                    None => None,
                };
            }
            INQUIRE_NODE_ID => return Some(Answer::NodeId(b1)),
            17 => Service::ConfigureNodeId,
            19 => Service::ConfigureBitTiming,
            23 => Service::Store,
            _ => return None,
        };
        Some(match b1 {
            0 => Answer::Done(service),
            error => Answer::Refused(Refusal {
                service,
                error,
                specific: b2,
            }),
        })
    }

    /// The eight data bytes.
    pub const fn to_bytes(self) -> [u8; 8] {
        match self {
            Answer::Selected => bytes(SELECTED, 0),
            Answer::Done(service) => bytes(service as u8, 0),
            Answer::Refused(refusal) => bytes(
                refusal.service as u8,
                u32::from_le_bytes([refusal.error, refusal.specific, 0, 0]),
            ),
            Answer::Identified => bytes(IDENTIFIED, 0),
            Answer::NonConfigured => bytes(NON_CONFIGURED, 0),
            Answer::Identity(part, number) => bytes(INQUIRE_IDENTITY + part.number(), number),
            Answer::NodeId(id) => bytes(INQUIRE_NODE_ID, id as u32),
        }
    }

    /// The answer in a frame; `None` unless that is a data frame 0x7E4 of eight bytes.
    pub fn from_frame(frame: &Frame) -> Option<Answer> {
        let ours = frame.key() == u32::from(COB_ID) && frame.len() == 8;
        ours.then(|| Answer::from_bytes(frame.bytes())).flatten()
    }

    /// The frame.
    pub fn frame(self) -> Frame {
        Frame::classic(COB_ID, self.to_bytes(), 8)
    }
}

/// In words, for traces.
impl core::fmt::Display for Answer {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let done = match self {
            Answer::Selected => "selected",
            Answer::Done(Service::ConfigureNodeId) => "node ID configured",
            Answer::Done(Service::ConfigureBitTiming) => "bit timing configured",
            Answer::Done(Service::Store) => "configuration stored",
            Answer::Refused(refusal) => return write!(f, "refused, {refusal}"),
            Answer::Identified => "identified",
            Answer::NonConfigured => "has no node ID",
            Answer::Identity(part, number) => return write!(f, "{part} 0x{number:08X}"),
            Answer::NodeId(UNCONFIGURED) => "no node ID",
            Answer::NodeId(id) => return write!(f, "node ID {id}"),
        };
        f.write_str(done)
    }
}
