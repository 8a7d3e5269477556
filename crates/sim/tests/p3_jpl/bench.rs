//! A bus of these drives, and what comes of a frame.
#![allow(unreachable_pub, reason = "a test's module")]

use can::Frame;
use sim::DriveSettings;

use crate::master::{Master, id};

pub fn jpl(node: u8) -> DriveSettings {
    DriveSettings::new(id(node), &personalities::p3_jpl::P3_JPL)
}

/// A bus of drives that have had their power for 50 ms, and no message yet.
pub fn quiet(nodes: &[u8]) -> Master {
    Master::with(nodes.iter().map(|node| jpl(*node)).collect())
}

/// The same in operational.
pub fn operational(nodes: &[u8]) -> Master {
    let mut master = quiet(nodes);
    master.send(0, &[0x01, 0]);
    master.run_ms(5);
    master.log.clear();
    master
}

/// Frames of the drives in the log: identifier and data.
pub fn answers(master: &Master) -> Vec<(u32, Vec<u8>)> {
    let from_drives =
        |frame: &Frame| !matches!(frame.raw_id(), 0 | 0x080 | 0x601..=0x67F | 1..=0x1F);
    master
        .log
        .iter()
        .filter(|traffic| from_drives(&traffic.frame))
        .map(|traffic| (traffic.frame.raw_id(), traffic.frame.data().to_vec()))
        .collect()
}

/// What comes of one frame within 10 ms.
pub fn of(master: &mut Master, id: u16, data: &[u8]) -> Vec<(u32, Vec<u8>)> {
    master.log.clear();
    master.send(id, data);
    master.run_ms(10);
    let sent = u32::from(id);
    answers(master)
        .into_iter()
        .filter(|(id, _)| *id != sent)
        .collect()
}

/// A property over BarrettCAN.
pub fn property(master: &mut Master, node: u8, number: u8) -> i32 {
    let frames = of(master, u16::from(node), &[number]);
    let [(identifier, data)] = frames.as_slice() else {
        panic!("{frames:02X?}")
    };
    assert_eq!(*identifier, 0x406 | u32::from(node) << 5);
    assert_eq!(data[..2], [0x80 | number, 0]);
    match data[2..] {
        [v0, v1] => i16::from_le_bytes([v0, v1]).into(),
        [v0, v1, v2, v3] => i32::from_le_bytes([v0, v1, v2, v3]),
        _ => panic!("{data:02X?}"),
    }
}
