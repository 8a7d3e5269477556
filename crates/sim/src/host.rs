//! A virtual drive's flash as the host of its core: data sheet and programs.

use canopen::{Abort, Default, Instant};
use drive::program::{Action, Failure, ImageHeader, ProgramStore, Version};
use drive::{Host, ProgramState};
use personalities::Personality;

use crate::data_sheet::data_sheet_text;
use crate::flash_file::FlashFile;
use crate::store::StoreError;

/// Erasing a sector takes so long, ns.
const ERASE_NS: u64 = 8_000_000;
/// The program that a new drive comes with.
const FACTORY_VERSION: &str = "1.0.0";
/// Bytes of the memory to try transfers with.
const SCRATCH_BYTES: usize = 1 << 20;

/// What a drive's program memory does since its last start.
#[derive(Debug)]
pub(crate) struct Programs {
    store: ProgramStore,
    version: String,
    sheet: &'static str,
    /// Memory to try transfers with; it does not outlive a start.
    scratch: Vec<u8>,
    /// When the next sector is erased.
    erase_at: Instant,
    /// The time of the call that the drive is in.
    now: Instant,
}

impl FlashFile {
    /// A drive of this personality starts: its newest valid program runs. One that was never
    /// programmed comes with a program from the factory.
    ///
    /// # Errors
    /// [`StoreError`] if that cannot be written; the drive then has no program memory.
    pub(crate) fn start_programs(
        &mut self,
        personality: &'static Personality,
    ) -> Result<(), StoreError> {
        self.running = None;
        if personality.host.is_none() {
            return Ok(());
        }
        let product = product_code(personality);
        let store = self.programs(product, &factory_image(product))?;
        let version = store
            .running()
            .map_or(String::new(), |program| program.image.version.text().into());
        self.running = Some(Programs {
            store,
            version,
            sheet: data_sheet_text(personality),
            scratch: Vec::new(),
            erase_at: Instant::NEVER,
            now: Instant::ZERO,
        });
        Ok(())
    }

    /// The time of the calls that follow.
    pub(crate) fn at(&mut self, now: Instant) -> &mut FlashFile {
        if let Some(running) = &mut self.running {
            running.now = now;
        }
        self
    }

    /// When [`FlashFile::work`] has something to do.
    pub(crate) fn next_work(&self) -> Instant {
        self.running
            .as_ref()
            .map_or(Instant::NEVER, |running| running.erase_at)
    }

    /// Erases the next sector, if one is due.
    pub(crate) fn work(&mut self, now: Instant) {
        let Some(mut running) = self.running.take() else {
            return;
        };
        if now >= running.erase_at {
            // What goes wrong stands in 0x1F57.
            let more = running.store.erase_sector(self.flash()).unwrap_or(false);
            running.erase_at = if more {
                now.plus_ns(ERASE_NS)
            } else {
                Instant::NEVER
            };
        }
        self.running = Some(running);
    }

    /// A function of the program store together with the flash.
    fn with_programs<T>(
        &mut self,
        act: impl FnOnce(&mut Programs, &mut FlashFile) -> Result<T, Abort>,
    ) -> Result<T, Abort> {
        let Some(mut running) = self.running.take() else {
            return Err(Abort::UNSUPPORTED_ACCESS);
        };
        let result = act(&mut running, self);
        self.running = Some(running);
        result
    }

    /// Why the last download or command on the program memory did not succeed.
    pub fn program_failure(&self) -> Option<Failure> {
        self.running.as_ref()?.store.failure()
    }
}

impl Host for FlashFile {
    fn data_sheet(&self) -> &[u8] {
        self.running
            .as_ref()
            .map_or(&[], |running| running.sheet.as_bytes())
    }

    fn software_version(&self) -> &str {
        self.running
            .as_ref()
            .map_or("", |running| running.version.as_str())
    }

    fn program(&self) -> ProgramState {
        match &self.running {
            Some(Programs { store, .. }) => ProgramState {
                control: store.control_value(),
                identification: store.identification(),
                status: store.status(),
            },
            None => ProgramState::default(),
        }
    }

    fn control_program(&mut self, value: u8) -> Result<Action, Abort> {
        self.with_programs(|running, _| {
            let action = running.store.control(value)?;
            if action == Action::Clear {
                running.erase_at = running.now.plus_ns(ERASE_NS);
            }
            Ok(action)
        })
    }

    fn begin_program(&mut self, bytes: Option<u32>) -> Result<(), Abort> {
        self.with_programs(|running, _| running.store.begin(bytes))
    }

    fn take_program(&mut self, at: u32, bytes: &[u8]) -> Result<(), Abort> {
        self.with_programs(|running, memory| running.store.write(memory.flash(), at, bytes))
    }

    fn finish_program(&mut self) -> Result<(), Abort> {
        self.with_programs(|running, memory| {
            running.store.finish(memory.flash())?;
            memory.sync().map_err(|_| Abort::HARDWARE)
        })
    }

    fn scratch(&self) -> &[u8] {
        self.running
            .as_ref()
            .map_or(&[], |running| &running.scratch)
    }

    fn clear_scratch(&mut self, bytes: Option<u32>) -> Result<(), Abort> {
        if bytes.is_some_and(|bytes| bytes as usize > SCRATCH_BYTES) {
            return Err(Abort::TOO_LONG);
        }
        self.with_programs(|running, _| {
            running.scratch.clear();
            Ok(())
        })
    }

    fn append_scratch(&mut self, bytes: &[u8]) -> Result<(), Abort> {
        self.with_programs(|running, _| {
            if running.scratch.len() + bytes.len() > SCRATCH_BYTES {
                return Err(Abort::OUT_OF_MEMORY);
            }
            running.scratch.extend_from_slice(bytes);
            Ok(())
        })
    }

    fn abort_program(&mut self) {
        if let Some(running) = &mut self.running {
            running.store.abort();
        }
    }
}

/// 0x1018,2, for which a program must be made.
pub fn product_code(personality: &Personality) -> u32 {
    let table = personality.device.table;
    let row = table.find(0x1018, 2).ok();
    let row = row.and_then(|entry| table.row(&entry));
    match row.map(|row| row.default) {
        Some(Default::Value(code)) => u32::try_from(code).unwrap_or(0),
        _ => 0,
    }
}

/// A virtual drive runs no machine code: the body of its programs is only carried and checked.
fn factory_image(product: u32) -> Vec<u8> {
    let body = b"servobus virtual drive\n".repeat(64);
    let version = Version::new(FACTORY_VERSION).expect("a version of a few characters");
    let mut image = ImageHeader::of(product, version, &body).bytes().to_vec();
    image.extend_from_slice(&body);
    image
}
