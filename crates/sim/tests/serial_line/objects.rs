//! What the line writes and reads are the objects of CAN.

use canopen::{Access, Address, DataType};
use personalities::roboteq::{ROBOTEQ_2, ROBOTEQ_3};
use personalities::serial::{Action, Command, Kind, Of};

use crate::bench::{controller, say};
use crate::master::Master;

/// The integer behind an object, by SDO; its abort code if it is refused.
fn by_can(master: &mut Master, at: Address) -> Result<i64, u32> {
    let data_type = data_type(master, at);
    let raw = master.try_read(1, at.index, at.sub)?;
    Ok(data_type.number(u32::from_le_bytes(raw)))
}

fn data_type(master: &mut Master, at: Address) -> DataType {
    let table = &master.drive(1).personality().device.table;
    let entry = table.find(at.index, at.sub).expect("an object");
    entry.field.data_type()
}

fn write_by_can(master: &mut Master, at: Address, value: i64) -> Result<(), u32> {
    let size = usize::from(data_type(master, at).size());
    master.try_write(1, at.index, at.sub, &value.to_le_bytes()[..size])
}

/// A value that the object takes, and another one.
fn values(command: &Command) -> [i64; 2] {
    match command.name {
        "ROM" => [3, -2],
        "POS" => [-700, 700],
        "FSA" => [1, 0],
        "RWD" => [65_000, 0],
        "OVL" | "UVL" => [200, 210],
        "OTL" => [60, 70],
        "MXRPM" => [1500, 1600],
        "S" => [-250, 250],
        "MS" => [1, 2],
        _ => [1, 2],
    }
}

/// What is written by one way is read by the other, and what one way refuses the other does, too.
#[test]
fn both_ways_lead_to_the_same_objects() {
    let mut master = controller(&ROBOTEQ_3);
    let port = ROBOTEQ_3.serial.expect("a serial line");
    let mut compared = 0;
    for command in port.commands {
        let Action::Write(object) = command.action else {
            continue;
        };
        let (count, steps) = match command.of {
            Of::Order => continue,
            Of::Drive => (1, 1),
            Of::Channel => (3, 1),
            Of::Pair => (3, 2),
            Of::Elements(count) => (1, count),
        };
        for which in 0..count * steps {
            let at = object.at(which / steps, which % steps);
            let rows = ROBOTEQ_3.device.table.rows();
            let row = rows.iter().find(|row| {
                row.address.index == at.index
                    && (row.address.sub..row.address.sub + row.count).contains(&at.sub)
            });
            let row = row.expect("a row");
            let number = match command.of {
                Of::Drive => String::new(),
                _ => format!("{} ", which + 1),
            };
            let (set, get) = match command.kind {
                Kind::Command => ('!', '?'),
                _ => ('^', '~'),
            };
            let name = command.name;
            let [one, other] = values(command);
            let line = format!("{set}{name} {number}{one}\r");
            assert_eq!(say(&mut master, &line), "+\r", "{line}");
            if row.access != Access::WriteOnly {
                assert_eq!(by_can(&mut master, at), Ok(one), "{line}");
                let query = format!("{get}{name} {number}\r");
                assert_eq!(write_by_can(&mut master, at, other), Ok(()), "{name}");
                let answer = say(&mut master, &query);
                assert_eq!(answer, format!("{name}={other}\r"), "{query}");
                compared += 1;
            }
            // Beyond what the object takes: refused by both, or by both held within.
            for wrong in [i64::from(i32::MIN), i64::from(i32::MAX)] {
                let fits = row
                    .data_type
                    .bounds()
                    .is_some_and(|(l, h)| l <= wrong && wrong <= h);
                let line = format!("{set}{name} {number}{wrong}\r");
                let answer = say(&mut master, &line);
                if fits {
                    let refused = write_by_can(&mut master, at, wrong).is_err();
                    assert_eq!(answer == "-\r", refused, "{line}");
                } else {
                    assert_eq!(answer, "-\r", "{line}");
                }
            }
        }
    }
    assert!(compared > 60, "{compared}");
}

/// Each query tells what an upload tells.
#[test]
fn queries_tell_what_uploads_tell() {
    let mut master = controller(&ROBOTEQ_2);
    for line in [
        "^FSA 1\r",
        "!ROM 2 3\r",
        "!CW 2 6\r",
        "!CW 2 15\r",
        "!S 2 300\r",
    ] {
        assert_eq!(say(&mut master, line), "+\r", "{line}");
    }
    master.run_ms(300);
    // Currents and speeds are never twice the same.
    let lively = ["A", "BA", "F", "S", "SR", "C", "E", "V", "P"];
    let mut compared = 0;
    for command in ROBOTEQ_2.serial.expect("a serial line").commands {
        let (Action::Read(object), Kind::Query | Kind::Get) = (command.action, command.kind) else {
            continue;
        };
        let (count, steps) = match command.of {
            Of::Drive | Of::Order => (1, 1),
            Of::Channel => (2, 1),
            Of::Pair => (2, 2),
            Of::Elements(count) => (1, count),
        };
        let prefix = if command.kind == Kind::Query {
            '?'
        } else {
            '~'
        };
        let answer = say(&mut master, &format!("{prefix}{}\r", command.name));
        let told = answer.trim_end().split_once('=').expect("an answer").1;
        let told: Vec<i64> = told
            .split(':')
            .map(|n| n.parse().expect("a number"))
            .collect();
        assert_eq!(told.len(), usize::from(count * steps), "{}", command.name);
        for (which, told) in (0..).zip(told) {
            let at = object.at(which / steps, which % steps);
            let read = by_can(&mut master, at).expect("readable");
            if lively.contains(&command.name) {
                let tolerance = match command.name {
                    // Of a turning shaft, and of a voltage that follows each sample.
                    "C" => 10_000,
                    "P" => 100,
                    _ => 20.max(read.abs() / 10),
                };
                assert!((read - told).abs() <= tolerance, "{at}: {told} {read}");
            } else {
                assert_eq!(told, read, "{} {at}", command.name);
            }
            compared += 1;
        }
    }
    assert!(compared > 50, "{compared}");
}
