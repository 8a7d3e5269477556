//! Bytes as a script.

use canopen::lss::{Answer, BitTiming, Identity, Job, Known, Request, Settings, State, StoreError};

use super::pair::node_id;
use super::{Pair, Wire};

fn take<const N: usize>(input: &mut &[u8]) -> Option<[u8; N]> {
    let (bytes, rest) = input.split_first_chunk::<N>()?;
    *input = rest;
    Some(*bytes)
}

/// Runs a script: what is on the wire, then steps of one byte and the bytes each needs.
pub fn run(input: &[u8]) {
    script(&mut { input });
}

fn script(input: &mut &[u8]) -> Option<()> {
    let [count, ids, rates, attempts] = take(input)?;
    let rates = match rates {
        0..=15 => &[][..],
        16..=63 => &[BitTiming::Kbit10, BitTiming::Automatic],
        _ => &BitTiming::ALL,
    };
    let mut pairs = Vec::new();
    for at in 0..1 + usize::from(count % 3) {
        let [vendor, product, revision, serial] = take(input)?;
        // Few bits differ, so that slaves share beginnings.
        let address = [
            0x0408,
            u32::from(product & 1) << 31 | u32::from(vendor & 3),
            u32::from(revision),
            u32::from_le_bytes([serial, 0, 0, serial]),
        ];
        let active = if ids >> at & 1 == 0 { 0xFF } else { 5 };
        pairs.push(Pair::new(address, active, rates));
    }
    let settings = Settings {
        answer_ms: 5,
        store_ms: 10,
        scan_ms: u16::from(attempts >> 4),
        settle_ms: u16::from(attempts >> 6),
        gap_ms: u16::from(attempts >> 3 & 1),
        attempts: attempts & 3,
    };
    let mut wire = Wire::new(pairs, settings);
    while step(&mut wire, input).is_some() {}
    wire.finish();
    Some(())
}

fn step(wire: &mut Wire, input: &mut &[u8]) -> Option<()> {
    let [what] = take(input)?;
    let at = usize::from(what >> 4) % wire.pairs.len();
    match what & 0x0F {
        // Any eight bytes from some master.
        0 => {
            let data = take::<8>(input)?;
            parsing(data);
            for pair in &mut wire.pairs {
                pair.receive(data, wire.now);
            }
        }
        // A request that means this slave, or nearly so.
        1..=4 => {
            let [command, change] = take(input)?;
            let address = wire.pairs[at].model.address;
            let number = match command {
                64..=67 => address[usize::from(command - 64)],
                70 | 71 => address[usize::from(command - 70)],
                72 | 73 => address[2],
                74 | 75 => address[3],
                81 => address[usize::from(change & 3)],
                _ => u32::from(change),
            };
            let wrong = if change & 0x80 == 0 {
                0
            } else {
                1 << (change & 31)
            };
            let [a, b, c, d] = (number ^ wrong).to_le_bytes();
            let (bit, next) = (change & 0x1F, (change & 3) + (change >> 5 & 1));
            let data = match command {
                81 => [81, a, b, c, d, bit, change & 3, next & 3],
                _ => [command, a, b, c, d, 0, 0, 0],
            };
            for pair in &mut wire.pairs {
                pair.receive(data, wire.now);
            }
        }
        5 => {
            let [a, b] = take(input)?;
            wire.wait(u64::from(u16::from_le_bytes([a, b])) * 100_000);
        }
        6 => {
            let stored = match what >> 4 & 3 {
                0 => Ok(()),
                1 => Err(StoreError::NotSupported),
                2 => Err(StoreError::Access),
                _ => Err(StoreError::Specific(what)),
            };
            for pair in &mut wire.pairs {
                pair.complete(stored);
            }
        }
        7 => wire.pairs[at].reset_communication(),
        8 | 9 => {
            let [which, id] = take(input)?;
            wire.start(job(which, id, wire.pairs[at].slave.identity()));
        }
        // Exchanges until the losses are used up.
        10..=12 => {
            let [losses, rounds] = take(input)?;
            let mut left = u32::from(losses);
            for _ in 0..=rounds {
                wire.exchange(&mut || {
                    let lost = left & 1 != 0;
                    left >>= 1;
                    lost
                });
                wire.wait(1_000_000);
            }
        }
        // Any answer to the master.
        13 => {
            let data = take::<8>(input)?;
            parsing(data);
            let frame = can::Frame::classic(0x7E4, data, what >> 4);
            wire.master.receive(&frame, wire.now);
            wire.check_master();
        }
        14 => {
            wire.master.cancel();
            wire.busy = false;
            wire.check_master();
        }
        _ => wire
            .master
            .receive(&can::Frame::classic(0x7E5, [what; 8], 8), wire.now),
    }
    Some(())
}

fn job(which: u8, id: u8, identity: Identity) -> Job {
    match which % 12 {
        0 => Job::Switch(State::Waiting),
        1 => Job::Switch(State::Configuration),
        2 => Job::Select(identity),
        3 => Job::ConfigureNodeId(node_id(id)),
        4 => Job::ConfigureBitTiming(BitTiming::ALL[usize::from(id) % BitTiming::ALL.len()]),
        5 => Job::ActivateBitTiming {
            delay_ms: u16::from(id),
        },
        6 => Job::Store,
        7 => Job::InquireIdentity,
        8 => Job::InquireNodeId,
        9 => Job::Identify {
            low: identity,
            high: identity,
        },
        10 => Job::IdentifyNonConfigured,
        _ => Job::Fastscan(Known {
            vendor: (id & 1 != 0).then_some(identity.vendor),
            product: (id & 2 != 0).then_some(identity.product),
            revision: (id & 4 != 0).then_some(identity.revision),
            serial: (id & 8 != 0).then_some(u32::from(id)),
        }),
    }
}

/// What is written as it was read is read as it was written.
fn parsing(data: [u8; 8]) {
    if let Some(request) = Request::from_bytes(data) {
        assert_eq!(Request::from_bytes(request.to_bytes()), Some(request));
    }
    if let Some(answer) = Answer::from_bytes(data) {
        assert_eq!(Answer::from_bytes(answer.to_bytes()), Some(answer));
    }
}
