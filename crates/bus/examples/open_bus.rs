//! A bus without any drive: doors only. What one client sends reaches all others, at the pace of
//! a bus of the given bit rate.
//!
//! ```text
//! cargo run -p servobus-bus --example open_bus -- socketcand://127.0.0.1:29536 slcan://127.0.0.1:29537
//! ```
//!
//! Ends when standard input ends. With `--log FILE` the traffic is written as candump would.

use bus::recording::candump;
use bus::{ClientId, Doors, Endpoint, Event, Options};
use can::Frame;
use std::collections::BTreeMap;
use std::io::{BufWriter, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

const BIT_RATE: u64 = 1_000_000;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut endpoints = Vec::new();
    let mut log = None;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--log" {
            let file = arguments.next().ok_or("--log needs a file name")?;
            log = Some(BufWriter::new(std::fs::File::create(file)?));
        } else {
            endpoints.push(argument.parse::<Endpoint>()?);
        }
    }
    let mut doors = Doors::open(&endpoints, &Options::default())?;
    for address in doors.addresses() {
        println!("{address}");
    }
    let over = Arc::new(AtomicBool::new(false));
    let seen = over.clone();
    std::thread::spawn(move || {
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        seen.store(true, Ordering::Relaxed);
    });
    let start = Instant::now();
    let mut free_at_ns = 0_u64;
    let mut mailboxes: BTreeMap<ClientId, Vec<Frame>> = BTreeMap::new();
    while !over.load(Ordering::Relaxed) {
        while let Some(event) = doors.take() {
            match event {
                Event::Joined { client, .. } => drop(mailboxes.insert(client, Vec::new())),
                Event::Frame { client, frame } => {
                    mailboxes.entry(client).or_default().push(frame);
                    continue;
                }
                Event::Left { .. } | Event::Refused { .. } | Event::Trouble { .. } => {}
            }
            eprintln!("{event:?}");
        }
        let now_ns = start.elapsed().as_nanos() as u64;
        if free_at_ns > now_ns {
            doors.wait(Duration::from_nanos(free_at_ns - now_ns));
            continue;
        }
        let first = |(client, frames): (&ClientId, &Vec<Frame>)| {
            frames
                .first()
                .map(|frame| (frame.arbitration_key(), *client, *frame))
        };
        match mailboxes
            .iter()
            .filter_map(first)
            .min_by_key(|(key, client, _)| (*key, *client))
        {
            None => doors.wait(Duration::from_millis(10)),
            Some((_, client, frame)) => {
                let begin_ns = free_at_ns.max(now_ns.saturating_sub(1_000_000));
                free_at_ns = begin_ns + u64::from(frame.wire_bits()) * 1_000_000_000 / BIT_RATE;
                if let Some(frames) = mailboxes.get_mut(&client) {
                    frames.remove(0);
                }
                doors.grant(client, 1);
                doors.deliver(&frame, free_at_ns, Some(client));
                if let Some(log) = &mut log {
                    candump::write_line(log, free_at_ns, "can0", &frame)?;
                }
            }
        }
    }
    if let Some(mut log) = log {
        log.flush()?;
    }
    Ok(())
}
