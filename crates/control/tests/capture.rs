//! Captures of edges and index pulses, exact to the period, whatever bounces.

use control::capture::{Captures, Latched, Trigger};

const TURN: i32 = 4096;

/// Feeds readings of a rotor that goes through `ways`, in the encoder's counts.
struct Rotor {
    captures: Captures,
    place: i32,
    polarity: i32,
    levels: u32,
}

impl Rotor {
    fn at(place: i32, polarity: i32) -> Rotor {
        let mut captures = Captures::new();
        captures.set_encoder(TURN, polarity);
        let mut rotor = Rotor {
            captures,
            place,
            polarity,
            levels: 0,
        };
        rotor.go(0);
        rotor
    }

    fn go(&mut self, way: i32) {
        self.place += way;
        self.captures.period(
            self.levels,
            self.place.rem_euclid(TURN),
            self.place * self.polarity,
        );
    }

    fn latched(&self) -> Latched {
        self.captures.seen().latches[1]
    }
}

#[test]
fn the_index_is_exact_at_any_speed_and_in_both_directions() {
    let trigger = Trigger {
        index: true,
        ..Trigger::default()
    };
    for polarity in [1, -1] {
        // Start, steps, and the count of the encoder's place at which the index was.
        let cases: [(i32, &[i32], Option<i32>); 12] = [
            (4_000, &[50, 45], None),
            (4_000, &[50, 46], Some(4_096)),
            (4_000, &[2_000], Some(4_096)),
            (100, &[-99], None),
            (100, &[-100], Some(0)),
            (100, &[-2_000], Some(0)),
            // Leaving it is not coming to it.
            (0, &[5, 5], None),
            (0, &[-5, -5], None),
            (0, &[0, 0], None),
            (1, &[-1, -1], Some(0)),
            (-1, &[1, 1], Some(0)),
            // The first stays.
            (4_000, &[200, 2_000, 2_000], Some(4_096)),
        ];
        for (start, steps, index) in cases {
            let mut rotor = Rotor::at(start, polarity);
            rotor.captures.set_trigger(1, trigger);
            for step in steps {
                rotor.go(*step);
            }
            let latched = rotor.latched();
            let got = (latched.index_count > 0).then_some(latched.index);
            let expected = index.map(|place| place * polarity);
            assert_eq!(got, expected, "{start} {steps:?} {polarity}");
        }
    }
}

#[test]
fn the_first_index_after_an_edge_counts() {
    let mut rotor = Rotor::at(3_000, 1);
    rotor.captures.set_trigger(
        1,
        Trigger {
            inputs: 4,
            rising: true,
            index: true,
            serial: 7,
            ..Trigger::default()
        },
    );
    rotor.go(1_500);
    assert_eq!(rotor.latched().index_count, 0, "before the edge");
    rotor.levels = 4;
    rotor.go(100);
    let latched = rotor.latched();
    assert_eq!((latched.rising, latched.rising_count), (4_600, 1));
    rotor.go(1_800);
    rotor.go(1_800);
    rotor.levels = 0;
    rotor.go(10);
    rotor.levels = 4;
    rotor.go(10);
    let latched = rotor.latched();
    assert_eq!((latched.index, latched.index_count), (8_192, 1));
    assert_eq!((latched.rising, latched.serial), (4_600, 7));
}

#[test]
fn only_wanted_edges_of_wanted_inputs_are_captured() {
    let mut rotor = Rotor::at(0, 1);
    let trigger = Trigger {
        inputs: 1 << 16,
        rising: true,
        falling: true,
        continuous: true,
        ..Trigger::default()
    };
    rotor.captures.set_trigger(1, trigger);
    for (levels, way) in [
        (1, 10),
        (1 << 16 | 1, 10),
        (1 << 16, 10),
        (0, 10),
        (1 << 16, 10),
    ] {
        rotor.levels = levels;
        rotor.go(way);
    }
    let latched = rotor.latched();
    assert_eq!((latched.rising, latched.rising_count), (50, 2));
    assert_eq!((latched.falling, latched.falling_count), (40, 1));
    // An inverted input: nothing has moved, and edges are the other way round.
    rotor.captures.set_trigger(
        1,
        Trigger {
            falling: false,
            ..trigger
        },
    );
    rotor.captures.set_inverted(1 << 16);
    assert_eq!(rotor.captures.seen().active, 0);
    rotor.go(10);
    assert_eq!(rotor.latched().rising_count, 0);
    rotor.levels = 0;
    rotor.go(10);
    assert_eq!(rotor.latched().rising, 70);
    rotor.captures.rename(-1_000);
    assert_eq!(rotor.latched().rising, -930);
}

#[test]
fn the_first_reading_is_no_edge() {
    let mut captures = Captures::new();
    captures.set_encoder(TURN, 1);
    captures.set_trigger(
        0,
        Trigger {
            inputs: u32::MAX,
            rising: true,
            index: true,
            ..Trigger::default()
        },
    );
    captures.period(0xF, 4_000, 4_000);
    captures.period(0xF, 3_990, 3_990);
    assert_eq!(captures.seen().latches[0], Latched::default());
}

#[test]
fn a_bouncing_switch_counts_once_and_where_it_first_touched() {
    let mut rotor = Rotor::at(4_000, 1);
    rotor.captures.set_filter(5, 0);
    rotor.captures.set_trigger(
        1,
        Trigger {
            inputs: 4,
            falling: true,
            index: true,
            ..Trigger::default()
        },
    );
    // It closes with bounces, in which it opens, too; 5 periods later it is closed.
    for level in [4, 0, 4, 0, 0, 4, 4, 4, 4, 4] {
        rotor.levels = level;
        rotor.go(3);
        assert_eq!(rotor.captures.seen().active, 0);
    }
    rotor.go(3);
    assert_eq!(rotor.captures.seen().active, 4);
    assert_eq!(rotor.latched().falling_count, 0);
    // A disturbance shorter than the filter is none.
    for level in [0, 0, 0, 0, 4, 4, 4, 4, 4, 4, 4] {
        rotor.levels = level;
        rotor.go(1);
    }
    assert_eq!(rotor.latched(), Latched::default());
    // It opens at 4053 and bounces beyond the index, which is after the first touch.
    let place = rotor.place;
    for level in [0, 4, 0, 0, 0, 0, 0, 0] {
        rotor.levels = level;
        rotor.go(10);
    }
    let latched = rotor.latched();
    assert_eq!((latched.falling, latched.falling_count), (place + 10, 1));
    assert_eq!((latched.index, latched.index_count), (4_096, 1));
}

#[test]
fn any_reading_may_come() {
    // No panic with overflow checks, and no edge of an input that nothing waits for.
    let mut random = 0x2545_F491_4F6C_DD1D_u64;
    let mut next = || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random
    };
    let mut captures = Captures::new();
    for _ in 0..200_000 {
        match next() % 16 {
            0 => captures.set_encoder(next() as i32, next() as i32),
            1 => captures.set_inverted(next() as u32),
            2 => captures.set_filter(next() as u16 % 5, next() as u16 % 5),
            3 => captures.rename(next() as i32),
            4 => captures.set_trigger(
                next() as usize % 4,
                Trigger {
                    inputs: next() as u32 & 0x0001_0004,
                    rising: next() % 2 == 0,
                    falling: next() % 2 == 0,
                    index: next() % 2 == 0,
                    continuous: next() % 2 == 0,
                    serial: next() as u8,
                },
            ),
            _ => captures.period(next() as u32, next() as i32, next() as i32),
        }
        assert_eq!(captures.seen().active & !0x000F_000F, 0);
    }
}
