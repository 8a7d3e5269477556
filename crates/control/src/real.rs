//! The scalar that the loops are computed in.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub, SubAssign};

/// The outcome of comparing two [`Real`]s: `bool`, or one per lane.
pub trait Mask:
    Copy + Debug + PartialEq + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// The same value in every lane.
    fn splat(value: bool) -> Self;
    /// Whether at least one lane is true.
    fn any(self) -> bool;
}

/// A scalar for control mathematics: `f32`, or a group of them computed side by side.
///
/// Code over `Real` has no branches on values: it computes both sides and [`Real::select`]s.
/// Counts are wrapping 32-bit integers: encoder counts, or angles where 2³² is one turn.
pub trait Real:
    Copy
    + Debug
    + PartialEq
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// What comparisons give.
    type Mask: Mask;
    /// Wrapping 32-bit integer, one per lane.
    type Count: Copy + Debug + PartialEq;

    /// The same value in every lane.
    fn splat(value: f32) -> Self;
    /// `a` where `mask` is true, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// `self < other`; false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`; false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Magnitude.
    fn abs(self) -> Self;
    /// Square root of a non-negative number (0 for a negative one), correctly rounded or within
    /// 1 ulp, the same on every machine.
    fn sqrt(self) -> Self;

    /// The same count in every lane.
    fn count(value: i32) -> Self::Count;
    /// Toward zero, saturating; 0 for NaN.
    fn to_count(self) -> Self::Count;
    /// The nearest representable number.
    fn of_count(count: Self::Count) -> Self;
    /// `a + b`, wrapping.
    fn count_add(a: Self::Count, b: Self::Count) -> Self::Count;
    /// `a - b`, wrapping.
    fn count_sub(a: Self::Count, b: Self::Count) -> Self::Count;
    /// `a * b`, wrapping.
    fn count_mul(a: Self::Count, b: Self::Count) -> Self::Count;
    /// `a` where `mask` is true, else `b`.
    fn count_select(mask: Self::Mask, a: Self::Count, b: Self::Count) -> Self::Count;

    /// The smaller of two numbers; `other` if `self` is NaN.
    #[inline(always)]
    fn least(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }

    /// The greater of two numbers; `other` if `self` is NaN.
    #[inline(always)]
    fn greatest(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }

    /// `self` held between `-limit` and `limit`.
    #[inline(always)]
    fn within(self, limit: Self) -> Self {
        self.least(limit).greatest(-limit)
    }
}

impl Mask for bool {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        value
    }

    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

impl Real for f32 {
    type Mask = bool;
    type Count = i32;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f32::from_bits(self.to_bits() & 0x7FFF_FFFF)
    }

    fn sqrt(self) -> Self {
        // A first guess from halving the exponent, then three Newton steps: within 1 ulp.
        if !(self > 0.0) {
            return 0.0;
        }
        let mut root = f32::from_bits((self.to_bits() >> 1).wrapping_add(0x1FBD_1DF5));
        root = 0.5 * (root + self / root);
        root = 0.5 * (root + self / root);
        0.5 * (root + self / root)
    }

    #[inline(always)]
    fn count(value: i32) -> i32 {
        value
    }

    #[inline(always)]
    fn to_count(self) -> i32 {
        self as i32
    }

    #[inline(always)]
    fn of_count(count: i32) -> Self {
        count as f32
    }

    #[inline(always)]
    fn count_add(a: i32, b: i32) -> i32 {
        a.wrapping_add(b)
    }

    #[inline(always)]
    fn count_sub(a: i32, b: i32) -> i32 {
        a.wrapping_sub(b)
    }

    #[inline(always)]
    fn count_mul(a: i32, b: i32) -> i32 {
        a.wrapping_mul(b)
    }

    #[inline(always)]
    fn count_select(mask: bool, a: i32, b: i32) -> i32 {
        if mask { a } else { b }
    }
}
