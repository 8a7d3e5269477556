//! Frames in words: what an NMT command, an SDO transfer, a PDO or an emergency says, down to the
//! bits of controlword and statusword.
//!
//! A [`Decoder`] watches a bus from the side. It learns PDO parameters and modes of operation from
//! the SDO transfers that pass, and so can name the objects in a PDO.

mod emergency;
mod frame;
mod meaning;
mod modes;
mod object;
mod pdo;
mod sdo;
mod standard;
mod words;

pub use emergency::emergency_text;
pub use frame::Decoder;
pub use meaning::{Decoded, Direction, Meaning, ObjectValue, PdoContents};
pub use standard::standard_type;
pub use words::DriveWords;
