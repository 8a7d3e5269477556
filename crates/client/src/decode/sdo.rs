//! SDO transfers in words, and what is learned from them.

use can::Frame;
use canopen::{Address, NodeId};

use super::frame::Node;
use super::meaning::Meaning;
use super::object;
use crate::sdo::{Answer, Data, Request};

/// A request on its way from the client.
pub(super) fn request(node: NodeId, known: &mut Node, frame: &Frame) -> Meaning {
    let number = node.get();
    let table = known.words.table;
    match Request::parse(frame) {
        None => Meaning::Malformed {
            text: format!(
                "SDO request to node {number} of {} bytes, under 4",
                frame.len()
            ),
        },
        Some(Request::Upload(address)) => Meaning::Read {
            node: number,
            index: address.index,
            sub: address.sub,
            name: object::name(table.as_ref(), address),
        },
        Some(Request::Download(address, data)) => {
            let value = object::value(known, address, data);
            known.pending = Some((address, data));
            Meaning::Write {
                node: number,
                value,
            }
        }
        Some(Request::SegmentedDownload(address, bytes)) => Meaning::Transfer {
            node: number,
            text: segmented("write", address, bytes),
        },
        Some(Request::Abort(address, abort)) => {
            known.pending = None;
            aborted(number, known, address, abort, true)
        }
        Some(Request::Other { command }) => Meaning::Transfer {
            node: number,
            text: format!("request 0x{command:02X}, {}", protocol(command >> 5, true)),
        },
    }
}

/// An answer on its way from the server.
pub(super) fn answer(node: NodeId, known: &mut Node, frame: &Frame) -> Meaning {
    let number = node.get();
    match Answer::parse(frame) {
        None => Meaning::Malformed {
            text: format!(
                "SDO answer of node {number} of {} bytes, under 4",
                frame.len()
            ),
        },
        Some(Answer::Uploaded(address, data)) => {
            learn(known, address, data);
            let value = object::value(known, address, data);
            Meaning::Value {
                node: number,
                value,
            }
        }
        Some(Answer::Downloaded(address)) => {
            match known.pending.take() {
                Some((asked, data)) if asked == address => learn(known, address, data),
                _ => {}
            }
            Meaning::Written {
                node: number,
                index: address.index,
                sub: address.sub,
                name: object::name(known.words.table.as_ref(), address),
            }
        }
        Some(Answer::Aborted(address, abort)) => {
            known.pending = None;
            aborted(number, known, address, abort, false)
        }
        Some(Answer::SegmentedUpload(address, bytes)) => Meaning::Transfer {
            node: number,
            text: segmented("read", address, bytes),
        },
        Some(Answer::Other { command }) => Meaning::Transfer {
            node: number,
            text: format!("answer 0x{command:02X}, {}", protocol(command >> 5, false)),
        },
    }
}

/// Notes what an object holds now.
fn learn(known: &mut Node, address: Address, data: Data) {
    if data.bytes().is_empty() {
        return;
    }
    known.modes.learn(address, data.bytes());
    known.pdos.learn(address, data.raw());
}

fn aborted(
    node: u8,
    known: &Node,
    address: Address,
    abort: canopen::Abort,
    by_client: bool,
) -> Meaning {
    Meaning::Abort {
        node,
        index: address.index,
        sub: address.sub,
        name: object::name(known.words.table.as_ref(), address),
        code: abort.0,
        text: abort.text().unwrap_or("unknown abort code").to_owned(),
        by_client,
    }
}

fn segmented(way: &str, address: Address, bytes: Option<u32>) -> String {
    match bytes {
        Some(bytes) => format!("segmented {way} of {address}, {bytes} bytes"),
        None => format!("segmented {way} of {address}"),
    }
}

/// The protocol that a command specifier belongs to (CiA 301 7.2.4.3).
fn protocol(specifier: u8, from_client: bool) -> &'static str {
    match (specifier, from_client) {
        (0, true) | (1, false) => "download segment",
        (3, true) | (0, false) => "upload segment",
        (5 | 6, _) => "block transfer",
        _ => "unknown command",
    }
}
