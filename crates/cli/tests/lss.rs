//! `servobus lss` against devices behind a door.

#[path = "../../client/tests/support/lss.rs"]
mod devices;
mod support;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant as RealTime};

use bus::{Doors, Endpoint};
use canopen::lss::{BitTiming, Identity, State, StoreError};
use canopen::{Instant, NodeId};
use devices::{Device, nth};
use serde_json::{Value, json};
use support::printed;

/// Devices behind a socketcand door, in real time.
struct Bus {
    address: String,
    devices: Arc<Mutex<Vec<Device>>>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Bus {
    fn new(all: Vec<Device>) -> Bus {
        let endpoint: Endpoint = "socketcand://127.0.0.1:0".parse().unwrap();
        let mut doors = Doors::open(&[endpoint], &bus::Options::default()).unwrap();
        let address = doors.addresses()[0].to_string();
        let devices = Arc::new(Mutex::new(all));
        let ends = Arc::new(AtomicBool::new(false));
        let (shared, end) = (devices.clone(), ends.clone());
        let thread = std::thread::spawn(move || {
            let began = RealTime::now();
            while !end.load(Ordering::Relaxed) {
                doors.wait(Duration::from_millis(5));
                let now_ns = began.elapsed().as_nanos() as u64;
                let mut devices = shared.lock().unwrap();
                for device in devices.iter_mut() {
                    while device.slave.poll(Instant(now_ns)).is_some() {}
                }
                while let Some(event) = doors.take() {
                    let bus::Event::Frame { client, frame } = event else {
                        continue;
                    };
                    doors.grant(client, 1);
                    for device in devices.iter_mut() {
                        if let Some(answer) = device.receive(&frame, Instant(now_ns)) {
                            doors.deliver(&answer, now_ns, None);
                        }
                    }
                }
            }
        });
        Bus {
            address,
            devices,
            ends,
            thread: Some(thread),
        }
    }

    /// Unconfigured devices, numbered from 0.
    fn unconfigured(count: u32) -> Bus {
        Bus::new((0..count).map(|n| Device::new(nth(n), None)).collect())
    }

    /// What the command prints, after it ended with this exit code.
    fn lss(&self, words: &[&str], code: i32) -> String {
        let (service, rest) = words.split_first().unwrap();
        printed(
            &[&["lss", service, "--bus", &self.address], rest].concat(),
            code,
        )
    }

    /// Node IDs, active and stored.
    fn ids(&self) -> Vec<(Option<u8>, Option<u8>)> {
        let devices = self.devices.lock().unwrap();
        let id = |id: Option<NodeId>| id.map(NodeId::get);
        devices
            .iter()
            .map(|device| (id(device.slave.node_id()), id(device.stored.0)))
            .collect()
    }

    fn all_wait(&self) -> bool {
        let devices = self.devices.lock().unwrap();
        devices
            .iter()
            .all(|device| device.slave.state() == State::Waiting)
    }
}

impl Drop for Bus {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(ended.is_ok() || std::thread::panicking());
        }
    }
}

fn word(identity: Identity) -> String {
    identity.to_string()
}

#[test]
fn scan_lists_devices_without_a_node_id() {
    let mut all = vec![
        Device::new(nth(2), None),
        Device::new(nth(0), None),
        Device::new(nth(1), NodeId::new(9)),
    ];
    all.push(Device::new(
        Identity {
            vendor: 9,
            ..nth(5)
        },
        None,
    ));
    let bus = Bus::new(all);
    let text = bus.lss(&["scan"], 0);
    let rows: Vec<&str> = text.lines().skip(1).map(str::trim_end).collect();
    assert_eq!(
        rows,
        [
            "0x00000009:0x00000003:0x00010002:0x00000BBD  3005",
            "0x00000408:0x00000003:0x00010002:0x00000BB8  3000",
            "0x00000408:0x00000003:0x00010002:0x00000BBA  3002",
        ]
    );
    let text = bus.lss(
        &["scan", "--vendor", "0x408", "--product", "3", "--json"],
        0,
    );
    let rows: Value = serde_json::from_str(&text).unwrap();
    let row =
        |serial| json!({"vendor": 0x408, "product": 3, "revision": 0x10002, "serial": serial});
    assert_eq!(rows, json!([row(3000), row(3002)]));
    let text = bus.lss(&["scan", "--vendor", "7"], 1);
    assert_eq!(text, "no device without a node ID was found\n");
    // A product code without its vendor ID does not narrow anything.
    let text = bus.lss(&["scan", "--product", "3"], 2);
    assert!(text.contains("--vendor"), "{text}");
    assert!(bus.all_wait());
}

#[test]
fn assign_gives_and_stores_node_ids() {
    let bus = Bus::unconfigured(3);
    let text = bus.lss(&["assign", "--ids", "5,6,7"], 0);
    let expected = [(5, 0), (6, 1), (7, 2)].map(|(node, n)| {
        let identity = nth(n);
        format!("node {node}: {identity}, has booted\n")
    });
    assert_eq!(text, expected.concat());
    assert_eq!(
        bus.ids(),
        [5, 6, 7].map(|id| (Some(id), Some(id))),
        "active and stored"
    );
    assert!(bus.all_wait());
}

