//! Emergencies, produced and consumed, and the error history (CiA 301 7.2.7, 7.5.2.2, 7.5.2.4,
//! 7.5.2.17, 7.5.2.18, 7.5.2.31).

use canopen::{Emergency, News, NodeId};

use crate::harness::FULL;
use crate::harness::stand::{BIT_29, BIT_30, OFF, Stand, WIDE};

use super::identifiers::is_restricted;

const INVALID: u32 = 0x0609_0030;
const NO_DATA: u32 = 0x0800_0024;

fn emergency(code: u16, register: u8) -> (u32, Vec<u8>) {
    let [low, high] = code.to_le_bytes();
    (0x85, vec![low, high, register, 0, 0, 0, 0, 0])
}

pub(crate) fn contents() {
    let mut stand = Stand::operational();
    stand
        .node
        .announce(0x8611, 0x21, [1, 2, 3, 4, 5], stand.now);
    assert_eq!(
        stand.drain(),
        [(0x85, vec![0x11, 0x86, 0x21, 1, 2, 3, 4, 5])]
    );
    assert_eq!(stand.drain(), [], "once");
    assert_eq!(stand.wait_ms(100_000), []);
}

pub(crate) fn error_reset() {
    let mut stand = Stand::operational();
    stand.announce(0x1000, 0x01);
    assert_eq!(stand.announce(0x0000, 0x00), [emergency(0, 0)]);
    assert_eq!(stand.read(0x1001, 0), Ok(0));
    assert_eq!(stand.read(0x1003, 0), Ok(1), "it is no error");
}

pub(crate) fn register() {
    let mut stand = Stand::operational();
    assert_eq!(stand.read(0x1001, 0), Ok(0));
    for register in [0x01, 0x05, 0x81, 0x00] {
        assert_eq!(
            stand.announce(0x1000, register),
            [emergency(0x1000, register)]
        );
        assert_eq!(stand.read(0x1001, 0), Ok(register.into()));
    }
    assert!(stand.write(0x1001, 0, 0).is_err());
}

pub(crate) fn history() {
    let mut stand = Stand::operational();
    for n in 1..=12u16 {
        stand.announce(0x1000 + n, 1);
        assert_eq!(stand.read(0x1003, 0), Ok(u32::from(n.min(8))));
        for sub in 1..=8 {
            let expected = match n.checked_sub(sub - 1) {
                Some(nth @ 1..) => Ok(0x1000 + u32::from(nth)),
                _ => Err(NO_DATA),
            };
            assert_eq!(stand.read(0x1003, sub as u8), expected, "{n} errors, {sub}");
        }
    }
}

pub(crate) fn history_cleared() {
    let mut stand = Stand::operational();
    for code in 1..=3 {
        stand.announce(code, 1);
    }
    for value in 1..=255 {
        assert_eq!(stand.write(0x1003, 0, value), Err(INVALID));
    }
    assert_eq!(stand.read(0x1003, 0), Ok(3));
    stand.must(0x1003, 0, 0);
    assert_eq!(stand.read(0x1003, 0), Ok(0));
    assert_eq!(stand.read(0x1003, 1), Err(NO_DATA));
    assert_eq!(
        stand.read(0x1001, 0),
        Ok(1),
        "the errors themselves are still there"
    );
    stand.announce(0x4000, 1);
    assert_eq!(
        (stand.read(0x1003, 0), stand.read(0x1003, 1)),
        (Ok(1), Ok(0x4000))
    );
    assert_eq!(stand.read(0x1003, 2), Err(NO_DATA));
}

pub(crate) fn history_is_read_only() {
    let mut stand = Stand::operational();
    stand.announce(0x1000, 1);
    for sub in 1..=8 {
        assert_eq!(stand.write(0x1003, sub, 0), Err(0x0601_0002));
    }
    assert_eq!(stand.read(0x1003, 9), Err(0x0609_0011));
}

pub(crate) fn history_survives_communication() {
    let mut stand = Stand::operational();
    stand.announce(0x1000, 1);
    let id = stand.node.id();
    stand.node.restart_communication(&[], id);
    assert_eq!(stand.start(), [(0x705, vec![0])]);
    assert_eq!(
        (stand.read(0x1003, 1), stand.read(0x1001, 0)),
        (Ok(0x1000), Ok(1))
    );
}

pub(crate) fn default_identifier() {
    let mut stand = Stand::new();
    assert_eq!(stand.read(0x1014, 0), Ok(0x85));
}

