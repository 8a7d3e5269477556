//! Which drive is at which node: `1=p3`, `2-3=md80`.

use std::fmt;
use std::str::FromStr;

use canopen::NodeId;
use personalities::Personality;

use crate::node_list::{NodeList, NodeListError};
use crate::{Failure, drive_kind};

/// Drives of one kind at some nodes.
#[derive(Clone, Debug)]
pub(crate) struct NamedDrives {
    nodes: NodeList,
    kind: &'static Personality,
}

/// Why a text names no drives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum NamedDrivesError {
    /// There is no `=` in it.
    NoKind(String),
    /// What stands before the `=`.
    Nodes(NodeListError),
    /// What stands behind it: no drive is called that.
    Kind(String),
}

impl fmt::Display for NamedDrivesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NamedDrivesError::NoKind(text) => {
                let nodes = if text.is_empty() { "1" } else { text };
                write!(f, "it does not say which drive that is; write {nodes}=p3")
            }
            NamedDrivesError::Nodes(error) => write!(f, "{error}"),
            NamedDrivesError::Kind(name) => {
                write!(
                    f,
                    "no drive is called '{name}'; there are: {}",
                    drive_kind::names()
                )
            }
        }
    }
}

impl std::error::Error for NamedDrivesError {}

impl FromStr for NamedDrives {
    type Err = NamedDrivesError;

    fn from_str(text: &str) -> Result<NamedDrives, NamedDrivesError> {
        let Some((nodes, name)) = text.split_once('=') else {
            return Err(NamedDrivesError::NoKind(text.to_owned()));
        };
        let nodes = nodes.trim().parse().map_err(NamedDrivesError::Nodes)?;
        let name = name.trim();
        let kind =
            personalities::by_name(name).ok_or_else(|| NamedDrivesError::Kind(name.to_owned()))?;
        Ok(NamedDrives { nodes, kind })
    }
}

impl NamedDrives {
    /// The nodes and the drive that is there.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = (NodeId, &'static Personality)> {
        self.nodes.nodes().iter().map(|node| (*node, self.kind))
    }
}

/// All of them, in the order of their nodes.
///
/// # Errors
/// A node that is there twice.
pub(crate) fn all(named: &[NamedDrives]) -> Result<Vec<(NodeId, &'static Personality)>, Failure> {
    let mut drives: Vec<(NodeId, &'static Personality)> = Vec::new();
    for (node, kind) in named.iter().flat_map(NamedDrives::nodes) {
        if drives.iter().any(|(other, _)| *other == node) {
            return Err(Failure::input(format!(
                "--node names node {node} twice; name every node once"
            )));
        }
        drives.push((node, kind));
    }
    drives.sort_by_key(|(node, _)| *node);
    Ok(drives)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(words: &[&str]) -> Result<String, Failure> {
        let named: Vec<NamedDrives> = words.iter().map(|word| word.parse().unwrap()).collect();
        let drives = all(&named)?;
        let drives = drives
            .iter()
            .map(|(place, kind)| format!("{place} {}", kind.name));
        Ok(drives.collect::<Vec<_>>().join(", "))
    }

    #[test]
    fn drives_come_in_the_order_of_their_nodes() {
        for (words, drives) in [
            (&["1=p3"][..], "1 p3"),
            (&["7=p3", "2=p3-extended"], "2 p3-extended, 7 p3"),
            (
                &["1,5=p3-extended", "2 - 3 = p3"],
                "1 p3-extended, 2 p3, 3 p3, 5 p3-extended",
            ),
        ] {
            assert_eq!(read(words).unwrap(), drives, "{words:?}");
        }
        assert!(read(&["1-3=p3", "2=p3-extended"]).is_err());
    }

    #[test]
    fn nonsense_is_refused() {
        for (text, why) in [
            ("", "write 1=p3"),
            ("4", "write 4=p3"),
            ("=p3", "a node ID is missing"),
            ("0=p3", "there is no node 0; node IDs are 1 to 127"),
            ("128=p3", "there is no node 128"),
            ("1,1=p3", "node 1 is there twice"),
            ("u1=p3", "'u1' is no node ID"),
            ("1=", "no drive is called ''; there are: p3, "),
            ("1=p4", "no drive is called 'p4'; there are: p3, "),
            ("1=p3=p3", "no drive is called 'p3=p3'"),
        ] {
            let error = text.parse::<NamedDrives>().unwrap_err().to_string();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
