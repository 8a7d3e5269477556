//! What a transmit PDO is sent by, and when (CiA 301 7.2.2, 7.5.2.37).

use crate::harness::stand::{BIT_30, OFF, Stand, WIDE};

const U8: u32 = 0x2000_0108;
const U16: u32 = 0x2000_0210;
const U32: u32 = 0x2000_0320;
const I64: u32 = 0x2000_0940;
const INVALID: u32 = 0x0609_0030;

/// An operational node whose first TPDO, 0x185, has a type, inhibit time, event timer and SYNC
/// start value, and carries 0x2000,1.
pub(crate) fn with(transmission_type: u8, inhibit: u32, timer_ms: u32, start: u32) -> Stand {
    let mut stand = Stand::new();
    stand.map_off(0x1800, transmission_type, &[U8]);
    stand.must(0x1800, 3, inhibit);
    stand.must(0x1800, 5, timer_ms);
    stand.must(0x1800, 6, start);
    stand.must(0x1800, 1, 0x185);
    stand.nmt(0x01);
    stand
}

fn typed(transmission_type: u8) -> Stand {
    with(transmission_type, 0, 0, 0)
}

/// The frame with 0x2000,1.
pub(crate) fn one(value: u8) -> Vec<(u32, Vec<u8>)> {
    vec![(0x185, vec![value])]
}

/// Everything that can make a PDO be sent, in one go.
fn provoke(stand: &mut Stand) -> usize {
    let value = stand.get(0x2000, 1) ^ 1;
    stand.set(0x2000, 1, value);
    stand.detect().len()
        + stand.trigger(0).len()
        + stand.sync().len()
        + stand.request(0x185, 1).len()
        + stand.wait_ms(20).len()
}

pub(crate) fn operational_only() {
    for transmission_type in [0, 1, 240, 252, 253, 254, 255] {
        let mut stand = Stand::new();
        stand.map_off(0x1800, transmission_type, &[U8]);
        stand.must(0x1800, 5, 3);
        stand.must(0x1800, 1, 0x185);
        assert_eq!(provoke(&mut stand), 0, "pre-operational");
        stand.nmt(0x02);
        assert_eq!(provoke(&mut stand), 0, "stopped");
        stand.nmt(0x01);
        let sent: usize = (0..240).map(|_| provoke(&mut stand)).sum();
        assert!(sent > 0, "type {transmission_type} in operational");
        stand.nmt(0x80);
        assert_eq!(provoke(&mut stand), 0, "pre-operational again");
    }
}

pub(crate) fn acyclic() {
    let mut stand = typed(0);
    assert_eq!(stand.detect(), [], "an event waits for its SYNC");
    assert_eq!(stand.sync(), one(0));
    for _ in 0..500 {
        assert_eq!(stand.detect(), []);
        assert_eq!(stand.sync(), []);
    }
    stand.set(0x2000, 1, 7);
    assert_eq!(stand.detect(), []);
    assert_eq!(stand.wait_ms(1000), []);
    assert_eq!(stand.sync(), one(7));
    assert_eq!(stand.sync(), []);
    assert_eq!(stand.trigger(0), [], "the application's own event");
    assert_eq!(stand.trigger(0), []);
    assert_eq!(stand.sync(), one(7));
    assert_eq!(stand.sync(), [], "two events before a SYNC are one frame");
}

pub(crate) fn acyclic_value_of_the_sync() {
    let mut stand = typed(0);
    stand.trigger(0);
    stand.set(0x2000, 1, 9);
    assert_eq!(stand.sync(), one(9));
}

pub(crate) fn cyclic() {
    for every in 1..=240u32 {
        let mut stand = typed(every as u8);
        for n in 1..=3 * every {
            let expected = if n % every == 0 { one(0) } else { vec![] };
            assert_eq!(stand.sync(), expected, "SYNC {n} of type {every}");
        }
    }
}

pub(crate) fn cyclic_is_sampled_with_sync() {
    let mut stand = typed(2);
    stand.set(0x2000, 1, 1);
    assert_eq!(stand.sync(), []);
    stand.set(0x2000, 1, 2);
    stand.give(&crate::harness::stand::frame(0x80, &[]));
    stand.set(0x2000, 1, 3);
    assert_eq!(stand.drain(), one(2));
}