pub(crate) fn identifiers() {
    let mut stand = Stand::operational();
    for id in 0..0x800 {
        stand.must(0x1014, 0, OFF);
        let expected = if is_restricted(id) {
            Err(INVALID)
        } else {
            Ok(())
        };
        assert_eq!(stand.write(0x1014, 0, id), expected, "{id:03X}");
        let sent = if expected.is_ok() {
            vec![(id, emergency(1, 1).1)]
        } else {
            vec![]
        };
        assert_eq!(stand.announce(1, 1), sent);
    }
    for bit in 11..=28 {
        stand.must(0x1014, 0, OFF);
        assert_eq!(stand.write(0x1014, 0, 0x85 | 1 << bit), Err(INVALID));
    }
    for id in [0, 0x85, 0x1FFF_FFFF] {
        stand.must(0x1014, 0, OFF);
        stand.must(0x1014, 0, id | BIT_29);
        assert_eq!(stand.announce(1, 1), [(id | WIDE, emergency(1, 1).1)]);
    }
}

pub(crate) fn fixed_while_valid() {
    let mut stand = Stand::operational();
    assert_eq!(stand.write(0x1014, 0, 0x86), Err(INVALID));
    assert_eq!(stand.write(0x1014, 0, 0x85 | BIT_29), Err(INVALID));
    assert_eq!(stand.write(0x1014, 0, 0x85), Ok(()), "no change");
    for off in [0, OFF] {
        stand.must(0x1014, 0, 0x85 | off);
        assert_eq!(
            stand.write(0x1014, 0, 0x85 | BIT_30),
            Err(INVALID),
            "bit 30 is reserved"
        );
    }
    assert_eq!(stand.write(0x1014, 0, 0x86), Ok(()));
}

pub(crate) fn off() {
    let mut stand = Stand::operational();
    stand.must(0x1014, 0, 0x85 | OFF);
    assert_eq!(stand.announce(0x1000, 3), []);
    assert_eq!(
        (stand.read(0x1001, 0), stand.read(0x1003, 1)),
        (Ok(3), Ok(0x1000))
    );
    stand.must(0x1014, 0, 0x85);
    assert_eq!(stand.drain(), [], "what was not sent is not sent later");
    assert_eq!(stand.announce(0x2000, 3), [emergency(0x2000, 3)]);
}

pub(crate) fn inhibit_time() {
    for inhibit in [1u32, 30, 65_535] {
        let us = 100 * u64::from(inhibit);
        let mut stand = Stand::operational();
        stand.must(0x1015, 0, inhibit);
        let expected: Vec<_> = (1..4u16)
            .map(|n| (u64::from(n) * us, 0x85, emergency(0x1000 + n, 1).1))
            .collect();
        assert_eq!(
            stand.announce(0x1000, 1),
            [emergency(0x1000, 1)],
            "the first at once"
        );
        for n in 1..4 {
            assert_eq!(stand.announce(0x1000 + n, 1), []);
        }
        assert_eq!(
            stand.wait_us(3 * us - 1),
            expected[..2],
            "one by one, in their order"
        );
        assert_eq!(stand.wait_us(1).len(), 1);
        assert_eq!(stand.wait_us(us - 1), []);
        assert_eq!(stand.announce(0x2000, 1), []);
        assert_eq!(stand.wait_us(1), [(1, 0x85, emergency(0x2000, 1).1)]);
        assert_eq!(stand.wait_us(10 * us), []);
        assert_eq!(stand.announce(0x3000, 1).len(), 1, "after a pause at once");
        stand.must(0x1014, 0, 0x85 | OFF);
        stand.must(0x1014, 0, 0x85);
        assert_eq!(stand.announce(0x4000, 1), [], "off and on ends no time");
        assert_eq!(stand.wait_us(us), [(us, 0x85, emergency(0x4000, 1).1)]);
    }
}

pub(crate) fn no_inhibit_time() {
    let mut stand = Stand::operational();
    for n in 1..=5 {
        stand.node.announce(0x1000 + n, 1, [0; 5], stand.now);
    }
    let expected: Vec<_> = (1..=5).map(|n| emergency(0x1000 + n, 1)).collect();
    assert_eq!(stand.drain(), expected);
}

pub(crate) fn inhibit_time_of_a_busy_bus() {
    // The first is not fetched before its time has passed: the others follow all the same.
    let mut stand = Stand::operational();
    stand.must(0x1015, 0, 10);
    for n in 1..=3 {
        stand.node.announce(0x1000 + n, 1, [0; 5], stand.now);
    }
    for _ in 0..5 {
        stand.now = stand.now.plus_us(700);
        stand.node.poll(stand.now, &mut stand.host);
    }
    assert_eq!(stand.drain(), [emergency(0x1001, 1)]);
    let codes: Vec<u8> = stand.wait_ms(10).iter().map(|sent| sent.2[0]).collect();
    assert_eq!(codes, [2, 3]);
    // The time lies between the frames as they leave, however long each waits for the bus.
    for busy_us in [0, 100, 900, 1000, 1100, 2500] {
        for slot_us in [100, 300, 700, 900, 1000, 1500] {
            let first = u64::next_multiple_of(busy_us, slot_us);
            let second = (first + 1000).next_multiple_of(slot_us);
            let third = (second + 1000).next_multiple_of(slot_us);
            assert_eq!(
                leave(busy_us, slot_us),
                [(first, 1), (second, 2), (third, 3)],
                "busy for {busy_us} µs, then free each {slot_us} µs"
            );
        }
    }
}

