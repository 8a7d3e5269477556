//! The owner of a drive's objects: what it has once, and its axes.

mod own;
mod writes;

use canopen::{Changed, Image, Instant, NodeId, store};
use control::capture::Seen;
use control::io::Signals;
use control::{Command, Feedback, Limits, Parameters};
use personalities::Personality;
use personalities::own::OwnBehaviour;

use crate::axis_part::{AxisPart, Common};
use crate::body::{Body, List};
use crate::faults::{Announcement, Errors, FaultManager};
use crate::gains::Direct;
use crate::parameters::read_parameters;
use crate::{Hardware, ParameterError};

/// Everything about the drive that is not CANopen itself.
#[derive(Clone, Debug)]
pub(crate) struct Application<O, B: Body> {
    pub(crate) personality: &'static Personality,
    hardware: Hardware,
    /// The program is stopped: the power stages stay off.
    is_stopped: bool,
    pub(crate) faults: FaultManager,
    axes: B::List<AxisPart>,
    /// To be taken once its write is acknowledged.
    pub(crate) new_node_id: Option<NodeId>,
    /// What of the parameters is to be saved, or with `restores` put back to its defaults.
    pub(crate) storage_request: Option<store::Request>,
    pub(crate) restores: bool,
    /// A program is to be started: with it the node starts over.
    pub(crate) restart: bool,
    /// What only this drive does.
    pub(crate) own: O,
}

/// An application, and the parameters of each axis's loops.
type MadeApplication<O, B> = (Application<O, B>, <B as Body>::List<Parameters<f32>>);

impl<O: OwnBehaviour, B: Body> Application<O, B> {
    /// Reads everything from the image. Beside it: the parameters of each axis's loops.
    ///
    /// # Errors
    /// The [`ParameterError`] of a dictionary whose very defaults make no drive, or of a body that
    /// has no room for its axes.
    pub(crate) fn new(
        personality: &'static Personality,
        hardware: Hardware,
        image: &Image<'_>,
    ) -> Result<MadeApplication<O, B>, ParameterError> {
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
            hardware,
            is_stopped: false,
            faults: FaultManager::default(),
            axes,
            new_node_id: None,
            storage_request: None,
            restores: false,
            restart: false,
            own: O::new(personality, image),
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
        let (axes, common) = self.split();
        for axis in axes {
            axis.changed(&common, image, changed);
        }
    }

    /// A SYNC was received; what came with it has been acted upon.
    pub(crate) fn sync(&mut self, image: &Image<'_>, now: Instant) {
        let (axes, common) = self.split();
        for axis in axes {
            axis.sync(&common, image, now);
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

    /// The axes, and what they need of the drive.
    fn split(&mut self) -> (&mut [AxisPart], Common<'_, O>) {
        let common = Common {
            hardware: &self.hardware,
            own: &self.own,
            is_stopped: self.is_stopped,
        };
        (self.axes.as_mut(), common)
    }

    /// Does something to the axes; what it changes in their errors will be announced.
    fn noting<T>(&mut self, act: impl FnOnce(&mut [AxisPart], &Common<'_, O>) -> T) -> T {
        let before = self.errors();
        let (axes, common) = self.split();
        let done = act(axes, &common);
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
        self.is_stopped = true;
    }

    /// The program is to start (0x1F51).
    pub(crate) fn program_starts(&mut self) {
        self.restart = true;
    }

    /// Whether a power stage is on.
    pub(crate) fn is_powered(&self) -> bool {
        self.axes().iter().any(|axis| axis.is_powered(&self.own))
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
        for axis in self.axes.as_ref() {
            self.own.publish(image, &axis.view(&self.hardware));
        }
    }

    /// What the control half of an axis is to take, in its order.
    pub(crate) fn take_parameters(
        &mut self,
        axis: usize,
        image: &Image<'_>,
    ) -> Option<Parameters<f32>> {
        let (axes, common) = self.split();
        axes.get_mut(axis)?.take_parameters(&common, image)
    }

    /// A new command for the control half of an axis.
    pub(crate) fn take_command(&mut self, axis: usize) -> Option<Command<f32>> {
        let (axes, common) = self.split();
        axes.get_mut(axis)?.take_command(common.own)
    }

    /// Limits that changed while the demand of an axis goes on.
    pub(crate) fn take_limits(&mut self, axis: usize) -> Option<Limits<f32>> {
        let (axes, common) = self.split();
        axes.get_mut(axis)?.take_limits(common.own)
    }

    /// Takes what the control half of an axis has seen.
    #[inline]
    pub(crate) fn observe(
        &mut self,
        axis: usize,
        feedback: &Feedback<f32>,
        signals: &Signals,
        seen: &Seen,
    ) {
        let (axes, common) = self.split();
        if let Some(axis) = axes.get_mut(axis) {
            axis.observe(common.own, feedback, signals, seen);
        }
    }
}
