//! Switches along the way of the load, and the board's other inputs.

use control::Real as _;

use crate::Invalid;
use crate::load::MAX_TURNS;

/// A switch that the load presses while it is within a region of its way.
///
/// It closes at the region's edge and opens a hysteresis beyond it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switch {
    /// Where the region begins, turns; -∞: it has no begin.
    pub from_turns: f64,
    /// Where the region ends, turns; +∞: it has no end.
    pub to_turns: f64,
    /// How far outside the region the switch opens again, turns.
    pub hysteresis_turns: f64,
    /// The input is low while the switch is pressed (and a broken wire looks like a pressed switch).
    pub active_low: bool,
    /// How long the contact bounces after it has closed or opened, s. Meanwhile the level is one or
    /// the other, by a fixed sequence of chances.
    pub bounce_s: f64,
}

impl Switch {
    /// Pressed from a position to another, turns; no hysteresis, no bounce, active high.
    pub const fn between(from_turns: f64, to_turns: f64) -> Self {
        Self {
            from_turns,
            to_turns,
            hysteresis_turns: 0.0,
            active_low: false,
            bounce_s: 0.0,
        }
    }

    /// Pressed up to a position, turns, like a negative limit switch.
    pub const fn below(turns: f64) -> Self {
        Self::between(f64::NEG_INFINITY, turns)
    }

    /// Pressed from a position on, turns, like a positive limit switch.
    pub const fn above(turns: f64) -> Self {
        Self::between(turns, f64::INFINITY)
    }

    fn check(&self) -> Result<(), Invalid> {
        if self.from_turns > self.to_turns || self.from_turns.is_nan() || self.to_turns.is_nan() {
            return Err(Invalid::Switch(self.from_turns));
        }
        if !(0.0..=MAX_TURNS).contains(&self.hysteresis_turns) {
            return Err(Invalid::Switch(self.hysteresis_turns));
        }
        if !(0.0..=10.0).contains(&self.bounce_s) {
            return Err(Invalid::Switch(self.bounce_s));
        }
        Ok(())
    }
}

/// The switches that are connected; `None`: nothing is, and [`crate::Plant::set_inputs`] says the
/// level.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Switches {
    /// Bit 0 of the inputs.
    pub negative_limit: Option<Switch>,
    /// Bit 1 of the inputs.
    pub positive_limit: Option<Switch>,
    /// Bit 2 of the inputs.
    pub home: Option<Switch>,
}

impl Switches {
    /// No switch.
    pub const NONE: Switches = Switches {
        negative_limit: None,
        positive_limit: None,
        home: None,
    };

    pub(crate) fn check(&self) -> Result<(), Invalid> {
        let connected = [self.negative_limit, self.positive_limit, self.home];
        let mut connected = connected.iter().flatten();
        connected.try_for_each(Switch::check)
    }
}

/// One of the [`Switches`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SwitchName {
    /// The switch at the negative end.
    NegativeLimit,
    /// The switch at the positive end.
    PositiveLimit,
    /// The home switch.
    Home,
}

/// A position, 2³² per turn.
type Way = i64;

/// A [`Switch`] and what has become of it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Contact {
    from: Way,
    to: Way,
    hysteresis: Way,
    active_low: bool,
    bounce_s: f64,
    bounce_periods: u32,
    /// Pressed or held by someone, whatever the shaft does.
    held: Option<bool>,
    pressed: bool,
    changed_at: u32,
    bouncing: bool,
}

impl Contact {
    fn new(switch: &Switch, period_s: f64) -> Self {
        // Casts saturate, so an infinite end is never reached.
        let way = |turns: f64| (turns * 4_294_967_296.0) as Way;
        Self {
            from: way(switch.from_turns),
            to: way(switch.to_turns),
            hysteresis: way(switch.hysteresis_turns),
            active_low: switch.active_low,
            bounce_s: switch.bounce_s,
            bounce_periods: (switch.bounce_s / period_s) as u32,
            held: None,
            pressed: false,
            changed_at: 0,
            bouncing: false,
        }
    }

    /// A period takes so long from now on, `periods` after the beginning, and took `before_s`. A
    /// contact that bounces does so for the time that was left.
    fn set_period_s(&mut self, before_s: f64, period_s: f64, periods: u32) {
        self.bounce_periods = (self.bounce_s / period_s) as u32;
        if self.bouncing {
            let since = f64::from(periods.wrapping_sub(self.changed_at)) * (before_s / period_s);
            self.changed_at = periods.wrapping_sub(since as u32);
        }
    }

