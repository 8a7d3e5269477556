//! The owner of a drive's objects: what it has once, and its axes.

mod writes;

use canopen::{Changed, Image, Instant, NodeId, store};
use control::Parameters;
use personalities::Personality;

use crate::axis_part::{AxisPart, Common};
use crate::body::{Body, List};
use crate::faults::{Announcement, Errors, FaultManager};
use crate::gains::Direct;
use crate::parameters::read_parameters;
use crate::{Hardware, ParameterError};

/// Everything about the drive that is not CANopen itself.
#[derive(Clone, Debug)]
pub(crate) struct Application<B: Body> {
    pub(crate) personality: &'static Personality,
    common: Common,
    pub(crate) faults: FaultManager,
    axes: B::List<AxisPart>,
    /// To be taken once its write is acknowledged.
    pub(crate) new_node_id: Option<NodeId>,
    /// What of the parameters is to be saved, or with `restores` put back to its defaults.
    pub(crate) storage_request: Option<store::Request>,
    pub(crate) restores: bool,
    /// A program is to be started: with it the node starts over.
    pub(crate) restart: bool,
}

impl<B: Body> Application<B> {
    /// Reads everything from the image. Beside it: the parameters of each axis's loops.
    ///
    /// # Errors
    /// The [`ParameterError`] of a dictionary whose very defaults make no drive, or of a body that
    /// has no room for its axes.
    pub(crate) fn new(
        personality: &'static Personality,
        hardware: Hardware,
        image: &Image<'_>,
    ) -> Result<(Application<B>, B::List<Parameters<f32>>), ParameterError> {
        let count = personality.axes.len();
        let axes = List::build(count, |number| {
            AxisPart::new(personality, number, &hardware, image)
        })?;
        let parameters = List::build(count, |number| {
            let its = personality.axes.get(number);
            let its = its.ok_or(ParameterError::Axes(count))?;
            read_parameters(image, its, &hardware, Direct::default()).map(|(made, _)| made)
        })?;
        let application = Application {
            personality,
            common: Common {
                hardware,
                is_stopped: false,
            },
            faults: FaultManager::default(),
            axes,
            new_node_id: None,
            storage_request: None,
            restores: false,
            restart: false,
        };
        Ok((application, parameters))
    }

    /// The axes, the first one first.
    pub(crate) fn axes(&self) -> &[AxisPart] {
        self.axes.as_ref()
    }

    /// The first axis.
    pub(crate) fn first(&self) -> &AxisPart {
        self.axes.first()
    }

    /// An axis; 0 is the first.
    pub(crate) fn axis_mut(&mut self, number: usize) -> Option<&mut AxisPart> {
        self.axes.as_mut().get_mut(number)
    }

    /// Acts upon writes that were committed.
    pub(crate) fn changed(&mut self, image: &Image<'_>, changed: Changed) {
        for axis in self.axes.as_mut() {
            axis.changed(&self.common, image, changed);
        }
    }

    /// A SYNC was received; what came with it has been acted upon.
    pub(crate) fn sync(&mut self, image: &Image<'_>, now: Instant) {
        for axis in self.axes.as_mut() {
            axis.sync(image, now);
        }
    }

    /// Once per millisecond.
    pub(crate) fn tick(&mut self, image: &Image<'_>, now: Instant) {
        // What inputs reset may come again in this tick; both is announced.
        self.noting(|axes, common| {
            for axis in axes {
                axis.obey_inputs(common, image);
            }
        });
        let happened = self.faults.take_happened();
        self.noting(|axes, common| {
            for axis in axes {
                axis.tick(common, image, now, &happened);
            }
        });
    }

    /// Does something to the axes; what it changes in their errors will be announced.
    fn noting<T>(&mut self, act: impl FnOnce(&mut [AxisPart], &Common) -> T) -> T {
        let before = self.errors();
        let done = act(self.axes.as_mut(), &self.common);
        self.faults.note(before, self.errors());
        done
    }

    /// Those of all axes.
    fn errors(&self) -> Errors {
        let errors = self.axes().iter().map(|axis| axis.faults.errors());
        errors.fold(Errors::default(), Errors::and)
    }

    /// The next change of an error to announce.
    pub(crate) fn announce(&mut self) -> Option<Announcement> {
        let errors = self.errors();
        self.faults.announce(self.personality, errors)
    }

    /// 0x1002: a bit for each active error.
    pub(crate) fn status_register(&self) -> u32 {
        self.errors().status_register(self.personality.faults)
    }

    /// The program has been stopped (0x1F51): nothing moves until the next start.
    pub(crate) fn program_stops(&mut self) {
        self.common.is_stopped = true;
    }

    /// The program is to start (0x1F51).
    pub(crate) fn program_starts(&mut self) {
        self.restart = true;
    }

    /// Whether a power stage is on.
    pub(crate) fn is_powered(&self) -> bool {
        self.axes().iter().any(AxisPart::is_powered)
    }

    /// The stored parameters are in the image.
    pub(crate) fn loaded(&mut self, image: &Image<'_>) {
        for axis in self.axes.as_mut() {
            axis.loaded(image);
        }
    }

    /// The image is about to be stored.
    pub(crate) fn before_store(&mut self, image: &mut Image<'_>) {
        for axis in self.axes.as_mut() {
            axis.before_store(image);
        }
    }

    /// Writes the gains that follow from those written into the image, if they have changed. A write
    /// to one of them keeps what is shown of the others.
    pub(crate) fn show_gains(&mut self, image: &mut Image<'_>) {
        for axis in self.axes.as_mut() {
            axis.show_gains(image);
        }
    }

    /// Writes what the drive shows into the image.
    pub(crate) fn publish(&mut self, image: &mut Image<'_>) {
        for axis in self.axes.as_mut() {
            axis.publish(image);
        }
    }

    /// What the control half of an axis is to take, in its order.
    pub(crate) fn take_parameters(
        &mut self,
        axis: usize,
        image: &Image<'_>,
    ) -> Option<Parameters<f32>> {
        let part = self.axes.as_mut().get_mut(axis)?;
        part.take_parameters(&self.common, image)
    }
}
