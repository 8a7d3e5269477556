//! The line that a script waits for: which drives there are.

use ::sim::{Bus, Place, VirtualDrive};
use canopen::NodeId;

use crate::node_list::NodeList;

/// `ready: 3 virtual p3 drives, nodes 1-3`, or `ready: 3 virtual drives, nodes 1-3: 1-2 p3, 3 md80`, as
/// the drives of `bus` have booted.
pub(super) fn line(bus: &Bus) -> String {
    let drives = bus.drives();
    let mut nodes: Vec<NodeId> = drives.iter().filter_map(|drive| drive.node()).collect();
    let without = drives.len() - nodes.len();
    nodes.sort();
    nodes.dedup();
    let word = match drives.len() {
        1 => "drive",
        _ => "drives",
    };
    let kinds = kinds(drives);
    let mut line = match kinds.as_slice() {
        [(kind, _)] => format!("ready: {} virtual {kind} {word}", drives.len()),
        _ => format!("ready: {} virtual {word}", drives.len()),
    };
    if let Some(list) = NodeList::of(&nodes) {
        let word = match nodes.len() {
            1 => "node",
            _ => "nodes",
        };
        line.push_str(&format!(", {word} {list}"));
    }
    if without > 0 {
        line.push_str(&format!(", {without} without a node ID"));
    }
    if kinds.len() > 1 {
        let kinds = kinds.iter();
        let kinds: Vec<String> = kinds
            .map(|(kind, places)| format!("{} {kind}", written(places)))
            .collect();
        line.push_str(&format!(": {}", kinds.join(", ")));
    }
    let by_lss: Vec<String> = drives
        .iter()
        .filter(|drive| drive.node() != drive.place().node())
        .map(|drive| match drive.node() {
            Some(node) => format!("drive {} is node {node}", drive.place()),
            None => format!("drive {} has no node ID", drive.place()),
        })
        .collect();
    if !by_lss.is_empty() {
        line.push_str(&format!("; stored by LSS: {}", by_lss.join(", ")));
    }
    line
}

/// Who sends nothing and hears no SDO yet, and what ends that.
pub(super) fn mute(bus: &Bus) -> Option<String> {
    let waits = |drive: &&VirtualDrive| !drive.personality().device.dialect.boot_up;
    let drives = bus.drives().iter().filter(waits);
    let places: Vec<Place> = drives.map(VirtualDrive::place).collect();
    let word = match places.len() {
        0 => return None,
        1 => "drive",
        _ => "drives",
    };
    Some(format!(
        "{word} {}: mute until the first NMT message, as the document says: servobus nmt pre-operational",
        written(&places)
    ))
}

/// The kinds of drives in the order of their first places, and where each is.
fn kinds(drives: &[VirtualDrive]) -> Vec<(&'static str, Vec<Place>)> {
    let mut kinds: Vec<(&str, Vec<Place>)> = Vec::new();
    for drive in drives {
        let name = drive.personality().name;
        match kinds.iter_mut().find(|(kind, _)| *kind == name) {
            Some((_, places)) => places.push(drive.place()),
            None => kinds.push((name, vec![drive.place()])),
        }
    }
    kinds
}

/// `1-3,5,u1`.
fn written(places: &[Place]) -> String {
    let nodes: Vec<NodeId> = places.iter().filter_map(|place| place.node()).collect();
    let nodes = NodeList::of(&nodes).map(|nodes| nodes.to_string());
    let others = places.iter().filter(|place| place.node().is_none());
    let parts = nodes.into_iter().chain(others.map(Place::to_string));
    parts.collect::<Vec<_>>().join(",")
}
