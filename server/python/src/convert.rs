//! Between numpy and the method.

use god_object::Pose;
use numpy::{AllowTypeChange, PyArray1, PyArrayLikeDyn, PyArrayMethods};
use pyo3::prelude::*;
use taut_scene::{FileError, numbers_of_pose, pose_of_numbers};

use crate::TautError;

/// A row of numbers: an array of floats without a copy, or whatever numpy makes an array of. It may have any shape, so that another than a row is
/// refused in words.
pub(crate) type VectorLike<'py> = PyArrayLikeDyn<'py, f64, AllowTypeChange>;

/// The numbers of a row of `N`, or the shape of what is none.
pub(crate) fn row_of<const N: usize>(numbers: &VectorLike<'_>) -> Result<[f64; N], Vec<usize>> {
    let view = numbers.as_array();
    if view.shape() != [N] {
        return Err(view.shape().to_vec());
    }
    let mut row = [0.0; N];
    row.iter_mut().zip(view).for_each(|(to, from)| *to = *from);
    Ok(row)
}

/// The pose `x y z qw qx qy qz`, or an exception that says what is wrong with it.
pub(crate) fn pose_of(numbers: &VectorLike<'_>) -> PyResult<Pose> {
    let seven = row_of::<7>(numbers).map_err(|shape| {
        bad(format!(
            "a pose is a row of 7 numbers, x y z qw qx qy qz, but the shape of this one is {shape:?}"
        ))
    })?;
    pose_of_numbers(&seven).map_err(bad)
}

pub(crate) fn array_of<'py>(py: Python<'py>, pose: &Pose) -> Bound<'py, PyArray1<f64>> {
    PyArray1::from_slice(py, &numbers_of_pose(pose))
}

pub(crate) fn bad(text: impl Into<String>) -> PyErr {
    TautError::new_err(text.into())
}

pub(crate) fn bad_file(error: FileError) -> PyErr {
    bad(error.to_string())
}

/// `rows` rows of `columns` numbers.
pub(crate) fn table<'py>(
    py: Python<'py>,
    numbers: Vec<f64>,
    columns: usize,
) -> PyResult<Bound<'py, numpy::PyArray2<f64>>> {
    let rows = numbers.len() / columns;
    PyArray1::from_vec(py, numbers).reshape([rows, columns])
}
