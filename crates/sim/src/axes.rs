//! A list with as many members as a drive has axes, for drives of any number.

use std::fmt::Debug;

use drive::{Body, List, ParameterError};

/// The body of a virtual drive.
#[derive(Clone, Copy, Debug)]
pub struct Virtual;

impl Body for Virtual {
    type List<T: Clone + Debug> = Axes<T>;
}

/// Something for each axis.
#[derive(Clone, Debug)]
pub struct Axes<T>(Box<[T]>);

impl<T> AsRef<[T]> for Axes<T> {
    fn as_ref(&self) -> &[T] {
        &self.0
    }
}

impl<T> AsMut<[T]> for Axes<T> {
    fn as_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl<T: Clone + Debug> List<T> for Axes<T> {
    fn build(
        count: usize,
        make: impl FnMut(usize) -> Result<T, ParameterError>,
    ) -> Result<Axes<T>, ParameterError> {
        if count == 0 {
            return Err(ParameterError::Axes(0));
        }
        (0..count).map(make).collect::<Result<_, _>>().map(Axes)
    }

    fn first(&self) -> &T {
        &self.0[0]
    }
}
