//! A NOR flash in memory, or in a file, whose power can fail.

use std::fs::File;
use std::io::{self, ErrorKind, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::PathBuf;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use rand_core::{RngCore as _, SeedableRng as _};
use rand_pcg::Pcg32;

/// What erased flash reads as.
pub(crate) const ERASED: u8 = 0xFF;

/// A NOR flash with pages of `PAGE` bytes (what one write is aligned to) and sectors of `SECTOR`
/// bytes (what one erase takes).
///
/// A write clears bits and can set none; an erase sets every bit of a sector. Like flash with error
/// correction, a page that was written is not written again before it is erased. Every byte that is
/// written and every sector that is erased is one step; the power can be made to fail in any of
/// them ([`MemoryFlash::cut_after`]).
///
/// In a file the flash is its image, byte for byte. The file is made by the first write and ends
/// behind the last byte that was ever written; what is not in it is erased. The same holds for the
/// memory that a flash takes.
#[derive(Debug)]
pub struct MemoryFlash<const PAGE: usize = 4, const SECTOR: usize = 4096> {
    /// What is behind them is erased.
    bytes: Vec<u8>,
    capacity: usize,
    file: Option<ImageFile>,
    steps: Steps,
    cut: Option<PowerCut>,
    powered: bool,
}

/// The file of a flash.
#[derive(Debug)]
struct ImageFile {
    path: PathBuf,
    /// Opened by the first write.
    open: Option<File>,
    /// Why the last write failed.
    error: Option<io::Error>,
}

impl ImageFile {
    /// Writes `bytes` at `at`.
    fn put(&mut self, at: usize, bytes: &[u8]) -> io::Result<()> {
        let file = match &mut self.open {
            Some(file) => file,
            none => none.insert(
                File::options()
                    .write(true)
                    .create(true)
                    .truncate(false)
                    .open(&self.path)?,
            ),
        };
        file.seek(SeekFrom::Start(at as u64))?;
        file.write_all(bytes)
    }
}

/// What was done to a flash.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    /// Bytes written.
    pub written: u64,
    /// Sectors erased.
    pub erased: u64,
}

impl Steps {
    /// All of them.
    pub fn total(self) -> u64 {
        self.written + self.erased
    }
}

/// When the power fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PowerCut {
    /// Steps that are still done whole. The next one is done in part: of a byte some bits are
    /// cleared, of a sector each byte is what it was, erased, or anything.
    pub after: u64,
    /// What "some" and "anything" are.
    pub seed: u64,
}

/// Why a flash refuses.
#[derive(Debug)]
pub enum Refusal {
    /// The address is not aligned.
    NotAligned,
    /// It runs past the end.
    OutOfBounds,
    /// A page is written that is not erased.
    NotErased,
    /// The power has failed, in this call or before.
    PowerCut,
    /// The file cannot be written; [`MemoryFlash::take_file_error`] has the error.
    File(ErrorKind),
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Refusal::NotAligned => f.write_str("not aligned"),
            Refusal::OutOfBounds => f.write_str("past the end of the flash"),
            Refusal::NotErased => f.write_str("a page that is not erased cannot be written"),
            Refusal::PowerCut => f.write_str("the power has failed"),
            Refusal::File(kind) => write!(f, "the flash's file: {kind}"),
        }
    }
}

impl std::error::Error for Refusal {}

impl NorFlashError for Refusal {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Refusal::NotAligned => NorFlashErrorKind::NotAligned,
            Refusal::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            Refusal::NotErased | Refusal::PowerCut | Refusal::File(_) => NorFlashErrorKind::Other,
        }
    }
}

impl<const PAGE: usize, const SECTOR: usize> MemoryFlash<PAGE, SECTOR> {
    /// An erased flash of `capacity` bytes, whole sectors, that ends with the process.
    pub fn new(capacity: usize) -> MemoryFlash<PAGE, SECTOR> {
        const { assert!(SECTOR.is_multiple_of(PAGE)) };
        MemoryFlash {
            bytes: Vec::new(),
            capacity: capacity.next_multiple_of(SECTOR),
            file: None,
            steps: Steps::default(),
            cut: None,
            powered: true,
        }
    }

    /// The same that holds `image` at first; what is longer than it is left out.
    pub fn of_image(image: &[u8], capacity: usize) -> MemoryFlash<PAGE, SECTOR> {
        let mut flash = MemoryFlash::new(capacity);
        flash.bytes = image.iter().take(flash.capacity).copied().collect();
        flash
    }

