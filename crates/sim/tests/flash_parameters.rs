//! Parameters in two slots: whatever happens to the flash, a load finds the set before or the new
//! one, whole, or says that there is none.

use drive::flash::{Checksum, LayoutError, LoadError, ParameterFlash, Region, SaveError, Slot};
use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind, ReadNorFlash as _};
use proptest::prelude::*;
use sim::{MemoryFlash, PowerCut, Steps};

/// Two sectors a slot, so that an erase can end between them.
type Small = MemoryFlash<4, 256>;
const SMALL_SLOT: u32 = 512;

fn slots<F: NorFlash>(flash: &F, bytes: u32) -> ParameterFlash {
    let first = Region::new(0, bytes);
    ParameterFlash::new(first, Region::new(bytes, bytes), flash).unwrap()
}

/// The newest set; `None` if nothing was stored.
fn load<F: NorFlash>(flash: &mut F, slots: &ParameterFlash) -> Result<Option<Vec<u8>>, LoadError> {
    let mut bytes = vec![0; slots.capacity() as usize];
    let loaded = slots.load(flash, &mut bytes)?;
    Ok(loaded.set.map(|set| {
        bytes.truncate(set.bytes as usize);
        bytes
    }))
}

/// Like [`load`] after a power cut, by which no set that was stored is ever lost.
fn load_after_cut<F: NorFlash>(flash: &mut F, slots: &ParameterFlash) -> Option<Vec<u8>> {
    assert!(!slots.find(flash).unwrap().lost);
    load(flash, slots).unwrap()
}

/// A set that differs from every other number's in most bytes.
fn set(number: u32, length: usize) -> Vec<u8> {
    let byte = |at: usize| (at as u32).wrapping_mul(31).wrapping_add(number * 97) as u8;
    (0..length).map(byte).collect()
}

/// What is stored before anything was: nothing, or the empty set that makes the flash ready.
fn is_nothing(set: &Option<Vec<u8>>) -> bool {
    set.as_ref().is_none_or(Vec::is_empty)
}

/// How often which set was found.
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
        } else if found == old || is_nothing(old) && is_nothing(found) {
            self.old += 1;
        } else {
            panic!("{what}: neither the old nor the new set: {found:?}");
        }
    }
}

/// The steps that a save of `set` takes.
fn steps<const PAGE: usize, const SECTOR: usize>(
    flash: &MemoryFlash<PAGE, SECTOR>,
    slots: &ParameterFlash,
    set: &[u8],
) -> u64 {
    let mut flash = flash.copy();
    let before = flash.steps().total();
    slots.save(&mut flash, set).unwrap();
    flash.steps().total() - before
}

/// Saves `set` with the power failing after `after` steps, and powers on again.
fn save_cut<const PAGE: usize, const SECTOR: usize>(
    flash: &mut MemoryFlash<PAGE, SECTOR>,
    slots: &ParameterFlash,
    set: &[u8],
    cut: PowerCut,
) {
    flash.cut_after(cut);
    let error = slots.save(flash, set).unwrap_err();
    assert!(matches!(error, SaveError::Flash(at) if at.kind == NorFlashErrorKind::Other));
    assert!(flash.has_lost_power());
    flash.power_on();
}

/// A flash on which `saved` sets were stored.
fn prepared<const PAGE: usize, const SECTOR: usize>(
    slot_bytes: u32,
    saved: u32,
    length: usize,
) -> (MemoryFlash<PAGE, SECTOR>, ParameterFlash, Option<Vec<u8>>) {
    let mut flash = MemoryFlash::new(2 * slot_bytes as usize);
    let slots = slots(&flash, slot_bytes);
    let mut old = None;
    for number in 0..saved {
        let bytes = set(number, length);
        slots.save(&mut flash, &bytes).unwrap();
        old = Some(bytes);
    }
    (flash, slots, old)
}

