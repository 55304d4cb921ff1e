//! A recorded scan.

use crate::calibration::{Calibration, Made};
use crate::columns::{self, FeatureErrors};
use crate::failure::Failure;
use crate::interruptible;
use crate::named::choice;
use crate::options::Options;
use crate::pictures::joint_of;
use crate::rows::{self, Extras, FARTHEST_SEEN_M};
use numpy::ndarray::Array3;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use trueline::Guess;
use trueline::open::How;
use trueline_dataset::{SensorFile, folder, join, sensor_toml};
use trueline_method::diagnose::{clock_alignment, doctor};
use trueline_method::stripe::corners::with_corners;
use trueline_report::diagnosis;
use trueline_sim::Preset;

const PRESETS: [Preset; 8] = [
    Preset::Paper,
    Preset::Quick,
    Preset::Good,
    Preset::Weak,
    Preset::TwoLines,
    Preset::Profiler,
    Preset::ConstantAttitude,
    Preset::AlongLine,
];

/// Time offsets of random cells lie within this, s, as with `trueline simulate --random-cell`.
const RANDOM_OFFSET_S: f64 = 1.0;

/// The doctor begins no trial later, as on the command line.
const DOCTOR_LONGEST: Duration = Duration::from_secs(12);

/// A recorded scan; it does not change.
#[pyclass(frozen, module = "trueline._trueline")]
pub struct Recording {
    inner: Arc<trueline::Recording>,
    title: String,
}

/// Robot stamps and poses, feature stamps and points, as keywords of the Python layer.
type Arrays<'py> = (
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray3<'py, f64>,
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray2<'py, f64>,
);

/// Line numbers, frame counters, standard deviations of the features and the correlations of their errors.
type ExtraArrays<'py> = (
    Option<PyReadonlyArray1<'py, i64>>,
    Option<PyReadonlyArray1<'py, i64>>,
    Option<PyReadonlyArray2<'py, f64>>,
    Option<PyReadonlyArray1<'py, f64>>,
);

/// Stamps, plates, the two support points and the standard deviations of stripes.
type StripeArrays<'py> = (
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray1<'py, i64>,
    PyReadonlyArray3<'py, f64>,
    PyReadonlyArray1<'py, f64>,
);

/// A first guess: time offset in s and tool_from_camera.
type GuessArrays<'py> = (f64, PyReadonlyArray2<'py, f64>);

