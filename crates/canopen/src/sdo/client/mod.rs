//! The client's side of SDO (CiA 301 7.2.4) as a state machine without I/O: expedited, segmented
//! and block transfers, both ways, of objects of any length.
//!
//! The caller owns the clock, the wire and the data. It begins a transfer, takes frames from
//! [`SdoClient::transmit`] until there are none, hands received frames to [`SdoClient::receive`] and
//! calls [`SdoClient::poll`] when [`SdoClient::next_deadline`] has come, until
//! [`SdoClient::outcome`] tells the end. Bytes go to a [`Sink`] and come from a [`Source`] that are
//! passed into each call, a few at a time, so no buffer has the size of an object.
//!
//! What is done when no answer comes:
//!
//! | waiting for the answer to | then |
//! |---|---|
//! | the first request | it is repeated: a server begins anew with it |
//! | a segment | never repeated, because of the toggle bit; the transfer is begun anew |
//! | the start of a block upload | repeated |
//! | a segment of a block upload | what came in order is confirmed, the rest comes again |
//! | the confirmation of an uploaded block | repeated if the size is known, so that bytes missing show; else begun anew |
//! | a downloaded block | its last segment is repeated, unless it is the only one; then begun anew |
//! | the end of a block transfer | the frame before it is repeated |
//!
//! Each request is repeated, and a transfer begun, [`Settings::attempts`] times in all; then the
//! transfer fails with [`Failure::TimedOut`] and the server gets an abort. A server that had
//! received a request of a block transfer already may be surprised by its repetition and abort; the
//! transfer is begun anew then, too.

mod block_download;
mod block_upload;
mod channel;
mod data;
mod failure;
mod initiate;
mod moved;
mod segmented;
mod settings;
mod transfer;

use can::Frame;

use self::transfer::{Answer, Direction, Lapse, Phase, Reaction, Request, Transfer};
use crate::{Abort, Address, Instant};

pub use self::channel::Channel;
pub use self::data::{NoData, Sink, Source};
pub use self::failure::{Done, Failure, Progress, Stage, StartError};
pub use self::settings::{Method, RequestForm, Settings};

/// A client of one SDO server, one transfer at a time.
#[derive(Clone, Debug)]
pub struct SdoClient {
    channel: Channel,
    settings: Settings,
    transfer: Option<Transfer>,
    /// Of the present transfer, or the last.
    progress: Progress,
    outcome: Option<Result<Done, Failure>>,
    /// What the server is still to be told, though the transfer is over: that it was aborted, or
    /// that its end was understood.
    parting: Option<[u8; 8]>,
    deadline: Instant,
}

impl SdoClient {
    /// A client without transfer. [`Settings::block_size`] is brought into its range.
    pub fn new(channel: Channel, settings: Settings) -> SdoClient {
        SdoClient {
            channel,
            settings: Settings {
                block_size: settings.block_size.clamp(1, 127),
                attempts: settings.attempts.max(1),
                ..settings
            },
            transfer: None,
            progress: Progress::default(),
            outcome: None,
            parting: None,
            deadline: Instant::NEVER,
        }
    }

    /// Begins to read an object.
    ///
    /// # Errors
    /// [`StartError::Busy`].
    pub fn upload(&mut self, object: Address, method: Method) -> Result<(), StartError> {
        self.begin(object, Direction::Upload, method)
    }

