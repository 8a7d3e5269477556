//! Coming, going, and frames in both directions.

use crate::peer::Peer;
use crate::{frame_from, joined, next, numbered, open};
use bus::Protocol::{Slcan, Socketcand};
use bus::{Doors, Endpoint, Event, LeaveReason, OpenError, Options};
use can::{ExtendedId, Frame, StandardId};
use std::net::TcpListener;
use std::time::Duration;

/// Every answer is read by one call, alone, even if frames are under way: python-can compares it
/// as a whole.
#[test]
fn socketcand_answers_stand_alone() {
    let mut doors = open(&Options::default());
    let mut peer = Peer::connect(&doors, Socketcand);
    assert_eq!(peer.one_read(), "< hi >");
    peer.say("< open can0 >");
    assert_eq!(peer.one_read(), "< ok >");
    assert_eq!(doors.take(), None, "not on the bus before raw mode");
    peer.say("< rawmode >");
    joined(&mut doors);
    doors.deliver(&numbered(7), 2_000, None);
    // Even if it is a little slow to read.
    std::thread::sleep(Duration::from_millis(10));
    assert_eq!(peer.one_read(), "< ok >");
    assert_eq!(peer.one_read(), "< frame 300 0.000002 07000000 >");
}

/// Who speaks need not wait for frames: they come without the delay after joining.
#[test]
fn frames_flow_at_once_when_the_client_speaks() {
    let mut doors = open(&Options::default());
    let mut peer = Peer::connect(&doors, Socketcand);
    peer.say("< open can0 >< rawmode >< send 080 0 >");
    let client = joined(&mut doors);
    assert_eq!(frame_from(&mut doors, client).to_string(), "080#");
    doors.deliver(&numbered(1), 0, None);
    peer.expect("< hi >< ok >< ok >< frame 300 0.000000 01000000 >");
}

