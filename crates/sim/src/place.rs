//! Which drive of a bus.

use std::fmt;
use std::str::FromStr;

use canopen::NodeId;

/// What the places of drives without a node ID are counted from.
const UNCONFIGURED: u8 = 128;

/// Which drive of its bus, whatever node ID it has at the time: LSS may change that.
///
/// A drive that is set up with a node ID has the place of that number, written `5`. The drives that
/// are set up without one are counted from 1 and have the places behind: `u1`, `u2`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place(u8);

impl Place {
    /// The place of the drive that is set up as `node`.
    pub const fn of_node(node: NodeId) -> Place {
        Place(node.get())
    }

    /// The place of the drive that is set up without a node ID, `number` of those, from 1 to 127.
    pub const fn unconfigured(number: u8) -> Option<Place> {
        match number {
            1..=127 => Some(Place(UNCONFIGURED + number)),
            _ => None,
        }
    }

    /// The node ID with which the drive is set up.
    pub fn node(self) -> Option<NodeId> {
        NodeId::new(self.0)
    }

    /// Different for each place: 1 to 127, and 129 to 255.
    pub const fn number(self) -> u8 {
        self.0
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.node() {
            Some(node) => write!(f, "{node}"),
            None => write!(f, "u{}", self.0 - UNCONFIGURED),
        }
    }
}

/// A text that names no [`Place`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a node ID is a number from 1 to 127; drives without one are called u1 to u127")]
pub struct NoPlace;

impl FromStr for Place {
    type Err = NoPlace;

    fn from_str(text: &str) -> Result<Place, NoPlace> {
        let digits = text.strip_prefix('u');
        let number = digits.unwrap_or(text).parse::<u8>().map_err(|_| NoPlace)?;
        let place = match digits {
            Some(_) => Place::unconfigured(number),
            None => NodeId::new(number).map(Place::of_node),
        };
        place.ok_or(NoPlace)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_as_they_are_written_and_keep_their_order() {
        let configured = (1..=127).filter_map(NodeId::new).map(Place::of_node);
        let all: Vec<Place> = configured
            .chain((1..=127).filter_map(Place::unconfigured))
            .collect();
        assert_eq!(all.len(), 254);
        assert!(all.is_sorted());
        for place in all {
            assert_eq!(place.to_string().parse(), Ok(place));
        }
        for wrong in ["", "0", "128", "u0", "u128", "u", "u-1", "x1", "256"] {
            assert_eq!(wrong.parse::<Place>(), Err(NoPlace), "{wrong}");
        }
        assert_eq!(Place::unconfigured(0), None);
    }
}
