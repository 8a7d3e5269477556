//! A virtual drive's non-volatile memory: one flash with its parameters and its programs.

use std::fs;
use std::io::{self, ErrorKind};
use std::ops::Range;
use std::path::{Path, PathBuf};

use canopen::store;
use drive::flash::{LoadError, ParameterFlash, Region, SaveError, Slot, SlotState};
use drive::program::{Banks, ProgramStore};

use crate::flash::{ERASED, MemoryFlash, PowerCut};
use crate::host::Programs;
use crate::place::Place;
use crate::store::{StoreError, free_name};

/// Two slots of 16 KiB for parameters.
const SLOTS: [Region; 2] = [Region::new(0, 0x4000), Region::new(0x4000, 0x4000)];
/// Two banks of 128 KiB for programs.
const BANKS: [Region; 2] = [
    Region::new(0x8000, 0x2_0000),
    Region::new(0x2_8000, 0x2_0000),
];
pub(crate) const CAPACITY: usize = 0x4_8000;

/// A drive's non-volatile memory: the image of its flash in a file, or memory that ends with the
/// process.
///
/// The file is made by the first save. If the process ends in the middle of one, that is a power cut:
/// the next start finds the set before.
#[derive(Debug)]
pub struct FlashFile {
    flash: MemoryFlash,
    path: Option<PathBuf>,
    slots: ParameterFlash,
    banks: Banks,
    /// What the drive finds when it starts.
    stored: Vec<u8>,
    fell_back: bool,
    /// The power fails in a save of parameters to come, and in nothing else that is written.
    pub(crate) cut_in_save: Option<PowerCut>,
    /// The programs, since the drive's last start.
    pub(crate) running: Option<Programs>,
}

impl FlashFile {
    /// Memory that holds the stored parameters `bytes` at first; it is erased if there are none.
    pub fn memory(bytes: Vec<u8>) -> FlashFile {
        let mut memory = FlashFile::over(MemoryFlash::new(CAPACITY), None);
        if bytes.is_empty() {
            return memory;
        }
        // What does not fit is kept for the drive's next start all the same.
        let _: Result<(), StoreError> = memory.save(&bytes);
        memory.stored = bytes;
        memory
    }

    /// Memory whose flash has this [`FlashFile::image`] at first.
    pub fn of_image(image: &[u8]) -> FlashFile {
        let mut memory = FlashFile::over(MemoryFlash::of_image(image, CAPACITY), None);
        memory.load();
        memory
    }

    /// The image of its flash, parameters and programs, up to the last byte that is not erased.
    pub fn image(&self) -> &[u8] {
        let bytes = self.flash.bytes();
        let end = bytes.iter().rposition(|byte| *byte != ERASED);
        bytes.get(..end.map_or(0, |last| last + 1)).unwrap_or(bytes)
    }

    /// Its file; `None` if it is memory that ends with the process.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// The flash of the drive at `place` in `folder`, which is made if it is not there: the file
    /// `<drive>-node5.flash`, or `<drive>-u1.flash` of a drive without a node ID. If nothing is stored in it, parameters that an earlier version
    /// left in a file of that name with `.params` are taken over; that file is then called `.params.old`.
    ///
    /// # Errors
    /// [`StoreError`]; a file that is not there is an erased flash.
    pub fn file(folder: &Path, drive: &str, place: Place) -> Result<FlashFile, StoreError> {
        fs::create_dir_all(folder).map_err(|source| StoreError::Folder {
            path: folder.to_owned(),
            source,
        })?;
        let path = folder.join(match place.node() {
            Some(node) => format!("{drive}-node{node}.flash"),
            None => format!("{drive}-{place}.flash"),
        });
        let flash = MemoryFlash::in_file(path.clone(), CAPACITY);
        let flash = flash.map_err(|source| StoreError::Read {
            path: path.clone(),
            source,
        })?;
        let mut memory = FlashFile::over(flash, Some(path.clone()));
        memory.load();
        if memory.stored.is_empty() {
            memory.take_over(&path.with_extension("params"))?;
        }
        Ok(memory)
    }

