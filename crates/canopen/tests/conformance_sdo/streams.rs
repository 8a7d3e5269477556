//! DOMAIN objects: what their owner is asked, and in which order.

use canopen::{Abort, Address, Verdict};

use crate::blocks::PLAIN;
use crate::harness::Call;
use crate::master::{Master, STREAM, abort, bytes, checksum, initiate, segment};

const HALF: &str = "
    > 21 20 20 00 0E 00 00 00
    < 60 20 20 00 00 00 00 00
    > 00 01 02 03 04 05 06 07
    < 20 00 00 00 00 00 00 00";
const HALF_IN_BLOCKS: &str = "
    > C6 20 20 00 0E 00 00 00
    < A4 20 20 00 7F 00 00 00
    > 01 01 02 03 04 05 06 07
    > 82 08 09 0A 0B 0C 0D 0E
    < A2 02 7F 00 00 00 00 00";

fn begun() -> [Call; 2] {
    [
        Call::Begin(STREAM, Some(14)),
        Call::Bytes(0, vec![1, 2, 3, 4, 5, 6, 7]),
    ]
}

pub(crate) fn in_order_and_without_gaps() {
    let rest = [
        Call::Bytes(7, vec![8, 9, 10, 11, 12, 13, 14]),
        Call::End(STREAM, 14),
    ];
    let mut master = Master::new();
    master.play(HALF);
    assert_eq!(master.bench.owner.take_calls(), begun());
    assert!(master.bench.events.changed.is_empty());
    master.play(
        "> 11 08 09 0A 0B 0C 0D 0E
         < 30 00 00 00 00 00 00 00",
    );
    assert_eq!(master.bench.owner.take_calls(), rest);
    let changed = master.bench.events.changed;
    assert!(changed.has(crate::harness::full::STREAM), "and it is told");

    master.play(HALF_IN_BLOCKS);
    let data: Vec<u8> = (1..=14).collect();
    assert_eq!(master.end_blocks(0, checksum(&data)), Ok(()));
    let all: Vec<Call> = begun().into_iter().chain(rest).collect();
    assert_eq!(master.bench.owner.take_calls(), all);
}

pub(crate) fn expedited() {
    let mut master = Master::new();
    master.play(
        "> 27 20 20 00 01 02 03 00
         < 60 20 20 00 00 00 00 00",
    );
    let calls = [
        Call::Begin(STREAM, Some(3)),
        Call::Bytes(0, vec![1, 2, 3]),
        Call::End(STREAM, 3),
    ];
    assert_eq!(master.bench.owner.take_calls(), calls);

    // An end that comes later; a begin cannot.
    master.bench.owner.end = Verdict::Later;
    assert_eq!(master.send(&initiate(0x2F, STREAM, 1)), [[0; 8]; 0]);
    assert_eq!(master.complete(Ok(())), [initiate(0x60, STREAM, 0)]);
    master.bench.owner.begin = Verdict::Later;
    master.bench.owner.take_calls();
    let answer = master.ask(&initiate(0x2F, STREAM, 1));
    assert_eq!(answer, abort(STREAM, Abort::UNSUPPORTED_ACCESS));
    let calls = [
        Call::Begin(STREAM, Some(1)),
        Call::Abort(STREAM, Abort::UNSUPPORTED_ACCESS),
    ];
    assert_eq!(master.bench.owner.take_calls(), calls);

    // Refused at each of the three steps.
    let refusal = Verdict::Refuse(Abort::LOCAL_CONTROL);
    for step in 0..3 {
        let mut master = Master::new();
        let owner = &mut master.bench.owner;
        match step {
            0 => owner.begin = refusal,
            1 => owner.full_at = 0,
            _ => owner.end = refusal,
        }
        let answer = master.ask(&initiate(0x2F, STREAM, 1));
        let code = if step == 1 {
            Abort::HARDWARE
        } else {
            Abort::LOCAL_CONTROL
        };
        assert_eq!(answer, abort(STREAM, code));
        assert!(master.bench.owner.is_balanced());
    }
}

