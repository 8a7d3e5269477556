//! Every row of the drives' fault tables: what causes it, what the drive says and does, how it ends.
//!
//! A [`Row`] names a cause and how it is brought about, in the simulated motor, its board or on the
//! bus. [`prove`] then checks the same of each: the emergency frame, 0x1001, 0x1002, 0x603F, 0x1003,
//! the statusword, latching or ending by itself, the message of its end, that it comes again after a
//! reset while its cause is there, and that its object set to zero disables it.

#[path = "../master/mod.rs"]
mod master;

mod board;
mod bus;
mod motion;
mod motor;
mod page;
mod supply;

use canopen::Instant;
use master::*;
use personalities::{Cause, FaultRow, Kind, Personality, Switch, p3::P3, p3_extended::P3_EXTENDED};
use sim::DriveSettings;

/// One row of a fault table and how to prove it.
#[derive(Clone, Copy)]
struct Row {
    cause: Cause,
    /// How it is brought about, for docs/faults.md.
    how: &'static str,
    /// Sets thresholds and brings the drive to where the cause can act.
    prepare: fn(&mut Master),
    /// Brings the cause about.
    provoke: fn(&mut Master),
    /// Takes it away.
    cease: fn(&mut Master),
    /// When the emergency must have come, ms after the cause: not before, not after.
    within_ms: (f64, f64),
    /// The cause is an event and not a state: a reset while it is there does not bring it back.
    is_event: bool,
}

const ROWS: &[&[Row]] = &[
    supply::ROWS,
    board::ROWS,
    motor::ROWS,
    motion::ROWS,
    bus::ROWS,
];

fn rows() -> impl Iterator<Item = &'static Row> {
    ROWS.iter().flat_map(|rows| rows.iter())
}

