//! Fitting models to samples by least squares.

mod circular;
mod complex;
mod linear;
mod second_order;

pub(crate) use circular::circular_mean;
pub(crate) use complex::Complex;
pub(crate) use linear::fit;
pub(crate) use second_order::{Order2, Shape, fit_step};
