//! What can happen to a drive's memory on purpose: stored bytes that change, and a power cut in the
//! middle of a save.

use canopen::Instant;
use rand_core::{RngCore as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use crate::drive::VirtualDrive;
use crate::flash::PowerCut;
use crate::flash_file::FlashFile;
use crate::notice::NoticeKind;
use crate::store::StoreError;

impl FlashFile {
    /// Flips one bit in each of `count` bytes of the newest set of stored parameters; which follow
    /// from `seed`. The drive finds out when it starts. False if nothing is stored.
    fn spoil(&mut self, count: u32, seed: u64) -> bool {
        let Some(set) = self.newest_set() else {
            return false;
        };
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut left: Vec<usize> = set.collect();
        let bytes = self.flash().bytes_mut();
        for _ in 0..count {
            if left.is_empty() {
                break;
            }
            let chosen = (random.next_u64() % left.len() as u64) as usize;
            let place = left.swap_remove(chosen);
            if let Some(byte) = bytes.get_mut(place) {
                *byte ^= 1 << (random.next_u64() % 8);
            }
        }
        self.load();
        true
    }
}

impl VirtualDrive {
    /// Flips one bit in each of `count` bytes of the newest set of stored parameters, or of both sets
    /// that the flash holds; which follow from `seed`. The drive finds out when it starts. How many
    /// sets there were to spoil.
    pub fn spoil_store(&mut self, count: u32, both: bool, seed: u64) -> u8 {
        let mut sets = u8::from(self.store.spoil(count, seed));
        if both && sets == 1 && self.store.fell_back() {
            sets += u8::from(self.store.spoil(count, seed ^ 1));
        }
        sets
    }

    /// Lets the logic supply fail for a moment when the next save of parameters, by 0x1010, 0x1011 or
    /// LSS, has written so many bytes and erased so many sectors, together `after`. A save that has
    /// fewer leaves the rest to the one after it. What is half written then follows from `seed`.
    pub fn cut_power_in_save(&mut self, after: u64, seed: u64) {
        self.store.cut_in_save = Some(PowerCut { after, seed });
    }

    /// Replaces what is stored. `None` if the logic supply has failed meanwhile: the drive boots.
    pub(crate) fn replace_stored(
        &mut self,
        bytes: Vec<u8>,
        now: Instant,
        notice: &mut impl FnMut(NoticeKind),
    ) -> Option<Result<(), StoreError>> {
        let replaced = self.store.replace(bytes);
        if !self.store.flash().has_lost_power() {
            return Some(replaced);
        }
        notice(NoticeKind::PowerCutInSave);
        self.store.flash().power_on();
        self.store.load();
        self.lose_supply();
        self.boots_at = now.plus_ns(self.latency.boot_ns());
        None
    }
}
