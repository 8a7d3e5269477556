//! Limited jerk in profile position and profile velocity mode.

mod rig;

use cia402::{Mode, State, Target};
use rig::{PERIOD_NS, Random, Rig, STANDARD};

const REACHED: u16 = 0x0400;
const JERK: f32 = 4_000_000.0;

/// 10,000 counts/s, up at 100,000, down at 200,000 counts/s², 4,000,000 counts/s³.
fn rig(mode: Mode) -> Rig {
    let mut rig = Rig::enabled(&STANDARD, mode);
    rig.configuration.jerk = JERK;
    rig
}

/// The velocity at each tick of the trace.
fn ticks(rig: &Rig) -> Vec<f64> {
    let periods = (1_000_000 / PERIOD_NS) as usize;
    let ticks = rig.trace.iter().skip(periods - 1).step_by(periods);
    ticks.map(|sample| sample.velocity).collect()
}

/// Velocity, acceleration and jerk as the differences of whole milliseconds show them. Segments
/// have one acceleration each; in position mode they keep their end positions exactly, which
/// costs up to a sixth of a millisecond's jerk.
#[track_caller]
fn soft(rig: &Rig, velocity: f64, rate: f64, jerk: f64) {
    let seen = ticks(rig);
    let slack = jerk * 1e-6 / 3.0 + 0.1;
    for velocities in seen.windows(3) {
        let [before, now, after] = velocities else {
            unreachable!()
        };
        assert!(now.abs() <= velocity + slack, "{velocities:?}");
        assert!((after - now).abs() <= rate * 1e-3 + slack, "{velocities:?}");
        let change = (after - 2.0 * now + before).abs();
        assert!(change <= jerk * 1e-6 + 2.0 * slack, "{velocities:?}");
    }
}

fn hand_over(rig: &mut Rig, target: i32, word: u16) {
    rig.targets.position = target;
    rig.word(word);
    rig.word(word | 0x10);
}

#[test]
fn a_move_takes_the_closed_form() {
    let mut rig = rig(Mode::PROFILE_POSITION);
    rig.trace.clear();
    hand_over(&mut rig, 5000, 0x0F);
    // L/v + v/2·(1/a + 1/d) + (a + d)/2j = 500 + 75 + 37.5 ms.
    rig.run_ms(612);
    assert_eq!(rig.status() & REACHED, 0);
    rig.run_ms(2);
    assert_eq!(rig.status() & REACHED, REACHED);
    assert_eq!(rig.sample().position, 5000.0);
    assert_eq!(rig.sample().velocity, 0.0);
    soft(&rig, 10_000.0, 200_000.0, f64::from(JERK));
    let fastest = ticks(&rig).into_iter().fold(0.0, f64::max);
    assert!((fastest - 10_000.0).abs() < 1.0);
    // After the rise, 125 ms, it cruises: a linear ramp would have taken 100 ms.
    assert!(ticks(&rig)[110] < 9_900.0);
    assert!((ticks(&rig)[126] - 10_000.0).abs() < 1.0);
}

#[test]
fn a_new_target_on_the_way_makes_no_step() {
    let mut random = Random(86);
    for case in 0..300 {
        let mut rig = rig(Mode::PROFILE_POSITION);
        let mut last = 0;
        rig.trace.clear();
        for _ in 0..6 {
            last = random.below(20_000) as i32 - 10_000;
            // At once, or from the buffer; absolute or passing through.
            let word = [0x2F, 0x0F, 0x20F][random.below(3) as usize];
            hand_over(&mut rig, last, word);
            if word == 0x0F && rig.status() & 0x1000 == 0 {
                continue;
            }
            rig.run_ms(random.below(600) as u32);
        }
        hand_over(&mut rig, last, 0x2F);
        rig.run_ms(10_000);
        assert_eq!(rig.sample().position, f64::from(last), "case {case}");
        assert_eq!(rig.status() & REACHED, REACHED, "case {case}");
        soft(&rig, 10_000.0, 200_000.0, f64::from(JERK));
    }
}

#[test]
fn velocity_ramps_are_rounded() {
    let mut rig = rig(Mode::PROFILE_VELOCITY);
    rig.trace.clear();
    for (target, ms) in [
        (10_000, 125), // v/a + a/j = 100 + 25
        (0, 100),      // v/d + d/j = 50 + 50
        (-10_000, 125),
        (-9_990, 4),  // 2·√(Δv/j) = 3.2
        (5_000, 175), // Δv/a + a/j = 149.9 + 25
    ] {
        rig.targets.velocity = target;
        rig.receive(Target::Velocity);
        rig.run_ms(ms - 3);
        assert_ne!(rig.sample().velocity, f64::from(target), "{target}");
        rig.run_ms(6);
        assert!(
            (rig.sample().velocity - f64::from(target)).abs() < 1e-2,
            "{target}"
        );
        assert_eq!(rig.status() & REACHED, REACHED, "{target}");
    }
    soft(&rig, 10_000.0, 200_000.0, f64::from(JERK));
}

#[test]
fn a_target_that_changes_each_millisecond_makes_no_step() {
    let mut random = Random(3);
    for equal in [false, true] {
        let mut rig = rig(Mode::PROFILE_VELOCITY);
        if equal {
            rig.configuration.deceleration = 100_000.0;
        }
        rig.trace.clear();
        for _ in 0..3000 {
            rig.targets.velocity = random.below(20_001) as i32 - 10_000;
            rig.receive(Target::Velocity);
            rig.run_ms(1 + random.below(40) as u32);
        }
        soft(&rig, 10_010.0, 200_000.0, f64::from(JERK));
    }
}

#[test]
fn the_slow_down_ramp_is_rounded_and_the_quick_stop_is_not() {
    for mode in [Mode::PROFILE_POSITION, Mode::PROFILE_VELOCITY] {
        let moving = || {
            let mut rig = rig(mode);
            rig.targets.position = 1_000_000;
            rig.targets.velocity = 10_000;
            rig.word(0x1F);
            rig.run_ms(300);
            rig.trace.clear();
            rig
        };
        // Halt: 50 + 50 ms.
        let mut rig = moving();
        rig.word(0x10F);
        rig.run_ms(97);
        assert!(rig.sample().velocity > 0.0, "{mode}");
        rig.run_ms(6);
        assert_eq!(rig.sample().velocity, 0.0, "{mode}");
        soft(&rig, 10_000.0, 200_000.0, f64::from(JERK));
        // And on, with a rise of 125 ms.
        rig.word(0x0F);
        rig.run_ms(128);
        assert!((rig.sample().velocity - 10_000.0).abs() < 1.0, "{mode}");
        soft(&rig, 10_000.0, 200_000.0, f64::from(JERK));
        // On the way out.
        let mut rig = moving();
        rig.word(0x07);
        rig.run_ms(95);
        assert_eq!(rig.axis.state(), State::OperationEnabled, "{mode}");
        rig.run_ms(10);
        assert_eq!(rig.axis.state(), State::SwitchedOn, "{mode}");
        // Quick stop: 25 ms.
        let mut rig = moving();
        rig.word(0x02);
        rig.run_ms(30);
        assert_eq!(rig.axis.state(), State::SwitchOnDisabled, "{mode}");
    }
}