    /// What the input reads with the load at `way`, after so many periods.
    fn level(&mut self, way: Way, periods: u32) -> bool {
        let slack = if self.pressed { self.hysteresis } else { 0 };
        let inside = self.from.saturating_sub(slack) <= way && way <= self.to.saturating_add(slack);
        let pressed = self.held.unwrap_or(inside);
        if pressed != self.pressed {
            self.pressed = pressed;
            self.changed_at = periods;
            self.bouncing = self.bounce_periods > 0;
        }
        let since = periods.wrapping_sub(self.changed_at);
        self.bouncing &= since < self.bounce_periods;
        let touching = if self.bouncing {
            chance(periods ^ self.changed_at.rotate_left(16))
        } else {
            pressed
        };
        touching != self.active_low
    }
}

/// A bit that nobody can guess from its neighbours (a multiplicative hash).
fn chance(number: u32) -> bool {
    let mut bits = number.wrapping_mul(0x9E37_79B1);
    bits ^= bits >> 15;
    bits.wrapping_mul(0x85EB_CA77) >> 31 != 0
}

/// What is connected to the board beside motor and encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Board {
    contacts: [Option<Contact>; 3],
    inputs: u32,
    auxiliary_adc: [f32; 2],
    torque_off: bool,
}

impl Board {
    /// With `switches`, the load being at `way`; all other inputs low.
    pub(crate) fn new(switches: &Switches, way: Way, period_s: f64) -> Self {
        let connected = [
            switches.negative_limit,
            switches.positive_limit,
            switches.home,
        ];
        let contacts = connected.map(|switch| {
            let mut contact = Contact::new(switch.as_ref()?, period_s);
            // It has been there for long.
            contact.level(way, 0);
            contact.bouncing = false;
            Some(contact)
        });
        Self {
            contacts,
            inputs: 0,
            auxiliary_adc: [0.0; 2],
            torque_off: false,
        }
    }

    /// A PWM period takes so long from now on, s, `periods` after the beginning, and took `before_s`.
    pub(crate) fn set_period_s(&mut self, before_s: f64, period_s: f64, periods: u32) {
        for contact in self.contacts.iter_mut().flatten() {
            contact.set_period_s(before_s, period_s, periods);
        }
    }

    /// Levels of the inputs with the load at `way`, after so many periods.
    pub(crate) fn inputs(&mut self, way: Way, periods: u32) -> u32 {
        let mut inputs = self.inputs;
        for (bit, contact) in self.contacts.iter_mut().enumerate() {
            if let Some(contact) = contact {
                let level = u32::from(contact.level(way, periods));
                inputs = inputs & !(1 << bit) | level << bit;
            }
        }
        inputs
    }

    /// The switches that were pressed when the inputs were last read: bits 0 to 2.
    pub(crate) fn pressed(&self) -> u32 {
        let mut bits = 0;
        for (bit, contact) in self.contacts.iter().enumerate() {
            bits |= u32::from(contact.is_some_and(|contact| contact.pressed)) << bit;
        }
        bits
    }

    pub(crate) fn hold(&mut self, name: SwitchName, held: Option<bool>) {
        let [negative, positive, home] = &mut self.contacts;
        let contact = match name {
            SwitchName::NegativeLimit => negative,
            SwitchName::PositiveLimit => positive,
            SwitchName::Home => home,
        };
        if let Some(contact) = contact {
            contact.held = held;
        }
    }

    pub(crate) fn set_inputs(&mut self, levels: u32) {
        self.inputs = levels;
    }

    pub(crate) fn set_auxiliary_v(&mut self, volts: [f32; 2]) {
        let counts = |volts: f32| volts.greatest(0.0).least(3.3) * (4095.0 / 3.3);
        self.auxiliary_adc = volts.map(|volts| (counts(volts) + 0.5) as u16 as f32);
    }

    pub(crate) fn auxiliary_adc(&self) -> [f32; 2] {
        self.auxiliary_adc
    }

    pub(crate) fn set_torque_off(&mut self, asked: bool) {
        self.torque_off = asked;
    }

    pub(crate) fn torque_off(&self) -> bool {
        self.torque_off
    }
}
