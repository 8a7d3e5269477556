//! Each command and the objects that it means, written out once more.

use canopen::Access;
use personalities::roboteq::command_line::{COMMANDS, SERIAL};
use personalities::roboteq::{ROBOTEQ, ROBOTEQ_2, ROBOTEQ_3};
use personalities::serial::{Action, Kind, Of};

use crate::harness::Bench;

/// A line, its answer on a drive with three channels, and an object with its value before and after.
/// Of `line`, the number that is `#` is another for each channel.
type Row = (&'static str, &'static str, (u16, u8), i64, i64);

const NO: &str = "-\r";
const YES: &str = "+\r";

const WRITES: &[Row] = &[
    ("!CW 1 15", YES, (0x6040, 0), 0, 15),
    ("!CW 2 15", YES, (0x6840, 0), 0, 15),
    ("!CW 3 15", YES, (0x7040, 0), 0, 15),
    ("!cw 3 15", YES, (0x7040, 0), 0, 15),
    ("!CW 0 15", NO, (0x6040, 0), 7, 7),
    ("!CW 4 15", NO, (0x6040, 0), 7, 7),
    ("!CW -1 15", NO, (0x6040, 0), 7, 7),
    ("!CW 15", NO, (0x6040, 0), 7, 7),
    ("!CW", NO, (0x6040, 0), 7, 7),
    ("!CW 1 15 1", NO, (0x6040, 0), 7, 7),
    ("!S 1 300", YES, (0x2002, 1), 0, 300),
    ("!S 3 -300", YES, (0x2002, 3), 0, -300),
    ("!S 4 -300", NO, (0x2002, 3), 0, 0),
    ("!P 2 9000", YES, (0x2001, 2), 0, 9000),
    ("!AC 2 9000", YES, (0x2006, 2), 0, 9000),
    ("!DC 2 9000", YES, (0x2007, 2), 0, 9000),
    ("!EX", YES, (0x200C, 0), 0, 1),
    ("!EX 1", NO, (0x200C, 0), 0, 0),
    ("!MG", YES, (0x200D, 0), 0, 1),
    ("!EES", YES, (0x2017, 0), 0, 1),
    ("!EES 1", NO, (0x2017, 0), 0, 0),
    ("!MS 2", YES, (0x200E, 0), 0, 2),
    ("!MS 1 2", NO, (0x200E, 0), 0, 0),
    ("!G 1 -1000", YES, (0x2000, 1), 0, -1000),
    ("!G 2 500", YES, (0x2000, 2), 0, 500),
    ("!G 3 500", YES, (0x2000, 3), 0, 500),
    ("!ROM 1 -4", YES, (0x6060, 0), 0, -4),
    ("!ROM 2 3", YES, (0x6860, 0), 0, 3),
    ("!POS 1 -100000", YES, (0x607A, 0), 0, -100_000),
    ("!POS 3 2147483647", YES, (0x707A, 0), 0, 2_147_483_647),
    ("!POS 3 2147483648", NO, (0x707A, 0), 1, 1),
    ("!PSP 1 1500", YES, (0x6081, 0), 0, 1500),
    ("!PSP 2 1500", YES, (0x6881, 0), 0, 1500),
    ("!PAC 1 30000", YES, (0x6083, 0), 0, 30_000),
    ("!PAC 2 30000", YES, (0x6883, 0), 0, 30_000),
    ("!PDC 1 30000", YES, (0x6084, 0), 0, 30_000),
    ("!PDC 3 30000", YES, (0x7084, 0), 0, 30_000),
    // R25: element 2(channel - 1) + 1 is sub-index 1, the next one sub-index 2.
    ("!SPL 1 10", YES, (0x6046, 1), 0, 10),
    ("!SPL 2 20", YES, (0x6046, 2), 0, 20),
    ("!SPL 3 30", YES, (0x6846, 1), 0, 30),
    ("!SPL 4 40", YES, (0x6846, 2), 0, 40),
    ("!SPL 5 50", YES, (0x7046, 1), 0, 50),
    ("!SPL 6 60", YES, (0x7046, 2), 0, 60),
    ("!SPL 7 70", NO, (0x7046, 2), 5, 5),
    ("!SPL 0 70", NO, (0x6046, 1), 5, 5),
    ("!SAC 1 10", YES, (0x6048, 1), 0, 10),
    ("!SAC 4 3", YES, (0x6848, 2), 0, 3),
    ("!SDC 2 3", YES, (0x6049, 2), 0, 3),
    ("!SDC 5 10", YES, (0x7049, 1), 0, 10),
    ("!TC 1 -25", YES, (0x6071, 0), 0, -25),
    ("!TC 2 25", YES, (0x6871, 0), 0, 25),
    ("!TSL 1 20000", YES, (0x6087, 0), 0, 20_000),
    ("!TSL 3 20000", YES, (0x7087, 0), 0, 20_000),
    ("!VAR 16 -7", YES, (0x2005, 16), 0, -7),
    ("!VAR 17 -7", NO, (0x2005, 16), 0, 0),
    ("^RWD 0", YES, (0x3008, 0), 1000, 0),
    ("^FSA 1", YES, (0x30F1, 0), 0, 1),
    ("^FSA 1 1", NO, (0x30F1, 0), 0, 0),
    ("^MMOD 1 3", YES, (0x3027, 1), 0, 3),
    ("^MMOD 3 -2", YES, (0x3027, 3), 0, -2),
    ("^MAC 1 5000", YES, (0x3033, 1), 0, 5000),
    ("^MAC 2 5000", YES, (0x3033, 2), 0, 5000),
    ("^MDEC 1 5000", YES, (0x3034, 1), 0, 5000),
    ("^MVEL 2 500", YES, (0x3035, 2), 0, 500),
    ("^EDEC 3 5000", YES, (0x30F0, 3), 0, 5000),
    ("^OVL 300", YES, (0x30F4, 1), 0, 300),
    ("^UVL 120", YES, (0x30F4, 2), 0, 120),
    ("^OTL 70", YES, (0x30F4, 3), 0, 70),
    ("^MXRPM 1 2000", YES, (0x3036, 1), 0, 2000),
    ("^ALIM 2 25", YES, (0x302A, 2), 0, 25),
    ("^ELL 3 -5", YES, (0x30F2, 3), 0, -5),
    ("^EHL 3 5", YES, (0x30F3, 3), 0, 5),
    ("^CLERD 1 0", YES, (0x3038, 1), 2, 0),
    // A kind belongs to the name.
    ("!SW 1 1", NO, (0x6041, 0), 1, 1),
    ("!A 1 1", NO, (0x2100, 1), 1, 1),
    ("!AOM 1 1", NO, (0x6061, 0), 3, 3),
    ("!MAC 1 1", NO, (0x3033, 1), 4, 4),
    ("^CW 1 15", NO, (0x6040, 0), 4, 4),
    ("%CW 1 15", NO, (0x6040, 0), 4, 4),
    ("!XYZ 1 15", NO, (0x6040, 0), 4, 4),
    ("!C W 1 15", NO, (0x6040, 0), 4, 4),
    ("!1 15", NO, (0x6040, 0), 4, 4),
    ("!", NO, (0x6040, 0), 4, 4),
    // As the maker's manual writes `?T2`: the number needs no space.
    ("!CW1 15", YES, (0x6040, 0), 4, 15),
    ("!CW2 -1", YES, (0x6840, 0), 4, -1),
    ("!CW115", NO, (0x6040, 0), 4, 4),
    ("CW 1 15", NO, (0x6040, 0), 4, 4),
];

