//! From the dictionary to the axis: limits, profile parameters and targets in internal units.

use canopen::{Address, Field, Image};
use cia402::{Axis, Configuration, HomingConfiguration, Targets, VlConfiguration, Window};
use personalities::{
    AxisObjects, Figure, HomingObjects, Scaled, TargetWindow, VlObjects, WindowObjects,
};

/// A figure in internal units: the value of its object, if it has one.
#[inline]
pub(crate) fn value(image: &Image<'_>, figure: impl Into<Figure>) -> f32 {
    match figure.into() {
        Figure::Object(object) => image.real(object.field) * object.scale,
        Figure::Fixed(value) => value,
    }
}

/// Turns of the output for one of the motor.
pub(crate) fn gear(image: &Image<'_>, axis: &AxisObjects) -> f32 {
    let ratio = axis.gear.map_or(1.0, |field| image.real(field));
    if ratio > 0.0 && ratio.is_finite() {
        ratio
    } else {
        1.0
    }
}

/// Objects of motion, which are the output's where there is a gear.
#[derive(Clone, Copy)]
struct Motion<'a, 'b> {
    image: &'a Image<'b>,
    /// Turns of the motor for one of the output; `None` without a gear.
    turns: Option<f32>,
}

impl<'a, 'b> Motion<'a, 'b> {
    fn of(image: &'a Image<'b>, axis: &AxisObjects) -> Motion<'a, 'b> {
        Motion {
            image,
            turns: axis.gear.map(|_| 1.0 / gear(image, axis)),
        }
    }

    /// The motor's rate, counts/s or counts/s².
    fn value(&self, object: Scaled) -> f32 {
        value(self.image, object) * self.turns.unwrap_or(1.0)
    }

    fn limit(&self, object: Option<Scaled>) -> Option<f32> {
        limit(self.image, object).map(|limit| limit * self.turns.unwrap_or(1.0))
    }

    /// The motor's counts.
    fn count(&self, object: Scaled) -> i32 {
        match self.turns {
            // In 64 bits: counts above 2²⁴ have no exact `f32`.
            Some(turns) => {
                let output = self.image.number(object.field) as f64 * f64::from(object.scale);
                output_to_motor(output, turns)
            }
            None => count(self.image, object),
        }
    }

    fn window(&self, objects: Option<WindowObjects>) -> Option<Window> {
        let objects = objects?;
        let size = self.value(objects.size) as u32;
        (size > 0).then(|| Window {
            size,
            time_ms: time_ms(self.image, objects),
        })
    }

    fn target_window(&self, window: TargetWindow) -> Option<Window> {
        match window {
            TargetWindow::Fixed { size, time_ms } => Some(Window { size, time_ms }),
            TargetWindow::Size(size) => Some(Window {
                size: self.count(size) as u32,
                time_ms: 0,
            }),
            TargetWindow::Objects(objects) => {
                let switched_off = self.image.raw(objects.size.field) == u32::MAX;
                (!switched_off).then(|| Window {
                    size: self.count(objects.size) as u32,
                    time_ms: time_ms(self.image, objects),
                })
            }
        }
    }
}

/// To the nearest count.
fn output_to_motor(output: f64, turns: f32) -> i32 {
    let motor = output * f64::from(turns);
    // `as` saturates.
    if motor < 0.0 {
        (motor - 0.5) as i32
    } else {
        (motor + 0.5) as i32
    }
}

/// The value of an object in internal units, as a count.
#[inline]
fn count(image: &Image<'_>, object: Scaled) -> i32 {
    if object.scale == 1.0 {
        // Counts above 2²⁴ have no exact `f32`.
        image.number(object.field) as i32
    } else {
        value(image, object) as i32
    }
}

/// A limit, of which 0 means "none".
pub(crate) fn limit(image: &Image<'_>, object: Option<Scaled>) -> Option<f32> {
    object
        .map(|object| value(image, object))
        .filter(|limit| *limit > 0.0)
}

/// The least of several limits, of which 0 means "none".
fn least(motion: &Motion<'_, '_>, objects: [Option<Scaled>; 2]) -> Option<f32> {
    let mut least: Option<f32> = None;
    for object in objects {
        let Some(next) = motion.limit(object) else {
            continue;
        };
        least = Some(match least {
            Some(so_far) if so_far < next => so_far,
            _ => next,
        });
    }
    least
}

fn time_ms(image: &Image<'_>, objects: WindowObjects) -> u16 {
    image.number(objects.time_ms).clamp(0, i64::from(u16::MAX)) as u16
}

/// 0x6080 or its like, counts/s of the motor.
pub(crate) fn max_motor_velocity(image: &Image<'_>, axis: &AxisObjects) -> Option<f32> {
    Motion::of(image, axis).limit(axis.configuration.max_motor_velocity)
}

