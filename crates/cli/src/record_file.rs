//! The file of a recording, as an argument.

use std::path::PathBuf;

use bus::recording::Format;

/// Parses a file name whose ending tells a format.
///
/// # Errors
/// A message that names the endings.
pub(crate) fn parse(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match Format::of(&path) {
        Ok(_) => Ok(path),
        Err(unknown) => Err(unknown.to_string()),
    }
}
