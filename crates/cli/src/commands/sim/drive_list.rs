//! Which drives there shall be: `5`, `1-3`, `unconfigured:3`, `1-2,unconfigured:3`.

use std::fmt;
use std::str::FromStr;

use ::sim::Place;

use crate::node_list::{NodeList, NodeListError};

/// What stands before the number of drives without a node ID.
const UNCONFIGURED: &str = "unconfigured:";

/// Places of drives, those with a node ID first; at least one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct DriveList {
    nodes: Option<NodeList>,
    unconfigured: u8,
}

/// Why a text is no list of drives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum DriveListError {
    /// The node IDs are wrong.
    Nodes(NodeListError),
    /// The number of drives without one is wrong.
    Count(String),
    /// That number is there twice.
    Twice,
}

impl fmt::Display for DriveListError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DriveListError::Nodes(error) => {
                write!(
                    f,
                    "{error}; for drives without a node ID write unconfigured:3"
                )
            }
            DriveListError::Count(text) => write!(
                f,
                "'{text}' is no number of drives; write unconfigured:3, with a number from 1 to 127"
            ),
            DriveListError::Twice => {
                f.write_str("unconfigured: is there twice; write it once, with the sum")
            }
        }
    }
}

impl std::error::Error for DriveListError {}

impl FromStr for DriveList {
    type Err = DriveListError;

    fn from_str(text: &str) -> Result<DriveList, DriveListError> {
        let mut unconfigured = 0;
        let mut nodes = Vec::new();
        for part in text.split(',') {
            let Some(count) = part.trim().strip_prefix(UNCONFIGURED) else {
                nodes.push(part);
                continue;
            };
            if unconfigured > 0 {
                return Err(DriveListError::Twice);
            }
            unconfigured = match count.parse() {
                Ok(count @ 1..=127) => count,
                _ => return Err(DriveListError::Count(count.to_owned())),
            };
        }
        let nodes = match nodes.is_empty() {
            true => None,
            false => Some(nodes.join(",").parse().map_err(DriveListError::Nodes)?),
        };
        Ok(DriveList {
            nodes,
            unconfigured,
        })
    }
}

impl DriveList {
    /// The places.
    pub(super) fn places(&self) -> impl Iterator<Item = Place> {
        let nodes = self.nodes.iter().flat_map(NodeList::nodes);
        let nodes = nodes.map(|node| Place::of_node(*node));
        nodes.chain((1..=self.unconfigured).filter_map(Place::unconfigured))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drives_with_and_without_a_node_id() {
        for (text, places) in [
            ("1-2", &["1", "2"][..]),
            ("unconfigured:2", &["u1", "u2"]),
            ("4,unconfigured:1,1", &["1", "4", "u1"]),
        ] {
            let list: DriveList = text.parse().unwrap();
            let written: Vec<String> = list.places().map(|place| place.to_string()).collect();
            assert_eq!(written, places, "{text}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for (text, why) in [
            ("unconfigured:0", "'0' is no number of drives"),
            ("unconfigured:128", "1 to 127"),
            ("unconfigured:", "'' is no number"),
            ("unconfigured:1,unconfigured:2", "twice"),
            ("unconfigured", "'unconfigured' is no node ID"),
            ("1,1,unconfigured:1", "node 1 is there twice"),
            ("", "a node ID is missing"),
        ] {
            let error = text.parse::<DriveList>().unwrap_err().to_string();
            assert!(error.contains(why), "{text}: {error}");
        }
    }
}
