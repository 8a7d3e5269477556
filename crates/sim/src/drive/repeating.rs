//! Control periods that are all the same: of loops that have come to rest behind an open bridge.

use control::io::{Duty, Sample, Signals};

use super::Core;

/// The last control period of an axis. When sensors and board say the same as in the one before, and
/// that has changed nothing in the loops, the next one needs no computing.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Repeating {
    /// If the bridge was open.
    last: Option<(Sample<f32>, Signals, Duty<f32>)>,
    settled: bool,
}

impl Repeating {
    /// The loops may have been told something.
    #[inline]
    pub(super) fn stop(&mut self) {
        self.settled = false;
    }

    /// One control period of `axis`.
    #[inline]
    pub(super) fn period(
        &mut self,
        core: &mut Core,
        axis: usize,
        sample: &Sample<f32>,
        signals: &Signals,
    ) -> Duty<f32> {
        let duty = match &self.last {
            Some((last, board, duty)) if last == sample && board == signals => {
                if self.settled {
                    return *duty;
                }
                let (duty, settled) = core.repeated_period(axis, sample, signals);
                self.settled = settled;
                duty
            }
            _ => {
                self.settled = false;
                core.axis_period(axis, sample, signals)
            }
        };
        self.last = (!duty.enabled).then_some((*sample, *signals, duty));
        duty
    }
}
