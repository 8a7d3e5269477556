//! What a master sends on 0x7E5.

use can::Frame;

use super::{BitTiming, Part, State};
use crate::NodeId;

/// The node ID of an unconfigured device.
pub const UNCONFIGURED: u8 = 0xFF;

/// Identifier of all requests.
const COB_ID: u16 = 0x7E5;

const SWITCH_GLOBAL: u8 = 4;
const CONFIGURE_NODE_ID: u8 = 17;
const CONFIGURE_BIT_TIMING: u8 = 19;
const ACTIVATE_BIT_TIMING: u8 = 21;
const STORE: u8 = 23;
const SWITCH_SELECTIVE: u8 = 64;
const IDENTIFY: u8 = 70;
const IDENTIFY_NON_CONFIGURED: u8 = 76;
const FASTSCAN: u8 = 81;
const INQUIRE_IDENTITY: u8 = 90;
const INQUIRE_NODE_ID: u8 = 94;

/// One of the six numbers of "identify remote slave", in their order. Bounds belong to the range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Bound {
    /// The vendor ID.
    Vendor = 0,
    /// The product code.
    Product = 1,
    /// The least revision number.
    RevisionLow = 2,
    /// The greatest revision number.
    RevisionHigh = 3,
    /// The least serial number.
    SerialLow = 4,
    /// The greatest serial number.
    SerialHigh = 5,
}

impl Bound {
    /// All six, in their order.
    pub const ALL: [Bound; 6] = [
        Bound::Vendor,
        Bound::Product,
        Bound::RevisionLow,
        Bound::RevisionHigh,
        Bound::SerialLow,
        Bound::SerialHigh,
    ];

    const fn from_number(number: u8) -> Option<Bound> {
        Some(match number {
            0 => Bound::Vendor,
            1 => Bound::Product,
            2 => Bound::RevisionLow,
            3 => Bound::RevisionHigh,
            4 => Bound::SerialLow,
            5 => Bound::SerialHigh,
            _ => return None,
        })
    }
}

/// The question of one fastscan request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Test {
    /// BitCheck 128: who is unconfigured? Every scan begins with it, and slaves begin anew.
    Reset,
    /// Whose number agrees in bit `bit` (0 to 31) and all above it?
    Bits {
        /// The lowest bit that counts.
        bit: u8,
    },
}

/// A request. Reserved bytes are written as zeros and not looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Switch state global: all slaves. No answer.
    SwitchGlobal(State),
    /// Switch state selective, one of four numbers; the slave that all four name answers the last.
    SwitchSelective(Part, u32),
    /// Configure node-ID: 1 to 127 or 0xFF; anything else is for the slave to refuse.
    ConfigureNodeId(u8),
    /// Configure bit timing parameters; table 0 is [`super::BitTiming`].
    ConfigureBitTiming {
        /// Which table; 128 to 255 are makers' own.
        table: u8,
        /// Which entry.
        index: u8,
    },
    /// Activate bit timing parameters: all slaves in configuration change their bit rate after
    /// `delay_ms` and keep silent for `delay_ms` more. No answer.
    ActivateBitTiming {
        /// Length of each of the two delays, in milliseconds.
        delay_ms: u16,
    },
    /// Store configuration: pending node ID and bit timing.
    Store,
    /// Inquire one number of the identity.
    InquireIdentity(Part),
    /// Inquire the active node ID.
    InquireNodeId,
    /// Identify remote slave, one of six numbers; all slaves in the ranges answer the last.
    Identify(Bound, u32),
    /// Identify non-configured remote slave: all unconfigured slaves answer.
    IdentifyNonConfigured,
    /// Fastscan.
    Fastscan {
        /// IDNumber: what the slave's number is compared with.
        number: u32,
        /// BitCheck.
        test: Test,
        /// LSSSub: the number that is asked about.
        sub: Part,
        /// LSSNext: the number that is asked about next. Where it is before `sub` and all bits
        /// agree, the slave has been found and enters configuration.
        next: Part,
    },
}

impl Request {
    /// From eight data bytes; `None` if they are no request.
    pub const fn from_bytes(data: [u8; 8]) -> Option<Request> {
        let [command, b1, b2, b3, b4, b5, b6, b7] = data;
        let number = u32::from_le_bytes([b1, b2, b3, b4]);
        Some(match command {
            SWITCH_GLOBAL => match b1 {
                0 => Request::SwitchGlobal(State::Waiting),
                1 => Request::SwitchGlobal(State::Configuration),
                _ => return None,
            },
            CONFIGURE_NODE_ID => Request::ConfigureNodeId(b1),
            CONFIGURE_BIT_TIMING => Request::ConfigureBitTiming {
                table: b1,
                index: b2,
            },
            ACTIVATE_BIT_TIMING => Request::ActivateBitTiming {
                delay_ms: u16::from_le_bytes([b1, b2]),
            },
            STORE => Request::Store,
            SWITCH_SELECTIVE..=67 => match Part::from_number(command - SWITCH_SELECTIVE) {
                Some(part) => Request::SwitchSelective(part, number),
                None => return None,
            },
            IDENTIFY..=75 => match Bound::from_number(command - IDENTIFY) {
                Some(bound) => Request::Identify(bound, number),
                None => return None,
            },
            IDENTIFY_NON_CONFIGURED => Request::IdentifyNonConfigured,
            FASTSCAN => {
                let test = match b5 {
                    128 => Test::Reset,
                    0..=31 => Test::Bits { bit: b5 },
                    _ => return None,
                };
                match (Part::from_number(b6), Part::from_number(b7)) {
                    (Some(sub), Some(next)) => Request::Fastscan {
                        number,
                        test,
                        sub,
                        next,
                    },
                    _ => return None,
                }
            }
            INQUIRE_IDENTITY..=93 => match Part::from_number(command - INQUIRE_IDENTITY) {
                Some(part) => Request::InquireIdentity(part),
                None => return None,
            },
            INQUIRE_NODE_ID => Request::InquireNodeId,
            _ => return None,
        })
    }