    fn over(flash: MemoryFlash, path: Option<PathBuf>) -> FlashFile {
        let slots = ParameterFlash::new(SLOTS[0], SLOTS[1], &flash);
        let banks = Banks::new(BANKS[0], BANKS[1], &flash);
        FlashFile {
            slots: slots.expect("slots of whole sectors within the flash"),
            banks: banks.expect("banks of whole sectors within the flash"),
            flash,
            path,
            stored: Vec::new(),
            fell_back: false,
            cut_in_save: None,
            running: None,
        }
    }

    /// Finds what is stored. Where that is damaged and nothing is left, it is what stands at the
    /// head of the damaged slot, which a drive finds to be no parameters.
    pub(crate) fn load(&mut self) {
        let mut bytes = vec![0; self.slots.capacity() as usize];
        match self.slots.load(&mut self.flash, &mut bytes) {
            Ok(loaded) => {
                bytes.truncate(loaded.set.map_or(0, |set| set.bytes as usize));
                self.fell_back = loaded.lost && !bytes.is_empty();
                self.stored = if loaded.lost && bytes.is_empty() {
                    let broken = loaded.set.map(|set| set.slot.other());
                    self.head(broken.unwrap_or(Slot::First))
                } else {
                    bytes
                };
            }
            Err(LoadError::Damaged) => {
                let first = self.slots.look(&mut self.flash, Slot::First);
                let broken = match first {
                    Ok(SlotState::Broken) => Slot::First,
                    _ => Slot::Second,
                };
                self.stored = self.head(broken);
            }
            Err(error @ (LoadError::Full { .. } | LoadError::Flash(_))) => {
                unreachable!("memory with power and a buffer of a slot's size: {error}")
            }
        }
    }

    fn head(&self, slot: Slot) -> Vec<u8> {
        let at = match slot {
            Slot::First => SLOTS[0].at,
            Slot::Second => SLOTS[1].at,
        };
        let known = self.flash.bytes().iter().skip(at as usize).copied();
        known.chain(std::iter::repeat(ERASED)).take(64).collect()
    }

