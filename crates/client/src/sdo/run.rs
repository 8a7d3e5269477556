//! The state machine of a transfer, driven over a link.

use std::ops::ControlFlow;

use canopen::sdo_client::{self, Channel, Done, Failure, Method, SdoClient, Sink, Source, Stage};
use canopen::{Abort, Address, NodeId};

use crate::sdo::Cause;
use crate::{Client, Link, RequestForm};

/// How long at most between two looks at whether the caller still wants the transfer.
const LOOK_MS: u64 = 50;

/// Which way, and how many bytes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Direction {
    Upload,
    Download(u32),
}

/// Never gives up.
pub(super) fn go_on(_: &SdoClient) -> ControlFlow<Abort> {
    ControlFlow::Continue(())
}

impl<L: Link> Client<L> {
    /// A state machine for transfers with `node`, as the settings say.
    pub(super) fn sdo_client(&self, node: NodeId, form: sdo_client::RequestForm) -> SdoClient {
        let blocks = self.settings.blocks;
        let settings = sdo_client::Settings {
            answer_ns: self.settings.answer_ms.saturating_mul(1_000_000),
            pause_ns: blocks.pause_ms.saturating_mul(1_000_000),
            attempts: self.settings.attempts,
            form,
            block_size: blocks.segments,
            crc: blocks.crc,
            switch_threshold: blocks.switch_threshold,
        };
        SdoClient::new(Channel::of(node), settings)
    }

    /// How expedited requests are written.
    pub(super) fn expedited_form(&self, is_sized: bool) -> sdo_client::RequestForm {
        match (self.settings.form, is_sized) {
            (RequestForm::Standard, true) => sdo_client::RequestForm::Sized,
            (RequestForm::Standard, false) => sdo_client::RequestForm::Unsized,
            (RequestForm::Short, _) => sdo_client::RequestForm::Short,
        }
    }

    /// Runs one transfer to its end. Frames that are not its answers go to the inbox. `watch` is
    /// called often; if it breaks, the transfer is given up.
    #[allow(clippy::too_many_arguments, reason = "what a transfer is made of")]
    pub(super) async fn run(
        &mut self,
        sdo: &mut SdoClient,
        object: Address,
        direction: Direction,
        method: Method,
        sink: &mut impl Sink,
        source: &mut impl Source,
        mut watch: impl FnMut(&SdoClient) -> ControlFlow<Abort>,
    ) -> Result<Done, Cause> {
        match direction {
            Direction::Upload => sdo.upload(object, method),
            Direction::Download(bytes) => sdo.download(object, bytes, method),
        }
        .map_err(Cause::NotBegun)?;
        loop {
            // What has come is looked at before anything is sent: an answer that was doubled on
            // the wire must not be taken for the answer to what follows.
            let now = self.now();
            while let Some((at, frame)) = self.link.receive(now).await.map_err(Cause::Link)? {
                if !sdo.receive(&frame, now, sink) {
                    self.keep(at, frame);
                }
            }
            if let ControlFlow::Break(why) = watch(sdo) {
                sdo.cancel(why);
            }
            if let Some(frame) = sdo.transmit(self.now(), source) {
                self.send(frame).await.map_err(Cause::Link)?;
                continue;
            }
            if let Some(outcome) = sdo.outcome() {
                return outcome.map_err(|failure| self.cause(failure));
            }
            let until = sdo.next_deadline().min(self.now().plus_ms(LOOK_MS));
            let received = self.link.receive(until).await.map_err(Cause::Link)?;
            let now = self.now();
            if let Some((at, frame)) = received
                && !sdo.receive(&frame, now, sink)
            {
                self.keep(at, frame);
            }
            sdo.poll(now);
        }
    }

    fn cause(&self, failure: Failure) -> Cause {
        match failure {
            Failure::Aborted(abort) => Cause::Aborted(abort),
            Failure::TimedOut {
                stage: Stage::Initiate,
            } => Cause::TimedOut {
                answer_ms: self.settings.answer_ms,
                attempts: self.settings.attempts.max(1),
            },
            Failure::NotExpedited { bytes } => Cause::NotExpedited { bytes },
            other => Cause::Failed(other),
        }
    }
}
