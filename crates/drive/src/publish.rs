//! From the loops' feedback into the dictionary, before an object is read or sampled.

use canopen::Image;
use cia402::{Axis, Demand};
use control::Feedback;
use control::io::Signals;
use control::modulation::LINEAR_RANGE;
use personalities::{AxisObjects, Scaled};

use crate::configuration::gear;

/// Writes what the drive shows into the image.
pub(crate) fn publish(
    image: &mut Image<'_>,
    objects: &AxisObjects,
    axis: &Axis,
    feedback: &Feedback<f32>,
    signals: &Signals,
    pm_per_ampere: f32,
    vl_counts_per_s: f32,
) {
    if let Some(statusword) = objects.statusword {
        image.set(statusword, axis.statusword().0);
    }
    image.set_number(objects.mode_display, i64::from(axis.mode_display()));
    let shown = &objects.feedback;
    // Of motion the objects show the output's.
    let turns = objects.gear.map(|_| gear(image, objects));
    let rate = |motor: f32| motor * turns.unwrap_or(1.0);
    position(image, shown.position, feedback.position, turns);
    real(image, shown.velocity, rate(feedback.velocity_reported));
    optional(image, shown.torque, feedback.current_q_a * pm_per_ampere);
    optional(image, shown.current_a, feedback.current_q_a);
    if let Some(object) = shown.position_demand {
        // To the nearest count: a move may end a rounding error below its target.
        let up = i32::from(feedback.demand_fraction >= 0.5);
        let demand = feedback.demand_position.wrapping_add(up);
        position(image, object, demand, turns);
    }
    for object in shown.velocity_demand {
        optional(image, object, rate(feedback.demand_velocity));
    }
    for object in shown.torque_demand {
        optional(image, object, feedback.demand_current_a * pm_per_ampere);
    }
    if let Some(field) = shown.vl_velocity {
        // A factor of 0 makes nothing of every target; what is shown then saturates.
        real(
            image,
            Scaled::plain(field),
            feedback.velocity_reported / vl_counts_per_s,
        );
    }
    if let Some(field) = shown.interpolation_buffered {
        image.set_number(field, i64::from(axis.buffered()));
    }
    let following_error = rate(feedback.following_error);
    optional(image, shown.following_error, following_error);
    let velocity_error = feedback.demand_velocity - feedback.velocity_reported;
    optional(image, shown.velocity_error, rate(velocity_error));
    optional(image, shown.bus_voltage_v, feedback.bus_voltage_v);
    optional(image, shown.temperature_c, feedback.temperature_c);
    if let Some(object) = shown.raw_encoder {
        count(image, object, feedback.encoder);
    }
    frame(image, objects, axis, feedback);
    optional(image, shown.current_d_a, feedback.current_d_a);
    optional(image, shown.motor_thermistor, signals.motor_temperature_adc);
    for (object, adc) in shown.auxiliary_adc.iter().zip(signals.auxiliary_adc) {
        optional(image, *object, adc);
    }
    for (object, adc) in shown.current_sense.iter().zip(feedback.phase_adc) {
        optional(image, *object, adc);
    }
}

/// Electrical angle and phase voltage: those given where they are given, else those that the loops
/// make.
fn frame(image: &mut Image<'_>, objects: &AxisObjects, axis: &Axis, feedback: &Feedback<f32>) {
    let made = (feedback.electrical_angle >> 16) as i16;
    let (angle, voltage) = match *axis.demand() {
        Demand::TorqueWithAngle { angle, .. } => (angle, None),
        Demand::PhaseVoltage {
            angle,
            voltage_d,
            voltage_q,
        } => (angle, Some([voltage_d, voltage_q])),
        _ => (made, None),
    };
    if let Some(field) = objects.targets.angle {
        image.set_number(field, i64::from(angle));
    }
    let voltages = [objects.targets.voltage_d, objects.targets.voltage_q];
    let bus_v = if feedback.bus_voltage_v > 1.0 {
        feedback.bus_voltage_v
    } else {
        1.0
    };
    let per_volt = 32_768.0 / (LINEAR_RANGE * bus_v);
    for (n, made_v) in feedback.voltage_v.into_iter().enumerate() {
        let given = voltage.and_then(|both| both.get(n).copied());
        if let Some((_, field)) = voltages.get(n).copied().flatten() {
            let units = (made_v * per_volt) as i64;
            image.set_number(field, given.map_or(units, i64::from));
        }
    }
}

fn optional(image: &mut Image<'_>, object: Option<Scaled>, value: f32) {
    if let Some(object) = object {
        real(image, object, value);
    }
}

/// Rounded to the nearest unit of the object, held within its type.
fn real(image: &mut Image<'_>, object: Scaled, value: f32) {
    let units = value * object.per_unit;
    // `as` saturates and makes 0 of what is not a number.
    let rounded = if units < 0.0 {
        units - 0.5
    } else {
        units + 0.5
    } as i64;
    image.set_number(object.field, rounded);
}

/// The output's position; 64 bits, because counts above 2²⁴ have no exact `f32`.
fn position(image: &mut Image<'_>, object: Scaled, motor: i32, turns: Option<f32>) {
    match turns {
        Some(turns) => {
            let output = f64::from(motor) * f64::from(turns) * f64::from(object.per_unit);
            let rounded = if output < 0.0 {
                output - 0.5
            } else {
                output + 0.5
            } as i64;
            image.set_number(object.field, rounded);
        }
        None => count(image, object, motor),
    }
}

/// Counts wrap as the drive's position does.
fn count(image: &mut Image<'_>, object: Scaled, value: i32) {
    if object.scale == 1.0 {
        image.set_raw(object.field, value as u32);
    } else {
        real(image, object, value as f32);
    }
}