pub(crate) fn cyclic_has_no_events() {
    let mut stand = with(2, 0, 5, 0);
    stand.set(0x2000, 1, 1);
    assert_eq!(stand.detect(), []);
    assert_eq!(stand.trigger(0), []);
    assert_eq!(stand.wait_ms(100), []);
    assert_eq!(stand.sync(), []);
    assert_eq!(stand.sync(), one(1));
}

pub(crate) fn synchronous_request() {
    let mut stand = typed(252);
    assert_eq!(stand.request(0x185, 1), [], "nothing was sampled yet");
    stand.set(0x2000, 1, 1);
    assert_eq!(stand.sync(), []);
    stand.set(0x2000, 1, 2);
    assert_eq!(stand.request(0x185, 1), one(1));
    assert_eq!(stand.request(0x185, 1), one(1), "again the same sample");
    assert_eq!(stand.sync(), []);
    assert_eq!(stand.request(0x185, 1), one(2));
    assert_eq!(stand.detect(), []);
    assert_eq!(stand.trigger(0), []);
}

pub(crate) fn event_request() {
    let mut stand = with(253, 0, 5, 0);
    for value in [0, 4, 4, 9] {
        stand.set(0x2000, 1, value);
        assert_eq!(stand.detect(), []);
        assert_eq!(stand.trigger(0), []);
        assert_eq!(stand.sync(), []);
        assert_eq!(stand.wait_ms(10), []);
        assert_eq!(stand.request(0x185, 1), one(value as u8));
    }
}

pub(crate) fn change_is_an_event() {
    for transmission_type in [254, 255] {
        let mut stand = typed(transmission_type);
        assert_eq!(stand.detect(), one(0), "values that were never sent");
        for value in 1..=255 {
            stand.set(0x2000, 1, value);
            assert_eq!(stand.detect(), one(value as u8));
            assert_eq!(stand.detect(), []);
            assert_eq!(stand.sync(), []);
        }
        stand.set(0x2000, 2, 1);
        assert_eq!(stand.detect(), [], "0x2000,2 is not mapped");
        // A write by SDO is a change like any other.
        stand.must(0x2000, 1, 0x55);
        assert_eq!(stand.detect(), one(0x55));
    }
}

pub(crate) fn change_of_any_bit() {
    let mut stand = Stand::operational();
    let switches: Vec<u32> = (1..=64).map(|sub| 0x2030_0001 | sub << 8).collect();
    stand.map(0x1800, 0x185, 255, &switches);
    stand.map(0x1801, 0x285, 254, &[I64]);
    stand.detect();
    let mut data = 0u64;
    for bit in 0..64u8 {
        data ^= 1 << bit;
        stand.set(0x2030, bit + 1, 1);
        assert_eq!(stand.detect(), [(0x185, data.to_le_bytes().to_vec())]);
        stand.set(0x2000, 9, data);
        assert_eq!(stand.detect(), [(0x285, data.to_le_bytes().to_vec())]);
    }
}

pub(crate) fn application_event() {
    let mut stand = typed(254);
    stand.detect();
    assert_eq!(stand.trigger(0), one(0), "without a change");
    assert_eq!(stand.trigger(0), one(0));
    assert_eq!(stand.trigger(1), [], "an empty PDO");
    assert_eq!(stand.trigger(4), [], "a PDO that the device has not");
}

pub(crate) fn inhibit_time() {
    for inhibit in [1u32, 25, 65_535] {
        let inhibit_us = 100 * u64::from(inhibit);
        let mut stand = with(255, inhibit, 0, 0);
        assert_eq!(stand.detect(), one(0), "the first waits for nothing");
        // All that comes within the time makes one frame at its end, with the last value.
        for value in [1, 2, 3] {
            assert_eq!(stand.wait_us(inhibit_us / 4), []);
            stand.set(0x2000, 1, value);
            assert_eq!(stand.detect(), []);
        }
        let left = inhibit_us - 3 * (inhibit_us / 4);
        assert_eq!(stand.wait_us(left - 1), []);
        assert_eq!(stand.wait_us(1), [(1, 0x185, vec![3])]);
        assert_eq!(stand.wait_us(10 * inhibit_us), [], "and no more than one");
        stand.set(0x2000, 1, 9);
        assert_eq!(stand.detect(), one(9), "after a pause at once");
    }
}

