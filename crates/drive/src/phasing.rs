//! Whether the rotor follows the field: the cause of 0x7122.
//!
//! A current that drives the rotor backwards shows a field that is oriented wrongly: the electrical
//! zero is half a turn off, or the magnet has slipped. Where it is a quarter turn off, or the order of
//! the phases is wrong, the rotor stands as if it were blocked; nothing tells the two apart.

/// So long must the rotor run away, ms.
const LASTING_MS: u8 = 10;
/// Smaller currents say nothing: this part of the continuous current.
const LEAST_PART: f32 = 0.2;

/// Watches the acceleration that a current causes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PhasingWatch {
    velocity: f32,
    wrong_ms: u8,
}

impl PhasingWatch {
    /// One millisecond more, with the measured current, A, the velocity, counts/s, the current of an
    /// acceleration, A per count/s², and the continuous current, A. Whether the rotor runs away: for
    /// 10 ms it has become faster against its current, by half of what the current should cause at
    /// least.
    pub(crate) fn tick(
        &mut self,
        current_a: f32,
        velocity: f32,
        amperes_per_acceleration: f32,
        continuous_a: f32,
    ) -> bool {
        let gained = velocity - self.velocity;
        self.velocity = velocity;
        let (against, faster) = (current_a * gained < 0.0, velocity * gained > 0.0);
        let caused_a = control::Real::abs(gained) * 1e3 * amperes_per_acceleration;
        let size_a = control::Real::abs(current_a);
        let wrong =
            against && faster && size_a > LEAST_PART * continuous_a && caused_a > 0.5 * size_a;
        self.wrong_ms = if wrong {
            self.wrong_ms.saturating_add(1)
        } else {
            0
        };
        self.wrong_ms >= LASTING_MS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 A gives a million counts/s², 1,000 counts/s each millisecond.
    const A_PER_ACCELERATION: f32 = 1e-6;

    fn ticks(current_a: f32, gained: f32, ms: usize) -> usize {
        let mut watch = PhasingWatch::default();
        let mut velocity = 0.0;
        (0..ms)
            .filter(|_| {
                velocity += gained;
                watch.tick(current_a, velocity, A_PER_ACCELERATION, 1.0)
            })
            .count()
    }

    #[test]
    fn running_away_is_seen_after_its_time() {
        assert_eq!(ticks(1.0, -1_000.0, 30), 21);
        assert_eq!(ticks(-0.5, 500.0, 10), 1);
        assert_eq!(ticks(1.0, -1_000.0, 9), 0);
    }

    #[test]
    fn a_rotor_that_follows_stands_or_is_pushed_a_little_is_well() {
        assert_eq!(ticks(1.0, 1_000.0, 100), 0);
        assert_eq!(ticks(1.0, 0.0, 100), 0);
        // A load that is stronger than a feeble current.
        assert_eq!(ticks(0.1, -1_000.0, 100), 0);
        // A heavy load pulls slowly.
        assert_eq!(ticks(1.0, -400.0, 100), 0);
        assert_eq!(ticks(f32::NAN, -1_000.0, 100), 0);
    }

    #[test]
    fn braking_is_not_running_away() {
        let mut watch = PhasingWatch::default();
        watch.tick(0.0, 100_000.0, A_PER_ACCELERATION, 1.0);
        let wrong = (1..=100)
            .filter(|ms| {
                let velocity = 100_000.0 - 1_000.0 * *ms as f32;
                watch.tick(-1.0, velocity, A_PER_ACCELERATION, 1.0)
            })
            .count();
        assert_eq!(wrong, 0);
    }
}
