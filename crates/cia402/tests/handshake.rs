//! The profile position handshake, as traces: what is written and what bits 10 and 12 say.

mod rig;

use cia402::{Mode, Target, Window};
use rig::{P3, Rig, STANDARD};

const REACHED: u16 = 0x0400;
const ACK: u16 = 0x1000;

/// A step of a trace: an action, then the expected acknowledge and target reached.
#[derive(Debug)]
enum Do {
    /// Target position, then controlword.
    Write(i32, u16),
    /// Let so many milliseconds pass.
    Wait(u32),
    /// The demand must have come to rest here.
    At(i32),
}
use Do::*;

fn play(rig: &mut Rig, trace: &[(Do, bool, bool)]) {
    for (line, (action, ack, reached)) in trace.iter().enumerate() {
        match *action {
            Write(target, word) => {
                rig.targets.position = target;
                rig.word(word);
            }
            Wait(ms) => rig.run_ms(ms),
            At(position) => {
                let sample = rig.sample();
                let off = (sample.position - f64::from(position)).abs();
                // What f32 leaves of a segment's end; the next demand is exact again.
                assert!(
                    off < 1e-6 && sample.velocity.abs() < 1e-2,
                    "{line}: {sample:?}"
                );
            }
        }
        let status = rig.status();
        let bits = (status & ACK != 0, status & REACHED != 0);
        assert_eq!(
            bits,
            (*ack, *reached),
            "line {line}, {action:?}: {status:04X}"
        );
    }
}

// v 10,000, a 100,000, d 200,000: 100 ms up (500), 50 ms down (250). 1000 counts take 175 ms
// (25 ms cruising), 5000 take 575 ms. 1000 and back is twice that.

#[test]
fn a_single_set_point() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    play(
        &mut rig,
        &[
            (Wait(5), false, false), // no acknowledge before the first set-point
            (Write(1000, 0x1F), true, false),
            (Write(1000, 0x0F), false, false), // bit 4 falls, room for one more
            (Wait(175), false, false),
            (Wait(1), false, true),
            (At(1000), false, true),
            (Write(77, 0x0F), false, true), // without an edge the target means nothing
            (Wait(50), false, true),
            (At(1000), false, true),
        ],
    );
}

#[test]
fn the_acknowledge_stays_while_bit_4_does() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    play(
        &mut rig,
        &[
            (Write(1000, 0x1F), true, false),
            (Wait(176), true, true),
            (Write(2000, 0x1F), true, true), // no edge
            (Wait(10), true, true),
            (At(1000), true, true),
            (Write(2000, 0x0F), false, true),
        ],
    );
}

#[test]
fn a_set_of_set_points_one_after_the_other() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    play(
        &mut rig,
        &[
            (Write(1000, 0x1F), true, false),
            (Write(0, 0x0F), false, false),
            (Wait(50), false, false),
            (Write(5000, 0x1F), true, false), // into the buffer
            (Write(0, 0x0F), true, false),    // which is full: the acknowledge stays
            (Write(-9, 0x1F), true, false),   // lost
            (Write(0, 0x0F), true, false),
            (Wait(125), true, false),
            (At(1000), true, false),   // at rest in the first
            (Wait(1), false, false),   // the second starts, and the buffer is free
            (Wait(474), false, false), // 4000 take 475 ms
            (At(5000), false, false),
            (Wait(1), false, true),
            (At(5000), false, true),
        ],
    );
}

#[test]
fn change_immediately() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    play(
        &mut rig,
        &[
            (Write(5000, 0x1F), true, false),
            (Write(0, 0x0F), false, false),
            (Wait(200), false, false),
            (Write(8000, 0x1F), true, false), // into the buffer
            (Write(0, 0x0F), true, false),
            // Back at once; the buffer is thrown away. 1500 + 250 counts, 1750 + 1000 back.
            (Write(-1000, 0x3F), true, false),
            (Write(0, 0x0F), false, false),
            (Wait(49), false, false),
        ],
    );
    // At 200 ms it was at 500 + 100 ms × 10,000 = 1500 with 10,000 counts/s; it stops in 50 ms.
    assert!(
        (rig.sample().position - 1750.0).abs() < 1.0,
        "{:?}",
        rig.sample()
    );
    // 2750 back: 100 + 200 + 50 ms.
    play(
        &mut rig,
        &[
            (Wait(351), false, false),
            (Wait(1), false, true),
            (At(-1000), false, true),
        ],
    );
}

