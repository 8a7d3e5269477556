//! Serial lines: what comes and goes over a TCP port and a pseudo-terminal, byte by byte.

use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use bus::{SerialEndpoint, SerialEvent, SerialLines};

const PATIENCE: Duration = Duration::from_secs(20);

fn open(endpoint: &str) -> SerialLines {
    let endpoint: SerialEndpoint = endpoint.parse().expect("an endpoint");
    SerialLines::open(&[endpoint], false).expect("a line")
}

fn connect(lines: &SerialLines) -> TcpStream {
    let address = lines.addresses()[0].strip_prefix("tcp://").expect("TCP");
    let stream = TcpStream::connect(address).expect("a connection");
    stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
    stream
}

fn next(lines: &mut SerialLines, room: usize) -> SerialEvent {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(event) = lines.take(0, room) {
            return event;
        }
        assert!(Instant::now() < end, "nothing happens");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// So many bytes, however they come.
fn bytes(lines: &mut SerialLines, count: usize) -> Vec<u8> {
    let mut all = Vec::new();
    while all.len() < count {
        match next(lines, count - all.len()) {
            SerialEvent::Bytes(bytes) => all.extend(bytes),
            other => panic!("{other:?}"),
        }
    }
    all
}

/// Every byte there is, so that nothing between takes one for its own.
fn every_byte() -> Vec<u8> {
    (0..=255).collect()
}

#[test]
fn every_byte_goes_both_ways_over_tcp() {
    let mut lines = open("tcp://127.0.0.1:0");
    let mut outside = connect(&lines);
    outside.write_all(&every_byte()).expect("written");
    assert_eq!(next(&mut lines, 0), SerialEvent::Connected);
    assert_eq!(bytes(&mut lines, 256), every_byte());
    lines.send(0, &every_byte());
    let mut heard = [0; 256];
    outside.read_exact(&mut heard).expect("read");
    assert_eq!(heard.to_vec(), every_byte());
    drop(outside);
    assert_eq!(next(&mut lines, 0), SerialEvent::HungUp);
}

#[cfg(unix)]
#[test]
fn every_byte_goes_both_ways_over_a_terminal_as_often_as_it_is_opened() {
    let mut lines = open("pty");
    let name = lines.addresses()[0].clone();
    for _ in 0..3 {
        let terminal = OpenOptions::new().read(true).write(true).open(&name);
        let mut terminal = terminal.expect("a terminal");
        terminal.write_all(&every_byte()).expect("written");
        assert_eq!(next(&mut lines, 0), SerialEvent::Connected);
        assert_eq!(bytes(&mut lines, 256), every_byte());
        lines.send(0, &every_byte());
        let mut heard = [0; 256];
        terminal.read_exact(&mut heard).expect("read");
        assert_eq!(heard.to_vec(), every_byte());
        // Half a line, and away.
        terminal.write_all(b"!CW 1").expect("written");
        drop(terminal);
        assert_eq!(bytes(&mut lines, 5), b"!CW 1");
        assert_eq!(next(&mut lines, 9), SerialEvent::HungUp);
        // It takes a moment until it is held open again.
        std::thread::sleep(Duration::from_millis(200));
    }
}

#[test]
fn one_program_at_a_time() {
    let mut lines = open("tcp://127.0.0.1:0");
    let mut first = connect(&lines);
    first.write_all(b"1").expect("written");
    assert_eq!(next(&mut lines, 0), SerialEvent::Connected);
    assert_eq!(bytes(&mut lines, 1), b"1");
    let mut second = connect(&lines);
    let mut nothing = [0; 1];
    let ended = second.read(&mut nothing);
    assert!(matches!(ended, Ok(0) | Err(_)), "{ended:?}");
    first.write_all(b"2").expect("written");
    assert_eq!(bytes(&mut lines, 1), b"2");
    drop(first);
    assert_eq!(next(&mut lines, 0), SerialEvent::HungUp);
    let mut third = connect(&lines);
    third.write_all(b"3").expect("written");
    assert_eq!(next(&mut lines, 0), SerialEvent::Connected);
    assert_eq!(bytes(&mut lines, 1), b"3");
}

/// As `printf '?SW\r' | nc -N` does it.
#[test]
fn who_closes_one_direction_still_gets_the_answer() {
    let mut lines = open("tcp://127.0.0.1:0");
    let mut outside = connect(&lines);
    outside.write_all(b"?SW\r").expect("written");
    outside.shutdown(std::net::Shutdown::Write).expect("closed");
    assert_eq!(next(&mut lines, 0), SerialEvent::Connected);
    assert_eq!(bytes(&mut lines, 4), b"?SW\r");
    lines.send(0, b"SW=592\r");
    let mut answer = String::new();
    outside.read_to_string(&mut answer).expect("an answer");
    assert_eq!(answer, "SW=592\r");
    assert_eq!(next(&mut lines, 0), SerialEvent::HungUp);
}

/// Who sends without end is slowed down, and loses nothing.
#[test]
fn a_flood_waits_outside() {
    let mut lines = open("tcp://127.0.0.1:0");
    let mut outside = connect(&lines);
    let flood: Vec<u8> = (0..4_000_000_u32).map(|n| (n % 251) as u8).collect();
    let sent = flood.clone();
    let writer = std::thread::spawn(move || outside.write_all(&sent));
    assert_eq!(next(&mut lines, 0), SerialEvent::Connected);
    std::thread::sleep(Duration::from_millis(200));
    assert!(
        !writer.is_finished(),
        "four megabytes cannot be on their way"
    );
    assert!(bytes(&mut lines, flood.len()) == flood);
    writer.join().expect("it ended").expect("written");
}

#[test]
fn addresses_that_others_can_reach_need_to_be_asked_for() {
    let endpoint: SerialEndpoint = "tcp://0.0.0.0:0".parse().expect("an endpoint");
    let refused = SerialLines::open(std::slice::from_ref(&endpoint), false);
    let message = refused.expect_err("closed by default").to_string();
    assert!(message.contains("--expose"), "{message}");
    assert!(SerialLines::open(&[endpoint], true).is_ok());
    // A port can be had once.
    let lines = open("tcp://127.0.0.1:0");
    let taken: SerialEndpoint = lines.addresses()[0].parse().expect("an endpoint");
    let refused = SerialLines::open(&[taken], false);
    let message = refused.expect_err("in use").to_string();
    assert!(message.contains("the port is in use"), "{message}");
}