    /// The eight data bytes.
    pub const fn to_bytes(self) -> [u8; 8] {
        match self {
            Request::SwitchGlobal(state) => bytes(SWITCH_GLOBAL, state as u32),
            Request::SwitchSelective(part, number) => {
                bytes(SWITCH_SELECTIVE + part.number(), number)
            }
            Request::ConfigureNodeId(id) => bytes(CONFIGURE_NODE_ID, id as u32),
            Request::ConfigureBitTiming { table, index } => bytes(
                CONFIGURE_BIT_TIMING,
                u32::from_le_bytes([table, index, 0, 0]),
            ),
            Request::ActivateBitTiming { delay_ms } => bytes(ACTIVATE_BIT_TIMING, delay_ms as u32),
            Request::Store => bytes(STORE, 0),
            Request::InquireIdentity(part) => bytes(INQUIRE_IDENTITY + part.number(), 0),
            Request::InquireNodeId => bytes(INQUIRE_NODE_ID, 0),
            Request::Identify(bound, number) => bytes(IDENTIFY + bound as u8, number),
            Request::IdentifyNonConfigured => bytes(IDENTIFY_NON_CONFIGURED, 0),
            Request::Fastscan {
                number,
                test,
                sub,
                next,
            } => {
                let bit_check = match test {
                    Test::Reset => 128,
                    Test::Bits { bit } => bit,
                };
                let [command, b1, b2, b3, b4, ..] = bytes(FASTSCAN, number);
                let [sub, next] = [sub.number(), next.number()];
                [command, b1, b2, b3, b4, bit_check, sub, next]
            }
        }
    }

    /// The request in a frame; `None` unless that is a data frame 0x7E5 of eight bytes.
    pub fn from_frame(frame: &Frame) -> Option<Request> {
        let ours = frame.key() == u32::from(COB_ID) && frame.len() == 8;
        ours.then(|| Request::from_bytes(frame.bytes())).flatten()
    }

    /// The frame.
    pub fn frame(self) -> Frame {
        Frame::classic(COB_ID, self.to_bytes(), 8)
    }
}

/// In words, for traces.
impl core::fmt::Display for Request {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Request::SwitchGlobal(State::Waiting) => f.write_str("switch all to waiting"),
            Request::SwitchGlobal(State::Configuration) => {
                f.write_str("switch all to configuration")
            }
            Request::SwitchSelective(part, number) => write!(f, "select {part} 0x{number:08X}"),
            Request::ConfigureNodeId(UNCONFIGURED) => f.write_str("configure no node ID"),
            Request::ConfigureNodeId(id) => write!(f, "configure node ID {id}"),
            Request::ConfigureBitTiming { table, index } => {
                match BitTiming::from_index(*index).filter(|_| *table == 0) {
                    Some(timing) => write!(f, "configure {timing}"),
                    None => write!(f, "configure bit timing {index} of table {table}"),
                }
            }
            Request::ActivateBitTiming { delay_ms } => {
                write!(f, "activate bit timing after {delay_ms} ms")
            }
            Request::Store => f.write_str("store configuration"),
            Request::InquireIdentity(part) => write!(f, "inquire {part}"),
            Request::InquireNodeId => f.write_str("inquire node ID"),
            Request::Identify(bound, number) => {
                let bound = match bound {
                    Bound::Vendor => "vendor ID",
                    Bound::Product => "product code",
                    Bound::RevisionLow => "revision number from",
                    Bound::RevisionHigh => "revision number to",
                    Bound::SerialLow => "serial number from",
                    Bound::SerialHigh => "serial number to",
                };
                write!(f, "identify {bound} 0x{number:08X}")
            }
            Request::IdentifyNonConfigured => f.write_str("identify devices without a node ID"),
            Request::Fastscan {
                test: Test::Reset, ..
            } => f.write_str("fastscan begins"),
            Request::Fastscan {
                number,
                test: Test::Bits { bit },
                sub,
                next,
            } => {
                write!(f, "fastscan {sub} 0x{number:08X} from bit {bit}")?;
                match next == sub {
                    true => Ok(()),
                    false => write!(f, ", next {next}"),
                }
            }
        }
    }
}

/// A command specifier and a number behind it.
pub(super) const fn bytes(command: u8, number: u32) -> [u8; 8] {
    let [b1, b2, b3, b4] = number.to_le_bytes();
    [command, b1, b2, b3, b4, 0, 0, 0]
}

/// A node ID as LSS writes it.
pub(super) const fn node_id_byte(id: Option<NodeId>) -> u8 {
    match id {
        Some(id) => id.get(),
        None => UNCONFIGURED,
    }
}
