//! Round targets: a row of the table each.
//!
//! | | an arc is off its prediction by | what the target looks the same under |
//! |---|---|---|
//! | sphere | a polynomial of degree 2 along the arc | every turn about its centre |
//! | cylinder | a polynomial of degree 6 | turns about its axis, and shifts along it |

use crate::board_hand_eye::unknowns::TARGET;
use nalgebra::{SMatrix, SVector};

/// The most numbers that a profile gives.
pub const ROWS: usize = 7;
/// Numbers of a profile; those beyond [`Row::rows`] are zero.
pub type Rows = SVector<f64, ROWS>;
/// Their covariance or whitening; the identity beyond [`Row::rows`].
pub type Square = SMatrix<f64, ROWS, ROWS>;

/// What is scanned.
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
    /// Numbers that a profile gives: coefficients of a polynomial along the arc.
    pub rows: usize,
    /// Unknowns of its pose, in its own axes, under which it looks the same: they are held.
    pub held: &'static [usize],
    /// Median of the squared length of so many whitened numbers.
    pub median_squared: f64,
    /// A cut is left out beyond this squared length: by chance one of 300,000.
    pub outlier_squared: f64,
    /// The circle through an arc is at most so many times as large as the target.
    pub larger: f64,
    /// An arc of 120° is off its circle by up to this part of the circle's radius, a shorter one by the cube of its length less.
    pub off_circle: f64,
}

static SPHERE: Row = Row {
    name: "sphere",
    rows: 3,
    held: &[TARGET, TARGET + 1, TARGET + 2],
    median_squared: 2.366,
    outlier_squared: 28.0,
    // But for the sensor's scale and the noise.
    larger: 1.03,
    off_circle: 0.0,
};

static CYLINDER: Row = Row {
    name: "cylinder",
    // An ellipse cut 35° askew is off its circle by such a polynomial to 4 µm rms, of a radius of 20 mm and an arc of 130 to 160°.
    rows: 7,
    held: &[TARGET + 1, TARGET + 4],
    median_squared: 6.346,
    outlier_squared: 37.8,
    // At its flatter side an ellipse, cut 35° askew, has a radius of curvature of 1/cos² 35° radii.
    larger: 1.5,
    // Such an ellipse is off the circle through 120° of it by 3.5 % at the most, and beyond the ends of what was fitted by more.
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
