//! Program download (CiA 302-3: 0x1F50, 0x1F51, 0x1F56, 0x1F57) into two banks of a flash.
//!
//! One bank holds the program that runs, the other takes the next one. A program counts only when
//! its bank's record is there, which is written last, after the image has been read back and
//! checked. So whatever happens before, the next start runs the old program; after it, the new one.
//!
//! The boot loader's part is [`Banks::newest`]; the drive's is [`ProgramStore`].

mod bank;
mod control;
mod download;
mod failure;
mod image;
mod store;

pub use bank::{Bank, Banks, Program};
pub use control::{Action, Command};
pub use failure::Failure;
pub use image::{IMAGE_HEADER, ImageHeader, Version, VersionError, check_image};
pub use store::ProgramStore;
