//! The motor and its encoder.

use canopen::{Address, Field};

use super::{Figure, Scaled};

/// The motor and its encoder.
#[derive(Clone, Copy, Debug)]
pub struct MotorObjects {
    /// Encoder reading with the rotor under phase A, counts.
    pub electrical_zero: Figure,
    /// +1 or −1: order of the phases against the encoder's direction.
    pub electrical_polarity: Figure,
    /// Its object, which takes no 0.
    pub electrical_polarity_at: Option<Address>,
    /// Number of poles (twice the pole pairs).
    pub poles: Figure,
    /// Nm per A of peak phase current.
    pub torque_constant: Figure,
    /// Terminal to terminal, Ω.
    pub terminal_resistance: Figure,
    /// Terminal to terminal, H.
    pub terminal_inductance: Figure,
    /// kg·m², where the drive knows it.
    pub rotor_inertia: Option<Figure>,
    /// A.
    pub continuous_current: Figure,
    /// A.
    pub peak_current: Figure,
    /// s.
    pub peak_time: Figure,
    /// The user's own, lower current limits: continuous A, peak A, time s; 0 is "none".
    pub user_continuous_current: Option<Scaled>,
    /// See [`MotorObjects::user_continuous_current`].
    pub user_peak_current: Option<Scaled>,
    /// See [`MotorObjects::user_continuous_current`].
    pub user_peak_time: Option<Scaled>,
    /// Counts per turn.
    pub encoder_resolution: Figure,
    /// Age of an encoder reading, s.
    pub encoder_lag: Figure,
    /// The object that is 0 where the excess of current is limited as the P3's manual prints it, and
    /// 1 where dimensionally right (P30). Without it: as printed.
    pub i2t_rule: Option<Field>,
    /// Figures of 0 are those of a drive that was not set up yet. It starts, with a bridge through
    /// which its controllers send no current. If not, they are a parameter error.
    pub may_be_unset: bool,
}
