//! Drives on a simulated bus, driven by raw frames as a master sends them.

use can::Frame;
use canopen::{Instant, NodeId};
use sim::{Bus, BusSettings, DriveSettings, Place, Sender, Traffic};

fn bus(nodes: &[u8]) -> Bus {
    let drives = nodes
        .iter()
        .map(|id| DriveSettings::new(NodeId::new(*id).unwrap(), &personalities::p3::P3))
        .collect();
    Bus::new(BusSettings::new(1, drives))
}

/// Sends a frame and gives everything that the bus carries in the next 5 ms.
fn say(bus: &mut Bus, id: u16, data: &[u8]) -> Vec<Traffic> {
    let mut bytes = [0; 8];
    bytes[..data.len()].copy_from_slice(data);
    bus.send(0, Frame::classic(id, bytes, data.len() as u8));
    bus.run_until(bus.now().plus_ms(5));
    bus.take_traffic()
}

fn write(bus: &mut Bus, node: u16, index: u16, sub: u8, value: &[u8]) {
    let [low, high] = index.to_le_bytes();
    let mut data = vec![0x22, low, high, sub];
    data.extend(value);
    let heard = say(bus, 0x600 + node, &data);
    let answer = heard
        .iter()
        .find(|t| t.frame.raw_id() == u32::from(0x580 + node))
        .unwrap();
    assert_eq!(
        answer.frame.data(),
        [0x60, low, high, sub, 0, 0, 0, 0],
        "{index:04X},{sub}"
    );
}

fn read(bus: &mut Bus, node: u16, index: u16, sub: u8) -> i32 {
    let [low, high] = index.to_le_bytes();
    let heard = say(bus, 0x600 + node, &[0x40, low, high, sub]);
    let answer = heard
        .iter()
        .find(|t| t.frame.raw_id() == u32::from(0x580 + node))
        .unwrap();
    let data = answer.frame.bytes();
    assert_eq!(data[..4], [0x42, low, high, sub]);
    i32::from_le_bytes(data[4..].try_into().unwrap())
}

#[test]
fn three_drives_boot_once_each() {
    let mut bus = bus(&[1, 2, 3]);
    bus.run_until(Instant::ZERO.plus_ms(100));
    let mut boots: Vec<Traffic> = bus.take_traffic();
    boots.sort_by_key(|traffic| traffic.frame.raw_id());
    assert_eq!(boots.len(), 3);
    for (boot, id) in boots.iter().zip(1..) {
        assert_eq!(
            boot.sender,
            Sender::Drive(Place::of_node(NodeId::new(id).unwrap()))
        );
        assert_eq!(boot.frame, Frame::classic(0x700 + u16::from(id), [0; 8], 1));
    }
    assert!(bus.take_notices().is_empty());
}

#[test]
fn a_profile_position_move_ends_at_its_target() {
    let mut bus = bus(&[1]);
    bus.run_until(Instant::ZERO.plus_ms(100));
    bus.take_traffic();
    write(&mut bus, 1, 0x6040, 0, &[0x86, 0]);
    write(&mut bus, 1, 0x6040, 0, &[0x0F, 0]);
    assert_eq!(read(&mut bus, 1, 0x6041, 0) & 0x6F, 0x27);
    write(&mut bus, 1, 0x6060, 0, &[1]);
    let from = read(&mut bus, 1, 0x6064, 0);
    let target = from + 40_960;
    write(&mut bus, 1, 0x607A, 0, &target.to_le_bytes());
    write(&mut bus, 1, 0x6040, 0, &[0x1F, 0]);
    // 40,960 counts at 200,000 counts/s and 2,000,000 counts/s²: 0.305 s.
    bus.run_until(bus.now().plus_ms(500));
    let position = read(&mut bus, 1, 0x6064, 0);
    assert!(
        (position - target).abs() <= 20,
        "{from} {position} {target}"
    );
    assert_ne!(read(&mut bus, 1, 0x6041, 0) & 0x0400, 0, "target reached");
    let turns = bus
        .drive(NodeId::new(1).unwrap())
        .unwrap()
        .plant()
        .truth()
        .position_turns();
    assert!((turns - 10.0).abs() < 0.01, "{turns}");
}
