//! Poses, features and stripes as arrays.

use numpy::ndarray::{Array2, Array3};
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use trueline::{Feature, Measured, Pose};
use trueline_dataset::PlateStripe;

/// A pose as a 4×4 matrix, m.
pub(crate) fn pose<'py>(py: Python<'py>, pose: &Pose) -> Bound<'py, PyArray2<f64>> {
    let matrix = pose.to_homogeneous();
    Array2::from_shape_fn((4, 4), |place| matrix[place]).into_pyarray(py)
}

/// Points (N, 2) or (N, 3): px, or m.
pub(crate) fn points<'py, 'a>(
    py: Python<'py>,
    points: impl ExactSizeIterator<Item = &'a Measured>,
) -> Bound<'py, PyArray2<f64>> {
    let rows: Vec<&[f64]> = points.map(numbers).collect();
    let width = rows.first().map_or(2, |row| row.len());
    Array2::from_shape_fn((rows.len(), width), |(row, column)| rows[row][column]).into_pyarray(py)
}

/// Standard deviations (N, 2) and correlations (N,).
pub(crate) type FeatureErrors<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

/// The standard deviations of features (px, or m), NaN if unknown, and the correlations of these errors.
pub(crate) fn errors<'py>(py: Python<'py>, features: &[Feature]) -> FeatureErrors<'py> {
    let sigma = Array2::from_shape_fn((features.len(), 2), |(row, axis)| {
        features[row].sigma.map_or(f64::NAN, |sigma| sigma[axis])
    });
    let correlation: Vec<f64> = features.iter().map(|feature| feature.correlation).collect();
    (sigma.into_pyarray(py), correlation.into_pyarray(py))
}

/// Stamps (ns), plates, support points (px, or m) and their standard deviations.
pub(crate) fn stripes<'py>(py: Python<'py>, stripes: &[PlateStripe]) -> PyResult<Bound<'py, PyDict>> {
    let width = stripes.first().map_or(2, |stripe| numbers(&stripe.points[0]).len());
    let points = Array3::from_shape_fn((stripes.len(), 2, width), |(row, end, column)| {
        numbers(&stripes[row].points[end])[column]
    });
    let out = PyDict::new(py);
    out.set_item("stamp_ns", stripes.iter().map(|s| s.stamp_ns).collect::<Vec<_>>().into_pyarray(py))?;
    out.set_item("plate", stripes.iter().map(|s| i64::from(s.plate)).collect::<Vec<_>>().into_pyarray(py))?;
    out.set_item("points", points.into_pyarray(py))?;
    out.set_item("sigma", stripes.iter().map(|s| s.sigma).collect::<Vec<_>>().into_pyarray(py))?;
    Ok(out)
}

fn numbers(measured: &Measured) -> &[f64] {
    match measured {
        Measured::Pixel(numbers) | Measured::Profile(numbers) => numbers,
        Measured::Point(numbers) => numbers,
    }
}
