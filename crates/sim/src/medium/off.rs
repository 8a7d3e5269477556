//! Into bus-off by a broken cable, and out of it.

use super::ErrorState;
use super::rules::{ALL, Bench, standard};

/// A cable that is dominant: the transmitter has an error, and one more for each eight bits behind
/// its flag of six. Receivers are error passive.
#[test]
fn a_dominant_wire_drives_the_transmitter_off() {
    let mut bench = Bench::new(3);
    bench.nodes[0].queue.push_back(standard(0x555, &[0x55; 4]));
    bench.run(20);
    bench.stuck = Some(false);
    while bench.counters()[0].0 == 0 {
        bench.bit();
    }
    bench.run(6 + 31 * 8 - 1);
    assert_eq!(bench.counters()[0].0, 248);
    bench.run(1);
    assert_eq!(bench.nodes[0].protocol.counters.state(), ErrorState::BusOff);
    for node in &bench.nodes[1..] {
        assert_eq!(node.protocol.counters.state(), ErrorState::Passive);
        assert_eq!(node.protocol.counters.transmit, 0);
    }
    bench.run(100_000);
    assert_eq!(bench.counters(), [(256, 0), (0, 255), (0, 255)]);
    // 128 times 11 recessive bits, wherever they are; a dominant bit begins the eleven anew.
    bench.nodes[0].queue.clear();
    bench.stuck = None;
    bench.run(1407);
    assert_eq!(bench.counters()[0], (256, 0));
    bench.run(1);
    assert_eq!(bench.counters()[0], (0, 0));
}

#[test]
fn traffic_delays_recovery() {
    let mut bench = Bench::new(3);
    bench.nodes[0].queue.push_back(standard(0x555, &[]));
    bench.set(0, 250, 0);
    bench.flips.push_back((15, ALL));
    bench.run(16);
    assert_eq!(bench.counters()[0].0, 258);
    bench.nodes[0].queue.clear();
    // Back to back: one sequence of eleven for each frame, from its acknowledge on.
    let frame = standard(0x100, &[0x55; 8]);
    bench.nodes[1].queue.extend([frame; 200]);
    while bench.counters()[0].0 != 0 {
        bench.bit();
    }
    let sent = bench.nodes[1].sent.len();
    // One more was in the error frame's delimiter and intermission.
    assert_eq!(sent, 127);
}

/// A cable that stays recessive: whoever sends reads another bit than it sends, in its flags too.
#[test]
fn a_recessive_wire_drives_who_sends_off() {
    let mut bench = Bench::new(2);
    bench.stuck = Some(true);
    bench.nodes[0].queue.push_back(standard(0x555, &[]));
    let from = bench.bits;
    while !bench.nodes[0].protocol.counters.is_bus_off() {
        bench.bit();
    }
    // Start of frame and fifteen bits of active flags to 128, one more by which it is known that
    // the next is passive; then flag, delimiter, intermission, suspension and start of frame for
    // each 8 from 136 to 256.
    assert_eq!(bench.bits - from, 17 + 15 * (6 + 8 + 3 + 8 + 1));
    assert_eq!(bench.counters(), [(256, 0), (0, 0)]);
}
