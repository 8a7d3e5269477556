//! The bus: SYNC, lost frames, bus-off, and what CiA 301 watches.

use sim::{Participant, Place, WireAct};

use super::*;

/// The longest of frames, which nobody answers: two of them take 270 µs.
fn noise(master: &mut Master, frames: usize) {
    for _ in 0..frames {
        master.send(0x010, &[0x55; 8]);
    }
}

/// Nodes 1 and 9 answer SYNC with one identifier and different data.
fn quarrel(master: &mut Master, on: u8) {
    master.write(1, 0x2405, 0, &[on]);
    for node in [1, 9] {
        master.write(node, 0x1800, 1, &[0x90, 0x01, 0, 0x80]);
        master.write(node, 0x1A00, 0, &[0]);
        master.write(node, 0x1A00, 1, &[0x20, 0x00, 0x64, 0x60]);
        master.write(node, 0x1A00, 0, &[1]);
        master.write(node, 0x1800, 2, &[1]);
        master.write(node, 0x1800, 1, &[0x90, 0x01, 0, 0]);
        // Node 1 sends a recessive bit where node 9 sends a dominant one: it is node 1 that errs.
        master.write_i32(node, 0x6064, 0, 10 - i32::from(node));
    }
    master.send(0, &[1, 0]);
    master.run_ms(2);
}

pub(super) const ROWS: &[Row] = &[
    Row {
        cause: Cause::SyncLoss,
        how: "no SYNC comes any more",
        prepare: |master| {
            master.send(0x80, &[]);
            master.write_u16(1, 0x2406, 0, 100);
        },
        // 20 ms of the time have passed already.
        provoke: nothing,
        cease: |master| master.write_u16(1, 0x2406, 0, 0),
        within_ms: (77.0, 83.0),
        is_event: false,
    },
    Row {
        cause: Cause::CanOverrun,
        how: "the processor is busy for 6 ms while 30 frames come in",
        prepare: |master| master.write(1, 0x2404, 0, &[1]),
        provoke: |master| {
            let until = master.now().plus_ms(6);
            master.drive(1).stall_until(until);
            noise(master, 30);
        },
        cease: nothing,
        within_ms: (2.0, 9.0),
        is_event: true,
    },
    Row {
        cause: Cause::BusOffRecovered,
        how: "two drives answer each SYNC with one identifier and different data, until one is bus-off",
        prepare: |master| quarrel(master, 1),
        provoke: |master| {
            // A long frame behind each SYNC, at whose end both answers begin in the same bit. The
            // first takes both to error passive, the others node 1 alone to bus-off.
            for _ in 0..25 {
                master.send(0x80, &[]);
                noise(master, 1);
                master.run_ms(2);
            }
        },
        cease: nothing,
        // Then 128 times 11 recessive bits.
        within_ms: (36.0, 60.0),
        is_event: true,
    },
    // What follows the faithful P3 does not watch.
    Row {
        cause: Cause::HeartbeatLost,
        how: "the node that is watched stops its heartbeat",
        prepare: |master| {
            // Node 9 within 50 ms; it beats.
            master.write_u16(9, 0x1017, 0, 20);
            master.write_i32(1, 0x1016, 1, 0x0009_0032);
            // It stays as it is.
            master.write(1, 0x1029, 1, &[1]);
            master.run_ms(100);
        },
        provoke: |master| master.write_u16(9, 0x1017, 0, 0),
        cease: |master| master.write_u16(9, 0x1017, 0, 20),
        within_ms: (30.0, 55.0),
        is_event: false,
    },
    Row {
        cause: Cause::ErrorPassive,
        how: "the drive is cut off the bus for 30 ms: nobody acknowledges its heartbeats",
        prepare: |master| master.write_u16(1, 0x1017, 0, 10),
        provoke: |master| {
            let drive = Participant::Drive(Place::of_node(id(1)));
            master.bus.act(WireAct::Disconnect(drive)).unwrap();
            master.run_ms(30);
            master.bus.act(WireAct::Connect(drive)).unwrap();
        },
        cease: nothing,
        // It can tell when it is heard again.
        within_ms: (30.0, 35.0),
        is_event: true,
    },
    Row {
        cause: Cause::PdoTooShort,
        how: "an RPDO with one byte comes where two are mapped",
        prepare: listen,
        provoke: |master| master.send(0x201, &[0x06]),
        // A right one ends it.
        cease: |master| master.send(0x201, &[0x06, 0]),
        within_ms: (0.0, 3.0),
        is_event: false,
    },
    Row {
        cause: Cause::PdoTooLong,
        how: "an RPDO with four bytes comes where two are mapped",
        prepare: listen,
        provoke: |master| master.send(0x201, &[0x06, 0, 0, 0]),
        // A right one ends it.
        cease: |master| master.send(0x201, &[0x06, 0]),
        within_ms: (0.0, 3.0),
        is_event: false,
    },
    Row {
        cause: Cause::SyncLength,
        how: "a SYNC without a counter comes where one is expected",
        prepare: |master| master.write(1, 0x1019, 0, &[10]),
        // A SYNC with a counter is expected.
        provoke: |master| master.send(0x80, &[]),
        cease: |master| master.send(0x80, &[1]),
        within_ms: (0.0, 3.0),
        is_event: false,
    },
    Row {
        cause: Cause::RpdoTimeout,
        how: "an RPDO does not come again within its 40 ms",
        prepare: |master| {
            listen(master);
            master.write_u16(1, 0x1400, 5, 40);
            // The time runs from the first reception.
            master.send(0x201, &[0x06, 0]);
        },
        provoke: nothing,
        cease: |master| {
            master.send(0x201, &[0x06, 0]);
            master.run_ms(3);
            master.write_u16(1, 0x1400, 5, 0);
        },
        // 20 ms of them have passed.
        within_ms: (17.0, 23.0),
        is_event: false,
    },
];

/// Node 1 is operational and takes its controlword by RPDO1.
fn listen(master: &mut Master) {
    master.write_i32(1, 0x1400, 1, 0x8000_0201_u32 as i32);
    master.write(1, 0x1600, 0, &[0]);
    master.write_i32(1, 0x1600, 1, 0x6040_0010);
    master.write(1, 0x1600, 0, &[1]);
    master.write(1, 0x1400, 2, &[255]);
    master.write_i32(1, 0x1400, 1, 0x201);
    master.send(0, &[1, 1]);
    master.run_ms(2);
}

#[test]
fn p3() {
    prove_all(&P3, ROWS);
}

#[test]
fn p3_extended() {
    prove_all(&P3_EXTENDED, ROWS);
}
