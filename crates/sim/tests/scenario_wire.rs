//! What a scenario does to the wire, and when its events happen.

mod master;
use master::*;

use canopen::Instant;
use sim::scenario::Scenario;
use sim::{Bus, BusSettings, NoticeKind, Sender};

/// A bus with P3s 1 and 2 on which `text` is played; the drives have booted at 50 ms.
fn play(text: &str) -> Master {
    let scenario = Scenario::read("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let mut settings = BusSettings::new(7, vec![p3(1), p3(2)]);
    let set_up = scenario.set_up(&mut settings, Instant::NEVER);
    set_up.unwrap_or_else(|error| panic!("{error}"));
    let mut master = Master {
        bus: Bus::new(settings),
        log: Vec::new(),
    };
    master.run_ms(50);
    master.log.clear();
    master
}

/// What the scenario has told: microseconds, and the words behind the title.
fn told(master: &mut Master) -> Vec<(u64, String)> {
    let notices = master.bus.take_notices().into_iter();
    notices
        .filter_map(|notice| match notice.kind {
            NoticeKind::Scenario(words) => Some((notice.at.0 / 1_000, words)),
            _ => None,
        })
        .collect()
}

/// Times in ms at which shafts were blocked.
fn blocked_ms(master: &mut Master) -> Vec<f64> {
    let told = told(master).into_iter();
    told.filter(|(_, words)| words.ends_with(" blocked"))
        .map(|(us, _)| us as f64 * 1e-3)
        .collect()
}

fn frames(master: &Master, id: u32) -> usize {
    let log = master.log.iter();
    log.filter(|traffic| traffic.frame.raw_id() == id).count()
}

#[test]
fn a_flipped_bit_destroys_a_frame_and_it_is_repeated() {
    let mut master = play(
        "[[event]]\nat = \"60 ms\"\ndo = \"flip-bit\"\nframes = { id = 0x601, from = \"outside\" }\n\
         bit = 20\n",
    );
    master.run_ms(20);
    let before = master.now();
    assert!(master.try_read(1, 0x6041, 0).is_ok());
    // An answer takes 111 µs to 135 µs twice, and some service; the repetition adds an error frame.
    let took_us = master.now().since_ns(before) / 1_000;
    let disturbed = master.now();
    assert!(master.try_read(1, 0x6041, 0).is_ok());
    let usual_us = master.now().since_ns(disturbed) / 1_000;
    assert!(took_us > usual_us + 20, "{took_us} {usual_us}");
    assert_eq!(frames(&master, 0x601), 2);
    let errors = master.bus.outside_error_counters();
    assert!(errors.transmit > 0, "{errors:?}");
}

#[test]
fn frames_are_lost_at_one_receiver_and_come_twice() {
    let mut master = play(
        "[[event]]\nat = \"60 ms\"\ndo = \"lose-frames\"\ndrive = 1\nframes = { id = 0x000 }\n\
         skip = 1\ncount = 1\n\
         [[event]]\nat = \"200 ms\"\ndo = \"duplicate-frames\"\nframes = { id = 0x123 }\n",
    );
    master.run_ms(20);
    // The second NMT message is lost at drive 1 only.
    let start = |master: &mut Master, command| {
        master.send(0x000, &[command, 0]);
        master.run_ms(5);
        [1, 2].map(|node| {
            let drive = master.drive(node);
            drive.core().unwrap().comms().node().state()
        })
    };
    use canopen::NmtState::{Operational, Stopped};
    assert_eq!(start(&mut master, 1), [Operational; 2]);
    assert_eq!(start(&mut master, 2), [Operational, Stopped]);
    assert_eq!(start(&mut master, 2), [Stopped; 2]);
    master.run_ms(150);
    master.send(0x123, &[1]);
    master.run_ms(5);
    master.send(0x123, &[2]);
    master.run_ms(5);
    let heard = master.log.iter().filter(|t| t.frame.raw_id() == 0x123);
    let heard: Vec<u8> = heard.map(|t| t.frame.data()[0]).collect();
    assert_eq!(heard, [1, 1, 2]);
}

#[test]
fn frames_wait_and_a_strange_node_babbles() {
    let mut master = play(
        "[[event]]\nat = \"60 ms\"\ndo = \"hold-frames\"\ndrive = 1\nfor = \"30 ms\"\n\
         [[event]]\nat = \"200 ms\"\ndo = \"flood\"\nid = 0x005\ndata = \"AB\"\nperiod = \"1 ms\"\n\
         for = \"20 ms\"\n",
    );
    master.run_ms(11);
    let asked = master.now();
    master.send(0x601, &[0x40, 0x41, 0x60, 0]);
    master.send(0x602, &[0x40, 0x41, 0x60, 0]);
    master.run_ms(40);
    let answered = |node: u32| {
        let mut log = master.log.iter();
        let answer = log.find(|t| t.frame.raw_id() == 0x580 + node).unwrap();
        answer.at.since_ns(asked) / 1_000_000
    };
    assert!(answered(2) < 2);
    assert!((28..=31).contains(&answered(1)), "{}", answered(1));
    master.run_ms(200);
    let strange = master.log.iter().filter(|t| t.sender == Sender::Stranger);
    let count = strange.count();
    assert!((19..=21).contains(&count), "{count}");
    assert_eq!(frames(&master, 0x005), count);
}

#[test]
fn who_is_cut_off_is_not_heard_and_a_broken_cable_leads_to_bus_off() {
    let mut master = play(
        "[[event]]\nat = \"60 ms\"\ndo = \"disconnect\"\ndrive = 1\nfor = \"100 ms\"\n\
         [[event]]\nat = \"300 ms\"\ndo = \"break-bus\"\nlevel = \"dominant\"\nfor = \"20 ms\"\n",
    );
    let answers = |master: &mut Master, node: u32| {
        master.log.clear();
        master.send(0x600 + node as u16, &[0x40, 0x41, 0x60, 0]);
        master.run_ms(5);
        frames(master, 0x580 + node) == 1
    };
    assert!(answers(&mut master, 1));
    master.run_ms(10);
    assert!(!answers(&mut master, 1) && answers(&mut master, 2));
    master.run_ms(150);
    assert!(answers(&mut master, 1) && answers(&mut master, 2));
    let now_ms = master.now().0 / 1_000_000;
    master.run_ms(301 - now_ms);
    assert!(!answers(&mut master, 2));
    master.run_ms(100);
    assert!(answers(&mut master, 2) && answers(&mut master, 1));
}

#[test]
fn times_periods_and_other_events() {
    let block = "do = \"block-shaft\"\ndrive = 1\n";
    for (text, expected) in [
        (format!("at = \"60 ms\"\n{block}"), vec![60.0]),
        (
            format!("at = \"60 ms\"\nevery = \"10 ms\"\ntimes = 3\n{block}"),
            vec![60.0, 70.0, 80.0],
        ),
        (
            format!("at = \"60 ms\"\nevery = \"10 ms\"\nfor = \"5 ms\"\n{block}"),
            vec![60.0, 70.0, 80.0, 90.0],
        ),
        (
            format!(
                "name = \"a\"\nat = \"60 ms\"\ndo = \"stop-sync\"\n[[event]]\nafter = \"a\"\n\
                 delay = \"7 ms\"\n{block}"
            ),
            vec![67.0],
        ),
        (
            format!(
                "name = \"a\"\nat = \"60 ms\"\nevery = \"10 ms\"\ndo = \"stop-sync\"\n[[event]]\n\
                 after = \"a\"\ntimes = \"always\"\n{block}"
            ),
            vec![60.0, 70.0, 80.0, 90.0],
        ),
        (
            format!(
                "name = \"a\"\nat = \"60 ms\"\ndo = \"stop-sync\"\n[[event]]\nafter = \"a\"\n\
                 every = \"20 ms\"\ntimes = 2\n{block}"
            ),
            vec![60.0, 80.0],
        ),
    ] {
        let mut master = play(&format!("[[event]]\n{text}"));
        master.run_ms(45);
        assert_eq!(blocked_ms(&mut master), expected, "{text}");
    }
}

/// An act that lasts and happens again meanwhile lasts on.
#[test]
fn an_act_that_happens_again_lasts_on() {
    let mut master = play(
        "[[event]]\nwhen = { frame = { id = 0x123 } }\ntimes = \"always\"\ndo = \"block-shaft\"\n\
         drive = 1\nfor = \"10 ms\"\n",
    );
    master.send(0x123, &[]);
    master.run_ms(6);
    master.send(0x123, &[]);
    master.run_ms(20);
    let free = told(&mut master);
    let free = free.iter().filter(|(_, words)| words.ends_with(" free"));
    let free: Vec<u64> = free.map(|(us, _)| us / 1_000).collect();
    assert_eq!(free, [66]);
}

#[test]
fn conditions_come_true() {
    let event =
        |when: &str| format!("[[event]]\nwhen = {{ {when} }}\ndo = \"block-shaft\"\ndrive = 2\n");
    // The third frame that fits, by identifier, data and sender.
    let mut master = play(&event(
        "frame = { id = 0x180, mask = 0x7F0, data = \"?? 02\", from = \"outside\" }, nth = 2",
    ));
    for (id, data) in [
        (0x181_u16, [1, 2]),
        (0x190, [1, 2]),
        (0x18F, [1, 3]),
        (0x180, [9, 2]),
    ] {
        assert!(blocked_ms(&mut master).is_empty());
        master.send(id, &data);
        master.run_ms(2);
    }
    let frame = master
        .log
        .iter()
        .find(|t| t.frame.raw_id() == 0x180)
        .unwrap();
    let at_ms = frame.at.0 as f64 * 1e-6;
    let blocked = blocked_ms(&mut master);
    assert!(
        blocked.len() == 1 && (blocked[0] - at_ms).abs() < 2e-3,
        "{blocked:?} {at_ms}"
    );

    // Position, speed and current of drive 1, whose load pulls it up to speed.
    let pulled = "[[event]]\nat = \"60 ms\"\ndo = \"load-torque\"\ndrive = 1\nto = \"-1 mNm\"\n";
    for (when, looks, exact_ms) in [
        // 1 mNm less 2 % of 1.2 mNm on 4.45 g cm²: 2193 rad/s².
        (
            "drive = 1, position = \"2 turns\"",
            true,
            (2.0 * 2.0 * std::f64::consts::TAU / 2193.0_f64).sqrt() * 1e3,
        ),
        (
            "drive = 1, position = \"2 turns\", direction = \"up\"",
            true,
            (2.0 * 2.0 * std::f64::consts::TAU / 2193.0_f64).sqrt() * 1e3,
        ),
        (
            "drive = 1, position = \"2 turns\", direction = \"down\"",
            false,
            0.0,
        ),
        (
            "drive = 1, speed_above = \"100 rad/s\"",
            true,
            100.0 / 2193.0 * 1e3,
        ),
        ("drive = 1, current_above = \"1 mA\"", false, 0.0),
    ] {
        let mut master = play(&format!("{pulled}{}", event(when)));
        master.run_ms(150);
        let blocked = blocked_ms(&mut master);
        assert_eq!(blocked.len(), usize::from(looks), "{when}");
        if looks {
            let after_ms = blocked[0] - 60.0;
            assert!(
                (after_ms - exact_ms).abs() < 0.02 * exact_ms,
                "{when} {after_ms} {exact_ms}"
            );
        }
    }
    // True from the start.
    let mut master = play(&event("drive = 1, speed_below = \"1 rad/s\""));
    assert_eq!(blocked_ms(&mut master), [0.0]);

    // States, and an emergency message.
    let mut master = play(&event("drive = 1, state = \"operation enabled\", nth = 2"));
    master.enable(1, 3);
    assert!(blocked_ms(&mut master).is_empty());
    master.write_u16(1, 0x6040, 0, 0x06);
    master.write_u16(1, 0x6040, 0, 0x0F);
    assert_eq!(blocked_ms(&mut master).len(), 1);
    let mut master = play(&event("drive = 1, nmt = \"stopped\""));
    master.send(0x000, &[2, 2]);
    master.run_ms(2);
    assert!(blocked_ms(&mut master).is_empty());
    master.send(0x000, &[2, 1]);
    master.run_ms(2);
    assert_eq!(blocked_ms(&mut master).len(), 1);
    let mut master = play(&format!(
        "{}[[event]]\nat = \"60 ms\"\ndo = \"cut-motor-supply\"\ndrive = 1\n",
        event("drive = 1, emergency = 0x3220")
    ));
    master.enable(1, 3);
    master.run_ms(700);
    let emergency = master
        .log
        .iter()
        .find(|t| t.frame.raw_id() == 0x081)
        .unwrap();
    let at_ms = emergency.at.0 as f64 * 1e-6;
    let blocked = blocked_ms(&mut master);
    assert!(
        blocked.len() == 1 && (blocked[0] - at_ms).abs() < 2e-3,
        "{blocked:?} {at_ms}"
    );

    // A current, with the shaft held.
    let mut master = play(&event("drive = 1, current_above = \"300 mA\""));
    master.drive(1).plant().set_blocked(true);
    master.enable(1, 4);
    master.write_i16(1, 0x6071, 0, 100);
    master.run_ms(200);
    assert!(blocked_ms(&mut master).is_empty());
    master.write_i16(1, 0x6071, 0, 500);
    master.run_ms(200);
    assert_eq!(blocked_ms(&mut master).len(), 1);
}
