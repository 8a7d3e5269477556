//! The field of a magnet at a sensor, by their distance.

use control::io::Magnet;

/// Distance of the magnet, mm, at which its field is 1.
pub(crate) const BEST_MM: f32 = 1.0;
/// Depth of the magnet's dipole behind its face, mm: about that of a cylinder 6 mm wide and 2.5 high.
const DEPTH_MM: f32 = 2.5;
/// Below this field the encoder warns, and its noise grows by more than the field falls.
pub(crate) const WEAK: f32 = 0.5;
/// Above this field the encoder warns.
const STRONG: f32 = 2.0;
/// Below this field the encoder finds no angle and says so instead.
pub(crate) const LEAST: f32 = 0.15;
/// Counts of noise per turn that a field of half of [`WEAK`] adds.
pub(crate) const WEAK_NOISE_PART: f32 = 1.0 / 1024.0;

/// Field of the magnet at the sensor, as a part of the field at the best distance: a dipole's,
/// ((2.5 mm + 1 mm)/(2.5 mm + distance))³. Below ½ (1.91 mm) the magnet is too weak, above 2
/// (0.28 mm) too strong; below 0.15 (4.09 mm) no angle is found. Figures of ours, in the manner of
/// a magnetic encoder's sheet (about 70 mT at best, 35 mT at least).
pub fn field_at(distance_mm: f32) -> f32 {
    let distance = if distance_mm > 0.0 { distance_mm } else { 0.0 };
    let ratio = (DEPTH_MM + BEST_MM) / (DEPTH_MM + distance);
    ratio * ratio * ratio
}

/// What an encoder says of a field.
pub(crate) fn magnet_of(field: f32) -> Magnet {
    if field < WEAK {
        Magnet::TooWeak
    } else if field > STRONG {
        Magnet::TooStrong
    } else {
        Magnet::Good
    }
}
