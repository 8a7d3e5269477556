//! The whole control period: sensors, estimators, three loops, limits, modulation.

use crate::current::CurrentLoop;
use crate::i2t::I2tSum;
use crate::io::{Duty, Sample};
use crate::motion::{MotionInput, MotionLoops};
use crate::parameters::{Constants, Parameters};
use crate::segment::Segment;
use crate::transform::{Rotation, Rotor, clarke};
use crate::velocity::Tracker;
use crate::{Command, Feedback, FrameSource, Limits, Mask as _, Real, modulation};

/// The supply is taken for at least this, V: it is divided by.
const LEAST_BUS_V: f32 = 1.0;

/// The controllers of one drive (or of a batch, one per lane): from sample to duty.
///
/// [`period`](Self::period) runs once per control period. It has no branch on values, but for
/// shortcuts that change no bit, and one division: by the supply voltage (a given voltage costs a
/// second one). For one `f32` drive that is 886 instructions on x86-64 (callgrind), with the voltage
/// far from its limit, and on a Cortex-M4F 1,289 as compiled, a ninth of them the `it` of selections.
/// Numbers that are not, in a sample, a parameter or a command, leave every duty within 0 and 1 and no
/// trace in the state once they have gone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cascade<R: Real> {
    constants: Constants<R>,
    command: Command<R>,
    segment: Segment<R>,
    tracker: Tracker<R>,
    motion: MotionLoops<R>,
    current: CurrentLoop<R>,
    i2t: I2tSum<R>,
    /// The bridge was on in the last period.
    was_enabled: R::Mask,
    voltage_limited: R::Mask,
    /// Part of a given voltage that is applied, so that its current stays within the limit.
    given_part: R,
    /// A short circuit has opened the bridge; until the command switches it off.
    tripped: R::Mask,
    encoder_valid: R::Mask,
    /// Velocity demand behind the filter that the velocity estimate has behind it: otherwise an
    /// acceleration a would leave a following error of a·(filter delay)/Kp.
    matched_velocity: R,
    measured_a: Rotor<R>,
    voltage_v: Rotor<R>,
    angle: R::Count,
    following_error: R,
    shown: (R::Count, R),
    /// Smoothed converter readings; the currents' as deviation from the nominal zero, where `f32`
    /// is fine enough for a slow filter.
    phase_adc: [R; 2],
    bus_adc: R,
    temperature_adc: R,
    settled: R::Mask,
}

// A drive's share of the cache, and of a microcontroller's memory.
const _: () = assert!(core::mem::size_of::<Cascade<f32>>() <= 512);

/// How fast a given voltage gives way to its current's limit: the part of the present excess, in
/// squares, that one period takes back.
const THROTTLE: f32 = 0.02;
/// The least part, from which it can grow again.
const LEAST_PART: f32 = 1.0 / 1024.0;

/// The part of a given voltage to be applied next: less while the current exceeds its limit, back
/// to all of it while there is room. It halves at most within one period.
fn throttled<R: Real>(part: R, actual: Rotor<R>, limit_a: R) -> R {
    let half = R::splat(0.5);
    let square = limit_a * limit_a;
    let square = square.greatest(R::splat(1e-6)).least(R::splat(1e12));
    let excess = (actual.d * actual.d + actual.q * actual.q) / square - R::splat(1.0);
    let factor = (R::splat(1.0) - R::splat(THROTTLE) * excess).greatest(half);
    let next = (part * factor)
        .least(R::splat(1.0))
        .greatest(R::splat(LEAST_PART));
    R::select(R::splat(0.0).lt(limit_a), next, R::splat(0.0))
}

impl<R: Real> Cascade<R> {
    /// Bridge off, position to be taken from the first sample.
    pub fn new(parameters: &Parameters<R>) -> Self {
        let zero = R::splat(0.0);
        let off = R::Mask::splat(false);
        Self {
            constants: Constants::of(parameters),
            command: Command::idle(),
            segment: Segment::of(&Command::idle()),
            tracker: Tracker::new(),
            motion: MotionLoops::new(),
            current: CurrentLoop::new(),
            i2t: I2tSum::new(),
            was_enabled: off,
            voltage_limited: off,
            given_part: R::splat(1.0),
            tripped: off,
            encoder_valid: R::Mask::splat(true),
            matched_velocity: zero,
            measured_a: Rotor { d: zero, q: zero },
            voltage_v: Rotor { d: zero, q: zero },
            angle: R::count(0),
            following_error: zero,
            shown: (R::count(0), zero),
            phase_adc: [zero; 2],
            bus_adc: zero,
            temperature_adc: zero,
            settled: off,
        }
    }

