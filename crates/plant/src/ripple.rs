//! Torques that depend on the angle: cogging, and weights that turn.

use control::{Real, sin_cos};

use crate::Invalid;
use crate::load::{MAX_TURNS, Pendulum};

/// Cogging: the magnet pulls toward some angles even without current, with
/// `torque_nm` · sin(n · (`rest_turns` - position)), n periods a turn. It takes and gives back its
/// energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cogging {
    /// Greatest torque, Nm; 0: none, as in a motor with an ironless winding.
    pub torque_nm: f64,
    /// Periods in a turn: the least common multiple of poles and slots, typically.
    pub periods_per_turn: u16,
    /// One of the positions that it pulls to, turns.
    pub rest_turns: f64,
}

impl Cogging {
    /// No cogging.
    pub const NONE: Cogging = Cogging {
        torque_nm: 0.0,
        periods_per_turn: 1,
        rest_turns: 0.0,
    };

    pub(crate) fn check(&self) -> Result<(), Invalid> {
        if !(0.0..=1e9).contains(&self.torque_nm) {
            return Err(Invalid::Cogging(self.torque_nm));
        }
        if !(-MAX_TURNS..=MAX_TURNS).contains(&self.rest_turns) {
            return Err(Invalid::Cogging(self.rest_turns));
        }
        if self.periods_per_turn == 0 {
            return Err(Invalid::Cogging(0.0));
        }
        Ok(())
    }
}

/// A torque that is a sine of the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ripple<R: Real> {
    torque: R,
    periods: R::Count,
    rest: R::Count,
}

impl<R: Real> Ripple<R> {
    fn new(torque_nm: f64, periods: u16, rest_turns: f64) -> Option<Self> {
        // Of the rest position only the part of a period counts; the cast keeps that.
        let rest = rest_turns * f64::from(periods);
        let whole = rest as i64;
        let part = ((rest - whole as f64) * 4_294_967_296.0) as i64;
        let exists = torque_nm != 0.0 && torque_nm.is_finite();
        exists.then(|| Self {
            torque: R::splat(torque_nm as f32),
            periods: R::count(periods.into()),
            rest: R::count(part as i32),
        })
    }

    /// `None` without cogging.
    pub(crate) fn of_cogging(cogging: &Cogging) -> Option<Self> {
        let Cogging {
            torque_nm,
            periods_per_turn,
            rest_turns,
        } = *cogging;
        Self::new(torque_nm, periods_per_turn, rest_turns)
    }

    /// `None` without a weight.
    pub(crate) fn of_pendulum(pendulum: &Pendulum) -> Option<Self> {
        Self::new(pendulum.torque_nm, 1, pendulum.hanging_turns)
    }

    /// Torque against positive rotation at an angle, Nm.
    #[inline(always)]
    pub(crate) fn opposing(&self, angle: R::Count) -> R {
        let phase = R::count_sub(R::count_mul(angle, self.periods), self.rest);
        let (sine, _) = sin_cos::<R>(phase);
        self.torque * sine
    }
}