pub(crate) fn a_begin_that_comes_later() {
    for (request, answer) in [
        (0x21, initiate(0x60, STREAM, 0)),
        (0xC6, initiate(0xA4, STREAM, 127)),
    ] {
        let mut master = Master::new();
        master.bench.owner.begin = Verdict::Later;
        assert_eq!(master.send(&initiate(request, STREAM, 14)), [[0; 8]; 0]);
        assert_eq!(master.after_ms(60_000), [[0; 8]; 0], "it takes its time");
        assert_eq!(master.complete(Ok(())), [answer]);
        let data = bytes(14);
        if request == 0x21 {
            assert_eq!(master.send_segments(&data), Ok(()));
        } else {
            master.send(&segment(0x01, &data[..7]));
            assert_eq!(master.send(&segment(0x82, &data[7..])).len(), 1);
            assert_eq!(master.end_blocks(0, checksum(&data)), Ok(()));
        }
        assert_eq!(master.bench.owner.taken, data);

        // The client's time runs from the answer on.
        assert_eq!(master.send(&initiate(request, STREAM, 14)), [[0; 8]; 0]);
        assert_eq!(master.after_ms(60_000), [[0; 8]; 0]);
        assert_eq!(master.complete(Ok(())), [answer]);
        assert_eq!(master.after_ms(999), [[0; 8]; 0]);
        assert_eq!(master.after_ms(1), [abort(STREAM, Abort::TIMED_OUT)]);

        // It ends in a refusal.
        assert_eq!(master.send(&initiate(request, STREAM, 14)), [[0; 8]; 0]);
        master.bench.owner.give_up();
        master.bench.owner.take_calls();
        let refused = master.complete(Err(Abort::HARDWARE));
        assert_eq!(refused, [abort(STREAM, Abort::HARDWARE)]);
        assert_eq!(master.bench.owner.take_calls(), [], "it knows");
        master.is_usable();
    }
}

pub(crate) fn an_end_that_comes_later() {
    for result in [Ok(()), Err(Abort::HARDWARE)] {
        let mut master = Master::new();
        master.bench.owner.end = Verdict::Later;
        master.play(HALF);
        let last = segment(0x11, &[0; 7]);
        assert_eq!(master.send(&last), [[0; 8]; 0]);
        assert_eq!(master.after_ms(60_000), [[0; 8]; 0]);
        let expected = match result {
            Ok(()) => [0x30, 0, 0, 0, 0, 0, 0, 0],
            Err(code) => abort(STREAM, code),
        };
        assert_eq!(master.complete(result), [expected]);

        master.play(HALF_IN_BLOCKS);
        let data: Vec<u8> = (1..=14).collect();
        let [low, high] = checksum(&data).to_le_bytes();
        let end = [0xC1, low, high, 0, 0, 0, 0, 0];
        assert_eq!(master.send(&end), [[0; 8]; 0]);
        let expected = match result {
            Ok(()) => [0xA1, 0, 0, 0, 0, 0, 0, 0],
            Err(code) => abort(STREAM, code),
        };
        assert_eq!(master.complete(result), [expected]);
        let ended = |call: &&Call| !matches!(call, Call::Begin(..) | Call::Bytes(..));
        let ends: Vec<_> = master.bench.owner.calls.iter().filter(ended).collect();
        assert_eq!(ends, [&Call::End(STREAM, 14), &Call::End(STREAM, 14)]);
        master.is_usable();
    }
}

/// The owner refuses at each step; it knows, so it is not told to forget.
pub(crate) fn refusals() {
    for in_blocks in [false, true] {
        for step in 0..3 {
            let mut master = Master::new();
            let owner = &mut master.bench.owner;
            let code = Abort::LOCAL_CONTROL;
            match step {
                0 => owner.begin = Verdict::Refuse(code),
                1 => owner.full_at = 10,
                _ => owner.end = Verdict::Refuse(code),
            }
            let code = if step == 1 { Abort::HARDWARE } else { code };
            let data = bytes(40);
            let done = match in_blocks {
                false => master.download(STREAM, &data, true),
                true => master.download_blocks(STREAM, &data, PLAIN, |_| false),
            };
            assert_eq!(done, Err(code.0), "{in_blocks}, {step}");
            assert!(master.bench.owner.is_balanced());
            let told = |call: &Call| matches!(call, Call::Abort(..));
            assert!(!master.bench.owner.calls.iter().any(told));
            assert!(master.bench.events.changed.is_empty());
            master.is_usable();
        }
    }
}