    /// Takes other parameters and keeps all state: integrators hold volts, amperes and counts/s,
    /// so a change of gains makes no bump of its own. A change of the user's direction negates
    /// position, velocity and demand. I²t keeps its energy as the same part of Ip²·period.
    pub fn set_parameters(&mut self, parameters: &Parameters<R>) {
        let before = R::of_count(self.constants.user_polarity);
        self.constants = Constants::of(parameters);
        let turned = (before * R::of_count(self.constants.user_polarity)).lt(R::splat(0.0));
        self.tracker.reverse(turned);
        self.segment.reverse(turned);
        self.motion.reverse(turned);
        self.matched_velocity = R::select(turned, -self.matched_velocity, self.matched_velocity);
    }

    /// Whether both have the same parameters.
    pub fn is_tuned_like(&self, other: &Self) -> bool {
        self.constants == other.constants
    }

    /// Takes a segment; it starts with the next period. With the one that enables the bridge, a
    /// closed position loop starts at the actual position whatever the command says, and the
    /// integrators start without a bump; the next segment's position counts.
    pub fn load(&mut self, command: &Command<R>) {
        self.command = Command {
            velocity_offset: command.velocity_offset.sane(),
            frame: FrameSource {
                voltage_d_v: command.frame.voltage_d_v.sane(),
                voltage_q_v: command.frame.voltage_q_v.sane(),
                ..command.frame
            },
            ..*command
        };
        self.set_limits(&Limits {
            current_a: command.current_limit,
            velocity: command.velocity_limit,
        });
        self.segment = Segment::of(command);
    }

    /// Changes the limits of the command in force; its segment goes on.
    pub fn set_limits(&mut self, limits: &Limits<R>) {
        // A limit that is negative or not a number lets nothing pass.
        let zero = R::splat(0.0);
        let bound = |limit: R| R::select(zero.lt(limit), limit, zero);
        self.command.current_limit = bound(limits.current_a);
        self.command.velocity_limit = bound(limits.velocity);
    }

    /// Gives the present position another name (0x6064 written). The demand moves along, so the
    /// axis does not.
    pub fn preset_position(&mut self, position: R::Count) {
        self.rename(R::count_sub(position, self.tracker.position()));
        self.tracker.preset(position);
    }

    /// Makes all positions `offset` greater, also while the axis moves. The demand moves along.
    pub fn rename(&mut self, offset: R::Count) {
        self.segment.shift(offset);
        self.shown.0 = R::count_add(self.shown.0, offset);
        self.tracker
            .preset(R::count_add(self.tracker.position(), offset));
    }

    /// Position over many turns, counts, wrapping: that of the last period.
    #[inline]
    pub fn position(&self) -> R::Count {
        self.tracker.position()
    }

    /// The encoder's reading of the last period, counts within a turn; in the place of an invalid one
    /// that which the velocity led to.
    #[inline]
    pub fn encoder(&self) -> R::Count {
        self.tracker.raw()
    }

