//! Writes that are taken, and those that are refused.

use crate::bench::*;

#[test]
fn writes_that_are_padded_with_zeros_are_taken() {
    let mut master = quiet();
    // M19: four bytes for a UINT16, once with the size bits of four, once without.
    for command in [0x23, 0x22] {
        master.log.clear();
        master.send(0x605, &[command, 0x40, 0x60, 0, 6, 0, 0, 0]);
        master.run_ms(5);
        let last = master.log.last().expect("an answer").frame.data().to_vec();
        assert_eq!(last[0], 0x60, "{command:02X}");
    }
    assert_eq!(master.state(NODE), READY_TO_SWITCH_ON);
    master.log.clear();
    master.send(0x605, &[0x23, 0x40, 0x60, 0, 6, 0, 1, 0]);
    master.run_ms(5);
    let last = master.log.last().expect("an answer").frame.data().to_vec();
    assert_eq!(last[..4], [0x80, 0x40, 0x60, 0]);
    assert_eq!(last[4..], 0x0607_0012_u32.to_le_bytes());
}

#[test]
fn reals_and_strings_keep_to_their_ranges() {
    let mut master = quiet();
    for (sub, value, code) in [
        (3, 1e-9_f32, 0x0609_0032),
        (3, 0.2, 0x0609_0031),
        (4, f32::NAN, 0x0609_0030),
        (4, 21.0, 0x0609_0031),
        (8, 0.0, 0x0609_0032),
    ] {
        let result = master.try_write(NODE, 0x2000, sub, &value.to_le_bytes());
        assert_eq!(result, Err(code), "{sub} {value}");
    }
    for (sub, value) in [(1, 1_u32), (1, 256), (10, 0), (10, 32)] {
        let result = master.try_write(NODE, 0x2000, sub, &value.to_le_bytes());
        assert!(result.is_err(), "{sub} {value}");
    }
    assert!((real(&mut master, 0x2000, 8) - 0.111_11).abs() < 1e-7);
    // A name of six characters comes in segments.
    master.log.clear();
    master.send(0x605, &[0x40, 0x00, 0x20, 6, 0, 0, 0, 0]);
    master.run_ms(5);
    assert_eq!(master.log.last().expect("it").frame.data()[0] & 0xE2, 0x40);
    master.send(0x605, &[0x60, 0, 0, 0, 0, 0, 0, 0]);
    master.run_ms(5);
    assert_eq!(
        &master.log.last().expect("it").frame.data()[1..7],
        b"AK80_9"
    );
}
