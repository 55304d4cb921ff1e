//! A seam that is followed.

use crate::failure::Failure;
use crate::rows::{self, FARTHEST_REACHED_M};
use nalgebra::Vector3;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};
use trueline::rt::{SeamPointError, TrackSettings};

/// Keywords of a track; `None` keeps the default.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct SeamTrackSettings {
    half_window_m: Option<f64>,
    longest_extrapolation_m: Option<f64>,
    curvature_per_m: Option<f64>,
    jump_m: Option<f64>,
    points_kept: Option<usize>,
}

/// A track; it may be used by several threads, one after the other.
#[pyclass(frozen, module = "trueline._trueline")]
pub struct SeamTrack {
    inner: Mutex<trueline::rt::SeamTrack>,
}

#[pymethods]
impl SeamTrack {
    /// A track without points.
    #[new]
    fn new(settings: SeamTrackSettings) -> PyResult<Self> {
        let stated = TrackSettings::default();
        let settings = TrackSettings {
            half_window_m: settings.half_window_m.unwrap_or(stated.half_window_m),
            longest_extrapolation_m: settings
                .longest_extrapolation_m
                .unwrap_or(stated.longest_extrapolation_m),
            curvature_per_m: settings.curvature_per_m.unwrap_or(stated.curvature_per_m),
            jump_m: settings.jump_m.unwrap_or(stated.jump_m),
            points_kept: settings.points_kept.unwrap_or(stated.points_kept),
        };
        let inner = trueline::rt::SeamTrack::new(&settings).map_err(|bad| {
            Failure::new(
                format!("{}: is not finite or out of range", bad.name),
                "leave it out for the default",
            )
        })?;
        Ok(Self { inner: Mutex::new(inner) })
    }

    /// Forgets all points.
    fn clear(&self) {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// Way from the first to the last point, m.
    fn length_m(&self) -> f64 {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner).length_m()
    }

    /// Takes a seam point, m; why it is not taken, in words, or `None`.
    fn push(&self, point: [f64; 3], sigma_m: f64) -> PyResult<Option<String>> {
        let pushed =
            self.inner.lock().unwrap_or_else(PoisonError::into_inner).push(&Vector3::from(point), sigma_m);
        match pushed {
            Ok(()) => Ok(None),
            Err(error @ SeamPointError::NotFinite) => Err(Failure::new(
                format!("point: {error}"),
                "three numbers in m, and a ± above zero in m: leave out points that were flagged",
            )
            .into()),
            Err(error) => Ok(Some(error.to_string())),
        }
    }

    /// Target of the torch, or why it is unknown, in words.
    fn ahead<'py>(
        &self,
        py: Python<'py>,
        base_from_torch: PyReadonlyArray2<'py, f64>,
        speed_m_s: f64,
        delay_s: f64,
    ) -> PyResult<(Option<Bound<'py, PyDict>>, Option<String>)> {
        let wrong = |text: String| {
            Failure::new(
                format!("base_from_torch: {text}"),
                "a 4×4 matrix, torch to base, its position in metres",
            )
        };
        let matrix = base_from_torch.as_array();
        if matrix.shape() != [4, 4] {
            return Err(wrong(format!("found the shape {:?}", matrix.shape())).into());
        }
        let pose = rows::pose(matrix, FARTHEST_REACHED_M).map_err(wrong)?;
        let ahead =
            self.inner.lock().unwrap_or_else(PoisonError::into_inner).ahead(&pose, speed_m_s, delay_s);
        let target = match ahead {
            Ok(target) => target,
            Err(error) => return Ok((None, Some(error.to_string()))),
        };
        let out = PyDict::new(py);
        out.set_item("base_from_torch", crate::columns::pose(py, &target.base_from_torch))?;
        out.set_item("along_m", target.along_m)?;
        out.set_item("tangent", <[f64; 3]>::from(target.tangent))?;
        out.set_item("across", <[f64; 3]>::from(target.across))?;
        out.set_item("upward", <[f64; 3]>::from(target.upward))?;
        out.set_item("sigma_m", target.sigma_m)?;
        out.set_item("off_m", target.off_m)?;
        Ok((Some(out), None))
    }
}
