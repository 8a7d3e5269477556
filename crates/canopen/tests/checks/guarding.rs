//! Node and life guarding, and error behaviour (CiA 301 7.2.8.2.2, 7.5.2.11, 7.5.2.12, 7.5.2.32).

use canopen::{CommunicationErrors, News, NmtState};

use crate::harness::stand::{Stand, WIDE};

use super::nmt::STATES;

const LOST: CommunicationErrors = CommunicationErrors::LIFE_GUARD;
const NOTHING: CommunicationErrors = CommunicationErrors::NOTHING;

/// An operational node whose life is guarded with a guard time of 50 ms and a factor of 3, and that
/// changes nothing when its master is lost.
fn guarded() -> Stand {
    let mut stand = Stand::new();
    stand.must(0x100C, 0, 50);
    stand.must(0x100D, 0, 3);
    stand.must(0x1029, 1, 1);
    stand.nmt(0x01);
    stand.fresh();
    stand
}

pub(crate) fn toggle() {
    let mut stand = Stand::operational();
    for n in 0..10 {
        let toggle = if n % 2 == 0 { 0x00 } else { 0x80 };
        assert_eq!(stand.request(0x705, 1), [(0x705, vec![0x05 | toggle])]);
        stand.wait_ms(100);
    }
}

pub(crate) fn toggle_and_states() {
    let mut stand = Stand::new();
    assert_eq!(stand.request(0x705, 1), [(0x705, vec![0x7F])]);
    let mut toggle = 0x80;
    for (command, _, number) in STATES {
        stand.nmt(command);
        assert_eq!(stand.request(0x705, 1), [(0x705, vec![number | toggle])]);
        toggle ^= 0x80;
    }
    stand.nmt(0x01);
    let id = stand.node.id();
    stand.node.restart_communication(&[], id);
    stand.start();
    assert_eq!(
        stand.request(0x705, 1),
        [(0x705, vec![0x7F])],
        "a reset starts with 0"
    );
    assert_eq!(stand.request(0x705, 1), [(0x705, vec![0xFF])]);
}

pub(crate) fn request() {
    let mut stand = guarded();
    for length in 0..=8 {
        assert_eq!(stand.request(0x705, length).len(), 1);
    }
    assert_eq!(stand.request(0x706, 1), []);
    assert_eq!(stand.request(0x705 | WIDE, 1), []);
    assert_eq!(stand.send(0x705, &[0x05]), []);
}

pub(crate) fn life_time() {
    for (guard_ms, factor) in [(50u32, 3u32), (1, 1), (65_535, 255)] {
        let mut stand = guarded();
        stand.must(0x100C, 0, guard_ms);
        stand.must(0x100D, 0, factor);
        let us = 1000 * u64::from(guard_ms) * u64::from(factor);
        stand.wait_us(10 * us);
        assert_eq!(
            stand.node.errors(),
            NOTHING,
            "it begins with the first request"
        );
        for _ in 0..3 {
            stand.request(0x705, 1);
            stand.wait_us(us - 1);
            assert_eq!(stand.node.errors(), NOTHING);
        }
        stand.fresh().wait_us(1);
        assert_eq!(stand.node.errors(), LOST);
        assert!(stand.told(News::ERRORS));
        stand.fresh().wait_us(10 * us);
        assert!(!stand.told(News::ERRORS), "once");
        assert_eq!(stand.request(0x705, 1).len(), 1);
        assert_eq!(stand.node.errors(), NOTHING, "until the master asks again");
        assert!(stand.told(News::ERRORS));
        stand.wait_us(us);
        assert_eq!(stand.node.errors(), LOST);
    }
}

pub(crate) fn no_life_time() {
    for (guard_ms, factor) in [(0, 3), (50, 0), (0, 0)] {
        let mut stand = guarded();
        stand.must(0x100C, 0, guard_ms);
        stand.must(0x100D, 0, factor);
        assert_eq!(stand.request(0x705, 1), [(0x705, vec![0x05])]);
        stand.wait_ms(1_000_000);
        assert_eq!(stand.node.errors(), NOTHING);
    }
}

