//! The correction table of an encoder: how much its reading is off at each place of a turn, because the
//! magnet is not centred over it.

use canopen::{Field, Image};

use crate::md80::internal::{COUNTS_PER_TURN, PLACES};

/// Counts between two places, a power of two.
const APART: i32 = (COUNTS_PER_TURN / PLACES as u32) as i32;
/// The table's unit is a sixteenth of a count.
const UNITS: i32 = 16;

/// Means of a quantity at each place of a turn.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Means {
    sums: [f32; PLACES],
    counts: [u16; PLACES],
}

impl Means {
    /// One more, at a reading of 2³² per turn.
    pub(super) fn add(&mut self, value: f32, reading: i32) {
        let place = (reading as u32 / (u32::MAX / PLACES as u32 + 1)) as usize;
        if let (Some(sum), Some(count)) = (self.sums.get_mut(place), self.counts.get_mut(place)) {
            *sum += value;
            *count = count.saturating_add(1);
        }
    }

    /// Each place's mean; `None` if one has none.
    fn places(&self) -> Option<[f32; PLACES]> {
        let mut means = self.sums;
        for (mean, count) in means.iter_mut().zip(self.counts) {
            if count == 0 {
                return None;
            }
            *mean /= f32::from(count);
        }
        Some(means)
    }
}

/// What the means of two passes, or of one twice, tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Told {
    /// Their mean over a turn.
    pub(super) mean: f32,
    /// What each place's differ from it.
    pub(super) deviations: [f32; PLACES],
}

/// The mean of both passes at each place; `None` if they did not come by everywhere.
pub(super) fn told(passes: &[Means; 2]) -> Option<Told> {
    let [first, second] = passes;
    let mut deviations = first.places()?;
    let mut mean = 0.0;
    for (one, other) in deviations.iter_mut().zip(second.places()?) {
        *one = 0.5 * (*one + other);
        mean += *one / PLACES as f32;
    }
    for deviation in &mut deviations {
        *deviation -= mean;
    }
    Some(Told { mean, deviations })
}

/// By how much readings are off, in its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Table {
    places: [i16; PLACES],
    /// All of them are 0.
    is_plain: bool,
}

impl Table {
    /// That which is stored.
    pub(super) fn stored(image: &Image<'_>, fields: &[Field; PLACES]) -> Table {
        Table::of(fields.map(|field| image.number(field) as i16))
    }

    fn of(places: [i16; PLACES]) -> Table {
        let is_plain = places.iter().all(|place| *place == 0);
        Table { places, is_plain }
    }

    /// Of errors in turns.
    pub(super) fn of_turns(errors: [f32; PLACES]) -> Table {
        let per_turn = (COUNTS_PER_TURN as i32 * UNITS) as f32;
        // `as` saturates.
        Table::of(errors.map(|turns| rounded(turns * per_turn) as i16))
    }

    /// Into the image, to be stored.
    pub(super) fn keep(&self, image: &mut Image<'_>, fields: &[Field; PLACES]) {
        for (field, place) in fields.iter().zip(self.places) {
            image.set_number(*field, place.into());
        }
    }

    /// How much a reading of `count` is off, units: linear between the middles of two places.
    #[inline]
    fn off(&self, count: i32) -> i32 {
        let from_middle = count.wrapping_sub(APART / 2) & (COUNTS_PER_TURN as i32 - 1);
        let place = (from_middle / APART) as usize % PLACES;
        let beyond = from_middle % APART;
        let at = |place: usize| i32::from(self.places.get(place).copied().unwrap_or(0));
        let (before, after) = (at(place), at((place + 1) % PLACES));
        before + (after - before) * beyond / APART
    }

    /// What a reading within a turn should be, counts.
    #[inline]
    pub(super) fn right(&self, raw: i32) -> i32 {
        if self.is_plain {
            return raw;
        }
        let units = raw.wrapping_mul(UNITS).wrapping_sub(self.off(raw));
        units.wrapping_add(UNITS / 2).div_euclid(UNITS) & (COUNTS_PER_TURN as i32 - 1)
    }

    /// The same in turns, from 0 to 1 and a little beyond.
    pub(super) fn right_turns(&self, turns: f32) -> f32 {
        let count = (turns * COUNTS_PER_TURN as f32) as i32;
        let per_turn = (COUNTS_PER_TURN as i32 * UNITS) as f32;
        turns - self.off(count) as f32 / per_turn
    }
}

/// Half away from 0, before `as` cuts.
pub(super) fn rounded(value: f32) -> f32 {
    if value < 0.0 {
        value - 0.5
    } else {
        value + 0.5
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    fn error(reading: f64) -> f64 {
        0.01 * (std::f64::consts::TAU * reading + 0.7).sin()
    }

    #[test]
    fn readings_are_right_to_a_count_after_a_pass() {
        let mut means = Means::default();
        for step in 0..4000 {
            let reading = f64::from(step) / 4000.0;
            let angle = (reading * 4_294_967_296.0) as i64 as i32;
            means.add((error(reading) + 0.25) as f32, angle);
        }
        let told = told(&[means; 2]).unwrap();
        assert!((told.mean - 0.25).abs() < 1e-4);
        let table = Table::of_turns(told.deviations);
        let turn = COUNTS_PER_TURN as i32;
        let mut worst = 0.0_f64;
        for raw in 0..turn {
            let wanted = f64::from(raw) - error(f64::from(raw) / f64::from(turn)) * f64::from(turn);
            let off = f64::from(table.right(raw)) - wanted;
            let off = off - (off / f64::from(turn)).round() * f64::from(turn);
            worst = worst.max(off.abs());
            assert!((0..turn).contains(&table.right(raw)));
            let turns = f64::from(table.right_turns(raw as f32 / turn as f32));
            assert!((turns - wanted / f64::from(turn)).abs() < 2e-4);
        }
        // Of 164 counts.
        assert!(worst < 1.6, "{worst}");
    }

    #[test]
    fn a_pass_that_left_places_out_tells_nothing() {
        let mut means = Means::default();
        means.add(1.0, 5);
        assert_eq!(told(&[means; 2]), None);
    }

    #[test]
    fn no_table_changes_nothing() {
        let table = Table::of([0; PLACES]);
        assert_eq!(table.right(12_345), 12_345);
    }
}