    /// One control period: what the sensors say at its start, and what the bridge shall do.
    #[inline]
    pub fn period(&mut self, sample: &Sample<R>) -> Duty<R> {
        let c = &self.constants;
        let zero = R::splat(0.0);
        self.tripped = self.command.enabled & (self.tripped | sample.overcurrent);
        let enabled = self.command.enabled & !self.tripped;
        let source = &self.command.frame;

        // Where the rotor is, and how fast.
        self.tracker
            .update(&c.encoder, sample.encoder, sample.encoder_valid);
        let velocity = self.tracker.velocity();
        let from_zero = R::count_sub(self.tracker.raw(), c.electrical_zero);
        let rotor = R::count_mul(from_zero, c.angle_per_count);
        let advanced = |advance: R| {
            let angle = R::count_add(rotor, (velocity * advance).to_count());
            R::count_select(source.angle_given, source.angle, angle)
        };
        let at_sample = Rotation::<R>::at(advanced(c.sample_advance));
        let angle = advanced(c.apply_advance);
        let at_apply = Rotation::<R>::at(angle);

        // What flows.
        let scale = R::splat(c.scales.current_a);
        let [a, b] = sample.phase_adc;
        let [zero_a, zero_b] = c.current_zero;
        let actual = at_sample.park(clarke((a - zero_a) * scale, (b - zero_b) * scale));
        // The user's direction has no meaning in a frame given from outside.
        let sign = R::select(source.angle_given, R::splat(1.0), c.torque_sign);

        // What shall flow.
        let starts = enabled & !self.was_enabled;
        let closed = enabled & self.command.position_loop;
        self.segment
            .follow(!closed | starts, self.tracker.position());
        let lag = R::count_sub(self.segment.position, self.tracker.position());
        self.following_error = R::of_count(lag) + self.segment.fraction;
        self.shown = (self.segment.position, self.segment.fraction);
        let limit = self
            .command
            .current_limit
            .least(c.amplifier_limit_a)
            .least(self.i2t.limit(&c.i2t));
        let closed_velocity = enabled & (self.command.position_loop | self.command.velocity_loop);
        let ahead = self.segment.velocity - self.matched_velocity;
        let matched = (self.matched_velocity + self.tracker.part() * ahead).sane();
        self.matched_velocity = R::select(closed_velocity, matched, velocity);
        let unrealised = self.motion.demand_current - sign * actual.q;
        self.motion.period(
            &c.motion,
            &MotionInput {
                position_loop: closed,
                velocity_loop: closed_velocity,
                following_error: self.following_error,
                following_rate: self.matched_velocity - velocity,
                velocity_demand: self.matched_velocity + self.command.velocity_offset,
                velocity,
                current_demand: self.segment.current + self.segment.acceleration_current,
                velocity_limit: self.command.velocity_limit,
                current_limit: limit,
                unrealised: R::select(self.voltage_limited, unrealised, zero),
            },
        );
        let driven = enabled & !source.voltage_given;
        self.motion.release(!driven);
        self.i2t.add(
            &c.i2t,
            R::select(
                enabled & source.voltage_given,
                actual.d * actual.d + actual.q * actual.q,
                self.motion.demand_current * self.motion.demand_current,
            ),
        );

        // The voltage for it, or the given one.
        let bus_v = (sample.bus_adc * R::splat(c.scales.voltage_v)).greatest(R::splat(LEAST_BUS_V));
        let error = Rotor {
            d: -actual.d,
            q: sign * self.motion.demand_current - actual.q,
        };
        self.given_part = if (enabled & source.voltage_given).any() {
            let part = throttled(self.given_part, actual, limit);
            R::select(enabled & source.voltage_given, part, R::splat(1.0))
        } else {
            R::splat(1.0)
        };
        let speed = velocity * c.electrical_rad_per_count;
        let by_loop = self.current.wanted(&c.current, error, actual, speed);
        let pick = |given: R, by_loop: R| {
            let given = given * self.given_part;
            let voltage = R::select(source.voltage_given, given, by_loop);
            R::select(enabled, voltage, zero)
        };
        let wanted = Rotor {
            d: pick(source.voltage_d_v, by_loop.d),
            q: pick(source.voltage_q_v, by_loop.q),
        };
        let (voltage, limited) =
            modulation::inside_circle(wanted, (bus_v * c.radius).least(c.voltage_limit_v));
        let unrealised = Rotor {
            d: wanted.d - voltage.d,
            q: wanted.q - voltage.q,
        };
        self.current
            .settle(&c.current, error, unrealised, speed, driven);
        // Against the dead time by the current that shall flow: what is measured about zero says
        // little of where a current wants to go, because the dead time holds it there. Under a given
        // voltage it is the measured one, and about zero that which the voltage drives.
        let under_voltage = |voltage: R, actual: R| voltage * c.hint_a_per_v + actual;
        let flowing = Rotor {
            d: R::select(
                source.voltage_given,
                under_voltage(voltage.d, actual.d),
                zero,
            ),
            q: R::select(
                source.voltage_given,
                under_voltage(voltage.q, actual.q),
                sign * self.motion.demand_current,
            ),
        };
        let more =
            modulation::against_dead_time(at_apply.unpark(flowing), c.dead_part, c.dead_part_per_a);
        let duty = modulation::duties(
            at_apply.unpark(voltage),
            R::splat(1.0) / bus_v,
            more,
            c.shortest,
            c.reach,
            enabled,
        );
        let shorted = self.command.shorted;
        let duty = Duty {
            phase: duty.phase.map(|phase| R::select(shorted, zero, phase)),
            ..duty
        };

        // What is left behind.
        self.voltage_limited = limited;
        self.was_enabled = enabled;
        self.measured_a = Rotor {
            d: actual.d,
            q: sign * actual.q,
        };
        self.voltage_v = voltage;
        self.angle = angle;
        self.encoder_valid = sample.encoder_valid;
        let frame = &mut self.command.frame;
        frame.angle = R::count_add(frame.angle, frame.turn);
        self.smooth(sample);
        self.segment.advance(self.constants.period_s);
        duty
    }