/// Reads the axis's configuration.
pub(crate) fn read_configuration(image: &Image<'_>, axis: &AxisObjects) -> Configuration {
    let objects = &axis.configuration;
    let motion = Motion::of(image, axis);
    let position_limits = objects.position_limits.and_then(|(low, high)| {
        let limits = (motion.count(low), motion.count(high));
        (limits != (0, 0)).then_some(limits)
    });
    Configuration {
        profile_velocity: motion.value(objects.profile_velocity),
        acceleration: motion.value(objects.acceleration),
        deceleration: motion.value(objects.deceleration),
        quick_stop_deceleration: objects
            .quick_stop_deceleration
            .map_or(0.0, |object| motion.value(object)),
        max_velocity: least(&motion, objects.max_velocity),
        max_acceleration: motion.limit(objects.max_acceleration),
        max_deceleration: motion.limit(objects.max_deceleration),
        position_limits,
        max_torque_pm: value(image, objects.max_torque),
        jerk: objects
            .jerk
            .filter(|(profile_type, _)| image.number(*profile_type) == JERK_LIMITED)
            .map_or(0.0, |(_, jerk)| value(image, jerk)),
        vl: objects.vl.map_or(VlConfiguration::default(), |objects| {
            read_vl(image, &objects)
        }),
        torque_slope_pm_per_s: limit(image, objects.torque_slope),
        interpolation_period_ns: interpolation_period_ns(image, objects.interpolation_period),
        interpolation_buffer: objects.interpolation_buffer.map_or(0, |field| {
            image.number(field).clamp(0, i64::from(Axis::BUFFER_SIZE)) as u8
        }),
        quick_stop_option: code(image, objects.quick_stop_option, 2),
        shutdown_option: code(image, objects.shutdown_option, 0),
        disable_option: code(image, objects.disable_option, 0),
        halt_option: code(image, objects.halt_option, 1),
        fault_reaction_option: code(image, objects.fault_reaction_option, 0),
        abort_connection_option: code(image, objects.abort_connection_option, 0),
        following_warning: motion.window(objects.following_warning),
        following_fault: motion.window(objects.following_fault),
        velocity_warning: motion.window(objects.velocity_warning),
        velocity_fault: motion.window(objects.velocity_fault),
        position_window: motion.target_window(objects.position_window),
        velocity_window: motion.target_window(objects.velocity_window),
        velocity_window_percent: objects.velocity_window_percent,
        velocity_threshold: objects.velocity_threshold,
        velocity_threshold_time_ms: 0,
        homing: axis.homing.map_or(HomingConfiguration::DEFAULT, |objects| {
            homing(image, &objects)
        }),
    }
}

/// What homing needs of the dictionary; the counts of a turn are the motor's.
fn homing(image: &Image<'_>, objects: &HomingObjects) -> HomingConfiguration {
    let configuration = HomingConfiguration {
        method: image.number(objects.method) as i8,
        offset: count(image, objects.offset),
        ..HomingConfiguration::DEFAULT
    };
    let Some(search) = objects.search else {
        return configuration;
    };
    HomingConfiguration {
        switch_velocity: value(image, search.switch_velocity),
        zero_velocity: value(image, search.zero_velocity),
        acceleration: value(image, search.acceleration),
        stop_torque_pm: value(image, search.stop_torque),
        stop_time_ms: image.raw(search.stop_time_ms) as u16,
        back_off: image.raw(search.back_off),
        timeout_ms: image.raw(search.timeout_ms),
        range: image.raw(search.range),
        least_way: image.raw(search.least_way),
        ..configuration
    }
}

/// 0x6086: ramps with limited jerk.
pub(crate) const JERK_LIMITED: i64 = 3;

/// Reads unit and ramps of velocity mode.
fn read_vl(image: &Image<'_>, objects: &VlObjects) -> VlConfiguration {
    let real = |field: Field| image.number(field) as f32;
    let factor = |(numerator, denominator): (Field, Field)| real(numerator) / real(denominator);
    let counts_per_s = real(objects.encoder_resolution) / 60.0 * factor(objects.dimension_factor);
    // A speed in no time is at once.
    let rate = |speed_and_time| control::Real::abs(factor(speed_and_time) * counts_per_s);
    VlConfiguration {
        counts_per_s: counts_per_s * factor(objects.set_point_factor),
        acceleration: rate(objects.acceleration),
        deceleration: rate(objects.deceleration),
        quick_stop_deceleration: rate(objects.quick_stop),
    }
}

/// An option code, or what a drive without the object does.
fn code(image: &Image<'_>, object: Option<Field>, otherwise: i8) -> i8 {
    object.map_or(otherwise, |field| image.number(field) as i8)
}

/// 0x60C2: value × 10^exponent seconds, in ns; 0 if the drive has no such object.
fn interpolation_period_ns(image: &Image<'_>, objects: Option<(Field, Field)>) -> u32 {
    let Some((value, exponent)) = objects else {
        return 0;
    };
    let mut ns = image.number(value).max(0) as u64;
    let exponent = image.number(exponent).clamp(-9, 9) + 9;
    for _ in 0..exponent {
        ns = ns.saturating_mul(10);
    }
    u32::try_from(ns).unwrap_or(u32::MAX)
}

/// Reads what the master wants.
pub(crate) fn read_targets(image: &Image<'_>, axis: &AxisObjects) -> Targets {
    let objects = &axis.targets;
    let motion = Motion::of(image, axis);
    let offset = |object: Option<Scaled>| object.map_or(0, |object| motion.count(object));
    // Held within its type: an object may hold more than the motor ever gives.
    let torque = |object: Option<Scaled>| {
        let pm = object.map_or(0, |object| count(image, object));
        pm.clamp(i16::MIN.into(), i16::MAX.into()) as i16
    };
    let voltage = |object: Option<(Address, Field)>| {
        object.map_or(0, |(_, field)| image.number(field) as i16)
    };
    Targets {
        position: motion.count(objects.position),
        velocity: motion.count(objects.velocity),
        vl_velocity: objects
            .vl_velocity
            .map_or(0, |field| image.number(field) as i16),
        torque_pm: torque(objects.torque),
        position_offset: offset(objects.position_offset),
        velocity_offset: offset(objects.velocity_offset),
        torque_offset_pm: torque(objects.torque_offset),
        angle: objects.angle.map_or(0, |field| image.number(field) as i16),
        voltage_d: voltage(objects.voltage_d),
        voltage_q: voltage(objects.voltage_q),
    }
}
