//! What can go wrong with a connection.

use crate::{Endpoint, InterfaceError};
use std::io;
use std::time::Duration;

/// What went wrong with a connection, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConnectionError {
    /// Nobody listens there.
    #[error(
        "nobody listens at {endpoint}: start `servobus sim` with this address, or check host and \
         port"
    )]
    NobodyThere {
        /// Where.
        endpoint: Endpoint,
    },
    /// No connection, for another reason.
    #[error("cannot connect to {endpoint}: {source}; check host, port and network")]
    Connect {
        /// Where.
        endpoint: Endpoint,
        /// What the system says.
        source: io::Error,
    },
    /// No answer in time.
    #[error(
        "{endpoint} gives no {missing} within {timeout:?}: check that a {scheme} server is there",
        scheme = endpoint.protocol().scheme()
    )]
    Timeout {
        /// Where.
        endpoint: Endpoint,
        /// What was waited for.
        missing: &'static str,
        /// How long.
        timeout: Duration,
    },
    /// The other end refuses.
    #[error("{endpoint} refuses: {text}")]
    Refused {
        /// Where.
        endpoint: Endpoint,
        /// Why, in the other end's words.
        text: String,
    },
    /// The other end does not speak the protocol.
    #[error(
        "{endpoint} does not speak {scheme}: {text}; check the port",
        scheme = endpoint.protocol().scheme()
    )]
    Protocol {
        /// Where.
        endpoint: Endpoint,
        /// What it sent.
        text: String,
    },
    /// The other end closed the connection.
    #[error("{endpoint} closed the connection: did the simulation or the adapter end?")]
    Closed {
        /// Where.
        endpoint: Endpoint,
    },
    /// The connection broke.
    #[error("the connection to {endpoint} broke: {source}")]
    Broken {
        /// Where.
        endpoint: Endpoint,
        /// What the system says.
        source: io::Error,
    },
    /// The interface of this machine cannot be used, or not any more.
    #[error(transparent)]
    Interface(#[from] InterfaceError),
}
