//! How many clients there may be at one time, all doors together.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The seats of all doors.
#[derive(Debug)]
pub(super) struct Seats {
    taken: AtomicUsize,
    all: usize,
}

/// One client's place, free again when this is dropped. The conversation and the roster share it:
/// who has disconnected keeps it until the simulation has taken leave of it.
#[derive(Debug)]
pub(super) struct Seat(Arc<Seats>);

impl Seats {
    pub(super) fn new(all: usize) -> Arc<Seats> {
        Arc::new(Seats {
            taken: AtomicUsize::new(0),
            all,
        })
    }

    /// A free seat, or how many are taken if that is all of them.
    pub(super) fn take(self: &Arc<Seats>) -> Result<Arc<Seat>, usize> {
        self.taken
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |taken| {
                (taken < self.all).then(|| taken + 1)
            })
            .map(|_| Arc::new(Seat(self.clone())))
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.0.taken.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seat_is_free_when_nobody_holds_it() {
        let seats = Seats::new(2);
        let first = seats.take().unwrap();
        let shared = first.clone();
        let _second = seats.take().unwrap();
        assert_eq!(seats.take().unwrap_err(), 2);
        drop(first);
        assert_eq!(seats.take().unwrap_err(), 2);
        drop(shared);
        let _third = seats.take().unwrap();
        assert_eq!(seats.take().unwrap_err(), 2);
        assert_eq!(Seats::new(0).take().unwrap_err(), 0);
    }
}
