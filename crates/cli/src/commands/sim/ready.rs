//! The line that a script waits for: which drives there are.

use ::sim::Bus;
use canopen::NodeId;
use personalities::Personality;

use crate::node_list::NodeList;

/// `ready: 3 virtual p3 drives, nodes 1-3`, as the drives of `bus` have booted.
pub(super) fn line(kinds: &[&Personality], bus: &Bus) -> String {
    let drives = bus.drives();
    let names: Vec<&str> = kinds.iter().map(|kind| kind.name).collect();
    let mut nodes: Vec<NodeId> = drives.iter().filter_map(|drive| drive.node()).collect();
    let without = drives.len() - nodes.len();
    nodes.sort();
    nodes.dedup();
    let word = match drives.len() {
        1 => "drive",
        _ => "drives",
    };
    let mut line = format!(
        "ready: {} virtual {} {word}",
        drives.len(),
        names.join(" and ")
    );
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
