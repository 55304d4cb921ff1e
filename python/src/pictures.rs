//! Pictures as an array → seam points.

use crate::columns;
use crate::failure::Failure;
use crate::interruptible;
use crate::named::choice;
use numpy::ndarray::{Array2, ArrayView3, Axis};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use trueline::open::OpenError;
use trueline_dataset::sensor_setup::RegionOfInterest;
use trueline_dataset::{
    Error, FrameStamp, GrayImage, PictureSource, Pixels, SensorFile, correlation_of, sensor_toml,
};
use trueline_vision::scan::{ExaminedPicture, ScanError, ScanObserver, ScanSeams};
use trueline_vision::{Detector, Joint, PictureRegion, StripeChoice};

/// A stack of pictures: number, row, column.
#[derive(FromPyObject)]
pub(crate) enum Stack<'py> {
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

/// Ends the search when somebody has pressed Ctrl-C.
struct Stop<'a>(&'a AtomicBool);

impl ScanObserver for Stop<'_> {
    fn examined(&self, _picture: &ExaminedPicture<'_>) -> Result<(), ScanError> {
        if self.0.load(Ordering::Relaxed) {
            return Err(ScanError::Observer("interrupted".into()));
        }
        Ok(())
    }
}

/// The joint, which of several places, and the corners of a region, px.
type How = (Option<String>, Option<String>, Option<Vec<[f64; 2]>>);

/// Finds the seam in pictures; returns a dictionary with the stamps, pixels and their ± if found, and the reasons for the
/// others.
#[pyfunction]
pub(crate) fn picture_seams<'py>(
    py: Python<'py>,
    sensor_toml: &str,
    pictures: Stack<'py>,
    stamps_ns: PyReadonlyArray1<'py, i64>,
    how: How,
) -> PyResult<Bound<'py, PyDict>> {
    let (detector, joint) = looking_for(sensor_toml, &how)?;
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
    let stop = AtomicBool::new(false);
    let found = interruptible::borrowing(py, &stop, || {
        let found = trueline_vision::find_seams(&source, &detector, joint, &Stop(&stop));
        found.map_err(|error| Failure::from(trueline::Error::from(OpenError::from(error))))
    })?;
    columns_of(py, &found)
}

fn looking_for(
    sensor_toml: &str,
    (joint, stripe, region): &How,
) -> Result<(Detector, Option<Joint>), Failure> {
    let SensorFile { sensor, setup } = sensor_toml::parse_file(Path::new("sensor"), sensor_toml)?;
    let detector = Detector::for_sensor(&sensor)
        .ok_or_else(|| Failure::new("only cameras take pictures", "profilers and points have no pixels"))?;
    let joint = joint.as_deref().map(joint_of).transpose()?;
    let stripe = stripe
        .as_deref()
        .map(|name| choice("stripe", name, &StripeChoice::ALL.map(|choice| (choice.name(), choice))))
        .transpose()?
        .unwrap_or_default();
    let region = match (region, setup.region_of_interest) {
        (Some(corners), _) => Some(region_of(corners, detector.lens().camera().size)?),
        (None, Some(RegionOfInterest::Pixels { u_px, v_px })) => PictureRegion::rectangle(u_px, v_px),
        _ => None,
    };
    Ok((detector.within(region).choosing(stripe), joint))
}

fn columns_of<'py>(py: Python<'py>, seams: &ScanSeams) -> PyResult<Bound<'py, PyDict>> {
    let found: Vec<_> = seams
        .detections()
        .flat_map(|(stamp, found)| found.seams().zip(0_i64..).map(move |(seam, line)| (stamp, seam, line)))
        .collect();
    let pixels = Array2::from_shape_fn((found.len(), 2), |(row, axis)| found[row].1.pixel[axis]);
    let sigma = Array2::from_shape_fn((found.len(), 2), |(row, axis)| {
        found[row].1.covariance_px2[(axis, axis)].sqrt()
    });
    let correlation: Vec<f64> =
        found.iter().map(|(_, seam, _)| correlation_of(&seam.covariance_px2)).collect();
    let (stamps, frames): (Vec<_>, Vec<_>) =
        found.iter().map(|(stamp, ..)| (stamp.stamp_ns, stamp.frame as i64)).unzip();
    let out = PyDict::new(py);
    out.set_item("joint", seams.joint.name())?;
    out.set_item("stamp_ns", stamps.into_pyarray(py))?;
    out.set_item("frame", frames.into_pyarray(py))?;
    out.set_item("line", found.iter().map(|(.., line)| *line).collect::<Vec<_>>().into_pyarray(py))?;
    out.set_item("points", pixels.into_pyarray(py))?;
    out.set_item("sigma", sigma.into_pyarray(py))?;
    out.set_item("correlation", correlation.into_pyarray(py))?;
    out.set_item("stripes", columns::stripes(py, &seams.stripes())?)?;
    let others = seams
        .frames
        .iter()
        .filter_map(|frame| Some((frame.stamp.frame, frame.found.as_ref().err()?.to_string())));
    out.set_item("not_found", others.collect::<Vec<_>>())?;
    Ok(out)
}

fn region_of(corners: &[[f64; 2]], size: [u32; 2]) -> Result<PictureRegion, Failure> {
    let region = match corners {
        [[u0, v0], [u1, v1]] => PictureRegion::rectangle([*u0, *u1], [*v0, *v1]),
        more => PictureRegion::polygon(more),
    };
    region.filter(|region| region.overlaps(size)).ok_or_else(|| {
        Failure::new(
            format!("region: {corners:?} is not a region of the pictures"),
            "two opposite corners (u, v), upper left first, or three or more corners of a polygon, px",
        )
    })
}

/// A joint by its name.
///
/// # Errors
/// An unknown name.
pub(crate) fn joint_of(name: &str) -> Result<Joint, Failure> {
    choice("joint", name, &Joint::ALL.map(|joint| (joint.name(), joint)))
}
