//! Profiles as an array → seam points and stripes.

use crate::columns;
use crate::failure::Failure;
use crate::interruptible;
use crate::pictures::joint_of;
use crate::rows::{FARTHEST_SEEN_M, not_metres};
use numpy::ndarray::{ArrayView2, Axis};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use trueline::open::OpenError;
use trueline_dataset::{Profile, ProfilePoint};
use trueline_vision::profile::{self, ProfileJoint};

/// Finds the seam in profiles: number, point, (x, z) in m; a point that is not finite did not come back. Without a joint the
/// profiles determine it.
#[pyfunction]
pub(crate) fn profile_seams<'py>(
    py: Python<'py>,
    profiles: PyReadonlyArray3<'py, f64>,
    stamps_ns: PyReadonlyArray1<'py, i64>,
    joint: Option<&str>,
) -> PyResult<Bound<'py, PyDict>> {
    let named = joint.map(named).transpose()?;
    let (stack, stamps) = (profiles.as_array(), stamps_ns.as_array());
    if stack.len_of(Axis(0)) != stamps.len() || stack.len_of(Axis(2)) != 2 {
        return Err(Failure::new(
            format!("profiles: an array of shape {:?} and {} stamps", stack.shape(), stamps.len()),
            "expected (N, K, 2): x and z in metres of K points of N profiles, NaN for no return; and N \
            stamps",
        )
        .into());
    }
    let too_far = stack.indexed_iter().find(|(_, x)| x.is_finite() && x.abs() > FARTHEST_SEEN_M);
    if let Some(((number, point, _), far)) = too_far {
        return Err(not_metres(&format!("profiles[{number}, {point}]"), *far).into());
    }
    let rows: Vec<Profile> = (0_u64..)
        .zip(stack.outer_iter())
        .zip(stamps)
        .map(|((number, points), stamp)| of(number, *stamp, &points))
        .collect();
    let (joint, found, not_found) = interruptible::run(py, move || {
        let profile::ProfileSeams { joint, found, not_found } = profile::seams(&rows, named);
        let not_found: Vec<(usize, String)> =
            not_found.into_iter().map(|(number, reason)| (number, reason.to_string())).collect();
        Ok((joint, found, not_found))
    })?;
    let out = PyDict::new(py);
    let features = &found.features;
    let (sigma, correlation) = columns::errors(py, features);
    let frames = features.iter().filter_map(|feature| Some(feature.frame? as i64));
    out.set_item("joint", joint.seam())?;
    out.set_item("stamp_ns", features.iter().map(|f| f.stamp_ns).collect::<Vec<_>>().into_pyarray(py))?;
    out.set_item("frame", frames.collect::<Vec<_>>().into_pyarray(py))?;
    out.set_item("line", features.iter().map(|f| i64::from(f.line)).collect::<Vec<_>>().into_pyarray(py))?;
    out.set_item("points", columns::points(py, features.iter().map(|feature| &feature.measured)))?;
    out.set_item("sigma", sigma)?;
    out.set_item("correlation", correlation)?;
    out.set_item("stripes", columns::stripes(py, &found.stripes)?)?;
    out.set_item("not_found", not_found)?;
    Ok(out)
}

/// A joint of profiles by its name.
fn named(name: &str) -> Result<ProfileJoint, Failure> {
    let joint = joint_of(name)?;
    ProfileJoint::of(joint).ok_or_else(|| {
        let not_there = OpenError::NotInProfiles(joint);
        Failure::new(not_there.to_string(), not_there.hint())
    })
}

fn of(number: u64, stamp_ns: i64, points: &ArrayView2<'_, f64>) -> Profile {
    let point = |x_m: f64, z_m: f64| {
        (x_m.is_finite() && z_m.is_finite()).then_some(ProfilePoint { x_m, z_m, intensity: None })
    };
    Profile {
        stamp_ns,
        frame: Some(number),
        points: points.outer_iter().filter_map(|row| point(row[0], row[1])).collect(),
    }
}
