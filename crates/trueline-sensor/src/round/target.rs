//! Round targets, as a table with a row for each.
//!
//! | | in a profile | symmetries |
//! |---|---|---|
//! | sphere | a circle: centre and radius | every turn about its centre |
//! | cylinder | the arc of an ellipse: five points of it | turns about its axis, and shifts along it |

use crate::board_hand_eye::unknowns::TARGET;
use nalgebra::{SMatrix, SVector};

/// Maximum number of coordinates of a cut.
pub const ROWS: usize = 5;
/// Coordinates of a cut; those beyond [`Row::rows`] are zero.
pub type Rows = SVector<f64, ROWS>;
/// Their covariance or whitening; the identity beyond [`Row::rows`].
pub type Square = SMatrix<f64, ROWS, ROWS>;

/// The scanned target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RoundTarget {
    /// A sphere about the target's origin.
    #[default]
    Sphere,
    /// A cylinder about the target's y axis.
    Cylinder,
}

/// The properties of a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Its name.
    pub name: &'static str,
    /// Number of coordinates of a cut.
    pub rows: usize,
    /// Pose unknowns of its symmetries, in its own axes: they are held.
    pub held: &'static [usize],
    /// Median squared length of a whitened residual with this number of coordinates.
    pub median_squared: f64,
    /// A cut beyond this squared length is left out: by chance one of 300,000.
    pub outlier_squared: f64,
    /// Largest ratio of the circle through an arc to the target.
    pub larger: f64,
    /// Largest distance of an arc of 120° from its circle, as a fraction of the circle's radius; for a shorter arc it decreases
    /// with the cube of the length.
    pub off_circle: f64,
}

static SPHERE: Row = Row {
    name: "sphere",
    rows: 3,
    held: &[TARGET, TARGET + 1, TARGET + 2],
    median_squared: 2.366,
    outlier_squared: 28.0,
    // A margin for the sensor's scale and the noise.
    larger: 1.03,
    off_circle: 0.0,
};

static CYLINDER: Row = Row {
    name: "cylinder",
    rows: 5,
    held: &[TARGET + 1, TARGET + 4],
    median_squared: 4.351,
    outlier_squared: 33.0,
    // At its flatter side an ellipse cut at 35° has a radius of curvature of 1/cos² 35° radii.
    larger: 1.5,
    // Such an ellipse is off the circle through 120° of it by at most 3.5 %, and by more beyond the ends of the fitted arc.
    off_circle: 0.07,
};

impl RoundTarget {
    /// Its row.
    #[must_use]
    pub fn row(self) -> &'static Row {
        match self {
            Self::Sphere => &SPHERE,
            Self::Cylinder => &CYLINDER,
        }
    }
}