/// The power fails in each step of a save; then it fails in each step of the save that follows;
/// then a save goes through.
#[test]
fn a_cut_in_every_step_and_another_in_every_step_of_the_recovery() {
    const LENGTH: usize = 90;
    let (mut single, mut double) = (Count::default(), Count::default());
    for saved in 0..4 {
        let (flash, slots, old) = prepared::<4, 256>(SMALL_SLOT, saved, LENGTH);
        let new = set(10, LENGTH + 7);
        let newer = set(20, LENGTH - 9);
        for seed in 0..12 {
            for after in 0..steps(&flash, &slots, &new) {
                let mut cut = flash.copy();
                save_cut(&mut cut, &slots, &new, PowerCut { after, seed });
                let what = format!("{saved} sets, cut after {after}, seed {seed}");
                let found = load_after_cut(&mut cut, &slots);
                single.add(&found, &old, &new, &what);
                for again in 0..steps(&cut, &slots, &newer) {
                    let mut twice = cut.copy();
                    let seed = seed.wrapping_add(again * 7);
                    save_cut(&mut twice, &slots, &newer, PowerCut { after: again, seed });
                    let what = format!("{what}, again after {again}");
                    let left = load_after_cut(&mut twice, &slots);
                    double.add(&left, &found, &newer, &what);
                    slots.save(&mut twice, &new).unwrap();
                    assert_eq!(load_after_cut(&mut twice, &slots), Some(new.clone()));
                }
            }
        }
    }
    println!("once: {single:?}; twice: {double:?}");
    assert!(single.cuts > 5000 && single.old > 0 && single.new > 0);
    assert!(double.cuts > 500_000 && double.old > 0 && double.new > 0);
}

/// Real sizes, and every page size that is served.
#[test]
fn a_cut_in_every_step_on_every_kind_of_flash() {
    fn all<const PAGE: usize>() -> Count {
        let mut count = Count::default();
        for saved in [0, 1, 2] {
            let (mut flash, slots, old) = prepared::<PAGE, 4096>(16 * 1024, saved, 1400);
            let new = set(10, 1501);
            for after in 0..steps(&flash, &slots, &new) {
                let mut cut = flash.copy();
                save_cut(&mut cut, &slots, &new, PowerCut { after, seed: after });
                let found = load_after_cut(&mut cut, &slots);
                count.add(
                    &found,
                    &old,
                    &new,
                    &format!("page {PAGE}, cut after {after}"),
                );
            }
            slots.save(&mut flash, &new).unwrap();
            assert_eq!(load(&mut flash, &slots).unwrap(), Some(new));
        }
        count
    }
    for (page, count) in [
        (1, all::<1>()),
        (4, all::<4>()),
        (8, all::<8>()),
        (32, all::<32>()),
        (64, all::<64>()),
    ] {
        println!("pages of {page}: {count:?}");
        assert!(count.cuts > 4500 && count.old > 0 && count.new > 0);
    }
}

/// Every bit of both slots, one at a time: the newest set, or the one before it.
#[test]
fn one_damaged_bit_costs_at_most_the_newest_set() {
    let (flash, slots, _) = prepared::<4, 256>(SMALL_SLOT, 5, 90);
    let (newest, before) = (Some(set(4, 90)), Some(set(3, 90)));
    let mut fell_back = 0;
    for at in 0..flash.capacity() {
        for bit in 0..8 {
            let mut damaged = flash.copy();
            damaged.bytes_mut()[at] ^= 1 << bit;
            let found = load(&mut damaged, &slots).unwrap();
            let lost = slots.find(&mut damaged).unwrap().lost;
            assert_eq!(lost, found != newest, "byte {at}, bit {bit}");
            if lost {
                assert_eq!(found, before, "byte {at}, bit {bit}");
                fell_back += 1;
            }
        }
    }
    // The header's 16 bytes and the set's 90.
    assert_eq!(fell_back, 8 * 106);
}

