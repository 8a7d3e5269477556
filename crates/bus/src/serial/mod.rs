//! Serial lines of simulated devices, offered to outside programs: a TCP port, or a pseudo-terminal.
//!
//! The simulation owns [`SerialLines`] and calls it from its own thread, which never waits. Behind it
//! a thread of its own keeps sockets and terminals. A line has one other end, so it takes one program
//! at a time; at a TCP port a second one is turned away.
//!
//! **A program that sends faster than the line carries** is slowed down: while 4096 bytes of it wait,
//! nothing more is read. **A program that does not read** loses what does not fit into 64 KiB, as it
//! would at a wire.
//!
//! **A program that goes** is noticed ([`SerialEvent::HungUp`]) when it closes its socket, or the
//! terminal. Who closes only its own direction (`printf '?SW\r' | nc -N …`) still gets what is sent
//! within the next half second.

mod endpoint;
mod keep;
mod line;
#[cfg(unix)]
mod pty;
mod stream;

use std::net::TcpListener;
use std::sync::Arc;
use std::thread::JoinHandle;

use tokio::sync::watch;

use crate::doors::{BindError, bind};
use line::Line;

pub use endpoint::{NoSerialEndpoint, SerialEndpoint};

/// What happens at the outer end of a serial line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SerialEvent {
    /// A program is there.
    Connected,
    /// It has sent this.
    Bytes(Vec<u8>),
    /// It has gone.
    HungUp,
}

/// Why serial lines could not be opened. None is open then.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SerialError {
    /// A TCP port cannot be listened on.
    #[error("{0}")]
    Bind(String),
    /// The system gives no pseudo-terminal.
    #[error("cannot open a pseudo-terminal: {0}; offer the line as tcp://127.0.0.1:29540")]
    Terminal(std::io::Error),
    /// The thread that keeps the lines could not be started.
    #[error("cannot start the thread for the serial lines: {0}; are there too many?")]
    Thread(std::io::Error),
}

impl SerialError {
    fn bind(endpoint: &SerialEndpoint, error: BindError) -> SerialError {
        let address = endpoint;
        SerialError::Bind(match error {
            BindError::Public => format!(
                "{address} could be reached by other machines, and whoever reaches it commands the \
                 drive: listen on 127.0.0.1, or allow it by --expose"
            ),
            BindError::Unresolved(source) => format!(
                "cannot listen on {address}: no address belongs to that name ({source}); use \
                 127.0.0.1"
            ),
            BindError::InUse => format!(
                "cannot listen on {address}: the port is in use; end the program that uses it, or \
                 choose another port (0 takes a free one)"
            ),
            BindError::Other { source, hint } => {
                format!("cannot listen on {address}: {source}; {hint}")
            }
        })
    }
}

/// An open end, nobody there yet.
enum Opened {
    Tcp(TcpListener),
    #[cfg(unix)]
    Pty(pty::Pty),
}

/// The open serial lines of one simulation. Closed when dropped.
#[derive(Debug)]
pub struct SerialLines {
    addresses: Vec<String>,
    lines: Vec<Arc<Line>>,
    closing: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

impl SerialLines {
    /// Opens all these lines, or none. `public` lets TCP ports be at addresses that other machines
    /// can reach.
    ///
    /// # Errors
    /// The first that cannot be opened, with what to do about it.
    pub fn open(endpoints: &[SerialEndpoint], public: bool) -> Result<SerialLines, SerialError> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .build()
            .map_err(SerialError::Thread)?;
        let mut addresses = Vec::new();
        let mut opened = Vec::new();
        let entered = runtime.enter();
        for endpoint in endpoints {
            let (end, address) = open(endpoint, public)?;
            addresses.push(address);
            opened.push(end);
        }
        drop(entered);
        let lines: Vec<Arc<Line>> = opened.iter().map(|_| Arc::default()).collect();
        let (closing, closed) = watch::channel(false);
        let work = keep::keep(opened, lines.clone(), closed);
        let thread = std::thread::Builder::new()
            .name("serial lines".to_owned())
            .spawn(move || runtime.block_on(work))
            .map_err(SerialError::Thread)?;
        Ok(SerialLines {
            addresses,
            lines,
            closing,
            thread: Some(thread),
        })
    }

    /// Where the lines are: `tcp://127.0.0.1:29540` with the port that it really has, or the name of
    /// the terminal, `/dev/pts/3`. In the order in which they were given.
    pub fn addresses(&self) -> &[String] {
        &self.addresses
    }

    /// What has happened next at a line, by its number from 0. Of bytes at most `room` are given; with
    /// none, what comes next waits. Never waits.
    pub fn take(&mut self, line: usize, room: usize) -> Option<SerialEvent> {
        self.lines.get(line)?.take(room)
    }

    /// Sends bytes to whoever is there; they are lost if nobody is. Never waits.
    pub fn send(&mut self, line: usize, bytes: &[u8]) {
        if let Some(line) = self.lines.get(line) {
            line.send(bytes);
        }
    }
}

impl Drop for SerialLines {
    fn drop(&mut self) {
        self.closing.send_replace(true);
        if let Some(thread) = self.thread.take() {
            // A panic in it has been printed already.
            let _ = thread.join();
        }
    }
}

fn open(endpoint: &SerialEndpoint, public: bool) -> Result<(Opened, String), SerialError> {
    match endpoint {
        SerialEndpoint::Tcp { host, port } => {
            let bound = bind(host, *port, public);
            let (listener, port) = bound.map_err(|error| SerialError::bind(endpoint, error))?;
            Ok((Opened::Tcp(listener), endpoint.with_port(port).to_string()))
        }
        #[cfg(unix)]
        SerialEndpoint::Pty => {
            let pty = pty::Pty::open().map_err(SerialError::Terminal)?;
            let name = pty.name().display().to_string();
            Ok((Opened::Pty(pty), name))
        }
        #[cfg(not(unix))]
        SerialEndpoint::Pty => Err(SerialError::Terminal(
            std::io::ErrorKind::Unsupported.into(),
        )),
    }
}
