//! Homing methods (0x6098): what each looks for, and the legs of the way there.
//!
//! Directions, switch changes and the side on which an index pulse counts are those of the diagrams
//! in CiA 402 ("Homing", methods 1 to 37). A leg goes in one direction until the switch changes in
//! one way; so each leg's end is one certain place of the axis, however far the axis ran on before it
//! turned round.

/// A switch that homing looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Switch {
    /// Bit 0 of 0x60FD.
    NegativeLimit,
    /// Bit 1 of 0x60FD.
    PositiveLimit,
    /// Bit 2 of 0x60FD.
    Home,
}

/// A change of a switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Edge {
    /// It becomes active.
    Rising,
    /// It becomes inactive.
    Falling,
}

/// A direction of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Towards lesser positions; "left" in the diagrams.
    Negative,
    /// Towards greater positions; "right" in the diagrams.
    Positive,
}

impl Direction {
    /// −1 or 1.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Direction::Negative => -1.0,
            Direction::Positive => 1.0,
        }
    }

    /// The limit switch at that end.
    pub(crate) fn limit(self) -> Switch {
        match self {
            Direction::Negative => Switch::NegativeLimit,
            Direction::Positive => Switch::PositiveLimit,
        }
    }

    pub(crate) fn opposite(self) -> Direction {
        match self {
            Direction::Negative => Direction::Positive,
            Direction::Positive => Direction::Negative,
        }
    }
}

/// One way without turning round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Leg {
    pub(crate) direction: Direction,
    pub(crate) until: Edge,
}

/// Until the switch becomes active or inactive, to the left or to the right.
const LEFT_ON: Leg = leg(Direction::Negative, Edge::Rising);
const LEFT_OFF: Leg = leg(Direction::Negative, Edge::Falling);
const RIGHT_ON: Leg = leg(Direction::Positive, Edge::Rising);
const RIGHT_OFF: Leg = leg(Direction::Positive, Edge::Falling);

const fn leg(direction: Direction, until: Edge) -> Leg {
    Leg { direction, until }
}

/// Where an axis begins its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum From {
    /// Beside the switch.
    Off,
    /// On the switch.
    On,
    /// At the limit switch behind which there is nothing, turned round.
    Limit,
}

/// A way to a change of a switch: the last leg ends there, and goes on to the index pulse if there
/// is to be one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Search {
    pub(crate) switch: Switch,
    off: &'static [Leg],
    on: &'static [Leg],
    /// After the limit switch; empty: none is to be met.
    limit: &'static [Leg],
}

impl Search {
    pub(crate) fn legs(&self, from: From) -> &'static [Leg] {
        match from {
            From::Off => self.off,
            From::On => self.on,
            From::Limit => self.limit,
        }
    }
}

const fn search(
    switch: Switch,
    off: &'static [Leg],
    on: &'static [Leg],
    limit: &'static [Leg],
) -> Search {
    Search {
        switch,
        off,
        on,
        limit,
    }
}

/// Methods 1 to 14 with the index pulse, 17 to 30 without.
///
/// A positive home switch (3, 4) is active from its place to the positive end, a negative one (5, 6)
/// to the negative end; that of 7 to 14 over a part of the way.
#[rustfmt::skip]
static SEARCHES: [Search; 14] = [
    //                             beside the switch        on the switch            after the limit switch
    search(Switch::NegativeLimit, &[LEFT_ON, RIGHT_OFF],   &[RIGHT_OFF],            &[]),
    search(Switch::PositiveLimit, &[RIGHT_ON, LEFT_OFF],   &[LEFT_OFF],             &[]),
    search(Switch::Home,          &[RIGHT_ON, LEFT_OFF],   &[LEFT_OFF],             &[]),
    search(Switch::Home,          &[RIGHT_ON],             &[LEFT_OFF, RIGHT_ON],   &[]),
    search(Switch::Home,          &[LEFT_ON, RIGHT_OFF],   &[RIGHT_OFF],            &[]),
    search(Switch::Home,          &[LEFT_ON],              &[RIGHT_OFF, LEFT_ON],   &[]),
    search(Switch::Home,          &[RIGHT_ON, LEFT_OFF],   &[LEFT_OFF],             &[LEFT_OFF]),
    search(Switch::Home,          &[RIGHT_ON],             &[LEFT_OFF, RIGHT_ON],   &[LEFT_OFF, RIGHT_ON]),
    search(Switch::Home,          &[RIGHT_OFF, LEFT_ON],   &[RIGHT_OFF, LEFT_ON],   &[LEFT_ON]),
    search(Switch::Home,          &[RIGHT_OFF],            &[RIGHT_OFF],            &[LEFT_ON, RIGHT_OFF]),
    search(Switch::Home,          &[LEFT_ON, RIGHT_OFF],   &[RIGHT_OFF],            &[RIGHT_OFF]),
    search(Switch::Home,          &[LEFT_ON],              &[RIGHT_OFF, LEFT_ON],   &[RIGHT_OFF, LEFT_ON]),
    search(Switch::Home,          &[LEFT_OFF, RIGHT_ON],   &[LEFT_OFF, RIGHT_ON],   &[RIGHT_ON]),
    search(Switch::Home,          &[LEFT_OFF],             &[LEFT_OFF],             &[RIGHT_ON, LEFT_OFF]),
];

