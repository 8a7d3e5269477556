//! Every bit of the statusword in every mode: when it is set and when it falls. The rows are the
//! tables of `docs/statusword.md`; a run with `WRITE_STATUSWORD=1` writes them there.

#[path = "../rig/mod.rs"]
mod rig;

mod common;
mod cyclic;
mod homing;
mod interpolated;
mod position;
mod speed;
mod table;
mod torque;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use cia402::{Mode, State, Window};
use rig::{Random, Rig, STANDARD};
use table::{COMMON, HALTED, Row, TABLE};

/// Operation enabled, with and without bit 4, and halted.
const RUN: u16 = 0x0F;
const GO: u16 = 0x1F;
const HALT: u16 = 0x100;

fn has(rig: &Rig, bit: u32) -> bool {
    rig.status() & (1 << bit) != 0
}

#[track_caller]
fn set(rig: &Rig, bit: u32) {
    assert!(
        has(rig, bit),
        "bit {bit} is not set in {}",
        rig.axis.statusword()
    );
}

#[track_caller]
fn clear(rig: &Rig, bit: u32) {
    assert!(
        !has(rig, bit),
        "bit {bit} is set in {}",
        rig.axis.statusword()
    );
}

/// Halted, bit 10 falls, and comes back when the axis stands; without halt it falls again.
fn halts(rig: &mut Rig, word: u16) {
    rig.word(word | HALT);
    clear(rig, 10);
    rig.actual.velocity = 0.0;
    rig.run_ms(300);
    set(rig, 10);
    rig.word(word);
    clear(rig, 10);
}

/// Whatever is done in operation enabled, only these bits are ever 1.
fn never_others(mode: Mode, used: u16) {
    let mut random = Random(1 + u64::from(mode.0.unsigned_abs()));
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.following_warning = Some(Window {
        size: 5,
        time_ms: 1,
    });
    rig.configuration.velocity_fault = Some(Window {
        size: 5,
        time_ms: 1,
    });
    rig.configuration.velocity_threshold = 100.0;
    let allowed = used | State::OperationEnabled.mask();
    let mut seen = 0;
    for _ in 0..3000 {
        match random.below(8) {
            0 => {
                rig.word(RUN | (random.next() as u16 & 0x0370));
            }
            1 => cyclic::cyclic(&mut rig, random.next() as i16),
            2 => speed::vl_target(&mut rig, random.next() as i16),
            3 => {
                let position = random.next() as i16;
                rig.axis.push_set_point(
                    position.into(),
                    &rig.configuration,
                    &rig.targets,
                    &rig.actual,
                );
            }
            4 => rig.lag = random.below(20) as i32,
            5 => {
                rig.actual.warning = random.below(2) == 0;
                rig.actual.limited = random.below(2) == 0;
            }
            _ => rig.run_ms(random.below(30) as u32),
        }
        assert_eq!(rig.axis.state(), State::OperationEnabled);
        let others = rig.status() & !allowed;
        assert_eq!(others, 0, "{}", rig.axis.statusword());
        seen |= rig.status();
    }
    // Halted, every mode that halts says that it stands.
    assert_eq!(seen & 0x0400 != 0, used & 0x0400 != 0);
}

#[test]
fn every_bit_of_every_mode_does_what_its_row_says() {
    let mut broken = Vec::new();
    for uses in &TABLE {
        let mode = uses.mode;
        assert!(STANDARD.modes().contains(mode));
        for row in COMMON.iter().chain(uses.rows) {
            let check = AssertUnwindSafe(|| (row.check)(mode));
            if catch_unwind(check).is_err() {
                broken.push(format!("{mode}, bit {}", row.bit));
            }
        }
        let used = COMMON.iter().chain(uses.rows);
        let used = used.fold(0, |word, row| word | 1 << row.bit);
        if catch_unwind(AssertUnwindSafe(|| never_others(mode, used))).is_err() {
            broken.push(format!("{mode}, the bits it has not"));
        }
        // What halts says so, and what does not halt has no bit 10.
        let halts = uses.rows.iter().any(|row| row.set.contains(HALTED));
        assert_eq!(halts, used & 0x0400 != 0, "{mode}");
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn the_table_is_complete() {
    let listed: Vec<i8> = TABLE.iter().map(|uses| uses.mode.0).collect();
    let all: Vec<i8> = (i8::MIN..=i8::MAX)
        .filter(|&mode| STANDARD.modes().contains(Mode(mode)))
        .collect();
    assert_eq!(listed, all);
}

#[test]
fn a_quick_stop_shows_when_it_stands() {
    // The only bit beside the common ones in another state than operation enabled.
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_VELOCITY);
    rig.configuration.quick_stop_option = 6;
    speed::velocity_target(&mut rig, 10_000);
    rig.run_ms(200);
    rig.word(0x02);
    assert_eq!(rig.status() & 0x3C4F, 0x0007);
    rig.run_ms(100);
    assert_eq!(rig.status() & 0x3C4F, 0x0407);
}

fn table(rows: &[Row]) -> String {
    let mut text = String::from("| bit | name | set when | cleared when |\n|---|---|---|---|\n");
    for row in rows {
        let Row {
            bit,
            name,
            set,
            cleared,
            ..
        } = row;
        text += &format!("| {bit} | {name} | {set} | {cleared} |\n");
    }
    text
}

#[test]
fn the_documentation_has_the_same_rows() {
    let mut tables = String::from("\n### In every mode and state\n\n");
    tables += &table(&COMMON);
    for uses in &TABLE {
        let name = uses.mode.name().expect("a name");
        tables += &format!("\n### Mode {}, {name}\n\n", uses.mode.0);
        if uses.rows.is_empty() {
            tables += "None.\n";
        } else {
            tables += &table(uses.rows);
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/statusword.md");
    let text = std::fs::read_to_string(&path).expect("docs/statusword.md can be read");
    let (begin, end) = ("<!-- bits -->\n", "\n<!-- end -->\n");
    let from = text.find(begin).expect("the tables have a beginning") + begin.len();
    let to = text.find(end).expect("the tables have an end");
    if text[from..to] == *tables {
        return;
    }
    assert!(
        std::env::var_os("WRITE_STATUSWORD").is_some(),
        "docs/statusword.md has other tables; \
         write them anew with WRITE_STATUSWORD=1 cargo test -p servobus-cia402 --test statusword"
    );
    let new = format!("{}{tables}{}", &text[..from], &text[to..]);
    std::fs::write(&path, new).expect("docs/statusword.md can be written");
}