    /// The flash whose image is the file at `path`, erased if there is none. What the file has beyond
    /// `capacity` bytes is neither read nor touched.
    ///
    /// # Errors
    /// Those of reading it.
    pub fn in_file(path: PathBuf, capacity: usize) -> io::Result<MemoryFlash<PAGE, SECTOR>> {
        let mut flash = MemoryFlash::new(capacity);
        match File::open(&path) {
            Ok(file) => {
                let capacity = flash.capacity as u64;
                file.take(capacity).read_to_end(&mut flash.bytes)?;
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
        flash.file = Some(ImageFile {
            path,
            open: None,
            error: None,
        });
        Ok(flash)
    }

    /// Its contents; what is behind them is erased.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Its whole contents, to damage them. A file does not see it.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        self.bytes.resize(self.capacity, ERASED);
        &mut self.bytes
    }

    /// What was done to it since it was made.
    pub fn steps(&self) -> Steps {
        self.steps
    }

    /// Lets the power fail. From the cut on everything is refused, until [`MemoryFlash::power_on`].
    pub fn cut_after(&mut self, cut: PowerCut) {
        self.cut = Some(cut);
    }

    /// Calls off a cut that has not come yet, and returns what is left of it.
    pub fn call_off(&mut self) -> Option<PowerCut> {
        self.cut.take().filter(|_| self.powered)
    }

    /// The power is back; a cut that has not come yet is called off.
    pub fn power_on(&mut self) {
        self.powered = true;
        self.cut = None;
    }

    /// Whether the power has failed.
    pub fn has_lost_power(&self) -> bool {
        !self.powered
    }

    /// The same contents in memory, with power.
    pub fn copy(&self) -> MemoryFlash<PAGE, SECTOR> {
        let mut copy = MemoryFlash::new(self.capacity);
        copy.bytes.clone_from(&self.bytes);
        copy
    }

    /// Waits until a file is on its disk.
    ///
    /// # Errors
    /// Those of the file.
    pub fn sync(&mut self) -> io::Result<()> {
        let open = self.file.as_ref().and_then(|file| file.open.as_ref());
        open.map_or(Ok(()), File::sync_data)
    }

    /// Why the file could not be written, once.
    pub fn take_file_error(&mut self) -> Option<io::Error> {
        self.file.as_mut().and_then(|file| file.error.take())
    }

    /// The place of `length` bytes from `at`, both multiples of `step`.
    fn place(&self, at: u32, length: usize, step: usize) -> Result<usize, Refusal> {
        let at = at as usize;
        if !at.is_multiple_of(step) || !length.is_multiple_of(step) {
            return Err(Refusal::NotAligned);
        }
        match at.checked_add(length) {
            Some(end) if end <= self.capacity => Ok(at),
            _ => Err(Refusal::OutOfBounds),
        }
    }

    /// Goes one step on: `None` if it is done whole, or what "in part" is.
    fn step(&mut self) -> Option<Pcg32> {
        let cut = self.cut.as_mut()?;
        if let Some(left) = cut.after.checked_sub(1) {
            cut.after = left;
            return None;
        }
        self.powered = false;
        Some(Pcg32::seed_from_u64(cut.seed))
    }

    /// Puts `new` at `at`, into the file first: what it does not take has not happened.
    fn put(&mut self, at: usize, new: &[u8]) -> Result<(), Refusal> {
        let known = self.bytes.len();
        let mut longer = Vec::new();
        if at > known {
            // A gap behind the file's end would read as zeros.
            longer.resize(at - known, ERASED);
            longer.extend(new);
        }
        let (from, new) = match longer.as_slice() {
            [] => (at, new),
            longer => (known, longer),
        };
        if let Some(file) = &mut self.file
            && let Err(error) = file.put(from, new)
        {
            let refusal = Refusal::File(error.kind());
            file.error = Some(error);
            return Err(refusal);
        }
        let end = from + new.len();
        if end > known {
            self.bytes.resize(end, ERASED);
        }
        self.bytes[from..end].copy_from_slice(new);
        Ok(())
    }

    /// What `range` holds.
    fn get(&self, at: usize, length: usize) -> Vec<u8> {
        let known = self.bytes.iter().skip(at).copied();
        known
            .chain(std::iter::repeat(ERASED))
            .take(length)
            .collect()
    }
}

impl<const PAGE: usize, const SECTOR: usize> ErrorType for MemoryFlash<PAGE, SECTOR> {
    type Error = Refusal;
}

impl<const PAGE: usize, const SECTOR: usize> ReadNorFlash for MemoryFlash<PAGE, SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refusal> {
        if !self.powered {
            return Err(Refusal::PowerCut);
        }
        let at = self.place(offset, bytes.len(), 1)?;
        bytes.fill(ERASED);
        let known = self.bytes.get(at..).unwrap_or(&[]);
        for (byte, known) in bytes.iter_mut().zip(known) {
            *byte = *known;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.capacity
    }
}

impl<const PAGE: usize, const SECTOR: usize> NorFlash for MemoryFlash<PAGE, SECTOR> {
    const WRITE_SIZE: usize = PAGE;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Refusal> {
        if !self.powered {
            return Err(Refusal::PowerCut);
        }
        let length = to.checked_sub(from).ok_or(Refusal::OutOfBounds)? as usize;
        let at = self.place(from, length, SECTOR)?;
        for start in (at..at + length).step_by(SECTOR) {
            match self.step() {
                None if start >= self.bytes.len() => {}
                None => self.put(start, &[ERASED; SECTOR])?,
                Some(mut random) => {
                    let mut sector = self.get(start, SECTOR);
                    half_erase(&mut sector, &mut random);
                    self.put(start, &sector)?;
                    return Err(Refusal::PowerCut);
                }
            }
            self.steps.erased += 1;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        if !self.powered {
            return Err(Refusal::PowerCut);
        }
        let at = self.place(offset, bytes.len(), PAGE)?;
        let is = self.bytes.get(at..).unwrap_or(&[]);
        if is.iter().take(bytes.len()).any(|byte| *byte != ERASED) {
            return Err(Refusal::NotErased);
        }
        let mut new = vec![ERASED; bytes.len()];
        for (place, byte) in new.iter_mut().zip(bytes) {
            *place = match self.step() {
                None => *byte,
                Some(mut random) => byte | random.next_u32() as u8,
            };
            if !self.powered {
                break;
            }
            self.steps.written += 1;
        }
        self.put(at, &new)?;
        match self.powered {
            true => Ok(()),
            false => Err(Refusal::PowerCut),
        }
    }
}

/// What an erase leaves that was cut short: of four kinds one, from hardly begun to hardly ended.
fn half_erase(sector: &mut [u8], random: &mut Pcg32) {
    let kind = random.next_u32() % 4;
    for byte in sector {
        let noise = random.next_u32() as u8;
        *byte = match kind {
            // Before it begins, some flash clears every bit.
            0 => *byte & noise,
            1 => *byte | noise,
            2 => noise,
            // Only some cells are not there yet.
            _ if noise < 8 => 0x7F,
            _ => ERASED,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Flash = MemoryFlash<4, 64>;

    #[test]
    fn it_clears_bits_and_erases_sectors() {
        let mut flash = Flash::new(128);
        flash.write(4, &[0x0F, 0xF0, 0x00, 0xFF]).unwrap();
        assert_eq!(flash.bytes()[3..], [0xFF, 0x0F, 0xF0, 0x00, 0xFF]);
        flash.write(64, &[0; 64]).unwrap();
        flash.erase(64, 128).unwrap();
        assert_eq!(flash.bytes()[4], 0x0F);
        assert_eq!(flash.bytes()[64..], [0xFF; 64]);
        assert_eq!(flash.bytes_mut().len(), 128);
        let steps = flash.steps();
        assert_eq!((steps.written, steps.erased, steps.total()), (68, 1, 69));
    }

    #[test]
    fn it_refuses_what_a_flash_refuses() {
        let mut flash = Flash::new(128);
        flash.write(0, &[0; 4]).unwrap();
        let kind = |result: Result<(), Refusal>| result.unwrap_err().kind();
        assert_eq!(kind(flash.write(2, &[0; 4])), NorFlashErrorKind::NotAligned);
        assert_eq!(kind(flash.write(4, &[0; 3])), NorFlashErrorKind::NotAligned);
        assert_eq!(kind(flash.erase(0, 32)), NorFlashErrorKind::NotAligned);
        assert_eq!(kind(flash.erase(64, 192)), NorFlashErrorKind::OutOfBounds);
        assert_eq!(kind(flash.erase(64, 0)), NorFlashErrorKind::OutOfBounds);
        assert_eq!(
            kind(flash.write(126, &[0; 4])),
            NorFlashErrorKind::NotAligned
        );
        assert_eq!(
            kind(flash.read(125, &mut [0; 4])),
            NorFlashErrorKind::OutOfBounds
        );
        assert!(matches!(flash.write(0, &[0; 4]), Err(Refusal::NotErased)));
        assert_eq!(flash.steps().total(), 4);
    }

    #[test]
    fn the_power_fails_in_the_step_it_is_told_to() {
        let mut flash = Flash::new(64);
        flash.cut_after(PowerCut { after: 2, seed: 1 });
        assert!(matches!(flash.write(0, &[0; 8]), Err(Refusal::PowerCut)));
        assert_eq!(flash.bytes()[..2], [0; 2]);
        assert_eq!(flash.bytes_mut()[3..], [0xFF; 61]);
        assert!(matches!(flash.read(0, &mut [0]), Err(Refusal::PowerCut)));
        assert!(matches!(flash.erase(0, 64), Err(Refusal::PowerCut)));
        flash.power_on();
        flash.cut_after(PowerCut { after: 0, seed: 2 });
        assert!(matches!(flash.erase(0, 64), Err(Refusal::PowerCut)));
        assert!(flash.bytes().iter().any(|byte| *byte != 0xFF));
        flash.power_on();
        flash.erase(0, 64).unwrap();
        assert_eq!(flash.bytes(), [0xFF; 64]);
    }

    /// Over all seeds a half-written byte takes each value that it can take.
    #[test]
    fn a_half_written_byte_has_any_of_its_bits() {
        let mut seen = std::collections::BTreeSet::new();
        for seed in 0..200 {
            let mut flash = Flash::new(64);
            flash.cut_after(PowerCut { after: 0, seed });
            flash.write(0, &[0b1111_1010, 0, 0, 0]).unwrap_err();
            seen.insert(flash.bytes()[0]);
        }
        assert_eq!(
            Vec::from_iter(seen),
            [0b1111_1010, 0b1111_1011, 0b1111_1110, 0b1111_1111]
        );
    }

    #[test]
    fn a_file_is_the_image() {
        let path = std::env::temp_dir().join(format!("servobus-flash-{}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        let open = || Flash::in_file(path.clone(), 256).unwrap();
        let mut flash = open();
        assert!(!path.exists(), "nothing was written");
        flash.erase(0, 256).unwrap();
        assert!(!path.exists(), "it is erased");
        flash.write(64, b"abcd").unwrap();
        let expected = [&[0xFF; 64][..], b"abcd"].concat();
        assert_eq!(std::fs::read(&path).unwrap(), expected);
        let mut flash = open();
        assert_eq!(flash.bytes(), expected);
        flash.write(128, b"efgh").unwrap();
        flash.erase(64, 128).unwrap();
        flash.cut_after(PowerCut { after: 2, seed: 0 });
        flash.write(192, b"ijkl").unwrap_err();
        flash.sync().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), flash.bytes());
        assert_eq!(open().bytes(), flash.bytes());
        assert_eq!(flash.bytes()[..64], [0xFF; 64]);
        assert_eq!(&flash.bytes()[128..132], b"efgh");
        assert_eq!(&flash.bytes()[192..194], b"ij");
        // Longer than the flash.
        assert_eq!(
            Flash::in_file(path.clone(), 64).unwrap().bytes(),
            [0xFF; 64]
        );
        std::fs::remove_file(path).unwrap();
    }

    /// What the file does not take has not happened.
    #[test]
    fn a_file_that_cannot_be_written() {
        let mut flash = Flash::in_file("/dev/null/flash".into(), 256);
        assert_eq!(flash.as_ref().unwrap_err().kind(), ErrorKind::NotADirectory);
        flash = Flash::in_file("/no/such/folder/flash".into(), 256);
        let mut flash = flash.unwrap();
        assert!(matches!(
            flash.write(0, b"abcd"),
            Err(Refusal::File(ErrorKind::NotFound))
        ));
        assert_eq!(flash.bytes(), [0u8; 0]);
        assert_eq!(
            flash.take_file_error().map(|error| error.kind()),
            Some(ErrorKind::NotFound)
        );
        assert!(flash.take_file_error().is_none());
    }
}
