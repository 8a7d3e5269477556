//! A channel's objects, found in the table, and positions of -1000 to 1000 in them.

use canopen::{Field, Image, Table};

use crate::roboteq::axis::base;

/// A channel's objects.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fields {
    pub(super) statusword: Field,
    pub(super) target_vl: Field,
    pub(super) min_vl: Field,
    pub(super) max_vl: Field,
    pub(super) up_vl: [Field; 2],
    pub(super) down_vl: [Field; 2],
    pub(super) mode: Field,
    pub(super) mode_display: Field,
    pub(super) position: Field,
    pub(super) target_torque: Field,
    pub(super) target_position: Field,
    pub(super) profile_velocity: Field,
    pub(super) acceleration: Field,
    pub(super) deceleration: Field,
    pub(super) target_velocity: Field,
    pub(super) motor_command: Field,
    pub(super) power: Field,
    pub(super) speed: Field,
    pub(super) counter: Field,
    pub(super) relative_speed: Field,
    pub(super) battery_amps: Field,
    pub(super) feedback: Field,
    pub(super) loop_error: Field,
    pub(super) flags: Field,
    pub(super) start_mode: Field,
    pub(super) max_acceleration: Field,
    pub(super) max_deceleration: Field,
    pub(super) max_velocity: Field,
    pub(super) fault_deceleration: Field,
    pub(super) max_rpm: Field,
    pub(super) current_limit: Field,
    pub(super) low: Field,
    pub(super) high: Field,
    pub(super) detection: Field,
}

pub(super) fn field(table: &Table, index: u16, sub: u8) -> Option<Field> {
    table.find(index, sub).ok().map(|entry| entry.field)
}

impl Fields {
    pub(super) fn of(table: &Table, n: u8) -> Option<Fields> {
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

impl Fields {
    /// Counts of a position of −1000 to 1000.
    pub(super) fn to_counts(self, image: &Image<'_>, relative: i32) -> i32 {
        let (low, high) = (image.number(self.low), image.number(self.high));
        let part = i64::from(relative.clamp(-1000, 1000)) + 1000;
        let counts = (high - low).saturating_mul(part) / 2000 + low;
        counts.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    }

    /// A position as −1000 to 1000; beyond the limits it is cut.
    pub(super) fn to_relative(self, image: &Image<'_>, counts: i32) -> i64 {
        let (low, high) = (image.number(self.low), image.number(self.high));
        let range = high - low;
        if range == 0 {
            return 0;
        }
        let from_low = (i64::from(counts) - low).saturating_mul(4000) / range;
        ((from_low + 1).div_euclid(2) - 1000).clamp(-1000, 1000)
    }
}
