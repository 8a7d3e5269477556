//! Switches, inputs and what else the board says.

mod support;

use plant::{Invalid, Parameters, Plant, Switch, SwitchName, Switches};
use support::{OPEN, frictionless};

fn machine() -> Parameters {
    let mut parameters = frictionless();
    parameters.switches = Switches {
        negative_limit: Some(Switch::below(-2.0)),
        positive_limit: Some(Switch::above(3.0)),
        home: Some(Switch::between(0.5, 0.75)),
    };
    parameters
}

fn moving(parameters: &Parameters, speed_turns: f32) -> Plant<f32> {
    assert_eq!(parameters.check(), Ok(()));
    let mut plant = Plant::<f32>::new(parameters);
    plant.load(&OPEN);
    let truth = plant.truth();
    plant.set_motion(truth.angle, speed_turns * std::f32::consts::TAU);
    plant
}

/// Positions in turns at which the inputs change, with what they are then.
fn edges(plant: &mut Plant<f32>, periods: u32) -> Vec<(f64, u32)> {
    let mut last = plant.signals().inputs;
    let mut edges = Vec::new();
    for _ in 0..periods {
        plant.step();
        let inputs = plant.signals().inputs;
        if inputs != last {
            edges.push((plant.truth().position_turns(), inputs));
            last = inputs;
        }
    }
    edges
}

fn assert_edges(actual: &[(f64, u32)], expected: &[(f64, u32)], step: f64) {
    assert_eq!(actual.len(), expected.len(), "{actual:?}");
    for (&(at, inputs), &(where_, level)) in actual.iter().zip(expected) {
        assert_eq!(inputs, level, "{actual:?}");
        assert!((at - where_).abs() <= step, "{at} {where_}");
    }
}

#[test]
fn every_switch_is_where_it_is() {
    // 10 turns/s, 10 µs: 1e-4 turns a step.
    let mut plant = moving(&machine(), 10.0);
    assert_eq!(plant.signals().inputs, 0);
    let seen = edges(&mut plant, 40_000);
    assert_edges(&seen, &[(0.5, 4), (0.75, 0), (3.0, 2)], 1.01e-4);
    assert_eq!(plant.truth().switches, 2);
    // And back from turn 0 (set_motion forgets turns).
    let mut plant = moving(&machine(), -10.0);
    let seen = edges(&mut plant, 30_000);
    assert_edges(&seen, &[(-2.0, 1)], 1.01e-4);
}

#[test]
fn hysteresis_opens_later_than_it_closed() {
    let mut parameters = machine();
    for switch in [
        &mut parameters.switches.negative_limit,
        &mut parameters.switches.home,
    ] {
        switch.as_mut().unwrap().hysteresis_turns = 0.01;
    }
    let mut plant = moving(&parameters, 10.0);
    let seen = edges(&mut plant, 10_000);
    assert_edges(&seen, &[(0.5, 4), (0.76, 0)], 1.01e-4);
    // Turned round by a load.
    plant.set_load_torque_nm(5.6);
    plant.step();
    plant.set_load_torque_nm(0.0);
    let seen = edges(&mut plant, 10_000);
    assert_eq!(seen.first().map(|edge| edge.1), Some(4), "{seen:?}");
    assert!(
        (seen[0].0 - 0.75).abs() < 0.01 && (seen[1].0 - 0.49).abs() < 0.01,
        "{seen:?}"
    );
}

#[test]
fn a_normally_closed_switch_reads_the_other_way() {
    let mut parameters = machine();
    parameters.switches.home.as_mut().unwrap().active_low = true;
    let mut plant = moving(&parameters, 10.0);
    assert_eq!(plant.signals().inputs, 4);
    let seen = edges(&mut plant, 10_000);
    assert_edges(&seen, &[(0.5, 0), (0.75, 4)], 1.01e-4);
    assert_eq!(plant.truth().switches, 0);
}

#[test]
fn a_machine_that_starts_on_its_switch_has_it_pressed() {
    let mut parameters = machine();
    parameters.start_turns = 0.6;
    parameters.switches.home.as_mut().unwrap().bounce_s = 1e-3;
    let mut plant = Plant::<f32>::new(&parameters);
    for _ in 0..100 {
        assert_eq!(plant.signals().inputs, 4);
        plant.step();
    }
}

