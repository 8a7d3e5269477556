//! Errors of communication that a node notices: what a drive that knows them sends, and one that
//! does not. Each is provoked by frames, or by their absence.

use can::Frame;
use canopen::{Instant, NodeId};
use drive::{Drive, Hardware, Health, NoHost};
use personalities::{Personality, p3, p3_extended};

/// A drive, its clock, and what it has sent.
struct Bench {
    drive: Drive<Vec<u8>>,
    ms: u64,
}

impl Bench {
    fn new(personality: &'static Personality) -> Bench {
        let hardware = Hardware {
            scales: plant::VIRTUAL_P3.scales,
            duty_margin: 0.0,
        };
        let memory = vec![0; personality.device.table.image_bytes()];
        let id = NodeId::new(5).expect("a node ID");
        let made = Drive::new(personality, hardware, memory, id, 1, &[], Health::default());
        let (mut drive, _) = made.expect("defaults that make a drive");
        drive.start(Instant::ZERO);
        Bench { drive, ms: 0 }
    }

    fn send(&mut self, id: u16, data: &[u8]) {
        let mut bytes = [0; 8];
        bytes[..data.len()].copy_from_slice(data);
        let frame = Frame::classic(id, bytes, data.len() as u8);
        let now = Instant::ZERO.plus_ms(self.ms);
        self.drive.receive(&frame, now, &mut NoHost);
    }

    /// An expedited download, whatever comes of it.
    fn write(&mut self, index: u16, sub: u8, value: u32, bytes: u8) {
        let [low, high] = index.to_le_bytes();
        let [d0, d1, d2, d3] = value.to_le_bytes();
        let command = 0x23 | (4 - bytes) << 2;
        self.send(0x605, &[command, low, high, sub, d0, d1, d2, d3]);
    }

    /// A receive PDO of two bytes at 0x205, applied at once, which must come every 20 ms if
    /// `deadline_ms` says so; operational.
    fn map(&mut self, deadline_ms: u32) {
        self.write(0x1400, 1, 0x8000_0205, 4);
        self.write(0x1400, 5, deadline_ms, 2);
        self.write(0x1600, 0, 0, 1);
        self.write(0x1600, 1, 0x6071_0010, 4);
        self.write(0x1600, 0, 1, 1);
        self.write(0x1400, 1, 0x205, 4);
        self.send(0x000, &[1, 5]);
    }

    /// The emergencies of the next millisecond: code, error register, code of the ended error.
    fn tick(&mut self) -> Vec<(u16, u8, u16)> {
        self.ms += 1;
        self.drive.poll(Instant::ZERO.plus_ms(self.ms), &mut NoHost);
        let mut seen = Vec::new();
        while let Some(frame) = self.drive.transmit(&mut NoHost) {
            if frame.raw_id() == 0x85 {
                let bytes = frame.bytes();
                let code = u16::from_le_bytes([bytes[0], bytes[1]]);
                seen.push((code, bytes[2], u16::from_le_bytes([bytes[6], bytes[7]])));
            }
        }
        seen
    }

    fn ticks(&mut self, count: u32) -> Vec<(u16, u8, u16)> {
        (0..count).flat_map(|_| self.tick()).collect()
    }
}

/// One error: how it comes, how it goes, and in which millisecond it is told. A time that is over in
/// one millisecond is told in the next.
struct Case {
    code: u16,
    provoke: fn(&mut Bench),
    told_ms: u32,
    mend: fn(&mut Bench),
}

/// CiA 301 7.2.7.1, table 26.
const CASES: &[Case] = &[
    Case {
        code: 0x8130,
        provoke: |bench| {
            bench.write(0x1016, 1, 0x0007_000A, 4);
            bench.send(0x707, &[0x05]);
        },
        told_ms: 10 + 1,
        mend: |bench| bench.send(0x707, &[0x05]),
    },
    Case {
        code: 0x8250,
        provoke: |bench| {
            bench.map(20);
            bench.send(0x205, &[0, 0]);
        },
        told_ms: 20 + 1,
        mend: |bench| bench.send(0x205, &[0, 0]),
    },
    Case {
        code: 0x8210,
        provoke: |bench| {
            bench.map(0);
            bench.send(0x205, &[0]);
        },
        told_ms: 1,
        mend: |bench| bench.send(0x205, &[0, 0]),
    },
    Case {
        code: 0x8220,
        provoke: |bench| {
            bench.map(0);
            bench.send(0x205, &[0, 0, 0]);
        },
        told_ms: 1,
        mend: |bench| bench.send(0x205, &[0, 0]),
    },
    Case {
        code: 0x8240,
        provoke: |bench| bench.send(0x080, &[1]),
        told_ms: 1,
        mend: |bench| bench.send(0x080, &[]),
    },
];

#[test]
fn each_has_its_code_and_is_a_warning_of_communication() {
    for case in CASES {
        let mut bench = Bench::new(&p3_extended::P3_EXTENDED);
        assert_eq!(bench.ticks(3), []);
        (case.provoke)(&mut bench);
        let code = case.code;
        // Generic and communication.
        assert_eq!(bench.ticks(case.told_ms - 1), [], "0x{code:04X}: too early");
        assert_eq!(bench.tick(), [(code, 0x11, 0)], "0x{code:04X}");
        // It lasts, and is told once.
        assert_eq!(bench.ticks(10), [], "0x{code:04X}");
        assert!(bench.drive.comms().axis().statusword().warning());
        (case.mend)(&mut bench);
        assert_eq!(bench.tick(), [(0, 0, code)], "0x{code:04X}");
        assert_eq!(bench.tick(), [], "0x{code:04X}");
        assert!(!bench.drive.comms().axis().statusword().warning());
        let state = bench.drive.comms().axis().state();
        assert_eq!(state, cia402::State::SwitchOnDisabled, "no fault");
    }
}