#[pymethods]
impl Recording {
    /// Opens a folder, an .mcap or a bag; the joint is stated, or found in the pictures.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf, joint: Option<&str>) -> PyResult<Self> {
        let title = path.display().to_string();
        let how = How { joint: joint.map(joint_of).transpose()?, ..How::default() };
        let inner = interruptible::run(py, move || Ok(trueline::Recording::open_how(path, &how)?))?;
        Ok(Self { inner: Arc::new(inner), title })
    }

    /// A recording from arrays; the sensor as the text of a sensor.toml.
    #[staticmethod]
    fn from_arrays(
        sensor_toml: &str,
        arrays: Arrays<'_>,
        extras: ExtraArrays<'_>,
        stripes: Option<StripeArrays<'_>>,
        guess: Option<GuessArrays<'_>>,
    ) -> PyResult<Self> {
        let file = Path::new("sensor");
        let SensorFile { sensor, setup } =
            sensor_toml::parse_file(file, sensor_toml).map_err(Failure::from)?;
        folder::refuse_what_is_not_applied(file, &setup).map_err(Failure::from)?;
        let (robot_ns, base_from_tool, feature_ns, points) = &arrays;
        let (line, frame, sigma, correlation) = &extras;
        let poses = rows::poses(robot_ns.as_array(), base_from_tool.as_array())?;
        let extras = Extras {
            line: line.as_ref().map(|line| line.as_array()),
            frame: frame.as_ref().map(|frame| frame.as_array()),
            sigma: sigma.as_ref().map(|sigma| sigma.as_array()),
            correlation: correlation.as_ref().map(|correlation| correlation.as_array()),
        };
        let features = rows::features(&sensor, feature_ns.as_array(), points.as_array(), extras)?;
        let stripes = match &stripes {
            None => Vec::new(),
            Some((stamps_ns, plate, points, sigma)) => rows::stripes(
                &sensor,
                (stamps_ns.as_array(), plate.as_array()),
                points.as_array(),
                sigma.as_array(),
            )?,
        };
        let data = trueline_dataset::Recording {
            stripes,
            initial: guess.map(|(time_offset_s, pose)| guess_of(time_offset_s, &pose)).transpose()?,
            ..trueline_dataset::Recording::new(sensor, setup, poses, features)
        };
        let data = with_corners(&data).unwrap_or(data);
        Ok(Self { inner: Arc::new(data.into()), title: "arrays".into() })
    }

    /// Several scans of one sensor as one, each with its own lines.
    #[staticmethod]
    fn join(scans: Vec<PyRef<'_, Recording>>) -> PyResult<Self> {
        let titles: Vec<&str> = scans.iter().map(|scan| scan.title.as_str()).collect();
        let joined = join::join(scans.iter().map(|scan| (**scan.inner).clone()).collect());
        let joined = joined.map_err(|error| {
            Failure::new(
                error.to_string(),
                "scans of different sensors, or set-ups, are calibrated one by one",
            )
        })?;
        Ok(Self { inner: Arc::new(joined.recording.into()), title: titles.join(", ") })
    }

    /// A simulated scan of a preset; with `random_cell` the time offset, the hand-eye transform and the seam are drawn anew.
    #[staticmethod]
    fn simulate(py: Python<'_>, preset: &str, seed: u64, random_cell: bool) -> PyResult<Self> {
        let preset = choice("preset", preset, &PRESETS.map(|known| (known.name(), known)))?;
        let mut scenario = preset.scenario();
        if random_cell {
            scenario = trueline_sim::random_cell(&scenario, seed, RANDOM_OFFSET_S);
        }
        let inner = interruptible::run(py, move || {
            trueline_sim::simulate(&scenario, seed)
                .ok_or_else(|| Failure::new("the sensor never sees the seam", "try another preset"))
        })?;
        Ok(Self {
            inner: Arc::new(inner.into()),
            title: format!("{} (simulated, seed {seed})", preset.name()),
        })
    }

    /// Calibrates from a guess, else from the recording's own, else from nothing.
    fn calibrate(
        &self,
        py: Python<'_>,
        options: Options,
        guess: Option<GuessArrays<'_>>,
    ) -> PyResult<Calibration> {
        let align_clocks = options.align_clocks();
        let config = options.config()?;
        let guess = guess.map(|(time_offset_s, pose)| guess_of(time_offset_s, &pose)).transpose()?;
        let recorded = Arc::clone(&self.inner);
        let made = interruptible::run(py, move || {
            let mut recording = recorded;
            if align_clocks {
                let found = clock_alignment::align(&recording, &config, |_| ())
                    .map_err(|error| Failure::new(error.to_string(), error.hint()))?;
                recording = Arc::new(clock_alignment::aligned(&recording, found.images_ahead_ns).into());
            }
            if let Some(guess) = guess {
                recording = Arc::new((*recording).clone().with_guess(guess));
            }
            let began = Instant::now();
            let inner = recording.calibrate_with(&config)?;
            Ok((Made { inner, took: began.elapsed() }, recording))
        });
        let (made, recording) = made?;
        Ok(Calibration::new(made, recording, self.title.clone()))
    }

    /// Fault of the recording; JSON.
    fn doctor(&self, py: Python<'_>, options: Options) -> PyResult<String> {
        let config = options.config()?;
        let recording = Arc::clone(&self.inner);
        interruptible::run(py, move || {
            let found = doctor::diagnose(&recording, &config, Some(DOCTOR_LONGEST), |_| ());
            Ok(format!("{:#}", diagnosis::json(&found)))
        })
    }

    /// Writes a dataset folder.
    fn write(&self, py: Python<'_>, out: PathBuf) -> PyResult<()> {
        let recording = Arc::clone(&self.inner);
        interruptible::run(py, move || Ok(folder::write(&out, &recording)?))
    }

    /// Stamps of the robot's poses, ns.
    fn robot_stamps_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.inner.robot.iter().map(|sample| sample.stamp_ns).collect::<Vec<_>>().into_pyarray(py)
    }

    /// The robot's poses, m.
    fn base_from_tool<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
        let matrices: Vec<_> =
            self.inner.robot.iter().map(|sample| sample.base_from_tool.to_homogeneous()).collect();
        Array3::from_shape_fn((matrices.len(), 4, 4), |(n, row, column)| matrices[n][(row, column)])
            .into_pyarray(py)
    }

    /// Stamps of the features, ns.
    fn feature_stamps_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.inner.features.iter().map(|feature| feature.stamp_ns).collect::<Vec<_>>().into_pyarray(py)
    }

    /// The features: px, or m.
    fn points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        columns::points(py, self.inner.features.iter().map(|feature| &feature.measured))
    }

    /// Which line each feature lies on.
    fn lines<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.inner.features.iter().map(|feature| i64::from(feature.line)).collect::<Vec<_>>().into_pyarray(py)
    }

    /// Standard deviations of the features (px, or m), NaN if unknown, and the correlations of their errors.
    fn feature_errors<'py>(&self, py: Python<'py>) -> FeatureErrors<'py> {
        columns::errors(py, &self.inner.features)
    }

    /// The stripes: stamps (ns), plates, support points (px, or m) and their standard deviations.
    fn stripes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        columns::stripes(py, &self.inner.stripes)
    }

    /// Time offset (s) and tool_from_camera (m) of the simulation, if it is one.
    fn truth<'py>(&self, py: Python<'py>) -> Option<(f64, Bound<'py, PyArray2<f64>>)> {
        let truth = &self.inner.truth.as_ref()?.parameters;
        Some((truth.time_offset_s, columns::pose(py, &truth.tool_from_camera)))
    }

    /// The sensor as the text of a sensor.toml.
    fn sensor_toml(&self) -> String {
        sensor_toml::format_file(&SensorFile {
            sensor: self.inner.sensor.clone(),
            setup: self.inner.setup.clone(),
        })
    }

    /// Remarks about the file.
    fn notes(&self) -> Vec<String> {
        self.inner.notes().to_vec()
    }
}

fn guess_of(time_offset_s: f64, tool_from_camera: &PyReadonlyArray2<'_, f64>) -> Result<Guess, Failure> {
    let wrong = |text: String| {
        Failure::new(format!("guess: {text}"), "a guess is (time offset in s, 4×4 tool_from_camera in m)")
    };
    if tool_from_camera.as_array().shape() != [4, 4] || !time_offset_s.is_finite() {
        return Err(wrong("expected a finite time offset and a 4×4 matrix".into()));
    }
    let tool_from_camera = rows::pose(tool_from_camera.as_array(), FARTHEST_SEEN_M).map_err(wrong)?;
    Ok(Guess { time_offset_s, tool_from_camera })
}
