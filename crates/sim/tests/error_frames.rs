//! Error messages of the controller of outside programs, as a real one's driver tells them.

mod master;
use master::*;

use bus::ErrorFrame;
use canopen::Instant;
use sim::{
    BitPlace, Bus, BusSettings, ErrorSeen, Happening, Injection, Participant, Recording, RunHeader,
    WhichFrames, WireAct, WireFault, replay,
};

fn settings(error_frames: bool) -> BusSettings {
    BusSettings {
        error_frames,
        ..BusSettings::new(5, vec![p3(1), p3(2)])
    }
}

fn flip(bit: BitPlace, seen_by: Option<Participant>) -> WireAct {
    WireAct::Flip {
        frames: WhichFrames::NEXT,
        bit,
        seen_by,
    }
}

fn booted() -> Bus {
    let mut bus = Bus::new(settings(true));
    bus.run_until(Instant::ZERO.plus_ms(50));
    let errors = errors(&mut bus);
    assert!(errors.is_empty(), "{errors:?}");
    bus
}

fn errors(bus: &mut Bus) -> Vec<ErrorSeen> {
    let all = bus.take_happenings().into_iter();
    all.filter_map(|happening| match happening {
        Happening::Error(error) => Some(error),
        _ => None,
    })
    .collect()
}

#[test]
fn each_kind_of_error_is_told_with_its_place() {
    let outside = Some(Participant::Outside);
    let sent = frame(0x555, &[0x55; 4]);
    let data = BitPlace::Number(30);
    for (what, act, by_outside, class, particulars, counters) in [
        ("bit", flip(data, None), true, 0x288, [0x81, 0x0A], [8, 0]),
        (
            "bit for itself",
            flip(data, outside),
            true,
            0x288,
            [0x81, 0x0A],
            [8, 0],
        ),
        (
            "acknowledge",
            flip(BitPlace::AckSlot, None),
            true,
            0x2A0,
            [0x80, 0x19],
            [8, 0],
        ),
        (
            "end",
            flip(BitPlace::EndOfFrame(3), None),
            true,
            0x288,
            [0x81, 0x1A],
            [8, 0],
        ),
        // Of a drive's frame: by the flag of who found it, or by itself.
        (
            "stuff",
            flip(data, None),
            false,
            0x288,
            [0x04, 0x0A],
            [0, 1],
        ),
        (
            "CRC",
            flip(BitPlace::Number(60), outside),
            false,
            0x288,
            [0x00, 0x08],
            [0, 1],
        ),
        (
            "form",
            flip(BitPlace::CrcDelimiter, None),
            false,
            0x288,
            [0x02, 0x18],
            [0, 1],
        ),
    ] {
        let mut bus = booted();
        if !by_outside {
            // The question first: the answer is spoilt.
            bus.send(0, frame(0x601, &[0x40, 0x00, 0x10, 0]));
            bus.run_until(bus.now().plus_us(60));
        }
        bus.act(act).unwrap();
        if by_outside {
            bus.send(0, sent);
        }
        bus.run_until(bus.now().plus_ms(1));
        let errors = errors(&mut bus);
        assert_eq!(errors.len(), 1, "{what}: {errors:?}");
        let ErrorFrame { class: seen, data } = errors[0].frame;
        assert_eq!(seen, class, "{what}: {data:02X?}");
        assert_eq!(data[2..4], particulars, "{what}");
        assert_eq!(data[6..], counters, "{what}");
    }
}

#[test]
fn the_way_into_bus_off_and_out_of_it() {
    let mut bus = booted();
    let act = WireAct::Break {
        fault: WireFault::Recessive,
        for_ns: 1_000_000,
    };
    bus.act(act).unwrap();
    bus.send(0, frame(0x7F0, &[]));
    bus.run_until(bus.now().plus_ms(10));
    let errors = errors(&mut bus);
    let of = |class: u32| {
        errors
            .iter()
            .filter(move |e| e.frame.class & class != 0)
            .collect::<Vec<_>>()
    };
    let passive = of(0x004);
    assert_eq!(passive.len(), 1);
    assert_eq!(passive[0].frame.data, [0, 0x20, 0, 0, 0, 0, 128, 0]);
    let (off, on) = (of(0x040), of(0x100));
    assert_eq!((off.len(), on.len()), (1, 1));
    assert_eq!(off[0].frame.data[6], 255, "eight bits");
    assert_eq!(on[0].at.since_ns(off[0].at), 1_408_000);
}

/// A recording with them is repeated byte for byte, and without them it is the same but for them.
#[test]
fn recordings_may_have_them() {
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("error_frames");
    std::fs::create_dir_all(&folder).unwrap();
    let record = |name: &str, error_frames| {
        let log = folder.join(name);
        let settings = settings(error_frames);
        let mut recording = Recording::create(&log, &RunHeader::of(&settings)).unwrap();
        let mut bus = Bus::new(settings);
        for n in 0..200_u64 {
            let at = Instant::ZERO.plus_ns(30_000_000 + n * 555_555);
            bus.run_until(at);
            if n % 10 == 0 {
                let act = flip(BitPlace::Number(n as u16 / 3), None);
                recording.act(at, &act).unwrap();
                bus.act(act).unwrap();
            }
            let frame = frame(0x601 + (n % 2) as u16, &[0x40, 0x00, 0x10, 0]);
            let injection = Injection {
                at,
                client: 1,
                frame,
            };
            recording.injection(&injection).unwrap();
            bus.send(1, frame);
        }
        bus.run_until(bus.now().plus_ms(5));
        for happening in bus.take_happenings() {
            recording.happening(&happening).unwrap();
        }
        recording.finish(bus.now()).unwrap();
        let mut again = Vec::new();
        replay(&log, &mut again).unwrap();
        let original = std::fs::read(&log).unwrap();
        assert!(original == again, "{name}");
        String::from_utf8(original).unwrap()
    };
    let with = record("with.log", true);
    let without = record("without.log", false);
    let is_error = |line: &&str| line.contains(" can0 2000");
    assert_eq!(with.lines().filter(is_error).count(), 20);
    let frames: Vec<&str> = with.lines().filter(|line| !is_error(line)).collect();
    assert_eq!(frames, without.lines().collect::<Vec<_>>());
}