/// An error that comes and goes within a millisecond is told all the same, and once however often
/// it comes.
#[test]
fn a_short_error_is_not_overlooked() {
    let mut bench = Bench::new(&p3_extended::P3_EXTENDED);
    bench.map(0);
    assert_eq!(bench.tick(), []);
    for _ in 0..2 {
        bench.send(0x205, &[0]);
        bench.send(0x205, &[0, 0]);
    }
    assert_eq!(bench.tick(), [(0x8210, 0x11, 0)]);
    assert_eq!(bench.tick(), [(0, 0, 0x8210)]);
    assert_eq!(bench.tick(), []);
}

/// What the controller says of itself while it is error passive.
fn error_passive() -> Health {
    Health {
        error_passive: true,
        ..Health::default()
    }
}

#[test]
fn the_controller_tells_that_it_is_error_passive() {
    let mut bench = Bench::new(&p3_extended::P3_EXTENDED);
    assert_eq!(bench.tick(), []);
    // However often it is reported in a millisecond, and in however many, it is told once. The
    // statusword shows it from the next millisecond on.
    for ms in 0..11 {
        for _ in 0..2 {
            bench.drive.report(error_passive());
            bench.drive.report(Health::default());
        }
        let expected: &[(u16, u8, u16)] = if ms == 0 { &[(0x8120, 0x11, 0)] } else { &[] };
        assert_eq!(bench.tick(), expected, "{ms}");
        let warning = bench.drive.comms().axis().statusword().warning();
        assert_eq!(warning, ms > 0, "{ms}");
    }
    assert_eq!(bench.tick(), [(0, 0, 0x8120)]);
    assert_eq!(bench.tick(), []);
    assert!(!bench.drive.comms().axis().statusword().warning());
    let state = bench.drive.comms().axis().state();
    assert_eq!(state, cia402::State::SwitchOnDisabled, "no fault");
}

#[test]
fn the_faithful_drive_knows_none_of_them() {
    for case in CASES {
        let mut bench = Bench::new(&p3::P3);
        (case.provoke)(&mut bench);
        assert_eq!(bench.ticks(case.told_ms + 10), [], "0x{:04X}", case.code);
    }
    let mut bench = Bench::new(&p3::P3);
    for _ in 0..5 {
        bench.drive.report(error_passive());
        assert_eq!(bench.tick(), []);
    }
    assert!(!bench.drive.comms().axis().statusword().warning());
}

/// 0x1029,1: what a bus-off does to the NMT state (CiA 301 7.5.2.29).
#[test]
fn bus_off_leaves_operational_as_the_error_behaviour_says() {
    use canopen::NmtState::{Operational, PreOperational, Stopped};
    let p3_extended = &p3_extended::P3_EXTENDED;
    for (personality, behaviour, expected) in [
        (p3_extended, 0, PreOperational),
        (p3_extended, 1, Operational),
        (p3_extended, 2, Stopped),
        (&p3::P3, 0, Operational),
    ] {
        let mut bench = Bench::new(personality);
        bench.write(0x1029, 1, behaviour, 1);
        bench.send(0x000, &[1, 5]);
        bench.tick();
        bench.drive.report(Health {
            bus_off_recovered: true,
            ..Health::default()
        });
        bench.tick();
        bench.tick();
        assert_eq!(bench.drive.comms().node().state(), expected, "{behaviour}");
    }
}

/// 0x6007, and 0x2405 as the drive starts with it: 0.
#[test]
fn bus_off_under_power_is_a_lost_connection() {
    use cia402::State;
    for (option, enabled, state, told) in [
        (0, true, State::OperationEnabled, false),
        (1, true, State::Fault, true),
        (1, false, State::ReadyToSwitchOn, false),
        (2, true, State::SwitchOnDisabled, false),
        (3, true, State::QuickStopActive, false),
    ] {
        let mut bench = Bench::new(&p3_extended::P3_EXTENDED);
        bench.write(0x6007, 0, option, 2);
        bench.write(0x605A, 0, 6, 2);
        bench.write(0x6060, 0, 3, 1);
        bench.write(0x6040, 0, 0x06, 2);
        if enabled {
            bench.write(0x6040, 0, 0x0F, 2);
        }
        assert_eq!(bench.ticks(3), []);
        bench.drive.report(Health {
            bus_off_recovered: true,
            ..Health::default()
        });
        let expected: &[(u16, u8, u16)] = if told { &[(0x8140, 0x11, 0)] } else { &[] };
        assert_eq!(bench.ticks(5), expected, "{option}");
        assert_eq!(bench.drive.comms().axis().state(), state, "{option}");
        if told {
            // Latched until it is reset.
            assert!(!bench.drive.comms().axis().statusword().warning());
            bench.write(0x6040, 0, 0x80, 2);
            assert_eq!(bench.ticks(2), [(0, 0, 0x8140)]);
            let state = bench.drive.comms().axis().state();
            assert_eq!(state, State::SwitchOnDisabled);
        }
    }
    // The faithful drive has no such object.
    let mut bench = Bench::new(&p3::P3);
    bench.write(0x6040, 0, 0x86, 2);
    bench.write(0x6040, 0, 0x0F, 2);
    bench.drive.report(Health {
        bus_off_recovered: true,
        ..Health::default()
    });
    assert_eq!(bench.ticks(5), []);
    assert_eq!(bench.drive.comms().axis().state(), State::OperationEnabled);
}