#[test]
fn relative_means_relative_to_the_last_target() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    rig.lag = 3; // not relative to where the motor is
    play(
        &mut rig,
        &[
            (Write(1000, 0x5F), true, false),
            (Write(0, 0x0F), false, false),
            (Wait(200), false, true),
            (At(1000), false, true),
            (Write(1000, 0x5F), true, false),
            (Write(0, 0x0F), false, false),
            (Wait(50), false, false),
            // On the way to 2000: immediately, relative to 2000.
            (Write(500, 0x7F), true, false),
            (Write(0, 0x0F), false, false),
            (Wait(400), false, true),
            (At(2500), false, true),
            // Two within one millisecond add up.
            (Write(10, 0x7F), true, false),
            (Write(0, 0x0F), false, false),
            (Write(-30, 0x7F), true, false),
            (Wait(100), true, true),
            (At(2480), true, true),
        ],
    );
}

#[test]
fn change_on_set_point_passes_the_first_without_stopping() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    play(
        &mut rig,
        &[
            (Write(1000, 0x1F), true, false),
            (Write(0, 0x0F), false, false),
            (Wait(10), false, false),
            (Write(2000, 0x21F), true, false),
            (Write(0, 0x20F), true, false),
            // 1000 is passed at full speed: 100 ms (500) + 50 ms (500), then the buffer is free.
            (Wait(138), true, false),
            (Wait(3), false, false),
        ],
    );
    assert!(
        (rig.sample().velocity - 10_000.0).abs() < 1.0,
        "{:?}",
        rig.sample()
    );
    // 2000 in all take 275 ms.
    play(
        &mut rig,
        &[
            (Wait(124), false, false),
            (Wait(1), false, true),
            (At(2000), false, true),
        ],
    );

    // Where the second lies backwards, the first is a place to stop at.
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    play(
        &mut rig,
        &[
            (Write(1000, 0x1F), true, false),
            (Write(0, 0x0F), false, false),
            (Wait(10), false, false),
            (Write(500, 0x21F), true, false),
            (Write(0, 0x20F), true, false),
            (Wait(165), true, false),
            (At(1000), true, false),
            (Wait(200), false, true),
            (At(500), false, true),
        ],
    );
    let top = rig
        .trace
        .iter()
        .map(|sample| sample.position)
        .fold(0.0, f64::max);
    assert!(top < 1000.0 + 1e-3, "{top}");
}

#[test]
fn target_reached_asks_the_motor() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    // P3: 20 counts (P53).
    rig.configuration.position_window = Some(Window {
        size: 20,
        time_ms: 10,
    });
    rig.lag = 21;
    play(
        &mut rig,
        &[
            (Write(1000, 0x1F), true, false),
            (Write(2000, 0x0F), false, false),
            (Write(2000, 0x1F), true, false), // the buffered one waits until the first is reached
            (Write(2000, 0x0F), true, false),
            (Wait(1000), true, false),
            (At(1000), true, false),
        ],
    );
    rig.lag = 20;
    play(
        &mut rig,
        &[
            (Wait(11), true, false),
            (At(1000), true, false),
            (Wait(2), false, false),
            (Wait(200), false, true),
            (At(2000), false, true),
        ],
    );
    // Pushed out of the window, the target is no longer reached.
    rig.lag = 40;
    play(&mut rig, &[(Wait(2), false, false)]);
    rig.lag = 0;
    play(&mut rig, &[(Wait(9), false, false), (Wait(4), false, true)]);
}

