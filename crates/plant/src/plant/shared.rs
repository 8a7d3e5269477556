//! Several plants on one supply: the axes of one drive.

use control::Real;

use super::Plant;

impl<R: Real> Plant<R> {
    /// Moves the axes of one drive forward by one PWM period. They hang on one supply, that of the
    /// first: what their bridges take and give back adds up, and each sees the voltage that comes of
    /// it. The supplies of the others, and what was set on them, do not count. Their PWM periods are
    /// one.
    pub fn step_axes(axes: &mut [Self]) {
        let Some((first, others)) = axes.split_first_mut() else {
            return;
        };
        for axis in others.iter_mut() {
            axis.hang_on(first);
        }
        let mut taken = first.step_bridge();
        for axis in others.iter_mut() {
            taken += axis.step_bridge();
        }
        if first.supply.is_ideal() {
            return;
        }
        first.supply.end_period(taken);
        for axis in others {
            axis.supply.follow(&first.supply);
        }
    }

    /// All of a step but what it does to the supply; gives the current that the bridge has taken, A.
    fn step_bridge(&mut self) -> R {
        self.leaves_supply = true;
        self.step();
        self.leaves_supply = false;
        self.bridge_current
    }

    /// Has the supply of `other`.
    fn hang_on(&mut self, other: &Self) {
        let was_ideal = self.supply.is_ideal();
        self.supply.follow(&other.supply);
        if was_ideal != self.supply.is_ideal() {
            self.parameters.link = other.parameters.link;
            self.look_for_effects();
        }
    }
}
