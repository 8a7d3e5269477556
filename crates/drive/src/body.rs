//! What carries a drive, as far as that shows in its types: how many axes it has memory for.

use core::fmt::Debug;

use crate::ParameterError;

/// A body of the drive core: firmware, or a virtual drive.
///
/// The core allocates nothing. A body says with which list it holds what there is for each axis, so
/// that firmware holds just what its drive has and a simulation any number.
pub trait Body: Clone + Debug {
    /// Something for each axis.
    type List<T: Clone + Debug>: List<T>;
}

/// A list that has as many members as the drive has axes. It never changes its length.
pub trait List<T>: AsRef<[T]> + AsMut<[T]> + Clone + Debug {
    /// A list of `count` members, each made by its number, which begins at 0.
    ///
    /// # Errors
    /// The first error of `make`, or [`ParameterError::Axes`] if this list never has `count` members.
    fn build(
        count: usize,
        make: impl FnMut(usize) -> Result<T, ParameterError>,
    ) -> Result<Self, ParameterError>;

    /// The first member: no drive is without an axis.
    fn first(&self) -> &T;
}

/// The body of a drive with one axis.
#[derive(Clone, Copy, Debug)]
pub struct OneAxis;

impl Body for OneAxis {
    type List<T: Clone + Debug> = [T; 1];
}

impl<T: Clone + Debug> List<T> for [T; 1] {
    #[inline]
    fn build(
        count: usize,
        mut make: impl FnMut(usize) -> Result<T, ParameterError>,
    ) -> Result<[T; 1], ParameterError> {
        match count {
            1 => Ok([make(0)?]),
            _ => Err(ParameterError::Axes(count)),
        }
    }

    #[inline]
    fn first(&self) -> &T {
        let [first] = self;
        first
    }
}
