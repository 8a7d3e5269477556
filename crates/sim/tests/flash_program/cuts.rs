//! The power fails.

use drive::program::Banks;
use sim::{MemoryFlash, PowerCut};

use crate::bench::{SMALL_BANK, image, prepared, started, update};

/// The steps that an update takes.
fn steps<const PAGE: usize, const SECTOR: usize>(
    flash: &MemoryFlash<PAGE, SECTOR>,
    banks: &Banks,
    image: &[u8],
) -> u64 {
    let mut flash = flash.copy();
    update(&mut flash, banks, image, 889).unwrap();
    flash.steps().total()
}

/// Updates with the power failing, and powers on again.
fn update_cut<const PAGE: usize, const SECTOR: usize>(
    flash: &mut MemoryFlash<PAGE, SECTOR>,
    banks: &Banks,
    image: &[u8],
    piece: usize,
    cut: PowerCut,
) {
    flash.cut_after(cut);
    update(flash, banks, image, piece).unwrap_err();
    assert!(flash.has_lost_power());
    flash.power_on();
}

#[derive(Debug, Default)]
struct Count {
    cuts: u64,
    old: u64,
    new: u64,
}

impl Count {
    fn add(&mut self, found: &Option<Vec<u8>>, old: &Option<Vec<u8>>, new: &[u8], what: &str) {
        self.cuts += 1;
        if found.as_deref() == Some(new) {
            self.new += 1;
        } else if found == old {
            self.old += 1;
        } else {
            panic!("{what}: neither the old nor the new program");
        }
    }
}

/// The power fails in each step of an update; then in each step of the update that follows; then
/// one goes through.
#[test]
fn a_cut_in_every_step_and_another_in_every_step_of_the_recovery() {
    let (mut single, mut double) = (Count::default(), Count::default());
    for installed in 0..4 {
        let (flash, banks, old) = prepared::<4, 256>(SMALL_BANK, installed, 100);
        let (new, newer) = (image(10, 131), image(20, 90));
        for seed in 0..4 {
            for after in 0..steps(&flash, &banks, &new) {
                let mut cut = flash.copy();
                let piece = 1 + (after as usize * 13 + seed as usize) % 200;
                update_cut(&mut cut, &banks, &new, piece, PowerCut { after, seed });
                let what = format!("{installed} installed, cut after {after}, seed {seed}");
                let found = started(&mut cut, &banks);
                single.add(&found, &old, &new, &what);
                for again in 0..steps(&cut, &banks, &newer) {
                    let mut twice = cut.copy();
                    let seed = seed + again * 7;
                    update_cut(
                        &mut twice,
                        &banks,
                        &newer,
                        64,
                        PowerCut { after: again, seed },
                    );
                    let what = format!("{what}, again after {again}");
                    let left = started(&mut twice, &banks);
                    double.add(&left, &found, &newer, &what);
                    update(&mut twice, &banks, &new, 100).unwrap();
                    assert_eq!(started(&mut twice, &banks).as_ref(), Some(&new));
                }
            }
        }
    }
    println!("once: {single:?}; twice: {double:?}");
    // A new one only if the half-written last byte happened to get all its bits.
    assert!(single.cuts > 3000 && single.old > 0);
    assert!(double.cuts > 600_000 && double.old > 0 && double.new > 0);
}

/// Real sizes: every erase, the last thousand steps, and between them every 499th.
#[test]
fn cuts_on_banks_of_128_kib() {
    let (mut flash, banks, old) = prepared::<8, 4096>(128 * 1024, 2, 90_000);
    let new = image(10, 100_000);
    let total = steps(&flash, &banks, &new);
    let mut count = Count::default();
    let between = (40..total - 1000).step_by(499);
    for after in (0..40).chain(between).chain(total - 1000..total) {
        let mut cut = flash.copy();
        update_cut(&mut cut, &banks, &new, 889, PowerCut { after, seed: after });
        let found = started(&mut cut, &banks);
        count.add(&found, &old, &new, &format!("cut after {after} of {total}"));
    }
    println!("{total} steps: {count:?}");
    update(&mut flash, &banks, &new, 889).unwrap();
    assert_eq!(started(&mut flash, &banks), Some(new));
}
