//! The serial lines of drives that have one: which are offered, and what goes over them.

use std::fmt;
use std::str::FromStr;

use ::sim::{Bus, Place, SerialAct};
use bus::{NoSerialEndpoint, SerialEndpoint, SerialEvent, SerialLines};
use canopen::NodeId;
use personalities::Personality;

use super::stage::Log;
use crate::Failure;
use crate::output::tell;

/// The longest line of a drive that is written down as one.
const LONGEST_LINE: usize = 256;

/// A serial line that is to be offered: `pty`, or `2=tcp://127.0.0.1:29540` for that of node 2.
#[derive(Clone, Debug)]
pub(super) struct SerialDoor {
    node: Option<NodeId>,
    endpoint: SerialEndpoint,
}

/// Why a text is none.
#[derive(Clone, Debug)]
pub(super) enum NoSerialDoor {
    Node(String),
    Endpoint(NoSerialEndpoint),
}

impl fmt::Display for NoSerialDoor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoSerialDoor::Node(text) => write!(
                f,
                "'{text}' is no node ID, which is a number from 1 to 127: write \
                 2=tcp://127.0.0.1:29540 for the line of node 2"
            ),
            NoSerialDoor::Endpoint(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for NoSerialDoor {}

impl FromStr for SerialDoor {
    type Err = NoSerialDoor;

    fn from_str(text: &str) -> Result<SerialDoor, NoSerialDoor> {
        let (node, endpoint) = match text.split_once('=') {
            Some((node, endpoint)) => {
                let id = node.parse().ok().and_then(NodeId::new);
                let id = id.ok_or_else(|| NoSerialDoor::Node(node.to_owned()))?;
                (Some(id), endpoint)
            }
            None => (None, text),
        };
        let endpoint = endpoint.parse().map_err(NoSerialDoor::Endpoint)?;
        Ok(SerialDoor { node, endpoint })
    }
}

/// The lines that are offered.
#[derive(Debug)]
pub(super) struct Serial {
    lines: SerialLines,
    offered: Vec<Offered>,
}

/// One of them.
#[derive(Debug)]
struct Offered {
    place: Place,
    /// What the drive has sent of a line that is not at its end.
    line: Vec<u8>,
}

impl Serial {
    /// Opens them; `None` if there are none.
    ///
    /// # Errors
    /// A drive that is not there or has no serial line, and what the system refuses.
    pub(super) fn open(
        doors: &[SerialDoor],
        drives: &[(Place, &'static Personality)],
        public: bool,
    ) -> Result<Option<Serial>, Failure> {
        if doors.is_empty() {
            return Ok(None);
        }
        let places = choose(doors, drives)?;
        let endpoints: Vec<SerialEndpoint> =
            doors.iter().map(|door| door.endpoint.clone()).collect();
        let lines = SerialLines::open(&endpoints, public).map_err(Failure::input)?;
        let offered = places.into_iter().map(|place| Offered {
            place,
            line: Vec::new(),
        });
        Ok(Some(Serial {
            lines,
            offered: offered.collect(),
        }))
    }

    /// A line for each: `serial tcp://127.0.0.1:29540 node 1`.
    pub(super) fn addresses(&self) -> Vec<String> {
        let offered = self.lines.addresses().iter().zip(&self.offered);
        offered
            .map(|(address, offered)| format!("serial {address} node {}", offered.place))
            .collect()
    }

    /// Hands over what came; whether there was anything.
    pub(super) fn admit(&mut self, bus: &mut Bus, log: &mut Option<Log>) -> Result<bool, Failure> {
        let mut any = false;
        for (number, offered) in self.offered.iter().enumerate() {
            let place = offered.place;
            while let Some(event) = self.lines.take(number, bus.serial_room(place)) {
                let act = match event {
                    SerialEvent::Connected => {
                        tell(format_args!(
                            "a program is at the serial line of drive {place}"
                        ));
                        continue;
                    }
                    SerialEvent::Bytes(bytes) => SerialAct::Bytes(bytes),
                    SerialEvent::HungUp => {
                        tell(format_args!("it has left the serial line of drive {place}"));
                        SerialAct::HangUp
                    }
                };
                let at = bus.now();
                bus.run_until(at);
                if let Some(log) = log {
                    log.write(|recording| recording.serial(at, place, &act))?;
                }
                bus.act_on_serial(place, &act);
                any = true;
            }
        }
        Ok(any)
    }

    /// Gives out what the drives have sent; whether there was anything.
    pub(super) fn deliver(
        &mut self,
        bus: &mut Bus,
        log: &mut Option<Log>,
    ) -> Result<bool, Failure> {
        let sent = bus.take_serial();
        for byte in &sent {
            let mut offered = self.offered.iter_mut().enumerate();
            let Some((number, offered)) = offered.find(|(_, one)| one.place == byte.place) else {
                continue;
            };
            self.lines.send(number, &[byte.byte]);
            if byte.byte != b'\r' {
                offered.line.push(byte.byte);
            }
            if byte.byte == b'\r' || offered.line.len() >= LONGEST_LINE {
                let line = std::mem::take(&mut offered.line);
                if let Some(log) = log {
                    log.write(|recording| recording.serial_answer(byte.at, byte.place, &line))?;
                }
            }
        }
        Ok(!sent.is_empty())
    }
}

/// Whose lines they are. Without a node ID it is that of the first drive that has one, and that no
/// other was given.
fn choose(
    doors: &[SerialDoor],
    drives: &[(Place, &'static Personality)],
) -> Result<Vec<Place>, Failure> {
    let mut chosen: Vec<Place> = Vec::new();
    let named: Vec<NodeId> = doors.iter().filter_map(|door| door.node).collect();
    for door in doors {
        let place = match door.node {
            Some(node) => {
                let mut drives = drives.iter();
                let drive = drives.find(|(place, _)| place.node() == Some(node));
                let Some((place, kind)) = drive else {
                    return Err(Failure::input(format!(
                        "--serial {node}={}: there is no drive with node ID {node}",
                        door.endpoint
                    )));
                };
                if kind.serial.is_none() {
                    return Err(Failure::input(format!(
                        "--serial {node}={}: {} has no serial command line; {}",
                        door.endpoint,
                        kind.name,
                        who_has_one()
                    )));
                }
                *place
            }
            None => {
                let free = |place: &Place| {
                    let is_named = place.node().is_some_and(|node| named.contains(&node));
                    !is_named && !chosen.contains(place)
                };
                let mut able = drives.iter().filter(|(_, kind)| kind.serial.is_some());
                let Some((place, _)) = able.find(|(place, _)| free(place)) else {
                    return Err(Failure::input(format!(
                        "--serial {}: no drive is left that has a serial command line; {}",
                        door.endpoint,
                        who_has_one()
                    )));
                };
                *place
            }
        };
        if chosen.contains(&place) {
            return Err(Failure::input(format!(
                "--serial names drive {place} twice; a serial line has one other end"
            )));
        }
        chosen.push(place);
    }
    Ok(chosen)
}

/// What to do for a drive with a serial line.
fn who_has_one() -> String {
    let able = personalities::ALL
        .iter()
        .filter(|kind| kind.serial.is_some());
    let names: Vec<String> = able.map(|kind| format!("--drive {}", kind.name)).collect();
    match names.is_empty() {
        true => "none of the drives has one".to_owned(),
        false => format!("use {}", names.join(" or ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts() {
        let parse = |text: &str| text.parse::<SerialDoor>();
        let door = parse("2=tcp://127.0.0.1:29540").unwrap();
        assert_eq!(door.node, NodeId::new(2));
        assert_eq!(door.endpoint.to_string(), "tcp://127.0.0.1:29540");
        assert_eq!(parse("pty").unwrap().node, None);
        for text in ["0=pty", "128=pty", "x=pty", "=pty"] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains("is no node ID"), "{error}");
        }
        for text in ["1=", "1=com1", "1=1=pty", ""] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains("is no place for a serial line"), "{error}");
        }
    }
}
