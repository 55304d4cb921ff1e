//! Points in base while it runs.

use crate::failure::Failure;
use crate::named::choice;
use crate::rows::{self, FARTHEST_REACHED_M};
use nalgebra::{UnitVector3, Vector3};
use numpy::ndarray::ArrayView3;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use trueline::rt::{AxisError, Points, PoseError, Readout, SensorModel, Settings, StampRule};
use trueline::{ResultFile, RunTime};
use trueline_dataset::sensor_toml;
use trueline_geometry::Axis;

const RULES: [(&str, StampRule); 2] =
    [("as-stamped", StampRule::AsStamped), ("lower-envelope", StampRule::LowerEnvelope)];
/// A readout by its step, s.
type OfStep = fn(f64) -> Readout;

const READOUTS: [(&str, OfStep); 4] = [
    ("at-once", |_| Readout::AtOnce),
    ("by-index", Readout::ByIndex),
    ("by-row", Readout::ByRow),
    ("by-column", Readout::ByColumn),
];

/// Keywords of a placer; `None` keeps the default.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct PlacerSettings {
    pose_stamps: Option<String>,
    frame_stamps: Option<String>,
    axis_stamps: Option<String>,
    readout: Option<String>,
    readout_step_s: Option<f64>,
    stamp_sigma_s: Option<f64>,
    half_window_s: Option<f64>,
    longest_prediction_s: Option<f64>,
    acceleration_m_s2: Option<f64>,
    angular_acceleration_rad_s2: Option<f64>,
    fastest_m_s: Option<f64>,
    fastest_rad_s: Option<f64>,
    poses_kept: Option<usize>,
    reading_sigma_m: Option<f64>,
    standing: Vec<String>,
    in_pose: Vec<(String, [f64; 3], [f64; 3])>,
}

impl PlacerSettings {
    fn over(&self, stated: Settings) -> Result<Settings, Failure> {
        let rule = |name: &str, given: &Option<String>, stated| match given {
            Some(given) => choice(name, given, &RULES),
            None => Ok(stated),
        };
        let readout = match &self.readout {
            Some(given) => choice("readout", given, &READOUTS)?(self.readout_step_s.unwrap_or(0.0)),
            None => stated.readout,
        };
        Ok(Settings {
            pose_stamps: rule("pose_stamps", &self.pose_stamps, stated.pose_stamps)?,
            frame_stamps: rule("frame_stamps", &self.frame_stamps, stated.frame_stamps)?,
            axis_stamps: rule("axis_stamps", &self.axis_stamps, stated.axis_stamps)?,
            stamp_sigma_s: self.stamp_sigma_s.unwrap_or(stated.stamp_sigma_s),
            readout,
            half_window_s: self.half_window_s.unwrap_or(stated.half_window_s),
            longest_prediction_s: self.longest_prediction_s.unwrap_or(stated.longest_prediction_s),
            acceleration_m_s2: self.acceleration_m_s2.unwrap_or(stated.acceleration_m_s2),
            angular_acceleration_rad_s2: self
                .angular_acceleration_rad_s2
                .unwrap_or(stated.angular_acceleration_rad_s2),
            fastest_m_s: self.fastest_m_s.unwrap_or(stated.fastest_m_s),
            fastest_rad_s: self.fastest_rad_s.unwrap_or(stated.fastest_rad_s),
            poses_kept: self.poses_kept.unwrap_or(stated.poses_kept),
        })
    }
}

/// A placer; it may be used by several threads, one after the other.
#[pyclass(frozen, module = "trueline._trueline")]
pub struct Placer {
    inner: Mutex<trueline::rt::Placer>,
    sensor: SensorModel,
    axes: Vec<String>,
}

/// Result of `place`: points (N, 3) m, their ± (N,) m, time of the first exposure (ns), time to the last pose (s), and the
/// reason of a refusal, in words.
type PlacedArrays<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>, Option<i64>, Option<f64>, Option<String>);

