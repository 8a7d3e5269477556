//! What holds of every request: lengths, kinds of frames, aborts, states.

use can::{ExtendedId, Frame, StandardId};
use canopen::Abort;

use crate::harness::{Bench, FULL, ID, Streams};
use crate::master::{LONGEST_TEXT, Master, STREAM, TEXT, abort, bytes, characters, initiate};

/// A client that has brought a transfer to one of its steps, and what the step is called.
pub(crate) fn every_step() -> Vec<(&'static str, Master)> {
    let begin = |dialogue: &str| {
        let mut master = Master::reading(&bytes(100));
        master.play(dialogue);
        master
    };
    vec![
        (
            "segmented download begun",
            begin(
                "> 21 10 20 01 0A 00 00 00
                 < 60 10 20 01 00 00 00 00",
            ),
        ),
        (
            "segmented download half done",
            begin(
                "> 21 10 20 01 0A 00 00 00
                 < 60 10 20 01 00 00 00 00
                 > 00 61 62 63 64 65 66 67
                 < 20 00 00 00 00 00 00 00",
            ),
        ),
        (
            "segmented upload begun",
            begin(
                "> 40 13 20 01 00 00 00 00
                 < 41 13 20 01 E8 03 00 00",
            ),
        ),
        (
            "segmented upload half done",
            begin(
                "> 40 13 20 01 00 00 00 00
                 < 41 13 20 01 E8 03 00 00
                 > 60 00 00 00 00 00 00 00
                 < 00 30 31 32 33 34 35 36",
            ),
        ),
        (
            "block download begun",
            begin(
                "> C6 20 20 00 0A 00 00 00
                 < A4 20 20 00 7F 00 00 00",
            ),
        ),
        (
            "block download amid a block",
            begin(
                "> C6 20 20 00 0A 00 00 00
                 < A4 20 20 00 7F 00 00 00
                 > 01 61 62 63 64 65 66 67",
            ),
        ),
        (
            "block download before its end",
            begin(
                "> C6 20 20 00 0A 00 00 00
                 < A4 20 20 00 7F 00 00 00
                 > 01 61 62 63 64 65 66 67
                 > 82 61 62 63 00 00 00 00
                 < A2 02 7F 00 00 00 00 00",
            ),
        ),
        (
            "block upload begun",
            begin(
                "> A4 20 20 00 02 00 00 00
                 < C6 20 20 00 64 00 00 00",
            ),
        ),
        (
            "block upload with a block sent",
            begin(
                "> A4 13 20 01 02 00 00 00
                 < C6 13 20 01 E8 03 00 00
                 > A3 00 00 00 00 00 00 00
                 < 01 30 31 32 33 34 35 36
                 < 02 37 38 39 31 32 33 34",
            ),
        ),
        (
            "block upload before its end",
            begin(
                "> A4 13 20 05 02 00 00 00
                 < C6 13 20 05 08 00 00 00
                 > A3 00 00 00 00 00 00 00
                 < 01 65 69 67 68 74 38 38
                 < 82 38 00 00 00 00 00 00
                 > A2 02 02 00 00 00 00 00
                 < D9 9F 0E 00 00 00 00 00",
            ),
        ),
        ("a download that its owner has not begun yet", {
            let mut master = Master::new();
            master.bench.owner.begin = canopen::Verdict::Later;
            master.play("> 21 20 20 00 0A 00 00 00");
            master
        }),
        ("a write that its owner has not judged yet", {
            let mut master = Master::new();
            master.bench.owner.verdict = canopen::Verdict::Later;
            master.play("> 23 10 10 01 73 61 76 65");
            master
        }),
    ]
}

pub(crate) fn short_frames_are_silent() {
    for (step, master) in every_step() {
        for length in 0..8 {
            let mut master = Master {
                bench: Bench {
                    node: master.bench.node.clone(),
                    owner: master.bench.owner.clone(),
                    ..master.bench
                },
                ..master
            };
            for command in [0x00, 0x21, 0x40, 0x60, 0x80, 0xA1, 0xC1, 0xE0] {
                let request = initiate(command, TEXT, 0);
                assert_eq!(master.send(&request[..length]), [[0; 8]; 0], "{step}");
            }
            // And the transfer goes on.
            if step == "segmented upload begun" {
                master.play(
                    "> 60 00 00 00 00 00 00 00
                     < 00 30 31 32 33 34 35 36",
                );
            }
        }
    }
}

