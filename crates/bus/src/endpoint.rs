//! Where a bus is reached, as text.

use std::fmt;
use std::net::IpAddr;
use std::str::FromStr;

/// The channel name used where none is given.
pub(crate) const DEFAULT_CHANNEL: &str = "can0";

/// The longest channel name (IFNAMSIZ of Linux, without the closing zero).
const LONGEST_CHANNEL: usize = 15;

/// How frames are spoken over the connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Protocol {
    /// The ASCII protocol of socketcand, in raw mode.
    Socketcand,
    /// The slcan (Lawicel) protocol, over TCP instead of a serial line.
    Slcan,
    /// Linux's own CAN sockets (SocketCAN): no connection at all, but a network interface of this
    /// machine.
    SocketCan,
}

impl Protocol {
    /// The name before `://`.
    pub fn scheme(self) -> &'static str {
        match self {
            Protocol::Socketcand => "socketcand",
            Protocol::Slcan => "slcan",
            Protocol::SocketCan => "socketcan",
        }
    }
}

/// A bus at the other end of a TCP connection, `socketcand://HOST:PORT[/CHANNEL]` or
/// `slcan://HOST:PORT`, or at a CAN interface of this machine, `socketcan://INTERFACE`. An IPv6
/// address stands in brackets. Port 0 has a meaning only for listening: a free one is chosen.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Endpoint {
    protocol: Protocol,
    host: String,
    port: u16,
    channel: String,
}

/// Why a text is no endpoint. The message says what to write instead.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EndpointError {
    /// No `://`.
    #[error(
        "'{0}' is no bus address: write socketcand://HOST:PORT/can0, slcan://HOST:PORT or \
         socketcan://INTERFACE"
    )]
    NoProtocol(String),
    /// A protocol this crate does not speak.
    #[error(
        "'{protocol}' in '{text}' is not a known protocol: use socketcand://, slcan:// or \
         socketcan://"
    )]
    UnknownProtocol {
        /// The whole text.
        text: String,
        /// What stands before `://`.
        protocol: String,
    },
    /// No host name or address.
    #[error("'{0}' names no host: write for example {example}", example = example(.0))]
    NoHost(String),
    /// A host that contains what no host name does.
    #[error(
        "'{host}' in '{text}' is no host: write a name, an IPv4 address, or an IPv6 address in \
         brackets as in [::1]"
    )]
    BadHost {
        /// The whole text.
        text: String,
        /// The part that should be the host.
        host: String,
    },
    /// No port.
    #[error("'{0}' names no port: write for example {example}", example = example(.0))]
    NoPort(String),
    /// A port that is not a number from 0 to 65535.
    #[error("'{port}' in '{text}' is no port: write a number from 0 to 65535")]
    BadPort {
        /// The whole text.
        text: String,
        /// The part that should be the port.
        port: String,
    },
    /// A channel where none belongs, or one that cannot be a name of an interface.
    #[error(
        "'{channel}' in '{text}' is no channel: use 1 to 15 letters, digits, '-', '_' or '.', \
         as in can0"
    )]
    BadChannel {
        /// The whole text.
        text: String,
        /// The part behind the slash.
        channel: String,
    },
    /// slcan carries one bus, which has no name.
    #[error("'{0}' names a channel, but slcan knows none: leave out what follows the port")]
    ChannelOnSlcan(String),
    /// What stands behind `socketcan://` cannot be a network interface.
    #[error(
        "'{interface}' in '{text}' is no CAN interface of this machine: write its name alone, as \
         in socketcan://can0, or socketcand://HOST:PORT for a bus behind a network"
    )]
    BadInterface {
        /// The whole text.
        text: String,
        /// The part that should be the interface.
        interface: String,
    },
}

fn example(text: &str) -> &'static str {
    if text.starts_with("slcan") {
        "slcan://127.0.0.1:29537"
    } else {
        "socketcand://127.0.0.1:29536/can0"
    }
}

impl Endpoint {
    /// An endpoint from its parts. `host` is a name or an address, without brackets.
    pub fn new(protocol: Protocol, host: impl Into<String>, port: u16) -> Endpoint {
        let channel = DEFAULT_CHANNEL.to_owned();
        Endpoint {
            protocol,
            host: host.into(),
            port,
            channel,
        }
    }

    /// The CAN interface of this machine with that name, as `ip link` lists it.
    pub fn of_interface(name: impl Into<String>) -> Endpoint {
        Endpoint {
            protocol: Protocol::SocketCan,
            host: String::new(),
            port: 0,
            channel: name.into(),
        }
    }