#[test]
fn each_command_writes_its_object() {
    for (line, answer, (index, sub), before, after) in WRITES {
        let mut bench = Bench::quiet(3);
        bench.drive.set(*index, *sub, *before);
        assert_eq!(bench.say(format!("{line}\r").as_bytes()), *answer, "{line}");
        assert_eq!(bench.drive.get(*index, *sub), *after, "{line}");
    }
}

/// A query, the objects behind it by channel, and in which mode.
type Query = (&'static str, &'static str, [(u16, u8); 3]);

const READS: &[Query] = &[
    ("?CW", "CW", [(0x6040, 0), (0x6840, 0), (0x7040, 0)]),
    ("?SW", "SW", [(0x6041, 0), (0x6841, 0), (0x7041, 0)]),
    ("?S", "S", [(0x2103, 1), (0x2103, 2), (0x2103, 3)]),
    ("?M", "M", [(0x2101, 1), (0x2101, 2), (0x2101, 3)]),
    ("?P", "P", [(0x2102, 1), (0x2102, 2), (0x2102, 3)]),
    ("?F", "F", [(0x2110, 1), (0x2110, 2), (0x2110, 3)]),
    ("?C", "C", [(0x2104, 1), (0x2104, 2), (0x2104, 3)]),
    ("?E", "E", [(0x2114, 1), (0x2114, 2), (0x2114, 3)]),
    ("?BA", "BA", [(0x210C, 1), (0x210C, 2), (0x210C, 3)]),
    ("?FM", "FM", [(0x2122, 1), (0x2122, 2), (0x2122, 3)]),
    ("?V", "V", [(0x210D, 1), (0x210D, 2), (0x210D, 3)]),
    ("?SR", "SR", [(0x2107, 1), (0x2107, 2), (0x2107, 3)]),
    ("~MXRPM", "MXRPM", [(0x3036, 1), (0x3036, 2), (0x3036, 3)]),
    ("~ALIM", "ALIM", [(0x302A, 1), (0x302A, 2), (0x302A, 3)]),
    ("~ELL", "ELL", [(0x30F2, 1), (0x30F2, 2), (0x30F2, 3)]),
    ("~EHL", "EHL", [(0x30F3, 1), (0x30F3, 2), (0x30F3, 3)]),
    ("~CLERD", "CLERD", [(0x3038, 1), (0x3038, 2), (0x3038, 3)]),
    ("?ROM", "ROM", [(0x6060, 0), (0x6860, 0), (0x7060, 0)]),
    ("?AOM", "AOM", [(0x6061, 0), (0x6861, 0), (0x7061, 0)]),
    ("?POS", "POS", [(0x607A, 0), (0x687A, 0), (0x707A, 0)]),
    ("?PSP", "PSP", [(0x6081, 0), (0x6881, 0), (0x7081, 0)]),
    ("?PAC", "PAC", [(0x6083, 0), (0x6883, 0), (0x7083, 0)]),
    ("?PDC", "PDC", [(0x6084, 0), (0x6884, 0), (0x7084, 0)]),
    ("?TC", "TC", [(0x6071, 0), (0x6871, 0), (0x7071, 0)]),
    ("?TSL", "TSL", [(0x6087, 0), (0x6887, 0), (0x7087, 0)]),
    ("?SDM", "SDM", [(0x6502, 0), (0x6D02, 0), (0x7502, 0)]),
    ("?VNM", "VNM", [(0x67FE, 0), (0x6FFE, 0), (0x77FE, 0)]),
    ("?A", "A", [(0x2100, 1), (0x2100, 2), (0x2100, 3)]),
    ("?RMP", "RMP", [(0x6043, 0), (0x6843, 0), (0x7043, 0)]),
    ("~MMOD", "MMOD", [(0x3027, 1), (0x3027, 2), (0x3027, 3)]),
    ("~MAC", "MAC", [(0x3033, 1), (0x3033, 2), (0x3033, 3)]),
    ("~MDEC", "MDEC", [(0x3034, 1), (0x3034, 2), (0x3034, 3)]),
    ("~MVEL", "MVEL", [(0x3035, 1), (0x3035, 2), (0x3035, 3)]),
    ("~EDEC", "EDEC", [(0x30F0, 1), (0x30F0, 2), (0x30F0, 3)]),
];

