//! The queries that were asked last.

/// How many are kept.
pub(crate) const LENGTH: usize = 16;

/// A query: the row of its command, and the number that came with it, if one did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Asked {
    pub(crate) row: u8,
    pub(crate) number: Option<i32>,
}

/// The last queries, oldest first, and which of them is next when they are asked again.
#[derive(Clone, Copy, Debug)]
pub(crate) struct History {
    queries: [Asked; LENGTH],
    length: u8,
    next: u8,
}

impl History {
    pub(crate) const EMPTY: History = History {
        queries: [Asked {
            row: 0,
            number: None,
        }; LENGTH],
        length: 0,
        next: 0,
    };

    /// Keeps a query; of too many the oldest goes.
    pub(crate) fn push(&mut self, query: Asked) {
        if usize::from(self.length) == LENGTH {
            self.queries.rotate_left(1);
            self.length -= 1;
            // It stays at the query that it was at.
            self.next = self.next.saturating_sub(1);
        }
        if let Some(place) = self.queries.get_mut(usize::from(self.length)) {
            *place = query;
            self.length += 1;
        }
    }

    /// The next query, round and round; `None` if there are none.
    pub(crate) fn next(&mut self) -> Option<Asked> {
        let length = usize::from(self.length);
        let queries = self.queries.get(..length)?;
        let at = if self.next < self.length {
            self.next
        } else {
            0
        };
        let query = queries.get(usize::from(at)).copied()?;
        self.next = at + 1;
        Some(query)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn query(row: u8) -> Asked {
        Asked { row, number: None }
    }

    #[test]
    fn queries_come_again_in_their_order_round_and_round() {
        let mut history = History::EMPTY;
        assert_eq!(history.next(), None);
        for row in 0..3 {
            history.push(query(row));
        }
        let rows: [u8; 7] = core::array::from_fn(|_| history.next().map_or(99, |asked| asked.row));
        assert_eq!(rows, [0, 1, 2, 0, 1, 2, 0]);
    }

    #[test]
    fn of_seventeen_the_oldest_is_forgotten() {
        let mut history = History::EMPTY;
        for row in 0..20 {
            history.push(query(row));
        }
        let rows: [u8; 17] = core::array::from_fn(|_| history.next().map_or(99, |asked| asked.row));
        assert_eq!(rows[0], 4);
        assert_eq!(rows[15], 19);
        assert_eq!(rows[16], 4);
    }
}
