//! Network management against CiA 301 7.3.2 and CiA 302-2 (0x1F80).

mod harness;

use canopen::{Device, Dialect, NmtState, Reset, nmt::Command};
use harness::{Bench, ID, P3_LIKE, STANDARD, devices};

use NmtState::{Operational, PreOperational, Stopped};

/// Every command from every state.
#[test]
fn transitions() {
    for device in [&STANDARD, &P3_LIKE] {
        for (from, state) in [(0x01, Operational), (0x02, Stopped), (0x80, PreOperational)] {
            for (command, to) in [(0x01, Operational), (0x02, Stopped), (0x80, PreOperational)] {
                for target in [0, ID] {
                    let mut bench = Bench::new(device);
                    bench.nmt(from);
                    assert_eq!(bench.node.state(), state);
                    assert_eq!(bench.send(0, &[command, target]), []);
                    assert_eq!(bench.node.state(), to);
                    assert_eq!(bench.events.entered, (state != to).then_some(to));
                    assert_eq!(bench.events.reset, None);
                }
            }
            for (command, reset) in [(0x81, Reset::Node), (0x82, Reset::Communication)] {
                let mut bench = Bench::new(device);
                bench.nmt(from);
                assert_eq!(bench.send(0, &[command, ID]), []);
                assert_eq!(bench.events.reset, Some(reset));
                assert_eq!(bench.node.state(), state, "the owner builds the node anew");
            }
        }
    }
}

/// Only two bytes are a command, only the five specifiers are, and only for 0 or this node.
#[test]
fn what_is_no_command() {
    for device in [&STANDARD, &P3_LIKE] {
        for target in 0..=255 {
            for specifier in 0..=255 {
                let mut bench = Bench::new(device);
                let before = bench.node.state();
                assert_eq!(bench.send(0, &[specifier, target]), []);
                let obeyed =
                    matches!(specifier, 0x01 | 0x02 | 0x80..=0x82) && (target == 0 || target == ID);
                let acted = bench.node.state() != before || bench.events.reset.is_some();
                let to_same = matches!(
                    (specifier, before),
                    (0x01, Operational) | (0x80, PreOperational)
                );
                assert_eq!(acted, obeyed && !to_same, "{specifier:02X} {target:02X}");
            }
        }
        let stop = [0x02, ID, 0, 0, 0, 0, 0, 0];
        for length in [0, 1, 3, 4, 5, 6, 7, 8] {
            let mut bench = Bench::operational(device);
            assert_eq!(bench.send(0, &stop[..length]), []);
            assert_eq!(bench.node.state(), Operational, "{length} bytes");
        }
        let mut bench = Bench::operational(device);
        for frame in [
            can::Frame::remote_frame(can::StandardId::ZERO, 2),
            can::Frame::data_frame(can::ExtendedId::ZERO, &stop[..2]),
        ] {
            assert_eq!(bench.frame(frame.expect("a frame")), []);
            assert_eq!(bench.node.state(), Operational);
        }
    }
}

/// Boot-up is one byte 0x00, then the node is in the state that the dialect and 0x1F80 say.
#[test]
fn start() {
    static ALWAYS: Device = Device::new(
        &BARE,
        Dialect {
            boots_to_operational: true,
            ..Dialect::STANDARD
        },
    );
    static BARE: canopen::Dictionary<1> =
        canopen::dictionary::layout(&[&[canopen::row::u8(0x1001, 0, "Error register")]]);
    const STARTUP: canopen::Handle<u32> = devices::OBJECTS_CONST.handle(0x1F80, 0);
    for (device, startup, state) in [
        (&STANDARD, 0, PreOperational),
        (&STANDARD, 4, PreOperational),
        (&P3_LIKE, 0, Operational),
        (&P3_LIKE, 4, PreOperational),
        // Bit 2 alone decides.
        (&P3_LIKE, 0xFFFF_FFFB, Operational),
        (&P3_LIKE, 0xFFFF_FFFF, PreOperational),
    ] {
        let mut bench = Bench::unstarted(device);
        assert_eq!(bench.node.state(), NmtState::Initialising);
        assert_eq!(bench.drain(), []);
        bench.node.image().set(STARTUP, startup);
        let events = bench.node.start(bench.now);
        assert_eq!(events.entered, Some(state));
        assert_eq!(events.changed, canopen::Changed::EVERYTHING);
        assert_eq!(bench.node.state(), state);
        assert_eq!(bench.drain(), [(0x705, vec![0x00])]);
    }
    // A device without 0x1F80 goes by its dialect.
    let id = canopen::NodeId::new(127).expect("a node ID");
    let mut node = canopen::Node::new(&ALWAYS, [0u8; 1], id);
    node.start(canopen::Instant::ZERO);
    assert_eq!(node.state(), Operational);
    assert_eq!(
        node.transmit(&mut canopen::NoOwner)
            .map(|frame| frame.raw_id()),
        Some(0x77F)
    );
}

/// Before its start a node takes nothing and sends nothing.
#[test]
fn before_the_start() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::unstarted(device);
        for (id, data) in [
            (0x000, &[0x01, ID][..]),
            (0x080, &[]),
            (0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]),
            (0x205, &[1, 2, 3, 4]),
        ] {
            assert_eq!(bench.send(id, data), []);
            assert_eq!(bench.node.state(), NmtState::Initialising);
        }
        assert_eq!(bench.node.next_deadline(), canopen::Instant::NEVER);
        assert_eq!(bench.after_ms(1_000_000), []);
    }
}

