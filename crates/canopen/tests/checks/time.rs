//! TIME, consumed and produced (CiA 301 7.2.6, 7.5.2.15).

use canopen::{News, TimeOfDay};

use crate::harness::stand::{BIT_29, BIT_30, OFF, Stand, WIDE};

use super::identifiers::is_restricted;

const INVALID: u32 = 0x0609_0030;
/// Bit 31 of 0x1012: consumes.
const CONSUMES: u32 = OFF;
/// Bit 30 of 0x1012: produces.
const PRODUCES: u32 = BIT_30;

fn with(cob_id: u32) -> Stand {
    let mut stand = Stand::operational();
    stand.must(0x1012, 0, cob_id);
    stand
}

pub(crate) fn default() {
    let mut stand = Stand::operational();
    assert_eq!(stand.read(0x1012, 0), Ok(0x100));
    stand.send(0x100, &[1, 0, 0, 0, 1, 0]);
    assert_eq!(stand.node.time_of_day(), None);
    assert!(!stand.node.send_time(TimeOfDay { ms: 1, days: 1 }));
    assert_eq!(stand.drain(), []);
}

pub(crate) fn consumed() {
    let mut stand = with(0x100 | CONSUMES);
    for (data, ms, days) in [
        ([0, 0, 0, 0, 0, 0], 0, 0),
        // A millisecond before midnight on the last day that there is.
        ([0xFF, 0x5B, 0x26, 0x05, 0xFF, 0xFF], 86_399_999, 65_535),
        ([0x78, 0x56, 0x34, 0x02, 0xBC, 0x9A], 0x0234_5678, 0x9ABC),
    ] {
        stand.now = stand.now.plus_ms(1);
        stand.fresh().send(0x100, &data);
        assert!(stand.told(News::TIME));
        assert_eq!(
            stand.node.time_of_day(),
            Some((TimeOfDay { ms, days }, stand.now))
        );
    }
}

pub(crate) fn reserved_bits() {
    let mut stand = with(0x100 | CONSUMES);
    stand.send(0x100, &[1, 0, 0, 0xF0, 2, 0]);
    let time = stand.node.time_of_day().map(|(time, _)| time);
    assert_eq!(time, Some(TimeOfDay { ms: 1, days: 2 }));
    assert_eq!(
        TimeOfDay {
            ms: u32::MAX,
            days: 2
        }
        .to_bytes(),
        [0xFF, 0xFF, 0xFF, 0x0F, 2, 0]
    );
}

pub(crate) fn six_bytes() {
    let mut stand = with(0x100 | CONSUMES);
    for length in [0, 1, 2, 3, 4, 5, 7, 8] {
        stand.fresh().send(0x100, &[1; 8][..length]);
        assert!(!stand.told(News::TIME));
        assert_eq!(stand.node.time_of_day(), None);
    }
    stand.request(0x100, 6);
    stand.send(0x100 | WIDE, &[1; 6]);
    assert_eq!(stand.node.time_of_day(), None);
}

pub(crate) fn produced() {
    let mut stand = with(0x100 | PRODUCES);
    assert!(stand.node.send_time(TimeOfDay {
        ms: 86_399_999,
        days: 0x1234
    }));
    assert_eq!(
        stand.drain(),
        [(0x100, vec![0xFF, 0x5B, 0x26, 0x05, 0x34, 0x12])]
    );
    assert_eq!(stand.drain(), [], "once");
    stand.send(0x100, &[1; 6]);
    assert_eq!(
        stand.node.time_of_day(),
        None,
        "a producer need not consume"
    );
}

pub(crate) fn not_produced() {
    let mut stand = with(0x100 | CONSUMES);
    assert!(!stand.node.send_time(TimeOfDay::default()));
    assert_eq!(stand.drain(), []);
}

pub(crate) fn fixed_while_on() {
    for on in [CONSUMES, PRODUCES, CONSUMES | PRODUCES] {
        let mut stand = with(0x100 | on);
        assert_eq!(stand.write(0x1012, 0, 0x0F0 | on), Err(INVALID));
        assert_eq!(stand.write(0x1012, 0, 0x100 | BIT_29 | on), Err(INVALID));
        assert_eq!(
            stand.write(0x1012, 0, 0x0F0 | CONSUMES | PRODUCES),
            Err(INVALID)
        );
        assert_eq!(stand.write(0x1012, 0, 0x100 | CONSUMES | PRODUCES), Ok(()));
        assert_eq!(stand.write(0x1012, 0, 0x100), Ok(()));
        assert_eq!(stand.write(0x1012, 0, 0x0F0 | on), Ok(()));
    }
}

pub(crate) fn identifiers() {
    let mut stand = Stand::operational();
    for id in 0..0x800 {
        let expected = if is_restricted(id) {
            Err(INVALID)
        } else {
            Ok(())
        };
        assert_eq!(stand.write(0x1012, 0, id), expected, "{id:03X}");
    }
    for bit in 11..=28 {
        assert_eq!(stand.write(0x1012, 0, 0x100 | 1 << bit), Err(INVALID));
    }
    for id in [0, 0x601, 0x1FFF_FFFF] {
        stand.must(0x1012, 0, 0x100);
        stand.must(0x1012, 0, id | BIT_29 | CONSUMES | PRODUCES);
        stand.fresh().send(id | WIDE, &[1; 6]);
        assert!(stand.told(News::TIME));
        assert!(stand.node.send_time(TimeOfDay::default()));
        assert_eq!(stand.drain(), [(id | WIDE, vec![0; 6])]);
    }
}
