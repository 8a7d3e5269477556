//! What only this controller does: its numbers of modes and their units, motion with the state machine
//! switched off, open loop, and its commands and flags beside CiA 402.

use canopen::{Abort, Address, Field, Image, Table, Verdict, store};
use cia402::{Configuration, Demand, State, Targets, VlConfiguration};

use super::axis::{PER_RATE, PER_RPM, base};
use super::communication::VARIABLES;
use super::faults::{EMERGENCY_STOP, LOOP_ERROR};
use super::mode;
use crate::Personality;
use crate::own::{AxisView, Orders, OwnBehaviour};

/// Bits of the statusword that never change (R5, R19): 4, voltage, and 9, remote, are 1, 7, warning, 13
/// and the last two are 0.
const ALWAYS_SET: u16 = 1 << 4 | 1 << 9;
const ALWAYS_CLEAR: u16 = 1 << 7 | 0xE000;
const REACHED: u16 = 1 << 10;
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
/// Greatest speed command (R10), RPM.
const MAX_SPEED: i32 = 500_000;
/// A voltage of 1 in the demand's unit.
const FULL: f32 = 32_767.0;

/// A channel's objects.
#[derive(Clone, Copy, Debug)]
struct Fields {
    statusword: Field,
    target_vl: Field,
    min_vl: Field,
    max_vl: Field,
    up_vl: [Field; 2],
    down_vl: [Field; 2],
    mode: Field,
    mode_display: Field,
    position: Field,
    target_torque: Field,
    target_position: Field,
    profile_velocity: Field,
    acceleration: Field,
    deceleration: Field,
    target_velocity: Field,
    motor_command: Field,
    power: Field,
    speed: Field,
    counter: Field,
    relative_speed: Field,
    battery_amps: Field,
    feedback: Field,
    loop_error: Field,
    flags: Field,
    start_mode: Field,
    max_acceleration: Field,
    max_deceleration: Field,
    max_velocity: Field,
    fault_deceleration: Field,
    max_rpm: Field,
    current_limit: Field,
    low: Field,
    high: Field,
    detection: Field,
}

fn field(table: &Table, index: u16, sub: u8) -> Option<Field> {
    table.find(index, sub).ok().map(|entry| entry.field)
}

impl Fields {
    fn of(table: &Table, n: u8) -> Option<Fields> {
        let window = |offset, sub| field(table, base(n) + offset, sub);
        let own = |index| field(table, index, n + 1);
        Some(Fields {
            statusword: window(0x41, 0)?,
            target_vl: window(0x42, 0)?,
            min_vl: window(0x46, 1)?,
            max_vl: window(0x46, 2)?,
            up_vl: [window(0x48, 1)?, window(0x48, 2)?],
            down_vl: [window(0x49, 1)?, window(0x49, 2)?],
            mode: window(0x60, 0)?,
            mode_display: window(0x61, 0)?,
            position: window(0x64, 0)?,
            target_torque: window(0x71, 0)?,
            target_position: window(0x7A, 0)?,
            profile_velocity: window(0x81, 0)?,
            acceleration: window(0x83, 0)?,
            deceleration: window(0x84, 0)?,
            target_velocity: window(0xFF, 0)?,
            motor_command: own(0x2101)?,
            power: own(0x2102)?,
            speed: own(0x2103)?,
            counter: own(0x2104)?,
            relative_speed: own(0x2107)?,
            battery_amps: own(0x210C)?,
            feedback: own(0x2110)?,
            loop_error: own(0x2114)?,
            flags: own(0x2122)?,
            start_mode: own(0x3027)?,
            max_acceleration: own(0x3033)?,
            max_deceleration: own(0x3034)?,
            max_velocity: own(0x3035)?,
            fault_deceleration: own(0x30F0)?,
            max_rpm: own(0x3036)?,
            current_limit: own(0x302A)?,
            low: own(0x30F2)?,
            high: own(0x30F3)?,
            detection: own(0x3038)?,
        })
    }
}