#[test]
fn the_manuals_drive_from_reset_to_target() {
    let mut rig = Rig::new(&P3);
    rig.place(-12_345);
    rig.configuration.position_window = Some(Window {
        size: 20,
        time_ms: 0,
    });
    rig.word(0x86);
    rig.word(0x0F);
    rig.mode(Mode::PROFILE_POSITION).expect("mode 1");
    rig.run_ms(3);
    assert_eq!(rig.sample().position, -12_345.0);
    // A write of the target alone does not move it.
    rig.targets.position = 0;
    rig.receive(Target::Position);
    rig.run_ms(3);
    assert_eq!(rig.sample().position, -12_345.0);
    rig.word(0x1F);
    assert_eq!(rig.status(), 0x1037);
    rig.word(0x0F);
    // 12,345 counts: 100 + 50 ms ramps (750), 1159.5 ms at speed.
    rig.run_ms(1308);
    assert_eq!(rig.status(), 0x0037);
    rig.run_ms(4);
    assert_eq!(rig.status(), 0x0437);
    assert_eq!(rig.sample().position, 0.0);
}

#[test]
fn leaving_the_mode_or_the_state_forgets_everything() {
    for way in 0..2 {
        let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
        rig.configuration.disable_option = 0;
        rig.targets.position = 1000;
        rig.word(0x1F);
        rig.run_ms(10);
        rig.targets.position = 5000;
        rig.word(0x0F);
        rig.word(0x1F);
        assert_eq!(rig.status() & (ACK | REACHED), ACK);
        if way == 0 {
            rig.mode(Mode::PROFILE_VELOCITY).expect("mode 3");
            assert_eq!(rig.status() & 0x3400, 0);
            rig.mode(Mode::PROFILE_POSITION).expect("mode 1");
        } else {
            rig.word(0x07);
            assert_eq!(rig.status() & 0x3400, 0);
            rig.word(0x0F);
        }
        assert_eq!(rig.status() & 0x3400, 0);
        rig.run_ms(200);
        // Neither target was moved to.
        assert!(rig.sample().position < 100.0, "{:?}", rig.sample());
        assert_eq!(rig.sample().velocity, 0.0);
    }
}

#[test]
fn a_set_point_keeps_the_parameters_of_its_edge() {
    let mut rig = Rig::enabled(&STANDARD, Mode::PROFILE_POSITION);
    rig.targets.position = 1000;
    rig.word(0x1F);
    rig.configuration.profile_velocity = 10.0;
    rig.targets.position = 9;
    rig.run_ms(176);
    assert_eq!(rig.sample().position, 1000.0);
}

#[test]
fn across_the_end_of_the_counts() {
    // A relative move wraps, an absolute one goes the long way.
    let mut rig = Rig::new(&STANDARD);
    rig.place(i32::MAX - 10);
    rig.word(0x06);
    rig.word(0x0F);
    rig.mode(Mode::PROFILE_POSITION).expect("mode 1");
    rig.run_ms(1);
    rig.targets.position = 1000;
    rig.word(0x5F);
    rig.run_ms(176);
    assert_eq!(rig.actual.demand_position, i32::MIN + 989);
    assert_eq!(rig.status() & REACHED, REACHED);
    rig.word(0x0F);
    rig.targets.position = i32::MIN + 1989;
    rig.word(0x1F);
    rig.run_ms(176);
    assert_eq!(rig.actual.demand_position, i32::MIN + 1989);
    rig.word(0x0F);
    rig.configuration.profile_velocity = 2e9;
    rig.configuration.acceleration = 1e12;
    rig.configuration.deceleration = 1e12;
    rig.targets.position = i32::MAX;
    rig.word(0x1F);
    // (2³² − 1990 − ...) counts at 2·10⁹ counts/s: 2.146 s and 4 ms of ramps.
    rig.run_ms(1000);
    assert!((f64::from(rig.actual.demand_position) - (-2_147_481_659.0 + 2e9 - 2e6)).abs() < 300.0);
    rig.run_ms(1152);
    assert_eq!(rig.actual.demand_position, i32::MAX);
    assert_eq!(rig.status() & REACHED, REACHED);
}
