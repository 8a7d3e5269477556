//! Bytes as what clients and the owner do.

use std::sync::LazyLock;

use can::{Frame, StandardId};
use canopen::{Abort, Row, Verdict};

use super::model::Phase;
use super::{DEVICES, IDS, OBJECTS, World, frame};

/// Runs a script. Its first byte chooses the device; then each step is a byte that says what it is
/// and for which server, and the bytes it needs. Where the bytes end, the script ends.
///
/// # Panics
/// If a rule is broken.
pub fn run(input: &[u8]) {
    let Some((first, mut rest)) = input.split_first() else {
        return;
    };
    let mut world = World::new(usize::from(*first) % DEVICES.len());
    while step(&mut world, &mut rest).is_some() {}
    world.end();
}

fn take<const N: usize>(input: &mut &[u8]) -> Option<[u8; N]> {
    let (bytes, rest) = input.split_first_chunk::<N>()?;
    *input = rest;
    Some(*bytes)
}

fn step(world: &mut World, input: &mut &[u8]) -> Option<()> {
    let [what] = take(input)?;
    let n = usize::from(what >> 4) % 3;
    match what & 0x0F {
        0..=2 => {
            let request = initiate(input)?;
            world.request(n, request);
        }
        3..=7 => {
            let request = next(world, n, input)?;
            world.request(n, request);
        }
        8 => {
            let request = take(input)?;
            world.request(n, allowed(request));
        }
        9 => {
            let [length, command] = take(input)?;
            let short = frame(IDS[n].0, &[command; 8][..usize::from(length % 8)]);
            world.is_deaf_to(short);
            let id = [0x605, 0x585, 0x6C0][n];
            let id = StandardId::new(id).expect("11 bits");
            world.is_deaf_to(Frame::remote_frame(id, length % 9).expect("a frame"));
        }
        10 => {
            let [times] = take(input)?;
            world.wait_ms([1, 50, 99, 100, 900, 999, 1000, 5000][usize::from(times % 8)]);
        }
        11 if what & 0x80 == 0 => world.complete(Ok(())),
        11 => world.complete(Err(Abort::HARDWARE)),
        12 => {
            let [verdicts, full_at] = take(input)?;
            let verdict = |bits: u8| match bits & 3 {
                0 => Verdict::Accept,
                1 => Verdict::Done,
                2 => Verdict::Refuse(Abort::LOCAL_CONTROL),
                _ => Verdict::Later,
            };
            world.owner.verdict = verdict(verdicts);
            world.owner.begin = verdict(verdicts >> 2);
            world.owner.end = verdict(verdicts >> 4);
            let limit = |bit: u8| match verdicts >> bit & 1 {
                0 => u32::MAX,
                _ => u32::from(full_at),
            };
            (world.owner.full_at, world.owner.broken_at) = (limit(6), limit(7));
        }
        13 => {
            let [length, times] = take(input)?;
            let is_read = |phase: &Phase| {
                !matches!(
                    phase,
                    Phase::Idle
                        | Phase::Download { .. }
                        | Phase::BlockDownload { .. }
                        | Phase::BlockDownloadEnd
                )
            };
            if !world.clients.iter().any(|client| is_read(&client.phase)) {
                let count = usize::from(length) * usize::from(times % 8);
                world.owner.contents = (0..count).map(|n| (n ^ n >> 8) as u8 ^ length).collect();
                world.owner.says_size = times & 8 == 0;
                world.owner.is_unreadable = times & 0xF0 == 0xF0;
            }
        }
        14 if n == 0 => world.stop_and_go(),
        14 => world.switch(n, what & 0x80 == 0),
        _ => {
            let [patience] = take(input)?;
            world.patience = match patience {
                0 => usize::MAX,
                few => usize::from(few),
            };
        }
    }
    Some(())
}

/// The objects that requests name: no COB-IDs, which have a step of their own, and nothing that
/// makes the node send what is no answer.
fn is_harmless(index: u16) -> bool {
    !matches!(
        index,
        0x1005..=0x1007 | 0x1012 | 0x1014 | 0x1017 | 0x1201..=0x127F | 0x1400..=0x1BFF
    )
}

/// The request, or another one if it names an object that is not harmless.
fn allowed(request: [u8; 8]) -> [u8; 8] {
    let [command, low, high, rest @ ..] = request;
    let index = u16::from_le_bytes([low, high]);
    let [high, low] = match is_harmless(index) {
        true => [high, low],
        false => [0x20, 0x20],
    };
    let [r0, r1, r2, r3, r4] = rest;
    [command, low, high, r0, r1, r2, r3, r4]
}