#[test]
fn each_query_tells_its_object() {
    let values = [1500, -2, i64::from(i32::MIN)];
    for (line, name, objects) in READS {
        let mut bench = Bench::quiet(3);
        for ((index, sub), value) in objects.iter().zip(values) {
            bench.drive.set(*index, *sub, value);
        }
        let all = format!("{name}=1500:-2:-2147483648\r");
        assert_eq!(bench.say(format!("{line}\r").as_bytes()), all);
        for (channel, value) in (1..).zip(values) {
            let answer = bench.say(format!("{line} {channel}\r").as_bytes());
            assert_eq!(answer, format!("{name}={value}\r"));
        }
        for wrong in ["0", "4", "-1", "x", "1 1", "99999999999"] {
            let answer = bench.say(format!("{line} {wrong}\r").as_bytes());
            assert_eq!(answer, NO, "{line} {wrong}");
        }
    }
}

#[test]
fn values_of_elements_come_in_the_order_of_the_channels() {
    for (name, index) in [("SPL", 0x6046), ("SAC", 0x6048), ("SDC", 0x6049)] {
        let mut bench = Bench::quiet(3);
        for element in 0_u8..6 {
            let index = index + u16::from(element / 2) * 0x800;
            bench
                .drive
                .set(index, element % 2 + 1, i64::from(element) * 10 + 10);
        }
        let answer = bench.say(format!("?{name}\r").as_bytes());
        assert_eq!(answer, format!("{name}=10:20:30:40:50:60\r"));
        let answer = bench.say(format!("?{name} 4\r").as_bytes());
        assert_eq!(answer, format!("{name}=40\r"));
        assert_eq!(bench.say(format!("?{name} 7\r").as_bytes()), NO);
    }
}

