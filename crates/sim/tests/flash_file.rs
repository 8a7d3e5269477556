//! A virtual drive's flash in a file: what is there in the next run, what is taken over from the
//! form before, and what damage leaves.

use std::fs;
use std::path::PathBuf;

use drive::program::{ImageHeader, Version};
use sim::{FlashFile, Place, PowerCut};

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
        .join("flash-file")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    folder
}

fn place(node: u8) -> Place {
    Place::of_node(canopen::NodeId::new(node).unwrap())
}

fn open(folder: &std::path::Path) -> FlashFile {
    FlashFile::file(folder, "p3", place(7)).unwrap()
}

/// Stored parameters with one record.
fn set(value: u8) -> Vec<u8> {
    let body = [0x17, 0x10, 0, 2, value, 0];
    let sum = drive::flash::Checksum::of(&body).value();
    let mut set = b"SBP1".to_vec();
    set.extend(6u32.to_le_bytes());
    set.extend(sum.to_le_bytes());
    set.extend(body);
    set
}

fn image(number: u8) -> Vec<u8> {
    let body = [number; 700];
    let version = Version::new(&format!("1.{number}")).unwrap();
    [&ImageHeader::of(1, version, &body).bytes()[..], &body].concat()
}

#[test]
fn what_was_saved_is_there_in_the_next_run() {
    let folder = folder("saved");
    let file = folder.join("p3-node7.flash");
    let mut flash = open(&folder);
    assert_eq!(flash.bytes(), [0u8; 0]);
    assert!(!file.exists(), "no file before the first save");
    for value in 0..5 {
        flash.replace(set(value)).unwrap();
        assert_eq!(flash.bytes(), set(value));
        assert_eq!(open(&folder).bytes(), set(value));
    }
    let length = fs::metadata(&file).unwrap().len();
    assert!(length <= 0x8000, "{length}: no more than was written");
    let memory = FlashFile::memory(set(9));
    assert_eq!(memory.bytes(), set(9));
    assert!(!memory.is_damaged() && !memory.fell_back());
}

/// A process that ends at every step of a save.
#[test]
fn a_run_that_ends_in_the_middle_of_a_save() {
    let folder = folder("cut");
    let file = folder.join("p3-node7.flash");
    open(&folder).replace(set(1)).unwrap();
    let before = fs::read(&file).unwrap();
    let (mut old, mut new) = (0, 0);
    for after in 0.. {
        fs::write(&file, &before).unwrap();
        let mut flash = open(&folder);
        flash.flash().cut_after(PowerCut { after, seed: after });
        let done = flash.replace(set(2)).is_ok();
        drop(flash);
        let flash = open(&folder);
        assert!(!flash.is_damaged() && !flash.fell_back());
        if flash.bytes() == set(2) {
            new += 1;
        } else {
            assert_eq!(flash.bytes(), set(1), "after {after}");
            old += 1;
        }
        if done {
            break;
        }
    }
    // Four sectors, a page of the set and its rest, the header, the mark.
    assert_eq!((old, new), (4 + 20 + 16, 4 + 1));
}

#[test]
fn parameters_of_the_form_before_are_taken_over_once() {
    let folder = folder("params");
    let old = folder.join("p3-node7.params");
    let kept = folder.join("p3-node7.params.old");
    fs::create_dir_all(&folder).unwrap();
    fs::write(&old, set(5)).unwrap();
    assert_eq!(open(&folder).bytes(), set(5));
    assert!(!old.exists());
    assert_eq!(fs::read(&kept).unwrap(), set(5));
    open(&folder).replace(set(6)).unwrap();
    // One that appears later is not looked at: there is something stored.
    fs::write(&old, set(4)).unwrap();
    assert_eq!(open(&folder).bytes(), set(6));
    assert!(old.exists());
    // Damage is taken over as it is, for the drive to report.
    fs::remove_file(folder.join("p3-node7.flash")).unwrap();
    fs::write(&old, b"damaged").unwrap();
    let mut flash = open(&folder);
    assert!(flash.is_damaged());
    assert_eq!(flash.bytes(), b"damaged");
    assert_eq!(
        fs::read(folder.join("p3-node7.params.old2")).unwrap(),
        b"damaged"
    );
    flash.set_aside().unwrap();
    assert_eq!(open(&folder).bytes(), [0u8; 0]);
}