#[test]
fn a_bouncing_contact_settles_and_repeats_itself() {
    let mut parameters = machine();
    parameters.switches.home.as_mut().unwrap().bounce_s = 2e-3;
    let run = || {
        let mut plant = moving(&parameters, 10.0);
        edges(&mut plant, 10_000)
    };
    let seen = run();
    assert_eq!(seen, run());
    // 2 ms at 10 turns/s: all edges within 0.02 turns after each end of the region.
    let (first, second): (Vec<(f64, u32)>, Vec<_>) =
        seen.iter().copied().partition(|edge| edge.0 < 0.7);
    for (edges, begin, settled) in [(first, 0.5, 4), (second, 0.75, 0)] {
        assert!(edges.len() > 20, "{}", edges.len());
        assert!(
            edges
                .iter()
                .all(|edge| (begin..begin + 0.0202).contains(&edge.0)),
            "{edges:?}"
        );
        assert_eq!(edges.last().map(|edge| edge.1), Some(settled));
    }
}

/// A contact bounces for a time, not for a number of periods.
#[test]
fn another_pwm_period_leaves_the_bounce_as_long() {
    let mut parameters = machine();
    parameters.switches.home.as_mut().unwrap().bounce_s = 2e-3;
    // Before the switch is reached, and in the middle of its bounce, at 0.51 turns.
    for change_at in [0.3, 0.51] {
        for period_s in [5e-6, 20e-6] {
            let mut plant = moving(&parameters, 10.0);
            while plant.truth().position_turns() < change_at {
                plant.step();
                plant.signals();
            }
            plant.set_pwm_period_s(period_s);
            let seen = edges(&mut plant, (0.025 / period_s) as u32);
            let last = seen.iter().rfind(|edge| edge.0 < 0.7).unwrap();
            // A bouncing contact is open in its last periods with a chance of one half each.
            assert!((0.5194..0.5203).contains(&last.0), "{change_at} {last:?}");
            assert_eq!(last.1, 4);
        }
    }
}

#[test]
fn a_finger_is_stronger_than_the_shaft() {
    let mut plant = Plant::<f32>::new(&machine());
    plant.hold_switch(SwitchName::PositiveLimit, Some(true));
    assert_eq!((plant.signals().inputs, plant.truth().switches), (2, 2));
    plant.hold_switch(SwitchName::PositiveLimit, None);
    assert_eq!((plant.signals().inputs, plant.truth().switches), (0, 0));
    plant.set_motion(0x9000_0000_u32 as i32, 0.0);
    for (held, inputs) in [(None, 0), (Some(true), 4), (Some(false), 0)] {
        plant.hold_switch(SwitchName::Home, held);
        assert_eq!(plant.signals().inputs, inputs);
    }
    // One that is not connected has nothing to press.
    let mut bare = Plant::<f32>::new(&Parameters::default());
    bare.hold_switch(SwitchName::Home, Some(true));
    assert_eq!(bare.signals().inputs, 0);
}

#[test]
fn other_inputs_are_as_they_are_set() {
    let mut plant = Plant::<f32>::new(&machine());
    plant.set_inputs(0xF_000F);
    // Bits 0 to 2 belong to switches, which are open.
    assert_eq!(plant.signals().inputs, 0xF_0008);
    let mut bare = Plant::<f32>::new(&Parameters::default());
    bare.set_inputs(0xF_000F);
    assert_eq!(bare.signals().inputs, 0xF_000F);
    for (volts, counts) in [
        (0.0, 0.0),
        (3.3, 4095.0),
        (1.6, 1985.0),
        (-1.0, 0.0),
        (99.0, 4095.0),
        (f32::NAN, 0.0),
    ] {
        bare.set_auxiliary_v([volts, 3.3]);
        assert_eq!(bare.signals().auxiliary_adc, [counts, 4095.0], "{volts}");
    }
    assert!(!bare.signals().torque_off);
    bare.set_torque_off(true);
    assert!(bare.signals().torque_off);
}

#[test]
fn switches_that_cannot_be_are_refused() {
    let with = |switch: Switch| {
        let mut parameters = machine();
        parameters.switches.home = Some(switch);
        parameters.check()
    };
    assert_eq!(with(Switch::between(1.0, 0.5)), Err(Invalid::Switch(1.0)));
    assert!(with(Switch::between(f64::NAN, 0.5)).is_err());
    let mut switch = Switch::between(0.0, 0.5);
    switch.hysteresis_turns = -1.0;
    assert_eq!(with(switch), Err(Invalid::Switch(-1.0)));
    switch.hysteresis_turns = 0.0;
    switch.bounce_s = f64::INFINITY;
    assert!(with(switch).is_err());
}
