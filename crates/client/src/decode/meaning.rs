//! What a frame was found to mean: data for programs, words for people.

use std::fmt;

use can::Frame;
use canopen::Instant;
use serde::{Serialize, Serializer};

/// A frame and its meaning.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Decoded {
    /// When it was on the bus, in nanoseconds of the link's clock.
    #[serde(rename = "time_ns", serialize_with = "nanoseconds")]
    pub at: Instant,
    /// The frame, in candump's notation.
    #[serde(serialize_with = "candump")]
    pub frame: Frame,
    /// What it means.
    #[serde(flatten)]
    pub meaning: Meaning,
}

fn nanoseconds<S: Serializer>(at: &Instant, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_u64(at.0)
}

fn candump<S: Serializer>(frame: &Frame, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(frame)
}

/// Which way a PDO goes, from the node's side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// RPDO: the node receives it.
    Receive,
    /// TPDO: the node transmits it.
    Transmit,
}

/// A value in a transfer or a PDO.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ObjectValue {
    /// Index.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
    /// The object's name, if known.
    pub name: Option<String>,
    /// The bytes as they came, little-endian.
    pub bytes: Vec<u8>,
    /// The value in words, with its unit.
    pub text: String,
}

/// One node's view of a PDO.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PdoContents {
    /// The node.
    pub node: u8,
    /// Receive or transmit.
    pub direction: Direction,
    /// Number, from 1.
    pub number: u16,
    /// The mapped objects, if the mapping is known; as far as the frame's bytes go.
    pub values: Option<Vec<ObjectValue>>,
    /// Bytes that no mapped object accounts for; with an unknown mapping all of them.
    pub rest: Vec<u8>,
}

/// What a frame means.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Meaning {
    /// An NMT command; `node` is `None` for all nodes.
    Nmt {
        /// The command in words.
        command: String,
        /// Addressee.
        node: Option<u8>,
    },
    /// SYNC, with its counter if it has one.
    Sync {
        /// 1 to 240.
        counter: Option<u8>,
    },
    /// TIME stamp.
    Time {
        /// Milliseconds after midnight.
        milliseconds: u32,
        /// Days since 1984-01-01; `None` in the P3's four-byte form (P36).
        days: Option<u16>,
    },
    /// An emergency, or the end of one.
    Emergency {
        /// Who.
        node: u8,
        /// Error code.
        code: u16,
        /// The code in words.
        text: String,
        /// Error register 0x1001.
        register: u8,
        /// Its bits in words.
        register_text: String,
        /// The maker's bytes.
        vendor: [u8; 5],
    },
    /// A PDO, as each node that it concerns sees it.
    Pdo {
        /// At least one.
        nodes: Vec<PdoContents>,
    },
    /// An SDO read request.
    Read {
        /// Server.
        node: u8,
        /// Index.
        index: u16,
        /// Sub-index.
        sub: u8,
        /// Name, if known.
        name: Option<String>,
    },
    /// An SDO write request.
    Write {
        /// Server.
        node: u8,
        /// What is to be written.
        value: ObjectValue,
    },
    /// The answer to a read request.
    Value {
        /// Server.
        node: u8,
        /// What was read.
        value: ObjectValue,
    },
    /// The acknowledge of a write.
    Written {
        /// Server.
        node: u8,
        /// Index.
        index: u16,
        /// Sub-index.
        sub: u8,
        /// Name, if known.
        name: Option<String>,
    },
    /// An abort; by the server a refusal.
    Abort {
        /// Server.
        node: u8,
        /// Index.
        index: u16,
        /// Sub-index.
        sub: u8,
        /// Name, if known.
        name: Option<String>,
        /// Abort code.
        code: u32,
        /// The code in words.
        text: String,
        /// Whether the client sent it.
        by_client: bool,
    },
    /// Another part of an SDO transfer: segments, blocks.
    Transfer {
        /// Server.
        node: u8,
        /// In words.
        text: String,
    },
    /// Boot-up.
    BootUp {
        /// Who.
        node: u8,
    },
    /// A heartbeat, or the answer to node guarding.
    Heartbeat {
        /// Who.
        node: u8,
        /// NMT state in words.
        state: String,
    },
    /// A remote frame: node guarding, or a PDO asked for.
    Remote {
        /// In words.
        text: String,
    },
    /// Layer setting services.
    Lss {
        /// Whether the master sent it.
        by_master: bool,
        /// Command specifier.
        command: u8,
        /// In words.
        text: String,
    },
    /// A frame of a known service with contents it cannot have.
    Malformed {
        /// What is wrong.
        text: String,
    },
    /// No CANopen service that is known here.
    Unknown,
}

/// `0x6041,0 Statusword`.
fn write_object(
    f: &mut fmt::Formatter<'_>,
    index: u16,
    sub: u8,
    name: &Option<String>,
) -> fmt::Result {
    write!(f, "0x{index:04X},{sub}")?;
    match name {
        Some(name) => write!(f, " {name}"),
        None => Ok(()),
    }
}