/// A bit in each slot: what is whole is found; if nothing is, that is said, and a save cures it.
#[test]
fn damage_to_both_slots_is_reported() {
    let (flash, slots, _) = prepared::<4, 256>(SMALL_SLOT, 2, 20);
    let (first, second) = (set(1, 20), set(0, 20));
    let slot = SMALL_SLOT as usize;
    let (mut reported, mut found_one) = (0, 0);
    for one in 0..160 {
        for other in 0..160 {
            let mut damaged = flash.copy();
            damaged.bytes_mut()[one] ^= 0x10;
            damaged.bytes_mut()[slot + other] ^= 0x04;
            match load(&mut damaged, &slots) {
                Ok(Some(found)) => {
                    assert!(found == first || found == second);
                    found_one += 1;
                }
                Ok(None) => panic!("bytes {one} and {other}: taken for a new flash"),
                Err(error) => {
                    assert_eq!(error, LoadError::Damaged);
                    reported += 1;
                    let written = slots.save(&mut damaged, b"cured").unwrap();
                    assert_eq!(written.slot, Slot::First);
                    assert_eq!(load(&mut damaged, &slots).unwrap(), Some(b"cured".to_vec()));
                }
            }
        }
    }
    // Both headers (16) and both sets (20) have to be hit.
    assert_eq!((reported, found_one), (36 * 36, 160 * 160 - 36 * 36));
}

/// The only set that was ever stored is damaged: what was before it is nothing, and that is told.
#[test]
fn damage_to_the_first_set_falls_back_to_the_empty_one() {
    let (mut flash, slots, _) = prepared::<4, 256>(SMALL_SLOT, 1, 20);
    flash.bytes_mut()[SMALL_SLOT as usize + 130] ^= 1;
    let loaded = slots.find(&mut flash).unwrap();
    assert_eq!(
        loaded.set.map(|set| (set.slot, set.bytes)),
        Some((Slot::First, 0))
    );
    assert_eq!(loaded.other, drive::flash::SlotState::Broken);
    assert!(loaded.lost);
    // Until the next set is stored.
    slots.save(&mut flash, b"next").unwrap();
    assert!(!slots.find(&mut flash).unwrap().lost);
}

/// Writes a slot as its format says.
fn craft(slot: &mut [u8], sequence: u32, set: &[u8]) {
    let mut header = b"SBS1".to_vec();
    header.extend(sequence.to_le_bytes());
    header.extend((set.len() as u32).to_le_bytes());
    let sum = Checksum::of(&header).and(set).value();
    header.extend(sum.to_le_bytes());
    slot[..header.len()].copy_from_slice(&header);
    slot[128..128 + set.len()].copy_from_slice(set);
}

#[test]
fn the_sequence_number_wraps() {
    let last = u32::MAX;
    for (first, second, newest) in [
        (last, 0, 1),
        (0, last, 0),
        (last - 1, last, 1),
        (5, 4, 0),
        (1 << 31, (1 << 31) - 1, 0),
        (7, 7, 0),
    ] {
        let mut flash = Small::new(1024);
        let slots = slots(&flash, SMALL_SLOT);
        let sets = [b"first".to_vec(), b"second".to_vec()];
        craft(&mut flash.bytes_mut()[..512], first, &sets[0]);
        craft(&mut flash.bytes_mut()[512..], second, &sets[1]);
        assert_eq!(
            load(&mut flash, &slots).unwrap(),
            Some(sets[newest].clone())
        );
        for number in 0..5 {
            slots.save(&mut flash, &set(number, 9)).unwrap();
            assert_eq!(load(&mut flash, &slots).unwrap(), Some(set(number, 9)));
        }
    }
}

#[test]
fn sets_that_do_not_fit_change_nothing() {
    let (mut flash, slots, old) = prepared::<4, 256>(SMALL_SLOT, 1, 20);
    assert_eq!(slots.capacity(), 384);
    let before = flash.bytes().to_vec();
    assert_eq!(
        slots.save(&mut flash, &[0; 385]),
        Err(SaveError::TooLong {
            bytes: 385,
            capacity: 384
        })
    );
    assert_eq!(flash.bytes(), before);
    assert_eq!(
        slots.load(&mut flash, &mut [0; 19]),
        Err(LoadError::Full {
            bytes: 20,
            capacity: 19
        })
    );
    assert_eq!(load(&mut flash, &slots).unwrap(), old);
    slots.save(&mut flash, &[0xFF; 384]).unwrap();
    assert_eq!(load(&mut flash, &slots).unwrap(), Some(vec![0xFF; 384]));
    slots.save(&mut flash, &[]).unwrap();
    assert_eq!(load(&mut flash, &slots).unwrap(), Some(Vec::new()));
}