#[pymethods]
impl Placer {
    /// A placer of a result and of the text of its sensor file.
    #[new]
    fn new(
        result: &str,
        sensor_toml: &str,
        sensor_sha256: Option<&str>,
        settings: PlacerSettings,
    ) -> PyResult<Self> {
        let result = ResultFile::parse(Path::new("result"), result).map_err(Failure::from)?;
        let sensor = sensor_toml::parse_file(Path::new("sensor"), sensor_toml).map_err(Failure::from)?;
        let in_pose = settings.in_pose.iter().map(|(name, direction, point_m)| {
            let kind = result.axes.iter().find(|entry| entry.name == *name).map(|entry| entry.kind.as_str());
            Ok((name.clone(), nominal(name, kind == Some("linear"), *direction, *point_m)?))
        });
        let setup = RunTime {
            sensor: &sensor,
            sensor_sha256,
            reading_sigma_m: settings.reading_sigma_m,
            standing: &settings.standing,
            in_pose: &in_pose.collect::<Result<Vec<_>, Failure>>()?,
        };
        let setup = setup.placer(&result).map_err(Failure::from)?;
        let settings = settings.over(setup.settings)?;
        let inner = trueline::rt::Placer::new(&setup.calibration, &settings).map_err(|bad| {
            Failure::new(
                format!("{}: is not finite or out of range", bad.name),
                "leave it out for the default; see the documentation of the placer for its range",
            )
        })?;
        Ok(Self { inner: Mutex::new(inner), sensor: setup.calibration.sensor, axes: setup.axes })
    }

    /// Names of the external axes.
    fn axes(&self) -> Vec<String> {
        self.axes.clone()
    }

    /// Takes poses, 4×4 in m, in the order of their arrival.
    fn push_poses(
        &self,
        py: Python<'_>,
        stamps_ns: PyReadonlyArray1<'_, i64>,
        base_from_tool: PyReadonlyArray3<'_, f64>,
    ) -> PyResult<()> {
        let (stamps, poses) = (stamps_ns.as_array(), base_from_tool.as_array());
        if poses.shape() != [stamps.len(), 4, 4] {
            return Err(Failure::new(
                format!("base_from_tool: found the shape {:?}", poses.shape()),
                "expected (N, 4, 4) with N stamps, or (4, 4) with one",
            )
            .into());
        }
        Ok(py.detach(|| self.push_all(stamps.iter().copied(), poses))?)
    }

    /// Takes values of an external axis, rad or m, in the order of their arrival.
    fn push_axis(
        &self,
        py: Python<'_>,
        axis: &str,
        stamps_ns: PyReadonlyArray1<'_, i64>,
        values: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<()> {
        let numbers: Vec<(&str, usize)> =
            self.axes.iter().enumerate().map(|(number, name)| (name.as_str(), number)).collect();
        let number = choice("axis", axis, &numbers)?;
        let (stamps, values) = (stamps_ns.as_array(), values.as_array());
        if stamps.len() != values.len() {
            return Err(Failure::new(
                format!("values: {} of them and {} stamps", values.len(), stamps.len()),
                "a value for each stamp",
            )
            .into());
        }
        Ok(py.detach(|| {
            let mut placer = self.lock();
            for (row, (stamp_ns, value)) in stamps.iter().zip(values).enumerate() {
                placer.push_axis(number, *stamp_ns, *value).map_err(|error| of_axis(row, &error))?;
            }
            Ok::<(), Failure>(())
        })?)
    }

    /// Places the points of a frame.
    fn place<'py>(
        &self,
        py: Python<'py>,
        stamp_ns: i64,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<PlacedArrays<'py>> {
        let points = points.as_array();
        let columns = if matches!(self.sensor, SensorModel::Points { .. }) { 3 } else { 2 };
        let numbers = points.as_slice().filter(|_| points.ncols() == columns).ok_or_else(|| {
            Failure::new(
                format!("points: found the shape {:?}", points.shape()),
                format!("expected (N, {columns}) of this sensor"),
            )
        })?;
        let count = points.nrows();
        let (mut base, mut sigma) = (vec![0.0; 3 * count], vec![0.0; count]);
        let placed = py.detach(|| {
            let pairs = numbers.as_chunks::<2>().0;
            let points = match &self.sensor {
                SensorModel::Profiler => Points::Profile(pairs),
                SensorModel::CameraLaser { .. } => Points::Pixels(pairs),
                SensorModel::Points { .. } => Points::Camera(numbers.as_chunks::<3>().0),
            };
            self.lock().place(stamp_ns, points, base.as_chunks_mut::<3>().0, &mut sigma)
        });
        let base = base.into_pyarray(py);
        let base = numpy::PyArrayMethods::reshape(&base, [count, 3])?;
        let (exposed_ns, age_s, refused) = match placed {
            Ok(placed) => (Some(placed.exposed_ns), Some(placed.age_s), None),
            Err(error) => (None, None, Some(error.to_string())),
        };
        Ok((base, sigma.into_pyarray(py), exposed_ns, age_s, refused))
    }