pub(crate) fn inhibit_time_of_requests() {
    let mut stand = with(254, 10, 0, 0);
    stand.detect();
    assert_eq!(stand.request(0x185, 1), []);
    assert_eq!(stand.wait_us(2000), [(1000, 0x185, vec![0])]);
    // Types that only requests send have none.
    let mut stand = with(253, 10, 0, 0);
    assert_eq!(stand.request(0x185, 1), one(0));
    assert_eq!(stand.request(0x185, 1), one(0));
}

pub(crate) fn inhibit_time_of_cyclic() {
    let mut stand = with(1, 60_000, 0, 0);
    for _ in 0..3 {
        assert_eq!(stand.sync(), one(0));
    }
}

pub(crate) fn inhibit_time_survives_a_type() {
    let mut stand = with(255, 100, 0, 0);
    stand.detect();
    stand.must(0x1800, 2, 254);
    stand.set(0x2000, 1, 1);
    assert_eq!(stand.detect(), []);
    assert_eq!(stand.wait_ms(20), [(10_000, 0x185, vec![1])]);
}

pub(crate) fn inhibit_time_of_what_is_sent() {
    for act in [
        (|stand: &mut Stand| {
            stand.give(&crate::harness::stand::frame(0, &[0x80, 5]));
            stand.give(&crate::harness::stand::frame(0, &[0x01, 5]));
        }) as fn(&mut Stand),
        |stand| stand.must(0x1800, 2, 254),
    ] {
        let mut stand = with(255, 100, 0, 0);
        stand.node.trigger(0, stand.now, &mut stand.host);
        act(&mut stand);
        assert_eq!(stand.drain(), []);
        assert_eq!(stand.trigger(0), one(0));
    }
}

pub(crate) fn inhibit_time_is_fixed() {
    let mut stand = with(255, 10, 0, 0);
    assert_eq!(stand.write(0x1800, 3, 11), Err(INVALID));
    assert_eq!(stand.write(0x1800, 3, 0), Err(INVALID));
    assert_eq!(stand.write(0x1800, 3, 10), Ok(()), "no change");
    assert_eq!(stand.read(0x1800, 3), Ok(10));
    stand.must(0x1800, 1, 0x185 | OFF);
    assert_eq!(stand.write(0x1800, 3, 11), Ok(()));
}

pub(crate) fn event_timer() {
    for ms in [1u32, 7, 65_535] {
        for transmission_type in [254, 255] {
            let us = 1000 * u64::from(ms);
            let mut stand = with(transmission_type, 0, ms, 0);
            let expected: Vec<_> = (1..=3).map(|n| (n * us, 0x185, vec![0])).collect();
            assert_eq!(stand.wait_us(3 * us), expected);
        }
    }
}

pub(crate) fn event_timer_starts_anew() {
    let mut stand = with(255, 0, 10, 0);
    assert_eq!(stand.wait_ms(4), []);
    assert_eq!(stand.trigger(0), one(0));
    assert_eq!(stand.wait_ms(9), []);
    assert_eq!(stand.request(0x185, 1), one(0));
    let sent = stand.wait_ms(25);
    assert_eq!(sent, [(10_000, 0x185, vec![0]), (20_000, 0x185, vec![0])]);
}

pub(crate) fn event_timer_off() {
    for timer in [0, 5] {
        for transmission_type in [0, 1, 252, 253, 254] {
            let mut stand = with(transmission_type, 0, timer, 0);
            let frames = stand.wait_ms(50).len();
            let expected = if timer == 5 && transmission_type == 254 {
                10
            } else {
                0
            };
            assert_eq!(frames, expected, "{timer} ms, type {transmission_type}");
        }
    }
    // It may be changed while the PDO exists, and holds at once.
    let mut stand = with(255, 0, 0, 0);
    stand.must(0x1800, 5, 20);
    assert_eq!(stand.wait_ms(30), [(20_000, 0x185, vec![0])]);
    stand.must(0x1800, 5, 0);
    assert_eq!(stand.wait_ms(1000), []);
}

pub(crate) fn event_timer_begins_with_operational() {
    let mut stand = with(255, 0, 10, 0);
    assert_eq!(stand.wait_ms(6), []);
    stand.nmt(0x80);
    assert_eq!(stand.wait_ms(100), []);
    stand.nmt(0x01);
    assert_eq!(stand.wait_ms(10), [(10_000, 0x185, vec![0])]);
}