    /// Slow filters of the converters. They start at their first reading.
    #[inline(always)]
    fn smooth(&mut self, sample: &Sample<R>) {
        let c = &self.constants;
        let zero = R::splat(0.0);
        let nominal = R::splat(c.scales.current_zero);
        // The first reading goes all the way from 0.
        let all = R::splat(1.0);
        let phase_adc_part = R::select(self.settled, c.phase_adc_part, all);
        let slow_part = R::select(self.settled, c.slow_part, all);
        let filter = |state: R, input: R, part: R| {
            let next = state + part * (input - state);
            // Far beyond any converter: not a reading, and slow to forget.
            R::select(next.abs().lt(R::splat(1e5)), next, zero)
        };
        let [a, b] = sample.phase_adc;
        let [state_a, state_b] = self.phase_adc;
        self.phase_adc = [
            filter(state_a, a - nominal, phase_adc_part),
            filter(state_b, b - nominal, phase_adc_part),
        ];
        self.bus_adc = filter(self.bus_adc, sample.bus_adc, slow_part);
        self.temperature_adc = filter(self.temperature_adc, sample.temperature_adc, slow_part);
        self.settled = R::Mask::splat(true);
    }

    /// The state after the last period, in units. Made when asked for.
    pub fn feedback(&self) -> Feedback<R> {
        let c = &self.constants;
        let nominal = R::splat(c.scales.current_zero);
        let [adc_a, adc_b] = self.phase_adc;
        let (demand_position, demand_fraction) = self.shown;
        Feedback {
            position: self.tracker.position(),
            velocity: self.tracker.velocity(),
            velocity_reported: self.tracker.reported(),
            current_q_a: self.measured_a.q,
            current_d_a: self.measured_a.d,
            demand_position,
            demand_fraction,
            next_position: self.segment.position,
            next_fraction: self.segment.fraction,
            next_velocity: self.segment.velocity,
            next_current_a: self.segment.current,
            next_periods_left: self.segment.periods_left(),
            following_error: self.following_error,
            demand_velocity: self.motion.demand_velocity,
            demand_current_a: self.motion.demand_current,
            voltage_v: [self.voltage_v.d, self.voltage_v.q],
            electrical_angle: self.angle,
            bus_voltage_v: self.bus_adc * R::splat(c.scales.voltage_v),
            temperature_c: self.temperature_adc * R::splat(c.scales.temperature_k)
                + R::splat(c.scales.temperature_zero_c),
            encoder: self.tracker.raw(),
            phase_adc: [adc_a + nominal, adc_b + nominal],
            current_limited: self.motion.current_limited | self.given_part.lt(R::splat(1.0)),
            velocity_limited: self.motion.velocity_limited,
            voltage_limited: self.voltage_limited,
            i2t_active: self.i2t.active(),
            overcurrent: self.tripped,
            encoder_valid: self.encoder_valid,
        }
    }
}
