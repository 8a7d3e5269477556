//! The sockets' side, in a thread of its own: listening, and one conversation per client.

use super::listen::Opened;
use super::outbox::{Item, Next};
use super::roster::Newcomer;
use super::{
    Action, ClientId, Effect, LeaveReason, Options, Outbox, Peer, Roster, Seat, Seats, Server,
    Text, farewell, greeting, interface, write_frame,
};
use crate::{Endpoint, Protocol};
use can::Frame;
use std::io::{self, Write};
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::{Notify, watch};
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep, sleep_until, timeout};

/// No frame follows the answer that puts a client on the bus before this time is over, or before
/// it sends something: python-can compares all it receives at once with that answer.
const AFTER_JOIN: Duration = Duration::from_millis(100);

/// Keeps all doors until they are closed.
pub(super) async fn keep(
    opened: Vec<(Opened, Endpoint)>,
    roster: Arc<Roster>,
    options: Options,
    closing: watch::Receiver<bool>,
) {
    let mut doors = JoinSet::new();
    let seats = Seats::new(options.clients);
    for (number, (opened, endpoint)) in opened.into_iter().enumerate() {
        let door = Door {
            door: number,
            endpoint,
            roster: roster.clone(),
            seats: seats.clone(),
            options: options.clone(),
            closing: closing.clone(),
        };
        match opened {
            Opened::Listener(listener) => doors.spawn(attend(listener, door)),
            Opened::Interface(opened) => doors.spawn(interface::attend(opened, door)),
        };
    }
    while doors.join_next().await.is_some() {}
}

/// What all conversations at one door share; of this, all doors share the roster and the seats.
#[derive(Clone)]
pub(super) struct Door {
    pub(super) door: usize,
    pub(super) endpoint: Endpoint,
    pub(super) roster: Arc<Roster>,
    seats: Arc<Seats>,
    pub(super) options: Options,
    pub(super) closing: watch::Receiver<bool>,
}

/// Lets clients in until the doors are closed, then waits for their conversations to end.
async fn attend(listener: TcpListener, door: Door) {
    let Ok(listener) = tokio::net::TcpListener::from_std(listener) else {
        return;
    };
    let mut closing = door.closing.clone();
    let mut conversations = JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, peer)) => match door.seats.take() {
                    Ok(seat) => {
                        conversations.spawn(converse(stream, peer, door.clone(), seat));
                    }
                    Err(taken) => turn_away(stream, peer, &door, taken),
                },
                // Out of file descriptors, or a client gone already: the next may do better.
                Err(_) => sleep(Duration::from_millis(50)).await,
            },
            Some(_) = conversations.join_next() => {}
            () = closed(&mut closing) => break,
        }
    }
    drop(listener);
    while conversations.join_next().await.is_some() {}
}

/// Until the doors are to be closed.
pub(super) async fn closed(closing: &mut watch::Receiver<bool>) {
    // An error means that the other side has gone without a word: closed as well.
    let _ = closing.wait_for(|closing| *closing).await;
}

/// Tells a client that there are too many. The socket is fresh, so the text fits in.
fn turn_away(stream: TcpStream, peer: SocketAddr, door: &Door, present: usize) {
    let reason = LeaveReason::Crowded(present);
    if let Ok(mut stream) = stream.into_std() {
        let _ = stream.write(&farewell(door.endpoint.protocol(), &reason));
    }
    door.roster.refuse(door.door, Peer::Tcp(peer), reason);
}

/// One client, from its connecting to the closing of its socket.
async fn converse(stream: TcpStream, peer: SocketAddr, door: Door, seat: Arc<Seat>) {
    // Without it answers are late, but right.
    let _ = stream.set_nodelay(true);
    let (mut input, output) = stream.into_split();
    let protocol = door.endpoint.protocol();
    let outbox = Arc::new(Outbox::new(door.options.outbox_frames));
    let mut writer = tokio::spawn(write(output, outbox.clone(), protocol));
    outbox.say(greeting(protocol));

    let mut closing = door.closing.clone();
    let joined = Arc::new(Notify::new());
    let mut client = Client {
        server: Server::new(&door.endpoint),
        place: (door.door, peer),
        held_frames: door.options.held_frames,
        roster: door.roster,
        outbox: outbox.clone(),
        seat,
        stay: Stay::Outside,
        joined: joined.clone(),
    };
    let reason = tokio::select! {
        reason = client.listen(&mut input) => reason,
        () = closed(&mut closing) => LeaveReason::Closing,
        () = late(door.options.handshake, &joined) => LeaveReason::Late(door.options.handshake),
    };
    match client.stay {
        Stay::On(id) => client.roster.leave(id, reason.clone()),
        // Who only looks in, like a port scanner or `nc -z`, is not worth a message.
        Stay::Outside if reason == LeaveReason::Disconnected => {}
        Stay::Outside | Stay::Off(_) if reason == LeaveReason::Closing => {}
        Stay::Outside => {
            let (door, peer) = client.place;
            client.roster.refuse(door, Peer::Tcp(peer), reason.clone());
        }
        Stay::Off(_) => {}
    }
    outbox.finish(farewell(protocol, &reason));
    // Read on until the client has closed too: closing a socket with unread input would make the
    // system throw away what is still on its way to the client, the farewell included.
    let rest = async {
        let sent = (&mut writer).await;
        let mut scrap = [0; 4096];
        while sent.is_ok() && input.read(&mut scrap).await.is_ok_and(|count| count > 0) {}
    };
    if timeout(door.options.linger, rest).await.is_err() {
        writer.abort();
    }
}

/// Until the time is over; never, if the client joins before.
async fn late(time: Duration, joined: &Notify) {
    if timeout(time, joined.notified()).await.is_ok() {
        std::future::pending().await
    }
}

