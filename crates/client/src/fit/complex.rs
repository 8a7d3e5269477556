//! As much of complex numbers as a rotating field needs.

use std::ops::{Add, Div, Mul, Sub};

/// A complex number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Complex {
    pub(crate) re: f64,
    pub(crate) im: f64,
}

impl Complex {
    pub(crate) const fn new(re: f64, im: f64) -> Complex {
        Complex { re, im }
    }

    /// e^(x + jy)
    pub(crate) fn exp(x: f64, y: f64) -> Complex {
        let (sine, cosine) = y.sin_cos();
        Complex::new(x.exp() * cosine, x.exp() * sine)
    }

    /// rad
    pub(crate) fn angle(self) -> f64 {
        self.im.atan2(self.re)
    }
}

impl Add for Complex {
    type Output = Complex;

    fn add(self, other: Complex) -> Complex {
        Complex::new(self.re + other.re, self.im + other.im)
    }
}

impl Sub for Complex {
    type Output = Complex;

    fn sub(self, other: Complex) -> Complex {
        Complex::new(self.re - other.re, self.im - other.im)
    }
}

impl Mul for Complex {
    type Output = Complex;

    fn mul(self, other: Complex) -> Complex {
        Complex::new(
            self.re * other.re - self.im * other.im,
            self.re * other.im + self.im * other.re,
        )
    }
}

impl Mul<f64> for Complex {
    type Output = Complex;

    fn mul(self, factor: f64) -> Complex {
        Complex::new(self.re * factor, self.im * factor)
    }
}

impl Div for Complex {
    type Output = Complex;

    fn div(self, other: Complex) -> Complex {
        let square = other.re * other.re + other.im * other.im;
        self * Complex::new(other.re, -other.im) * square.recip()
    }
}

#[cfg(test)]
mod tests {
    use super::Complex;

    #[test]
    fn division_undoes_multiplication_and_angles_add() {
        let (a, b) = (Complex::exp(0.3, 1.1), Complex::exp(-0.7, 0.4));
        let back = a * b / b;
        assert!((back.re - a.re).abs() < 1e-12 && (back.im - a.im).abs() < 1e-12);
        assert!(((a * b).angle() - 1.5).abs() < 1e-12);
    }
}
