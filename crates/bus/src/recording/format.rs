//! The formats, and how a file's name tells its own.

use std::path::{Path, PathBuf};

/// A format of recordings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// candump's log.
    Candump,
    /// pcapng with SocketCAN's link type.
    Pcapng,
    /// MCAP with JSON messages.
    Mcap,
}

/// A file name that tells no format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{}: the ending tells the format of a recording: .log (candump), .pcapng (Wireshark) or .mcap \
     (Foxglove)",
    path.display()
)]
pub struct UnknownEnding {
    /// The file.
    pub path: PathBuf,
}

impl Format {
    /// The format that the name's ending tells, in small letters or large ones.
    ///
    /// # Errors
    /// Another ending, or none.
    pub fn of(path: &Path) -> Result<Format, UnknownEnding> {
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        match ending.to_str() {
            Some("log") => Ok(Format::Candump),
            Some("pcapng") => Ok(Format::Pcapng),
            Some("mcap") => Ok(Format::Mcap),
            _ => Err(UnknownEnding {
                path: path.to_owned(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings() {
        let table = [
            ("run.log", Some(Format::Candump)),
            ("a.b/run.LOG", Some(Format::Candump)),
            ("run.pcapng", Some(Format::Pcapng)),
            ("run.log.mcap", Some(Format::Mcap)),
            ("run.pcap", None),
            ("run", None),
            ("run.", None),
            (".log", None),
            ("run.log/x", None),
        ];
        for (path, format) in table {
            assert_eq!(Format::of(Path::new(path)).ok(), format, "{path}");
        }
        let message = Format::of(Path::new("run.txt")).unwrap_err().to_string();
        for ending in ["run.txt: ", ".log", ".pcapng", ".mcap"] {
            assert!(message.contains(ending), "{message}");
        }
    }
}
