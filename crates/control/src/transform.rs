//! From three phases to the rotor's frame and back, amplitude-invariant: a phase current of
//! amplitude 1 A is a vector of length 1 A.

use crate::Real;

/// A vector in the stator's frame: `alpha` along phase A, `beta` 90 electrical degrees ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stator<R: Real> {
    /// Along phase A.
    pub alpha: R,
    /// A quarter turn ahead of phase A.
    pub beta: R,
}

/// A vector in the rotor's frame: `d` along the magnets' flux, `q` 90 electrical degrees ahead,
/// where current makes torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotor<R: Real> {
    /// Along the flux.
    pub d: R,
    /// Across the flux.
    pub q: R,
}

/// The rotation by an electrical angle: its sine and cosine, computed once for both directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation<R: Real> {
    sine: R,
    cosine: R,
}

/// The stator vector of two phase quantities whose three sum to zero (Clarke).
#[inline(always)]
pub fn clarke<R: Real>(a: R, b: R) -> Stator<R> {
    const INVERSE_ROOT_3: f32 = 0.577_350_27;
    Stator {
        alpha: a,
        beta: (a + b + b) * R::splat(INVERSE_ROOT_3),
    }
}

/// The three phase quantities of a stator vector; they sum to zero (inverse Clarke).
#[inline(always)]
pub fn phases<R: Real>(vector: Stator<R>) -> [R; 3] {
    const HALF_ROOT_3: f32 = 0.866_025_4;
    let along = vector.alpha * R::splat(-0.5);
    let across = vector.beta * R::splat(HALF_ROOT_3);
    [vector.alpha, along + across, along - across]
}

impl<R: Real> Rotation<R> {
    /// The rotation into the frame whose d axis stands at an electrical angle (2³² are one turn)
    /// from phase A.
    #[inline(always)]
    pub fn at(angle: R::Count) -> Self {
        let (sine, cosine) = crate::sin_cos::<R>(angle);
        Self { sine, cosine }
    }

    /// A stator vector as seen from the rotor (Park).
    #[inline(always)]
    pub fn park(&self, vector: Stator<R>) -> Rotor<R> {
        Rotor {
            d: self.cosine * vector.alpha + self.sine * vector.beta,
            q: self.cosine * vector.beta - self.sine * vector.alpha,
        }
    }

    /// A rotor vector as seen from the stator (inverse Park).
    #[inline(always)]
    pub fn unpark(&self, vector: Rotor<R>) -> Stator<R> {
        Stator {
            alpha: self.cosine * vector.d - self.sine * vector.q,
            beta: self.sine * vector.d + self.cosine * vector.q,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// 3,600 angles around the turn, as counts and as radians.
    fn turn() -> Vec<(i32, f64)> {
        (0..3_600)
            .map(|tenth| {
                let part = f64::from(tenth) / 3_600.0;
                let count = (part * 4_294_967_296.0) as i64 as u32 as i32;
                (count, part * 2.0 * core::f64::consts::PI)
            })
            .collect()
    }

    #[test]
    fn a_balanced_sine_is_a_constant_of_equal_amplitude_in_its_own_frame() {
        for (angle, radians) in turn() {
            // 3 A, 30 degrees ahead of the frame: d = 3 cos 30°, q = 3 sin 30°.
            let third = 2.0 * core::f64::consts::PI / 3.0;
            let ahead = radians + core::f64::consts::PI / 6.0;
            let phase = |shift: f64| (3.0 * (ahead - shift).cos()) as f32;
            let seen = Rotation::<f32>::at(angle).park(clarke(phase(0.0), phase(third)));
            assert!((seen.d - 2.598_076).abs() < 4e-6, "{seen:?}");
            assert!((seen.q - 1.5).abs() < 4e-6, "{seen:?}");
        }
    }

    #[test]
    fn there_and_back_is_the_same() {
        for (angle, _) in turn() {
            let rotation = Rotation::<f32>::at(angle);
            let sent = Rotor { d: -0.7, q: 2.9 };
            let [a, b, c] = phases(rotation.unpark(sent));
            assert!((a + b + c).abs() < 2e-6);
            let back = rotation.park(clarke(a, b));
            assert!((back.d - sent.d).abs() < 3e-6, "{back:?}");
            assert!((back.q - sent.q).abs() < 3e-6, "{back:?}");
        }
    }

    #[test]
    fn power_is_three_halves_of_the_product_of_vectors() {
        for (angle, _) in turn().into_iter().step_by(37) {
            let rotation = Rotation::<f32>::at(angle);
            let (voltage, current) = (Rotor { d: 1.5, q: 11.0 }, Rotor { d: -0.2, q: 0.7 });
            let [va, vb, vc] = phases(rotation.unpark(voltage));
            let [ia, ib, ic] = phases(rotation.unpark(current));
            let power = va * ia + vb * ib + vc * ic;
            assert!(
                (power - 1.5 * (1.5 * -0.2 + 11.0 * 0.7)).abs() < 2e-5,
                "{power}"
            );
        }
    }
}
