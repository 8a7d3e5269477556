//! SYNC start value of a transmit PDO (CiA 301 7.5.2.37).

use crate::harness::stand::{OFF, Stand};

use super::transmit::{one, with};

const U8: u32 = 0x2000_0108;
const INVALID: u32 = 0x0609_0030;

/// SYNCs with counters 1 to 10, round and round; those that are answered.
fn answered(stand: &mut Stand, first: u8, count: usize) -> Vec<u8> {
    let counters = (0..).map(|n| (first - 1 + n) % 10 + 1);
    counters
        .take(count)
        .filter(|counter| !stand.send(0x80, &[*counter]).is_empty())
        .collect()
}

fn counted(transmission_type: u8, start: u32) -> Stand {
    let mut stand = Stand::new();
    stand.must(0x1019, 0, 10);
    stand.map_off(0x1800, transmission_type, &[U8]);
    stand.must(0x1800, 6, start);
    stand.must(0x1800, 1, 0x185);
    stand.nmt(0x01);
    stand
}

pub(crate) fn sync_start() {
    for (transmission_type, start, first, expected) in [
        (1, 0, 7, &[7, 8, 9, 10, 1, 2][..]),
        (1, 4, 1, &[4, 5, 6]),
        (1, 4, 4, &[4, 5, 6, 7, 8, 9]),
        (1, 4, 5, &[]),
        (2, 4, 1, &[5]),
        // The SYNC with the start value is the first of three.
        (3, 4, 1, &[6]),
        (3, 0, 1, &[3, 6]),
    ] {
        let mut stand = counted(transmission_type, start);
        assert_eq!(
            answered(&mut stand, first, 6),
            expected,
            "{transmission_type} {start} {first}"
        );
    }
    let mut stand = counted(1, 4);
    assert_eq!(
        answered(&mut stand, 5, 15),
        [4, 5, 6, 7, 8, 9],
        "waits for as long as it takes"
    );
}

pub(crate) fn sync_start_without_counter() {
    let mut stand = with(1, 0, 0, 4);
    for _ in 0..3 {
        assert_eq!(stand.sync(), one(0));
    }
    // A PDO that waits is released when the counter is given up.
    let mut stand = counted(1, 4);
    assert_eq!(answered(&mut stand, 1, 2), []);
    stand.must(0x1019, 0, 0);
    assert_eq!(stand.sync(), one(0));
    // And waits when there is one.
    let mut stand = with(1, 0, 0, 4);
    stand.must(0x1019, 0, 10);
    assert_eq!(answered(&mut stand, 1, 5), [4, 5]);
}

pub(crate) fn sync_start_in_each_operational() {
    let mut stand = counted(1, 4);
    assert_eq!(answered(&mut stand, 1, 5), [4, 5]);
    stand.nmt(0x80);
    stand.nmt(0x01);
    assert_eq!(answered(&mut stand, 6, 10), [4, 5]);
}

pub(crate) fn sync_start_is_fixed() {
    let mut stand = with(1, 0, 0, 4);
    assert_eq!(stand.write(0x1800, 6, 5), Err(INVALID));
    assert_eq!(stand.write(0x1800, 6, 4), Ok(()), "no change");
    stand.must(0x1800, 1, 0x185 | OFF);
    for start in 0..=255 {
        let expected = if start <= 240 { Ok(()) } else { Err(INVALID) };
        assert_eq!(stand.write(0x1800, 6, start), expected);
    }
}
