//! SYNC, consumed and produced, its counter and its window (CiA 301 7.2.5, 7.5.2.5 to 7.5.2.7,
//! 7.5.2.22).

use canopen::{CommunicationErrors, News};

use crate::harness::devices::BASIC;
use crate::harness::stand::{BIT_29, BIT_30, OFF, Stand, WIDE, frame};

use super::identifiers::is_restricted;

const INVALID: u32 = 0x0609_0030;
const U8: u32 = 0x2000_0108;
const LENGTH: CommunicationErrors = CommunicationErrors::SYNC_LENGTH;
const WINDOW: CommunicationErrors = CommunicationErrors::SYNC_WINDOW;
const NOTHING: CommunicationErrors = CommunicationErrors::NOTHING;

/// Whether the last call obeyed a SYNC.
fn obeyed(stand: &Stand) -> bool {
    stand.log.last().is_some_and(|events| events.sync)
}

/// An operational node that produces SYNC every `period_us`, with a counter up to `overflow`.
fn producing(period_us: u32, overflow: u32) -> Stand {
    let mut stand = Stand::operational();
    stand.must(0x1019, 0, overflow);
    stand.must(0x1006, 0, period_us);
    stand.must(0x1005, 0, 0x80 | BIT_30);
    stand
}

pub(crate) fn default_identifier() {
    let mut stand = Stand::new();
    assert_eq!(stand.read(0x1005, 0), Ok(0x80));
    stand.sync();
    assert!(obeyed(&stand));
}

pub(crate) fn data_frame() {
    let mut stand = Stand::new();
    for key in [0x81, 0x80 | WIDE] {
        stand.send(key, &[]);
        assert!(!obeyed(&stand));
    }
    for key in [0x80, 0x80 | WIDE] {
        stand.request(key, 0);
        assert!(!obeyed(&stand));
    }
}

pub(crate) fn moved() {
    let mut stand = Stand::new();
    for id in 0..0x800 {
        let before = stand.read(0x1005, 0).expect("a COB-ID");
        let expected = if is_restricted(id) {
            Err(INVALID)
        } else {
            Ok(())
        };
        assert_eq!(stand.write(0x1005, 0, id), expected, "{id:03X}");
        let now = if expected.is_ok() { id } else { before };
        stand.send(now, &[]);
        assert!(obeyed(&stand), "holds at once");
    }
}

pub(crate) fn wide_identifier() {
    for id in [0, 0x80, 0x1FFF_FFFF] {
        let mut stand = Stand::operational();
        stand.must(0x1005, 0, id | BIT_29);
        stand.send(0x80, &[]);
        assert!(!obeyed(&stand));
        stand.send(id | WIDE, &[]);
        assert!(obeyed(&stand));
        stand.must(0x1006, 0, 1000);
        stand.must(0x1005, 0, id | BIT_29 | BIT_30);
        assert_eq!(stand.wait_ms(1), [(1000, id | WIDE, vec![])]);
    }
    let mut stand = Stand::new();
    for bit in 11..=28 {
        assert_eq!(stand.write(0x1005, 0, 0x80 | 1 << bit), Err(INVALID));
    }
}

pub(crate) fn bit_31() {
    let mut stand = Stand::new();
    assert_eq!(stand.write(0x1005, 0, 0x81 | OFF), Ok(()));
    stand.send(0x81, &[]);
    assert!(obeyed(&stand));
    stand.must(0x1006, 0, 1000);
    assert_eq!(stand.write(0x1005, 0, 0x81 | OFF | BIT_30), Ok(()));
    assert_eq!(stand.wait_ms(1).len(), 1);
}

pub(crate) fn no_producer() {
    let mut stand = Stand::unstarted(&BASIC);
    stand.start();
    assert_eq!(stand.write(0x1005, 0, 0x80 | BIT_30), Err(INVALID));
    assert_eq!(stand.write(0x1005, 0, 0x80 | BIT_29), Err(INVALID));
    assert_eq!(stand.read(0x1005, 0), Ok(0x80));
}

pub(crate) fn period() {
    for us in [100u32, 1_000, 33_333, 4_000_000_000] {
        let mut stand = producing(us, 0);
        let us = u64::from(us);
        let expected: Vec<_> = (1..=3).map(|n| (n * us, 0x80, vec![])).collect();
        assert_eq!(stand.wait_us(3 * us), expected);
    }
}

