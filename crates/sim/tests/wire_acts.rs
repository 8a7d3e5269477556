//! What is done to the wire on purpose, and what the drives make of it.

mod master;
use master::*;

use can::{Frame, StandardId};
use canopen::Instant;
use personalities::{Personality, p3, p3_extended};
use sim::{
    BitPlace, Bus, BusSettings, DriveSettings, ImpossibleAct, Injection, Participant, Place,
    Recording, RunHeader, Sender, WhichFrames, WireAct, WireFault, replay,
};

fn drive(node: u8) -> Participant {
    Participant::Drive(Place::of_node(id(node)))
}

fn with_id(raw: u16) -> WhichFrames {
    WhichFrames::with_id(StandardId::new(raw).unwrap())
}

fn count(master: &Master, raw: u32) -> usize {
    let frames = master.log.iter();
    frames.filter(|t| t.frame.raw_id() == raw).count()
}

/// Transmit and receive error counter.
fn errors(master: &mut Master, node: u8) -> (u16, u16) {
    let counters = master.drive(node).error_counters();
    (counters.transmit, counters.receive)
}

/// Each bit of a request, flipped for everybody or for one: the drive gets it once, and answers once.
fn flip_each_bit(personality: &'static Personality, request: Frame) {
    let settings = |node| DriveSettings::new(id(node), personality);
    let mut master = Master::with(vec![settings(1), settings(2)]);
    for bit in 0..request.frame_bits() {
        for seen_by in [
            None,
            Some(drive(1)),
            Some(drive(2)),
            Some(Participant::Outside),
        ] {
            let flip = WireAct::Flip {
                frames: with_id(0x601),
                bit: BitPlace::Number(bit),
                seen_by,
            };
            master.bus.act(flip).unwrap();
            master.log.clear();
            let status = master.status(1);
            assert_eq!(status & 0x6F, SWITCH_ON_DISABLED);
            master.run_ms(2);
            // In its last two bits a frame is good for some already when others destroy it.
            let (frames, answers) = match request.frame_bits() - bit {
                1 if seen_by.is_none() || seen_by == Some(Participant::Outside) => (2, 2),
                2 if seen_by == Some(drive(1)) => (2, 1),
                2 if seen_by.is_some() => (2, 2),
                _ => (1, 1),
            };
            let sent = master.log.iter().filter(|t| t.frame.raw_id() == 0x601);
            assert!(sent.clone().all(|t| t.frame == request), "{request:?}");
            assert_eq!(sent.count(), frames, "bit {bit} for {seen_by:?}");
            assert_eq!(count(&master, 0x581), answers, "bit {bit} for {seen_by:?}");
        }
        // Errors are forgotten by good frames.
        for _ in 0..40 {
            master.send(0x7FF, &[]);
        }
        master.run_ms(3);
    }
    assert!(master.bus.take_notices().is_empty());
}

#[test]
fn a_request_with_any_bit_flipped_is_answered() {
    let request = [0x40, 0x41, 0x60, 0, 0, 0, 0, 0];
    // As long as the manual has it, and as CiA 301 has it.
    flip_each_bit(&p3::P3, frame(0x601, &request[..4]));
    flip_each_bit(&p3_extended::P3_EXTENDED, frame(0x601, &request));
}

#[test]
fn a_flip_in_the_last_bit_doubles_a_frame() {
    let mut master = Master::new(&[1, 2]);
    let flip = |raw| WireAct::Flip {
        frames: with_id(raw),
        bit: BitPlace::EndOfFrame(7),
        seen_by: None,
    };
    // A drive's frame reaches outside programs twice.
    master.bus.act(flip(0x581)).unwrap();
    master.status(1);
    master.run_ms(1);
    assert_eq!(count(&master, 0x581), 2);
    assert!(master.log.iter().all(|t| t.copies == 1));
    // An outside program's frame is sent again; it is through the second time.
    master.log.clear();
    master.bus.act(flip(0x7F0)).unwrap();
    master.send(0x7F0, &[1]);
    master.run_ms(1);
    let copies: Vec<u8> = master.log.iter().map(|t| t.copies).collect();
    assert_eq!(copies, [0, 1]);
    assert_eq!(master.bus.outside_error_counters().transmit, 7);
    assert_eq!(master.bus.outside_waiting(), 0);
}

#[test]
fn acts_meet_the_frames_that_they_are_about() {
    let mut master = Master::new(&[1, 2]);
    let flip = WireAct::Flip {
        frames: WhichFrames {
            sender: Some(drive(2)),
            skip: 1,
            times: 2,
            ..WhichFrames::NEXT
        },
        bit: BitPlace::Number(20),
        seen_by: None,
    };
    master.bus.act(flip).unwrap();
    // The repetition of the second one is the third.
    for (n, transmit) in [0, 15, 14, 13].into_iter().enumerate() {
        master.status(1);
        master.status(2);
        master.run_us(500);
        assert_eq!(errors(&mut master, 2), (transmit, 0), "{n}");
        assert_eq!(errors(&mut master, 1).0, 0);
    }
}

