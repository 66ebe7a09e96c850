//! Between numpy and the method.

use god_object::Pose;
use numpy::{AllowTypeChange, PyArray1, PyArrayLike1, PyArrayMethods};
use pyo3::prelude::*;
use taut_scene::{FileError, numbers_of_pose, pose_of_numbers};

use crate::TautError;

/// Seven numbers: an array of floats without a copy, or whatever numpy makes an array of.
pub(crate) type PoseLike<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;

/// The pose `x y z qw qx qy qz`, or an exception that says what is wrong with it.
pub(crate) fn pose_of(numbers: &PoseLike<'_>) -> PyResult<Pose> {
    let view = numbers.as_array();
    let mut seven = [0.0; 7];
    if view.len() != seven.len() {
        return Err(bad(format!(
            "a pose has 7 numbers, x y z qw qx qy qz, but {} were given",
            view.len()
        )));
    }
    seven
        .iter_mut()
        .zip(view)
        .for_each(|(to, from)| *to = *from);
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