#[test]
fn what_the_drive_has_once() {
    let mut bench = Bench::quiet(2);
    let rows = [
        ("?FS", "FS", (0x2111, 0)),
        ("?FF", "FF", (0x2112, 0)),
        ("~FSA", "FSA", (0x30F1, 0)),
        ("~RWD", "RWD", (0x3008, 0)),
        ("~OVL", "OVL", (0x30F4, 1)),
        ("~UVL", "UVL", (0x30F4, 2)),
        ("~OTL", "OTL", (0x30F4, 3)),
    ];
    for (line, name, (index, sub)) in rows {
        bench.drive.set(index, sub, 7);
        let answer = bench.say(format!("{line}\r").as_bytes());
        assert_eq!(answer, format!("{name}=7\r"));
        bench.drive.set(index, sub, 0);
        assert_eq!(bench.say(format!("{line} 1\r").as_bytes()), NO);
    }
}

/// User variables are elements; an answer has room for all.
#[test]
fn sixteen_values_are_one_answer() {
    let mut bench = Bench::new(1);
    for element in 1..=16 {
        bench.drive.set(0x2106, element, i64::from(i32::MIN));
    }
    let all = ["-2147483648"; 16].join(":");
    assert_eq!(bench.say(b"?VAR\r"), format!("?VAR\rVAR={all}\r"));
    assert_eq!(bench.say(b"?VAR16\r"), "?VAR16\rVAR=-2147483648\r");
    bench.drive.set(0x210F, 1, 20);
    bench.drive.set(0x210F, 2, 30);
    assert_eq!(bench.say(b"?T\r"), "?T\rT=20:30\r");
    assert_eq!(bench.say(b"?T2\r"), "?T2\rT=30\r");
    assert_eq!(bench.say(b"?T3\r"), "?T3\r-\r");
}

/// With one channel its number may be left out, and there is no other.
#[test]
fn a_drive_with_one_channel() {
    let mut bench = Bench::quiet(1);
    assert_eq!(bench.say(b"!CW 15\r"), YES);
    assert_eq!(bench.drive.get(0x6040, 0), 15);
    assert_eq!(bench.say(b"!CW 1 6\r"), YES);
    assert_eq!(bench.drive.get(0x6040, 0), 6);
    assert_eq!(bench.say(b"!CW 2 6\r"), NO);
    assert_eq!(bench.say(b"?CW\r"), "CW=6\r");
    assert_eq!(bench.say(b"?SPL\r"), "SPL=0:0\r");
    assert_eq!(bench.say(b"!SPL 2 5\r"), YES);
    assert_eq!(bench.say(b"?SPL 2\r"), "SPL=5\r");
    assert_eq!(bench.say(b"!SPL 5\r"), NO);
    assert_eq!(bench.say(b"^MAC 100\r"), YES);
    assert_eq!(bench.say(b"~MAC\r"), "MAC=100\r");
}

/// What the drive refuses over CAN it refuses here.
#[test]
fn a_refusal_is_a_minus() {
    let mut bench = Bench::quiet(3);
    bench.drive.refuses.insert((0x6860, 0), 0x0609_0030);
    assert_eq!(bench.say(b"!ROM 2 7\r"), NO);
    assert_eq!(bench.say(b"!ROM 1 3\r"), YES);
    // A drive without the object.
    bench.drive.values.remove(&(0x7041, 0));
    assert_eq!(bench.say(b"?SW\r"), NO);
    assert_eq!(bench.say(b"?SW 1\r"), "SW=0\r");
}

#[test]
fn storing_is_answered_when_it_is_done() {
    let mut bench = Bench::quiet(3);
    assert_eq!(bench.say(b"%EESAV\r"), "");
    assert_eq!(bench.drive.stores, 1);
    assert!(!bench.line.is_ready());
    // What comes meanwhile would be lost: whoever hands bytes over waits.
    bench.line.stored(true);
    assert_eq!(bench.say(b"\r"), YES);
    assert_eq!(bench.say(b"%eesav\r"), "");
    bench.line.stored(false);
    assert_eq!(bench.say(b"\r"), NO);
    // Nobody waits for it.
    bench.line.stored(true);
    assert_eq!(bench.say(b"\r"), "");
    bench.drive.cannot_store = true;
    assert_eq!(bench.say(b"%EESAV\r"), NO);
    assert_eq!(bench.say(b"%EESAV 1\r"), NO);
    assert_eq!(bench.say(b"%EERST\r"), NO);
    assert!(bench.line.is_ready());
}