    /// Takes over what an earlier version has stored.
    fn take_over(&mut self, old: &Path) -> Result<(), StoreError> {
        let bytes = match fs::read(old) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            Err(source) => {
                let path = old.to_owned();
                return Err(StoreError::Read { path, source });
            }
        };
        self.replace(bytes)?;
        let aside = free_name(old, ".old");
        fs::rename(old, aside).map_err(|source| StoreError::SetAside {
            path: old.to_owned(),
            source,
        })
    }

    /// The longest set of parameters that can be stored, bytes.
    pub fn capacity(&self) -> usize {
        self.slots.capacity() as usize
    }

    /// The stored parameters: records of [`canopen::store`], none if nothing was stored, and
    /// something that is none if they are damaged.
    pub fn bytes(&self) -> &[u8] {
        &self.stored
    }

    /// Whether the newest set is damaged and [`FlashFile::bytes`] is the one before it. Until a save,
    /// or [`FlashFile::set_aside`].
    pub fn fell_back(&self) -> bool {
        self.fell_back
    }

    /// Replaces what is stored, in the slot that does not hold it.
    ///
    /// # Errors
    /// [`StoreError::Write`]; what was stored before is still there.
    pub fn replace(&mut self, bytes: Vec<u8>) -> Result<(), StoreError> {
        let saved = match self.cut_in_save.take() {
            Some(cut) => {
                self.flash.cut_after(cut);
                let saved = self.save(&bytes);
                // A save that ends before it leaves the rest to the next one.
                self.cut_in_save = self.flash.call_off();
                saved
            }
            None => self.save(&bytes),
        };
        saved?;
        self.stored = bytes;
        self.fell_back = false;
        Ok(())
    }

    fn save(&mut self, bytes: &[u8]) -> Result<(), StoreError> {
        let saved = self.slots.save(&mut self.flash, bytes);
        let written = match saved {
            Ok(_) => self.flash.sync(),
            Err(error) => Err(self.reason(error)),
        };
        written.map_err(|source| self.write_error(source))
    }

    /// What the file's error was, or the flash's.
    fn reason(&mut self, error: SaveError) -> io::Error {
        let file = self.flash.take_file_error();
        file.unwrap_or_else(|| io::Error::other(error))
    }

    fn write_error(&self, source: io::Error) -> StoreError {
        let path = self.path.clone().unwrap_or_default();
        StoreError::Write { path, source }
    }

    /// Sets damaged contents aside: a copy of the file is kept beside as `.corrupt`, or `.corrupt2`
    /// and so on if earlier ones are still there. What is damaged is then erased, the programs are
    /// not. Returns the copy's name.
    ///
    /// # Errors
    /// [`StoreError::SetAside`]; nothing has changed, and a save replaces what is damaged.
    pub fn set_aside(&mut self) -> Result<Option<PathBuf>, StoreError> {
        let mut kept = None;
        if let Some(path) = &self.path {
            let aside = free_name(path, ".corrupt");
            fs::copy(path, &aside).map_err(|source| StoreError::SetAside {
                path: path.clone(),
                source,
            })?;
            kept = Some(aside);
        }
        if self.fell_back {
            self.fell_back = false;
            self.erase(|state| state == SlotState::Broken)?;
        } else {
            self.stored.clear();
            self.erase(|_| true)?;
        }
        Ok(kept)
    }

    fn erase(&mut self, wanted: impl Fn(SlotState) -> bool) -> Result<(), StoreError> {
        let erased = self.slots.erase(&mut self.flash, wanted);
        let written = match erased {
            Ok(()) => self.flash.sync(),
            Err(error) => Err(self.reason(SaveError::Flash(error))),
        };
        written.map_err(|source| self.write_error(source))
    }

    /// The programs, for a drive whose product code is `product`, as its start finds them. If there
    /// is no valid one, `factory`, an image, is installed first.
    ///
    /// # Errors
    /// [`StoreError::Write`] if `factory` cannot be installed.
    pub fn programs(&mut self, product: u32, factory: &[u8]) -> Result<ProgramStore, StoreError> {
        let opened = ProgramStore::open(&mut self.flash, self.banks, product);
        let mut programs = opened.map_err(|error| self.write_error(io::Error::other(error)))?;
        if programs.valid().is_some() {
            return Ok(programs);
        }
        if self.install(&mut programs, factory).is_err() {
            let file = self.flash.take_file_error();
            let failure = programs.failure().map(io::Error::other);
            let source = file.or(failure).unwrap_or(ErrorKind::Other.into());
            return Err(self.write_error(source));
        }
        let opened = ProgramStore::open(&mut self.flash, self.banks, product);
        opened.map_err(|error| self.write_error(io::Error::other(error)))
    }

    /// Where the bytes of the newest whole set of parameters are in the flash, if there is one that is
    /// not empty.
    pub(crate) fn newest_set(&mut self) -> Option<Range<usize>> {
        let loaded = self.slots.find(&mut self.flash).ok()?;
        let set = loaded.set.filter(|set| set.bytes > 0)?;
        let body = self.slots.body(&set);
        Some(body.at as usize..body.at as usize + body.bytes as usize)
    }

    fn install(&mut self, programs: &mut ProgramStore, image: &[u8]) -> Result<(), canopen::Abort> {
        programs.control(3)?;
        while programs.erase_sector(&mut self.flash)? {}
        programs.begin(None)?;
        programs.write(&mut self.flash, 0, image)?;
        programs.finish(&mut self.flash)
    }

    /// The flash, to be passed into [`ProgramStore`]'s functions.
    pub fn flash(&mut self) -> &mut MemoryFlash {
        &mut self.flash
    }

    /// Waits until all is on the disk; after a program was finished.
    ///
    /// # Errors
    /// [`StoreError::Write`].
    pub fn sync(&mut self) -> Result<(), StoreError> {
        let synced = self.flash.sync();
        synced.map_err(|source| self.write_error(source))
    }

    /// Whether the stored bytes are parameters at all.
    pub fn is_damaged(&self) -> bool {
        store::records(&self.stored).is_err()
    }
}
