//! One channel: what it does by itself, in open loop, and what it shows.

use canopen::Image;
use cia402::{Demand, State};

use super::fields::Fields;
use crate::own::{AxisView, Orders};
use crate::roboteq::axis::{PER_RPM, PER_TENTH_AMPERE};
use crate::roboteq::mode;

/// Bits of the statusword that never change (R5, R19): 4, voltage, and 9, remote, are 1, 7, warning, 13
/// and the last two are 0.
const ALWAYS_SET: u16 = 1 << 4 | 1 << 9;
const ALWAYS_CLEAR: u16 = 1 << 7 | 0xE000;
const SWITCH_ON_DISABLED: u16 = 1 << 6;
const REACHED: u16 = 1 << 10;
const INTERNAL_LIMIT: u16 = 1 << 11;
const MODE_SPECIFIC: u16 = 1 << 12;
/// Bits of the controlword.
const NEW_SET_POINT: u16 = 1 << 4;
const RELATIVE: u16 = 1 << 6;
const RESET: u16 = 1 << 7;
const HALT: u16 = 1 << 8;
/// With the state machine off: enabled, set-points at once, ramps open.
const RUNS: u16 = 0x2F;
const RUNS_RAMP: u16 = 0x7F;
/// How often a fault is reset by itself with the state machine off, ms.
const RETRY_MS: u16 = 1000;
/// How far a tracked position may be off and count as reached, counts.
const TRACKED: i32 = 20;
/// A voltage of 1 in the demand's unit.
const FULL: f32 = 32_767.0;

/// One channel's state.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Channel {
    pub(super) fields: Option<Fields>,
    pub(super) started: bool,
    /// The state machine was active at the last tick.
    pub(super) had_machine: bool,
    /// As in 0x6060.
    pub(super) number: i8,
    /// What was written before the first millisecond, so that it does not begin as configured.
    pub(super) given: u8,
    /// The controlword that the axis has: as last written, or as given with the state machine off; with
    /// a halt while the watchdog of commands is out.
    pub(super) word: u16,
    /// The controlword as last written.
    pub(super) asked: u16,
    /// MS has stopped it, until it is commanded again.
    pub(super) is_stopped: bool,
    /// It rests for the sake of that or of the watchdog of commands, and whether the target was reached when that began.
    pub(super) is_out: bool,
    pub(super) was_reached: bool,
    /// G, −1000 to 1000.
    pub(super) command: i16,
    /// The command behind its ramp.
    pub(super) level: f32,
    /// Set-points, speed and rates that came by commands and are not in their objects yet.
    pub(super) position: Option<i32>,
    pub(super) speed: Option<i32>,
    pub(super) torque: Option<i16>,
    pub(super) rates: [Option<u32>; 2],
    /// A set-point is to be handed over: 2, then 1, is what is left to do.
    pub(super) set_point: u8,
    /// A halt has taken tracking or torque from its target.
    pub(super) halts_by_speed: bool,
    /// A halt of tracking or torque has let the motor go: it is to be braked from its own speed.
    pub(super) takes_up: bool,
    pub(super) demand: Option<Demand>,
    /// The mode was changed, and no target has come since (R18).
    pub(super) mode_changed: bool,
    /// The target that was handed over last, and for how long it still counts as reached because it was
    /// the one before (R18), ms.
    pub(super) last_target: Option<i32>,
    pub(super) still_reached_ms: u8,
    pub(super) retry_ms: u16,
    /// How long the loop error has been beyond its limit, ms.
    pub(super) error_ms: u16,
    pub(super) has_loop_error: bool,
}

/// From mode of MMOD to the number of table 1: open loop, speed, position relative, count position,
/// position tracking, torque, speed position.
fn number_of(start_mode: u32) -> i8 {
    match start_mode {
        1 => 3,
        2 => -1,
        3 => 1,
        4 => -2,
        5 => 4,
        6 => -3,
        _ => 0,
    }
}

/// The limit of the current (^ALIM) is reached: the demand is what it leaves, and the current is there. A
/// motor that gets no more current because the voltage is used up has not reached it.
pub(super) fn at_limit(image: &Image<'_>, fields: &Fields, view: &AxisView) -> bool {
    let limit = image.real(fields.current_limit); // 0.1 A
    let demanded =
        view.current_limited || view.torque_demand_pm.abs() >= 0.995 * limit * PER_TENTH_AMPERE;
    let [d, q] = view.current_a;
    let nearly = 0.09 * limit;
    demanded && d * d + q * q >= nearly * nearly
}

