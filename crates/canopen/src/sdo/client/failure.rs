//! How transfers end.

use crate::Abort;

/// A transfer that succeeded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Done {
    /// Bytes that were transferred.
    pub bytes: u32,
    /// False for an expedited upload whose answer does not say how many of its bytes count
    /// (0x42, P2): trailing ones may be padding.
    pub is_sized: bool,
}

/// How far a transfer is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Bytes that the sink has taken, or that the server has acknowledged.
    pub done: u32,
    /// Bytes in all; of an upload, if the server has said.
    pub total: Option<u32>,
}

/// The part of a transfer that is under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The first request has not been answered yet.
    Initiate,
    /// A segment (CiA 301 7.2.4.3.4, 7.2.4.3.7) has to be confirmed.
    Segment,
    /// A block (CiA 301 7.2.4.3.10, 7.2.4.3.14) is on its way, or its confirmation.
    Block,
    /// The end of a block transfer has to be confirmed.
    End,
}

/// Why a transfer did not begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartError {
    /// The one before it is still running.
    Busy,
    /// An expedited download carries 1 to 4 bytes.
    NotExpedited {
        /// Bytes that were to be sent.
        bytes: u32,
    },
}

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The server aborted.
    Aborted(Abort),
    /// [`super::SdoClient::cancel`] was called.
    Cancelled(Abort),
    /// The sink or the source refused.
    Refused(Abort),
    /// No answer came, as often as the settings allow.
    TimedOut {
        /// Which part waited.
        stage: Stage,
    },
    /// A segment's toggle bit did not alternate.
    Toggle {
        /// Bytes that had been transferred.
        offset: u32,
    },
    /// The server sent more or fewer bytes than it had indicated.
    Size {
        /// Bytes that were indicated; `u32::MAX` if more came than an object can have.
        indicated: u32,
        /// Bytes that came.
        received: u32,
    },
    /// The checksum of a block upload is wrong.
    Crc {
        /// Of the bytes that came.
        computed: u16,
        /// What the server says.
        received: u16,
    },
    /// A sequence number that cannot be, or again and again not the one that is needed.
    Sequence {
        /// The number that was needed; of an acknowledge, the highest possible.
        expected: u8,
        /// The number that came.
        received: u8,
    },
    /// The server wants blocks of a size that there is not.
    BlockSize {
        /// Segments per block, outside 1 to 127.
        segments: u8,
    },
    /// The answer's command specifier is unknown or not possible here.
    Command {
        /// The first byte.
        command: u8,
    },
    /// An expedited upload was asked for, and the server began a segmented one.
    NotExpedited {
        /// Bytes that the object has, if the server said.
        bytes: Option<u32>,
    },
}

impl Failure {
    /// The abort code that the server was told, or that it told.
    pub const fn abort(self) -> Abort {
        match self {
            Failure::Aborted(abort) | Failure::Cancelled(abort) | Failure::Refused(abort) => abort,
            Failure::TimedOut { .. } => Abort::TIMED_OUT,
            Failure::Toggle { .. } => Abort::TOGGLE,
            Failure::Size {
                indicated,
                received,
            } if received < indicated => Abort::TOO_SHORT,
            Failure::Size { .. } => Abort::TOO_LONG,
            Failure::Crc { .. } => Abort::CRC,
            Failure::Sequence { .. } => Abort::SEQUENCE_NUMBER,
            Failure::BlockSize { .. } => Abort::BLOCK_SIZE,
            Failure::Command { .. } => Abort::COMMAND,
            Failure::NotExpedited { .. } => Abort::OUT_OF_MEMORY,
        }
    }
}

impl core::fmt::Display for StartError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            StartError::Busy => f.write_str("another transfer is running"),
            StartError::NotExpedited { bytes } => {
                write!(f, "an expedited transfer carries 1 to 4 bytes, not {bytes}")
            }
        }
    }
}

impl core::error::Error for StartError {}

impl core::fmt::Display for Stage {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Stage::Initiate => "the first request",
            Stage::Segment => "a segment",
            Stage::Block => "a block",
            Stage::End => "the end of a block transfer",
        })
    }
}

impl core::fmt::Display for Failure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Failure::Aborted(abort) => write!(f, "refused, {abort}"),
            Failure::Cancelled(abort) => write!(f, "given up, {abort}"),
            Failure::Refused(abort) => write!(f, "the data were not taken or given, {abort}"),
            Failure::TimedOut { stage } => write!(f, "no answer to {stage}"),
            Failure::Toggle { offset } => write!(
                f,
                "the toggle bit of the segment after {offset} bytes is wrong"
            ),
            Failure::Size {
                indicated: u32::MAX,
                ..
            } => f.write_str("more bytes came than an object can have"),
            Failure::Size {
                indicated,
                received,
            } => write!(f, "{received} bytes came where {indicated} were indicated"),
            Failure::Crc { computed, received } => write!(
                f,
                "the checksum is 0x{computed:04X}, and the node says 0x{received:04X}"
            ),
            Failure::Sequence { expected, received } => write!(
                f,
                "sequence number {received} came where {expected} was due"
            ),
            Failure::BlockSize { segments } => {
                write!(
                    f,
                    "the node wants blocks of {segments} segments; 1 to 127 are possible"
                )
            }
            Failure::Command { command } => {
                write!(
                    f,
                    "the node's answer 0x{command:02X} is unknown or out of place"
                )
            }
            Failure::NotExpedited { bytes: Some(bytes) } => write!(
                f,
                "the object has {bytes} bytes, which needs a segmented transfer"
            ),
            Failure::NotExpedited { bytes: None } => {
                f.write_str("the object has more than 4 bytes, which needs a segmented transfer")
            }
        }
    }
}

impl core::error::Error for Failure {}
