//! How many simulated seconds a real second holds, for buses of different sizes.
use canopen::{Instant, NodeId};
use sim::{Bus, BusSettings, DriveSettings};

fn main() {
    for drives in [1_u8, 3, 20, 100] {
        for busy in [false, true] {
            let settings = (1..=drives)
                .map(|id| DriveSettings::new(NodeId::new(id).unwrap(), &personalities::p3::P3))
                .collect();
            let mut bus = Bus::new(BusSettings::new(1, settings));
            bus.run_until(Instant(100_000_000));
            let frame = |id: u16, data: &[u8]| {
                let mut bytes = [0; 8];
                bytes[..data.len()].copy_from_slice(data);
                can::Frame::classic(id, bytes, data.len() as u8)
            };
            if busy {
                for id in 1..=u16::from(drives) {
                    for data in [
                        &[0x22, 0x40, 0x60, 0, 0x86, 0][..],
                        &[0x22, 0x40, 0x60, 0, 0x0F, 0],
                        &[0x22, 0x60, 0x60, 0, 3],
                        &[0x22, 0xFF, 0x60, 0, 0x50, 0xC3, 0, 0],
                        &[0x22, 0, 0x1A, 1, 0x20, 0, 0x64, 0x60],
                        &[0x22, 0, 0x1A, 0, 1],
                    ] {
                        bus.send(0, frame(0x600 + id, data));
                        bus.run_until(bus.now().plus_ms(2));
                    }
                }
            }
            bus.take_traffic();
            let from = bus.now();
            let started = std::time::Instant::now();
            let mut frames = 0;
            while started.elapsed().as_secs_f64() < 1.0 {
                for _ in 0..10 {
                    if busy {
                        bus.send(0, frame(0x80, &[]));
                    }
                    // A hundred TPDOs of 4 bytes fill 10 ms.
                    bus.run_until(bus.now().plus_ms(if drives > 20 { 20 } else { 4 }));
                    frames += bus.take_traffic().len();
                }
            }
            let real = started.elapsed().as_secs_f64();
            let simulated = bus.now().since_ns(from) as f64 * 1e-9;
            let what = if busy {
                "moving, SYNC and TPDOs"
            } else {
                "idle"
            };
            println!(
                "{drives:3} drives, {what:22}: {:8.2} simulated s/s, {:6.0} ns per drive and period, {:8.0} frames per simulated s",
                simulated / real,
                real * 1e9 / (simulated * 20_000.0 * f64::from(drives)),
                f64::from(frames as u32) / simulated,
            );
        }
    }
}