#[test]
fn assign_says_what_is_left() {
    let bus = Bus::unconfigured(2);
    let text = bus.lss(&["assign", "--ids", "5", "--no-store", "--json"], 0);
    let rows: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(rows[0]["node"], 5);
    assert_eq!(rows[0]["serial"], 3000);
    assert_eq!(rows[0]["booted"], true);
    assert_eq!(bus.ids(), [(Some(5), None), (None, None)]);
    let text = bus.lss(&["assign", "--ids", "8-10"], 1);
    assert!(text.contains("node 8: 0x00000408"), "{text}");
    assert!(
        text.contains("no more devices without a node ID; left over: 9, 10"),
        "{text}"
    );
    let bus = Bus::unconfigured(2);
    bus.devices.lock().unwrap()[0].store = Err(StoreError::Access);
    let text = bus.lss(&["assign", "--ids", "5,6"], 1);
    let error = format!(
        "error: device {}: storing its configuration: refused, the store cannot be written (error 2)",
        word(nth(0))
    );
    assert!(text.contains(&error), "{text}");
    assert_eq!(bus.ids(), [(None, None); 2]);
}

#[test]
fn set_id_of_devices_with_and_without_one() {
    let bus = Bus::new(vec![
        Device::new(nth(0), NodeId::new(3)),
        Device::new(nth(1), None),
    ]);
    let (first, second) = (word(nth(0)), word(nth(1)));
    let text = bus.lss(&["set-id", "--identity", &first, "9", "--store"], 0);
    assert_eq!(
        text,
        format!(
            "{first}: node ID 9, stored\nit is node 3 until its communication is reset: \
             servobus nmt reset-communication 3\n"
        )
    );
    assert_eq!(bus.ids()[0], (Some(3), Some(9)));
    let text = bus.lss(&["set-id", "--identity", "0x408:3:0x10002:3001", "8"], 0);
    assert_eq!(
        text,
        format!("{second}: node ID 8, not stored\nit boots as node 8\n")
    );
    assert_eq!(bus.ids()[1], (Some(8), None));
    let text = bus.lss(&["set-id", "--identity", &first, "none", "--store"], 0);
    assert!(
        text.starts_with(&format!("{first}: no node ID, stored\n")),
        "{text}"
    );
    assert_eq!(bus.ids()[0], (Some(3), None));
    assert!(bus.all_wait());
}

#[test]
fn what_makes_no_sense_is_refused_before_anything_is_sent() {
    for (words, why) in [
        (&["set-id", "--identity", "1:2:3", "9"][..], "four numbers"),
        (
            &["set-id", "--identity", "1:2:3:4", "0"],
            "1 to 127, or none",
        ),
        (
            &["set-id", "--identity", "1:2:3:4", "128"],
            "1 to 127, or none",
        ),
        (&["set-id", "9"], "--identity"),
        (&["assign"], "--ids"),
        (&["assign", "--ids", "0"], "node IDs are 1 to 127"),
        (&["assign", "--ids", "5,5"], "there twice"),
        (&["bit-rate", "100", "--identity", "1:2:3:4"], "write 1000"),
        (&["bit-rate", "250"], "--identity"),
        (
            &[
                "bit-rate",
                "250",
                "--identity",
                "1:2:3:4",
                "--activate",
                "65536",
            ],
            "65536",
        ),
        (&["scan", "--scan-timeout", "66s"], "at most 65s"),
        (&["scan", "--vendor", "x"], "no number of 32 bits"),
    ] {
        let text = printed(&[&["lss"], words].concat(), 2);
        assert!(text.contains(why), "{words:?}: {text}");
    }
}

#[test]
fn bit_rates_are_set_stored_and_activated() {
    let bus = Bus::new(vec![
        Device::new(nth(0), NodeId::new(3)),
        Device::new(nth(1), NodeId::new(4)),
    ]);
    let (first, second) = (word(nth(0)), word(nth(1)));
    let text = bus.lss(&["bit-rate", "250", "--identity", &first], 0);
    assert!(text.contains("nothing changes: give --store"), "{text}");
    let text = bus.lss(&["bit-rate", "800", "--identity", &first, "--store"], 1);
    assert!(text.contains("refused, bit rate not supported"), "{text}");
    assert!(bus.all_wait());
    let text = bus.lss(
        &[
            "bit-rate",
            "250",
            "--identity",
            &first,
            "--identity",
            &second,
            "--store",
            "--activate",
            "10",
        ],
        0,
    );
    assert_eq!(
        text,
        format!(
            "{first}: 250 kbit/s, stored\n{second}: 250 kbit/s, stored\nthe devices change in \
             10 ms and are silent until 20 ms; give the interface its new bit rate, then: servobus \
             lss waiting\n"
        )
    );
    for device in bus.devices.lock().unwrap().iter() {
        assert_eq!(device.stored.1, BitTiming::Kbit250);
        assert_eq!(device.slave.bit_timing(), BitTiming::Kbit250);
        assert_eq!(device.slave.state(), State::Configuration);
    }
    assert_eq!(
        bus.lss(&["waiting"], 0),
        "sent: all devices to LSS waiting\n"
    );
    assert!(bus.all_wait());
}

#[test]
fn inquire_one_device_and_one_of_several() {
    let bus = Bus::new(vec![Device::new(nth(0), NodeId::new(3))]);
    let first = word(nth(0));
    assert_eq!(bus.lss(&["inquire"], 0), format!("{first}: node ID 3\n"));
    let several = Bus::new(vec![
        Device::new(nth(0), NodeId::new(3)),
        Device::new(nth(1), None),
    ]);
    let text = several.lss(&["inquire", "--identity", &word(nth(1)), "--json"], 0);
    let row: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((&row["node"], &row["serial"]), (&Value::Null, &json!(3001)));
    let text = several.lss(
        &["inquire", "--identity", "1:2:3:4", "--timeout", "20ms"],
        1,
    );
    assert_eq!(
        text,
        "error: device 0x00000001:0x00000002:0x00000003:0x00000004: selecting it: no answer \
         within 20 ms, asked 2 times\n"
    );
    assert!(several.all_wait());
}
