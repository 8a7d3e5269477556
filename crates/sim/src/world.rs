//! Which motor and supply each documented drive has when nobody says otherwise.

use personalities::Personality;
use plant::{EC_45_FLAT_339281, Encoder, Parameters, VIRTUAL_MD80, VIRTUAL_P3};

/// A small brushless motor at 24 V, as `personalities::roboteq` is set up for, on a board that senses as
/// a virtual P3's does. Neither motor nor board warms up: the controller's document knows no heat of the
/// motor.
const ROBOTEQ: Parameters = Parameters {
    motor: EC_45_FLAT_339281,
    // It counts from where it is switched on.
    encoder: Encoder::ideal(4096, 0),
    supply_v: 24.0,
    thermal: None,
    ..VIRTUAL_P3
};

/// The world of a drive, and of each of its axes.
pub(crate) fn of(personality: &Personality) -> Parameters {
    match personality.name {
        "roboteq" | "roboteq-2" | "roboteq-3" => ROBOTEQ,
        "md80" => VIRTUAL_MD80,
        _ => VIRTUAL_P3,
    }
}