pub(crate) fn producer_needs_both() {
    let mut stand = Stand::new();
    stand.must(0x1006, 0, 1000);
    assert_eq!(stand.wait_ms(10), [], "no producer");
    stand.must(0x1005, 0, 0x80 | BIT_30);
    assert_eq!(stand.wait_ms(1).len(), 1);
    stand.must(0x1006, 0, 0);
    assert_eq!(stand.wait_ms(10), [], "no period");
    stand.must(0x1006, 0, 2000);
    assert_eq!(stand.wait_ms(2), [(2000, 0x80, vec![])]);
    stand.must(0x1005, 0, 0x80);
    assert_eq!(stand.wait_ms(10), [], "no producer any more");
}

pub(crate) fn fixed_while_producing() {
    let mut stand = producing(0, 0);
    assert_eq!(stand.write(0x1005, 0, 0x81 | BIT_30), Err(INVALID));
    assert_eq!(stand.write(0x1005, 0, 0x80 | BIT_29 | BIT_30), Err(INVALID));
    assert_eq!(stand.write(0x1005, 0, 0x80 | BIT_30), Ok(()), "no change");
    assert_eq!(stand.write(0x1005, 0, 0x80), Ok(()));
    assert_eq!(stand.write(0x1005, 0, 0x81), Ok(()));
    assert_eq!(stand.write(0x1005, 0, 0x81 | BIT_30), Ok(()));
}

pub(crate) fn counter() {
    for overflow in [2u8, 3, 240] {
        let mut stand = producing(1000, overflow.into());
        let sent = stand.wait_ms(2 * u64::from(overflow) + 1);
        let expected: Vec<_> = (1..=overflow)
            .chain(1..=overflow)
            .chain([1])
            .map(|counter| vec![counter])
            .collect();
        assert_eq!(
            sent.into_iter().map(|frame| frame.2).collect::<Vec<_>>(),
            expected
        );
    }
}

fn counters(stand: &mut Stand, ms: u64) -> Vec<u8> {
    stand
        .wait_ms(ms)
        .into_iter()
        .map(|(_, _, data)| data[0])
        .collect()
}

pub(crate) fn counter_after_stopped() {
    for command in [0x01, 0x80] {
        let mut stand = producing(1000, 10);
        assert_eq!(counters(&mut stand, 4), [1, 2, 3, 4]);
        stand.nmt(0x02);
        assert_eq!(stand.wait_ms(5), []);
        stand.nmt(command);
        assert_eq!(counters(&mut stand, 3), [1, 2, 3]);
    }
}

pub(crate) fn counter_goes_on() {
    let mut stand = producing(1000, 10);
    assert_eq!(counters(&mut stand, 2), [1, 2]);
    stand.nmt(0x80);
    assert_eq!(counters(&mut stand, 2), [3, 4]);
    stand.nmt(0x01);
    assert_eq!(counters(&mut stand, 2), [5, 6]);
    stand.must(0x1006, 0, 500);
    assert_eq!(counters(&mut stand, 1), [7, 8], "with another period, too");
    stand.must(0x1007, 0, 100);
    assert_eq!(counters(&mut stand, 1), [9, 10]);
}

pub(crate) fn counter_of_a_new_producer() {
    for (index, off, on) in [(0x1005, 0x80, 0x80 | BIT_30), (0x1006, 0, 1000)] {
        let mut stand = producing(1000, 10);
        assert_eq!(counters(&mut stand, 2), [1, 2]);
        stand.must(index, 0, off);
        stand.must(index, 0, on);
        assert_eq!(counters(&mut stand, 2), [1, 2]);
    }
}

pub(crate) fn overflow_values() {
    let mut stand = Stand::new();
    for overflow in 0..=255 {
        let expected = if matches!(overflow, 0 | 2..=240) {
            Ok(())
        } else {
            Err(INVALID)
        };
        assert_eq!(stand.write(0x1019, 0, overflow), expected, "{overflow}");
    }
}

