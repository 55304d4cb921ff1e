//! Pictures as an array → seam points.

use crate::failure::Failure;
use numpy::ndarray::{Array2, ArrayView3, Axis};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::Path;
use trueline_dataset::{Error, FrameStamp, GrayImage, PictureSource, Pixels, sensor_toml};
use trueline_open::OpenError;
use trueline_vision::scan::{ScanError, ScanSeams};
use trueline_vision::{Detector, Joint};

/// A stack of pictures: number, row, column.
#[derive(FromPyObject)]
pub enum Stack<'py> {
    Eight(PyReadonlyArray3<'py, u8>),
    Sixteen(PyReadonlyArray3<'py, u16>),
}

enum Views<'a> {
    Eight(ArrayView3<'a, u8>),
    Sixteen(ArrayView3<'a, u16>),
}

struct Pictures<'a> {
    views: Views<'a>,
    stamps_ns: &'a [i64],
}

impl PictureSource for Pictures<'_> {
    fn count(&self) -> usize {
        self.stamps_ns.len()
    }

    fn stamp(&self, number: usize) -> FrameStamp {
        FrameStamp { stamp_ns: self.stamps_ns[number], frame: number as u64, device_ns: None }
    }

    fn name(&self, number: usize) -> String {
        format!("pictures[{number}]")
    }

    fn read(&self, number: usize, _spare: &mut Vec<u8>) -> Result<GrayImage, Error> {
        let (height, width, pixels) = match &self.views {
            Views::Eight(stack) => {
                let picture = stack.index_axis(Axis(0), number);
                (picture.nrows(), picture.ncols(), Pixels::Eight(picture.iter().copied().collect()))
            }
            Views::Sixteen(stack) => {
                let picture = stack.index_axis(Axis(0), number);
                (picture.nrows(), picture.ncols(), Pixels::Sixteen(picture.iter().copied().collect()))
            }
        };
        Ok(GrayImage { width, height, pixels })
    }
}

/// Finds the seam in pictures; a dictionary with the stamps, pixels and their ± where there is one, and the reasons of the
/// others.
#[pyfunction]
pub fn find_seams<'py>(
    py: Python<'py>,
    sensor_toml: &str,
    pictures: Stack<'py>,
    stamps_ns: PyReadonlyArray1<'py, i64>,
    joint: Option<&str>,
) -> PyResult<Bound<'py, PyDict>> {
    let sensor = sensor_toml::parse(Path::new("sensor"), sensor_toml).map_err(Failure::from)?;
    let detector = Detector::for_sensor(&sensor)
        .ok_or_else(|| Failure::new("only cameras take pictures", "profilers and points have no pixels"))?;
    let joint = joint.map(joint_of).transpose()?;
    let stamps = stamps_ns.as_slice()?;
    let views = match &pictures {
        Stack::Eight(stack) => Views::Eight(stack.as_array()),
        Stack::Sixteen(stack) => Views::Sixteen(stack.as_array()),
    };
    let count = match &views {
        Views::Eight(stack) => stack.len_of(Axis(0)),
        Views::Sixteen(stack) => stack.len_of(Axis(0)),
    };
    if count != stamps.len() {
        let text = format!("{count} pictures, but {} stamps", stamps.len());
        return Err(Failure::new(text, "one stamp for each picture").into());
    }
    let source = Pictures { views, stamps_ns: stamps };
    let found = py.detach(|| trueline_vision::find_seams(&source, &detector, joint, &()));
    columns(
        py,
        &found.map_err(|error: ScanError| Failure::from(trueline::Error::from(OpenError::from(error))))?,
    )
}

fn columns<'py>(py: Python<'py>, seams: &ScanSeams) -> PyResult<Bound<'py, PyDict>> {
    let found: Vec<_> = seams
        .detections()
        .flat_map(|(stamp, found)| found.seams().zip(0_i64..).map(move |(seam, line)| (stamp, seam, line)))
        .collect();
    let pixels = Array2::from_shape_fn((found.len(), 2), |(row, axis)| found[row].1.pixel[axis]);
    let sigma = Array2::from_shape_fn((found.len(), 2), |(row, axis)| {
        found[row].1.covariance_px2[(axis, axis)].sqrt()
    });
    let out = PyDict::new(py);
    out.set_item("joint", seams.joint.name())?;
    out.set_item(
        "stamp_ns",
        found.iter().map(|(stamp, ..)| stamp.stamp_ns).collect::<Vec<_>>().into_pyarray(py),
    )?;
    out.set_item(
        "picture",
        found.iter().map(|(stamp, ..)| stamp.frame as i64).collect::<Vec<_>>().into_pyarray(py),
    )?;
    out.set_item("line", found.iter().map(|(.., line)| *line).collect::<Vec<_>>().into_pyarray(py))?;
    out.set_item("pixels", pixels.into_pyarray(py))?;
    out.set_item("sigma_px", sigma.into_pyarray(py))?;
    let others = seams
        .frames
        .iter()
        .filter_map(|frame| Some((frame.stamp.frame, frame.found.as_ref().err()?.to_string())));
    out.set_item("not_found", others.collect::<Vec<_>>())?;
    Ok(out)
}

fn joint_of(name: &str) -> Result<Joint, Failure> {
    Joint::ALL.into_iter().find(|joint| joint.name() == name).ok_or_else(|| {
        let names: Vec<_> = Joint::ALL.iter().map(|joint| joint.name()).collect();
        Failure::new(format!("there is no joint {name:?}"), format!("one of {}", names.join(", ")))
    })
}
