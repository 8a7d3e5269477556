//! What the controller refuses, and that nothing changes by it.

use personalities::roboteq::{ROBOTEQ, ROBOTEQ_3};

use crate::bench::{Channel, controller, with_machine};

/// An object, what is written to it, and how that is refused (CiA 301).
type Row = (u16, u8, &'static [u8], u32);

const READ_ONLY: u32 = 0x0601_0002;
const TOO_LONG: u32 = 0x0607_0012;
const TOO_SHORT: u32 = 0x0607_0013;
const NO_SUB: u32 = 0x0609_0011;
const NO_OBJECT: u32 = 0x0602_0000;
const TOO_HIGH: u32 = 0x0609_0031;
const INVALID: u32 = 0x0609_0030;

const ROWS: &[Row] = &[
    (0x6040, 0, &[6], TOO_SHORT),
    (0x6040, 0, &[6, 0, 0, 0], TOO_LONG),
    (0x6042, 0, &[1, 0, 0, 0], TOO_LONG),
    (0x6046, 1, &[1, 0], TOO_SHORT),
    (0x6046, 0, &[1], READ_ONLY),
    (0x6046, 3, &[1, 0, 0, 0], NO_SUB),
    (0x6048, 2, &[1, 0, 0, 0], TOO_LONG),
    (0x6049, 1, &[1], TOO_SHORT),
    (0x6060, 0, &[1, 0], TOO_LONG),
    (0x6060, 0, &[5], INVALID),
    (0x6071, 0, &[1], TOO_SHORT),
    (0x607A, 0, &[1, 0], TOO_SHORT),
    (0x60FF, 0, &[1, 0], TOO_SHORT),
    (0x6041, 0, &[0, 0], READ_ONLY),
    (0x6043, 0, &[0, 0], READ_ONLY),
    (0x6044, 0, &[0, 0], READ_ONLY),
    (0x6061, 0, &[1], READ_ONLY),
    (0x6064, 0, &[0; 4], READ_ONLY),
    (0x606C, 0, &[0; 4], READ_ONLY),
    (0x6077, 0, &[0, 0], READ_ONLY),
    (0x6502, 0, &[0; 4], READ_ONLY),
    (0x67FE, 0, &[0; 4], READ_ONLY),
    (0x6045, 0, &[0, 0], NO_OBJECT),
    (0x605A, 0, &[0, 0], NO_OBJECT),
    (0x6098, 0, &[0], NO_OBJECT),
];

#[test]
fn every_channel_refuses_what_its_rows_do_not_allow() {
    let mut master = with_machine(&ROBOTEQ_3);
    for channel in 0..3_u16 {
        for (index, sub, data, abort) in ROWS {
            let index = index + 0x800 * channel;
            // Sub-index 0 of several has no row of its own.
            let is_there = ROBOTEQ_3.device.table.find(index, *sub).is_ok();
            let before = is_there.then(|| master.try_read(1, index, *sub));
            let result = master.try_write(1, index, *sub, data);
            assert_eq!(result, Err(*abort), "{index:04X},{sub}");
            let after = is_there.then(|| master.try_read(1, index, *sub));
            assert_eq!(after, before);
        }
    }
    // A window beyond the last.
    assert_eq!(master.try_write(1, 0x7840, 0, &[6, 0]), Err(NO_OBJECT));
    // Of what is configured, the ranges.
    for (index, sub, data, abort) in [
        (0x3027, 1, [7, 0, 0, 0].as_slice(), TOO_HIGH),
        (0x30F1, 0, &[2], TOO_HIGH),
        (0x3033, 3, &500_001_u32.to_le_bytes(), TOO_HIGH),
        (0x3033, 4, &[0; 4], NO_SUB),
        (0x2000, 1, &1001_i32.to_le_bytes(), TOO_HIGH),
        (0x200E, 0, &[4], INVALID),
    ] {
        let size = if matches!(index, 0x3027 | 0x30F1 | 0x200E) {
            1
        } else {
            4
        };
        let result = master.try_write(1, index, sub, &data[..size]);
        assert_eq!(result, Err(abort), "{index:04X},{sub}");
    }
    // What is only written cannot be read; a store needs its signature.
    assert_eq!(master.try_read(1, 0x2000, 1), Err(0x0601_0001));
    assert_eq!(master.try_write(1, 0x1010, 1, b"SAVE"), Err(0x0800_0020));
    assert_eq!(master.try_write(1, 0x1011, 1, b"save"), Err(0x0800_0020));
}

#[test]
fn bit_30_stays_set_in_every_tpdo() {
    let mut master = controller(&ROBOTEQ);
    for n in 0..4_u16 {
        let index = 0x1800 + n;
        let own = 0x4000_0181 + 0x100 * u32::from(n);
        assert_eq!(master.read(1, index, 1) as u32, own);
        for without in [own & !0x4000_0000, own & !0x4000_0000 | 0x8000_0000, 0] {
            let result = master.try_write(1, index, 1, &without.to_le_bytes());
            assert_eq!(result, Err(INVALID));
        }
        master.write(1, index, 1, &(own | 0x8000_0000).to_le_bytes());
        master.write(1, index, 1, &own.to_le_bytes());
    }
}

/// ^MMOD names the controller's modes, 0x6060 those of table 1.
#[test]
fn every_mode_at_the_start_is_one_of_table_1() {
    for (start, mode) in [(0, 0), (1, 3), (2, -1), (3, 1), (4, -2), (5, 4), (6, -3)] {
        let mut master = controller(&ROBOTEQ);
        master.write(1, 0x3027, 1, &[start]);
        assert_eq!(
            master.read(1, 0x6061, 0) as i8,
            0,
            "not before the next start"
        );
        master.write(1, 0x2017, 0, &[1]);
        master.run_ms(500);
        master.send(0, &[0x81, 1]);
        master.run_ms(200);
        assert_eq!(master.read(1, 0x6060, 0) as i8, mode);
        assert_eq!(master.read(1, 0x6061, 0) as i8, mode);
        // It rests until it is commanded.
        assert!(master.rpm(1).abs() < 1.0);
    }
}
