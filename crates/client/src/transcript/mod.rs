//! Transcripts: bus dialogues as text, in the notation of the drives' manuals, and a runner that
//! plays them against a bus and says where the drive departs from them.
//!
//! `docs/transcripts.md` defines the notation. A file is read with [`Transcript::read`] and played
//! with [`play`] over anything that is a [`crate::Link`] and [`Physics`]; a real bus becomes that
//! by [`WithoutPhysics`].

mod expression;
mod options;
mod parse;
mod parse_frame;
mod parse_quantity;
mod pattern;
mod physics;
mod play;
mod report;
mod source;
mod step;

pub use options::Options;
pub use parse::TranscriptError;
pub use physics::{Physics, Reading, WithoutPhysics};
pub use play::play;
pub use report::{Expected, Failure, FailureKind, Misprint, NotChecked, Received, Report};
pub use source::SyntaxError;
pub use step::{Header, Transcript};
