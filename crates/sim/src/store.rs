//! What may go wrong with the file of a virtual drive's memory.

use std::io;
use std::path::{Path, PathBuf};

/// The store's file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// It is there and cannot be read.
    #[error("{}: cannot read the stored parameters: {source}; correct its permissions or name another --store folder", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The folder cannot be made.
    #[error("{}: cannot make this folder for stored parameters: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Damaged contents cannot be renamed.
    #[error(
        "{}: the damaged parameters cannot be set aside as .corrupt: {source}; move the file away \
         before something is saved",
        path.display()
    )]
    SetAside {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// It cannot be written.
    #[error("{}: cannot write the stored parameters: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// The first of `path` with `ending`, `ending2` and so on that is not there.
pub(crate) fn free_name(path: &Path, ending: &str) -> PathBuf {
    let mut number = 1u32;
    loop {
        let mut name = path.to_owned().into_os_string();
        name.push(ending);
        if number > 1 {
            name.push(number.to_string());
        }
        let name = PathBuf::from(name);
        if !name.exists() {
            return name;
        }
        number += 1;
    }
}