pub(crate) fn overflow_needs_no_period() {
    let mut stand = Stand::new();
    stand.must(0x1006, 0, 1);
    for overflow in [0, 1, 2, 240, 255] {
        assert_eq!(stand.write(0x1019, 0, overflow), Err(0x0800_0022));
    }
    stand.must(0x1006, 0, 0);
    assert_eq!(stand.write(0x1019, 0, 240), Ok(()));
}

pub(crate) fn length() {
    for (overflow, good) in [(0, 0usize), (2, 1), (240, 1)] {
        let mut stand = Stand::operational();
        stand.must(0x1019, 0, overflow);
        stand.map(0x1800, 0x185, 1, &[U8]);
        for length in 0..=8 {
            stand.fresh().send(0x80, &[1; 8][..good]);
            assert_eq!(stand.node.errors(), NOTHING);
            let sent = stand.fresh().send(0x80, &[1; 8][..length]);
            assert_eq!(
                (obeyed(&stand), sent.len() == 1),
                (length == good, length == good)
            );
            let expected = if length == good { NOTHING } else { LENGTH };
            assert_eq!(
                stand.node.errors(),
                expected,
                "{length} bytes, 0x1019 = {overflow}"
            );
            assert_eq!(stand.told(News::ERRORS), length != good);
        }
    }
}

pub(crate) fn obeys_its_own() {
    let mut stand = producing(1000, 0);
    stand.map(0x1400, 0x205, 1, &[U8]);
    stand.map(0x1800, 0x185, 1, &[U8]);
    stand.map(0x1801, 0x285, 2, &[U8]);
    stand.send(0x205, &[7]);
    let first = [(1000, 0x80, vec![]), (1000, 0x185, vec![7])];
    assert_eq!(stand.fresh().wait_ms(1), first, "SYNC, then its PDOs");
    assert!(stand.log.iter().any(|events| events.sync));
    assert_eq!(stand.wait_ms(1).len(), 3);
}

pub(crate) fn start_value_of_its_own() {
    let mut stand = Stand::operational();
    stand.must(0x1019, 0, 10);
    stand.map_off(0x1800, 1, &[U8]);
    stand.must(0x1800, 6, 3);
    stand.must(0x1800, 1, 0x185);
    stand.must(0x1006, 0, 1000);
    stand.must(0x1005, 0, 0x80 | BIT_30);
    let keys: Vec<u32> = stand.wait_ms(4).iter().map(|sent| sent.1).collect();
    assert_eq!(keys, [0x80, 0x80, 0x80, 0x185, 0x80, 0x185]);
}

pub(crate) fn no_burst() {
    let mut stand = producing(1000, 10);
    stand.now = stand.now.plus_us(10_500);
    stand.node.poll(stand.now, &mut stand.host);
    assert_eq!(
        stand.drain(),
        [(0x80, vec![1])],
        "one for all that were missed"
    );
    assert_eq!(stand.wait_us(1000), [(1000, 0x80, vec![2])]);
    // Late by less than a period: the next is in time.
    stand.now = stand.now.plus_us(1_300);
    stand.node.poll(stand.now, &mut stand.host);
    assert_eq!(stand.drain(), [(0x80, vec![3])]);
    assert_eq!(stand.wait_us(700), [(700, 0x80, vec![4])]);
}

/// An operational node with a window of 500 µs, a synchronous TPDO 0x185 and an event-driven 0x285.
fn windowed() -> Stand {
    let mut stand = Stand::operational();
    stand.map(0x1800, 0x185, 1, &[U8]);
    stand.map(0x1801, 0x285, 255, &[0x2000_0210]);
    stand.map(0x1400, 0x205, 1, &[U8]);
    stand.map(0x1401, 0x305, 255, &[0x2000_0408]);
    stand.must(0x1007, 0, 500);
    stand.detect();
    stand
}

/// Polls `us` later without taking what waits.
fn poll_after(stand: &mut Stand, us: u64) {
    stand.now = stand.now.plus_us(us);
    let events = stand.node.poll(stand.now, &mut stand.host);
    stand.log.push(events);
}

