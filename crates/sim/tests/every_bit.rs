//! Frames that nothing happens to are taken as a whole. Played bit by bit by every controller they
//! come out the same, to the nanosecond.

mod master;
use master::*;

use canopen::Instant;
use rand_core::{RngCore, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sim::{Bus, BusSettings, Traffic};

/// Four drives that move and send on SYNC, outside programs that ask them and each other, remote
/// frames and 29-bit identifiers among it.
fn run(seed: u64, every_bit: bool) -> (Bus, Vec<Traffic>) {
    let mut bus = Bus::new(BusSettings::new(seed, (1..=4).map(p3).collect()));
    if every_bit {
        bus.look_at_every_bit();
    }
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut traffic = Vec::new();
    bus.run_until(Instant::ZERO.plus_ms(23));
    for node in 1..=4_u16 {
        for data in [
            &[0x22, 0x00, 0x1A, 0, 0][..],
            &[0x22, 0x00, 0x1A, 1, 0x20, 0x00, 0x64, 0x60],
            &[0x22, 0x00, 0x1A, 0, 1],
            &[0x22, 0x17, 0x10, 0, 3, 0],
            &[0x22, 0x40, 0x60, 0, 0x86, 0],
            &[0x22, 0x40, 0x60, 0, 0x0F, 0],
            &[0x22, 0x60, 0x60, 0, 3],
            &[0x22, 0xFF, 0x60, 0, 0x50, 0xC3, 0, 0],
        ] {
            bus.send(0, frame(0x600 + node, data));
        }
    }
    for _ in 0..400 {
        let word = random.next_u64();
        let bytes = random.next_u64().to_le_bytes();
        let id = (word >> 8) as u32;
        let frame = match word % 8 {
            0..4 => frame(0x80, &[]),
            4 => frame(0x600 + (id as u16 % 6), &[0x40, bytes[0], 0x60, 0]),
            5 => {
                let id = can::ExtendedId::new(id & 0x1FFF_FFFF).unwrap();
                can::Frame::data_frame(id, &bytes[..bytes[0] as usize % 9]).unwrap()
            }
            6 => {
                let id = can::StandardId::new(id as u16 & 0x7FF | 0x400).unwrap();
                can::Frame::remote_frame(id, bytes[0] % 9).unwrap()
            }
            _ => frame(id as u16 & 0x7FF | 0x400, &bytes),
        };
        bus.run_until(bus.now());
        bus.send(word as u32 >> 30, frame);
        bus.run_until(bus.now().plus_ns(1 + random.next_u64() % 700_000));
        traffic.extend(bus.take_traffic());
    }
    bus.run_until(bus.now().plus_ms(50));
    traffic.extend(bus.take_traffic());
    (bus, traffic)
}

#[test]
fn bit_by_bit_is_the_same_as_frame_by_frame() {
    for seed in 1..=6 {
        let (fast, frames) = run(seed, false);
        let (slow, bits) = run(seed, true);
        assert!(frames.len() > 900, "{}", frames.len());
        for (n, pair) in frames.iter().zip(&bits).enumerate() {
            assert_eq!(pair.0, pair.1, "seed {seed}, frame {n}");
        }
        assert_eq!(frames.len(), bits.len());
        assert_eq!(fast.busy_ns(), slow.busy_ns());
        for (one, other) in fast.drives().iter().zip(slow.drives()) {
            assert_eq!(one.error_counters(), other.error_counters());
            assert_eq!(one.error_counters(), Default::default());
        }
    }
}