/// Slower than 10 RPM.
pub(super) fn stands(view: &AxisView) -> bool {
    view.velocity.abs() < 10.0 * PER_RPM
}

impl Channel {
    pub(super) fn is_relative(&self) -> bool {
        matches!(self.number, -1 | -2)
    }

    /// Its mode has no ramp of speed to come to rest on.
    pub(super) fn lacks_ramp(&self) -> bool {
        matches!(self.number, -2 | 4)
    }

    /// A command of −1000 to 1000 (G) in the mode that is chosen.
    pub(super) fn take_command(&mut self, image: &Image<'_>, fields: &Fields, command: i16) {
        self.command = command;
        let part = i64::from(command);
        match self.number {
            2 | 3 | -3 | -4 => {
                self.speed = Some((image.number(fields.max_rpm) * part / 1000) as i32);
            }
            -1 | -2 => self.position = Some(i32::from(command)),
            4 => {
                self.torque = Some((image.number(fields.current_limit) * part / 1000) as i16);
            }
            _ => {}
        }
    }

    /// Puts what has come by commands into the objects.
    pub(super) fn flush(&mut self, image: &mut Image<'_>, fields: &Fields, orders: &mut Orders) {
        if let Some(speed) = self.speed.take() {
            image.set_number(fields.target_velocity, i64::from(speed));
            // Held within its type (R10).
            image.set_number(fields.target_vl, i64::from(speed));
            // The mode in force is told of its own target only: others may be old.
            orders.new_targets |= matches!(self.number, 2 | 3 | -3 | -4);
        }
        if let Some(position) = self.position.take() {
            image.set_number(fields.target_position, i64::from(position));
            orders.new_targets |= matches!(self.number, 1 | -1 | -2);
            self.set_point = 2;
        }
        if let Some(torque) = self.torque.take() {
            image.set_number(fields.target_torque, i64::from(torque));
            orders.new_targets |= self.number == 4;
        }
        for (rate, field) in self
            .rates
            .iter_mut()
            .zip([fields.acceleration, fields.deceleration])
        {
            if let Some(rate) = rate.take() {
                image.set_raw(field, rate);
                orders.new_parameters = true;
            }
        }
    }

    /// Which of what the first millisecond sets an object is, a bit each.
    pub(super) fn given_by(offset: u16, sub: u8) -> u8 {
        match (offset, sub) {
            (0x60, _) => 1,
            (0x83, _) => 2,
            (0x48, 1) => 4,
            (0x84, _) => 8,
            (0x49, 1) => 16,
            (0x81, _) => 32,
            _ => 0,
        }
    }

    /// The first millisecond: what the configuration gives for a start, but for what was written already.
    pub(super) fn start(&mut self, image: &mut Image<'_>, fields: &Fields, orders: &mut Orders) {
        self.started = true;
        if self.given & 1 == 0 {
            self.number = number_of(image.raw(fields.start_mode));
            image.set_number(fields.mode, i64::from(self.number));
            orders.mode = mode(self.number).map(|mode| mode.0);
        }
        let defaults = [
            (2, fields.acceleration, fields.max_acceleration),
            (4, fields.up_vl[0], fields.max_acceleration),
            (8, fields.deceleration, fields.max_deceleration),
            (16, fields.down_vl[0], fields.max_deceleration),
            (32, fields.profile_velocity, fields.max_velocity),
        ];
        for (bit, field, default) in defaults {
            if self.given & bit == 0 {
                let value = image.raw(default);
                image.set_raw(field, value);
            }
        }
        orders.new_parameters = true;
    }

    /// Transitions 0 and 1: what runs by itself ends. What comes then is the master's.
    pub(super) fn begin_machine(&mut self, orders: &mut Orders) {
        self.had_machine = true;
        self.word = 0;
        self.asked = 0;
        orders.enable = Some(false);
        if self.demand.take().is_some() {
            orders.new_demand = true;
        }
    }

