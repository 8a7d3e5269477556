//! `sdo` with objects of any length, against the model of a server that the SDO client's own tests
//! have, behind a socketcand door.

mod support;

#[path = "../../canopen/tests/sdo_client/harness/model.rs"]
#[allow(dead_code, unreachable_pub, reason = "this file uses a part")]
mod model;

use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bus::{ClientId, Doors, Event, Options};
use model::{Server, Traits};
use support::{Folder, printed, servobus};

const TRAITS: Traits = Traits {
    sizes: true,
    crc: true,
    blocks: true,
    block_sizes: [127, 60],
    switches: true,
};

/// Node 5 on a bus of its own.
struct Node {
    bus: String,
    server: Arc<Mutex<Server>>,
    /// What the clients sent.
    requests: Arc<Mutex<Vec<String>>>,
    /// Takes requests and answers none.
    is_mute: Arc<AtomicBool>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Node {
    fn with(traits: Traits, value: &[u8]) -> Node {
        let endpoint = "socketcand://127.0.0.1:0".parse().unwrap();
        let mut doors = Doors::open(&[endpoint], &Options::default()).unwrap();
        let door = doors.addresses().first().unwrap().to_string();
        let server = Arc::new(Mutex::new(Server::new(traits, value.to_vec())));
        let requests = Arc::new(Mutex::new(Vec::new()));
        let is_mute = Arc::new(AtomicBool::new(false));
        let is_over = Arc::new(AtomicBool::new(false));
        let (shared, seen) = (server.clone(), requests.clone());
        let (mute, over) = (is_mute.clone(), is_over.clone());
        let thread = std::thread::spawn(move || {
            while !over.load(Ordering::Relaxed) {
                serve(&mut doors, &shared, &seen, &mute);
                doors.wait(Duration::from_millis(1));
            }
        });
        Node {
            bus: door.split(' ').next().unwrap().to_owned(),
            server,
            requests,
            is_mute,
            is_over,
            thread: Some(thread),
        }
    }

    /// Runs `servobus sdo` with these words for this node.
    fn sdo(&self, words: &str, more: &[&str], code: i32) -> String {
        let words: Vec<&str> = words.split(' ').collect();
        let common = ["--node", "5", "--bus", &self.bus];
        let all = [&["sdo"], &words[..1], &common, &words[1..], more].concat();
        printed(&all, code)
    }

    fn requests(&self) -> Vec<String> {
        self.requests.lock().unwrap().clone()
    }
}

fn serve(
    doors: &mut Doors,
    server: &Mutex<Server>,
    requests: &Mutex<Vec<String>>,
    mute: &AtomicBool,
) {
    while let Some(event) = doors.take() {
        let Event::Frame { client, frame } = event else {
            continue;
        };
        let client: ClientId = client;
        doors.grant(client, 1);
        requests.lock().unwrap().push(frame.to_string());
        let mut server = server.lock().unwrap();
        if frame.raw_id() != 0x605 || mute.load(Ordering::Relaxed) {
            continue;
        }
        server.receive(&frame);
        while let Some(answer) = server.out.pop_front() {
            doors.deliver(&answer, 0, None);
        }
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn pattern(count: usize) -> Vec<u8> {
    (0..count).map(|n| (n % 251) as u8).collect()
}

#[test]
fn long_values_are_text_or_hexadecimal() {
    let node = Node::with(TRAITS, b"servo drive, type \"x\"");
    let text = node.sdo("read 0x2345,6", &["--type", "text"], 0);
    assert_eq!(text, "node 5 0x2345,6 = \"servo drive, type \\\"x\\\"\"\n");
    let text = node.sdo("read 0x2345,6 --method segmented", &[], 0);
    assert!(
        text.starts_with("node 5 0x2345,6 = 73 65 72 76 6F 20"),
        "{text}"
    );
    let json = node.sdo("read 0x2345,6 --type text --json", &[], 0);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["value"], "servo drive, type \"x\"");
    assert_eq!(json["bytes"].as_array().unwrap().len(), 21);
    let error = node.sdo("read 0x2345,6 --type u32", &[], 1);
    assert_eq!(
        error,
        "error: node 5: reading 0x2345,6: 21 bytes came, which is no UNSIGNED32\n"
    );
    let error = node.sdo("read 0x2345,6 --method expedited", &[], 1);
    assert_eq!(
        error,
        "error: node 5: reading 0x2345,6: the object has 21 bytes, which needs a segmented transfer\n"
    );
    let written = node.sdo("write 0x2345,6 --type text", &["a longer name"], 0);
    assert_eq!(written, "node 5 has taken 0x2345,6 = \"a longer name\"\n");
    let held = node.server.lock().unwrap().written.take();
    assert_eq!(held.as_deref(), Some(&b"a longer name"[..]));
    let empty = Node::with(TRAITS, b"");
    let text = empty.sdo("read 0x2345,6 --type text", &[], 0);
    assert_eq!(text, "node 5 0x2345,6 = \"\"\n");
}

#[test]
fn files_are_read_and_written_by_every_method() {
    let folder = Folder::new();
    for (method, count) in [
        ("auto", 0),
        ("auto", 3),
        ("auto", 20_000),
        ("segmented", 889),
        ("block", 65_536),
    ] {
        let data = pattern(count);
        let node = Node::with(TRAITS, &data);
        let file = folder.file("value");
        let out = node.sdo(
            &format!("read 0x2345,6 --method {method}"),
            &["--output", &file],
            0,
        );
        assert_eq!(
            out,
            format!("node 5 0x2345,6: {count} bytes, now in {file}\n")
        );
        assert!(std::fs::read(&file).unwrap() == data, "{method} {count}");
        assert!(!folder.path().join("value.part").exists());
        let out = node.sdo(
            &format!("write 0x2345 6 --method {method}"),
            &["--input", &file, "--json"],
            0,
        );
        let json: serde_json::Value = serde_json::from_str(&out).unwrap();
        assert_eq!(json["size"], count);
        let written = node.server.lock().unwrap().written.take();
        assert!(written == Some(data), "{method} {count}");
    }
}

#[test]
fn a_method_that_the_node_does_not_know() {
    let traits = Traits {
        blocks: false,
        ..TRAITS
    };
    let node = Node::with(traits, &pattern(1000));
    let error = node.sdo("read 0x2345,6 --method block", &[], 1);
    assert!(error.contains("refused, 0x05040001"), "{error}");
    assert!(
        node.sdo("read 0x2345,6", &[], 0)
            .starts_with("node 5 0x2345,6 = 00 01 02")
    );
}

#[test]
fn what_got_no_answer_is_repeated() {
    let node = Node::with(TRAITS, &pattern(1000));
    node.is_mute.store(true, Ordering::Relaxed);
    let error = node.sdo(
        "read 0x2345,6 --timeout 50ms --retries 2 --method block",
        &[],
        1,
    );
    assert_eq!(
        error,
        "error: node 5: reading 0x2345,6: no answer within 50 ms, asked 3 times\n"
    );
    let ask = "605#A44523067F150000";
    assert_eq!(node.requests(), [ask, ask, ask, "605#8045230600000405"]);
}

#[test]
fn mistakes_get_one_message_and_leave_no_file() {
    let folder = Folder::new();
    let node = Node::with(TRAITS, &pattern(10));
    let missing = folder.file("missing");
    let error = node.sdo("write 0x2345,6", &["--input", &missing], 2);
    assert!(error.starts_with(&format!("error: {missing}: ")), "{error}");
    let error = node.sdo("write 0x2345,6 7 8", &["--input", &missing], 2);
    assert_eq!(
        error,
        "error: '8' is too much: the value comes from --input\n"
    );
    let nowhere = folder.file("no/such/folder");
    let error = node.sdo("read 0x2345,6", &["--output", &nowhere], 2);
    assert!(error.starts_with(&format!("error: {nowhere}: ")), "{error}");
    let directory = folder.path().to_str().unwrap();
    let error = node.sdo("read 0x2345,6", &["--output", directory], 2);
    assert!(error.contains("is no name of a file"), "{error}");
    assert_eq!(node.requests(), [""; 0]);
    // An object that the node has not: no file is made, and an old one stays.
    let old = folder.file("old");
    std::fs::write(&old, "as it was").unwrap();
    node.is_mute.store(true, Ordering::Relaxed);
    node.sdo("read 0x2345,6 --timeout 50ms", &["--output", &old], 1);
    assert_eq!(std::fs::read_to_string(&old).unwrap(), "as it was");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// The node is told, and the user how far it was.
#[test]
fn ctrl_c_aborts_the_transfer_on_the_wire() {
    let folder = Folder::new();
    let file = folder.file("value");
    let node = Node::with(TRAITS, &pattern(1000));
    node.is_mute.store(true, Ordering::Relaxed);
    let words = [
        &["sdo", "read", "--node", "5", "--bus", &node.bus][..],
        &["0x2345,6", "--timeout", "1m", "--output", &file],
    ];
    let child = servobus(&words.concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let began = Instant::now();
    while node.requests().is_empty() {
        assert!(began.elapsed() < Duration::from_secs(20), "it asks nothing");
        std::thread::sleep(Duration::from_millis(5));
    }
    let id = child.id().to_string();
    let status = std::process::Command::new("kill")
        .args(["-INT", &id])
        .status();
    assert!(status.unwrap().success());
    let ended = child.wait_with_output().unwrap();
    assert!(
        began.elapsed() < Duration::from_secs(20),
        "it waited for the time-out"
    );
    assert_eq!(ended.status.code(), Some(1));
    assert_eq!(
        String::from_utf8(ended.stderr).unwrap(),
        "error: node 5: reading 0x2345,6: stopped after 0 bytes; the node was told\n"
    );
    let told = |requests: &[String]| {
        requests
            .last()
            .is_some_and(|last| last == "605#8045230600000008")
    };
    while !told(&node.requests()) {
        assert!(
            began.elapsed() < Duration::from_secs(20),
            "{:?}",
            node.requests()
        );
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