/// One channel's state.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    fields: Option<Fields>,
    started: bool,
    /// The state machine was active at the last tick.
    had_machine: bool,
    /// As in 0x6060.
    number: i8,
    /// The controlword as last written, or as given with the state machine off.
    word: u16,
    /// G, −1000 to 1000.
    command: i16,
    /// The command behind its ramp.
    level: f32,
    /// Set-points, speed and rates that came by commands and are not in their objects yet.
    position: Option<i32>,
    speed: Option<i32>,
    torque: Option<i16>,
    rates: [Option<u32>; 2],
    /// A set-point is to be handed over: 2, then 1, is what is left to do.
    set_point: u8,
    demand: Option<Demand>,
    /// The mode was changed, and no target has come since (R18).
    mode_changed: bool,
    /// The target that was handed over last, and for how long it still counts as reached because it was
    /// the one before (R18), ms.
    last_target: Option<i32>,
    still_reached_ms: u8,
    retry_ms: u16,
    /// How long the loop error has been beyond its limit, ms.
    error_ms: u16,
    has_loop_error: bool,
}

/// The controller's own behaviour.
#[derive(Clone, Debug)]
pub struct Roboteq {
    machine: Option<Field>,
    limits: [Option<Field>; 3],
    status_flags: Option<Field>,
    fault_flags: Option<Field>,
    processor_temperature: Option<Field>,
    /// User variables, as written and as read.
    variables: [Option<(Field, Field)>; VARIABLES as usize],
    channels: [Channel; 3],
    stopped: bool,
    /// Fault flags of each channel.
    faults: [u16; 3],
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

/// To the nearest whole number.
fn round(value: f32) -> i64 {
    (if value < 0.0 {
        value - 0.5
    } else {
        value + 0.5
    }) as i64
}

impl Fields {
    /// Counts of a position of −1000 to 1000.
    fn to_counts(self, image: &Image<'_>, relative: i32) -> i32 {
        let (low, high) = (image.number(self.low), image.number(self.high));
        let part = i64::from(relative.clamp(-1000, 1000)) + 1000;
        let counts = (high - low).saturating_mul(part) / 2000 + low;
        counts.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    }

    /// A position as −1000 to 1000; beyond the limits it is cut.
    fn to_relative(self, image: &Image<'_>, counts: i32) -> i64 {
        let (low, high) = (image.number(self.low), image.number(self.high));
        let range = high - low;
        if range == 0 {
            return 0;
        }
        let from_low = (i64::from(counts) - low).saturating_mul(4000) / range;
        ((from_low + 1).div_euclid(2) - 1000).clamp(-1000, 1000)
    }
}

impl Channel {
    fn is_relative(&self) -> bool {
        matches!(self.number, -1 | -2)
    }