/// Whether the client is on the bus.
#[derive(Clone, Copy)]
enum Stay {
    Outside,
    On(ClientId),
    /// It was, and may come again.
    Off(ClientId),
}

struct Client {
    server: Server,
    place: (usize, SocketAddr),
    held_frames: usize,
    roster: Arc<Roster>,
    outbox: Arc<Outbox>,
    seat: Arc<Seat>,
    stay: Stay,
    /// Told whenever the client has joined.
    joined: Arc<Notify>,
}

impl Client {
    /// Does what the client asks for, until the connection is to end.
    async fn listen(&mut self, input: &mut OwnedReadHalf) -> LeaveReason {
        let mut bytes = [0; 4096];
        loop {
            if let Err(reason) = self.until(|client| !client.outbox.is_behind()).await {
                return reason;
            }
            let count = tokio::select! {
                count = input.read(&mut bytes) => count,
                () = self.outbox.reader_woken() => continue,
            };
            let bytes = match count {
                Ok(0) => return LeaveReason::Disconnected,
                Ok(count) => bytes.get(..count).unwrap_or(&[]),
                Err(error) => return broken(&error),
            };
            for byte in bytes {
                if let Some(action) = self.server.push(*byte)
                    && let Err(reason) = self.act(action).await
                {
                    return reason;
                }
            }
        }
    }

    async fn act(&mut self, action: Action) -> Result<(), LeaveReason> {
        // It speaks again, so it has read what it was told.
        self.outbox.release();
        match action.effect {
            Effect::None => {}
            Effect::Join {
                listen_only,
                bit_rate,
            } => {
                // One stay after the other: nobody can fill the simulation's queue by going in
                // and out.
                if let Stay::Off(before) = self.stay {
                    self.until(|client| !client.roster.remembers(before))
                        .await?;
                }
                // The writer runs in this thread, so the client cannot read the answer before
                // it is on the roster: whoever it tells comes after it.
                self.outbox.open(action.answer, Instant::now() + AFTER_JOIN);
                let (door, peer) = self.place;
                let id = self.roster.join(Newcomer {
                    door,
                    peer: Peer::Tcp(peer),
                    outbox: &self.outbox,
                    seat: Some(self.seat.clone()),
                    listen_only,
                    bit_rate,
                    held_frames: self.held_frames,
                });
                self.stay = Stay::On(id);
                self.joined.notify_one();
                return Ok(());
            }
            Effect::Leave => {
                if let Stay::On(id) = self.stay {
                    self.roster.leave(id, LeaveReason::ChannelClosed);
                    self.stay = Stay::Off(id);
                    self.outbox.close();
                }
            }
            Effect::Send(frame) => self.send(frame).await?,
            Effect::Notes => self.outbox.set_manner(|manner| manner.notes = true),
            Effect::Timestamps(on) => self.outbox.set_manner(|manner| manner.timestamps = on),
            Effect::Drop(reason) => return Err(reason),
        }
        self.outbox.say(action.answer);
        self.until(|client| !client.outbox.is_behind()).await
    }

    async fn send(&mut self, frame: Frame) -> Result<(), LeaveReason> {
        if frame.is_remote() {
            self.outbox.set_manner(|manner| manner.remote = true);
        }
        match self.stay {
            Stay::On(id) => self.until(|client| client.roster.send(id, frame)).await,
            Stay::Outside | Stay::Off(_) => Ok(()),
        }
    }

    /// Waits until this is so, or the connection is to end.
    async fn until(&self, so: impl Fn(&Client) -> bool) -> Result<(), LeaveReason> {
        loop {
            if let Some(reason) = self.outbox.stopped() {
                return Err(reason);
            }
            if so(self) {
                return Ok(());
            }
            self.outbox.reader_woken().await;
        }
    }
}

fn broken(error: &io::Error) -> LeaveReason {
    match error.kind() {
        io::ErrorKind::ConnectionReset => LeaveReason::Disconnected,
        kind => LeaveReason::Broken(kind),
    }
}

/// Sends what is in the outbox until it is finished.
async fn write(mut output: OwnedWriteHalf, outbox: Arc<Outbox>, protocol: Protocol) {
    if let Err(error) = write_all(&mut output, &outbox, protocol).await {
        outbox.stop(broken(&error));
    }
    // Fails only if the client has gone.
    let _ = output.shutdown().await;
}

async fn write_all(
    output: &mut OwnedWriteHalf,
    outbox: &Outbox,
    protocol: Protocol,
) -> io::Result<()> {
    let mut batch = Vec::new();
    let mut text = Vec::new();
    loop {
        match outbox.next(&mut batch) {
            Next::Send(manner) => {
                for item in batch.drain(..) {
                    match item {
                        Item::Frame { stamp_ns, frame } => {
                            write_frame(&mut text, protocol, manner, stamp_ns, &frame);
                        }
                        Item::Text(answer) => say(output, &mut text, protocol, answer).await?,
                    }
                }
                output.write_all(&text).await?;
                text.clear();
            }
            Next::Wait => outbox.writer_woken().await,
            Next::WaitUntil(time) => {
                tokio::select! {
                    () = sleep_until(time) => {}
                    () = outbox.writer_woken() => {}
                }
            }
            Next::Close => return Ok(()),
        }
    }
}

/// socketcand's answers go out in segments of their own, slcan's together with the frames.
async fn say(
    output: &mut OwnedWriteHalf,
    text: &mut Vec<u8>,
    protocol: Protocol,
    answer: Text,
) -> io::Result<()> {
    match protocol {
        Protocol::Slcan | Protocol::SocketCan => text.extend_from_slice(&answer),
        Protocol::Socketcand => {
            output.write_all(text).await?;
            text.clear();
            output.write_all(&answer).await?;
        }
    }
    Ok(())
}