#[test]
fn messages_in_pieces() {
    let mut doors = open(&Options::default());
    let mut peer = Peer::join(&doors, Socketcand);
    let client = joined(&mut doors);
    for byte in ["< se", "nd 12", "3 2 1 ", "ff", " >< send 00000080 0  >"] {
        peer.say(byte);
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(frame_from(&mut doors, client).to_string(), "123#01FF");
    assert_eq!(frame_from(&mut doors, client).to_string(), "00000080#");
    peer.say("< echo >");
    peer.expect("< echo >");
}

#[test]
fn slcan_flows_only_while_open() {
    let mut doors = open(&Options::default());
    let mut peer = Peer::connect(&doors, Slcan);
    peer.say("C\rS6\r\rt1230\r");
    peer.expect("\x07\r\r\x07");
    assert_eq!(doors.take(), None);
    peer.say("O\rO\rt12320102\r");
    peer.expect("\r\x07z\r");
    let Event::Joined {
        client,
        door: 1,
        listen_only: false,
        bit_rate: Some(500_000),
        peer: from,
    } = next(&mut doors)
    else {
        panic!()
    };
    assert_eq!(from, bus::Peer::Tcp(peer.stream.local_addr().unwrap()));
    assert_eq!(frame_from(&mut doors, client).to_string(), "123#0102");
    let remote = Frame::remote_frame(ExtendedId::new(5).unwrap(), 2).unwrap();
    doors.deliver(&remote, 0, None);
    peer.expect("R000000052\r");
    peer.say("Z1\r");
    peer.expect("\r");
    doors.deliver(&numbered(0xAB), 1_234_567_890, None);
    // 1234 ms = 4D2h.
    peer.expect("t3004AB00000004D2\r");

    peer.say("C\r");
    peer.expect("\r");
    // The simulation has not taken the leaving yet, and goes on delivering.
    doors.deliver(&numbered(1), 0, None);
    assert_eq!(
        next(&mut doors),
        Event::Left {
            client,
            reason: LeaveReason::ChannelClosed
        }
    );
    doors.deliver(&numbered(2), 0, None);
    peer.hears_nothing();

    peer.say("L\r");
    peer.expect("\r");
    let Event::Joined {
        client: again,
        listen_only: true,
        ..
    } = next(&mut doors)
    else {
        panic!()
    };
    assert_ne!(again, client);
    peer.say("t1230\r");
    peer.expect("\x07");
    drop(peer);
    assert_eq!(
        next(&mut doors),
        Event::Left {
            client: again,
            reason: LeaveReason::Disconnected
        }
    );
}

/// A frame reaches everyone but its sender, whatever they speak.
#[test]
fn several_clients_at_several_doors() {
    let mut doors = open(&Options::default());
    let mut peers = Vec::new();
    for protocol in [Socketcand, Slcan, Socketcand, Slcan] {
        let peer = Peer::join(&doors, protocol);
        peers.push((protocol, peer, joined(&mut doors)));
    }
    let frame = Frame::data_frame(StandardId::new(0x181).unwrap(), &[0xA5]).unwrap();
    let text = |protocol, stamp: u32| match protocol {
        Socketcand => format!("< frame 181 0.{stamp:06} A5 >"),
        _ => "t1811A5\r".to_owned(),
    };
    for sender in 0..peers.len() {
        let (protocol, peer, client) = &mut peers[sender];
        peer.say(if *protocol == Socketcand {
            "< send 181 1 a5 >"
        } else {
            "t1811a5\r"
        });
        let got = frame_from(&mut doors, *client);
        assert_eq!(got, frame);
        doors.deliver(&got, sender as u64 * 1_000, Some(*client));
        if *protocol == Slcan {
            peer.expect("z\r");
        }
        for (_, (protocol, peer, _)) in peers.iter_mut().enumerate().filter(|(at, _)| *at != sender)
        {
            peer.expect(&text(*protocol, sender as u32));
        }
    }
    peers
        .iter_mut()
        .for_each(|(_, peer, _)| peer.hears_nothing());
}

/// Remote frames go to slcan, and to those socketcand clients that send such frames themselves.
#[test]
fn remote_frames() {
    let mut doors = open(&Options::default());
    let mut plain = Peer::join(&doors, Socketcand);
    joined(&mut doors);
    let mut knowing = Peer::join(&doors, Socketcand);
    let client = joined(&mut doors);
    knowing.say("< sendrtr 701 1 >");
    let frame = frame_from(&mut doors, client);
    assert_eq!(frame.to_string(), "701#R1");
    doors.deliver(&frame, 0, None);
    doors.deliver(&numbered(0), 0, None);
    knowing.expect("< rtr 701 0.000000 1 >< frame 300 0.000000 00000000 >");
    plain.expect("< frame 300 0.000000 00000000 >");
}

#[test]
fn all_doors_or_none() {
    let busy = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = busy.local_addr().unwrap().port();
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .port();
    let endpoints: Vec<Endpoint> = [
        format!("slcan://127.0.0.1:{free}"),
        format!("socketcand://127.0.0.1:{taken}"),
    ]
    .iter()
    .map(|text| text.parse().unwrap())
    .collect();
    let error = Doors::open(&endpoints, &Options::default()).unwrap_err();
    assert!(matches!(error, OpenError::InUse { .. }), "{error:?}");
    let text = error.to_string();
    assert!(
        text.contains(&format!("127.0.0.1:{taken}")) && text.contains("choose another"),
        "{text}"
    );
    TcpListener::bind(("127.0.0.1", free)).expect("the first door is closed again");
    // The same port for two doors is no better.
    let twice = [endpoints[0].clone(), endpoints[0].clone()];
    assert!(matches!(
        Doors::open(&twice, &Options::default()),
        Err(OpenError::InUse { .. })
    ));
}

#[test]
fn other_machines_only_if_asked_for() {
    for text in [
        "slcan://0.0.0.0:0",
        "socketcand://[::]:0",
        "slcan://192.0.2.1:0",
    ] {
        let endpoint: Endpoint = text.parse().unwrap();
        let error = Doors::open(&[endpoint], &Options::default()).unwrap_err();
        assert!(matches!(error, OpenError::Public { .. }), "{error:?}");
        assert!(error.to_string().contains("--expose"));
    }
    let everywhere: Endpoint = "slcan://0.0.0.0:0".parse().unwrap();
    let options = Options {
        public: true,
        ..Options::default()
    };
    let doors = Doors::open(&[everywhere], &options).unwrap();
    assert_ne!(doors.addresses()[0].port(), 0);
    // 192.0.2.1 is kept for documentation: no machine has it.
    let error = Doors::open(&["slcan://192.0.2.1:0".parse().unwrap()], &options).unwrap_err();
    assert!(
        error.to_string().contains("use an address of this machine"),
        "{error}"
    );
}

/// What has been delivered is sent before the sockets close, at once as well as after a hold.
#[test]
fn closing_sends_what_waits() {
    let mut doors = open(&Options::default());
    let mut peers = [Peer::join(&doors, Socketcand), Peer::join(&doors, Slcan)];
    joined(&mut doors);
    joined(&mut doors);
    (0..5_000).for_each(|number| doors.deliver(&numbered(number), 0, None));
    let address = doors.addresses()[0].clone();
    drop(doors);
    let texts = peers.each_mut().map(Peer::rest);
    assert_eq!(texts[0].matches("< frame 300 ").count(), 5_000);
    assert!(texts[0].ends_with("< frame 300 0.000000 87130000 >"));
    assert_eq!(texts[1].matches("t3004").count(), 5_000);
    assert!(texts[1].ends_with("t300487130000\r"));
    TcpListener::bind((address.host(), address.port())).expect("the port is free again");
}

#[test]
fn one_too_many() {
    let mut doors = open(&Options {
        clients: 1,
        ..Options::default()
    });
    let first = Peer::join(&doors, Socketcand);
    let client = joined(&mut doors);
    let mut second = Peer::connect(&doors, Slcan);
    assert_eq!(second.rest(), "\x07");
    let mut third = Peer::connect(&doors, Socketcand);
    assert_eq!(
        third.rest(),
        "< error 1 clients are connected already, which is all there may be >"
    );
    for door in [1, 0] {
        let Event::Refused {
            door: at,
            reason: LeaveReason::Crowded(1),
            ..
        } = next(&mut doors)
        else {
            panic!()
        };
        assert_eq!(at, door);
    }
    drop(first);
    assert_eq!(
        next(&mut doors),
        Event::Left {
            client,
            reason: LeaveReason::Disconnected
        }
    );
    Peer::join(&doors, Socketcand);
}
