//! A transfer that runs: its phases, and what a frame or silence means to it.

use can::Frame;

use super::block_download::BlockDownload;
use super::block_upload::BlockUpload;
use super::segmented::{SegmentedDownload, SegmentedUpload};
use super::{Failure, Method, Progress, Settings, Sink, Source, Stage};
use crate::{Abort, Address};

/// A transfer that runs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transfer {
    pub(super) object: Address,
    pub(super) direction: Direction,
    pub(super) method: Method,
    pub(super) phase: Phase,
    /// How often the transfer was begun.
    pub(super) begun: u32,
    /// How often the last request was sent.
    pub(super) tried: u32,
    /// Something waits to be sent. No answer is expected then.
    pub(super) is_ready: bool,
    /// Whether anything was sent, so that the server may wait for more.
    pub(super) is_known: bool,
    /// The server's last frame.
    pub(super) last: Option<Frame>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    Upload,
    Download { bytes: u32 },
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Phase {
    Initiate,
    SegmentedUpload(SegmentedUpload),
    SegmentedDownload(SegmentedDownload),
    BlockUpload(BlockUpload),
    BlockDownload(BlockDownload),
}

/// A frame of the server.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer<'a> {
    pub(super) frame: &'a Frame,
    /// The same as the one before it, bit for bit.
    pub(super) is_repeated: bool,
}

/// What an answer means to the transfer.
#[derive(Clone, Copy, Debug)]
pub(super) enum Reaction {
    /// It belongs to another transfer.
    Stale,
    /// It was here before, and changes nothing.
    Duplicate,
    /// There is something to send.
    Next,
    /// The server will send more by itself.
    More,
    Enter(Phase),
    /// The transfer has to begin anew.
    Restart,
    Done {
        parting: Option<[u8; 8]>,
        is_sized: bool,
    },
    Failed(Failure),
}

/// What to do when no answer came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lapse {
    /// Send what waits; it is no repetition.
    GoOn,
    /// Send the last request again, if that is allowed once more.
    Repeat,
    /// Begin anew, if that is allowed once more.
    Restart,
}

/// The data of a request, and how many bytes of them are sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Request {
    pub(super) data: [u8; 8],
    pub(super) len: u8,
}

impl Reaction {
    pub(super) const DONE: Reaction = Reaction::Done {
        parting: None,
        is_sized: true,
    };
}

impl Request {
    pub(super) fn whole(data: [u8; 8]) -> Request {
        Request { data, len: 8 }
    }
}

impl Answer<'_> {
    pub(super) fn command(&self) -> u8 {
        let [command, ..] = self.frame.bytes();
        command
    }

    /// Of an answer that the present request cannot have: a late one to a first request, or
    /// nothing that there is.
    pub(super) fn out_of_place(&self) -> Reaction {
        let command = self.command();
        match (command >> 5, command & 3) {
            _ if self.is_repeated => Reaction::Duplicate,
            (2 | 3, _) | (5, 0) | (6, 0 | 2) => Reaction::Stale,
            _ => Reaction::Failed(Failure::Command { command }),
        }
    }
}

impl Direction {
    pub(super) fn begin(self) -> Progress {
        let total = match self {
            Direction::Upload => None,
            Direction::Download { bytes } => Some(bytes),
        };
        Progress { done: 0, total }
    }
}

impl Transfer {
    pub(super) fn stage(&self) -> Stage {
        match &self.phase {
            Phase::Initiate => Stage::Initiate,
            Phase::SegmentedUpload(_) | Phase::SegmentedDownload(_) => Stage::Segment,
            Phase::BlockUpload(block) => block.stage(),
            Phase::BlockDownload(block) => block.stage(),
        }
    }