    /// A command of −1000 to 1000 (G) in the mode that is chosen.
    fn take_command(&mut self, image: &Image<'_>, fields: &Fields, command: i16) {
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
    fn flush(&mut self, image: &mut Image<'_>, fields: &Fields, orders: &mut Orders) {
        if let Some(speed) = self.speed.take() {
            image.set_number(fields.target_velocity, i64::from(speed));
            // Held within its type (R10).
            image.set_number(fields.target_vl, i64::from(speed));
            orders.new_targets = true;
        }
        if let Some(position) = self.position.take() {
            image.set_number(fields.target_position, i64::from(position));
            orders.new_targets = true;
            self.set_point = 2;
        }
        if let Some(torque) = self.torque.take() {
            image.set_number(fields.target_torque, i64::from(torque));
            orders.new_targets = true;
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

    /// The first millisecond: what the configuration gives for a start.
    fn start(&mut self, image: &mut Image<'_>, fields: &Fields, orders: &mut Orders) {
        self.started = true;
        self.number = number_of(image.raw(fields.start_mode));
        image.set_number(fields.mode, i64::from(self.number));
        let (up, down) = (
            image.raw(fields.max_acceleration),
            image.raw(fields.max_deceleration),
        );
        for field in [fields.acceleration, fields.up_vl[0]] {
            image.set_raw(field, up);
        }
        for field in [fields.deceleration, fields.down_vl[0]] {
            image.set_raw(field, down);
        }
        let velocity = image.raw(fields.max_velocity);
        image.set_raw(fields.profile_velocity, velocity);
        orders.new_parameters = true;
        orders.mode = mode(self.number).map(|mode| mode.0);
    }

    /// What keeps the motor going with the state machine off (R24).
    fn run_by_itself(&mut self, view: &AxisView, orders: &mut Orders) {
        let runs = match self.number {
            2 | -4 => RUNS_RAMP,
            _ => RUNS,
        };
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
                    2 if self.word & NEW_SET_POINT == 0 || runs == RUNS_RAMP => {
                        self.set_point = 0;
                        match self.number {
                            1 | -1 => runs | NEW_SET_POINT,
                            _ => runs,
                        }
                    }
                    _ => runs,
                };
                if word != self.word {
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
    fn open_loop(
        &mut self,
        image: &Image<'_>,
        fields: &Fields,
        view: &AxisView,
        has_machine: bool,
        orders: &mut Orders,
    ) {
        if self.number != 0 || view.state != State::OperationEnabled {
            self.level = 0.0;
            if self.demand.take().is_some() {
                orders.new_demand = true;
            }
            return;
        }
        let halts = has_machine && self.word & HALT != 0;
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
        self.level += (target - self.level).clamp(-step, step);
        let demand = Demand::RotorVoltage {
            voltage_q: (self.level * (FULL / 1000.0)) as i16,
        };
        if self.demand != Some(demand) {
            self.demand = Some(demand);
            orders.new_demand = true;
        }
    }

    /// Closed loop error detection (^CLERD): 1 to 3 are 250, 500 and 1000 ms beyond 100, 250 and 500.
    fn watch_error(&mut self, image: &Image<'_>, fields: &Fields, view: &AxisView) {
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
        self.has_loop_error = is_beyond && self.error_ms > time_ms;
    }

    /// Speed as a share of MXRPM, position as a share of its range, of 1000 each. In count position the
    /// controller's own unit is the count.
    fn loop_error(&self, image: &Image<'_>, fields: &Fields, view: &AxisView) -> f32 {
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
}

impl Roboteq {
    fn has_machine(&self, image: &Image<'_>) -> bool {
        self.machine.is_some_and(|machine| image.raw(machine) != 0)
    }

    fn limit(&self, image: &Image<'_>, n: usize) -> f32 {
        let field = self.limits.get(n).copied().flatten();
        field.map_or(f32::MAX, |field| image.real(field))
    }

    /// FF, of what is there now.
    fn fault_flags(&self, image: &Image<'_>, view: &AxisView) -> u16 {
        let [over, under, hot] = [0, 1, 2].map(|n| self.limit(image, n));
        u16::from(view.amplifier_temperature_c > hot)
            | u16::from(view.bus_voltage_v * 10.0 > over) << 1
            | u16::from(view.bus_voltage_v * 10.0 < under) << 2
            | u16::from(view.overcurrent) << 3
            | u16::from(self.stopped) << 4
            | u16::from(!view.encoder_valid) << 5
    }

    /// A write to an object of a channel.
    fn write_channel(
        &mut self,
        image: &Image<'_>,
        object: Address,
        new: &[u8],
        view: &AxisView,
        orders: &mut Orders,
    ) -> Option<Verdict> {
        let has_machine = self.has_machine(image);
        let channel = self.channels.get_mut(usize::from(view.axis))?;
        let fields = channel.fields?;
        let number = signed(new);
        let offset = object.index.wrapping_sub(base(view.axis));
        match (offset, object.index) {
            (0x40, _) if !has_machine => Some(Verdict::Accept), // R24
            (0x40, _) => {
                channel.take_word(image, &fields, number as u16, view, orders);
                None
            }
            (0x60, _) => {
                let number = number as i8;
                let Some(mode) = mode(number) else {
                    return Some(Verdict::Refuse(Abort::INVALID_VALUE));
                };
                channel.mode_changed = number != channel.number || channel.mode_changed;
                channel.number = number;
                channel.last_target = None;
                channel.set_point = 0;
                orders.mode = Some(mode.0);
                Some(Verdict::Accept)
            }
            (0x7A, _) => {
                if channel.is_relative() && !(-1000..=1000).contains(&number) {
                    return Some(Verdict::Refuse(match number > 0 {
                        true => Abort::VALUE_TOO_HIGH,
                        false => Abort::VALUE_TOO_LOW,
                    }));
                }
                channel.mode_changed = false;
                channel.set_point = 2;
                Some(Verdict::Accept)
            }
            (0x42 | 0xFF, _) => {
                channel.mode_changed = false;
                let speed = number.clamp(-MAX_SPEED, MAX_SPEED);
                channel.speed = Some(speed);
                // What is cut, or shows in the other object too, follows with the next millisecond.
                Some(match speed == number {
                    true => Verdict::Accept,
                    false => Verdict::Done,
                })
            }
            (0x71, _) => {
                channel.mode_changed = false;
                Some(Verdict::Accept)
            }
            (_, 0x2000) => {
                channel.mode_changed = false;
                channel.take_command(image, &fields, number as i16);
                Some(Verdict::Accept)
            }
            (_, 0x2001) => {
                channel.mode_changed = false;
                channel.position = Some(number);
                Some(Verdict::Accept)
            }
            (_, 0x2002) => {
                channel.mode_changed = false;
                channel.speed = Some(number.clamp(-MAX_SPEED, MAX_SPEED));
                Some(Verdict::Accept)
            }
            (_, index @ (0x2006 | 0x2007)) => {
                let rate = number.clamp(0, MAX_SPEED) as u32;
                if let Some(place) = channel.rates.get_mut(usize::from(index - 0x2006)) {
                    *place = Some(rate);
                }
                Some(Verdict::Accept)
            }
            _ => None,
        }
    }
}

impl Channel {
    /// A controlword that the axis is about to get.
    fn take_word(
        &mut self,
        image: &Image<'_>,
        fields: &Fields,
        word: u16,
        view: &AxisView,
        orders: &mut Orders,
    ) {
        let before = core::mem::replace(&mut self.word, word);
        // Out of open loop at once: what follows is the axis's.
        if word & 0x8F != 0x0F && self.demand.take().is_some() {
            orders.new_demand = true;
        }
        if self.number == -2 && (word ^ before) & HALT != 0 {
            // Tracking has no ramp of its own; profile position has, and stays where it stops.
            let halts = word & HALT != 0;
            orders.mode = Some(if halts { 1 } else { -2 })
                .and_then(mode)
                .map(|mode| mode.0);
            orders.new_targets = !halts;
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
}

/// Little-endian, with its sign.
fn signed(bytes: &[u8]) -> i32 {
    let negative = bytes.last().is_some_and(|last| last & 0x80 != 0);
    let mut all = [if negative { 0xFF } else { 0 }; 4];
    for (place, byte) in all.iter_mut().zip(bytes) {
        *place = *byte;
    }
    i32::from_le_bytes(all)
}

impl OwnBehaviour for Roboteq {
    fn new(personality: &'static Personality, _: &Image<'_>) -> Roboteq {
        let table = personality.device.table;
        let channel = |n| Channel {
            fields: Fields::of(&table, n),
            ..Channel::default()
        };
        Roboteq {
            machine: field(&table, 0x30F1, 0),
            limits: [1, 2, 3].map(|sub| field(&table, 0x30F4, sub)),
            status_flags: field(&table, 0x2111, 0),
            fault_flags: field(&table, 0x2112, 0),
            processor_temperature: field(&table, 0x210F, 1),
            variables: core::array::from_fn(|n| {
                let sub = n as u8 + 1;
                field(&table, 0x2005, sub).zip(field(&table, 0x2106, sub))
            }),
            channels: [0, 1, 2].map(channel),
            stopped: false,
            faults: [0; 3],
        }
    }

    fn axis_of(&self, object: Address) -> u8 {
        match object.index {
            0x2000..=0x2004 | 0x2006 | 0x2007 => object.sub.saturating_sub(1),
            index => (index.saturating_sub(0x6000) / 0x800) as u8,
        }
    }

    fn write(
        &mut self,
        image: &Image<'_>,
        object: Address,
        new: &[u8],
        view: &AxisView,
        orders: &mut Orders,
    ) -> Option<Verdict> {
        match object.index {
            0x200C => {
                self.stopped = true;
                Some(Verdict::Accept)
            }
            0x200D => {
                self.stopped = false;
                Some(Verdict::Accept)
            }
            0x200E => {
                let n = new.first().copied().unwrap_or(0);
                let channel = n.checked_sub(1).map(usize::from);
                match channel.and_then(|n| self.channels.get_mut(n)) {
                    Some(channel) => {
                        channel.command = 0;
                        channel.speed = Some(0);
                        Some(Verdict::Accept)
                    }
                    None => Some(Verdict::Refuse(Abort::INVALID_VALUE)),
                }
            }
            0x2017 => {
                orders.store = Some(store::Request::All);
                Some(Verdict::Accept)
            }
            _ => self.write_channel(image, object, new, view, orders),
        }
    }

    fn tick(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        let has_machine = self.has_machine(image);
        let Some(channel) = self.channels.get_mut(usize::from(view.axis)) else {
            return;
        };
        let Some(fields) = channel.fields else { return };
        if !channel.started {
            channel.had_machine = has_machine;
            channel.start(image, &fields, orders);
        }
        if has_machine && !channel.had_machine {
            orders.enable = Some(false); // transitions 0 and 1
            channel.word = 0;
        }
        channel.had_machine = has_machine;
        channel.flush(image, &fields, orders);
        if !has_machine {
            channel.run_by_itself(view, orders);
        }
        channel.still_reached_ms = channel.still_reached_ms.saturating_sub(1);
        channel.open_loop(image, &fields, view, has_machine, orders);
        channel.watch_error(image, &fields, view);
        if has_machine {
            channel.set_point = 0;
        }
        let flags = self.fault_flags(image, view);
        if let Some(own) = self.faults.get_mut(usize::from(view.axis)) {
            *own = flags;
        }
    }

    fn targets(&self, axis: u8, image: &Image<'_>, targets: &mut Targets) {
        let Some(channel) = self.channels.get(usize::from(axis)) else {
            return;
        };
        let Some(fields) = channel.fields else { return };
        if channel.is_relative() {
            targets.position = fields.to_counts(image, targets.position);
        }
        // SPL: not slower and not faster than that, in both directions.
        let (least, most) = (image.raw(fields.min_vl), image.raw(fields.max_vl));
        let wanted = u32::from(targets.vl_velocity.unsigned_abs());
        if wanted != 0 {
            let size = wanted.max(least).min(most).min(i16::MAX as u32) as i16;
            targets.vl_velocity = match targets.vl_velocity < 0 {
                true => -size,
                false => size,
            };
        }
    }

    fn configuration(&self, axis: u8, image: &Image<'_>, configuration: &mut Configuration) {
        let fields = self.channels.get(usize::from(axis));
        let Some(fields) = fields.and_then(|channel| channel.fields) else {
            return;
        };
        // Halt and quick stop are on the fault deceleration (R16, R3).
        configuration.halt_option = 2;
        configuration.quick_stop_option = 2;
        // "0 = ramp bypassed".
        let rate = |rate: f32| {
            if rate > 0.0 {
                rate * PER_RATE
            } else {
                f32::INFINITY
            }
        };
        let vl = |[speed, time]: [Field; 2]| rate(image.real(speed) / image.real(time).max(1.0));
        configuration.vl = VlConfiguration {
            counts_per_s: PER_RPM,
            acceleration: vl(fields.up_vl),
            deceleration: vl(fields.down_vl),
            quick_stop_deceleration: rate(image.real(fields.fault_deceleration)),
        };
        configuration.acceleration = rate(image.real(fields.acceleration));
        configuration.deceleration = rate(image.real(fields.deceleration));
        configuration.quick_stop_deceleration = rate(image.real(fields.fault_deceleration));
    }

    fn integrates_velocity(&self, axis: u8) -> bool {
        let channel = self.channels.get(usize::from(axis));
        channel.is_some_and(|channel| matches!(channel.number, -3 | -4))
    }

    fn demand(&self, axis: u8) -> Option<&Demand> {
        self.channels.get(usize::from(axis))?.demand.as_ref()
    }

    fn axis_causes(&self, axis: u8) -> u32 {
        let channel = self.channels.get(usize::from(axis));
        let has_loop_error = channel.is_some_and(|channel| channel.has_loop_error);
        u32::from(self.stopped) << EMERGENCY_STOP | u32::from(has_loop_error) << LOOP_ERROR
    }

    fn publish(&self, image: &mut Image<'_>, view: &AxisView) {
        let has_machine = self.has_machine(image);
        let axis = usize::from(view.axis);
        let Some(channel) = self.channels.get(axis) else {
            return;
        };
        let Some(fields) = channel.fields else { return };
        let status = match has_machine {
            true => channel.statusword(image, &fields, view),
            false => 0, // R24
        };
        image.set_raw(fields.statusword, u32::from(status));
        image.set_number(fields.mode_display, i64::from(channel.number));
        let rpm = round(view.velocity / PER_RPM);
        let max_rpm = image.real(fields.max_rpm);
        let feedback = match channel.number {
            -1 | -2 => fields.to_relative(image, view.position),
            1 => i64::from(view.position),
            _ => rpm,
        };
        if channel.is_relative() {
            image.set_number(fields.position, feedback);
        }
        image.set_number(fields.feedback, feedback);
        image.set_number(fields.motor_command, i64::from(channel.command));
        image.set_number(fields.speed, rpm);
        image.set_number(fields.counter, i64::from(view.position));
        image.set_number(
            fields.relative_speed,
            round(view.velocity / PER_RPM * 1000.0 / max_rpm),
        );
        let volts = view.bus_voltage_v.max(1.0);
        let [voltage_d, voltage_q] = view.voltage_v;
        let [current_d, current_q] = view.current_a;
        // The longest vector is the supply's over √3.
        let power = voltage_q * 1.732_050_8 / volts;
        image.set_number(fields.power, round(power * 1000.0));
        let watts = 1.5 * (voltage_d * current_d + voltage_q * current_q);
        image.set_number(fields.battery_amps, round(watts / volts * 10.0));
        let error = channel.loop_error(image, &fields, view);
        image.set_number(fields.loop_error, round(error));
        let stands = view.velocity.abs() < 10.0 * PER_RPM;
        let flags = u32::from(view.current_limited)
            | u32::from(view.current_limited && stands) << 1
            | u32::from(channel.has_loop_error) << 2;
        image.set_raw(fields.flags, flags);
        let all = self.faults.iter().fold(0, |all, own| all | own);
        if let Some(field) = self.fault_flags {
            image.set_raw(field, u32::from(all));
        }
        if let Some(field) = self.status_flags {
            // A serial command is in force; the power stage is off.
            let off = view.voltage_v == [0.0; 2] && view.current_a == [0.0; 2];
            image.set_raw(field, 1 | u32::from(off) << 3);
        }
        if let Some(field) = self.processor_temperature {
            image.set_number(field, round(view.amplifier_temperature_c));
        }
        for (written, read) in self.variables.into_iter().flatten() {
            let value = image.raw(written);
            image.set_raw(read, value);
        }
    }
}

impl Channel {
    fn statusword(&self, image: &Image<'_>, fields: &Fields, view: &AxisView) -> u16 {
        let mut status = (view.statusword | ALWAYS_SET) & !ALWAYS_CLEAR;
        let runs = view.state == State::OperationEnabled;
        if !matches!(self.number, 1 | -1 | 3 | -3) {
            status &= !MODE_SPECIFIC;
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
        status
    }
}