/// Whatever ends a download before its end: the owner is told once, with the reason.
pub(crate) fn told_once_and_why() {
    type End = fn(&mut Master);
    let ends: [(&str, Abort, End); 8] = [
        ("the client's abort", Abort(0x0800_0021), |master| {
            master.play("> 80 20 20 00 21 00 00 08");
        }),
        ("time", Abort::TIMED_OUT, |master| {
            assert_eq!(master.after_ms(1000).len(), 1);
        }),
        ("a toggle", Abort::TOGGLE, |master| {
            master.play(
                "> 00 01 02 03 04 05 06 07
                 < 80 20 20 00 00 00 03 05",
            );
        }),
        ("too long", Abort::TOO_LONG, |master| {
            master.play(
                "> 10 08 09 0A 0B 0C 0D 0E
                 < 30 00 00 00 00 00 00 00
                 > 0D 0F 00 00 00 00 00 00
                 < 80 20 20 00 12 00 07 06",
            );
        }),
        ("too short", Abort::TOO_SHORT, |master| {
            master.play(
                "> 13 08 09 0A 0B 0C 0D 0E
                 < 80 20 20 00 13 00 07 06",
            );
        }),
        ("another command", Abort::COMMAND, |master| {
            master.play(
                "> 60 00 00 00 00 00 00 00
                 < 80 20 20 00 01 00 04 05",
            );
        }),
        ("a new transfer", Abort::GENERAL, |master| {
            master.play(
                "> 40 01 20 00 00 00 00 00
                 < 4B 01 20 00 34 12 00 00",
            );
        }),
        ("stop", Abort::DEVICE_STATE, |master| {
            master.bench.nmt(0x02);
            master.bench.nmt(0x80);
        }),
    ];
    for (name, why, end) in ends {
        let mut master = Master::new();
        master.play(HALF);
        assert_eq!(master.bench.owner.take_calls(), begun());
        end(&mut master);
        let calls = master.bench.owner.take_calls();
        assert_eq!(calls.last(), Some(&Call::Abort(STREAM, why)), "{name}");
        let told = |call: &&Call| matches!(call, Call::Abort(..) | Call::End(..));
        assert_eq!(calls.iter().filter(told).count(), 1, "{name}");
        assert_eq!(master.after_ms(5000), [[0; 8]; 0], "{name}");
        assert_eq!(master.bench.owner.take_calls(), [], "{name}");
        master.is_usable();
    }
}

/// After its end a stream is not aborted, whatever comes.
pub(crate) fn never_after_its_end() {
    for end in [
        Verdict::Accept,
        Verdict::Later,
        Verdict::Refuse(Abort::GENERAL),
    ] {
        let mut master = Master::new();
        master.bench.owner.end = end;
        master.play(HALF);
        master.send(&segment(0x11, &[0; 7]));
        let calls = master.bench.owner.take_calls();
        assert_eq!(calls.last(), Some(&Call::End(STREAM, 14)));
        assert_eq!(master.send(&abort(STREAM, Abort::TIMED_OUT)), [[0; 8]; 0]);
        master.after_ms(5000);
        master.bench.nmt(0x02);
        master.bench.nmt(0x80);
        assert_eq!(master.bench.owner.take_calls(), []);
        assert_eq!(master.complete(Ok(())), [[0; 8]; 0]);
        master.is_usable();
    }
}

pub(crate) fn access() {
    let mut master = Master::new();
    for (object, request, code) in [
        (0x2021, 0x21, Abort::READ_ONLY),
        (0x2021, 0x20, Abort::READ_ONLY),
        (0x2021, 0x23, Abort::READ_ONLY),
        (0x2021, 0xC6, Abort::READ_ONLY),
        (0x2022, 0x40, Abort::WRITE_ONLY),
        (0x1021, 0xC2, Abort::READ_ONLY),
    ] {
        let object = Address::new(object, 0);
        assert_eq!(
            master.ask(&initiate(request, object, 4)),
            abort(object, code)
        );
    }
    assert_eq!(master.bench.owner.take_calls(), []);
    master.is_usable();
}

/// Any length, far beyond what a device has memory for.
pub(crate) fn any_length() {
    let data = bytes(1 << 18);
    let mut master = Master::reading(&data);
    assert_eq!(
        master.upload_blocks(STREAM, true, |_| 127, |_| false),
        Ok(data.clone())
    );
    assert_eq!(
        master.download_blocks(STREAM, &data, PLAIN, |_| false),
        Ok(())
    );
    assert!(master.bench.owner.taken == data);
    let data = &data[..1 << 16];
    master.bench.owner.contents.truncate(data.len());
    assert_eq!(master.download(STREAM, data, true), Ok(()));
    assert!(master.bench.owner.taken == data);
    assert!(master.upload(STREAM).is_ok_and(|read| read == data));
}