    /// The code, if the server aborts this transfer (CiA 301 7.2.4.3.17). Some servers name no
    /// object once a transfer runs. During a block upload, first bytes above 0x80 are segments.
    pub(super) fn aborted(&self, answer: &Answer<'_>) -> Option<Abort> {
        let command = answer.command();
        let is_abort = match &self.phase {
            Phase::BlockUpload(_) => command == 0x80,
            _ => command >> 5 == 4,
        };
        if !is_abort {
            return None;
        }
        let [_, i0, i1, sub, data @ ..] = answer.frame.bytes();
        let names_nothing = [i0, i1, sub] == [0; 3] && self.stage() != Stage::Initiate;
        let is_own = self.is_known && (self.is_for_object(answer) || names_nothing);
        is_own.then_some(Abort(u32::from_le_bytes(data)))
    }

    /// Whether the server may have aborted because a request was repeated that it had received.
    pub(super) fn is_provoked(&self, abort: Abort) -> bool {
        let is_surprise = matches!(abort, Abort::COMMAND | Abort::SEQUENCE_NUMBER);
        is_surprise && self.tried > 1 && self.stage() != Stage::Initiate
    }

    pub(super) fn receive(
        &mut self,
        answer: &Answer<'_>,
        settings: &Settings,
        progress: &mut Progress,
        sink: &mut impl Sink,
    ) -> Reaction {
        match &mut self.phase {
            Phase::Initiate => self.initiated(answer, settings, progress, sink),
            Phase::SegmentedUpload(segments) => segments.receive(answer, progress, sink),
            Phase::SegmentedDownload(segments) => segments.receive(answer, progress),
            Phase::BlockUpload(block) => block.receive(answer, progress, sink),
            Phase::BlockDownload(block) => block.receive(answer, progress),
        }
    }

    pub(super) fn request(
        &mut self,
        settings: &Settings,
        progress: &Progress,
        source: &mut impl Source,
    ) -> Result<Request, Failure> {
        let data = match &mut self.phase {
            Phase::Initiate => return self.initiate(settings, source),
            Phase::SegmentedUpload(segments) => segments.request(),
            Phase::SegmentedDownload(segments) => segments.request(progress, source)?,
            Phase::BlockUpload(block) => block.request(),
            Phase::BlockDownload(block) => block.request(progress, source)?,
        };
        Ok(Request::whole(data))
    }

    /// Whether there is more to send before the server answers.
    pub(super) fn goes_on(&self) -> bool {
        match &self.phase {
            Phase::BlockDownload(block) => !block.waits(),
            _ => false,
        }
    }

    /// What the silence means, if it is more than silence.
    pub(super) fn doubt(&self, progress: &Progress) -> Option<Failure> {
        match &self.phase {
            Phase::SegmentedUpload(segments) => segments.failure(progress),
            Phase::SegmentedDownload(segments) => segments.failure(progress),
            _ => None,
        }
    }

    pub(super) fn lapse(&mut self, progress: &Progress) -> Lapse {
        match &mut self.phase {
            Phase::Initiate => Lapse::Repeat,
            Phase::SegmentedUpload(_) | Phase::SegmentedDownload(_) => Lapse::Restart,
            Phase::BlockUpload(block) => block.lapse(progress),
            Phase::BlockDownload(block) => block.lapse(),
        }
    }

    /// Whether the server may be waiting for more of a transfer that failed: not if it aborted
    /// itself, and not if all there was to an expedited transfer is a request without answer.
    pub(super) fn has_to_be_told(&self, failure: Failure) -> bool {
        let was_one_exchange = self.method == Method::Expedited && self.stage() == Stage::Initiate;
        match failure {
            Failure::Aborted(_) => false,
            Failure::TimedOut { .. } => !was_one_exchange,
            _ => self.is_known,
        }
    }

    pub(super) fn abort(&self, why: Abort) -> [u8; 8] {
        self.addressed(0x80, why.0.to_le_bytes())
    }
}

/// A frame without address.
pub(super) const fn command_and(command: u8, data: [u8; 7]) -> [u8; 8] {
    let mut frame = [command; 8];
    if let Some(bytes) = frame.last_chunk_mut() {
        *bytes = data;
    }
    frame
}
