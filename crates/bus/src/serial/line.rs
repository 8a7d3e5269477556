//! What the simulation's thread and the thread of the lines share of one line.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

use super::SerialEvent;

/// Bytes from outside that may wait to be taken.
const INCOMING: usize = 4096;
/// Bytes to the outside that may wait to be read.
const OUTGOING: usize = 65_536;

/// One line.
#[derive(Debug, Default)]
pub(super) struct Line {
    state: Mutex<State>,
    /// There is something to send.
    sends: Notify,
    /// There is room again for what comes.
    takes: Notify,
}

#[derive(Debug, Default)]
struct State {
    /// In order; bytes that follow bytes are one event.
    events: VecDeque<SerialEvent>,
    incoming: usize,
    outgoing: VecDeque<u8>,
    connected: bool,
    /// How many have gone whose going was not taken yet: what is answered until then is for them.
    leaving: usize,
}

impl Line {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn take(&self, room: usize) -> Option<SerialEvent> {
        let state = &mut *self.state();
        let Some(SerialEvent::Bytes(bytes)) = state.events.front_mut() else {
            let event = state.events.pop_front();
            if event == Some(SerialEvent::HungUp) {
                state.leaving = state.leaving.saturating_sub(1);
            }
            return event;
        };
        if room == 0 {
            return None;
        }
        let taken = if bytes.len() > room {
            let rest = bytes.split_off(room);
            std::mem::replace(bytes, rest)
        } else {
            let taken = std::mem::take(bytes);
            state.events.pop_front();
            taken
        };
        state.incoming -= taken.len();
        self.takes.notify_one();
        Some(SerialEvent::Bytes(taken))
    }

    pub(super) fn send(&self, bytes: &[u8]) {
        let state = &mut *self.state();
        if state.connected && state.leaving == 0 {
            let room = OUTGOING.saturating_sub(state.outgoing.len());
            state.outgoing.extend(bytes.iter().take(room));
            self.sends.notify_one();
        }
    }

    /// Somebody is there.
    pub(super) fn connect(&self) {
        let state = &mut *self.state();
        state.connected = true;
        state.outgoing.clear();
        state.events.push_back(SerialEvent::Connected);
    }

    /// Nobody is there any more.
    pub(super) fn hang_up(&self) {
        let state = &mut *self.state();
        if std::mem::take(&mut state.connected) {
            state.outgoing.clear();
            state.events.push_back(SerialEvent::HungUp);
            state.leaving += 1;
        }
    }

    /// How many bytes may come now; waits until there is room for one.
    pub(super) async fn room(&self) -> usize {
        loop {
            let room = INCOMING.saturating_sub(self.state().incoming);
            if room > 0 {
                return room;
            }
            self.takes.notified().await;
        }
    }

    /// These came.
    pub(super) fn came(&self, bytes: &[u8]) {
        let state = &mut *self.state();
        state.incoming += bytes.len();
        match state.events.back_mut() {
            Some(SerialEvent::Bytes(before)) => before.extend_from_slice(bytes),
            _ => state.events.push_back(SerialEvent::Bytes(bytes.to_vec())),
        }
    }

    /// What is to be sent; waits until there is something.
    pub(super) async fn to_send(&self) -> Vec<u8> {
        loop {
            let bytes: Vec<u8> = self.state().outgoing.iter().take(4096).copied().collect();
            if !bytes.is_empty() {
                return bytes;
            }
            self.sends.notified().await;
        }
    }

    /// So many of these were sent.
    pub(super) fn sent(&self, count: usize) {
        let state = &mut *self.state();
        let count = count.min(state.outgoing.len());
        state.outgoing.drain(..count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_taken_as_there_is_room_and_in_their_order() {
        let line = Line::default();
        line.connect();
        line.came(b"!CW 1");
        line.came(b" 15\r");
        line.hang_up();
        assert_eq!(line.take(0), Some(SerialEvent::Connected));
        assert_eq!(line.take(0), None);
        assert_eq!(line.take(3), Some(SerialEvent::Bytes(b"!CW".to_vec())));
        assert_eq!(line.take(99), Some(SerialEvent::Bytes(b" 1 15\r".to_vec())));
        assert_eq!(line.take(0), Some(SerialEvent::HungUp));
        assert_eq!(line.take(99), None);
        assert_eq!(line.state().incoming, 0);
    }

    #[test]
    fn who_comes_hears_nothing_of_what_who_has_gone_asked() {
        let line = Line::default();
        line.connect();
        line.came(b"?SPL\r?SPL\r");
        line.hang_up();
        line.connect();
        line.came(b"?F\r");
        assert_eq!(line.take(0), Some(SerialEvent::Connected));
        assert!(matches!(line.take(5), Some(SerialEvent::Bytes(_))));
        line.send(b"SPL=0:1000\r");
        assert!(matches!(line.take(99), Some(SerialEvent::Bytes(_))));
        line.send(b"SPL=0:1000\r");
        assert!(line.state().outgoing.is_empty());
        assert_eq!(line.take(0), Some(SerialEvent::HungUp));
        assert_eq!(line.take(0), Some(SerialEvent::Connected));
        assert!(matches!(line.take(99), Some(SerialEvent::Bytes(_))));
        line.send(b"F=0\r");
        assert_eq!(line.state().outgoing, *b"F=0\r");
    }

    #[test]
    fn what_nobody_reads_is_lost() {
        let line = Line::default();
        line.send(b"early");
        assert!(line.state().outgoing.is_empty());
        line.connect();
        line.send(&[b'+'; 70_000]);
        assert_eq!(line.state().outgoing.len(), OUTGOING);
        line.hang_up();
        line.hang_up();
        assert!(line.state().outgoing.is_empty());
        assert_eq!(line.take(0), Some(SerialEvent::Connected));
        assert_eq!(line.take(0), Some(SerialEvent::HungUp));
        assert_eq!(line.take(0), None);
    }
}
