//! Doors in the wall of a simulated bus, through which outside programs come in: by TCP, or at a CAN
//! interface of this machine.
//!
//! The simulation owns a [`Doors`] and calls it from its own thread, never waiting unless it asks
//! to. Behind it a thread of its own keeps the sockets. What passes between the two:
//!
//! ```text
//! socket ─ bytes → held (64 frames) ─ credit → take()      towards the bus
//! socket ← bytes ─ outbox (65 536)           ← deliver()   from the bus
//! ```
//!
//! **A client that sends faster than the bus carries** is slowed down, not cut: the simulation
//! grants it credit for a few frames (its transmit mailbox) and renews it frame by frame as they
//! get onto the bus; meanwhile the held frames fill up, the socket is no longer read, and TCP
//! stops the sender. Every frame it sent gets its turn, in order, even if it disconnects.
//!
//! **A client that reads too slowly** is warned in the same way: while its outbox is more than
//! half full, nothing is read from it. When the outbox is full it is dropped and told why. Single
//! frames are never left out, and nobody else waits for it.
//!
//! **A client that connects and does not join** holds one of the seats that all doors share, so it
//! is dropped after a while and told why.
//!
//! **A CAN interface** of this machine is one client, whoever is behind it, from the beginning: what
//! it hears gets onto the bus, what goes over the bus is sent by it, and what it brought itself does
//! not go back. An interface cannot be slowed down, so far more of its frames are held. It leaves
//! when it goes down and joins again when it is up.
//!
//! **Clients are told what they did wrong**: `< error … >` by socketcand, BEL by slcan. Where the
//! stream cannot be trusted any more they are dropped, too.

mod event;
mod interface;
mod listen;
mod outbox;
mod roster;
mod seats;
mod serve;
mod slcan;
mod socketcand;

pub use event::{ClientId, Event, LeaveReason, Peer, Trouble};
pub use listen::OpenError;
pub(crate) use listen::{BindError, bind};

use crate::socketcand::write_note;
use crate::{Endpoint, Protocol};
use can::Frame;
use outbox::Outbox;
use roster::{Happening, Roster};
use seats::{Seat, Seats};
use std::collections::VecDeque;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::watch;

/// How doors are opened.
#[derive(Clone, Debug)]
pub struct Options {
    /// Listen on addresses other than loopback, too. The protocols know no password: whoever
    /// reaches the port is on the bus. Default: false.
    pub public: bool,
    /// Credit of a client that has just joined: how many of its frames the simulation is ready to
    /// hold as that client's transmit mailbox. Default: 4.
    pub mailbox_frames: u32,
    /// Frames of one client held beyond its credit, before its socket is no longer read.
    /// Default: 64.
    pub held_frames: usize,
    /// Frames waiting to be sent to one client, before it is dropped; also frames of an interface
    /// held beyond its credit. Default: 65 536.
    pub outbox_frames: usize,
    /// Clients at one time, all doors together: who has only connected counts, and so does who
    /// has gone, until its [`Event::Left`] is taken. Default: 64.
    pub clients: usize,
    /// How long a client may take from connecting until it is on the bus for the first time,
    /// before it is dropped. Default: 10 s.
    pub handshake: Duration,
    /// How long a closing connection may take to send what is still waiting. Default: 500 ms.
    pub linger: Duration,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            public: false,
            mailbox_frames: 4,
            held_frames: 64,
            outbox_frames: 65_536,
            clients: 64,
            handshake: Duration::from_secs(10),
            linger: Duration::from_millis(500),
        }
    }
}

