//! Further servers: 0x1201 and 0x1202.

use canopen::{Abort, Address, Verdict};

use crate::harness::Call;
use crate::master::{
    LONGEST_TEXT, Master, OCTETS, STREAM, TEXT, abort, bytes, characters, frame, initiate, segment,
};

const OFF: u32 = 1 << 31;
const EXTENDED: u32 = 1 << 29;
const SECOND: u16 = 0x1201;
const THIRD: u16 = 0x1202;

/// Writes an UNSIGNED32.
fn write(master: &mut Master, index: u16, sub: u8, value: u32) -> Result<(), u32> {
    let object = Address::new(index, sub);
    let answer = master.ask(&initiate(0x23, object, value));
    match answer[0] {
        0x60 => Ok(()),
        _ => Err(crate::master::number(answer)),
    }
}

fn switch_on(master: &mut Master, index: u16, request: u32, reply: u32) {
    assert_eq!(write(master, index, 1, request), Ok(()));
    assert_eq!(write(master, index, 2, reply), Ok(()));
}

/// Does something as the client of another server.
fn by<T>(master: &mut Master, ids: (u32, u32), act: impl FnOnce(&mut Master) -> T) -> T {
    let before = (master.request, master.reply);
    (master.request, master.reply) = ids;
    let done = act(master);
    (master.request, master.reply) = before;
    done
}

pub(crate) fn the_default_one() {
    Master::new().play(
        "> 40 00 12 00 00 00 00 00
         < 4F 00 12 00 02 00 00 00
         > 40 00 12 01 00 00 00 00
         < 43 00 12 01 05 06 00 00
         > 40 00 12 02 00 00 00 00
         < 43 00 12 02 85 05 00 00
         > 23 00 12 01 06 06 00 00
         < 80 00 12 01 02 00 01 06
         > 23 00 12 02 86 05 00 00
         < 80 00 12 02 02 00 01 06",
    );
}

pub(crate) fn off_at_first() {
    let mut master = Master::new();
    for (index, sub) in [(SECOND, 1), (SECOND, 2), (THIRD, 1), (THIRD, 2)] {
        let object = Address::new(index, sub);
        let answer = master.ask(&initiate(0x40, object, 0));
        assert_eq!(answer, initiate(0x43, object, OFF));
    }
    for id in [0x000_u32, 0x001, 0x640, 0x6C0, 0x7FF] {
        if id != 0 {
            master.hand_over(frame(id, &initiate(0x40, TEXT, 0)));
        }
        assert_eq!(master.answers(), [[0; 8]; 0]);
    }
}

/// It exists when bit 31 of neither COB-ID is set, in whichever order they are written.
pub(crate) fn on_with_both() {
    for order in [[1, 2], [2, 1]] {
        let mut master = Master::new();
        let id = |sub| if sub == 1 { 0x6C0 } else { 0x5C0 - 0x100 };
        assert_eq!(write(&mut master, SECOND, order[0], id(order[0])), Ok(()));
        by(&mut master, (0x6C0, 0x4C0), |second| {
            assert_eq!(
                second.send(&initiate(0x40, TEXT, 0)),
                [[0; 8]; 0],
                "half of it"
            );
        });
        assert_eq!(write(&mut master, SECOND, order[1], id(order[1])), Ok(()));
        by(&mut master, (0x6C0, 0x4C0), Master::is_usable);
        master.is_usable();
        // And off with either.
        assert_eq!(
            write(&mut master, SECOND, order[0], id(order[0]) | OFF),
            Ok(())
        );
        by(&mut master, (0x6C0, 0x4C0), |second| {
            assert_eq!(second.send(&initiate(0x40, TEXT, 0)), [[0; 8]; 0], "off");
        });
    }
}

pub(crate) fn identifiers_are_fixed_while_it_exists() {
    let mut master = Master::new();
    switch_on(&mut master, SECOND, 0x6C0, 0x4C0);
    for (sub, value) in [
        (1, 0x6C1),
        (2, 0x4C1),
        (1, EXTENDED | 0x6C0),
        (1, 0x6C0 | 1 << 11),
    ] {
        let refused = write(&mut master, SECOND, sub, value);
        assert_eq!(refused, Err(0x0609_0030), "{value:08X}");
    }
    assert_eq!(write(&mut master, SECOND, 1, 0x6C0), Ok(()), "the same");
    // Off first, either of them; then others, and on again.
    assert_eq!(write(&mut master, SECOND, 1, 0x6C1 | OFF), Ok(()));
    assert_eq!(write(&mut master, SECOND, 2, 0x4C1), Ok(()), "it is off");
    assert_eq!(write(&mut master, SECOND, 1, 0x6C1), Ok(()));
    by(&mut master, (0x6C1, 0x4C1), Master::is_usable);
    by(&mut master, (0x6C0, 0x4C0), |old| {
        assert_eq!(old.send(&initiate(0x40, TEXT, 0)), [[0; 8]; 0]);
    });
}