/// A save writes the set, its header and nothing else, and erases one slot.
#[test]
fn what_a_save_costs() {
    let (mut flash, slots, _) = prepared::<4, 256>(SMALL_SLOT, 1, 20);
    let before = flash.steps();
    slots.save(&mut flash, &set(1, 130)).unwrap();
    let after = flash.steps();
    let cost = Steps {
        written: after.written - before.written,
        erased: after.erased - before.erased,
    };
    assert_eq!(
        cost,
        Steps {
            written: 64 + 64 + 4 + 16 + 4,
            erased: 2
        }
    );
}

#[test]
fn layouts_that_cannot_be() {
    let flash = Small::new(2048);
    let new = |first: (u32, u32), second: (u32, u32)| {
        let region = |(at, bytes)| Region::new(at, bytes);
        ParameterFlash::new(region(first), region(second), &flash)
    };
    assert!(new((0, 256), (256, 256)).is_ok());
    assert!(new((1024, 1024), (0, 512)).is_ok());
    for unaligned in [(100, 256), (0, 300), (512, 0)] {
        assert!(matches!(
            new(unaligned, (1024, 256)),
            Err(LayoutError::Unaligned(_))
        ));
    }
    for outside in [(1024, 1280), (2048, 256), (u32::MAX - 255, 256)] {
        assert!(matches!(
            new((0, 256), outside),
            Err(LayoutError::OutOfBounds { .. })
        ));
    }
    for (one, other) in [((0, 512), (256, 256)), ((256, 256), (0, 1024))] {
        assert!(matches!(new(one, other), Err(LayoutError::Overlap(..))));
    }
}

/// What may be done to a flash.
#[derive(Clone, Debug)]
enum Act {
    Save(Vec<u8>),
    Cut(Vec<u8>, u64, u64),
    Flip(usize, u8),
}

fn act() -> impl Strategy<Value = Act> {
    let set = || proptest::collection::vec(any::<u8>(), 0..200);
    prop_oneof![
        3 => set().prop_map(Act::Save),
        3 => (set(), 0..300u64, any::<u64>()).prop_map(|(set, at, seed)| Act::Cut(set, at, seed)),
        1 => (0..1024usize, 0..8u8).prop_map(|(at, bit)| Act::Flip(at, bit)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Beside a model that knows what was saved: after saves and cuts the newest set is there; after
    /// damage some set that was saved, or a report.
    #[test]
    fn any_history(acts in proptest::collection::vec(act(), 1..40)) {
        let mut flash = Small::new(1024);
        let slots = slots(&flash, SMALL_SLOT);
        let mut newest: Option<Vec<u8>> = None;
        let mut saved = vec![Vec::new()];
        let mut damaged = false;
        for act in acts {
            match act {
                Act::Save(set) => {
                    slots.save(&mut flash, &set).unwrap();
                    saved.push(set.clone());
                    newest = Some(set);
                    damaged = false;
                }
                Act::Cut(set, after, seed) => {
                    flash.cut_after(PowerCut { after, seed });
                    let done = slots.save(&mut flash, &set).is_ok();
                    flash.power_on();
                    saved.push(set.clone());
                    if done {
                        newest = Some(set);
                        damaged = false;
                    } else if !damaged {
                        let found = load(&mut flash, &slots).unwrap();
                        prop_assert!(
                            found == newest
                                || found.as_ref() == Some(&set)
                                || is_nothing(&newest) && is_nothing(&found)
                        );
                        newest = found;
                    }
                }
                Act::Flip(at, bit) => {
                    flash.bytes_mut()[at] ^= 1 << bit;
                    damaged = true;
                }
            }
            match load(&mut flash, &slots) {
                Ok(None) => prop_assert!(damaged || newest.is_none()),
                Ok(found) if damaged => prop_assert!(saved.contains(&found.unwrap())),
                Ok(found) => prop_assert!(found == newest || is_nothing(&newest) && is_nothing(&found)),
                Err(error) => prop_assert!(damaged && error == LoadError::Damaged),
            }
        }
    }
}
