//! The master's procedures for an axis and its PDOs, against simulated P3s in virtual time.

use std::cell::RefCell;

use canopen::{DataType, Instant, NodeId};
use cia402::{Mode, State};
use client::axis::{Axis, AxisError, Goal, Walk};
use client::decode::Direction;
use client::pdo::{Cycle, Mapped, Order, Pdo};
use client::{Client, Link, Observed, RequestForm, Seen, Value, Way, block_on};
use sim::{Bus, BusSettings, DriveSettings, VirtualLink};

const NODE: NodeId = NodeId::new(1).unwrap();
const AXIS: Axis = Axis::new(NODE);

/// A bus with one booted P3.
fn bus() -> Bus {
    let mut bus = Bus::new(BusSettings::new(
        1,
        vec![DriveSettings::new(NODE, &personalities::p3::P3)],
    ));
    bus.run_until(Instant::ZERO.plus_ms(50));
    bus.take_traffic();
    bus
}

fn client(bus: &mut Bus) -> Client<VirtualLink<'_>> {
    Client::new(VirtualLink::new(bus, 0))
}

/// Lets virtual time pass.
async fn wait<L: Link>(client: &mut Client<L>, ms: u64) {
    let until = client.now().plus_ms(ms);
    while client.receive(until).await.unwrap().is_some() {}
}

async fn position<L: Link>(client: &mut Client<L>) -> i32 {
    let object = canopen::Address::new(0x6064, 0);
    match client.read(NODE, object, DataType::I32).await.unwrap() {
        Value::Integer(counts) => counts as i32,
        other => panic!("{other:?}"),
    }
}

/// The controlwords that `walk` writes to a P3 from switch on disabled, as the bus sees them.
fn controlwords(walk: Walk, form: RequestForm) -> Vec<String> {
    let mut bus = bus();
    let sent = RefCell::new(Vec::new());
    let link = Observed::new(VirtualLink::new(&mut bus, 0), |seen: Seen| {
        if seen.way == Way::Sent && seen.frame.bytes()[1..3] == [0x40, 0x60] {
            sent.borrow_mut().push(seen.frame.to_string());
        }
    });
    let mut client = Client::new(link);
    client.settings.form = form;
    let axis = Axis { walk, ..AXIS };
    let seen = block_on(axis.enable(&mut client)).unwrap();
    assert_eq!(seen.state(), Some(State::OperationEnabled));
    drop(client);
    sent.into_inner()
}

#[test]
fn the_short_walk_is_the_manuals_and_the_standard_one_takes_each_transition() {
    // P3 l.324, l.325, to the byte.
    assert_eq!(
        controlwords(Walk::Short, RequestForm::Short),
        ["601#224060008600", "601#224060000F00"]
    );
    assert_eq!(
        controlwords(Walk::Standard, RequestForm::Standard),
        [
            "601#2B40600006000000",
            "601#2B40600007000000",
            "601#2B4060000F000000"
        ]
    );
}

#[test]
fn an_enabled_axis_is_left_as_it_is_and_disabled_by_one_write() {
    let mut bus = bus();
    let mut client = client(&mut bus);
    block_on(async {
        AXIS.enable(&mut client).await.unwrap();
        AXIS.enable(&mut client).await.unwrap();
        let seen = AXIS.disable(&mut client).await.unwrap();
        assert_eq!(seen.state(), Some(State::SwitchOnDisabled));
    });
}

#[test]
fn a_fault_is_told_with_its_code_and_reset_when_its_cause_is_gone() {
    for walk in [Walk::Standard, Walk::Short] {
        let mut bus = bus();
        let mut client = client(&mut bus);
        let axis = Axis { walk, ..AXIS };
        block_on(async {
            axis.enable(&mut client).await.unwrap();
            // Under-voltage fault below 12.0 V, which must last 450 ms (P3 l.1237).
            let minimum = Value::Integer(120).encode(DataType::U16).unwrap();
            client
                .download(NODE, canopen::Address::new(0x2384, 7), minimum)
                .await
                .unwrap();
            let supply = |client: &mut Client<VirtualLink<'_>>, volts| {
                let drive = client.link().bus().drive(NODE).unwrap();
                drive.plant().set_supply_v(volts);
            };
            supply(&mut client, 10.0);
            wait(&mut client, 600).await;
            let fault = AxisError::Fault {
                node: NODE,
                code: Some(0x3220),
            };
            let refused = axis.move_to(&mut client, 0, false).await;
            assert_eq!(refused, Err(fault.clone()), "{walk:?}");
            let text = fault.to_string();
            assert!(
                text.starts_with("node 1 is in fault, 0x603F is 0x3220: "),
                "{text}"
            );
            assert!(text.ends_with("; remove the cause and reset the fault"));
            supply(&mut client, 48.0);
            axis.enable(&mut client).await.unwrap();
        });
    }
}

