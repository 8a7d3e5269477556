//! A client of one bus.

use std::collections::VecDeque;

use can::Frame;
use canopen::Instant;

use crate::sdo::Method;
use crate::{Link, LinkError};

/// How SDO requests are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RequestForm {
    /// Eight bytes, size indicated (CiA 301 7.2.4.3): every server takes these.
    #[default]
    Standard,
    /// As long as their contents, size not indicated: as the P3's manual prints them (P1).
    Short,
}

/// How long and how often a client asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// How long to wait for an SDO answer, in milliseconds.
    pub answer_ms: u64,
    /// How often to ask in all, at least once. A repeated write may be obeyed twice, so 1 unless
    /// the objects allow more.
    pub attempts: u32,
    /// How requests are written.
    pub form: RequestForm,
    /// Which protocol transfers of any length use.
    pub method: Method,
    /// How block transfers are done.
    pub blocks: BlockSettings,
}

impl Default for Settings {
    /// 500 ms, one attempt, standard form, the protocol by the size.
    fn default() -> Settings {
        Settings {
            answer_ms: 500,
            attempts: 1,
            form: RequestForm::Standard,
            method: Method::Auto,
            blocks: BlockSettings::default(),
        }
    }
}

/// How block transfers are done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSettings {
    /// Segments per block that uploads ask for, 1 to 127; others count as the nearest.
    pub segments: u8,
    /// Whether to offer a checksum.
    pub crc: bool,
    /// Objects of up to this many bytes may come by another protocol, if the server likes (CiA 301
    /// 7.2.4.3.12); 0 forbids it.
    pub switch_threshold: u8,
    /// After such a pause, in milliseconds, a block that has begun counts as ended.
    pub pause_ms: u64,
}

impl Default for BlockSettings {
    /// 127 segments, with checksum, a threshold of 21 bytes, 100 ms.
    fn default() -> BlockSettings {
        BlockSettings {
            segments: 127,
            crc: true,
            switch_threshold: 21,
            pause_ms: 100,
        }
    }
}

/// A client (a CANopen master, as far as it is needed here) on a link.
///
/// A frame that is not the answer to the question of the moment is kept for [`Client::receive`], so
/// that no emergency is lost because an SDO was waited for.
#[derive(Debug)]
pub struct Client<L> {
    pub(crate) link: L,
    inbox: VecDeque<(Instant, Frame)>,
    lost: u64,
    /// Bit n: node n has said that it knows no block transfers.
    pub(crate) without_blocks: u128,
    /// Time-out, attempts and form of requests; may be changed between calls.
    pub settings: Settings,
}

/// Frames that the inbox keeps; older ones fall out and are counted.
const INBOX: usize = 4096;

impl<L: Link> Client<L> {
    /// A client with the default [`Settings`].
    pub fn new(link: L) -> Client<L> {
        Client {
            link,
            inbox: VecDeque::new(),
            lost: 0,
            without_blocks: 0,
            settings: Settings::default(),
        }
    }

    /// The link.
    pub fn link(&mut self) -> &mut L {
        &mut self.link
    }

    /// Gives the link back; what is in the inbox is dropped.
    pub fn into_link(self) -> L {
        self.link
    }

    /// The present time of the link.
    pub fn now(&self) -> Instant {
        self.link.now()
    }

    /// Sends any frame.
    ///
    /// # Errors
    /// The link broke.
    pub async fn send(&mut self, frame: Frame) -> Result<(), LinkError> {
        self.link.send(frame).await
    }

    /// The next frame that no other function consumed, in the order of reception; `None` when none
    /// came until `until`.
    ///
    /// # Errors
    /// The link broke.
    pub async fn receive(&mut self, until: Instant) -> Result<Option<(Instant, Frame)>, LinkError> {
        match self.inbox.pop_front() {
            Some(kept) => Ok(Some(kept)),
            None => self.link.receive(until).await,
        }
    }

    /// When the frame that the link gave last was on the bus; see [`Link::stamp_ns`].
    pub(crate) fn stamp_ns(&self) -> Option<u64> {
        self.link.stamp_ns()
    }

    /// Frames that were dropped because nobody fetched them.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    pub(crate) fn keep(&mut self, at: Instant, frame: Frame) {
        if self.inbox.len() == INBOX {
            self.inbox.pop_front();
            self.lost += 1;
        }
        self.inbox.push_back((at, frame));
    }

    /// Waits until `until` for a frame that `accept` takes and that is not in the inbox yet; keeps
    /// the others. `None` when none came.
    pub(crate) async fn wait_for<T>(
        &mut self,
        until: Instant,
        mut accept: impl FnMut(Instant, &Frame) -> Option<T>,
    ) -> Result<Option<T>, LinkError> {
        while let Some((at, frame)) = self.link.receive(until).await? {
            if let Some(accepted) = accept(at, &frame) {
                return Ok(Some(accepted));
            }
            self.keep(at, frame);
        }
        Ok(None)
    }

    /// Puts everything that has been received already into the inbox, so that it cannot be taken
    /// for the answer to what is sent next.
    pub(crate) async fn set_aside(&mut self) -> Result<(), LinkError> {
        let now = self.link.now();
        while let Some((at, frame)) = self.link.receive(now).await? {
            self.keep(at, frame);
        }
        Ok(())
    }
}
