//! What waits to be sent to one client, and the signals of its connection.

use super::{LeaveReason, Manner, Text};
use can::Frame;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::Notify;
use tokio::time::Instant;

/// Items the writer takes at a time: small, so that the count of those left stays true.
const BATCH: usize = 256;

/// One thing to be sent.
#[derive(Debug)]
pub(super) enum Item {
    Frame { stamp_ns: u64, frame: Frame },
    Text(Text),
}

/// What the writer is to do next.
#[derive(Debug)]
pub(super) enum Next {
    /// Send what is in the batch.
    Send(Manner),
    /// Wait to be woken.
    Wait,
    /// Wait to be woken, or until then.
    WaitUntil(Instant),
    /// All is sent: close.
    Close,
}

#[derive(Debug)]
pub(super) struct Outbox {
    state: Mutex<State>,
    capacity: usize,
    writer: Notify,
    reader: Notify,
}

#[derive(Debug, Default)]
struct State {
    queue: VecDeque<Item>,
    manner: Manner,
    /// The client is on the bus.
    open: bool,
    /// Frames wait until then.
    hold: Option<Instant>,
    /// The connection is to end, for this reason.
    stop: Option<LeaveReason>,
    /// Nothing more will be put in.
    finished: bool,
}

impl Outbox {
    pub(super) fn new(capacity: usize) -> Outbox {
        Outbox {
            state: Mutex::default(),
            capacity: capacity.max(2),
            writer: Notify::new(),
            reader: Notify::new(),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts in a frame from the bus. If there is no room, the connection is to end.
    pub(super) fn deliver(&self, frame: &Frame, stamp_ns: u64) {
        let state = &mut *self.state();
        if !state.open || state.stop.is_some() {
            return;
        }
        let waiting = state.queue.len();
        if waiting < self.capacity {
            state.queue.push_back(Item::Frame {
                stamp_ns,
                frame: *frame,
            });
            if waiting == 0 {
                self.writer.notify_one();
            }
        } else {
            state.queue.clear();
            state.stop = Some(LeaveReason::TooSlow { waiting });
            self.reader.notify_one();
        }
    }

    /// Puts in a note, if the client wants notes and is not behind.
    pub(super) fn note(&self, message: &[u8]) {
        let state = &mut *self.state();
        let waits = state.queue.len() >= self.capacity / 2;
        if state.open && state.stop.is_none() && state.manner.notes && !waits {
            state.queue.push_back(Item::Text(message.to_vec().into()));
            self.writer.notify_one();
        }
    }

    /// Puts in text. The reader does so only while the box is less than half full.
    pub(super) fn say(&self, text: Text) {
        if !text.is_empty() {
            self.state().queue.push_back(Item::Text(text));
            self.writer.notify_one();
        }
    }

    /// Puts in the last text and lets the writer close when all is sent.
    pub(super) fn finish(&self, farewell: Text) {
        let state = &mut *self.state();
        if !farewell.is_empty() {
            state.queue.push_back(Item::Text(farewell));
        }
        state.hold = None;
        state.open = false;
        state.finished = true;
        self.writer.notify_one();
    }

    /// The client is about to be on the bus: frames are taken from now on, but not sent until
    /// `hold`. The answer that says so is put in here, because it must stand before the first
    /// frame, and that may be delivered as soon as the simulation knows of the client.
    pub(super) fn open(&self, answer: Text, hold: Instant) {
        let state = &mut *self.state();
        state.queue.push_back(Item::Text(answer));
        state.open = true;
        state.hold = Some(hold);
        self.writer.notify_one();
    }

    /// An interface is on the bus: there is nobody to be answered first.
    pub(super) fn open_at_once(&self) {
        self.state().open = true;
    }

    /// The client has left the bus: no more frames, not even those that wait.
    pub(super) fn close(&self) {
        let state = &mut *self.state();
        state.open = false;
        state.queue.retain(|item| matches!(item, Item::Text(_)));
    }

    /// Ends the connection for this reason, if it has none yet.
    pub(super) fn stop(&self, reason: LeaveReason) {
        self.state().stop.get_or_insert(reason);
        self.reader.notify_one();
    }

    /// Why the connection is to end, if it is.
    pub(super) fn stopped(&self) -> Option<LeaveReason> {
        self.state().stop.clone()
    }

    /// Whether the client is behind, so that nothing should be read from it.
    pub(super) fn is_behind(&self) -> bool {
        self.state().queue.len() > self.capacity / 2
    }

    /// Lets frames go.
    pub(super) fn release(&self) {
        if self.state().hold.take().is_some() {
            self.writer.notify_one();
        }
    }

    pub(super) fn set_manner(&self, change: impl FnOnce(&mut Manner)) {
        change(&mut self.state().manner);
    }

    /// Fills `batch`, which is empty, with what is to be sent next.
    pub(super) fn next(&self, batch: &mut Vec<Item>) -> Next {
        let state = &mut *self.state();
        let now = Instant::now();
        state.hold = state.hold.filter(|until| *until > now);
        let was_behind = state.queue.len() > self.capacity / 2;
        while batch.len() < BATCH {
            match state.queue.front() {
                Some(Item::Frame { .. }) if state.hold.is_some() => break,
                Some(_) => batch.extend(state.queue.pop_front()),
                None => break,
            }
        }
        if was_behind && state.queue.len() <= self.capacity / 2 {
            self.reader.notify_one();
        }
        match state.hold {
            _ if !batch.is_empty() => Next::Send(state.manner),
            _ if state.finished => Next::Close,
            Some(until) => Next::WaitUntil(until),
            None => Next::Wait,
        }
    }

    /// Until the writer has something to do, or is woken for nothing.
    pub(super) async fn writer_woken(&self) {
        self.writer.notified().await;
    }

    /// Until something the reader waits for may have changed.
    pub(super) async fn reader_woken(&self) {
        self.reader.notified().await;
    }

    pub(super) fn wake_reader(&self) {
        self.reader.notify_one();
    }
}