#[test]
fn a_damaged_set_falls_back_to_the_one_before() {
    let folder = folder("fall-back");
    let file = folder.join("p3-node7.flash");
    for value in 1..=3 {
        open(&folder).replace(set(value)).unwrap();
    }
    // The third set is in the second slot.
    let mut damaged = fs::read(&file).unwrap();
    damaged[0x4000 + 130] ^= 1;
    fs::write(&file, &damaged).unwrap();
    let mut flash = open(&folder);
    assert!(flash.fell_back() && !flash.is_damaged());
    assert_eq!(flash.bytes(), set(2));
    let aside = flash.set_aside().unwrap().unwrap();
    assert_eq!(aside, folder.join("p3-node7.flash.corrupt"));
    assert_eq!(fs::read(&aside).unwrap(), damaged);
    let flash = open(&folder);
    assert!(!flash.fell_back());
    assert_eq!(flash.bytes(), set(2));
}

#[test]
fn damage_to_all_there_is_is_told_and_leaves_the_programs() {
    let folder = folder("damaged");
    let file = folder.join("p3-node7.flash");
    let mut flash = open(&folder);
    flash.replace(set(1)).unwrap();
    let programs = flash.programs(1, &image(3)).unwrap();
    assert_eq!(programs.status(), 0);
    let identification = programs.identification();
    drop(flash);
    let good = fs::read(&file).unwrap();
    let mut only_set = good.clone();
    only_set[0x4000 + 130] ^= 1;
    let mut both = good.clone();
    both[0x0006] ^= 1;
    both[0x4006] ^= 1;
    for (number, damaged) in [only_set, both].into_iter().enumerate() {
        fs::write(&file, &damaged).unwrap();
        let mut flash = open(&folder);
        assert!(flash.is_damaged() && !flash.fell_back());
        // The same in a replay, which has the bytes only.
        assert!(FlashFile::memory(flash.bytes().to_vec()).is_damaged());
        let aside = flash.set_aside().unwrap().unwrap();
        let ending = ["corrupt", "corrupt2"][number];
        assert_eq!(aside, folder.join(format!("p3-node7.flash.{ending}")));
        assert_eq!(fs::read(&aside).unwrap(), damaged);
        let mut flash = open(&folder);
        assert_eq!(flash.bytes(), [0u8; 0]);
        let programs = flash.programs(1, &image(4)).unwrap();
        assert_eq!(programs.identification(), identification);
    }
}

/// Files that are no flash's.
#[test]
fn other_files() {
    for contents in [&b"x"[..], &[0; 0x5000], &[0xAA; 0x8_0000]] {
        let folder = folder("other");
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("p3-node7.flash"), contents).unwrap();
        let mut flash = open(&folder);
        assert!(flash.is_damaged());
        flash.set_aside().unwrap();
        assert_eq!(open(&folder).bytes(), [0u8; 0]);
        flash.replace(set(1)).unwrap();
        assert_eq!(open(&folder).bytes(), set(1));
    }
    let folder = folder("other");
    fs::create_dir_all(folder.join("p3-node7.flash")).unwrap();
    let error = FlashFile::file(&folder, "p3", place(7))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("p3-node7.flash: cannot read the stored parameters"),
        "{error}"
    );
}

#[test]
fn a_program_is_there_in_the_next_run() {
    let folder = folder("program");
    let mut flash = open(&folder);
    let mut programs = flash.programs(1, &image(1)).unwrap();
    assert_eq!(programs.running().unwrap().image.version.text(), "1.1");
    programs.control(0).unwrap();
    programs.control(3).unwrap();
    while programs.erase_sector(flash.flash()).unwrap() {}
    programs.begin(None).unwrap();
    programs.write(flash.flash(), 0, &image(2)).unwrap();
    programs.finish(flash.flash()).unwrap();
    flash.sync().unwrap();
    let programs = open(&folder).programs(1, &image(1)).unwrap();
    assert_eq!(programs.running().unwrap().image.version.text(), "1.2");
    let bad = FlashFile::memory(Vec::new()).programs(2, &image(1));
    let error = bad.unwrap_err().to_string();
    assert!(error.contains("for product 0x1"), "{error}");
}