/// The rows of harmless objects.
static ROWS: LazyLock<Vec<&'static Row>> = LazyLock::new(|| {
    let rows = OBJECTS.table().rows().iter();
    rows.filter(|row| is_harmless(row.address.index)).collect()
});

/// The beginning of a transfer of an object that exists, so that luck is not needed to find one.
fn initiate(input: &mut &[u8]) -> Option<[u8; 8]> {
    const COMMANDS: [u8; 16] = [
        0x40, 0x40, 0x21, 0x21, 0x20, 0x23, 0x2B, 0x2F, 0x22, 0x27, 0xA0, 0xA4, 0xC2, 0xC6, 0xC0,
        0xC4,
    ];
    let [command, row, a, b] = take(input)?;
    let row = ROWS[usize::from(row) % ROWS.len()];
    let [low, high] = row.address.index.to_le_bytes();
    let size = match row.data_type.size() {
        0 => row.length,
        size => size,
    };
    let first = COMMANDS[usize::from(command & 15)];
    let data = match (first >> 5, command >> 4 & 3) {
        // The object's size, or one near it.
        (1, 0) if first & 2 == 0 => [size, 0, 0, 0],
        (1 | 6, 1) => [a, 0, 0, 0],
        (6, 0) => [size, 0, 0, 0],
        (5, _) => [a, b, 0, 0],
        _ => [a, b, a & b, command],
    };
    let [d0, d1, d2, d3] = data;
    let sub = row.address.sub.wrapping_add(command >> 6);
    Some([first, low, high, sub, d0, d1, d2, d3])
}

/// What a client would say next, or nearly so.
fn next(world: &World, n: usize, input: &mut &[u8]) -> Option<[u8; 8]> {
    let [how, data] = take(input)?;
    let client = &world.clients[n];
    // Seven of eight times as it should be.
    let wrong = u8::from(how & 7 == 7);
    let bytes = |command| {
        let d = |n: u8| data.wrapping_mul(n).wrapping_add(n);
        [command, d(1), d(2), d(3), d(4), d(5), d(6), d(7)]
    };
    let request = match &client.phase {
        Phase::Idle => bytes(how),
        Phase::Download { toggle } => {
            let left = client
                .announced
                .map(|all| all.saturating_sub(client.data.len() as u32));
            let is_last = match left {
                Some(left) => left <= 7,
                None => how & 8 != 0,
            };
            let count = match left {
                Some(left) => left.min(7) as u8,
                None => how >> 4 & 7,
            };
            let unused = (7 - count.min(7)) ^ (wrong * (how >> 4 & 7));
            bytes((toggle ^ (wrong & how >> 3) << 4) | unused << 1 | u8::from(is_last))
        }
        Phase::Upload { toggle } => bytes(0x60 | toggle ^ wrong << 4),
        Phase::BlockDownload { block } => {
            let number = (block.len() + 1) as u8;
            let number = number.wrapping_add(wrong * (how >> 4 & 3)) & 0x7F;
            let left = client.announced.map(|all| {
                let before =
                    client.data.len() + 7 * (block.len() + usize::from(!client.data.is_empty()));
                all.saturating_sub(before as u32)
            });
            let is_last = left.map_or(how & 8 != 0, |left| left <= 7);
            if wrong == 1 && how & 0x40 != 0 {
                *block.last().unwrap_or(&bytes(number))
            } else {
                bytes(u8::from(is_last) << 7 | number)
            }
        }
        Phase::BlockDownloadEnd => {
            let all = client.announced.map_or(u32::from(how >> 4), |all| all);
            let unused = (client.data.len() as u32 + 7).saturating_sub(all).min(7) as u8;
            let crc = client.checksum(unused) ^ u16::from(wrong);
            let [low, high] = crc.to_le_bytes();
            if wrong == 1 && how & 0x40 != 0 {
                client.last_frame()
            } else {
                [0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0]
            }
        }
        Phase::BlockUploadStart { .. } => bytes(0xA3 ^ wrong),
        Phase::BlockUpload { came, size, .. } => {
            let segments = came
                .saturating_sub((how >> 3 & 3) * (how >> 5 & 1))
                .wrapping_add(wrong);
            let size = if how & 0x80 != 0 { data } else { *size };
            [0xA2, segments, size, 0, 0, 0, 0, 0]
        }
        Phase::BlockUploadEnd => bytes(0xA1 ^ wrong << 1),
    };
    // Segments name no object.
    let names = matches!(client.phase, Phase::Idle);
    Some(if names { allowed(request) } else { request })
}
