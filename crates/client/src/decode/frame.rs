//! From a frame to its service.

use std::collections::BTreeMap;

use can::Frame;
use canopen::lss::{Answer, Request};
use canopen::nmt::Command;
use canopen::{Address, Emergency, Instant, NmtState, NodeId};

use super::emergency;
use super::meaning::{Decoded, Direction, Meaning, PdoContents};
use super::modes::Modes;
use super::pdo::{Pdos, predefined};
use super::words::DriveWords;
use super::{object, sdo};
use crate::sdo::Data;

/// What is known of a node.
#[derive(Clone, Debug, Default)]
pub(super) struct Node {
    pub(super) words: DriveWords,
    pub(super) modes: Modes,
    pub(super) pdos: Pdos,
    /// A write that was not acknowledged yet.
    pub(super) pending: Option<(Address, Data)>,
}

/// Puts the frames of one bus into words. Give it every frame, in their order.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    words: DriveWords,
    nodes: BTreeMap<NodeId, Node>,
}

impl Decoder {
    /// A decoder that knows the standard's objects only.
    pub fn new() -> Decoder {
        Decoder::default()
    }

    /// A decoder that takes every node for a drive with these words.
    pub fn with_words(words: DriveWords) -> Decoder {
        Decoder {
            words,
            ..Decoder::default()
        }
    }

    /// Takes `node` for a drive with these words.
    pub fn set_drive(&mut self, node: NodeId, words: DriveWords) {
        self.node(node).words = words;
    }

    fn node(&mut self, node: NodeId) -> &mut Node {
        let words = self.words;
        self.nodes.entry(node).or_insert_with(|| Node {
            words,
            ..Node::default()
        })
    }

    /// What `frame` means, after all that came before. `at` is passed on.
    pub fn decode(&mut self, at: Instant, frame: &Frame) -> Decoded {
        Decoded {
            at,
            frame: *frame,
            meaning: self.meaning(frame),
        }
    }

    fn meaning(&mut self, frame: &Frame) -> Meaning {
        if frame.is_extended() {
            return Meaning::Unknown;
        }
        let id = frame.raw_id() as u16;
        if frame.is_remote() {
            return remote(id);
        }
        // A COB-ID that a node was given stands before the predefined meaning of the identifier.
        let pdos = self.pdos(id, frame.data());
        if !pdos.is_empty() {
            return Meaning::Pdo { nodes: pdos };
        }
        let node = NodeId::new((id & 0x7F) as u8);
        match (id, node) {
            (0x000, _) => self.nmt(frame.data()),
            (0x080, _) => sync(frame.data()),
            (0x100, _) => time(frame.data()),
            (0x081..=0x0FF, Some(node)) => emergency(node, &self.node(node).words, frame),
            (0x581..=0x5FF, Some(node)) => sdo::answer(node, self.node(node), frame),
            (0x601..=0x67F, Some(node)) => sdo::request(node, self.node(node), frame),
            (0x701..=0x77F, Some(node)) => error_control(node, frame.data()),
            (0x7E4 | 0x7E5, _) => lss(frame),
            _ => Meaning::Unknown,
        }
    }

    fn nmt(&mut self, data: &[u8]) -> Meaning {
        let &[command, node] = data else {
            let text = format!("NMT command of {} bytes, it has 2", data.len());
            return Meaning::Malformed { text };
        };
        if node > 127 {
            return Meaning::Malformed {
                text: format!("NMT command to node {node}, over 127"),
            };
        }
        let Some(command) = Command::from_byte(command) else {
            return Meaning::Malformed {
                text: format!("NMT command 0x{command:02X}"),
            };
        };
        let node = NodeId::new(node);
        if matches!(command, Command::ResetNode | Command::ResetCommunication) {
            // What a node was told is forgotten, unless it was stored, which cannot be seen here.
            for (known, state) in &mut self.nodes {
                if node.is_none_or(|node| node == *known) {
                    *state = Node {
                        words: state.words,
                        ..Node::default()
                    };
                }
            }
        }
        Meaning::Nmt {
            command: command.to_string(),
            node: node.map(NodeId::get),
        }
    }

