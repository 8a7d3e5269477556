//! Node IDs as people write them: `5`, `1-3`, `1,4`, `1-3,7`.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use canopen::NodeId;

/// Different node IDs in ascending order, at least one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NodeList(Vec<NodeId>);

/// Why a text is no list of node IDs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum NodeListError {
    /// Nothing where a number is needed.
    Empty,
    /// No number.
    NotANumber(String),
    /// 0 or above 127.
    OutOfRange(String),
    /// The end of a range lies before its begin.
    Reversed(NodeId, NodeId),
    /// A node is named twice.
    Twice(NodeId),
}

impl fmt::Display for NodeListError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NodeListError::Empty => f.write_str("a node ID is missing; write 5, 1-3 or 1,4"),
            NodeListError::NotANumber(text) => {
                write!(f, "'{text}' is no node ID; write 5, 1-3 or 1,4")
            }
            NodeListError::OutOfRange(text) => {
                write!(f, "there is no node {text}; node IDs are 1 to 127")
            }
            NodeListError::Reversed(from, to) => {
                write!(f, "the range {from}-{to} runs backwards; write {to}-{from}")
            }
            NodeListError::Twice(node) => {
                write!(f, "node {node} is there twice; name every node once")
            }
        }
    }
}

impl std::error::Error for NodeListError {}

fn node(text: &str) -> Result<NodeId, NodeListError> {
    if text.is_empty() {
        return Err(NodeListError::Empty);
    }
    if !text.bytes().all(|byte| byte.is_ascii_digit()) {
        return Err(NodeListError::NotANumber(text.to_owned()));
    }
    let id = text.parse().ok().and_then(NodeId::new);
    id.ok_or_else(|| NodeListError::OutOfRange(text.to_owned()))
}

impl FromStr for NodeList {
    type Err = NodeListError;

    fn from_str(text: &str) -> Result<NodeList, NodeListError> {
        let mut nodes = Vec::new();
        for part in text.split(',') {
            let (from, to) = match part.split_once('-') {
                Some((from, to)) => (node(from.trim())?, node(to.trim())?),
                None => {
                    let only = node(part.trim())?;
                    (only, only)
                }
            };
            if to < from {
                return Err(NodeListError::Reversed(from, to));
            }
            nodes.extend((from.get()..=to.get()).filter_map(NodeId::new));
        }
        nodes.sort();
        if let Some(pair) = nodes.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(NodeListError::Twice(pair[0]));
        }
        Ok(NodeList(nodes))
    }
}

impl NodeList {
    /// Of different node IDs in ascending order; `None` if there is none.
    pub(crate) fn of(nodes: &[NodeId]) -> Option<NodeList> {
        (!nodes.is_empty()).then(|| NodeList(nodes.to_vec()))
    }

    /// The node IDs in ascending order.
    pub(crate) fn nodes(&self) -> &[NodeId] {
        &self.0
    }

    /// Runs of neighbouring node IDs.
    pub(crate) fn runs(&self) -> Vec<RangeInclusive<u8>> {
        let mut runs: Vec<RangeInclusive<u8>> = Vec::new();
        for id in self.0.iter().map(|node| node.get()) {
            match runs.last_mut() {
                Some(run) if *run.end() + 1 == id => *run = *run.start()..=id,
                _ => runs.push(id..=id),
            }
        }
        runs
    }
}

/// The shortest way to write it.
impl fmt::Display for NodeList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, run) in self.runs().iter().enumerate() {
            let comma = if n == 0 { "" } else { "," };
            write!(f, "{comma}{}", run.start())?;
            if run.end() > run.start() {
                write!(f, "-{}", run.end())?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_read_and_written_in_their_shortest_form() {
        for (text, count, shortest) in [
            ("5", 1, "5"),
            ("1-3", 3, "1-3"),
            ("1,4", 2, "1,4"),
            ("7,1-3", 4, "1-3,7"),
            ("3,2,1", 3, "1-3"),
            ("1 - 2 , 4", 3, "1-2,4"),
            ("1-127", 127, "1-127"),
            ("9-9", 1, "9"),
        ] {
            let list: NodeList = text.parse().unwrap();
            assert_eq!(list.nodes().len(), count, "{text}");
            assert_eq!(list.to_string(), shortest);
        }
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let one = NodeId::new(1).unwrap();
        let three = NodeId::new(3).unwrap();
        for (text, error) in [
            ("", NodeListError::Empty),
            ("1,", NodeListError::Empty),
            ("1-", NodeListError::Empty),
            ("-3", NodeListError::Empty),
            ("0", NodeListError::OutOfRange("0".into())),
            ("128", NodeListError::OutOfRange("128".into())),
            ("0-3", NodeListError::OutOfRange("0".into())),
            (
                "99999999999999999999",
                NodeListError::OutOfRange("99999999999999999999".into()),
            ),
            ("all", NodeListError::NotANumber("all".into())),
            ("+1", NodeListError::NotANumber("+1".into())),
            ("0x1", NodeListError::NotANumber("0x1".into())),
            ("1-2-3", NodeListError::NotANumber("2-3".into())),
            ("3-1", NodeListError::Reversed(three, one)),
            ("1,1", NodeListError::Twice(one)),
            ("1-3,3", NodeListError::Twice(three)),
        ] {
            assert_eq!(text.parse::<NodeList>(), Err(error), "{text}");
        }
    }
}