    /// How frames are spoken.
    pub fn protocol(&self) -> Protocol {
        self.protocol
    }

    /// Host name or address, without brackets; empty for an interface of this machine.
    pub fn host(&self) -> &str {
        &self.host
    }

    /// TCP port; 0 for an interface of this machine.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Name of the bus at the other end (socketcand; `can0` unless given), or of the interface
    /// (SocketCAN).
    pub fn channel(&self) -> &str {
        &self.channel
    }

    /// Whether this is on this machine by its very name: a loopback address, `localhost`, or an
    /// interface. Other names are not looked up.
    pub fn is_loopback(&self) -> bool {
        if self.protocol == Protocol::SocketCan {
            return true;
        }
        let name = self.host.trim_end_matches('.').to_ascii_lowercase();
        match name.parse::<IpAddr>() {
            Ok(address) => address.to_canonical().is_loopback(),
            Err(_) => name == "localhost" || name.ends_with(".localhost"),
        }
    }

    /// The same with another port.
    pub(crate) fn with_port(&self, port: u16) -> Endpoint {
        Endpoint {
            port,
            ..self.clone()
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scheme, host, port) = (self.protocol.scheme(), &self.host, self.port);
        if self.protocol == Protocol::SocketCan {
            return write!(f, "{scheme}://{}", self.channel);
        }
        if host.contains(':') {
            write!(f, "{scheme}://[{host}]:{port}")?;
        } else {
            write!(f, "{scheme}://{host}:{port}")?;
        }
        match self.protocol {
            Protocol::Socketcand => write!(f, "/{}", self.channel),
            Protocol::Slcan | Protocol::SocketCan => Ok(()),
        }
    }
}

impl FromStr for Endpoint {
    type Err = EndpointError;

    fn from_str(text: &str) -> Result<Endpoint, EndpointError> {
        let whole = || text.to_owned();
        let (scheme, rest) = text
            .split_once("://")
            .ok_or_else(|| EndpointError::NoProtocol(whole()))?;
        let protocol = [Protocol::Socketcand, Protocol::Slcan, Protocol::SocketCan]
            .into_iter()
            .find(|protocol| protocol.scheme() == scheme)
            .ok_or_else(|| EndpointError::UnknownProtocol {
                text: whole(),
                protocol: scheme.to_owned(),
            })?;
        if protocol == Protocol::SocketCan {
            let interface = rest.strip_suffix('/').unwrap_or(rest);
            if is_channel(interface) {
                return Ok(Endpoint::of_interface(interface));
            }
            let (text, interface) = (whole(), interface.to_owned());
            return Err(EndpointError::BadInterface { text, interface });
        }
        let (place, channel) = match rest.split_once('/') {
            Some((place, channel)) => (place, Some(channel)),
            None => (rest, None),
        };
        let (host, port) = split_port(place);
        let host = match host
            .strip_prefix('[')
            .and_then(|host| host.strip_suffix(']'))
        {
            Some(host) if host.parse::<std::net::Ipv6Addr>().is_ok() => host,
            None if host.is_empty() => return Err(EndpointError::NoHost(whole())),
            None if host.bytes().all(is_host_byte) => host,
            _ => {
                return Err(EndpointError::BadHost {
                    text: whole(),
                    host: host.to_owned(),
                });
            }
        };
        let port = port.ok_or_else(|| EndpointError::NoPort(whole()))?;
        // u16's own parser would take a plus sign.
        let port = if port.bytes().all(|byte| byte.is_ascii_digit()) {
            port.parse().ok()
        } else {
            None
        }
        .ok_or_else(|| EndpointError::BadPort {
            text: whole(),
            port: port.to_owned(),
        })?;
        let channel = match (protocol, channel.filter(|channel| !channel.is_empty())) {
            (_, None) => DEFAULT_CHANNEL,
            (Protocol::Slcan, Some(_)) => return Err(EndpointError::ChannelOnSlcan(whole())),
            (_, Some(channel)) if is_channel(channel) => channel,
            (_, Some(channel)) => {
                let channel = channel.to_owned();
                return Err(EndpointError::BadChannel {
                    text: whole(),
                    channel,
                });
            }
        };
        let (host, channel) = (host.to_owned(), channel.to_owned());
        Ok(Endpoint {
            protocol,
            host,
            port,
            channel,
        })
    }
}

/// The part before the last colon outside of brackets, and the part behind it.
fn split_port(place: &str) -> (&str, Option<&str>) {
    let address_end = place.rfind(']').map_or(0, |at| at + 1);
    match place[address_end..].rfind(':') {
        Some(at) => {
            let (host, port) = place.split_at(address_end + at);
            (host, port.strip_prefix(':').filter(|port| !port.is_empty()))
        }
        None => (place, None),
    }
}

