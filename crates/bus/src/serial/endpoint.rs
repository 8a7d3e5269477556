//! Where a serial line is offered, as text.

use std::fmt;
use std::str::FromStr;

use crate::Endpoint;

/// Where a serial line is offered: `tcp://HOST:PORT`, or `pty`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SerialEndpoint {
    /// A TCP port; what goes over the socket is what goes over the line, and nothing else.
    Tcp {
        /// Name or address, without brackets.
        host: String,
        /// The port; 0 is any free one.
        port: u16,
    },
    /// A pseudo-terminal of this machine; the system gives it its name.
    Pty,
}

/// A text that is no such place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{0}' is no place for a serial line: write tcp://127.0.0.1:29540 or pty")]
pub struct NoSerialEndpoint(String);

impl SerialEndpoint {
    pub(super) fn with_port(&self, port: u16) -> SerialEndpoint {
        match self {
            SerialEndpoint::Tcp { host, .. } => SerialEndpoint::Tcp {
                host: host.clone(),
                port,
            },
            SerialEndpoint::Pty => SerialEndpoint::Pty,
        }
    }
}

impl fmt::Display for SerialEndpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SerialEndpoint::Tcp { host, port } if host.contains(':') => {
                write!(f, "tcp://[{host}]:{port}")
            }
            SerialEndpoint::Tcp { host, port } => write!(f, "tcp://{host}:{port}"),
            SerialEndpoint::Pty => f.write_str("pty"),
        }
    }
}

impl FromStr for SerialEndpoint {
    type Err = NoSerialEndpoint;

    fn from_str(text: &str) -> Result<SerialEndpoint, NoSerialEndpoint> {
        if text == "pty" {
            return Ok(SerialEndpoint::Pty);
        }
        let wrong = || NoSerialEndpoint(text.to_owned());
        let place = text.strip_prefix("tcp://").ok_or_else(wrong)?;
        // Host and port are written as everywhere else.
        let endpoint: Endpoint = format!("slcan://{place}").parse().map_err(|_| wrong())?;
        Ok(SerialEndpoint::Tcp {
            host: endpoint.host().to_owned(),
            port: endpoint.port(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_ones() {
        for text in [
            "tcp://127.0.0.1:29540",
            "tcp://localhost:0",
            "tcp://[::1]:5",
            "pty",
        ] {
            let endpoint: SerialEndpoint = text.parse().unwrap();
            assert_eq!(endpoint.to_string(), text);
        }
    }

    #[test]
    fn bad_ones() {
        for text in [
            "",
            "tcp",
            "tcp://",
            "tcp://h",
            "tcp://h:",
            "tcp://h:99999",
            "tcp://h:5/x",
            "pty:1",
            "/dev/ttyUSB0",
            "slcan://h:5",
            "127.0.0.1:29540",
        ] {
            let error = text.parse::<SerialEndpoint>().unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("'{text}' is no place")),
                "{error}"
            );
            assert!(error.contains("tcp://127.0.0.1:29540"), "{error}");
        }
    }
}
