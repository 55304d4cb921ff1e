//! A recording of a weld → its evidence, in the chart of its part.

use super::evidence::{Evidence, collected};
use super::pieces::fitted_pieces;
use super::seam_fit::{SeamFit, fitted_seams};
use super::weld_error::WeldError;
use crate::reference::{Part, Reference};
use nalgebra::Vector2;
use trueline_dataset::axes::{AxisRecord, Carries};
use trueline_dataset::{Guess, Recording};
use trueline_geometry::{Line, Pose};
use trueline_method::Config;
use trueline_method::evaluate::placed_features::{PlacedFeatures, place_with_stripes};
use trueline_method::input::timestamps::Dejittered;

/// A weld with its seams fitted by the stored calibration.
#[derive(Clone, Debug)]
pub struct Weld {
    features: PlacedFeatures,
    fits: Vec<SeamFit>,
    base_from_part: Option<Pose>,
}

impl Weld {
    /// Places the features of a recording and fits its seams.
    ///
    /// # Errors
    /// A recording that cannot be used, or a seam without enough features.
    pub fn of(recording: &Recording, reference: &Reference) -> Result<Self, WeldError> {
        Self::of_known(recording, reference, &[])
    }

    /// The same; a curved seam is cut into pieces as that of the part it is one of.
    ///
    /// # Errors
    /// As [`Weld::of`].
    pub fn of_known(recording: &Recording, reference: &Reference, parts: &[Part]) -> Result<Self, WeldError> {
        let mut features = placed(recording, &reference.guess, reference.dejittered)?;
        let fits = match fitted_seams(&features, reference.shape_origin_m) {
            Err(WeldError::Curved { line, off_m }) => {
                fitted_pieces(&mut features, parts, reference.shape_origin_m)
                    .map_err(|_| WeldError::Curved { line, off_m })?
            }
            fits => fits?,
        };
        Ok(Self { features, fits, base_from_part: base_from_part(recording) })
    }

    /// The seams.
    #[must_use]
    pub fn seams(&self) -> Vec<Line> {
        self.fits.iter().map(|fit| fit.seam.line).collect()
    }

    /// Its seam points with where the sensor was.
    #[must_use]
    pub(crate) fn features(&self) -> &PlacedFeatures {
        &self.features
    }

    /// Whether the stamps were treated as in the calibration.
    #[must_use]
    pub(crate) fn stamps_as(&self, wanted: Dejittered) -> bool {
        self.features.dejittered == wanted
    }

    /// Evidence of the weld, with its seams relative to those of its part.
    ///
    /// # Errors
    /// A seam with too few points left.
    pub fn evidence(&self, part: &Part, reference: &Reference) -> Result<Evidence, WeldError> {
        let mut evidence = collected(&self.features, &self.fits, part, reference)?;
        evidence.statistic.base_from_part = self.base_from_part;
        Ok(evidence)
    }
}

/// Where the axes that carry the part had it in the middle of the readings; `None` without such an axis at a known place.
fn base_from_part(recording: &Recording) -> Option<Pose> {
    let middle_ns = recording.features.get(recording.features.len() / 2)?.stamp_ns;
    let carries_part = |axis: &&AxisRecord| axis.carries == Carries::Part && axis.known.is_some();
    let mut axes = recording.axes.iter().filter(carries_part).peekable();
    axes.peek()?;
    axes.try_fold(Pose::identity(), |pose, axis| {
        let at = axis.values.partition_point(|value| value.stamp_ns < middle_ns);
        let value = axis.values.get(at).or(axis.values.last())?.value;
        Some(pose * axis.known.as_ref()?.motion(value))
    })
}

fn placed(recording: &Recording, by: &Guess, dejittered: Dejittered) -> Result<PlacedFeatures, WeldError> {
    Ok(place_with_stripes(recording, by, dejittered, &Config::default())?)
}

/// Origin of the laser plane's shape: the middle of a first weld's points, to a millimetre.
///
/// # Errors
/// A recording that cannot be used.
pub fn shape_origin_m(recording: &Recording, by: &Guess) -> Result<[f64; 2], WeldError> {
    let features = placed(recording, by, Dejittered::default())?;
    let count = features.list.len().max(1) as f64;
    let coordinates = features.list.iter().map(|f| features.sheet.coordinates(&f.point_in_camera));
    let mean: Vector2<f64> = coordinates.sum::<Vector2<f64>>() / count;
    Ok([mean.x, mean.y].map(|x| (x * 1e3).round() * 1e-3))
}