fn is_host_byte(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'-' | b'_')
}

fn is_channel(channel: &str) -> bool {
    (1..=LONGEST_CHANNEL).contains(&channel.len()) && channel.bytes().all(is_host_byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Endpoint, EndpointError> {
        text.parse()
    }

    #[test]
    fn good_ones() {
        // Text, protocol, host, port, channel, as printed.
        let table = [
            (
                "socketcand://127.0.0.1:29536/can1",
                "127.0.0.1",
                29536,
                "can1",
            ),
            (
                "socketcand://localhost:1/vcan-0.a",
                "localhost",
                1,
                "vcan-0.a",
            ),
            ("socketcand://[::1]:65535/can0", "::1", 65535, "can0"),
            ("slcan://bench-2.lab:3000", "bench-2.lab", 3000, "can0"),
            ("slcan://[fe80::1]:0", "fe80::1", 0, "can0"),
            ("socketcan://vcan0", "", 0, "vcan0"),
        ];
        for (text, host, port, channel) in table {
            let endpoint = parse(text).unwrap();
            assert_eq!(
                (endpoint.host(), endpoint.port(), endpoint.channel()),
                (host, port, channel)
            );
            assert_eq!(endpoint.to_string(), text);
        }
        assert_eq!(
            parse("socketcand://h:5").unwrap(),
            parse("socketcand://h:5/can0").unwrap()
        );
        assert_eq!(
            parse("socketcand://h:5/").unwrap(),
            parse("socketcand://h:5/can0").unwrap()
        );
        assert_eq!(
            parse("slcan://h:5/").unwrap(),
            Endpoint::new(Protocol::Slcan, "h", 5)
        );
        assert_eq!(
            parse("socketcan://can1/").unwrap(),
            Endpoint::of_interface("can1")
        );
    }

    /// Each message names the thing and the remedy.
    #[test]
    fn bad_ones() {
        let table = [
            (
                "can0",
                "'can0' is no bus address: write socketcand://HOST:PORT/can0",
            ),
            ("", "'' is no bus address"),
            (
                "tcp://h:1",
                "'tcp' in 'tcp://h:1' is not a known protocol: use socketcand://",
            ),
            (
                "slcan://",
                "names no host: write for example slcan://127.0.0.1:29537",
            ),
            (
                "socketcand://:5",
                "names no host: write for example socketcand://127.0.0.1:29536",
            ),
            (
                "socketcand://h",
                "'socketcand://h' names no port: write for example",
            ),
            ("socketcand://h:/can0", "names no port"),
            (
                "slcan://h:99999",
                "'99999' in 'slcan://h:99999' is no port: write a number",
            ),
            ("slcan://h:+1", "'+1' in 'slcan://h:+1' is no port"),
            ("slcan://::1:5", "'::1' in 'slcan://::1:5' is no host"),
            ("slcan://[::1", "is no host"),
            ("slcan://[nonsense]:5", "'[nonsense]' in"),
            ("slcan://a b:5", "'a b' in"),
            ("slcan://h:5/can0", "leave out what follows the port"),
            ("socketcand://h:5/can 0", "'can 0' in"),
            ("socketcand://h:5/a/b", "'a/b' in"),
            ("socketcand://h:5/sixteen-letters0", "is no channel"),
            (
                "socketcan://h:29536",
                "'h:29536' in 'socketcan://h:29536' is no CAN interface of this machine",
            ),
            ("socketcan://", "'' in 'socketcan://' is no CAN interface"),
            (
                "socketcan://can0/can0",
                "write its name alone, as in socketcan://can0",
            ),
        ];
        for (text, message) in table {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(message), "{text}: {error}");
        }
    }

    #[test]
    fn loopback() {
        let is = |text: &str| parse(text).unwrap().is_loopback();
        for text in [
            "slcan://127.0.0.1:1",
            "slcan://127.9.9.9:1",
            "slcan://[::1]:1",
        ] {
            assert!(is(text), "{text}");
        }
        for text in [
            "slcan://LocalHost:1",
            "slcan://a.localhost:1",
            "slcan://[::ffff:127.0.0.1]:1",
            "socketcan://can0",
        ] {
            assert!(is(text), "{text}");
        }
        for text in [
            "slcan://0.0.0.0:1",
            "slcan://[::]:1",
            "slcan://192.168.1.2:1",
            "slcan://h:1",
        ] {
            assert!(!is(text), "{text}");
        }
    }
}
