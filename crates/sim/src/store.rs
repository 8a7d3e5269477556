//! Where a virtual drive keeps its stored parameters.

use std::fs;
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

/// A drive's non-volatile memory: a file, or memory that ends with the process.
#[derive(Debug)]
pub struct ParameterStore {
    bytes: Vec<u8>,
    file: Option<PathBuf>,
}

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

impl ParameterStore {
    /// Memory that holds `bytes` at first.
    pub fn memory(bytes: Vec<u8>) -> ParameterStore {
        ParameterStore { bytes, file: None }
    }

    /// The file of drive `node` in `folder`, which is made if it is not there.
    ///
    /// # Errors
    /// [`StoreError`]; a file that is not there is an empty store.
    pub fn file(folder: &Path, drive: &str, node: u8) -> Result<ParameterStore, StoreError> {
        fs::create_dir_all(folder).map_err(|source| StoreError::Folder {
            path: folder.to_owned(),
            source,
        })?;
        let path = folder.join(format!("{drive}-node{node}.params"));
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => Vec::new(),
            Err(source) => return Err(StoreError::Read { path, source }),
        };
        Ok(ParameterStore {
            bytes,
            file: Some(path),
        })
    }

    /// What is stored.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Replaces what is stored. The file is written beside the old one and then takes its name, so
    /// at any moment there is a whole one.
    ///
    /// # Errors
    /// [`StoreError::Write`]; what was stored before is still there.
    pub fn replace(&mut self, bytes: Vec<u8>) -> Result<(), StoreError> {
        if let Some(path) = &self.file {
            let beside = path.with_extension("params.new");
            let write = || {
                let mut file = fs::File::create(&beside)?;
                file.write_all(&bytes)?;
                file.sync_all()?;
                fs::rename(&beside, path)
            };
            write().map_err(|source| StoreError::Write {
                path: path.clone(),
                source,
            })?;
        }
        self.bytes = bytes;
        Ok(())
    }

    /// Sets damaged contents aside: the file is kept beside as `.corrupt`, or `.corrupt2` and so on
    /// if earlier ones are still there. Returns its new name.
    ///
    /// # Errors
    /// [`StoreError::SetAside`]; the file is still where it was, and a save replaces it.
    pub fn set_aside(&mut self) -> Result<Option<PathBuf>, StoreError> {
        let mut kept = None;
        if let Some(path) = &self.file {
            let aside = free_name(path, ".corrupt");
            fs::rename(path, &aside).map_err(|source| StoreError::SetAside {
                path: path.clone(),
                source,
            })?;
            kept = Some(aside);
        }
        self.bytes.clear();
        Ok(kept)
    }
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
