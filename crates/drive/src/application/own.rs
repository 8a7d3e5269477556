//! The seam to what only one documented drive does.

use canopen::{Address, Image, Verdict};
use personalities::own::{AxisView, Orders, OwnBehaviour};

use super::Application;
use crate::body::Body;

impl<O: OwnBehaviour, B: Body> Application<O, B> {
    /// What own behaviour sees of an axis; 0 is the first. Of one that is not there, the first.
    pub(crate) fn view(&self, axis: usize) -> AxisView {
        let part = self.axes().get(axis).unwrap_or_else(|| self.first());
        part.view(&self.hardware)
    }

    /// What a write means to own behaviour, if anything.
    pub(super) fn write_own(
        &mut self,
        image: &Image<'_>,
        object: Address,
        new: &[u8],
    ) -> Option<Verdict> {
        let mut orders = Orders::default();
        let axis = usize::from(self.own.axis_of(object));
        let view = self.view(axis);
        let verdict = self.own.write(image, object, new, &view, &mut orders);
        self.obey(axis, image, &orders);
        verdict
    }

    /// A millisecond of own behaviour.
    pub(crate) fn tick_own(&mut self, image: &mut Image<'_>) {
        if self.own.is_nothing() {
            return;
        }
        for axis in 0..self.axes().len() {
            let mut orders = Orders::default();
            let view = self.view(axis);
            self.own.tick(image, &view, &mut orders);
            self.obey(axis, image, &orders);
        }
    }

    fn obey(&mut self, axis: usize, image: &Image<'_>, orders: &Orders) {
        if *orders == Orders::default() {
            return;
        }
        self.noting(|axes, common| {
            if let Some(part) = axes.get_mut(axis) {
                part.obey(common, image, orders);
            }
        });
        if orders.store.is_some() {
            self.storage_request = orders.store;
            self.restores = false;
        }
    }
}