pub(crate) fn other_frames_are_silent() {
    let upload = [0x40, 0x01, 0x20, 0, 0, 0, 0, 0];
    let standard = |id| StandardId::new(id).expect("11 bits");
    let extended = ExtendedId::new(0x605).expect("29 bits");
    for (step, mut master) in every_step() {
        for length in 0..=8 {
            for frame in [
                Frame::remote_frame(standard(0x605), length),
                Frame::remote_frame(standard(0x585), length),
                Frame::remote_frame(extended, length),
            ] {
                master.hand_over(frame.expect("a frame"));
                assert_eq!(master.answers(), [[0; 8]; 0], "{step}");
            }
        }
        for frame in [
            Frame::data_frame(extended, &upload),
            Frame::data_frame(standard(0x604), &upload),
            Frame::data_frame(standard(0x606), &upload),
            Frame::data_frame(standard(0x585), &upload),
            Frame::data_frame(standard(0x600), &upload),
        ] {
            master.hand_over(frame.expect("a frame"));
            assert_eq!(master.answers(), [[0; 8]; 0], "{step}");
        }
    }
}

pub(crate) fn unknown_commands_are_aborted() {
    for command in 0xE0..=0xFF {
        let mut master = Master::new();
        let answer = master.ask(&[command, 0x00, 0x20, 3, 0, 0, 0, 0]);
        assert_eq!(answer, [0x80, 0x00, 0x20, 3, 0x01, 0x00, 0x04, 0x05]);
        master.is_usable();
    }
}

/// Requests that continue a transfer where there is none.
pub(crate) fn steps_without_a_transfer_are_aborted() {
    for command in [
        0x00, 0x01, 0x0F, 0x10, 0x1F, 0x60, 0x70, 0xA1, 0xA2, 0xA3, 0xC1, 0xC5, 0xDD,
    ] {
        let mut master = Master::new();
        let answer = master.ask(&[command, 1, 1, 0, 0, 0, 0, 0]);
        assert_eq!(answer[0], 0x80, "{command:02X}");
        assert_eq!(answer[4..], [0x01, 0x00, 0x04, 0x05], "{command:02X}");
        master.is_usable();
        // After a transfer it names that one's object: the client believes that it goes on.
        assert_eq!(master.download(TEXT, b"a text", true), Ok(()));
        let answer = master.ask(&[command, 1, 1, 0, 0, 0, 0, 0]);
        assert_eq!(answer, abort(TEXT, Abort::COMMAND), "{command:02X}");
    }
}

/// Requests that continue another kind of transfer than the one there is.
pub(crate) fn steps_of_another_transfer_are_aborted() {
    let all = [0x01, 0x60, 0xA1, 0xA2, 0xA3, 0xC1];
    for (step, right) in [
        ("segmented download begun", &[0x01][..]),
        ("segmented download half done", &[0x01]),
        ("segmented upload begun", &[0x60]),
        ("segmented upload half done", &[0x60]),
        ("block download before its end", &[0xC1]),
        ("block upload begun", &[0xA3]),
        ("block upload with a block sent", &[0xA2]),
        ("block upload before its end", &[0xA1]),
    ] {
        for command in all.into_iter().filter(|command| !right.contains(command)) {
            let (_, mut master) = every_step()
                .into_iter()
                .find(|(name, _)| *name == step)
                .expect("a step");
            let answer = master.ask(&[command, 1, 1, 0, 0, 0, 0, 0]);
            assert_eq!(answer[0], 0x80, "{step}, {command:02X}");
            assert_eq!(
                answer[4..],
                [0x01, 0x00, 0x04, 0x05],
                "{step}, {command:02X}"
            );
            assert!(
                matches!(answer[1..4], [0x10 | 0x13 | 0x20, 0x20, 0 | 1 | 5]),
                "{answer:02X?}"
            );
            master.is_usable();
        }
    }
}