pub(crate) fn identifiers_of_29_bits() {
    let mut master = Master::new();
    let ids = (EXTENDED | 0x0123_4567, EXTENDED | 0x1FFF_FFFF);
    switch_on(&mut master, SECOND, ids.0, ids.1);
    by(&mut master, ids, |second| {
        second.is_usable();
        let text = characters(100);
        assert_eq!(second.download(LONGEST_TEXT, &text, true), Ok(()));
        assert_eq!(
            second.upload_blocks(LONGEST_TEXT, true, |_| 9, |_| false),
            Ok(text)
        );
    });
    // The same number of 11 bits is another identifier.
    master.hand_over(frame(0x0123_4567 & 0x7FF, &initiate(0x40, TEXT, 0)));
    assert_eq!(master.answers(), [[0; 8]; 0]);
}

pub(crate) fn restricted_identifiers() {
    let mut master = Master::new();
    let restricted = (0x000..=0x07F)
        .chain(0x101..=0x180)
        .chain(0x581..=0x5FF)
        .chain(0x601..=0x67F)
        .chain(0x6E0..=0x6FF)
        .chain(0x701..=0x7FF);
    for id in restricted {
        for sub in [1, 2] {
            let refused = write(&mut master, SECOND, sub, id);
            assert_eq!(refused, Err(0x0609_0030), "{id:03X}");
        }
    }
    for id in [0x080, 0x100, 0x181, 0x580, 0x600, 0x680, 0x6DF, 0x700] {
        assert_eq!(write(&mut master, SECOND, 1, id), Ok(()), "{id:03X}");
        assert_eq!(write(&mut master, SECOND, 1, id | OFF), Ok(()));
    }
    // Bits 11 to 28 are 0 in an identifier of 11 bits; no COB-ID here is given dynamically.
    for value in [0x0000_0E00, 0x1000_06C0, 1 << 30 | 0x6C0] {
        let refused = write(&mut master, SECOND, 1, value);
        assert_eq!(refused, Err(0x0609_0030), "{value:08X}");
    }
}

