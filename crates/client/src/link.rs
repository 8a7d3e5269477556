//! What a procedure needs of a bus: a clock, sending, receiving until a time.

use std::fmt;
use std::future::Future;

use can::Frame;
use canopen::Instant;

/// A way to a bus. Implemented by a simulated bus, whose time advances inside
/// [`Link::receive`], and by real interfaces.
pub trait Link {
    /// The present time. Any origin; it never goes back.
    fn now(&self) -> Instant;

    /// Sends a frame.
    ///
    /// # Errors
    /// The link broke.
    fn send(&mut self, frame: Frame) -> impl Future<Output = Result<(), LinkError>>;

    /// The next frame and when it was received; `None` when none came until `until`. With `until`
    /// not after [`Link::now`], gives only what was received already. A link does not give back
    /// the frames that were sent through it.
    ///
    /// # Errors
    /// The link broke.
    fn receive(
        &mut self,
        until: Instant,
    ) -> impl Future<Output = Result<Option<(Instant, Frame)>, LinkError>>;

    /// When the frame that [`Link::receive`] gave last was on the bus, in nanoseconds on the clock of
    /// whoever heard it there: an interface, or a simulation, whose clock may go slower than ours. Any
    /// origin. `None` if nobody says (slcan), or if it is the time that `receive` gave.
    fn stamp_ns(&self) -> Option<u64> {
        None
    }
}

impl<L: Link> Link for &mut L {
    fn now(&self) -> Instant {
        L::now(self)
    }

    fn stamp_ns(&self) -> Option<u64> {
        L::stamp_ns(self)
    }

    fn send(&mut self, frame: Frame) -> impl Future<Output = Result<(), LinkError>> {
        L::send(self, frame)
    }

    fn receive(
        &mut self,
        until: Instant,
    ) -> impl Future<Output = Result<Option<(Instant, Frame)>, LinkError>> {
        L::receive(self, until)
    }
}

/// Why a link can be used no more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkError {
    /// The other end has gone.
    Closed {
        /// Which door, as the user named it.
        door: String,
    },
    /// The interface reported an error.
    Failed {
        /// Which door, as the user named it.
        door: String,
        /// What the interface said.
        cause: String,
    },
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkError::Closed { door } => write!(f, "{door}: the other end closed the connection"),
            LinkError::Failed { door, cause } => write!(f, "{door}: {cause}"),
        }
    }
}

impl std::error::Error for LinkError {}

/// Which way a frame went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Sent by us.
    Sent,
    /// Received from the bus.
    Received,
}

/// A frame that passed a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// When: the reception stamp, or the time after sending.
    pub at: Instant,
    /// Which way.
    pub way: Way,
    /// The frame.
    pub frame: Frame,
}

/// A link that shows every frame to a function: for traces beside any procedure.
#[derive(Debug)]
pub struct Observed<L, F> {
    link: L,
    observer: F,
}

impl<L: Link, F: FnMut(Seen)> Observed<L, F> {
    /// Shows what passes `link` to `observer`.
    pub fn new(link: L, observer: F) -> Observed<L, F> {
        Observed { link, observer }
    }
}

impl<L: Link, F: FnMut(Seen)> Link for Observed<L, F> {
    fn now(&self) -> Instant {
        self.link.now()
    }

    fn stamp_ns(&self) -> Option<u64> {
        self.link.stamp_ns()
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        self.link.send(frame).await?;
        (self.observer)(Seen {
            at: self.link.now(),
            way: Way::Sent,
            frame,
        });
        Ok(())
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        let received = self.link.receive(until).await?;
        if let Some((at, frame)) = received {
            (self.observer)(Seen {
                at,
                way: Way::Received,
                frame,
            });
        }
        Ok(received)
    }
}
