//! How a transcript is played.

use canopen::NodeId;

use crate::decode::{Decoder, DriveWords};

/// How to play a transcript.
#[derive(Clone, Debug)]
pub struct Options {
    /// What the drives' documents say, for names and types in messages: of each drive that is of
    /// another kind than `drive`.
    pub drives: Vec<(NodeId, DriveWords)>,
    /// And of all others.
    pub drive: DriveWords,
    /// How long frames are dropped before the first line, in nanoseconds, unless the transcript
    /// says (`settle`).
    pub settle_ns: u64,
    /// How long an expected frame may take, in nanoseconds, until the transcript says otherwise
    /// (`limit`, `within`).
    pub limit_ns: u64,
}

impl Default for Options {
    /// Drives of which nothing is known, 100 ms each.
    fn default() -> Options {
        Options {
            drives: Vec::new(),
            drive: DriveWords::default(),
            settle_ns: 100_000_000,
            limit_ns: 100_000_000,
        }
    }
}

impl Options {
    pub(super) fn decoder(&self) -> Decoder {
        let mut decoder = Decoder::with_words(self.drive);
        for (node, words) in &self.drives {
            decoder.set_drive(*node, *words);
        }
        decoder
    }
}
