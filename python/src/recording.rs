//! A recorded scan.

use crate::calibration::Calibration;
use crate::failure::Failure;
use crate::interruptible;
use crate::options::Options;
use crate::rows::{self, Extras};
use nalgebra::Matrix4;
use numpy::ndarray::{Array2, Array3};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use trueline::{Guess, Measured, Pose};
use trueline_dataset::{SensorFile, calibration_file, folder, sensor_toml};
use trueline_method::diagnose::doctor;
use trueline_method::evaluate::evaluation::evaluate;
use trueline_method::evaluate::reference_curve::Form;
use trueline_report::{diagnosis, evaluated};
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

/// Time offsets of random cells lie within this, s: as those of `trueline simulate --random-cell`.
const RANDOM_OFFSET_S: f64 = 1.0;

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

/// A first guess: time offset in s and tool_from_camera.
type GuessArrays<'py> = (f64, PyReadonlyArray2<'py, f64>);

#[pymethods]
impl Recording {
    /// Opens a folder, an .mcap or a bag.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let title = path.display().to_string();
        let inner = interruptible::run(py, move || Ok(trueline::Recording::open(path)?))?;
        Ok(Self { inner: Arc::new(inner), title })
    }

    /// A recording from arrays; the sensor as the text of a sensor.toml.
    #[staticmethod]
    fn from_arrays(
        sensor_toml: &str,
        arrays: Arrays<'_>,
        line: Option<PyReadonlyArray1<'_, i64>>,
        sigma: Option<PyReadonlyArray2<'_, f64>>,
        guess: Option<GuessArrays<'_>>,
    ) -> PyResult<Self> {
        let SensorFile { sensor, setup } =
            sensor_toml::parse_file(Path::new("sensor"), sensor_toml).map_err(Failure::from)?;
        let (robot_ns, base_from_tool, feature_ns, points) = &arrays;
        let poses = rows::poses(robot_ns.as_array(), base_from_tool.as_array())?;
        let extras = Extras {
            line: line.as_ref().map(|line| line.as_array()),
            sigma: sigma.as_ref().map(|sigma| sigma.as_array()),
        };
        let features = rows::features(&sensor, feature_ns.as_array(), points.as_array(), extras)?;
        let data = trueline_dataset::Recording {
            sensor,
            setup,
            robot: poses,
            features,
            stripes: Vec::new(),
            initial: guess.map(|(time_offset_s, pose)| guess_of(time_offset_s, &pose)).transpose()?,
            truth: None,
            inputs: std::collections::BTreeMap::new(),
        };
        Ok(Self { inner: Arc::new(data.into()), title: "arrays".into() })
    }

    /// A simulated scan of a preset; with `random_cell` the time offset, the hand-eye transform and the seam are drawn anew.
    #[staticmethod]
    fn simulate(py: Python<'_>, preset: &str, seed: u64, random_cell: bool) -> PyResult<Self> {
        let known = PRESETS.iter().find(|known| known.name() == preset).copied();
        let preset = known.ok_or_else(|| {
            let names: Vec<_> = PRESETS.iter().map(|preset| preset.name()).collect();
            Failure::new(
                format!("there is no preset {preset:?}"),
                format!("the presets are {}", names.join(", ")),
            )
        })?;
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
        let config = options.config()?;
        let guess = guess.map(|(time_offset_s, pose)| guess_of(time_offset_s, &pose)).transpose()?;
        let recording = Arc::clone(&self.inner);
        let calibration = interruptible::run(py, move || {
            let guessed = guess.map(|guess| (*recording).clone().with_guess(guess));
            let recording = guessed.as_ref().unwrap_or(&recording);
            Ok(recording.calibrate_with(&config)?)
        })?;
        Ok(Calibration::new(calibration, Arc::clone(&self.inner), self.title.clone()))
    }

    /// Distances of the seam points by the calibration in a result file from the best line; JSON.
    fn evaluate(&self, py: Python<'_>, calibration: PathBuf) -> PyResult<String> {
        let recording = Arc::clone(&self.inner);
        interruptible::run(py, move || {
            let known = calibration_file::read(&calibration)?.known;
            let evaluation = evaluate(&recording, &known.parameters, None, Form::Auto)
                .map_err(|error| Failure::from(trueline::Error::from(error)))?;
            Ok(format!("{:#}", evaluated::json(&evaluation, None, None)))
        })
    }

    /// What is wrong with the recording; JSON.
    fn doctor(&self, py: Python<'_>, options: Options) -> PyResult<String> {
        let config = options.config()?;
        let recording = Arc::clone(&self.inner);
        interruptible::run(py, move || {
            let found = doctor::diagnose(&recording, &config, |_| ());
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
        let matrices: Vec<_> = self.inner.robot.iter().map(|sample| matrix(&sample.base_from_tool)).collect();
        Array3::from_shape_fn((matrices.len(), 4, 4), |(n, row, column)| matrices[n][(row, column)])
            .into_pyarray(py)
    }

    /// Stamps of the features, ns.
    fn feature_stamps_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.inner.features.iter().map(|feature| feature.stamp_ns).collect::<Vec<_>>().into_pyarray(py)
    }

    /// The features: px, or m.
    fn points<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let features = &self.inner.features;
        let columns = features.first().map_or(2, |feature| numbers(&feature.measured).len());
        Array2::from_shape_fn((features.len(), columns), |(row, column)| {
            numbers(&features[row].measured)[column]
        })
        .into_pyarray(py)
    }

    /// Which line each feature lies on.
    fn lines<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.inner.features.iter().map(|feature| i64::from(feature.line)).collect::<Vec<_>>().into_pyarray(py)
    }

    /// Time offset (s) and tool_from_camera (m) of the simulation, if it is one.
    fn truth<'py>(&self, py: Python<'py>) -> Option<(f64, Bound<'py, PyArray2<f64>>)> {
        let truth = &self.inner.truth.as_ref()?.parameters;
        let matrix = matrix(&truth.tool_from_camera);
        let array = Array2::from_shape_fn((4, 4), |(row, column)| matrix[(row, column)]);
        Some((truth.time_offset_s, array.into_pyarray(py)))
    }

    /// The sensor as the text of a sensor.toml.
    fn sensor_toml(&self) -> String {
        sensor_toml::format_file(&SensorFile {
            sensor: self.inner.sensor.clone(),
            setup: self.inner.setup.clone(),
        })
    }

    /// What is worth knowing of the file.
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
    Ok(Guess { time_offset_s, tool_from_camera: rows::pose(tool_from_camera.as_array()).map_err(wrong)? })
}

fn matrix(pose: &Pose) -> Matrix4<f64> {
    pose.to_homogeneous()
}

fn numbers(measured: &Measured) -> &[f64] {
    match measured {
        Measured::Pixel(numbers) | Measured::Profile(numbers) => numbers,
        Measured::Point(numbers) => numbers,
    }
}
