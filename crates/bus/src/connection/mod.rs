//! The outside end: a connection to a bus, behind a door or at an interface.

mod error;
mod stream;

pub use error::ConnectionError;

use crate::endpoint::{Endpoint, Protocol};
use crate::error_frame::ErrorFrame;
use crate::interface::{Heard, Interface, What};
use can::Frame;
use can::slcan::BitRate;
use std::time::Duration;
use stream::Stream;

/// Error frames that are kept until they are taken.
const REPORTS: usize = 100;

/// Notes that are kept until they are taken.
const NOTES: usize = 1_000;

/// How a connection is made.
#[derive(Clone, Debug)]
pub struct Options {
    /// How long connecting, and each answer while opening the bus, may take. Default: 3 s.
    pub timeout: Duration,
    /// Bit rate an slcan adapter is told to use before its channel is opened. `None`, the
    /// default, leaves it as it is; `servobus sim` takes any.
    pub bit_rate: Option<BitRate>,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            timeout: Duration::from_secs(3),
            bit_rate: None,
        }
    }
}

/// A frame from the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// When the other end saw it, in nanoseconds on the other end's clock (virtual time, if the
    /// bus is simulated; since 1970 at an interface of this machine). slcan does not say.
    pub stamp_ns: Option<u64>,
    /// The frame.
    pub frame: Frame,
}

/// Connects to a bus with the default options. See [`connect_with`].
///
/// # Errors
/// As [`connect_with`].
pub async fn connect(endpoint: &Endpoint) -> Result<Connection, ConnectionError> {
    connect_with(endpoint, &Options::default()).await
}

/// Connects to a bus and gets onto it: when this returns, frames flow.
///
/// # Errors
/// Nobody there, no answer in time, refused, or not the expected protocol; an interface that is
/// not there or down.
pub async fn connect_with(
    endpoint: &Endpoint,
    options: &Options,
) -> Result<Connection, ConnectionError> {
    let way = match endpoint.protocol() {
        Protocol::Socketcand | Protocol::Slcan => {
            Way::Stream(Stream::open(endpoint, options).await?)
        }
        Protocol::SocketCan => Way::Interface {
            interface: Interface::open(endpoint.channel())?,
            patience: options.timeout,
        },
    };
    Ok(Connection {
        endpoint: endpoint.clone(),
        way,
        reports: Vec::new(),
    })
}

/// A connection to a bus.
#[derive(Debug)]
pub struct Connection {
    endpoint: Endpoint,
    way: Way,
    reports: Vec<Report>,
}

/// An error that the controller's driver has reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Report {
    /// When, in nanoseconds since 1970.
    pub stamp_ns: u64,
    /// What.
    pub error: ErrorFrame,
}

/// What the other end says that people should know of; a simulation tells what its scenario does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// When, in nanoseconds on the other end's clock.
    pub stamp_ns: u64,
    /// What.
    pub text: String,
}

#[derive(Debug)]
enum Way {
    Stream(Stream),
    Interface {
        interface: Interface,
        /// How long a frame may wait for room in the interface's queue.
        patience: Duration,
    },
}

impl Connection {
    /// Where this leads.
    pub fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }

    /// Sends a frame. Returns when the system has taken it, which may be long before it is on the
    /// bus; waits while the other end takes no more. Frames that come in meanwhile are kept for
    /// [`Connection::receive`].
    ///
    /// Must not be cancelled: half a message would spoil the next. Over socketcand a remote frame
    /// goes out as `sendrtr`, which old servers do not know.
    ///
    /// # Errors
    /// The connection is closed or broken; the interface is down, or has sent nothing for
    /// [`Options::timeout`].
    pub async fn send(&mut self, frame: Frame) -> Result<(), ConnectionError> {
        match &mut self.way {
            Way::Stream(stream) => stream.send(frame).await,
            Way::Interface {
                interface,
                patience,
            } => Ok(interface.send(&frame, *patience).await?),
        }
    }

    /// The next frame from the bus; waits for it. May be cancelled without losing anything, so it
    /// fits into `select!` and `timeout`. Error frames are put aside for
    /// [`Connection::take_reports`].
    ///
    /// # Errors
    /// The connection is closed or broken, the interface is down, or the other end reports an
    /// error: then the next call goes on behind it.
    pub async fn receive(&mut self) -> Result<Received, ConnectionError> {
        let interface = match &mut self.way {
            Way::Stream(stream) => return stream.receive().await,
            Way::Interface { interface, .. } => interface,
        };
        loop {
            let Heard { stamp_ns, what } = interface.receive().await?;
            match what {
                What::Frame(frame) => {
                    let stamp_ns = Some(stamp_ns);
                    return Ok(Received { stamp_ns, frame });
                }
                What::Error(error) if self.reports.len() < REPORTS => {
                    self.reports.push(Report { stamp_ns, error });
                }
                What::Error(_) => {}
            }
        }
    }

    /// Asks the other end for notes. Simulations behind a socketcand door have some; others have
    /// none, and that is no error.
    ///
    /// # Errors
    /// The connection is closed or broken.
    pub async fn ask_notes(&mut self) -> Result<(), ConnectionError> {
        match &mut self.way {
            Way::Stream(stream) => stream.ask_notes().await,
            Way::Interface { .. } => Ok(()),
        }
    }

    /// The notes that came before the frame that was received last, or since, at most 1000.
    pub fn take_notes(&mut self) -> Vec<Note> {
        match &mut self.way {
            Way::Stream(stream) => stream.take_notes(),
            Way::Interface { .. } => Vec::new(),
        }
    }

    /// The errors that the controller's driver has reported since the last call, at most 100.
    /// Only an interface of this machine has such reports.
    pub fn take_reports(&mut self) -> Vec<Report> {
        std::mem::take(&mut self.reports)
    }
}