/// What a homing method looks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Goal {
    /// A change of a switch, and with `index` the first index pulse behind it.
    Switch {
        search: &'static Search,
        index: bool,
    },
    /// The first index pulse in a direction.
    Index(Direction),
    /// The end of the axis, and with `index` the first index pulse on the way back.
    HardStop { direction: Direction, index: bool },
    /// The present position.
    Here,
}

/// A homing method, the value of 0x6098.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HomingMethod(i8);

impl HomingMethod {
    /// The negative hard stop, then the first index pulse in the positive direction.
    pub const NEGATIVE_STOP_AND_INDEX: HomingMethod = HomingMethod(-1);
    /// The positive hard stop, then the first index pulse in the negative direction.
    pub const POSITIVE_STOP_AND_INDEX: HomingMethod = HomingMethod(-2);
    /// The negative hard stop.
    pub const NEGATIVE_STOP: HomingMethod = HomingMethod(-3);
    /// The positive hard stop.
    pub const POSITIVE_STOP: HomingMethod = HomingMethod(-4);
    /// The present position.
    pub const PRESENT_POSITION: HomingMethod = HomingMethod(37);

    /// Every method there is: those of CiA 402 without the reserved ones, and −1 to −4 of this
    /// project, which the standard leaves to makers.
    pub const ALL: [i8; 36] = [
        -4, -3, -2, -1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 17, 18, 19, 20, 21, 22, 23,
        24, 25, 26, 27, 28, 29, 30, 33, 34, 35, 37,
    ];

    /// The method with that number; `None` for those that are reserved or unknown, and 0.
    pub const fn new(number: i8) -> Option<HomingMethod> {
        match number {
            -4..=-1 | 1..=14 | 17..=30 | 33..=35 | 37 => Some(HomingMethod(number)),
            _ => None,
        }
    }

    /// The value of 0x6098.
    pub const fn number(self) -> i8 {
        self.0
    }

    pub(crate) fn goal(self) -> Goal {
        let (row, index) = match self.0 {
            n @ 1..=14 => (n - 1, true),
            n @ 17..=30 => (n - 17, false),
            33 => return Goal::Index(Direction::Negative),
            34 => return Goal::Index(Direction::Positive),
            -1 => return stop(Direction::Negative, true),
            -2 => return stop(Direction::Positive, true),
            -3 => return stop(Direction::Negative, false),
            -4 => return stop(Direction::Positive, false),
            _ => return Goal::Here,
        };
        match SEARCHES.get(usize::from(row.unsigned_abs())) {
            Some(search) => Goal::Switch { search, index },
            None => Goal::Here,
        }
    }
}

const fn stop(direction: Direction, index: bool) -> Goal {
    Goal::HardStop { direction, index }
}

/// What the control half shall capture, exact to its period: the position where a switch changes,
/// that of an index pulse, or of the first index pulse behind the change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trigger {
    /// The change to wait for; `None`: for the index pulse alone.
    pub edge: Option<(Switch, Edge)>,
    /// The index pulse counts, after the change if there is one to wait for.
    pub index: bool,
    /// Comes back with what was captured; differs from the trigger before.
    pub serial: u8,
}

/// What the control half has captured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Captured {
    /// Of the trigger to which this belongs.
    pub serial: u8,
    /// Position at the change of the switch, counts.
    pub edge: Option<i32>,
    /// Position of the index pulse, counts.
    pub index: Option<i32>,
}

/// What homing sees of the axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HomingInputs {
    /// The negative limit switch is active.
    pub negative_limit: bool,
    /// The positive limit switch is active.
    pub positive_limit: bool,
    /// The home switch is active.
    pub home: bool,
    /// What the trigger in force has captured.
    pub captured: Captured,
}