    /// The PDO with identifier `id`, as every node sees it that is known to use it.
    fn pdos(&mut self, id: u16, data: &[u8]) -> Vec<PdoContents> {
        // Without any knowledge the identifier alone tells node and number.
        if let (Some(node), Some(_)) = (NodeId::new((id & 0x7F) as u8), predefined(id)) {
            self.node(node);
        }
        let mut seen = Vec::new();
        for (node, known) in &mut self.nodes {
            let Some((direction, number, pdo)) = known.pdos.find(*node, id) else {
                continue;
            };
            let mapping = pdo.and_then(|pdo| pdo.mapping());
            let mut rest = data;
            let mut values = Vec::new();
            let mut bits_before = 0;
            for mapped in mapping.iter().flatten() {
                // Only whole bytes can be taken apart here; what follows a bit field is "rest".
                let bytes = usize::from(mapped.bits / 8);
                if mapped.bits % 8 != 0 || bits_before % 8 != 0 || bytes > rest.len() {
                    break;
                }
                bits_before += u32::from(mapped.bits);
                let (own, after) = rest.split_at(bytes);
                rest = after;
                if let Some(data) = Data::sized(own) {
                    known.modes.learn(mapped.object, own);
                    values.push(object::mapped_value(known, mapped.object, data));
                }
            }
            seen.push(PdoContents {
                node: node.get(),
                direction,
                number: number + 1,
                values: mapping.map(|_| values),
                rest: rest.to_vec(),
            });
        }
        // One that sends before those that listen.
        seen.sort_by_key(|contents| match contents.direction {
            Direction::Transmit => 0,
            Direction::Receive => 1,
        });
        seen
    }
}

/// A request or an answer of layer setting services.
fn lss(frame: &Frame) -> Meaning {
    let [command, ..] = frame.data() else {
        return Meaning::Malformed {
            text: "LSS frame without data".to_owned(),
        };
    };
    let request = Request::from_frame(frame).map(|request| request.to_string());
    let words = request.or_else(|| Answer::from_frame(frame).map(|answer| answer.to_string()));
    Meaning::Lss {
        by_master: frame.raw_id() == 0x7E5,
        command: *command,
        text: words.unwrap_or_else(|| format!("command 0x{command:02X}")),
    }
}

fn remote(id: u16) -> Meaning {
    let text = match (id, predefined(id)) {
        (0x701..=0x77F, _) => format!("node guarding asks node {}", id & 0x7F),
        (_, Some((Direction::Transmit, number))) => {
            format!("asks node {} for TPDO{}", id & 0x7F, number + 1)
        }
        _ => format!("asks for 0x{id:03X}"),
    };
    Meaning::Remote { text }
}

fn sync(data: &[u8]) -> Meaning {
    match data {
        [] => Meaning::Sync { counter: None },
        [counter] => Meaning::Sync {
            counter: Some(*counter),
        },
        _ => Meaning::Malformed {
            text: format!("SYNC of {} bytes", data.len()),
        },
    }
}

/// CiA 301 7.1.6.6: 28 bits of milliseconds, then days.
fn time(data: &[u8]) -> Meaning {
    let (milliseconds, days) = match *data {
        [a, b, c, d] => ([a, b, c, d], None),
        [a, b, c, d, e, f] => ([a, b, c, d], Some(u16::from_le_bytes([e, f]))),
        _ => {
            let text = format!("TIME of {} bytes, it has 6", data.len());
            return Meaning::Malformed { text };
        }
    };
    Meaning::Time {
        milliseconds: u32::from_le_bytes(milliseconds) & 0x0FFF_FFFF,
        days,
    }
}

fn emergency(node: NodeId, words: &DriveWords, frame: &Frame) -> Meaning {
    if frame.len() != 8 {
        let text = format!(
            "emergency of node {node} of {} bytes, it has 8",
            frame.len()
        );
        return Meaning::Malformed { text };
    }
    let Emergency {
        code,
        register,
        vendor,
    } = Emergency::from_bytes(frame.bytes());
    // The P3 names the error that is gone in the last two bytes (P16).
    let gone = u16::from_le_bytes([vendor[3], vendor[4]]);
    let text = match (code, gone) {
        (0, 1..) => format!("error reset, 0x{gone:04X} {} is gone", words.error(gone)),
        _ => words.error(code).to_owned(),
    };
    let register_text = emergency::register_text(words, register);
    Meaning::Emergency {
        node: node.get(),
        code,
        text,
        register,
        register_text,
        vendor,
    }
}

fn error_control(node: NodeId, data: &[u8]) -> Meaning {
    let node = node.get();
    match *data {
        [0] => Meaning::BootUp { node },
        [state] => match NmtState::from_heartbeat(state) {
            Some(state) => Meaning::Heartbeat {
                node,
                state: state.to_string(),
            },
            None => Meaning::Malformed {
                text: format!("node {node} in state 0x{state:02X}"),
            },
        },
        _ => {
            let text = format!("error control frame of node {node} of {} bytes", data.len());
            Meaning::Malformed { text }
        }
    }
}
