//! Heartbeats, produced and consumed (CiA 301 7.2.8.2.2, 7.5.2.19, 7.5.2.20).

use canopen::{CommunicationErrors, Monitored, News, NmtState, NodeId};

use crate::harness::FULL;
use crate::harness::stand::{Stand, WIDE};

use super::nmt::STATES;

const LOST: CommunicationErrors = CommunicationErrors::HEARTBEAT;
const NOTHING: CommunicationErrors = CommunicationErrors::NOTHING;

pub(crate) fn period() {
    for (command, _, number) in STATES {
        for ms in [1u32, 100, 65_535] {
            let mut stand = Stand::new();
            stand.must(0x1017, 0, ms);
            stand.nmt(command);
            let us = 1000 * u64::from(ms);
            let expected: Vec<_> = (1..=3).map(|n| (n * us, 0x705, vec![number])).collect();
            assert_eq!(stand.wait_us(3 * us), expected);
        }
    }
}

pub(crate) fn off() {
    let mut stand = Stand::new();
    assert_eq!(stand.wait_ms(1_000_000), []);
    stand.must(0x1017, 0, 10);
    stand.wait_ms(15);
    stand.must(0x1017, 0, 0);
    assert_eq!(stand.wait_ms(1_000_000), []);
}

pub(crate) fn boot_up_is_the_first() {
    let mut stand = Stand::unstarted(&FULL);
    stand.set(0x1017, 0, 10);
    assert_eq!(stand.start(), [(0x705, vec![0])]);
    assert_eq!(stand.wait_ms(10), [(10_000, 0x705, vec![0x7F])]);
}

pub(crate) fn new_period() {
    let mut stand = Stand::new();
    stand.must(0x1017, 0, 100);
    assert_eq!(stand.wait_ms(60), []);
    stand.must(0x1017, 0, 50);
    let expected = [(50_000, 0x705, vec![0x7F]), (100_000, 0x705, vec![0x7F])];
    assert_eq!(stand.wait_ms(100), expected);
}

pub(crate) fn state_changes_keep_the_rhythm() {
    let mut stand = Stand::new();
    stand.must(0x1017, 0, 10);
    stand.wait_ms(5);
    stand.nmt(0x01);
    assert_eq!(stand.wait_ms(10), [(5_000, 0x705, vec![0x05])]);
    stand.nmt(0x02);
    assert_eq!(stand.wait_ms(10), [(5_000, 0x705, vec![0x04])]);
}

/// An operational node that listens for node 7 for 100 ms, and changes nothing when it is lost.
fn listening() -> Stand {
    let mut stand = Stand::new();
    stand.must(0x1016, 1, 0x0007_0064);
    stand.must(0x1029, 1, 1);
    stand.nmt(0x01);
    stand.fresh();
    stand
}

fn monitored(stand: &Stand) -> Vec<(u8, Option<NmtState>, bool)> {
    let all = stand.node.monitored();
    all.map(
        |Monitored {
             node,
             state,
             is_lost,
         }| (node.get(), state, is_lost),
    )
    .collect()
}

pub(crate) fn first_heartbeat() {
    let mut stand = listening();
    assert_eq!(
        stand.node.monitored().next().map(|node| node.node),
        NodeId::new(7)
    );
    stand.wait_ms(100_000);
    assert_eq!(stand.node.errors(), NOTHING);
    assert!(!stand.told(News::HEARTBEAT));
    stand.send(0x707, &[0x05]);
    assert!(stand.told(News::HEARTBEAT));
    stand.wait_ms(100);
    assert_eq!(stand.node.errors(), LOST);
}

pub(crate) fn loss() {
    for ms in [1u32, 100, 65_535] {
        let mut stand = listening();
        stand.must(0x1016, 1, 0x0007_0000 | ms);
        stand.send(0x707, &[0x05]);
        stand.fresh().wait_us(1000 * u64::from(ms) - 1);
        assert_eq!(
            (stand.node.errors(), stand.told(News::HEARTBEAT)),
            (NOTHING, false)
        );
        stand.wait_us(1);
        assert_eq!(stand.node.errors(), LOST);
        assert!(stand.told(News::HEARTBEAT) && stand.told(News::ERRORS));
        assert_eq!(monitored(&stand), [(7, Some(NmtState::Operational), true)]);
        stand.fresh().wait_ms(1_000_000);
        assert!(!stand.told(News::HEARTBEAT), "once");
    }
}

pub(crate) fn each_heartbeat_starts_anew() {
    let mut stand = listening();
    for _ in 0..10 {
        stand.send(0x707, &[0x05]);
        stand.wait_us(99_999);
    }
    assert_eq!(stand.node.errors(), NOTHING);
}