pub(crate) fn aborts_are_not_answered() {
    for code in [0, 0x0504_0000, 0x0800_0000, 0xFFFF_FFFF] {
        let mut master = Master::new();
        for object in [TEXT, STREAM, canopen::Address::new(0x2FFF, 9)] {
            assert_eq!(master.send(&abort(object, Abort(code))), [[0; 8]; 0]);
        }
        master.is_usable();
    }
}

pub(crate) fn an_abort_ends_every_step() {
    for (step, mut master) in every_step() {
        let why = abort(TEXT, Abort::GENERAL);
        assert_eq!(master.send(&why), [[0; 8]; 0], "{step}");
        assert!(master.bench.owner.is_balanced(), "{step}");
        assert_eq!(master.complete(Ok(())), [[0; 8]; 0], "{step}");
        assert_eq!(master.after_ms(5000), [[0; 8]; 0], "{step}");
        assert_eq!(
            master.upload(TEXT),
            Ok(vec![]),
            "{step}: nothing was written"
        );
        master.is_usable();
    }
}

/// The answer to a request that is aborted before the answer was sent is not sent.
pub(crate) fn an_aborted_answer_is_not_sent() {
    for request in [
        initiate(0x40, TEXT, 0),
        initiate(0x21, TEXT, 10),
        initiate(0xA4, STREAM, 2),
        initiate(0xC6, STREAM, 10),
    ] {
        let mut master = Master::reading(&bytes(10));
        master.hand_over(crate::master::frame(0x605, &request));
        let why = abort(TEXT, Abort::TIMED_OUT);
        assert_eq!(master.send(&why), [[0; 8]; 0], "{request:02X?}");
        master.is_usable();
    }
}

pub(crate) fn a_new_initiate_begins_anew() {
    for (step, mut master) in every_step() {
        if step.contains("amid") || step.contains("block download begun") {
            // A segment of a block can begin with any byte.
            continue;
        }
        if step.contains("owner") {
            let answer = master.ask(&initiate(0x21, TEXT, 3));
            assert_eq!(answer, abort(TEXT, Abort::DEVICE_STATE), "{step}");
            let answer = master.ask(&initiate(0xA0, STREAM, 3));
            assert_eq!(answer, abort(STREAM, Abort::DEVICE_STATE), "{step}");
            continue;
        }
        assert_eq!(master.download(TEXT, b"another", true), Ok(()), "{step}");
        assert!(master.bench.owner.is_balanced(), "{step}");
        assert_eq!(master.upload(TEXT), Ok(b"another".to_vec()), "{step}");
        master.is_usable();
    }
}

pub(crate) fn a_silent_client_is_given_up() {
    for (step, mut master) in every_step() {
        if step.contains("owner") {
            // It is not the client that is waited for.
            assert_eq!(master.after_ms(100_000), [[0; 8]; 0], "{step}");
            assert_eq!(master.complete(Ok(())).len(), 1, "{step}");
            continue;
        }
        let amid = step.contains("amid");
        if amid {
            // What came of the block is acknowledged first, once.
            assert_eq!(master.after_ms(200), [[0xA2, 1, 127, 0, 0, 0, 0, 0]]);
        }
        assert_eq!(master.after_ms(999), [[0; 8]; 0], "{step}");
        let answers = master.after_ms(1);
        let [answer] = answers[..] else {
            panic!("{step}: {answers:02X?}");
        };
        assert_eq!(answer[0], 0x80, "{step}");
        assert_eq!(answer[4..], [0x00, 0x00, 0x04, 0x05], "{step}");
        assert_eq!(master.after_ms(5000), [[0; 8]; 0], "{step}: once");
        assert_eq!(
            master.upload(TEXT),
            Ok(vec![]),
            "{step}: nothing was written"
        );
        master.is_usable();
    }
}