pub(crate) fn life_time_ends() {
    for late in [false, true] {
        for (index, value) in [(0x100C, 0), (0x100D, 0), (0x1017, 500)] {
            let mut stand = guarded();
            stand.request(0x705, 1);
            stand.wait_ms(if late { 200 } else { 100 });
            stand.must(index, 0, value);
            stand.wait_ms(1000);
            assert_eq!(stand.node.errors(), NOTHING, "0x{index:04X}, late: {late}");
        }
    }
}

pub(crate) fn heartbeat_excludes_guarding() {
    let mut stand = guarded();
    assert_eq!(stand.request(0x705, 1), [(0x705, vec![0x05])]);
    stand.must(0x1017, 0, 100);
    assert_eq!(stand.request(0x705, 1), []);
    assert_eq!(
        stand.wait_ms(100),
        [(100_000, 0x705, vec![0x05])],
        "bit 7 is 0"
    );
    assert_eq!(stand.wait_ms(100), [(100_000, 0x705, vec![0x05])]);
    stand.must(0x1017, 0, 0);
    assert_eq!(stand.request(0x705, 1).len(), 1);
}

pub(crate) fn life_guarding_in_every_state() {
    for (command, _, number) in STATES {
        let mut stand = guarded();
        stand.nmt(command);
        assert_eq!(stand.request(0x705, 1), [(0x705, vec![number])]);
        stand.wait_ms(150);
        assert_eq!(stand.node.errors(), LOST);
    }
}

/// What becomes of the state when an error comes, by 0x1029,1 and the state before.
fn behaviour(error: fn(&mut Stand)) {
    use NmtState::{Operational, PreOperational, Stopped};
    for (value, operational, pre_operational) in [
        (0, PreOperational, PreOperational),
        (1, Operational, PreOperational),
        (2, Stopped, Stopped),
    ] {
        for (command, before, _) in STATES {
            let mut stand = Stand::new();
            stand.must(0x100C, 0, 50);
            stand.must(0x100D, 0, 3);
            stand.must(0x1016, 1, 0x0007_0096);
            stand.must(0x1029, 1, value);
            stand.nmt(command);
            stand.fresh();
            error(&mut stand);
            let expected = match before {
                Operational => operational,
                PreOperational => pre_operational,
                other => other,
            };
            assert_eq!(stand.node.state(), expected, "{before}, 0x1029,1 = {value}");
            let entered = stand.log.iter().find_map(|events| events.entered);
            assert_eq!(entered, (expected != before).then_some(expected));
        }
    }
}

pub(crate) fn behaviour_after_guarding() {
    behaviour(|stand| {
        stand.request(0x705, 1);
        stand.wait_ms(150);
    });
}

pub(crate) fn behaviour_after_heartbeat() {
    behaviour(|stand| {
        stand.send(0x707, &[0x05]);
        stand.wait_ms(150);
    });
}

pub(crate) fn behaviour_after_bus_off() {
    behaviour(|stand| {
        let mut events = canopen::Events::NOTHING;
        stand
            .node
            .communication_error(stand.now, &mut stand.host, &mut events);
        stand.log.push(events);
    });
}

pub(crate) fn behaviour_values() {
    let mut stand = Stand::new();
    for sub in [1, 2] {
        for value in 0..=255 {
            let expected = if value <= 2 { Ok(()) } else { Err(0x0609_0030) };
            assert_eq!(stand.write(0x1029, sub, value), expected);
        }
    }
}

pub(crate) fn recovery_changes_no_state() {
    let mut stand = guarded();
    stand.must(0x1029, 1, 0);
    stand.request(0x705, 1);
    stand.wait_ms(150);
    assert_eq!(stand.node.state(), NmtState::PreOperational);
    stand.request(0x705, 1);
    stand.wait_ms(100);
    assert_eq!(stand.node.state(), NmtState::PreOperational);
}

pub(crate) fn pdos_end() {
    let mut stand = guarded();
    stand.must(0x1029, 1, 0);
    stand.map(0x1800, 0x185, 1, &[0x2000_0108]);
    stand.request(0x705, 1);
    assert_eq!(stand.sync().len(), 1);
    stand.wait_ms(150);
    assert_eq!(stand.sync(), []);
}
