//! What only this controller does: its numbers of modes and their units, motion with the state machine
//! switched off, open loop, and its commands and flags beside CiA 402.

mod channel;
mod fields;
mod watchdog;

use canopen::{Abort, Address, Field, Image, Verdict, store};
use cia402::{Configuration, Demand, Targets, VlConfiguration};

use self::channel::{Channel, at_limit, stands};
use self::fields::{Fields, field};
use self::watchdog::Watchdog;
use super::axis::{PER_RATE, PER_RPM, base};
use super::communication::VARIABLES;
use super::faults::{EMERGENCY_STOP, LOOP_ERROR};
use super::mode;
use crate::Personality;
use crate::own::{AxisView, Orders, OwnBehaviour};

/// Greatest speed command (R10), RPM.
const MAX_SPEED: i32 = 500_000;

/// To the nearest whole number.
fn round(value: f32) -> i64 {
    (if value < 0.0 {
        value - 0.5
    } else {
        value + 0.5
    }) as i64
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
    watchdog: Watchdog,
    /// Fault flags of each channel.
    faults: [u16; 3],
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
        channel.is_stopped = false;
        if !channel.started {
            channel.given |= Channel::given_by(offset, object.sub);
        }
        match (offset, object.index) {
            // R24.
            (0x40, _) if !has_machine => Some(Verdict::Accept),
            (0x40, _) => {
                if !channel.had_machine {
                    channel.begin_machine(orders);
                }
                channel.asked = number as u16;
                channel.is_out = false;
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
                channel.halts_by_speed = false;
                channel.still_reached_ms = 0;
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
                channel.still_reached_ms = 0;
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
            (0x46 | 0x48 | 0x49 | 0x81 | 0x83 | 0x84 | 0x87, _) => Some(Verdict::Accept),
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
            watchdog: Watchdog::of(&table),
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
        let verdict = match object.index {
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
                let channel = channel.and_then(|n| self.channels.get_mut(n));
                // Of one to three, those that it has.
                match channel.filter(|channel| channel.fields.is_some()) {
                    Some(channel) => {
                        channel.is_stopped = true;
                        channel.command = 0;
                        channel.speed = Some(0);
                        channel.torque = Some(0);
                        Some(Verdict::Accept)
                    }
                    None => Some(Verdict::Refuse(Abort::INVALID_VALUE)),
                }
            }
            0x2005 => Some(Verdict::Accept),
            0x2017 => {
                orders.store = Some(store::Request::All);
                Some(Verdict::Accept)
            }
            0x30F1 => {
                if new.first() == Some(&1) && !self.has_machine(image) {
                    for channel in &mut self.channels {
                        channel.had_machine = false;
                    }
                }
                return Some(Verdict::Accept);
            }
            0x1010 | 0x1011 => return None,
            _ => self.write_channel(image, object, new, view, orders),
        };
        if !matches!(verdict, Some(Verdict::Refuse(_))) {
            self.watchdog.feed();
        }
        verdict
    }

    fn tick(&mut self, image: &mut Image<'_>, view: &AxisView, orders: &mut Orders) {
        let has_machine = self.has_machine(image);
        if view.axis == 0 {
            self.watchdog.tick(image);
        }
        let is_out = self.watchdog.is_out();
        let Some(channel) = self.channels.get_mut(usize::from(view.axis)) else {
            return;
        };
        let Some(fields) = channel.fields else { return };
        if !channel.started {
            channel.had_machine = has_machine;
            channel.start(image, &fields, orders);
        }
        if has_machine && !channel.had_machine {
            // What was seen of the axis is over: it is switched off now.
            channel.begin_machine(orders);
            return;
        }
        channel.had_machine = has_machine;
        if core::mem::take(&mut channel.takes_up) && channel.lacks_ramp() {
            orders.mode = mode(3).map(|mode| mode.0);
        }
        let is_out = is_out || channel.is_stopped;
        channel.follow_watchdog(image, &fields, is_out, view, orders);
        channel.flush(image, &fields, orders);
        if !has_machine {
            channel.run_by_itself(view, orders);
        }
        channel.still_reached_ms = channel.still_reached_ms.saturating_sub(1);
        channel.open_loop(image, &fields, view, orders);
        channel.watch_error(image, &fields, view, orders);
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
        let Some(channel) = self.channels.get(usize::from(axis)) else {
            return;
        };
        let Some(fields) = channel.fields else { return };
        // Halt, quick stop and faults are on the fault deceleration (R16, R3, R29). A motor that does not
        // follow is let go.
        configuration.halt_option = 2;
        configuration.quick_stop_option = 2;
        configuration.fault_reaction_option = if channel.has_loop_error { 0 } else { 2 };
        // "0 = ramp bypassed".
        let rate = |rate: f32| {
            if rate > 0.0 {
                rate * PER_RATE
            } else {
                f32::INFINITY
            }
        };
        let vl =
            |[speed, time]: [Field; 2]| rate(image.real(speed) / image.number(time).max(1) as f32);
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
        let volts = if view.bus_voltage_v > 1.0 {
            view.bus_voltage_v
        } else {
            1.0
        };
        let [voltage_d, voltage_q] = view.voltage_v;
        let [current_d, current_q] = view.current_a;
        // The longest vector is the supply's over √3.
        let power = voltage_q * 1.732_050_8 / volts;
        image.set_number(fields.power, round(power * 1000.0));
        let watts = 1.5 * (voltage_d * current_d + voltage_q * current_q);
        image.set_number(fields.battery_amps, round(watts / volts * 10.0));
        let error = channel.loop_error(image, &fields, view);
        image.set_number(fields.loop_error, round(error));
        let limited = at_limit(image, &fields, view);
        let flags = u32::from(limited)
            | u32::from(limited && stands(view)) << 1
            | u32::from(channel.has_loop_error) << 2;
        image.set_raw(fields.flags, flags);
        let all = self.faults.iter().fold(0, |all, own| all | own);
        if let Some(field) = self.fault_flags {
            image.set_raw(field, u32::from(all));
        }
        if let Some(field) = self.status_flags {
            // A command is in force, whose kind is called serial; the power stage is off.
            let off = view.voltage_v == [0.0; 2] && view.current_a == [0.0; 2];
            let commanded = !self.watchdog.is_out();
            image.set_raw(field, u32::from(commanded) | u32::from(off) << 3);
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