    /// Begins to write an object of `bytes` bytes. One without bytes can be written in segments or
    /// blocks.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn download(
        &mut self,
        object: Address,
        bytes: u32,
        method: Method,
    ) -> Result<(), StartError> {
        if method == Method::Expedited && !(1..=4).contains(&bytes) {
            return Err(StartError::NotExpedited { bytes });
        }
        self.begin(object, Direction::Download { bytes }, method)
    }

    fn begin(
        &mut self,
        object: Address,
        direction: Direction,
        method: Method,
    ) -> Result<(), StartError> {
        if self.transfer.is_some() {
            return Err(StartError::Busy);
        }
        self.transfer = Some(Transfer {
            object,
            direction,
            method,
            phase: Phase::Initiate,
            begun: 1,
            tried: 0,
            is_ready: true,
            is_known: false,
            last: None,
        });
        self.progress = direction.begin();
        self.outcome = None;
        self.deadline = Instant::NEVER;
        Ok(())
    }

    /// Gives up the transfer, if there is one; the server is told why.
    pub fn cancel(&mut self, why: Abort) {
        if self.transfer.is_some() {
            self.fail(Failure::Cancelled(why));
        }
    }

    /// How the last transfer ended; `None` while one runs, and before the first.
    pub fn outcome(&self) -> Option<Result<Done, Failure>> {
        self.outcome
    }

    /// How far the transfer is, or was when it ended.
    pub fn progress(&self) -> Progress {
        self.progress
    }

    /// The part of the transfer that is under way; `None` if there is no transfer.
    pub fn stage(&self) -> Option<Stage> {
        self.transfer.as_ref().map(Transfer::stage)
    }

    /// When [`SdoClient::poll`] has something to do, unless an answer comes before.
    pub fn next_deadline(&self) -> Instant {
        self.deadline
    }

    /// Takes a frame of the bus and hands the bytes of an upload to `sink`. False if it is not an
    /// answer to the present transfer, and somebody else's.
    pub fn receive(&mut self, frame: &Frame, now: Instant, sink: &mut impl Sink) -> bool {
        if !self.channel.is_answer(frame) || frame.len() == 0 {
            return false;
        }
        let Some(transfer) = &mut self.transfer else {
            return false;
        };
        let answer = Answer {
            frame,
            is_repeated: transfer.last == Some(*frame),
        };
        if let Some(abort) = transfer.aborted(&answer) {
            match transfer.is_provoked(abort) && transfer.begun < self.settings.attempts {
                true => self.begin_anew(),
                false => self.fail(Failure::Aborted(abort)),
            }
            return true;
        }
        let progress = &mut self.progress;
        let reaction = if transfer.is_ready {
            match answer.is_repeated {
                true => Reaction::Duplicate,
                false => Reaction::Stale,
            }
        } else {
            transfer.receive(&answer, &self.settings, progress, sink)
        };
        if matches!(reaction, Reaction::Stale) {
            return false;
        }
        transfer.last = Some(*frame);
        match reaction {
            Reaction::Stale | Reaction::Duplicate => {}
            Reaction::Next => {
                (transfer.is_ready, transfer.tried) = (true, 0);
                self.deadline = Instant::NEVER;
            }
            Reaction::More => {
                transfer.tried = 0;
                self.deadline = now.plus_ns(self.settings.pause_ns);
            }
            Reaction::Enter(phase) => {
                (transfer.phase, transfer.is_ready, transfer.tried) = (phase, true, 0);
                self.deadline = Instant::NEVER;
            }
            Reaction::Restart => self.restart(),
            Reaction::Done { parting, is_sized } => {
                self.parting = parting;
                let bytes = self.progress.done;
                self.end(Ok(Done { bytes, is_sized }));
            }
            Reaction::Failed(failure) => self.fail(failure),
        }
        true
    }

    /// Looks whether an answer is overdue. Spurious calls change nothing.
    pub fn poll(&mut self, now: Instant) {
        let Some(transfer) = &mut self.transfer else {
            return;
        };
        if transfer.is_ready || self.deadline > now {
            return;
        }
        if let Some(failure) = transfer.doubt(&self.progress) {
            return self.fail(failure);
        }
        match transfer.lapse(&self.progress) {
            Lapse::GoOn => (transfer.is_ready, transfer.tried) = (true, 0),
            Lapse::Repeat if transfer.tried < self.settings.attempts => transfer.is_ready = true,
            Lapse::Repeat | Lapse::Restart => return self.restart(),
        }
        self.deadline = Instant::NEVER;
    }

    /// The next frame to send, with the bytes of a download from `source`; `None` if there is none
    /// now. The time to wait for an answer begins with this call.
    pub fn transmit(&mut self, now: Instant, source: &mut impl Source) -> Option<Frame> {
        if let Some(parting) = self.parting.take() {
            return Some(self.channel.request(parting, 8));
        }
        let transfer = self
            .transfer
            .as_mut()
            .filter(|transfer| transfer.is_ready)?;
        match transfer.request(&self.settings, &self.progress, source) {
            Ok(Request { data, len }) => {
                transfer.is_known = true;
                transfer.is_ready = transfer.goes_on();
                if !transfer.is_ready {
                    transfer.tried = transfer.tried.saturating_add(1);
                    self.deadline = now.plus_ns(self.settings.answer_ns);
                }
                Some(self.channel.request(data, len))
            }
            Err(failure) => {
                self.fail(failure);
                let parting = self.parting.take()?;
                Some(self.channel.request(parting, 8))
            }
        }
    }

    /// Begins anew if another attempt is allowed; fails if not.
    fn restart(&mut self) {
        let Some(transfer) = &mut self.transfer else {
            return;
        };
        let stage = transfer.stage();
        // The first request was repeated already as often as it may be.
        if stage == Stage::Initiate || transfer.begun >= self.settings.attempts {
            return self.fail(Failure::TimedOut { stage });
        }
        self.parting = Some(transfer.abort(Abort::TIMED_OUT));
        self.begin_anew();
    }

    fn begin_anew(&mut self) {
        let Some(transfer) = &mut self.transfer else {
            return;
        };
        *transfer = Transfer {
            phase: Phase::Initiate,
            begun: transfer.begun.saturating_add(1),
            tried: 0,
            is_ready: true,
            last: None,
            ..*transfer
        };
        self.progress = transfer.direction.begin();
        self.deadline = Instant::NEVER;
    }

    fn fail(&mut self, failure: Failure) {
        if let Some(transfer) = &self.transfer
            && transfer.has_to_be_told(failure)
        {
            self.parting = Some(transfer.abort(failure.abort()));
        }
        self.end(Err(failure));
    }

    fn end(&mut self, outcome: Result<Done, Failure>) {
        self.outcome = Some(outcome);
        self.transfer = None;
        self.deadline = Instant::NEVER;
    }
}