    /// Halts what moves when the watchdog of commands is out, and lets it go on with the next command.
    pub(super) fn follow_watchdog(
        &mut self,
        image: &Image<'_>,
        fields: &Fields,
        is_out: bool,
        view: &AxisView,
        orders: &mut Orders,
    ) {
        if self.is_out == is_out {
            return;
        }
        self.was_reached = self.statusword(image, fields, view) & REACHED != 0;
        self.is_out = is_out;
        if self.had_machine && view.state == State::OperationEnabled {
            let word = self.asked | if is_out { HALT } else { 0 };
            self.take_word(image, fields, word, view, orders);
            orders.controlword = Some(word);
        }
    }

    /// Whether the motor is where its target wants it although it rests for the watchdog's sake.
    fn wants_rest(&self, image: &Image<'_>, fields: &Fields) -> bool {
        match self.number {
            0 => self.command == 0,
            2 | -4 => image.number(fields.target_vl) == 0,
            3 | -3 => image.number(fields.target_velocity) == 0,
            4 => image.number(fields.target_torque) == 0,
            _ => self.was_reached,
        }
    }

    /// What keeps the motor going with the state machine off (R24).
    pub(super) fn run_by_itself(&mut self, view: &AxisView, orders: &mut Orders) {
        let runs = match self.number {
            2 | -4 => RUNS_RAMP,
            _ => RUNS,
        } | if self.is_out { HALT } else { 0 };
        match view.state {
            State::Fault => {
                // The edge, and its end.
                self.retry_ms = self.retry_ms.saturating_add(1);
                if self.retry_ms >= RETRY_MS {
                    self.retry_ms = 0;
                    orders.controlword = Some(RESET);
                } else if self.retry_ms == 1 {
                    orders.controlword = Some(0);
                }
                self.word = 0;
            }
            State::FaultReactionActive | State::QuickStopActive => {}
            State::OperationEnabled => {
                let word = match self.set_point {
                    2 if self.word & NEW_SET_POINT == 0 || runs & !HALT == RUNS_RAMP => {
                        self.set_point = 0;
                        match self.number {
                            1 | -1 => runs | NEW_SET_POINT,
                            _ => runs,
                        }
                    }
                    _ => runs,
                };
                if word != self.word {
                    self.halt_by_speed(word, orders);
                    self.word = word;
                    orders.controlword = Some(word);
                }
            }
            _ => {
                self.retry_ms = 0;
                self.word = 0x0F;
                orders.enable = Some(true);
            }
        }
    }

    /// Mode 0: the command is a share of the voltage.
    pub(super) fn open_loop(
        &mut self,
        image: &Image<'_>,
        fields: &Fields,
        view: &AxisView,
        orders: &mut Orders,
    ) {
        if self.number != 0 || view.state != State::OperationEnabled {
            self.level = 0.0;
            if self.demand.take().is_some() {
                orders.new_demand = true;
            }
            return;
        }
        let halts = self.word & HALT != 0;
        let target = if halts { 0.0 } else { f32::from(self.command) };
        let slows = target.abs() < self.level.abs() || target * self.level < 0.0;
        let rate = match (halts, slows) {
            (true, _) => fields.fault_deceleration,
            (_, true) => fields.deceleration,
            _ => fields.acceleration,
        };
        // 0.1 RPM/s of MXRPM RPM: the command's share per millisecond. 0: at once.
        let rate = image.real(rate) * 0.1 / image.real(fields.max_rpm);
        let step = if rate > 0.0 { rate } else { f32::MAX };
        let way = target - self.level;
        self.level = if way > step {
            self.level + step
        } else if way < -step {
            self.level - step
        } else {
            target
        };
        let demand = Demand::RotorVoltage {
            voltage_q: (self.level * (FULL / 1000.0)) as i16,
        };
        if self.demand != Some(demand) {
            self.demand = Some(demand);
            orders.new_demand = true;
        }
    }

    /// Closed loop error detection (^CLERD): 1 to 3 are 250, 500 and 1000 ms beyond 100, 250 and 500.
    /// It shuts the motor down.
    pub(super) fn watch_error(
        &mut self,
        image: &Image<'_>,
        fields: &Fields,
        view: &AxisView,
        orders: &mut Orders,
    ) {
        let (time_ms, limit) = match image.raw(fields.detection) {
            1 => (250, 100.0),
            2 => (500, 250.0),
            3 => (1000, 500.0),
            _ => (0, f32::MAX),
        };
        let error = self.loop_error(image, fields, view);
        let is_beyond = view.state == State::OperationEnabled && error.abs() > limit;
        self.error_ms = match is_beyond {
            true => self.error_ms.saturating_add(1),
            false => 0,
        };
        let had_loop_error = self.has_loop_error;
        self.has_loop_error = is_beyond && self.error_ms > time_ms;
        // The reaction to it is another one.
        orders.new_parameters |= self.has_loop_error != had_loop_error;
    }