/// In stopped only NMT and heartbeat live (CiA 301 table 37): nothing else is answered, whatever
/// comes on whatever identifier.
#[test]
fn stopped_answers_nothing() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::operational(device);
        bench.map(0x1800, 0x185, 1, &[0x2000_0108]);
        bench.map(0x1400, 0x205, 255, &[0x2000_0108]);
        bench.write(0x1017, 0, &[100, 0]).expect("heartbeat");
        bench.nmt(0x02);
        for id in 1..0x800 {
            for length in [0, 4, 8] {
                assert_eq!(bench.send(id, &[0x40; 8][..length]), [], "{id:03X}");
            }
        }
        assert_eq!(bench.after_ms(100), [(0x705, vec![0x04])]);
        bench.nmt(0x80);
        assert_eq!(bench.read(0x2000, 1), Ok(0));
    }
}

/// A remote frame of any identifier does no harm: node guarding, PDO requests and the like are not
/// offered.
#[test]
fn remote_frames() {
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::operational(device);
        bench.map(0x1800, 0x185, 1, &[0x2000_0108]);
        bench.map(0x1400, 0x205, 255, &[0x2000_0108]);
        let before = bench.node.bytes().to_vec();
        for id in 0..0x800 {
            for length in 0..=8 {
                let id = can::StandardId::new(id).expect("11 bits");
                let frame = can::Frame::remote_frame(id, length).expect("a frame");
                assert_eq!(bench.frame(frame), []);
                assert_eq!(bench.events, canopen::Events::NOTHING);
            }
        }
        assert_eq!(bench.node.bytes(), before);
        assert_eq!(bench.node.state(), Operational);
    }
}

/// A 29-bit frame whose number is one of ours is not ours.
#[test]
fn extended_frames() {
    let mut bench = Bench::operational(&STANDARD);
    let before = bench.node.bytes().to_vec();
    for id in 0..0x800u32 {
        for high in [0, 0x0008_0000, 0x1FFF_F800] {
            let id = can::ExtendedId::new(id | high).expect("29 bits");
            let frame = can::Frame::data_frame(id, &[0x02, ID]).expect("a frame");
            assert_eq!(bench.frame(frame), []);
            assert_eq!(bench.events, canopen::Events::NOTHING);
        }
    }
    assert_eq!(bench.node.bytes(), before);
}

/// The numbers of the standard, both ways.
#[test]
fn numbers() {
    for byte in 0..=255u8 {
        let command = match byte {
            0x01 => Some(Command::Start),
            0x02 => Some(Command::Stop),
            0x80 => Some(Command::EnterPreOperational),
            0x81 => Some(Command::ResetNode),
            0x82 => Some(Command::ResetCommunication),
            _ => None,
        };
        assert_eq!(Command::from_byte(byte), command);
        // Bit 7 is the toggle of node guarding.
        let state = match byte & 0x7F {
            0x00 => Some(NmtState::Initialising),
            0x04 => Some(Stopped),
            0x05 => Some(Operational),
            0x7F => Some(PreOperational),
            _ => None,
        };
        assert_eq!(NmtState::from_heartbeat(byte), state);
        assert_eq!(
            canopen::NodeId::new(byte).map(canopen::NodeId::get),
            (1..=127).contains(&byte).then_some(byte)
        );
    }
}

/// Reset communication: the communication parameters are what is stored, or their defaults; the
/// application's objects and the error history stay; then boot-up.
#[test]
fn reset_communication() {
    use canopen::{Image, store};
    for device in [&STANDARD, &P3_LIKE] {
        let mut bench = Bench::operational(device);
        bench.write(0x1017, 0, &[100, 0]).expect("heartbeat");
        bench.map(0x1800, 0x1B5, 1, &[0x2000_0108]);
        let mut bytes = bench.node.bytes().to_vec();
        let mut stored = [0; 1024];
        let used = store::save(
            &device.table,
            &Image::new(&mut bytes),
            bench.node.id(),
            store::Request::Communication,
            &[],
            &mut stored,
        )
        .expect("room");
        bench.write(0x1017, 0, &[50, 0]).expect("heartbeat");
        bench.write(0x2000, 1, &[7]).expect("an application object");
        bench.node.announce(0x1000, 1, [0; 5], bench.now);
        bench.drain();
        let mut damaged = stored;
        damaged[used - 1] ^= 1;
        for (stored, heartbeat, sent) in [
            (&stored[..used], 100, &[(0x1B5, vec![7])][..]),
            (&[][..], 0, &[]),
            (&damaged[..used], 0, &[]),
        ] {
            // A frame that waits is not sent any more.
            bench.node.announce(0x0000, 0, [0; 5], bench.now);
            bench.node.restart_communication(stored, bench.node.id());
            bench.node.start(bench.now);
            assert_eq!(bench.drain(), [(0x705, vec![0])]);
            assert_eq!(bench.read(0x1017, 0), Ok(heartbeat));
            assert_eq!(bench.read(0x2000, 1), Ok(7));
            assert_eq!(bench.read(0x1003, 1), Ok(0x1000));
            bench.nmt(0x01);
            assert_eq!(bench.sync(), sent);
        }
    }
}
