//! Four drives side by side: a scalar of four lanes. Shared by the tests of `control` and `plant`.

use std::array::from_fn;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

use control::{Mask, Real};

/// Lanes of a group.
pub(crate) const N: usize = 4;

/// Four numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lanes(pub(crate) [f32; N]);

/// Four answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Masks(pub(crate) [bool; N]);

impl BitAnd for Masks {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self(from_fn(|i| self.0[i] & other.0[i]))
    }
}

impl BitOr for Masks {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(from_fn(|i| self.0[i] | other.0[i]))
    }
}

impl Not for Masks {
    type Output = Self;
    fn not(self) -> Self {
        Self(self.0.map(|lane| !lane))
    }
}

impl Mask for Masks {
    fn splat(value: bool) -> Self {
        Self([value; N])
    }
    fn any(self) -> bool {
        self.0.contains(&true)
    }
}

macro_rules! lanewise {
    ($($trait:ident $method:ident $operator:tt),*) => {$(
        impl $trait for Lanes {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self(from_fn(|i| self.0[i] $operator other.0[i]))
            }
        }
    )*};
}
lanewise!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for Lanes {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(|lane| -lane))
    }
}

impl AddAssign for Lanes {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Lanes {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl Real for Lanes {
    type Mask = Masks;
    type Count = [i32; N];

    fn splat(value: f32) -> Self {
        Self([value; N])
    }
    fn select(mask: Masks, a: Self, b: Self) -> Self {
        Self(from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
    fn lt(self, other: Self) -> Masks {
        Masks(from_fn(|i| self.0[i] < other.0[i]))
    }
    fn le(self, other: Self) -> Masks {
        Masks(from_fn(|i| self.0[i] <= other.0[i]))
    }
    fn abs(self) -> Self {
        Self(self.0.map(Real::abs))
    }
    fn sqrt(self) -> Self {
        Self(self.0.map(Real::sqrt))
    }
    fn count(value: i32) -> [i32; N] {
        [value; N]
    }
    fn to_count(self) -> [i32; N] {
        self.0.map(Real::to_count)
    }
    fn of_count(count: [i32; N]) -> Self {
        Self(count.map(f32::of_count))
    }
    fn count_add(a: [i32; N], b: [i32; N]) -> [i32; N] {
        from_fn(|i| a[i].wrapping_add(b[i]))
    }
    fn count_sub(a: [i32; N], b: [i32; N]) -> [i32; N] {
        from_fn(|i| a[i].wrapping_sub(b[i]))
    }
    fn count_mul(a: [i32; N], b: [i32; N]) -> [i32; N] {
        from_fn(|i| a[i].wrapping_mul(b[i]))
    }
    fn count_shift_right(count: [i32; N], bits: u32) -> [i32; N] {
        count.map(|lane| f32::count_shift_right(lane, bits))
    }
    fn count_select(mask: Masks, a: [i32; N], b: [i32; N]) -> [i32; N] {
        from_fn(|i| if mask.0[i] { a[i] } else { b[i] })
    }
}