    /// The state of the streams.
    fn health<'py>(&self, py: Python<'py>, now_ns: i64) -> PyResult<Bound<'py, PyDict>> {
        let (health, axes) = {
            let placer = self.lock();
            let axes: Vec<_> = (0..self.axes.len()).map(|axis| placer.axis_health(axis, now_ns)).collect();
            (placer.health(now_ns), axes)
        };
        let out = PyDict::new(py);
        out.set_item("is_settled", health.is_settled)?;
        out.set_item("is_stalled", health.is_stalled)?;
        out.set_item("silent_s", health.silent_s)?;
        out.set_item("pose_period_s", health.pose_period_s)?;
        out.set_item("pose_noise_m", health.pose_noise_m)?;
        out.set_item("pose_noise_rad", health.pose_noise_rad)?;
        out.set_item("poses_late_s", health.usual_late_s[0])?;
        out.set_item("frames_late_s", health.usual_late_s[1])?;
        out.set_item("pose_clock_jumps", health.jumps[0])?;
        out.set_item("frame_clock_jumps", health.jumps[1])?;
        let stalled = self.axes.iter().zip(axes);
        let stalled = stalled.filter(|(_, health)| health.is_none_or(|health| health.is_stalled));
        out.set_item("axes_stalled", stalled.map(|(name, _)| name.clone()).collect::<Vec<_>>())?;
        Ok(out)
    }
}

impl Placer {
    fn lock(&self) -> MutexGuard<'_, trueline::rt::Placer> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn push_all(
        &self,
        stamps_ns: impl Iterator<Item = i64>,
        poses: ArrayView3<'_, f64>,
    ) -> Result<(), Failure> {
        let mut placer = self.lock();
        for (row, (stamp_ns, matrix)) in stamps_ns.zip(poses.outer_iter()).enumerate() {
            let wrong = |text: String| {
                Failure::new(
                    format!("base_from_tool[{row}]: {text}"),
                    "poses are 4×4, tool to base, positions in metres; the poses before this one are taken",
                )
            };
            let pose = rows::pose(matrix, FARTHEST_REACHED_M).map_err(wrong)?;
            placer.push_pose(stamp_ns, &pose).map_err(|error| match error {
                PoseError::ClockWentBack { .. } => wrong(error.to_string()),
                PoseError::NotFinite | PoseError::NotLater { .. } => {
                    wrong(format!("{error}; it is not taken"))
                }
            })?;
        }
        Ok(())
    }
}

fn of_axis(row: usize, error: &AxisError) -> Failure {
    Failure::new(
        format!("values[{row}]: {error}"),
        "angles in rad and ways in m, by rising stamps; the values before this one are taken",
    )
}

/// An axis as the controller has it.
fn nominal(name: &str, is_linear: bool, direction: [f64; 3], point_m: [f64; 3]) -> Result<Axis, Failure> {
    let kind = match is_linear {
        true => trueline_geometry::AxisKind::Linear,
        false => trueline_geometry::AxisKind::Rotary,
    };
    let direction = UnitVector3::try_new(Vector3::from(direction), 1e-9).ok_or_else(|| {
        Failure::new(
            format!("in_pose: {name}: the direction has no length"),
            "(direction, point in m), both in base",
        )
    })?;
    Ok(Axis::new(kind, direction, Vector3::from(point_m)))
}
