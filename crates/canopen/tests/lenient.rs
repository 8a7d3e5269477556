//! Settings of `Dialect` that neither the standard nor the P3 uses.

mod harness;

use canopen::{Abort, NmtState};
use harness::{Bench, ID, LENIENT, STANDARD};

const fn entry(index: u32, sub: u32, bits: u32) -> [u8; 4] {
    (index << 16 | sub << 8 | bits).to_le_bytes()
}

/// Maps `entries` into the PDO whose parameters are at `index`.
fn map(bench: &mut Bench, index: u16, entries: &[[u8; 4]]) {
    bench.write(index + 0x200, 0, &[0]).expect("count 0");
    for (sub, entry) in (1..).zip(entries) {
        bench.write(index + 0x200, sub, entry).expect("an entry");
    }
    let count = u8::try_from(entries.len()).expect("a few");
    bench.write(index + 0x200, 0, &[count]).expect("the count");
}

/// No boot-up: a heartbeat that carries the state in which it is sent.
#[test]
fn the_first_frame_tells_the_state() {
    for (command, state) in [
        (0x01, NmtState::Operational),
        (0x80, NmtState::PreOperational),
        (0x02, NmtState::Stopped),
    ] {
        let mut bench = Bench::unstarted(&LENIENT);
        bench.node.start(bench.now);
        assert_eq!(
            bench.send(0, &[command, ID]),
            [(0x705, vec![state as u8])],
            "{state}"
        );
        assert_eq!(bench.node.state(), state);
        // Once.
        assert_eq!(bench.send(0, &[0x80, ID]), []);
    }
}

/// 0x1001 and the history are kept, 0x1014 is stored, nothing is sent.
#[test]
fn no_emergencies() {
    let mut bench = Bench::operational_without_boot_up(&LENIENT);
    bench.node.announce(0x4210, 0x09, [0; 5], bench.now);
    assert_eq!(bench.drain(), []);
    assert_eq!(bench.read(0x1001, 0), Ok(0x09));
    assert_eq!(bench.read(0x1003, 1), Ok(0x4210));
    bench
        .write(0x1014, 0, &0xA5u32.to_le_bytes())
        .expect("stored");
    bench.node.announce(0x0000, 0, [0; 5], bench.now);
    assert_eq!(bench.drain(), []);
    assert_eq!(bench.read(0x1014, 0), Ok(0xA5));
}

/// A received part is extended by the object's own sign; the parts lie one behind the other.
#[test]
fn received_parts() {
    // Object, bits, what is received, what the object is then.
    for (sub, bits, received, object) in [
        (6, 16, 0x1234u16, 0x0000_1234),
        (6, 16, 0xFFFE, 0xFFFF_FFFE),
        (6, 16, 0x8000, 0xFFFF_8000),
        (6, 8, 0x80, 0xFFFF_FF80),
        (6, 8, 0x7F, 0x0000_007F),
        (5, 8, 0xFF, 0xFFFF),
        (3, 16, 0xFFFE, 0x0000_FFFE),
        (2, 8, 0xFF, 0x00FF),
    ] {
        let mut bench = Bench::operational_without_boot_up(&LENIENT);
        let all: u8 = if matches!(sub, 3 | 6) { 4 } else { 2 };
        bench
            .write(0x2000, sub, &[0x55; 4][..usize::from(all)])
            .expect("another value");
        map(
            &mut bench,
            0x1400,
            &[entry(0x2000, u32::from(sub), bits), entry(0x2000, 1, 8)],
        );
        let mut data = received.to_le_bytes()[..bits as usize / 8].to_vec();
        data.push(0xA5);
        assert_eq!(bench.send(0x205, &data), []);
        assert_eq!(bench.read(0x2000, sub), Ok(object), "{sub} {bits}");
        assert_eq!(bench.read(0x2000, 1), Ok(0xA5));
        // A frame may be longer than the mapping (J5).
        data.extend([1, 2, 3]);
        bench.write(0x2000, 1, &[0]).expect("0");
        bench.send(0x205, &data);
        assert_eq!(bench.read(0x2000, 1), Ok(0xA5));
    }
}

/// Sent are the low bits, of live objects as well.
#[test]
fn sent_parts() {
    let mut bench = Bench::operational_without_boot_up(&LENIENT);
    bench.write(0x1800, 2, &[1]).expect("every SYNC");
    map(
        &mut bench,
        0x1800,
        &[
            entry(0x2008, 0, 16),
            entry(0x2000, 6, 8),
            entry(0x2000, 3, 32),
        ],
    );
    bench.owner.position = 0x1234_5678;
    bench
        .write(0x2000, 6, &(-2i32).to_le_bytes())
        .expect("a value");
    bench
        .write(0x2000, 3, &0xDDCC_BBAAu32.to_le_bytes())
        .expect("a value");
    assert_eq!(
        bench.sync(),
        [(0x185, vec![0x78, 0x56, 0xFE, 0xAA, 0xBB, 0xCC, 0xDD])]
    );
    // A new value is seen with the next SYNC.
    bench.owner.position = -3;
    assert_eq!(
        bench.sync(),
        [(0x185, vec![0xFD, 0xFF, 0xFE, 0xAA, 0xBB, 0xCC, 0xDD])]
    );
}

/// Parts are 8 or 16 bits, and less than the object; without the setting there are none.
#[test]
fn what_is_a_part() {
    let refused = Err(Abort::NOT_MAPPABLE.0);
    for (sub, bits, lenient) in [
        (6, 16, Ok(())),
        (6, 8, Ok(())),
        (5, 8, Ok(())),
        (6, 32, Ok(())),
        (6, 24, refused),
        (6, 1, refused),
        (6, 0, refused),
        (5, 32, refused),
        (1, 16, refused),
        (1, 4, refused),
    ] {
        for index in [0x1600, 0x1A00] {
            let value = entry(0x2000, sub, bits);
            let mut bench = Bench::operational_without_boot_up(&LENIENT);
            bench.write(index, 0, &[0]).expect("count 0");
            assert_eq!(bench.write(index, 1, &value), lenient, "{sub} {bits}");
            let mut bench = Bench::new(&STANDARD);
            bench
                .write(index - 0x200, 1, &0x8000_0000u32.to_le_bytes())
                .expect("off");
            bench.write(index, 0, &[0]).expect("count 0");
            let all = (sub == 6 && bits == 32).then_some(()).ok_or(refused);
            let standard = all.or_else(|refused| refused);
            assert_eq!(bench.write(index, 1, &value), standard, "{sub} {bits}");
        }
    }
}
