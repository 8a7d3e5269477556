//! The client's end against the doors, and against what is no door.

use crate::PATIENCE;
use bus::{ConnectOptions, Connection, ConnectionError, Doors, Endpoint, Event, Options};
use bus::{connect, connect_with};
use can::slcan::BitRate;
use can::{ExtendedId, Frame, StandardId};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::time::timeout;

/// A bus that passes every frame to all others, in a thread, with a clock that counts frames.
struct Hub {
    addresses: Vec<Endpoint>,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Hub {
    fn start() -> Hub {
        let mut doors = crate::open(&Options::default());
        let addresses = doors.addresses().to_vec();
        let over = Arc::new(AtomicBool::new(false));
        let seen = over.clone();
        let thread = std::thread::spawn(move || {
            let mut stamp_ns = 0;
            while !seen.load(Ordering::Relaxed) {
                match doors.take() {
                    Some(Event::Frame { client, frame }) => {
                        stamp_ns += 1_000;
                        doors.grant(client, 1);
                        doors.deliver(&frame, stamp_ns, Some(client));
                    }
                    Some(_) => {}
                    None => doors.wait(Duration::from_millis(1)),
                }
            }
        });
        Hub {
            addresses,
            over,
            thread: Some(thread),
        }
    }

    fn stop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

impl Drop for Hub {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

async fn receive(connection: &mut Connection) -> bus::Received {
    timeout(PATIENCE, connection.receive())
        .await
        .expect("a frame")
        .unwrap()
}

fn frames() -> Vec<Frame> {
    let wide = ExtendedId::new(0x1ABC_DEF0).unwrap();
    let id = StandardId::new(0x701).unwrap();
    vec![
        Frame::data_frame(id, &[]).unwrap(),
        Frame::data_frame(id, &[1, 2, 3, 4, 5, 6, 7, 0xFF]).unwrap(),
        Frame::data_frame(wide, &[0xA5]).unwrap(),
        Frame::remote_frame(id, 1).unwrap(),
        Frame::remote_frame(wide, 8).unwrap(),
    ]
}

#[tokio::test]
async fn frames_between_all_kinds_of_ends() {
    let hub = Hub::start();
    for from in &hub.addresses {
        for to in &hub.addresses {
            let mut sender = connect(from).await.unwrap();
            let mut receiver = connect(to).await.unwrap();
            // A socketcand client shows that it knows remote frames by sending one. The numbered
            // frames behind tell when everything before has passed.
            for (end, number) in [(&mut sender, 1), (&mut receiver, 2)] {
                end.send(frames()[3]).await.unwrap();
                end.send(crate::numbered(number)).await.unwrap();
            }
            while receive(&mut receiver).await.frame != crate::numbered(1) {}
            while receive(&mut sender).await.frame != crate::numbered(2) {}
            for frame in frames() {
                sender.send(frame).await.unwrap();
                assert_eq!(receive(&mut receiver).await.frame, frame, "{from} to {to}");
            }
            let stamped = to.protocol() == bus::Protocol::Socketcand;
            sender.send(frames()[0]).await.unwrap();
            assert_eq!(receive(&mut receiver).await.stamp_ns.is_some(), stamped);
        }
    }
}

/// Both sides send 30,000 frames before either reads: nobody waits for the other for ever.
#[tokio::test]
async fn sending_without_reading_does_not_lock_up() {
    let hub = Hub::start();
    let mut ends = Vec::new();
    for address in &hub.addresses {
        ends.push(connect(address).await.unwrap());
    }
    let [a, b] = &mut ends[..] else { panic!() };
    for number in 0..30_000 {
        a.send(crate::numbered(number)).await.unwrap();
        b.send(crate::numbered(number)).await.unwrap();
    }
    for expected in 0..30_000 {
        assert_eq!(crate::number(&receive(a).await.frame), expected);
        assert_eq!(crate::number(&receive(b).await.frame), expected);
    }
}

#[tokio::test]
async fn errors_say_what_to_do() {
    let mut hub = Hub::start();
    let socketcand = hub.addresses[0].clone();
    let slcan = hub.addresses[1].clone();
    let quick = ConnectOptions {
        timeout: Duration::from_millis(300),
        ..Default::default()
    };

    let other: Endpoint = format!("socketcand://127.0.0.1:{}/can9", socketcand.port())
        .parse()
        .unwrap();
    let error = connect(&other).await.unwrap_err().to_string();
    assert!(
        error.contains("there is no bus 'can9' here, open can0 instead"),
        "{error}"
    );

    // The right port with the wrong protocol, both ways.
    let crossed: Endpoint = format!("socketcand://127.0.0.1:{}", slcan.port())
        .parse()
        .unwrap();
    let error = connect_with(&crossed, &quick).await.unwrap_err();
    assert!(
        matches!(
            error,
            ConnectionError::Timeout {
                missing: "greeting",
                ..
            }
        ),
        "{error}"
    );
    assert!(
        error
            .to_string()
            .contains("check that a socketcand server is there")
    );
    let crossed: Endpoint = format!("slcan://127.0.0.1:{}", socketcand.port())
        .parse()
        .unwrap();
    let error = connect_with(&crossed, &quick).await.unwrap_err();
    assert!(
        matches!(
            error,
            ConnectionError::Timeout { .. } | ConnectionError::Closed { .. }
        ),
        "{error}"
    );

    let rate = BitRate::from_bits_per_s(500_000);
    let told = ConnectOptions {
        bit_rate: rate,
        ..Default::default()
    };
    let mut connection = connect_with(&slcan, &told).await.unwrap();
    hub.stop();
    let error = timeout(PATIENCE, connection.receive())
        .await
        .unwrap()
        .unwrap_err();
    assert!(matches!(error, ConnectionError::Closed { .. }), "{error:?}");
    let error = connect(&slcan).await.unwrap_err();
    assert!(
        matches!(error, ConnectionError::NobodyThere { .. }),
        "{error:?}"
    );
    assert!(
        error
            .to_string()
            .contains(&format!("127.0.0.1:{}: start `servobus sim`", slcan.port()))
    );
}

/// The server's word on why it dropped us reaches the user.
#[tokio::test]
async fn a_refusal_is_passed_on() {
    let mut doors: Doors = crate::open(&Options {
        clients: 1,
        ..Options::default()
    });
    let address = doors.addresses()[0].clone();
    let _first = connect(&address).await.unwrap();
    doors.wait(Duration::from_millis(100));
    let error = connect(&address).await.unwrap_err().to_string();
    assert!(error.contains("1 clients are connected already"), "{error}");
    assert!(matches!(doors.take(), Some(Event::Joined { .. })));
}