pub(crate) fn time_begins_anew_with_every_step() {
    let mut master = Master::new();
    master.play(
        "> 20 10 20 03 00 00 00 00
         < 60 10 20 03 00 00 00 00",
    );
    for toggle in [0x00, 0x10, 0x00, 0x10] {
        assert_eq!(master.after_ms(999), [[0; 8]; 0]);
        let segment = [toggle, 0x61, 0x61, 0x61, 0x61, 0x61, 0x61, 0x61];
        assert_eq!(master.ask(&segment)[0], 0x20 | toggle);
    }
    assert_eq!(master.after_ms(999), [[0; 8]; 0]);
    master.play(
        "~ 1
         < 80 10 20 03 00 00 04 05",
    );
    let mut master = Master::new();
    master.play(
        "> 40 13 20 01 00 00 00 00
         < 41 13 20 01 E8 03 00 00
         ~ 999
         > 60 00 00 00 00 00 00 00
         < 00 30 31 32 33 34 35 36
         ~ 999
         > 70 00 00 00 00 00 00 00
         < 10 37 38 39 31 32 33 34
         ~ 999
         ~ 1
         < 80 13 20 01 00 00 04 05",
    );
}

pub(crate) fn none_in_stopped() {
    for (step, mut master) in every_step() {
        let bench = &mut master.bench;
        bench.nmt(0x02);
        assert!(bench.owner.is_balanced(), "{step}");
        for request in [
            initiate(0x40, TEXT, 0),
            initiate(0x2F, canopen::Address::new(0x200B, 0), 9),
            initiate(0x60, TEXT, 0),
            initiate(0xA3, TEXT, 0),
            initiate(0xE0, TEXT, 0),
        ] {
            assert_eq!(master.send(&request), [[0; 8]; 0], "{step}");
        }
        assert_eq!(master.after_ms(5000), [[0; 8]; 0], "{step}");
        assert_eq!(master.complete(Ok(())), [[0; 8]; 0], "{step}");
        master.bench.nmt(0x80);
        assert_eq!(master.answers(), [[0; 8]; 0], "{step}: it is over");
        assert_eq!(master.upload(canopen::Address::new(0x200B, 0)), Ok(vec![0]));
        assert_eq!(master.upload(TEXT), Ok(vec![]), "{step}");
        master.is_usable();
    }
}

pub(crate) fn none_before_boot_up() {
    let mut master = Master {
        bench: Bench::unstarted_with(&FULL, Streams::default()),
        request: 0x600 + u32::from(ID),
        reply: 0x580 + u32::from(ID),
    };
    assert_eq!(master.send(&initiate(0x40, TEXT, 0)), [[0; 8]; 0]);
    master.bench.node.start(master.bench.now);
    let boot_up = [(0x700 + u16::from(ID), vec![0])];
    assert_eq!(master.bench.drain(), boot_up, "and no answer to it");
    master.is_usable();
}

pub(crate) fn alike_in_operational() {
    for command in [0x80, 0x01] {
        let mut master = Master::reading(&bytes(1000));
        master.bench.nmt(command);
        master.is_usable();
        let text = characters(200);
        assert_eq!(master.download(LONGEST_TEXT, &text, true), Ok(()));
        assert_eq!(master.upload(LONGEST_TEXT), Ok(text));
        let stream = master.upload_blocks(STREAM, true, |_| 50, |_| false);
        assert_eq!(stream, Ok(bytes(1000)));
    }
}

/// A change from one of the two states to the other touches no transfer.
pub(crate) fn transfers_go_on_when_started() {
    let mut master = Master::new();
    master.play(
        "> 21 10 20 01 0A 00 00 00
         < 60 10 20 01 00 00 00 00
         > 00 61 62 63 64 65 66 67
         < 20 00 00 00 00 00 00 00",
    );
    master.bench.nmt(0x01);
    master.play(
        "> 19 68 69 6A 00 00 00 00
         < 30 00 00 00 00 00 00 00",
    );
    assert_eq!(master.upload(TEXT), Ok(b"abcdefghij".to_vec()));
}