pub(crate) fn event_timer_and_inhibit_time() {
    let mut stand = with(255, 50, 2, 0);
    let times: Vec<u64> = stand.wait_ms(20).iter().map(|sent| sent.0).collect();
    assert_eq!(times, [2000, 7000, 12_000, 17_000]);
}

pub(crate) fn request_allowed() {
    for transmission_type in [252, 253, 254, 255] {
        let mut stand = typed(transmission_type);
        stand.sync();
        stand.detect();
        assert_eq!(stand.request(0x185, 1), one(0), "bit 30 clear");
        stand.must(0x1800, 1, 0x185 | BIT_30);
        stand.sync();
        stand.detect();
        assert_eq!(stand.request(0x185, 1), [], "bit 30 set");
        stand.must(0x1800, 1, 0x185);
        stand.sync();
        stand.detect();
        assert_eq!(stand.request(0x185, 1), one(0), "bit 30 clear again");
    }
}

pub(crate) fn request_of_synchronous() {
    for transmission_type in [0, 1, 2, 240] {
        let mut stand = typed(transmission_type);
        stand.sync();
        assert_eq!(stand.request(0x185, 1), []);
    }
}

pub(crate) fn request_by_identifier() {
    let mut stand = typed(253);
    for length in 0..=8 {
        assert_eq!(stand.request(0x185, length), one(0));
    }
    assert_eq!(stand.request(0x185 | WIDE, 1), []);
    assert_eq!(stand.request(0x186, 1), []);
    stand.must(0x1800, 1, 0x185 | OFF);
    assert_eq!(stand.request(0x185, 1), []);
    stand.must(0x1800, 1, 0x2123_4567);
    assert_eq!(
        stand.request(0x0123_4567 | WIDE, 1),
        [(0x0123_4567 | WIDE, vec![0])]
    );
    assert_eq!(stand.request(0x567, 1), []);
}

pub(crate) fn empty_mapping() {
    for transmission_type in [0, 1, 252, 253, 254, 255] {
        let mut stand = Stand::operational();
        stand.must(0x1800, 5, 5);
        stand.map(0x1800, 0x185, transmission_type, &[]);
        assert_eq!(provoke(&mut stand), 0);
    }
}

pub(crate) fn length_is_the_mapping() {
    let switches: Vec<u32> = (1..=63).map(|sub| 0x2030_0001 | sub << 8).collect();
    for bits in 1..=63 {
        let mut stand = Stand::operational();
        stand.map(0x1800, 0x185, 1, &switches[..bits]);
        let sent = stand.sync();
        assert_eq!(sent, [(0x185, vec![0; bits.div_ceil(8)])]);
    }
    let mut stand = Stand::operational();
    stand.map(0x1800, 0x185, 1, &[U16, U32, U8]);
    assert_eq!(stand.sync(), [(0x185, vec![0; 7])]);
}

pub(crate) fn wide_identifiers() {
    for id in [0, 0x185, 0x7FF, 0x800, 0x1FFF_FFFF] {
        let mut stand = Stand::operational();
        stand.map(0x1800, id | 0x2000_0000, 1, &[U8]);
        assert_eq!(stand.sync(), [(id | WIDE, vec![0])]);
    }
}

pub(crate) fn withdrawn() {
    for command in [0x80, 0x02] {
        let mut stand = typed(1);
        stand.give(&crate::harness::stand::frame(0x80, &[]));
        stand.give(&crate::harness::stand::frame(0, &[command, 5]));
        assert_eq!(stand.drain(), []);
    }
}

pub(crate) fn counts_from_operational() {
    let mut stand = typed(3);
    stand.sync();
    stand.sync();
    stand.nmt(0x80);
    stand.sync();
    stand.nmt(0x01);
    assert_eq!(stand.sync(), []);
    assert_eq!(stand.sync(), []);
    assert_eq!(stand.sync(), one(0));
}

pub(crate) fn one_moment() {
    let mut stand = Stand::operational();
    for n in 0..4 {
        stand.map(
            0x1800 + n,
            0x185 + 0x100 * u32::from(n),
            1,
            &[0x2008_0020, 0x2009_0020],
        );
    }
    stand.host.position = 0x0102_0304;
    let data = vec![4, 3, 2, 1, 0xFC, 0xFC, 0xFD, 0xFE];
    let expected: Vec<_> = (1..=4).map(|n| (0x100 * n + 0x85, data.clone())).collect();
    assert_eq!(stand.sync(), expected);
    assert_eq!(stand.host.publications, 1);
}
