//! Who is on the bus, and what each of them is still owed: the part that the simulation's thread
//! and the sockets' thread share.

use super::{ClientId, LeaveReason, Options, Outbox, Peer, Seat, Trouble};
use can::Frame;
use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Refusals and troubles that may wait to be taken; more are not reported.
const REFUSALS: usize = 1_000;

/// An event on its way to the simulation.
#[derive(Debug)]
pub(super) enum Happening {
    Joined {
        client: ClientId,
        outbox: Arc<Outbox>,
        door: usize,
        peer: Peer,
        listen_only: bool,
        bit_rate: Option<u32>,
    },
    Frame {
        client: ClientId,
        frame: Frame,
    },
    Left {
        client: ClientId,
        reason: LeaveReason,
    },
    Refused {
        door: usize,
        peer: Peer,
        reason: LeaveReason,
    },
    Trouble {
        door: usize,
        trouble: Trouble,
    },
}

/// Somebody who is about to join.
#[derive(Debug)]
pub(super) struct Newcomer<'a> {
    pub(super) door: usize,
    pub(super) peer: Peer,
    pub(super) outbox: &'a Arc<Outbox>,
    /// An interface needs none.
    pub(super) seat: Option<Arc<Seat>>,
    pub(super) listen_only: bool,
    pub(super) bit_rate: Option<u32>,
    /// Frames that may be held beyond its credit.
    pub(super) held_frames: usize,
}

#[derive(Debug)]
pub(super) struct Roster {
    state: Mutex<State>,
    /// Something happened.
    arrived: Condvar,
    /// Whether `state.happened` may hold something: spares the lock when it does not.
    pending: AtomicBool,
    mailbox_frames: u32,
}

#[derive(Debug, Default)]
struct State {
    happened: VecDeque<Happening>,
    refusals: usize,
    /// Everyone who joined and whose leaving has not been taken yet.
    members: HashMap<ClientId, Member>,
    joined: u32,
}

/// One client as long as it has something to say. Invariant: frames are held only while there is
/// no credit, so that they come in order.
#[derive(Debug)]
struct Member {
    credit: u32,
    held: VecDeque<Frame>,
    held_frames: usize,
    leaving: Option<LeaveReason>,
    outbox: Arc<Outbox>,
    /// Kept until the leaving is taken.
    _seat: Option<Arc<Seat>>,
}

impl Roster {
    pub(super) fn new(options: &Options) -> Roster {
        Roster {
            state: Mutex::default(),
            arrived: Condvar::new(),
            pending: AtomicBool::new(false),
            mailbox_frames: options.mailbox_frames,
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn happened(&self, state: &mut State, happening: Happening) {
        state.happened.push_back(happening);
        self.pending.store(true, Ordering::Release);
        self.arrived.notify_one();
    }

    /// Puts a client on the bus.
    pub(super) fn join(&self, newcomer: Newcomer<'_>) -> ClientId {
        let state = &mut *self.state();
        state.joined += 1;
        let client = ClientId(state.joined);
        let outbox = newcomer.outbox.clone();
        let member = Member {
            credit: self.mailbox_frames,
            held: VecDeque::new(),
            held_frames: newcomer.held_frames.max(1),
            leaving: None,
            outbox: outbox.clone(),
            _seat: newcomer.seat,
        };
        state.members.insert(client, member);
        let joined = Happening::Joined {
            client,
            outbox,
            door: newcomer.door,
            peer: newcomer.peer,
            listen_only: newcomer.listen_only,
            bit_rate: newcomer.bit_rate,
        };
        self.happened(state, joined);
        client
    }

    /// Takes a frame from a client, or gives `false`: none more can be held, try again when woken.
    pub(super) fn send(&self, client: ClientId, frame: Frame) -> bool {
        let state = &mut *self.state();
        let Some(member) = state.members.get_mut(&client) else {
            return true;
        };
        if member.credit > 0 {
            member.credit -= 1;
            self.happened(state, Happening::Frame { client, frame });
        } else if member.held.len() < member.held_frames {
            member.held.push_back(frame);
        } else {
            return false;
        }
        true
    }

    /// Gives credit to a client, which sets held frames free.
    pub(super) fn grant(&self, client: ClientId, frames: u32) {
        let state = &mut *self.state();
        let Some(member) = state.members.get_mut(&client) else {
            return;
        };
        member.credit = member.credit.saturating_add(frames);
        let free = member.held.len().min(member.credit as usize);
        member.credit -= free as u32;
        let freed: Vec<Frame> = member.held.drain(..free).collect();
        let left = if member.held.is_empty() {
            member.leaving.take()
        } else {
            None
        };
        if free > 0 && member.held.len() <= member.held_frames / 2 {
            member.outbox.wake_reader();
        }
        for frame in freed {
            self.happened(state, Happening::Frame { client, frame });
        }
        if let Some(reason) = left {
            self.happened(state, Happening::Left { client, reason });
        }
    }

    /// Takes a client off the bus, once all its frames are on it.
    pub(super) fn leave(&self, client: ClientId, reason: LeaveReason) {
        let state = &mut *self.state();
        let Some(member) = state.members.get_mut(&client) else {
            return;
        };
        if member.held.is_empty() {
            self.happened(state, Happening::Left { client, reason });
        } else {
            member.leaving = Some(reason);
        }
    }

    /// Reports somebody who never got onto the bus.
    pub(super) fn refuse(&self, door: usize, peer: Peer, reason: LeaveReason) {
        self.report(Happening::Refused { door, peer, reason });
    }

    /// Reports trouble of an interface.
    pub(super) fn trouble(&self, door: usize, trouble: Trouble) {
        self.report(Happening::Trouble { door, trouble });
    }

    fn report(&self, happening: Happening) {
        let state = &mut *self.state();
        if state.refusals < REFUSALS {
            state.refusals += 1;
            self.happened(state, happening);
        }
    }

    /// Whether the leaving of this client has not been taken yet.
    pub(super) fn remembers(&self, client: ClientId) -> bool {
        self.state().members.contains_key(&client)
    }

    /// The simulation has taken the leaving of this client.
    pub(super) fn forget(&self, client: ClientId) {
        let member = self.state().members.remove(&client);
        if let Some(member) = member {
            member.outbox.wake_reader();
        }
    }

    /// Moves all that happened into `ready`, which is empty.
    pub(super) fn collect(&self, ready: &mut VecDeque<Happening>) {
        if self.pending.load(Ordering::Acquire) {
            let state = &mut *self.state();
            std::mem::swap(&mut state.happened, ready);
            state.refusals = 0;
            self.pending.store(false, Ordering::Release);
        }
    }

    /// Waits until something has happened or the time is over.
    pub(super) fn wait(&self, timeout: Duration) {
        let state = self.state();
        // Woken or timed out makes no difference to the caller, and poisoning cannot hurt here.
        let _ = self
            .arrived
            .wait_timeout_while(state, timeout, |state| state.happened.is_empty());
    }
}