impl HomingInputs {
    pub(crate) fn is_active(&self, switch: Switch) -> bool {
        match switch {
            Switch::NegativeLimit => self.negative_limit,
            Switch::PositiveLimit => self.positive_limit,
            Switch::Home => self.home,
        }
    }
}

/// The parameters of homing, in internal units. A speed or rate that is 0, negative or NaN allows no
/// motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomingConfiguration {
    /// 0x6098. Other than a [`HomingMethod`]: homing fails.
    pub method: i8,
    /// Speed of the first leg: the search for a switch or a hard stop, or for the edge of a switch that
    /// the axis stands on, counts/s (0x6099,1).
    pub switch_velocity: f32,
    /// Speed of the later legs, and of the search for the index, counts/s (0x6099,2).
    pub zero_velocity: f32,
    /// Rate of speeding up and slowing down, counts/s² (0x609A).
    pub acceleration: f32,
    /// What the home point's position will be, counts (0x607C).
    pub offset: i32,
    /// Counts from one index pulse to the next.
    pub counts_per_turn: u32,
    /// Greatest torque while looking for a hard stop, per mille of rated torque.
    pub stop_torque_pm: f32,
    /// How long the axis must press and stand for a hard stop, ms.
    pub stop_time_ms: u16,
    /// How far the axis goes back from a hard stop, counts.
    pub back_off: u32,
    /// Homing fails if it lasts longer, ms; 0: it may.
    pub timeout_ms: u32,
    /// Homing fails if it leads farther from its start, counts; 0: it may.
    pub range: u32,
    /// Homing fails if a hard stop is met nearer to its start, counts; 0: it may be anywhere.
    pub least_way: u32,
}

impl HomingConfiguration {
    /// The present position is home, and has position 0.
    pub const DEFAULT: HomingConfiguration = HomingConfiguration {
        method: HomingMethod::PRESENT_POSITION.number(),
        switch_velocity: 0.0,
        zero_velocity: 0.0,
        acceleration: 0.0,
        offset: 0,
        counts_per_turn: 0,
        stop_torque_pm: 0.0,
        stop_time_ms: 0,
        back_off: 0,
        timeout_ms: 0,
        range: 0,
        least_way: 0,
    };
}

/// Why homing has failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum HomingError {
    /// 0x6098 is no method that the drive knows.
    NoMethod,
    /// A speed of 0x6099 or the rate of 0x609A that the method needs allows no motion.
    NoSpeed,
    /// Both limit switches are active.
    BothLimits,
    /// The negative limit switch was met where it should not be.
    NegativeLimit,
    /// The positive limit switch was met where it should not be.
    PositiveLimit,
    /// No index pulse has come within a turn.
    NoIndex,
    /// Homing has lasted too long.
    TimedOut,
    /// The axis has gone too far from where it began.
    OutOfRange,
    /// A hard stop was met too near to where the axis began: something else is in the way.
    TooNear,
}

impl HomingError {
    /// 1 for the first of the list above, and so on.
    pub const fn number(self) -> u8 {
        match self {
            HomingError::NoMethod => 1,
            HomingError::NoSpeed => 2,
            HomingError::BothLimits => 3,
            HomingError::NegativeLimit => 4,
            HomingError::PositiveLimit => 5,
            HomingError::NoIndex => 6,
            HomingError::TimedOut => 7,
            HomingError::OutOfRange => 8,
            HomingError::TooNear => 9,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_methods_are_those_that_can_be_made() {
        let mut numbers = HomingMethod::ALL.into_iter();
        for number in i8::MIN..=i8::MAX {
            if let Some(method) = HomingMethod::new(number) {
                assert_eq!(method.number(), number);
                assert_eq!(numbers.next(), Some(number));
            }
        }
        assert_eq!(numbers.next(), None);
    }

    #[test]
    fn legs_turn_round_after_each_other() {
        for search in &SEARCHES {
            for from in [From::Off, From::On, From::Limit] {
                let legs = search.legs(from);
                assert!(legs.len() <= 2);
                if let [first, second] = legs {
                    assert_ne!(first.direction, second.direction);
                }
            }
            // Whatever the beginning, the last leg is the same.
            let last = search.off.last();
            assert_eq!(search.on.last(), last);
            assert!(search.limit.is_empty() || search.limit.last() == last);
        }
    }
}