/// Three transfers at once, a step of each in turn.
pub(crate) fn independent_transfers() {
    let text = bytes(1000);
    let mut master = Master::reading(&text);
    switch_on(&mut master, SECOND, 0x6C0, 0x4C0);
    switch_on(&mut master, THIRD, 0x6C1, 0x4C1);
    let (second, third) = ((0x6C0, 0x4C0), (0x6C1, 0x4C1));
    assert_eq!(master.ask(&initiate(0x21, LONGEST_TEXT, 70))[0], 0x60);
    by(&mut master, second, |master| {
        assert_eq!(master.ask(&initiate(0x40, STREAM, 0))[0], 0x41);
    });
    by(&mut master, third, |master| {
        assert_eq!(master.ask(&initiate(0xA4, STREAM, 3))[0], 0xC6);
        assert_eq!(master.send(&[0xA3, 0, 0, 0, 0, 0, 0, 0]).len(), 3);
    });
    let written = characters(70);
    for n in 0..10_u8 {
        let toggle = (n & 1) << 4;
        let at = 7 * usize::from(n);
        let last = u8::from(n == 9);
        let answer = master.ask(&segment(toggle | last, &written[at..at + 7]));
        assert_eq!(answer[0], 0x20 | toggle);
        by(&mut master, second, |master| {
            let answer = master.ask(&[0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            assert_eq!(answer, segment(toggle, &text[at..at + 7]));
        });
        by(&mut master, third, |master| {
            let block = master.send(&[0xA2, 3, 3, 0, 0, 0, 0, 0]);
            let at = 21 * (usize::from(n) + 1);
            assert_eq!(block[0], segment(1, &text[at..at + 7]));
            assert_eq!(block.len(), 3);
        });
    }
    // One gives up, one is given up; the default server does not care.
    by(&mut master, second, |master| {
        assert_eq!(master.send(&abort(STREAM, Abort::GENERAL)), [[0; 8]; 0]);
    });
    by(&mut master, third, |master| {
        assert_eq!(master.after_ms(1000), [abort(STREAM, Abort::TIMED_OUT)]);
    });
    assert_eq!(master.upload(LONGEST_TEXT), Ok(written));
    for ids in [second, third] {
        by(&mut master, ids, Master::is_usable);
    }
}

/// Texts are gathered in one place: a second one at the same time is refused, not mixed.
pub(crate) fn one_text_at_a_time() {
    let mut master = Master::new();
    switch_on(&mut master, SECOND, 0x6C0, 0x4C0);
    assert_eq!(master.ask(&initiate(0x21, TEXT, 14))[0], 0x60);
    by(&mut master, (0x6C0, 0x4C0), |second| {
        let answer = second.ask(&initiate(0x21, OCTETS, 20));
        assert_eq!(answer, abort(OCTETS, Abort::OUT_OF_MEMORY));
        // A number or a stream is no text.
        second.is_usable();
        assert_eq!(second.download(STREAM, &bytes(30), true), Ok(()));
    });
    assert_eq!(master.send_segments(b"fourteen bytes"), Ok(()));
    assert_eq!(master.upload(TEXT), Ok(b"fourteen bytes".to_vec()));
    by(&mut master, (0x6C0, 0x4C0), |second| {
        assert_eq!(second.download(OCTETS, &bytes(20), true), Ok(()));
    });
    assert_eq!(master.upload(OCTETS), Ok(bytes(20)));
}

/// What is read is what one write has left: a text that is written while it is being read ends the
/// reading.
pub(crate) fn no_mixture_of_two_texts() {
    let mut master = Master::new();
    switch_on(&mut master, SECOND, 0x6C0, 0x4C0);
    for in_blocks in [false, true] {
        for new in ["another text, as long as the old", "short"] {
            let old = "the old text, seven-seven-seven.";
            master
                .download(TEXT, old.as_bytes(), true)
                .expect("written");
            if in_blocks {
                assert_eq!(master.ask(&initiate(0xA0, TEXT, 2))[0], 0xC2 | 4);
                assert_eq!(master.send(&[0xA3, 0, 0, 0, 0, 0, 0, 0]).len(), 2);
            } else {
                assert_eq!(master.ask(&initiate(0x40, TEXT, 0))[0], 0x41);
                assert_eq!(master.ask(&[0x60, 0, 0, 0, 0, 0, 0, 0])[0], 0x00);
            }
            by(&mut master, (0x6C0, 0x4C0), |second| {
                second
                    .download(TEXT, new.as_bytes(), true)
                    .expect("written");
            });
            let next = if in_blocks {
                [0xA2, 2, 2, 0, 0, 0, 0, 0]
            } else {
                [0x70, 0, 0, 0, 0, 0, 0, 0]
            };
            assert_eq!(master.ask(&next), abort(TEXT, Abort::DEVICE_STATE));
            assert_eq!(master.upload(TEXT), Ok(new.as_bytes().to_vec()));
        }
    }
}

pub(crate) fn one_write_waits_at_a_time() {
    let mut master = Master::new();
    switch_on(&mut master, SECOND, 0x6C0, 0x4C0);
    master.bench.owner.verdict = Verdict::Later;
    let store = Address::new(0x1010, 1);
    assert_eq!(
        master.send(&initiate(0x23, store, 0x6576_6173)),
        [[0; 8]; 0]
    );
    by(&mut master, (0x6C0, 0x4C0), |second| {
        for (request, object) in [
            (0x23, Address::new(0x1010, 2)),
            (0x2F, Address::new(0x200B, 0)),
            (0x21, TEXT),
            (0x21, STREAM),
            (0xC6, STREAM),
        ] {
            let answer = second.ask(&initiate(request, object, 4));
            assert_eq!(answer, abort(object, Abort::DEVICE_STATE), "{object}");
        }
        assert_eq!(second.upload(Address::new(0x2001, 0)), Ok(vec![0x34, 0x12]));
        assert_eq!(second.upload(TEXT), Ok(vec![]), "in segments, too");
    });
    assert_eq!(master.complete(Ok(())), [initiate(0x60, store, 0)]);
    by(&mut master, (0x6C0, 0x4C0), Master::is_usable);
}

/// Transfers that had begun before one write waited come to their end with an abort, and every
/// client gets its answer.
pub(crate) fn a_write_waits_while_others_end() {
    for (object, request) in [(STREAM, 0x21), (TEXT, 0x21), (STREAM, 0xC2)] {
        let mut master = Master::new();
        switch_on(&mut master, SECOND, 0x6C0, 0x4C0);
        by(&mut master, (0x6C0, 0x4C0), |second| {
            assert_eq!(
                second.ask(&initiate(request, object, 7))[0] & 0x80,
                request & 0x80
            );
        });
        let owner = &mut master.bench.owner;
        (owner.verdict, owner.end) = (Verdict::Later, Verdict::Later);
        let store = Address::new(0x1010, 1);
        assert_eq!(
            master.send(&initiate(0x23, store, 0x6576_6173)),
            [[0; 8]; 0]
        );
        by(&mut master, (0x6C0, 0x4C0), |second| {
            let answer = match request {
                0x21 => second.ask(&segment(0x01, b"abcdefg")),
                _ => {
                    assert_eq!(second.ask(&segment(0x81, b"abcdefg"))[0], 0xA2);
                    second.ask(&[0xC1, 0, 0, 0, 0, 0, 0, 0])
                }
            };
            assert_eq!(answer, abort(object, Abort::DEVICE_STATE));
        });
        assert!(master.bench.owner.is_balanced());
        assert_eq!(master.complete(Ok(())), [initiate(0x60, store, 0)]);
        by(&mut master, (0x6C0, 0x4C0), Master::is_usable);
    }
}

/// Two clients cannot write one stream at once.
pub(crate) fn one_writer_a_stream() {
    let mut master = Master::new();
    switch_on(&mut master, SECOND, 0x6C0, 0x4C0);
    assert_eq!(master.ask(&initiate(0x21, STREAM, 14))[0], 0x60);
    by(&mut master, (0x6C0, 0x4C0), |second| {
        for request in [0x20, 0x21, 0x23, 0xC6] {
            let answer = second.ask(&initiate(request, STREAM, 4));
            assert_eq!(answer, abort(STREAM, Abort::DEVICE_STATE), "{request:02X}");
        }
        // Another stream is another matter.
        let program = Address::new(0x1F50, 1);
        assert_eq!(second.ask(&initiate(0x21, program, 7))[0], 0x60);
        assert_eq!(second.ask(&segment(0x01, b"program"))[0], 0x20);
    });
    let data = bytes(14);
    assert_eq!(master.send_segments(&data), Ok(()));
    let ended = master.bench.owner.calls.contains(&Call::End(STREAM, 14));
    assert!(ended);
    by(&mut master, (0x6C0, 0x4C0), |second| {
        assert_eq!(
            second.download(STREAM, &data, true),
            Ok(()),
            "now it is free"
        );
    });
}

/// A server that is switched off while a client is at it: the transfer is over, the owner told,
/// and nothing is sent any more.
pub(crate) fn switched_off_in_the_middle() {
    for sub in [1, 2] {
        for request in [0x21, 0xC6] {
            let mut master = Master::new();
            switch_on(&mut master, SECOND, 0x6C0, 0x4C0);
            by(&mut master, (0x6C0, 0x4C0), |second| {
                assert_eq!(second.send(&initiate(request, STREAM, 14)).len(), 1);
            });
            let id = if sub == 1 { 0x6C0 } else { 0x4C0 };
            assert_eq!(write(&mut master, SECOND, sub, id | OFF), Ok(()));
            assert!(master.bench.owner.is_balanced());
            assert_eq!(master.after_ms(10_000), [[0; 8]; 0]);
            assert_eq!(write(&mut master, SECOND, sub, id), Ok(()));
            assert_eq!(master.after_ms(10_000), [[0; 8]; 0]);
            by(&mut master, (0x6C0, 0x4C0), |second| {
                let answer = second.ask(&[0x60, 0, 0, 0, 0, 0, 0, 0]);
                assert_eq!(answer[4..], [0x01, 0x00, 0x04, 0x05], "no transfer");
                second.is_usable();
            });
        }
    }
}

/// A server may switch itself off: that is acknowledged, then it is silent.
pub(crate) fn switching_itself_off() {
    let mut master = Master::new();
    switch_on(&mut master, SECOND, 0x6C0, 0x4C0);
    by(&mut master, (0x6C0, 0x4C0), |second| {
        assert_eq!(write(second, SECOND, 1, 0x6C0 | OFF), Ok(()));
        assert_eq!(second.send(&initiate(0x40, TEXT, 0)), [[0; 8]; 0]);
    });
}
