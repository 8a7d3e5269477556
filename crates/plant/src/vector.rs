//! A vector in the stator plane.

use core::ops::{Add, Mul, Sub};

use control::Real;

/// A quantity of the three phases as a vector in the stator plane, amplitude-invariant: a vector of
/// length 1 stands for three phases of peak value 1. `alpha` lies along phase A; the positive sense
/// of rotation runs A, B, C. Also a complex number: `alpha + j beta`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector<R: Real> {
    /// Along phase A.
    pub alpha: R,
    /// A quarter turn ahead of phase A.
    pub beta: R,
}

const HALF_SQRT_3: f32 = 0.866_025_4;
/// 1/√3.
pub(crate) const INVERSE_SQRT_3: f32 = 0.577_350_26;

impl<R: Real> Vector<R> {
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            alpha: R::splat(0.0),
            beta: R::splat(0.0),
        }
    }

    /// The vector of three phase quantities (Clarke). What the three have in common drops out: the
    /// star point is not connected.
    #[inline(always)]
    pub fn of_phases([a, b, c]: [R; 3]) -> Self {
        Self {
            alpha: (a + a - b - c) * R::splat(1.0 / 3.0),
            beta: (b - c) * R::splat(INVERSE_SQRT_3),
        }
    }

    /// The three phase quantities, of sum zero.
    #[inline(always)]
    pub fn phases(self) -> [R; 3] {
        let half = self.alpha * R::splat(-0.5);
        let across = self.beta * R::splat(HALF_SQRT_3);
        [self.alpha, half + across, half - across]
    }

    /// The product of two complex numbers.
    #[inline(always)]
    pub fn times(self, other: Self) -> Self {
        Self {
            alpha: self.alpha * other.alpha - self.beta * other.beta,
            beta: self.alpha * other.beta + self.beta * other.alpha,
        }
    }

    /// How far `other` stands out of this direction: `|self| |other| sin(angle from self to other)`.
    #[inline(always)]
    pub fn cross(self, other: Self) -> R {
        self.alpha * other.beta - self.beta * other.alpha
    }

    /// `a` where `mask` is true, else `b`.
    #[inline(always)]
    pub fn select(mask: R::Mask, a: Self, b: Self) -> Self {
        Self {
            alpha: R::select(mask, a.alpha, b.alpha),
            beta: R::select(mask, a.beta, b.beta),
        }
    }
}

impl<R: Real> Add for Vector<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            alpha: self.alpha + other.alpha,
            beta: self.beta + other.beta,
        }
    }
}

impl<R: Real> Sub for Vector<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            alpha: self.alpha - other.alpha,
            beta: self.beta - other.beta,
        }
    }
}

impl<R: Real> Mul<R> for Vector<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: R) -> Self {
        Self {
            alpha: self.alpha * factor,
            beta: self.beta * factor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Vector;

    #[test]
    fn one_ampere_peak_is_a_vector_of_length_one() {
        // Phase A at its peak: B and C carry half of it back.
        let vector = Vector::of_phases([1.0_f32, -0.5, -0.5]);
        assert_eq!(
            vector,
            Vector {
                alpha: 1.0,
                beta: 0.0
            }
        );
        // A quarter turn later: A zero, B = -C = sin 60°.
        let vector = Vector::of_phases([0.0_f32, 0.866_025_4, -0.866_025_4]);
        assert!(vector.alpha.abs() < 1e-7 && (vector.beta - 1.0).abs() < 1e-7);
    }

    #[test]
    fn phases_return_and_their_common_part_drops_out() {
        let [a, b, c] = Vector::of_phases([3.0_f32 + 7.0, -1.0 + 7.0, -2.0 + 7.0]).phases();
        assert!((a - 3.0).abs() < 2e-6 && (b + 1.0).abs() < 2e-6 && (c + 2.0).abs() < 2e-6);
    }
}