/// When three emergencies leave that were announced at once, with an inhibit time of 1 ms: on a bus
/// that takes no frame before `busy_us`, then one at each multiple of `slot_us`. Microseconds, and
/// the low bytes of the codes. The node is called at its deadlines only.
fn leave(busy_us: u64, slot_us: u64) -> Vec<(u64, u8)> {
    let mut stand = Stand::operational();
    stand.must(0x1015, 0, 10);
    let start = stand.now;
    for n in 1..=3 {
        stand.node.announce(0x1000 + n, 1, [0; 5], stand.now);
    }
    let mut left = Vec::new();
    for us in (0..10_000).step_by(100) {
        stand.now = start.plus_us(us);
        poll_if_due(&mut stand);
        if us >= busy_us
            && us.is_multiple_of(slot_us)
            && let Some(frame) = stand.node.transmit(&mut stand.host)
        {
            left.push((us, frame.bytes()[0]));
            poll_if_due(&mut stand);
        }
    }
    left
}

fn poll_if_due(stand: &mut Stand) {
    if stand.node.next_deadline() <= stand.now {
        stand.node.poll(stand.now, &mut stand.host);
        assert!(stand.node.next_deadline() > stand.now);
    }
}

pub(crate) fn stopped() {
    for (inhibit, gap) in [(0, 0), (10, 1000)] {
        let mut stand = Stand::operational();
        stand.must(0x1015, 0, inhibit);
        stand.nmt(0x02);
        for n in 1..=3 {
            assert_eq!(stand.announce(0x1000 + n, 1), []);
        }
        assert_eq!(stand.wait_ms(100), []);
        let mut times: Vec<(u64, u8)> = stand
            .send(0, &[0x80, 5])
            .into_iter()
            .map(|(_, data)| (0, data[0]))
            .collect();
        times.extend(
            stand
                .wait_ms(10)
                .into_iter()
                .map(|sent| (sent.0, sent.2[0])),
        );
        assert_eq!(times, [(0, 1), (gap, 2), (2 * gap, 3)]);
    }
}

pub(crate) fn before_boot_up() {
    let mut stand = Stand::unstarted(&FULL);
    assert_eq!(stand.announce(0x1000, 1), []);
    assert_eq!(stand.start(), [(0x705, vec![0])]);
    assert_eq!(stand.read(0x1003, 1), Ok(0x1000));
}

pub(crate) fn consumed() {
    let mut stand = Stand::operational();
    stand.must(0x1028, 7, 0x87);
    stand.must(0x1028, 2, 0xFF);
    for (key, node) in [(0x87, 7), (0xFF, 2)] {
        stand.fresh().send(key, &[0x11, 0x86, 0x21, 1, 2, 3, 4, 5]);
        assert!(stand.told(News::EMERGENCY));
        let emergency = Emergency {
            code: 0x8611,
            register: 0x21,
            vendor: [1, 2, 3, 4, 5],
        };
        let node = NodeId::new(node).expect("a node ID");
        assert_eq!(stand.node.received_emergency(), Some((node, emergency)));
    }
}

pub(crate) fn not_consumed() {
    let mut stand = Stand::operational();
    assert_eq!(stand.read(0x1028, 7), Ok(0x8000_0000));
    stand.send(0x87, &[1; 8]);
    stand.must(0x1028, 7, 0x87);
    for length in 0..8 {
        stand.send(0x87, &[1; 8][..length]);
    }
    stand.send(0x88, &[1; 8]);
    stand.send(0x87 | WIDE, &[1; 8]);
    stand.request(0x87, 8);
    stand.must(0x1028, 7, 0x87 | OFF);
    stand.send(0x87, &[1; 8]);
    assert_eq!(stand.node.received_emergency(), None);
}

pub(crate) fn consumers_identifiers() {
    let mut stand = Stand::operational();
    for id in 0..0x800 {
        stand.must(0x1028, 3, OFF);
        let expected = if is_restricted(id) {
            Err(INVALID)
        } else {
            Ok(())
        };
        assert_eq!(stand.write(0x1028, 3, id), expected, "{id:03X}");
    }
    stand.must(0x1028, 3, OFF);
    stand.must(0x1028, 3, 0x83);
    assert_eq!(
        stand.write(0x1028, 3, 0x84),
        Err(INVALID),
        "fixed while it exists"
    );
    assert_eq!(
        stand.write(0x1028, 3, 0x83 | BIT_30),
        Err(INVALID),
        "bit 30 is reserved"
    );
    stand.must(0x1028, 3, OFF);
    stand.must(0x1028, 3, 0x83 | BIT_29);
    stand.fresh().send(0x83 | WIDE, &[1; 8]);
    assert!(stand.told(News::EMERGENCY));
}