#[test]
fn resetting_no_fault_writes_nothing() {
    let mut bus = bus();
    let writes = RefCell::new(0);
    let link = Observed::new(VirtualLink::new(&mut bus, 0), |seen: Seen| {
        if seen.way == Way::Sent && seen.frame.bytes()[0] & 0xE0 == 0x20 {
            *writes.borrow_mut() += 1;
        }
    });
    let mut client = Client::new(link);
    block_on(AXIS.reset_fault(&mut client)).unwrap();
    drop(client);
    assert_eq!(writes.into_inner(), 0);
}

#[test]
fn a_move_is_handed_over_and_awaited() {
    let mut bus = bus();
    let mut client = client(&mut bus);
    block_on(async {
        AXIS.enable(&mut client).await.unwrap();
        AXIS.set_mode(&mut client, Mode::PROFILE_POSITION)
            .await
            .unwrap();
        let from = position(&mut client).await;
        let target = from + 40_960;
        let started = client.now();
        AXIS.move_to(&mut client, target, false).await.unwrap();
        let goal = |target| Goal::Position { target, window: 20 };
        let reached = AXIS
            .wait_for_target(&mut client, goal(target), 1_000)
            .await
            .unwrap();
        // Trapezoid, 200,000 counts/s and 2,000,000 counts/s²: 40960 / 2e5 + 2e5 / 2e6 = 0.3048 s.
        let took_ms = reached.since_ns(started) as f64 * 1e-6;
        assert!((304.8..325.0).contains(&took_ms), "{took_ms} ms");
        // Relative to the target before, not to where the shaft is.
        AXIS.move_to(&mut client, -10_000, true).await.unwrap();
        AXIS.wait_for_target(&mut client, goal(target - 10_000), 1_000)
            .await
            .unwrap();
        let off = position(&mut client).await - (target - 10_000);
        assert!(off.abs() <= 20, "{off}");
    });
}

#[test]
fn a_target_that_is_not_reached_is_told_with_what_was_seen() {
    let mut bus = bus();
    bus.drive(NODE).unwrap().plant().set_blocked(true);
    let mut client = client(&mut bus);
    block_on(async {
        AXIS.enable(&mut client).await.unwrap();
        AXIS.set_mode(&mut client, Mode::PROFILE_POSITION)
            .await
            .unwrap();
        let from = position(&mut client).await;
        let target = from + 4_096;
        AXIS.move_to(&mut client, target, false).await.unwrap();
        let goal = Goal::Position { target, window: 20 };
        let result = AXIS.wait_for_target(&mut client, goal, 300).await;
        let Err(AxisError::NotReached { actual, seen, .. }) = result else {
            panic!("{result:?}")
        };
        assert_eq!(actual, i64::from(from));
        assert!(!seen.target_reached());
    });
}

#[test]
fn a_torque_step_against_a_blocked_shaft_is_reached() {
    let mut bus = bus();
    bus.drive(NODE).unwrap().plant().set_blocked(true);
    let mut client = client(&mut bus);
    block_on(async {
        AXIS.enable(&mut client).await.unwrap();
        AXIS.set_mode(&mut client, Mode::PROFILE_TORQUE)
            .await
            .unwrap();
        AXIS.set_torque(&mut client, 400).await.unwrap();
        let goal = Goal::Torque {
            target_pm: 400,
            window_pm: 8,
        };
        AXIS.wait_for_target(&mut client, goal, 100).await.unwrap();
    });
    // 400 per mille of 23 mNm at 32 mNm/A are 287.5 mA; 2.5 mA is one step of the converter.
    let current_a = bus
        .drive(NODE)
        .unwrap()
        .core()
        .unwrap()
        .feedback()
        .current_q_a;
    assert!((current_a - 0.2875).abs() < 0.005, "{current_a}");
}