fn table_row(personality: &'static Personality, cause: Cause) -> Option<&'static FaultRow> {
    personality.faults.iter().find(|row| row.cause == cause)
}

fn one(personality: &'static Personality) -> Master {
    Master::with(vec![
        DriveSettings::new(id(1), personality),
        DriveSettings::new(id(9), &P3),
    ])
}

/// The emergency frames with a code, and when they were on the bus.
fn emergencies(master: &Master, code: u16) -> Vec<(Instant, [u8; 8])> {
    let [low, high] = code.to_le_bytes();
    let frames = master.log.iter().filter(|t| t.frame.raw_id() == 0x81);
    frames
        .map(|t| (t.at, t.frame.bytes()))
        .filter(|(_, bytes)| bytes[..2] == [low, high])
        .collect()
}

/// Frames that tell of the end of the error `code`.
fn ends(master: &Master, code: u16) -> Vec<[u8; 8]> {
    let [low, high] = code.to_le_bytes();
    let all = master.emergencies(1).into_iter();
    all.filter(|bytes| bytes[..2] == [0, 0] && bytes[6..] == [low, high])
        .collect()
}

fn prove(personality: &'static Personality, row: &Row) {
    let name = format!("{} {:?}", personality.name, row.cause);
    let table = table_row(personality, row.cause).unwrap();
    let mut master = one(personality);
    (row.prepare)(&mut master);
    master.run_ms(20);
    master.log.clear();
    let began = master.now();
    (row.provoke)(&mut master);
    let (not_before, not_after) = row.within_ms;
    while emergencies(&master, table.code).is_empty() {
        let passed = master.now().since_ns(began) as f64 * 1e-6;
        assert!(passed <= not_after, "{name}: no emergency in {passed} ms");
        master.run_us(500);
    }
    // The frame, and when it came.
    let (at, bytes) = emergencies(&master, table.code)[0];
    let ms = at.since_ns(began) as f64 * 1e-6;
    println!("{name}: {ms:.2} ms");
    assert!(
        ms >= not_before && ms <= not_after,
        "{name}: after {ms} ms, not {not_before} to {not_after}"
    );
    let [low, high] = table.code.to_le_bytes();
    let own_register = 1 | 1 << table.register_bit;
    assert_eq!(bytes[..2], [low, high], "{name}");
    assert_eq!(
        bytes[2] & own_register,
        own_register,
        "{name}: {bytes:02X?}"
    );
    assert_eq!(bytes[3..], [0; 5], "{name}");
    // The objects; a warning of an event may be over before they can be read.
    if !(row.is_event && table.kind == Kind::Warning) {
        master.run_ms(3);
        let register = master.read(1, 0x1001, 0) & i32::from(own_register);
        assert_eq!(register, i32::from(own_register), "{name}");
        assert!(status_has(&mut master, table), "{name}: 0x1002");
    }
    let history: Vec<i32> = (1..=master.read(1, 0x1003, 0))
        .map(|sub| master.read(1, 0x1003, sub as u8) & 0xFFFF)
        .collect();
    assert!(
        history.contains(&i32::from(table.code)),
        "{name}: {history:04X?}"
    );
    // The state machine, latching and the end.
    match table.kind {
        Kind::Fault | Kind::Critical => prove_fault(&mut master, row, table, &name),
        Kind::Warning => prove_warning(&mut master, row, table, &name),
    }
    prove_disabled(personality, row, table, &name);
}

/// "To disable a warning/fault, set its value to zero" (P3, important notes).
fn prove_disabled(personality: &'static Personality, row: &Row, table: &FaultRow, name: &str) {
    let objects = match table.switch {
        Switch::Always | Switch::Off => return,
        Switch::Object(object) => vec![object],
        Switch::Either(one, other) => vec![one, other],
    };
    let mut master = one(personality);
    (row.prepare)(&mut master);
    for object in objects {
        let (index, sub) = address(personality, object.field);
        let size = usize::from(object.field.size());
        master.write(1, index, sub, &[0; 4][..size]);
    }
    // Also for the errors of a start.
    master.write(1, 0x1010, 1, &SAVE);
    master.run_ms(20);
    master.log.clear();
    (row.provoke)(&mut master);
    master.run_ms((2.0 * row.within_ms.1).ceil() as u64);
    let came = emergencies(&master, table.code);
    assert!(came.is_empty(), "{name}: disabled, and yet {came:02X?}");
}

/// Index and sub-index of a place in the image.
fn address(personality: &Personality, field: canopen::Field) -> (u16, u8) {
    let place = |index, sub| match personality.name {
        "p3" => personalities::p3::OBJECTS.field(index, sub),
        _ => personalities::p3_extended::OBJECTS.field(index, sub),
    };
    let rows = personality.device.table.rows().iter();
    let mut addresses = rows.map(|row| (row.address.index, row.address.sub));
    let found = addresses.find(|(index, sub)| place(*index, *sub) == Some(field));
    found.unwrap_or_else(|| panic!("no row of {field:?}"))
}

fn prove_fault(master: &mut Master, row: &Row, table: &FaultRow, name: &str) {
    // The extended drive brakes first (0x605E), where it can.
    for _ in 0..50 {
        if master.state(1) == FAULT_REACTION_ACTIVE {
            master.run_ms(10);
        }
    }
    assert_eq!(master.state(1), FAULT, "{name}");
    assert_eq!(master.read(1, 0x603F, 0), i32::from(table.code), "{name}");
    let current = master.read_i16(1, 0x6078, 0);
    assert!(current.abs() <= 25, "{name}: {current} mA in fault");
    if !row.is_event {
        // A reset does not help while the cause is there.
        master.log.clear();
        reset(master);
        master.write_u16(1, 0x6040, 0, 0x0F);
        master.run_ms(row.within_ms.1.ceil() as u64 + 20);
        assert_eq!(ends(master, table.code).len(), 1, "{name}: reset");
        // Those that are looked for in operation enabled alone need a mode, where it comes again.
        if emergencies(master, table.code).is_empty() {
            (row.provoke)(master);
            master.run_ms(row.within_ms.1.ceil() as u64 + 20);
        }
    }
    (row.cease)(master);
    master.run_ms(250);
    if !row.is_event {
        assert_eq!(master.state(1), FAULT, "{name}: latched");
        assert_eq!(emergencies(master, table.code).len(), 1, "{name}: again");
    }
    master.log.clear();
    reset(master);
    master.run_ms(10);
    assert_eq!(
        ends(master, table.code).len(),
        1,
        "{name}: the message of its end"
    );
    assert_eq!(
        master.state(1),
        READY_TO_SWITCH_ON,
        "{name}: after the reset"
    );
    assert_eq!(master.read(1, 0x1001, 0), 0, "{name}");
    assert_eq!(master.read(1, 0x1002, 0), 0, "{name}");
    let shown = master.read(1, 0x603F, 0);
    let keeps = master.drive(1).personality().errors.keeps_last_code;
    assert_eq!(
        shown,
        if keeps { i32::from(table.code) } else { 0 },
        "{name}"
    );
    master.run_ms(600);
    assert_eq!(master.state(1), READY_TO_SWITCH_ON, "{name}: it stays away");
}

fn prove_warning(master: &mut Master, row: &Row, table: &FaultRow, name: &str) {
    if row.is_event {
        // It is over with the event, or soon after.
        master.run_ms(200);
        assert_eq!(ends(master, table.code).len(), 1, "{name}: its end");
        return;
    }
    assert!(ends(master, table.code).is_empty(), "{name}: ended already");
    assert_ne!(master.state(1), FAULT, "{name}");
    assert_ne!(master.status(1) & 0x80, 0, "{name}: statusword bit 7");
    (row.cease)(master);
    master.run_ms(600);
    assert_eq!(
        ends(master, table.code).len(),
        1,
        "{name}: it ends by itself"
    );
    assert_eq!(master.status(1) & 0x80, 0, "{name}");
    assert!(
        !status_has(master, table) || table.status_bit > 31,
        "{name}"
    );
}

/// Whether the row's bit of 0x1002 is set; true for a row that has none.
fn status_has(master: &mut Master, table: &FaultRow) -> bool {
    let status = master.read(1, 0x1002, 0) as u32;
    match 1_u32.checked_shl(table.status_bit.into()) {
        Some(bit) => status & bit != 0,
        None => true,
    }
}

/// Fault reset and shutdown: the edge of bit 7, then 0x06.
fn reset(master: &mut Master) {
    master.write_u16(1, 0x6040, 0, 0);
    master.write_u16(1, 0x6040, 0, 0x80);
    master.write_u16(1, 0x6040, 0, 0x06);
}

/// Into operation enabled with a mode, for either drive.
fn enable(master: &mut Master, mode: u8) {
    master.write_u16(1, 0x6040, 0, 0x86);
    master.write_u16(1, 0x6040, 0, 0x06);
    master.write_u16(1, 0x6040, 0, 0x0F);
    assert_eq!(master.state(1), OPERATION_ENABLED);
    master.write(1, 0x6060, 0, &[mode]);
}

/// Leaves everything as it is.
fn nothing(_: &mut Master) {}

/// Whether the rows of a table have proofs: all but those that are switched off for good, which must
/// be few and known.
#[test]
fn every_row_of_both_tables_is_proved() {
    for personality in [&P3, &P3_EXTENDED] {
        for row in personality.faults {
            let proofs = rows().filter(|proof| proof.cause == row.cause).count();
            let expected = usize::from(!matches!(row.switch, Switch::Off));
            assert!(
                proofs >= expected,
                "{}: {:?} has no proof",
                personality.name,
                row.cause
            );
        }
    }
    for row in rows() {
        assert_eq!(
            rows().filter(|other| other.cause == row.cause).count(),
            1,
            "{:?}",
            row.cause
        );
    }
}

fn prove_all(personality: &'static Personality, rows: &[Row]) {
    for row in rows {
        match table_row(personality, row.cause) {
            Some(table) if !matches!(table.switch, Switch::Off) => prove(personality, row),
            _ => {}
        }
    }
}