#[test]
fn the_echo_is_on_until_it_is_switched_off() {
    let mut bench = Bench::new(1);
    assert_eq!(bench.say(b"?CW\r"), "?CW\rCW=0\r");
    assert_eq!(bench.say(b"!CW 1 6_"), "!CW 1 6_+\r");
    assert_eq!(bench.say(b"~ECHOF\r"), "~ECHOF\rECHOF=0\r");
    assert_eq!(bench.say(b"^ECHOF 1\r"), "^ECHOF 1\r+\r");
    assert_eq!(bench.say(b"?CW\r"), "CW=6\r");
    assert_eq!(bench.say(b"~ECHOF\r"), "ECHOF=1\r");
    assert_eq!(bench.say(b"^ECHOF 2\r"), NO);
    assert_eq!(bench.say(b"^ECHOF 0\r"), YES);
    assert_eq!(bench.say(b"?CW\r"), "?CW\rCW=6\r");
}

#[test]
fn a_line_ends_with_a_return_or_an_underscore_and_line_feeds_are_passed_over() {
    let mut bench = Bench::quiet(1);
    assert_eq!(bench.say(b"?CW_?SW_\r\n?A\n\r"), "CW=0\rSW=0\rA=0\r");
    assert_eq!(bench.say(b"\r\r  \r\r"), "");
    assert_eq!(bench.say(b"  ?CW   1  \r"), "CW=0\r");
}

/// Every name of the issue is in the table, each pair of kind and name once, and in capitals.
#[test]
fn the_table_is_complete_and_without_doubles() {
    const NAMES: &str = "CW SW S G ROM AOM POS PSP PAC PDC SPL SAC SDC TC TSL SDM VNM F A RMP";
    for name in NAMES.split(' ') {
        let known = |kind| COMMANDS.iter().any(|c| c.name == name && c.kind == kind);
        assert!(known(Kind::Command) || known(Kind::Query), "{name}");
    }
    for name in ["FSA", "MMOD", "MAC", "MDEC", "MVEL", "EDEC"] {
        for kind in [Kind::Set, Kind::Get] {
            assert!(
                COMMANDS.iter().any(|c| c.name == name && c.kind == kind),
                "{name}"
            );
        }
    }
    for (n, command) in COMMANDS.iter().enumerate() {
        assert!(command.name.len() <= 5, "{}", command.name);
        assert_eq!(command.name, command.name.to_ascii_uppercase());
        let others = &COMMANDS[n + 1..];
        let same = |other: &&personalities::serial::Command| {
            other.kind == command.kind && other.name == command.name
        };
        assert!(!others.iter().any(|other| same(&other)), "{}", command.name);
    }
}

/// 115,200 bit/s, ten bits a byte.
#[test]
fn a_byte_takes_86_microseconds() {
    assert_eq!(SERIAL.byte_ns(), 86_806);
}

/// Every object that a command means is there for each channel, an integer, and can be read or written.
#[test]
fn every_command_has_its_objects_in_every_controller() {
    for controller in [&ROBOTEQ, &ROBOTEQ_2, &ROBOTEQ_3] {
        let port = controller.serial.expect("a serial line");
        let channels = u8::try_from(controller.axes.len()).expect("a few");
        let mut checked = 0;
        for command in port.commands {
            let (object, writes) = match command.action {
                Action::Read(object) => (object, false),
                Action::Write(object) => (object, true),
                Action::Echo | Action::Store => continue,
            };
            let (channels, steps) = match command.of {
                Of::Drive | Of::Order => (1, 1),
                Of::Channel => (channels, 1),
                Of::Pair => (channels, 2),
                Of::Elements(count) => (1, count),
            };
            for channel in 0..channels {
                for step in 0..steps {
                    let at = object.at(channel, step);
                    let mut rows = controller.device.table.rows().iter();
                    let row = rows.find(|row| {
                        row.address.index == at.index
                            && (row.address.sub..row.address.sub + row.count).contains(&at.sub)
                    });
                    let row = row.unwrap_or_else(|| panic!("{} {at}", command.name));
                    assert!(row.data_type.bounds().is_some(), "{} {at}", command.name);
                    let may_not = match writes {
                        true => matches!(row.access, Access::Constant | Access::ReadOnly),
                        false => row.access == Access::WriteOnly,
                    };
                    assert!(!may_not, "{} {at}", command.name);
                    checked += 1;
                }
            }
        }
        assert!(checked > 60, "{checked}");
    }
}
