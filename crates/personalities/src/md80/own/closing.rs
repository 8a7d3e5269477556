//! Output encoder mode MOTION: positions are the output's as its own encoder tells them (M29).
//!
//! The loops stay on the motor's encoder, which turns the rotor's field and has no play to the motor. What the
//! output is away from where the motor's encoder puts it is taken off each target, so that the output comes
//! to rest where it shall, whatever play or twist lies between. It is added to what is shown.

use canopen::Image;
use cia402::{Configuration, Mode, State, Targets};

use super::FIELDS;
use super::correction::rounded;
use super::output::{OutputEncoder, is_in_use};
use crate::md80::internal::COUNTS_PER_TURN;
use crate::own::{AxisView, Orders};

/// 0x2005,3.
const MOTION: i64 = 2;
/// Part of the way to a new difference each millisecond: 8 Hz.
const PART: f32 = 0.05;
/// Counts of the output's encoder by which the difference must change before it is taken.
const LEAST_COUNTS: f32 = 0.75;
/// Milliseconds for which the demand must have stood still, in a profile.
const STILL_TICKS: u8 = 20;
/// Statusword: the drive follows its targets (CiA 402-2, cyclic position mode).
const FOLLOWS: u16 = 1 << 12;

/// What the output is away from where the motor's encoder puts it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Closing {
    is_on: bool,
    /// Smooth, counts of the motor.
    difference: f32,
    /// What is taken off targets and added to what is shown, counts of the motor.
    offset: i32,
    demand: i32,
    still: u8,
}

impl Closing {
    /// Added to the motor's position it makes the output's, counts of the motor.
    pub(super) fn offset(&self) -> i32 {
        self.offset
    }

    /// Both are 0 from now on.
    pub(super) fn set_zero(&mut self) {
        *self = Closing {
            is_on: self.is_on,
            ..Closing::default()
        };
    }

    /// A millisecond more; `rests` in a calibration, and while there is no reading.
    pub(super) fn tick(
        &mut self,
        image: &Image<'_>,
        view: &AxisView,
        output: &OutputEncoder,
        rests: bool,
        orders: &mut Orders,
    ) {
        let gear = image.real(FIELDS.gear);
        let is_on = is_in_use(image) && image.number(FIELDS.output_mode) == MOTION && gear > 0.0;
        let there = output.position(image).filter(|_| is_on && !rests);
        let Some(there) = there else {
            if !is_on {
                *self = Closing::default();
            }
            return;
        };
        let per_turn = f64::from(COUNTS_PER_TURN) / f64::from(gear);
        let difference = (there * per_turn - f64::from(view.position)) as f32;
        if self.is_on {
            self.difference += PART * (difference - self.difference);
        } else {
            self.is_on = true;
            self.difference = difference;
        }
        let stands = view.position_demand == self.demand;
        self.still = if stands {
            self.still.saturating_add(1)
        } else {
            0
        };
        self.demand = view.position_demand;

        let change = self.difference - self.offset as f32;
        let least = LEAST_COUNTS / gear;
        if -least < change && change < least {
            return;
        }
        let drives = view.state == State::OperationEnabled;
        let target = f64::from(image.number(FIELDS.target_position) as i32) / f64::from(gear);
        let off = target - f64::from(self.offset) - f64::from(view.position_demand);
        let has_arrived = self.still >= STILL_TICKS && (-2.0..=2.0).contains(&off);
        match view.mode {
            // On its way, and before its first target, a profile is left alone.
            Mode::PROFILE_POSITION if drives && !has_arrived => return,
            Mode::PROFILE_POSITION if drives => orders.new_targets = true,
            Mode::CYCLIC_POSITION if drives => {
                orders.new_targets = view.statusword & FOLLOWS != 0;
            }
            _ => {}
        }
        self.offset = rounded(self.difference) as i32;
        // Limits are the output's, too.
        let limits = (
            image.number(FIELDS.least_position),
            image.number(FIELDS.greatest_position),
        );
        orders.new_parameters |= limits != (0, 0);
    }

    /// A target of the output's, as the motor's.
    pub(super) fn targets(&self, targets: &mut Targets) {
        targets.position = targets.position.wrapping_sub(self.offset);
    }

    /// Limits likewise.
    pub(super) fn configuration(&self, configuration: &mut Configuration) {
        if let Some((least, greatest)) = &mut configuration.position_limits {
            *least = least.saturating_sub(self.offset);
            *greatest = greatest.saturating_sub(self.offset);
        }
    }

    /// 0x6062, 0x6064 and 0x606C.
    pub(super) fn publish(&self, image: &mut Image<'_>, view: &AxisView, output: &OutputEncoder) {
        let Some(there) = output.position(image).filter(|_| self.is_on) else {
            return;
        };
        let counts = there * f64::from(COUNTS_PER_TURN);
        let counts = if counts < 0.0 {
            counts - 0.5
        } else {
            counts + 0.5
        };
        image.set_number(FIELDS.position_actual, counts as i64);
        let demand = view.position_demand.wrapping_add(self.offset);
        let demand = f64::from(demand) * f64::from(image.real(FIELDS.gear));
        let demand = if demand < 0.0 {
            demand - 0.5
        } else {
            demand + 0.5
        };
        image.set_number(FIELDS.position_demand, demand as i64);
        let rpm = rounded(output.velocity(image) * 60.0);
        image.set_number(FIELDS.velocity_actual, rpm as i64);
    }
}