#[test]
fn a_receiver_loses_frames_that_it_has_acknowledged() {
    let mut master = Master::new(&[1, 2]);
    let lose = |raw, times, receiver| WireAct::Lose {
        frames: WhichFrames {
            times,
            ..with_id(raw)
        },
        receiver,
    };
    master.bus.act(lose(0x601, 2, drive(1))).unwrap();
    for answers in [0, 0, 1] {
        master.log.clear();
        master.send(0x601, &[0x40, 0x41, 0x60, 0]);
        master.run_ms(2);
        assert_eq!((count(&master, 0x601), count(&master, 0x581)), (1, answers));
    }
    master
        .bus
        .act(lose(0x581, 1, Participant::Outside))
        .unwrap();
    master.log.clear();
    master.status(1);
    let copies: Vec<u8> = master.log.iter().map(|t| t.copies).collect();
    assert_eq!(copies, [1, 0]);
    for node in [1, 2] {
        assert_eq!(errors(&mut master, node), (0, 0));
    }
}

#[test]
fn who_is_held_back_sends_later() {
    let mut master = Master::new(&[1, 2]);
    let from = master.now();
    let for_ns = 3_000_000;
    master
        .bus
        .act(WireAct::Hold {
            who: drive(1),
            for_ns,
        })
        .unwrap();
    for node in [1, 2] {
        master.send(0x600 + node, &[0x40, 0x41, 0x60, 0]);
    }
    master.run_ms(10);
    let ends = |raw: u32| {
        let found = master.log.iter().find(|t| t.frame.raw_id() == raw).unwrap();
        (
            found.at.since_ns(from),
            u64::from(found.frame.frame_bits()) * 1000,
        )
    };
    let (late, bits) = ends(0x581);
    assert_eq!(late, for_ns + bits);
    assert!(ends(0x582).0 < 1_000_000);
    let who = Participant::Outside;
    let from = master.now();
    master.bus.act(WireAct::Hold { who, for_ns }).unwrap();
    master.send(0x7FF, &[]);
    master.run_ms(10);
    let late = master.log.last().unwrap().at.since_ns(from);
    assert_eq!(
        late,
        for_ns + u64::from(frame(0x7FF, &[]).frame_bits()) * 1000
    );
}

#[test]
fn a_babbling_node_takes_what_its_identifier_gives_it() {
    let mut master = Master::new(&[1]);
    let babble = |raw, every_ns| WireAct::Flood {
        frame: frame(raw, &[0xAA; 8]),
        every_ns,
        for_ns: 20_000_000,
    };
    // At a rate: every millisecond, beside the others.
    master.bus.act(babble(0x7F1, 1_000_000)).unwrap();
    master.status(1);
    master.run_ms(30);
    assert_eq!(count(&master, 0x7F1), 20);
    assert!(master.log.iter().any(|t| t.sender == Sender::Stranger));
    // Back to back with the lowest identifier nobody else gets the wire, until it is over.
    master.log.clear();
    let from = master.now();
    master.bus.act(babble(0x001, 0)).unwrap();
    master.run_us(100);
    master.send(0x601, &[0x40, 0x41, 0x60, 0]);
    master.run_ms(30);
    let bits = u64::from(frame(0x001, &[0xAA; 8]).wire_bits());
    // Eleven bits until it knows that the wire is free.
    assert_eq!(
        count(&master, 0x001) as u64,
        (20_000 - 11_u64).div_ceil(bits)
    );
    let request = master
        .log
        .iter()
        .find(|t| t.frame.raw_id() == 0x601)
        .unwrap();
    assert!(request.at.since_ns(from) > 20_000_000);
    assert_eq!(count(&master, 0x581), 1);
    // With the highest one it takes what is left.
    master.log.clear();
    master.bus.act(babble(0x7FF, 0)).unwrap();
    for _ in 0..10 {
        master.status(1);
    }
    assert!(count(&master, 0x7FF) >= 10);
}

#[test]
fn what_is_impossible_is_refused() {
    let mut master = Master::new(&[1]);
    let place = Place::of_node(id(2));
    let refused = master.bus.act(WireAct::Disconnect(drive(2)));
    assert_eq!(refused, Err(ImpossibleAct::NoDrive(place)));
    let flip = |bit, times| WireAct::Flip {
        frames: WhichFrames {
            times,
            ..WhichFrames::NEXT
        },
        bit,
        seen_by: None,
    };
    let bit = BitPlace::EndOfFrame(8);
    assert_eq!(master.bus.act(flip(bit, 1)), Err(ImpossibleAct::NoBit(bit)));
    assert_eq!(
        master.bus.act(flip(BitPlace::AckSlot, 0)),
        Err(ImpossibleAct::NoFrames)
    );
    let refused = master.bus.act(WireAct::Connect(Participant::Stranger));
    assert_eq!(refused, Err(ImpossibleAct::Stranger));
    assert_eq!(master.status(1) & 0x6F, SWITCH_ON_DISABLED);
}