pub(crate) fn window_of_transmission() {
    let mut stand = windowed();
    stand.give(&frame(0x80, &[]));
    poll_after(&mut stand, 500);
    assert_eq!(stand.drain(), [(0x185, vec![0])], "within the window");
    stand.set(0x2000, 2, 1);
    stand.give(&frame(0x80, &[]));
    stand.node.detect_events(stand.now, &mut stand.host);
    stand.fresh();
    poll_after(&mut stand, 501);
    assert_eq!(
        stand.drain(),
        [(0x285, vec![1, 0])],
        "the synchronous one is late"
    );
    assert_eq!(stand.node.errors(), WINDOW);
    assert!(stand.told(News::ERRORS));
}

pub(crate) fn window_of_reception() {
    let mut stand = windowed();
    stand.sync();
    stand.wait_us(500);
    stand.send(0x205, &[1]);
    stand.send(0x305, &[1]);
    stand.sync();
    assert_eq!(
        (stand.get(0x2000, 1), stand.get(0x2000, 4)),
        (1, 1),
        "within the window"
    );
    stand.wait_us(501);
    stand.send(0x205, &[2]);
    stand.send(0x305, &[2]);
    assert_eq!(stand.get(0x2000, 4), 2, "event-driven ones know no window");
    stand.sync();
    assert_eq!(stand.get(0x2000, 1), 1, "too late");
    stand.send(0x205, &[3]);
    stand.sync();
    assert_eq!(stand.get(0x2000, 1), 3, "the next SYNC opens it anew");
    // Writing the parameters anew opens no window that has closed, and closes none that is open.
    for (index, value) in [(0x1005, 0x80), (0x1006, 0), (0x1007, 500), (0x1019, 0)] {
        stand.sync();
        let closes = stand.now.plus_us(500).plus_ns(1);
        stand.must(index, 0, value);
        assert_eq!(stand.node.next_deadline(), closes, "0x{index:04X}");
        stand.send(0x205, &[4]);
        stand.sync();
        assert_eq!(stand.get(0x2000, 1), 4, "0x{index:04X}");
        stand.wait_us(501);
        stand.must(index, 0, value);
        stand.send(0x205, &[5]);
        stand.sync();
        assert_eq!(stand.get(0x2000, 1), 4, "0x{index:04X}: too late");
    }
    // One of another length begins with the next SYNC: the present one stays closed, or open as
    // long as it was to be.
    for (old, new, value) in [(500, 400, 5), (400, 500, 6)] {
        stand.wait_us(501);
        stand.must(0x1007, 0, new);
        stand.send(0x205, &[9]);
        stand.sync();
        let kept = u64::from(value) - 1;
        assert_eq!(stand.get(0x2000, 1), kept, "{old} to {new} µs: too late");
        let closes = stand.now.plus_us(u64::from(new)).plus_ns(1);
        stand.must(0x1007, 0, old);
        assert_eq!(stand.node.next_deadline(), closes);
        stand.send(0x205, &[value]);
        stand.sync();
        assert_eq!(stand.get(0x2000, 1), u64::from(value));
        stand.must(0x1007, 0, new);
        stand.sync();
    }
    // None at all ends it, and the next begins with a SYNC.
    stand.wait_us(501);
    stand.must(0x1007, 0, 0);
    stand.must(0x1007, 0, 400);
    stand.send(0x205, &[7]);
    stand.sync();
    assert_eq!(stand.get(0x2000, 1), 7);
    stand.wait_us(401);
    stand.send(0x205, &[8]);
    stand.sync();
    assert_eq!(stand.get(0x2000, 1), 7, "too late");
}

pub(crate) fn window_error_ends() {
    for end in [
        (|stand: &mut Stand| {
            stand.sync();
            stand.wait_ms(1);
        }) as fn(&mut Stand),
        |stand| stand.must(0x1007, 0, 0),
    ] {
        let mut stand = windowed();
        stand.give(&frame(0x80, &[]));
        poll_after(&mut stand, 501);
        assert_eq!(stand.node.errors(), WINDOW);
        end(&mut stand);
        assert_eq!(stand.node.errors(), NOTHING);
    }
}

pub(crate) fn no_window() {
    let mut stand = windowed();
    stand.must(0x1007, 0, 0);
    stand.give(&frame(0x80, &[]));
    poll_after(&mut stand, 1_000_000);
    assert_eq!(stand.drain(), [(0x185, vec![0])]);
    stand.send(0x205, &[1]);
    stand.sync();
    assert_eq!((stand.get(0x2000, 1), stand.node.errors()), (1, NOTHING));
}