impl fmt::Display for ObjectValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_object(f, self.index, self.sub, &self.name)?;
        write!(f, " = {}", self.text)
    }
}

impl fmt::Display for PdoContents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.direction {
            Direction::Receive => "RPDO",
            Direction::Transmit => "TPDO",
        };
        write!(f, "node {} {kind}{}", self.node, self.number)?;
        let mut separator = ": ";
        for value in self.values.iter().flatten() {
            write!(f, "{separator}{value}")?;
            separator = "; ";
        }
        if self.values.is_none() && !self.rest.is_empty() {
            write!(f, ", mapping unknown")?;
        } else if !self.rest.is_empty() {
            let plural = if self.rest.len() == 1 { "" } else { "s" };
            write!(f, "{separator}{} byte{plural} not mapped", self.rest.len())?;
        }
        Ok(())
    }
}

impl fmt::Display for Meaning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Meaning::Nmt {
                command,
                node: Some(node),
            } => write!(f, "NMT: {command}, node {node}"),
            Meaning::Nmt {
                command,
                node: None,
            } => write!(f, "NMT: {command}, all nodes"),
            Meaning::Sync {
                counter: Some(counter),
            } => write!(f, "SYNC {counter}"),
            Meaning::Sync { counter: None } => f.write_str("SYNC"),
            Meaning::Time { milliseconds, days } => {
                write!(f, "TIME {milliseconds} ms after midnight")?;
                days.map_or(Ok(()), |days| write!(f, ", {days} days since 1984-01-01"))
            }
            Meaning::Emergency {
                node,
                code,
                text,
                register,
                register_text,
                vendor,
            } => {
                write!(f, "node {node} emergency 0x{code:04X}: {text}")?;
                write!(f, "; error register 0x{register:02X}: {register_text}")?;
                if vendor.iter().any(|byte| *byte != 0) {
                    f.write_str("; maker's bytes")?;
                    vendor
                        .iter()
                        .try_for_each(|byte| write!(f, " {byte:02X}"))?;
                }
                Ok(())
            }
            Meaning::Pdo { nodes } => {
                for (n, contents) in nodes.iter().enumerate() {
                    let separator = if n == 0 { "" } else { " | " };
                    write!(f, "{separator}{contents}")?;
                }
                Ok(())
            }
            Meaning::Read {
                node,
                index,
                sub,
                name,
            } => {
                write!(f, "read node {node} ")?;
                write_object(f, *index, *sub, name)
            }
            Meaning::Write { node, value } => write!(f, "write node {node} {value}"),
            Meaning::Value { node, value } => write!(f, "node {node} answers {value}"),
            Meaning::Written {
                node,
                index,
                sub,
                name,
            } => {
                write!(f, "node {node} has written ")?;
                write_object(f, *index, *sub, name)
            }
            Meaning::Abort {
                node,
                index,
                sub,
                name,
                code,
                text,
                by_client,
            } => {
                match by_client {
                    true => write!(f, "client aborts at node {node} ")?,
                    false => write!(f, "node {node} refuses ")?,
                }
                write_object(f, *index, *sub, name)?;
                write!(f, ": 0x{code:08X} {text}")
            }
            Meaning::Transfer { node, text } => write!(f, "node {node} SDO: {text}"),
            Meaning::BootUp { node } => write!(f, "node {node} boot-up"),
            Meaning::Heartbeat { node, state } => write!(f, "node {node} heartbeat: {state}"),
            Meaning::Remote { text } => write!(f, "remote frame: {text}"),
            Meaning::Lss {
                by_master, text, ..
            } => {
                let who = if *by_master { "master" } else { "slave" };
                write!(f, "LSS {who}: {text}")
            }
            Meaning::Malformed { text } => write!(f, "malformed: {text}"),
            Meaning::Unknown => f.write_str("not a CANopen service known here"),
        }
    }
}

/// A line of a trace: seconds, identifier, length, data, meaning.
impl fmt::Display for Decoded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ns = self.at.0;
        write!(
            f,
            "{:5}.{:06}  ",
            ns / 1_000_000_000,
            ns % 1_000_000_000 / 1_000
        )?;
        let id = match self.frame.is_extended() {
            true => format!("0x{:08X}", self.frame.raw_id()),
            false => format!("0x{:03X}", self.frame.raw_id()),
        };
        let data: Vec<String> = self
            .frame
            .data()
            .iter()
            .map(|byte| format!("{byte:02X}"))
            .collect();
        let data = if self.frame.is_remote() {
            "remote".to_owned()
        } else {
            data.join(" ")
        };
        write!(f, "{id} {} {data:23}  {}", self.frame.len(), self.meaning)
    }
}
