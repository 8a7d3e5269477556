//! The way to a bus behind an endpoint, in real time.

use std::future::poll_fn;
use std::pin::pin;
use std::task::Poll;
use std::time::{Duration, Instant as RealTime};

use bus::{Connection, ConnectionError, Endpoint, Report};
use can::Frame;
use canopen::Instant;
use client::{Link, LinkError};

use crate::{Failure, output};

/// Where the bus is that a subcommand talks to.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct WireArguments {
    /// The bus: socketcand://HOST:PORT[/CHANNEL], slcan://HOST:PORT, or socketcan://INTERFACE.
    #[arg(
        long,
        value_name = "ENDPOINT",
        default_value = "socketcand://127.0.0.1:29536/can0"
    )]
    bus: Endpoint,
}

impl WireArguments {
    /// Connects and runs `work` on the connection, in a runtime of this thread.
    ///
    /// # Errors
    /// The bus cannot be reached (exit code 2), or what `work` says.
    pub(crate) fn run<T>(
        &self,
        work: impl AsyncFnOnce(Connection) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        run(&self.bus, work)
    }
}

/// Connects to `endpoint` and runs `work` on the connection, in a runtime of this thread.
///
/// # Errors
/// The bus cannot be reached (exit code 2), or what `work` says.
pub(crate) fn run<T>(
    endpoint: &Endpoint,
    work: impl AsyncFnOnce(Connection) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_io()
        .enable_time()
        .build()
        .map_err(|error| Failure::input(format!("cannot start network input: {error}")))?;
    runtime.block_on(async {
        let connection = bus::connect(endpoint).await.map_err(Failure::input)?;
        work(connection).await
    })
}

/// Tells people what the controller's driver has reported, and gives it.
pub(crate) fn tell_reports(connection: &mut Connection) -> Vec<Report> {
    let reports = connection.take_reports();
    for report in &reports {
        output::tell(format_args!("{}: {}", connection.endpoint(), report.error));
    }
    reports
}

/// A [`Link`] to a bus in real time, which counts from the connection.
#[derive(Debug)]
pub(crate) struct WireLink {
    connection: Connection,
    began: RealTime,
    /// The door's stamp of the frame that was received last.
    stamp_ns: Option<u64>,
}

impl WireLink {
    pub(crate) fn new(connection: Connection) -> WireLink {
        WireLink {
            connection,
            began: RealTime::now(),
            stamp_ns: None,
        }
    }

    /// The connection back.
    pub(crate) fn into_connection(self) -> Connection {
        self.connection
    }

    fn lost(&self, error: &ConnectionError) -> LinkError {
        let door = self.connection.endpoint().to_string();
        let cause = match error {
            ConnectionError::Closed { .. } => return LinkError::Closed { door },
            ConnectionError::Broken { source, .. } => source.to_string(),
            ConnectionError::Refused { text, .. } | ConnectionError::Protocol { text, .. } => {
                text.clone()
            }
            other => other.to_string(),
        };
        LinkError::Failed { door, cause }
    }
}

impl Link for WireLink {
    fn now(&self) -> Instant {
        let ns = u64::try_from(self.began.elapsed().as_nanos()).unwrap_or(u64::MAX);
        Instant(ns)
    }

    fn stamp_ns(&self) -> Option<u64> {
        self.stamp_ns
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        let sent = self.connection.send(frame).await;
        tell_reports(&mut self.connection);
        sent.map_err(|error| self.lost(&error))
    }

    async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        // Lets the runtime look at the socket, so that with `until` in the past what has arrived
        // already is found.
        tokio::task::yield_now().await;
        let longest = Duration::from_nanos(until.since_ns(self.now()));
        let received = if longest.is_zero() {
            // A timer, even one that has run out, would cost a millisecond.
            let mut receive = pin!(self.connection.receive());
            poll_fn(|context| match receive.as_mut().poll(context) {
                Poll::Ready(received) => Poll::Ready(Some(received)),
                Poll::Pending => Poll::Ready(None),
            })
            .await
        } else {
            tokio::time::timeout(longest, self.connection.receive())
                .await
                .ok()
        };
        tell_reports(&mut self.connection);
        match received {
            Some(Ok(received)) => {
                self.stamp_ns = received.stamp_ns;
                Ok(Some((self.now(), received.frame)))
            }
            Some(Err(error)) => Err(self.lost(&error)),
            None => Ok(None),
        }
    }
}
