//! Where the behaviour finds its values.

use canopen::{Dictionary, Field};

use crate::md80::internal::{self, PLACES};
use crate::md80::status::WORDS;

/// Objects that the behaviour reads and writes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fields {
    pub(super) pole_pairs: Field,
    pub(super) torque_constant: Field,
    pub(super) inductance: Field,
    pub(super) resistance: Field,
    pub(super) bandwidth: Field,
    pub(super) shutdown_temperature: Field,
    pub(super) gear: Field,
    pub(super) calibration_mode: Field,
    pub(super) watchdog_ms: Field,
    /// 0x2004, sub-indices 1 to 8.
    pub(super) status: [Field; WORDS],
    pub(super) output_type: Field,
    pub(super) output_calibration_mode: Field,
    pub(super) output_mode: Field,
    pub(super) output_position: Field,
    pub(super) output_velocity: Field,
    pub(super) motor_temperature: Field,
    pub(super) mosfet_temperature: Field,
    pub(super) statusword: Field,
    pub(super) position_demand: Field,
    pub(super) position_actual: Field,
    pub(super) velocity_actual: Field,
    pub(super) target_position: Field,
    pub(super) max_current: Field,
    pub(super) rated_current: Field,
    pub(super) least_position: Field,
    pub(super) greatest_position: Field,
    pub(super) max_speed: Field,
    pub(super) electrical_zero: Field,
    pub(super) electrical_polarity: Field,
    pub(super) is_calibrated: Field,
    pub(super) low_accuracy: Field,
    pub(super) current_zero_a: Field,
    pub(super) current_zero_b: Field,
    pub(super) zero: Field,
    pub(super) output_zero: Field,
    pub(super) output_direction: Field,
    pub(super) output_is_calibrated: Field,
    pub(super) output_low_accuracy: Field,
    pub(super) correction: [Field; PLACES],
    pub(super) output_correction: [Field; PLACES],
}

/// All places of a table.
const fn places<const N: usize>(objects: &Dictionary<N>, index: u16) -> [Field; PLACES] {
    let mut fields = [objects.need(index, 1); PLACES];
    let mut n = 1;
    while n < PLACES {
        #[allow(clippy::indexing_slicing, reason = "runs at compile time")]
        {
            fields[n] = objects.need(index, n as u8 + 1);
        }
        n += 1;
    }
    fields
}

impl Fields {
    pub(super) const fn of<const N: usize>(objects: &Dictionary<N>) -> Fields {
        Fields {
            pole_pairs: objects.need(0x2000, 1),
            torque_constant: objects.need(0x2000, 2),
            inductance: objects.need(0x2000, 3),
            resistance: objects.need(0x2000, 4),
            bandwidth: objects.need(0x2000, 5),
            shutdown_temperature: objects.need(0x2000, 7),
            gear: objects.need(0x2000, 8),
            calibration_mode: objects.need(0x2000, 9),
            watchdog_ms: objects.need(0x2000, 12),
            status: [
                objects.need(0x2004, 1),
                objects.need(0x2004, 2),
                objects.need(0x2004, 3),
                objects.need(0x2004, 4),
                objects.need(0x2004, 5),
                objects.need(0x2004, 6),
                objects.need(0x2004, 7),
                objects.need(0x2004, 8),
            ],
            output_type: objects.need(0x2005, 1),
            output_calibration_mode: objects.need(0x2005, 2),
            output_mode: objects.need(0x2005, 3),
            output_position: objects.need(0x2005, 4),
            output_velocity: objects.need(0x2005, 5),
            motor_temperature: objects.need(0x2006, 1),
            mosfet_temperature: objects.need(0x2006, 2),
            statusword: objects.need(0x6041, 0),
            position_demand: objects.need(0x6062, 0),
            position_actual: objects.need(0x6064, 0),
            velocity_actual: objects.need(0x606C, 0),
            target_position: objects.need(0x607A, 0),
            max_current: objects.need(0x6073, 0),
            rated_current: objects.need(0x6075, 0),
            least_position: objects.need(0x607D, 1),
            greatest_position: objects.need(0x607D, 2),
            max_speed: objects.need(0x6080, 0),
            electrical_zero: objects.need(internal::ELECTRICAL_ZERO, 0),
            electrical_polarity: objects.need(internal::ELECTRICAL_POLARITY, 0),
            is_calibrated: objects.need(internal::IS_CALIBRATED, 0),
            low_accuracy: objects.need(internal::LOW_ACCURACY, 0),
            current_zero_a: objects.need(internal::CURRENT_ZERO_A, 0),
            current_zero_b: objects.need(internal::CURRENT_ZERO_B, 0),
            zero: objects.need(internal::ZERO, 0),
            output_zero: objects.need(internal::OUTPUT_ZERO, 0),
            output_direction: objects.need(internal::OUTPUT_DIRECTION, 0),
            output_is_calibrated: objects.need(internal::OUTPUT_IS_CALIBRATED, 0),
            output_low_accuracy: objects.need(internal::OUTPUT_LOW_ACCURACY, 0),
            correction: places(objects, internal::CORRECTION),
            output_correction: places(objects, internal::OUTPUT_CORRECTION),
        }
    }
}