#[test]
fn a_disabled_axis_takes_no_set_point() {
    let mut bus = bus();
    let mut client = client(&mut bus);
    let result = block_on(AXIS.move_to(&mut client, 100, false));
    assert!(
        matches!(
            result,
            Err(AxisError::State {
                wanted: State::OperationEnabled,
                ..
            })
        ),
        "{result:?}"
    );
}

fn cyclic(order: Order) {
    let mut bus = bus();
    let mut client = client(&mut bus);
    let pdo = |direction, number, transmission, mapped: &[Mapped]| {
        Pdo::predefined(NODE, direction, number, transmission, mapped).unwrap()
    };
    let target = Mapped::new(0x607A, DataType::I32);
    let status = Mapped::new(0x6041, DataType::U16);
    let actual = Mapped::new(0x6064, DataType::I32);
    let velocity = Mapped::new(0x606C, DataType::I32);
    let set_point = pdo(Direction::Receive, 1, 1, &[target]);
    let feedback = pdo(Direction::Transmit, 1, 1, &[status, actual]);
    let slow = pdo(Direction::Transmit, 2, 10, &[velocity]);
    block_on(async {
        for pdo in [&set_point, &feedback, &slow] {
            client.configure_pdo(pdo, order).await.unwrap();
        }
        client
            .empty_pdos(NODE, Direction::Transmit, 3..=4)
            .await
            .unwrap();
        AXIS.enable(&mut client).await.unwrap();
        AXIS.set_mode(&mut client, Mode::CYCLIC_POSITION)
            .await
            .unwrap();
        let from = position(&mut client).await;
        // 50 counts each millisecond: 50,000 counts/s.
        let first = client.now().plus_ms(1);
        let mut cycle = Cycle::new(first, 1_000_000);
        let (mut fast, mut speeds) = (Vec::new(), Vec::new());
        for n in 1..=200 {
            let values = [Value::Integer(i64::from(from) + 50 * n)];
            let frames = [set_point.frame(&values).unwrap()];
            cycle
                .run(&mut client, &frames, |at, frame| {
                    if let Some(values) = feedback.values(frame) {
                        fast.push((at, values));
                    } else if let Some(values) = slow.values(frame) {
                        speeds.push(values[0].clone());
                    }
                })
                .await
                .unwrap();
        }
        assert_eq!(cycle.missed(), 0);
        assert_eq!(cycle.next(), first.plus_ms(200));
        assert_eq!(fast.len(), 200);
        assert_eq!(speeds.len(), 20);
        // Each answer follows its SYNC within the cycle.
        for (n, (at, _)) in fast.iter().enumerate() {
            let due = first.plus_ms(n as u64);
            assert!(*at > due && *at < due.plus_ms(1), "{n}");
        }
        let Value::Integer(speed) = speeds[19] else {
            panic!("{speeds:?}")
        };
        assert!((speed - 50_000).abs() < 2_000, "{speed}");
        // The last SYNC brought set-point 199, which the drive reaches a millisecond later; the
        // last answer is therefore about set-point 198.
        let [Value::Integer(word), Value::Integer(at)] = fast[199].1[..] else {
            panic!("{fast:?}")
        };
        let off = at - i64::from(from) - 50 * 198;
        assert!(off.abs() < 60, "{off}");
        let word = cia402::Statusword(word as u16);
        assert!(word.follows_command() && !word.following_error());
    });
}

#[test]
fn set_points_are_streamed_with_sync() {
    cyclic(Order::WhileValid);
    cyclic(Order::OffFirst);
}

#[test]
fn a_cycle_that_comes_late_leaves_periods_out_and_keeps_its_grid() {
    let mut bus = bus();
    let mut client = client(&mut bus);
    let first = client.now().plus_ms(1);
    let mut cycle = Cycle::new(first, 1_000_000);
    block_on(async {
        cycle.run(&mut client, &[], |_, _| {}).await.unwrap();
        assert_eq!(client.now(), first.plus_ms(1));
        wait(&mut client, 3).await;
        cycle.run(&mut client, &[], |_, _| {}).await.unwrap();
    });
    assert_eq!(cycle.missed(), 3);
    assert_eq!(cycle.next(), first.plus_ms(5));
}