/// All kinds of acts, recorded and replayed; and the same run with every bit looked at.
#[test]
fn a_run_with_acts_repeats_byte_for_byte() {
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("wire_acts");
    std::fs::create_dir_all(&folder).unwrap();
    let log = folder.join("acts.log");
    let settings = || BusSettings::new(11, vec![p3(1), p3(2)]);
    let frames = WhichFrames {
        times: 3,
        ..WhichFrames::NEXT
    };
    let flip = |bit, seen_by| WireAct::Flip {
        frames,
        bit,
        seen_by,
    };
    let acts = [
        flip(BitPlace::Number(33), None),
        flip(BitPlace::EndOfFrame(7), Some(drive(2))),
        flip(BitPlace::EndOfFrame(6), Some(drive(1))),
        WireAct::Lose {
            frames,
            receiver: Participant::Outside,
        },
        WireAct::Hold {
            who: drive(1),
            for_ns: 5_000_000,
        },
        WireAct::Flood {
            frame: frame(0x100, &[1]),
            every_ns: 333_333,
            for_ns: 9_000_000,
        },
        WireAct::Disconnect(drive(2)),
        WireAct::Connect(drive(2)),
        WireAct::Break {
            fault: WireFault::Recessive,
            for_ns: 2_000_000,
        },
        WireAct::Break {
            fault: WireFault::Dominant,
            for_ns: 2_000_000,
        },
    ];
    let run = |mut recording: Option<&mut Recording>, every_bit: bool| {
        let mut bus = Bus::new(settings());
        if every_bit {
            bus.look_at_every_bit();
        }
        for n in 0..600_u64 {
            let at = Instant::ZERO.plus_ns(30_000_000 + n * 277_777);
            bus.run_until(at);
            if n % 50 == 20
                && let Some(act) = acts.get(n as usize / 50)
            {
                if let Some(recording) = &mut recording {
                    recording.act(at, act).unwrap();
                }
                bus.act(*act).unwrap();
            }
            let frame = frame(0x601 + (n % 2) as u16, &[0x40, 0x00, 0x10, 0]);
            let injection = Injection {
                at,
                client: 1,
                frame,
            };
            if let Some(recording) = &mut recording {
                recording.injection(&injection).unwrap();
            }
            bus.send(1, frame);
        }
        bus.run_until(bus.now().plus_ms(20));
        (bus.take_traffic(), bus.now())
    };
    let mut recording = Recording::create(&log, &RunHeader::of(&settings())).unwrap();
    let (traffic, end) = run(Some(&mut recording), false);
    for traffic in &traffic {
        recording.frame(traffic).unwrap();
    }
    let frames = recording.finish(end).unwrap();
    assert!(frames > 1000, "{frames}");
    let original = std::fs::read(&log).unwrap();
    let mut again = Vec::new();
    assert_eq!(replay(&log, &mut again).unwrap().frames, frames);
    assert!(original == again);
    let bits = run(None, true).0;
    let pairs = bits.iter().zip(&traffic);
    for (n, (bit, whole)) in pairs.enumerate() {
        assert_eq!(bit, whole, "frame {n}");
    }

    let run = folder.join("acts.log.run");
    let causes = std::fs::read_to_string(&run).unwrap();
    assert_eq!(causes.matches("\nwire ").count(), acts.len());
    for (line, what) in [
        ("wire 1.000000000 flop", ":18: "),
        ("wire 1.000000000 hold 5 5ns", "no drive 5"),
        ("wire 1.0 connect 1", "nine digits"),
    ] {
        std::fs::write(&run, format!("servobus run 1\ndrive 1 p3\n{line}\n")).unwrap();
        let message = replay(&log, &mut Vec::new()).unwrap_err().to_string();
        assert!(message.contains(what), "{message}");
    }
}

/// A frame that nobody has asked for never comes, whatever is done.
#[test]
fn nobody_hears_a_wrong_frame() {
    let mut master = Master::new(&[1, 2]);
    let asked: Frame = frame(0x7F3, &[0x12, 0x34, 0x56, 0x78]);
    for n in 0..500_u32 {
        let flip = WireAct::Flip {
            frames: WhichFrames::NEXT,
            bit: BitPlace::Number((n % u32::from(asked.wire_bits())) as u16),
            seen_by: [None, Some(drive(1)), Some(Participant::Outside)][n as usize % 3],
        };
        master.bus.act(flip).unwrap();
        master.bus.send(0, asked);
        master.run_us(700);
    }
    assert!(master.log.iter().all(|t| t.frame == asked));
    assert!(
        (500..520).contains(&master.log.len()),
        "{}",
        master.log.len()
    );
}