/// The open doors of one simulated bus. Closed, with what is still waiting sent, when dropped.
#[derive(Debug)]
pub struct Doors {
    addresses: Vec<Endpoint>,
    roster: Arc<Roster>,
    members: Vec<(ClientId, Arc<Outbox>)>,
    ready: VecDeque<Happening>,
    closing: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

impl Doors {
    /// Opens all these doors, or none.
    ///
    /// # Errors
    /// The first endpoint that cannot be listened on, with what to do about it.
    pub fn open(endpoints: &[Endpoint], options: &Options) -> Result<Doors, OpenError> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .build()
            .map_err(|source| OpenError::Thread { source })?;
        let mut addresses = Vec::new();
        let mut opened = Vec::new();
        let entered = runtime.enter();
        for endpoint in endpoints {
            let (door, address) = listen::open(endpoint, options)?;
            addresses.push(address);
            opened.push((door, endpoint.clone()));
        }
        drop(entered);
        let roster = Arc::new(Roster::new(options));
        let (closing, closed) = watch::channel(false);
        let work = serve::keep(opened, roster.clone(), options.clone(), closed);
        let thread = std::thread::Builder::new()
            .name("doors".to_owned())
            .spawn(move || runtime.block_on(work))
            .map_err(|source| OpenError::Thread { source })?;
        Ok(Doors {
            addresses,
            roster,
            members: Vec::new(),
            ready: VecDeque::new(),
            closing,
            thread: Some(thread),
        })
    }

    /// Where the doors are, with the ports they really have.
    pub fn addresses(&self) -> &[Endpoint] {
        &self.addresses
    }

    /// The next event, if there is one. Never waits; costs one atomic read if there is none.
    pub fn take(&mut self) -> Option<Event> {
        if self.ready.is_empty() {
            self.roster.collect(&mut self.ready);
        }
        Some(match self.ready.pop_front()? {
            Happening::Joined {
                client,
                outbox,
                door,
                peer,
                listen_only,
                bit_rate,
            } => {
                self.members.push((client, outbox));
                Event::Joined {
                    client,
                    door,
                    peer,
                    listen_only,
                    bit_rate,
                }
            }
            Happening::Frame { client, frame } => Event::Frame { client, frame },
            Happening::Left { client, reason } => {
                self.members.retain(|(member, _)| *member != client);
                self.roster.forget(client);
                Event::Left { client, reason }
            }
            Happening::Refused { door, peer, reason } => Event::Refused { door, peer, reason },
            Happening::Trouble { door, trouble } => Event::Trouble { door, trouble },
        })
    }

    /// Sleeps until an event may be there or the time is over.
    pub fn wait(&mut self, timeout: Duration) {
        if self.ready.is_empty() {
            self.roster.wait(timeout);
        }
    }

    /// Lets `frames` more frames of this client come, because so many have left its mailbox for
    /// the bus (or were given up there). Without it a client gets through
    /// [`Options::mailbox_frames`] frames and no more. A client that has left is passed over.
    pub fn grant(&mut self, client: ClientId, frames: u32) {
        self.roster.grant(client, frames);
    }

    /// Gives a frame that went over the bus to all clients but `except`, usually its sender.
    /// Never waits. `stamp_ns` is the time in nanoseconds since the start of the bus.
    ///
    /// A remote frame reaches slcan clients, and socketcand clients that have shown by `sendrtr`
    /// that they know of such frames; to the others it cannot be said.
    pub fn deliver(&mut self, frame: &Frame, stamp_ns: u64, except: Option<ClientId>) {
        for (client, outbox) in &self.members {
            if Some(*client) != except {
                outbox.deliver(frame, stamp_ns);
            }
        }
    }

    /// Tells the clients that have asked for it what people should know of. Never waits.
    pub fn note(&mut self, text: &str, stamp_ns: u64) {
        let mut message = Vec::new();
        write_note(&mut message, stamp_ns, text);
        for (_, outbox) in &self.members {
            outbox.note(&message);
        }
    }

    /// The clients now on the bus, in the order in which they joined.
    pub fn clients(&self) -> impl Iterator<Item = ClientId> {
        self.members.iter().map(|(client, _)| *client)
    }
}

