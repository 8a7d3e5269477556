//! What the simulation is told.

#[cfg(doc)]
use super::{Doors, Options};
use crate::ErrorFrame;
use can::Frame;
use std::fmt;
use std::io::ErrorKind;
use std::net::SocketAddr;
use std::time::Duration;

/// One stay of a client on the bus. Never used twice: whoever joins again gets a new one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ClientId(pub(super) u32);

impl fmt::Display for ClientId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "client {}", self.0)
    }
}

/// Where a client is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Peer {
    /// At the other end of a TCP connection.
    Tcp(SocketAddr),
    /// All programs at a CAN interface of this machine, and what is on its wire: they cannot be
    /// told apart.
    Interface(String),
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Peer::Tcp(address) => address.fmt(f),
            Peer::Interface(name) => write!(f, "the interface {name}"),
        }
    }
}

/// What happened at the doors.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A client is on the bus: in raw mode (socketcand), with its channel open (slcan).
    Joined {
        /// Who.
        client: ClientId,
        /// Through which door, counted as in [`Doors::addresses`].
        door: usize,
        /// From where.
        peer: Peer,
        /// It will not send (slcan `L`).
        listen_only: bool,
        /// The bit rate it asked for, in bits per second. TCP has none, so it joined in any case;
        /// on a real bus with another rate it would have disturbed everyone: worth a warning.
        bit_rate: Option<u32>,
    },
    /// A client sends this frame. It has used up one unit of its credit, see [`Doors::grant`].
    Frame {
        /// Who.
        client: ClientId,
        /// What.
        frame: Frame,
    },
    /// A client is no longer on the bus. All its frames have come before.
    Left {
        /// Who.
        client: ClientId,
        /// Why.
        reason: LeaveReason,
    },
    /// Somebody connected and was dropped before being on the bus.
    Refused {
        /// At which door, counted as in [`Doors::addresses`].
        door: usize,
        /// From where.
        peer: Peer,
        /// Why.
        reason: LeaveReason,
    },
    /// The interface behind a door reports trouble, and stays on the bus.
    Trouble {
        /// Behind which door, counted as in [`Doors::addresses`].
        door: usize,
        /// What.
        trouble: Trouble,
    },
}

/// What an interface has to report.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Trouble {
    /// An error frame of its driver.
    #[error("{0}")]
    Error(ErrorFrame),
    /// Frames of the bus wait, because it does not send them.
    #[error("{0}")]
    Stuck(String),
}

/// Why a client is no longer on the bus.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LeaveReason {
    /// It closed the connection.
    #[error("it disconnected")]
    Disconnected,
    /// It closed its channel (slcan `C`) and may join again.
    #[error("it closed its channel")]
    ChannelClosed,
    /// It did not read what was sent to it.
    #[error("it read too slowly: {waiting} frames were waiting for it")]
    TooSlow {
        /// Frames that were waiting and are lost with it.
        waiting: usize,
    },
    /// What it sent makes no sense.
    #[error("it does not keep to the protocol: {0}")]
    Protocol(String),
    /// The connection broke.
    #[error("the connection broke: {0}")]
    Broken(ErrorKind),
    /// There are as many clients as may be.
    #[error("{0} clients are connected already, which is all there may be")]
    Crowded(usize),
    /// It connected, but was not on the bus when this time was over: [`Options::handshake`].
    #[error("it did not join the bus within {0:?}")]
    Late(Duration),
    /// The interface is down or has vanished. It joins again when it can be used again.
    #[error("{0}; it joins again when the interface is there and up")]
    Interface(String),
    /// More came from the interface than this bus carries.
    #[error("it brought more frames than this bus carries: {waiting} were waiting")]
    TooFast {
        /// Frames that were waiting, and still get their turn; what came later is lost.
        waiting: usize,
    },
    /// The doors are being closed.
    #[error("the bus is closing")]
    Closing,
}
