//! Result of a scan.

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use std::time::Duration;
use trueline_dataset::{SensorFile, SensorSetup, sensor_toml};
use trueline_method::assess::residuals::FeatureResidual;
use trueline_report::calibration_page::{self, Source};
use trueline_report::page::render::render;
use trueline_report::page::{Block, Columns};

/// A calibration as it was made.
pub struct Made {
    /// The calibration.
    pub inner: trueline::Calibration,
    /// How long the estimate took.
    pub took: Duration,
}

/// A result, and its source.
#[pyclass(frozen, module = "trueline._trueline")]
pub struct Calibration {
    inner: trueline::Calibration,
    took: Duration,
    recording: Arc<trueline::Recording>,
    title: String,
}

impl Calibration {
    /// A result of a recording.
    pub fn new(made: Made, recording: Arc<trueline::Recording>, title: String) -> Self {
        let Made { inner, took } = made;
        Self { inner, took, recording, title }
    }

    /// A result made from the report's inputs.
    fn with_source<T>(&self, of: impl FnOnce(&Source<'_>) -> T) -> T {
        of(&Source {
            calibration: &self.inner,
            recording: &self.recording,
            title: &format!("Calibration of {}", self.title),
            command: "trueline.calibrate(…)",
            probable_cause: None,
            frames: &[],
        })
    }

    fn column<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        value: impl Fn(&FeatureResidual) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        self.inner.findings.fit.features.iter().map(value).collect::<Vec<_>>().into_pyarray(py)
    }

    fn pairs<'py>(
        &self,
        py: Python<'py>,
        value: impl Fn(&FeatureResidual) -> Option<[f64; 2]>,
    ) -> Bound<'py, PyArray2<f64>> {
        let rows: Vec<_> =
            self.inner.findings.fit.features.iter().map(|r| value(r).unwrap_or([f64::NAN; 2])).collect();
        Array2::from_shape_fn((rows.len(), 2), |(row, column)| rows[row][column]).into_pyarray(py)
    }
}

#[pymethods]
impl Calibration {
    /// The result file's text, as written by `trueline calibrate --json`.
    fn json(&self) -> PyResult<String> {
        let file = self.inner.to_file();
        file.to_json().map_err(|error| pyo3::exceptions::PyRuntimeError::new_err(error.to_string()))
    }

    /// The summary in words.
    fn summary(&self) -> String {
        self.inner.to_string()
    }

    /// The report as a page.
    fn report_html(&self) -> String {
        self.with_source(calibration_page::html)
    }

    /// The words and tables of the report: charts, and the library that draws them, are nine tenths of it.
    fn brief_html(&self) -> String {
        let mut page = self.with_source(calibration_page::page);
        for section in &mut page.sections {
            section.blocks.retain(|block| !matches!(block, Block::Chart(_)));
        }
        page.sections.retain(|section| !section.blocks.is_empty());
        page.columns = Columns::default();
        render(&page)
    }

    /// How long the estimate took, s.
    fn took_s(&self) -> f64 {
        self.took.as_secs_f64()
    }

    /// The sensor.toml as the scan corrects it, if it does. Its uncertainty was that of the old one.
    fn corrected_sensor_toml(&self) -> Option<String> {
        let corrected = self.inner.findings.unknowns.corrected.as_ref()?;
        let setup = SensorSetup { uncertainty: None, shape: corrected.shape, ..self.recording.setup.clone() };
        Some(sensor_toml::format_file(&SensorFile { sensor: corrected.sensor.clone(), setup }))
    }

    /// The residuals, a column an array.
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        columns.set_item("row", self.column(py, |r| i64::from(r.row)))?;
        columns.set_item("line", self.column(py, |r| i64::from(r.line)))?;
        columns.set_item("time_s", self.column(py, |r| r.stamp_s))?;
        columns.set_item("normalised", self.column(py, |r| r.normalised))?;
        columns.set_item("weight", self.column(py, |r| r.weight))?;
        columns.set_item("offset_m", self.pairs(py, |r| Some(r.offset_m.into())))?;
        columns.set_item("residual_px", self.pairs(py, |r| r.residual_px.map(Into::into)))?;
        let points: Vec<[f64; 3]> =
            self.inner.findings.fit.features.iter().map(|r| r.point_in_base.into()).collect();
        let points = Array2::from_shape_fn((points.len(), 3), |(row, column)| points[row][column]);
        columns.set_item("point_in_base_m", points.into_pyarray(py))?;
        Ok(columns)
    }
}