impl Drop for Doors {
    fn drop(&mut self) {
        self.closing.send_replace(true);
        if let Some(thread) = self.thread.take() {
            // It ends by itself within the linger time; a panic in it has been printed already.
            let _ = thread.join();
        }
    }
}

/// What a message from a client asks for, and what it is answered once that is done.
#[derive(Debug, PartialEq, Eq)]
struct Action {
    effect: Effect,
    answer: Text,
}

/// Text for a client.
type Text = std::borrow::Cow<'static, [u8]>;

#[derive(Debug, PartialEq, Eq)]
enum Effect {
    None,
    Join {
        listen_only: bool,
        bit_rate: Option<u32>,
    },
    Leave,
    Send(Frame),
    Timestamps(bool),
    Notes,
    Drop(LeaveReason),
}

impl Effect {
    fn answered(self, answer: impl Into<Text>) -> Action {
        Action {
            effect: self,
            answer: answer.into(),
        }
    }
}

/// What has been agreed with a client about the frames it is sent.
#[derive(Clone, Copy, Debug, Default)]
struct Manner {
    /// slcan: with time stamps.
    timestamps: bool,
    /// socketcand: it knows remote frames.
    remote: bool,
    /// socketcand: it wants to be told what people should know of.
    notes: bool,
}

/// The server's side of one connection's protocol.
#[derive(Debug)]
enum Server {
    Socketcand(socketcand::Server),
    Slcan(slcan::Server),
}

impl Server {
    fn new(endpoint: &Endpoint) -> Server {
        match endpoint.protocol() {
            Protocol::Socketcand => Server::Socketcand(socketcand::Server::new(endpoint.channel())),
            // At an interface nobody is served, see `interface`.
            Protocol::Slcan | Protocol::SocketCan => Server::Slcan(slcan::Server::default()),
        }
    }

    /// Takes the next byte from the client.
    fn push(&mut self, byte: u8) -> Option<Action> {
        match self {
            Server::Socketcand(server) => server.push(byte),
            Server::Slcan(server) => server.push(byte),
        }
    }
}

/// What a client is told on connecting.
fn greeting(protocol: Protocol) -> Text {
    match protocol {
        Protocol::Socketcand => Text::Borrowed(b"< hi >"),
        Protocol::Slcan | Protocol::SocketCan => Text::Borrowed(b""),
    }
}

/// What a client is told last.
fn farewell(protocol: Protocol, reason: &LeaveReason) -> Text {
    match (protocol, reason) {
        (_, LeaveReason::Disconnected | LeaveReason::Broken(_) | LeaveReason::Closing) => {
            Text::Borrowed(b"")
        }
        (Protocol::SocketCan, _) => Text::Borrowed(b""),
        (Protocol::Slcan, _) => Text::Borrowed(&[can::slcan::REFUSED]),
        (Protocol::Socketcand, LeaveReason::Protocol(why)) => socketcand::error(why),
        (Protocol::Socketcand, LeaveReason::TooSlow { waiting }) => socketcand::error(&format!(
            "you read too slowly, {waiting} frames were waiting"
        )),
        (Protocol::Socketcand, LeaveReason::Late(time)) => {
            socketcand::error(&format!("you did not join the bus within {time:?}"))
        }
        (Protocol::Socketcand, reason) => socketcand::error(&reason.to_string()),
    }
}

/// Appends the text of a frame from the bus.
fn write_frame(
    text: &mut Vec<u8>,
    protocol: Protocol,
    manner: Manner,
    stamp_ns: u64,
    frame: &Frame,
) {
    match protocol {
        Protocol::Socketcand if frame.is_remote() && !manner.remote => {}
        Protocol::Socketcand => crate::socketcand::write_received(text, stamp_ns, frame),
        Protocol::Slcan => slcan::write_frame(text, manner.timestamps, stamp_ns, frame),
        Protocol::SocketCan => {}
    }
}