    /// Speed as a share of MXRPM, position as a share of its range, of 1000 each. In count position the
    /// controller's own unit is the count.
    pub(super) fn loop_error(&self, image: &Image<'_>, fields: &Fields, view: &AxisView) -> f32 {
        let counts = view.position_demand.wrapping_sub(view.position) as f32;
        match self.number {
            2 | 3 => {
                let rpm = (view.velocity_demand - view.velocity) / PER_RPM;
                rpm * 1000.0 / image.real(fields.max_rpm)
            }
            1 | -3 | -4 => counts,
            -1 | -2 => {
                let range = image.real(fields.high) - image.real(fields.low);
                if range == 0.0 {
                    0.0
                } else {
                    counts * 2000.0 / range
                }
            }
            _ => 0.0,
        }
    }

    /// Before another controlword: table 7 stops every mode on EDEC. Tracking has no ramp of its own, its
    /// demand is at the target already, and that of torque is not one of speed. With a halt the motor is
    /// let go and taken up where it is, by a mode that has one.
    fn halt_by_speed(&mut self, word: u16, orders: &mut Orders) {
        if self.lacks_ramp() && (word ^ self.word) & HALT != 0 {
            let halts = word & HALT != 0;
            orders.mode = mode(if halts { 0 } else { self.number }).map(|mode| mode.0);
            orders.new_targets = self.halts_by_speed && !halts;
            self.halts_by_speed = halts;
            self.takes_up = halts;
        }
    }

    /// A controlword that the axis is about to get.
    pub(super) fn take_word(
        &mut self,
        image: &Image<'_>,
        fields: &Fields,
        word: u16,
        view: &AxisView,
        orders: &mut Orders,
    ) {
        self.halt_by_speed(word, orders);
        let before = core::mem::replace(&mut self.word, word);
        // Out of open loop at once: what follows is the axis's.
        if word & 0x8F != 0x0F && self.demand.take().is_some() {
            orders.new_demand = true;
        }
        let edge = word & !before & NEW_SET_POINT != 0;
        if matches!(self.number, 1 | -1) && edge && word & RELATIVE == 0 {
            let target = image.number(fields.target_position) as i32;
            let same = self.last_target.replace(target) == Some(target);
            if same && view.statusword & REACHED != 0 {
                self.still_reached_ms = 50;
            }
        }
    }

    pub(super) fn statusword(&self, image: &Image<'_>, fields: &Fields, view: &AxisView) -> u16 {
        if !self.had_machine && !view.has_fault {
            return ALWAYS_SET | SWITCH_ON_DISABLED; // transitions 0 and 1 need no time
        }
        let mut status = (view.statusword | ALWAYS_SET) & !ALWAYS_CLEAR;
        let runs = view.state == State::OperationEnabled;
        if !matches!(self.number, 1 | -1 | 3 | -3) {
            status &= !MODE_SPECIFIC;
        }
        // The limit of the current, and no other.
        status &= !INTERNAL_LIMIT;
        if at_limit(image, fields, view) {
            status |= INTERNAL_LIMIT;
        }
        // Table 15: the axis does not know of a halt in open loop.
        if runs && self.number == 0 && self.word & HALT != 0 && stands(view) {
            status |= REACHED;
        }
        let tracks = runs && self.number == -2 && self.word & HALT == 0;
        if tracks {
            let target = image.number(fields.target_position) as i32;
            let off = fields.to_counts(image, target).wrapping_sub(view.position);
            if off.unsigned_abs() <= TRACKED.unsigned_abs() {
                status |= REACHED;
            }
        }
        if runs && (self.mode_changed || self.still_reached_ms > 0) {
            status |= REACHED;
        }
        if runs && self.is_out && !self.wants_rest(image, fields) {
            status &= !REACHED;
        }
        status
    }
}