pub(crate) fn recovery() {
    let mut stand = listening();
    stand.send(0x707, &[0x05]);
    stand.wait_ms(200);
    stand.fresh().send(0x707, &[0x05]);
    assert_eq!(stand.node.errors(), NOTHING);
    assert!(stand.told(News::HEARTBEAT) && stand.told(News::ERRORS));
    assert_eq!(monitored(&stand), [(7, Some(NmtState::Operational), false)]);
    stand.wait_ms(100);
    assert_eq!(stand.node.errors(), LOST, "and is listened for again");
}

pub(crate) fn states() {
    let mut stand = listening();
    for (byte, state) in [
        (0x7F, NmtState::PreOperational),
        (0x05, NmtState::Operational),
        (0x04, NmtState::Stopped),
        (0x00, NmtState::Initialising),
    ] {
        stand.fresh().send(0x707, &[byte]);
        assert!(stand.told(News::HEARTBEAT), "a new state");
        assert_eq!(monitored(&stand), [(7, Some(state), false)]);
        stand.fresh().send(0x707, &[byte]);
        // A boot-up says each time that the node has started.
        assert_eq!(stand.told(News::HEARTBEAT), byte == 0x00);
    }
}

pub(crate) fn not_a_heartbeat() {
    let mut stand = listening();
    stand.send(0x707, &[]);
    stand.send(0x707, &[0x05, 0]);
    stand.send(0x707 | WIDE, &[0x05]);
    stand.send(0x708, &[0x05]);
    stand.request(0x707, 1);
    assert_eq!(monitored(&stand), [(7, None, false)]);
}

pub(crate) fn several() {
    let mut stand = listening();
    for n in 1..=8 {
        stand.must(
            0x1016,
            n,
            u32::from(n) << 16 | 0x10_0000 | (10 * u32::from(n)),
        );
    }
    for n in 1..=8 {
        stand.send(0x710 + n, &[0x05]);
    }
    for n in 1..=8 {
        stand.wait_ms(9);
        assert_eq!(
            monitored(&stand).iter().filter(|node| node.2).count(),
            n - 1
        );
        stand.wait_ms(1);
        assert_eq!(monitored(&stand).iter().filter(|node| node.2).count(), n);
    }
    for n in 1..=8 {
        assert_eq!(stand.node.errors(), LOST, "as long as one is silent");
        stand.send(0x710 + n, &[0x05]);
    }
    assert_eq!(stand.node.errors(), NOTHING);
}

pub(crate) fn twice() {
    let mut stand = listening();
    assert_eq!(stand.write(0x1016, 2, 0x0007_0001), Err(0x0604_0043));
    assert_eq!(stand.read(0x1016, 2), Ok(0));
    assert_eq!(
        stand.write(0x1016, 1, 0x0007_0032),
        Ok(()),
        "the same entry"
    );
    assert_eq!(
        stand.write(0x1016, 2, 0x0007_0000),
        Ok(()),
        "time 0 does not count"
    );
    assert_eq!(stand.write(0x1016, 2, 0x0008_0032), Ok(()));
    assert_eq!(stand.write(0x1016, 1, 0x0008_0032), Err(0x0604_0043));
    assert_eq!(stand.read(0x1016, 1), Ok(0x0007_0032));
}

pub(crate) fn unused_entries() {
    for value in [0u32, 0x0007_0000, 0x0000_0064, 0x0080_0064, 0x00FF_0064] {
        let mut stand = listening();
        assert_eq!(stand.write(0x1016, 1, value), Ok(()));
        assert_eq!(monitored(&stand), [], "{value:08X}");
        for node in 1..=0x7F {
            stand.send(0x700 | node, &[0x05]);
        }
        stand.wait_ms(1000);
        assert_eq!(stand.node.errors(), NOTHING);
    }
}

pub(crate) fn reserved_bits() {
    let mut stand = listening();
    for bit in 24..32 {
        assert_eq!(
            stand.write(0x1016, 1, 0x0007_0064 | 1 << bit),
            Err(0x0609_0030)
        );
    }
}

pub(crate) fn entries_change() {
    let mut stand = listening();
    stand.must(0x1016, 2, 0x0008_0064);
    stand.send(0x707, &[0x05]);
    stand.send(0x708, &[0x05]);
    stand.wait_ms(50);
    // Another entry's change leaves this one's time running; a new one begins with a heartbeat.
    stand.must(0x1016, 2, 0x0009_0064);
    stand.wait_us(49_999);
    assert_eq!(stand.node.errors(), NOTHING);
    stand.wait_us(1);
    assert!(monitored(&stand)[0].2);
    assert_eq!(monitored(&stand)[1], (9, None, false));
    // Who is not listened for any more is not missed.
    stand.fresh().must(0x1016, 1, 0);
    assert_eq!(stand.node.errors(), NOTHING);
    assert!(stand.told(News::ERRORS));
}
