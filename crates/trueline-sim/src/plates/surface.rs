//! Two plates about a seam, and where the laser sheet cuts them.

use crate::capture::SheetAxes;
use crate::scenario::Scenario;
use nalgebra::{Point3, UnitVector3, Vector3};
use trueline_geometry::{Line, Pose};

/// How a plate is not flat: heights above its plane, m, at 25 mm from the seam and 100 mm along it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlateForm {
    /// Bow across: r².
    pub across: f64,
    /// Twist: r s.
    pub twist: f64,
    /// Bow along: s².
    pub along: f64,
    /// r³, r² s, r s², s³.
    pub cubic: [f64; 4],
}

impl PlateForm {
    /// The form with one term alone, in the order r², rs, s², r³, r²s, rs², s³.
    #[must_use]
    pub fn of_term(term: usize, height_m: f64) -> Self {
        let mut form = Self::default();
        match term {
            0 => form.across = height_m,
            1 => form.twist = height_m,
            2 => form.along = height_m,
            cubic => form.cubic[(cubic - 3).min(3)] = height_m,
        }
        form
    }

    fn height_m(&self, from_seam_m: f64, along_m: f64) -> f64 {
        let (r, s) = (from_seam_m / 0.025, along_m / 0.100);
        let [rrr, rrs, rss, sss] = self.cubic;
        self.across * r.powi(2)
            + self.twist * r * s
            + self.along * s.powi(2)
            + rrr * r.powi(3)
            + rrs * r.powi(2) * s
            + rss * r * s.powi(2)
            + sss * s.powi(3)
    }
}

/// How two plates make a seam.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PlatePair {
    /// They meet in it.
    #[default]
    Meeting,
    /// They are parallel, and the seam is the edge of one; the other is further from the sensor by this, m.
    Lap {
        /// Height of the step, m.
        step_m: f64,
    },
    /// There is one plate alone, and the seam is its edge.
    Edge,
    /// They lie in one plane, or in two that are parallel, and the seam is the middle of the gap between them.
    Butt {
        /// Width of the gap, m.
        gap_m: f64,
        /// By how much the right one lies further from the sensor, m.
        mismatch_m: f64,
    },
}

/// Two plates about the first line of a scenario, and how well their stripes are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plates {
    /// How they make a seam.
    pub pair: PlatePair,
    /// Number of the plate with the seam as its edge, for a lap or one plate: 0 for the left one, 1 for the right
    /// one.
    pub edge_on: usize,
    /// Angle between plates that meet, rad.
    pub opening_rad: f64,
    /// How far the pair is turned about the seam, rad.
    pub roll_rad: f64,
    /// Measured range of each plate, from the seam, m.
    pub reach_m: [f64; 2],
    /// How they are not flat.
    pub forms: [PlateForm; 2],
    /// Roughness, one standard deviation: of each support point, or each point of a profile, m.
    pub roughness_m: f64,
    /// Standard deviation of the stripe in one column of a picture, px.
    pub column_sigma_px: f64,
    /// Columns that a grain of speckle makes alike.
    pub alike_px: f64,
    /// Standard deviation of an edge along its stripe, px.
    pub edge_sigma_px: f64,
}

impl Default for Plates {
    /// A fillet of 90° with 25 mm of each plate visible; columns and edges with 0.5 px, grains of 1.75 px.
    fn default() -> Self {
        Self {
            pair: PlatePair::Meeting,
            edge_on: 0,
            opening_rad: std::f64::consts::FRAC_PI_2,
            roll_rad: 0.0,
            reach_m: [0.002, 0.025],
            forms: [PlateForm::default(); 2],
            roughness_m: 0.0,
            column_sigma_px: 0.5,
            alike_px: 1.75,
            edge_sigma_px: 0.5,
        }
    }
}

/// One plate in base.
pub(super) struct PlateInBase {
    centre: Vector3<f64>,
    along: Vector3<f64>,
    outward: Vector3<f64>,
    /// Unit normal.
    pub normal: Vector3<f64>,
    form: PlateForm,
}

/// Rounds of the search for the cut: each gains the surface's slope, a thousandth.
const CUT_ROUNDS: usize = 8;

impl PlateInBase {
    /// Both plates of a scenario, the left one first as a sensor along the approach sees them; `None` without a line.
    pub(super) fn both(scenario: &Scenario, plates: &Plates) -> Option<[Self; 2]> {
        Some(Self::about(scenario.cell.lines.first()?, &scenario.cell.approach, plates))
    }

    /// Both plates of a seam seen from `approach`, likewise.
    pub(super) fn about(seam: &Line, approach: &UnitVector3<f64>, plates: &Plates) -> [Self; 2] {
        let along = seam.direction();
        let away = (approach.into_inner() - along * along.dot(approach)).normalize();
        // As the scan's motion has it: the stripe runs along this.
        let across = along.cross(&away);
        let flat = std::f64::consts::PI;
        let (opening_rad, lower_m, gap_m) = match plates.pair {
            PlatePair::Meeting => (plates.opening_rad, 0.0, 0.0),
            PlatePair::Lap { step_m } => (flat, step_m, 0.0),
            PlatePair::Edge => (flat, 0.0, 0.0),
            PlatePair::Butt { gap_m, .. } => (flat, 0.0, gap_m),
        };
        let half_mismatch_m = match plates.pair {
            PlatePair::Butt { mismatch_m, .. } => 0.5 * mismatch_m,
            _ => 0.0,
        };
        [(-1.0, 0), (1.0, 1)].map(|(side, number)| {
            let angle = side * 0.5 * opening_rad + plates.roll_rad;
            let outward = across * angle.sin() - away * angle.cos();
            let form = plates.forms[number];
            let normal = along.cross(&outward);
            // Plate 1 faces the sensor with its normal, plate 0 turns its back on it.
            let step_m = if number == plates.edge_on { 0.0 } else { lower_m } + side * half_mismatch_m;
            let centre = seam.anchor() - normal * (side * step_m) + outward * (0.5 * gap_m);
            Self { centre, along, outward, normal, form }
        })
    }

    /// The point of the surface at a distance from the seam that the sheet cuts, base, m.
    pub(super) fn cut(
        &self,
        sheet: &SheetAxes,
        base_from_camera: &Pose,
        from_seam_m: f64,
    ) -> Option<Vector3<f64>> {
        let normal = base_from_camera * sheet.normal;
        let on_sheet = (base_from_camera * Point3::from(sheet.middle)).coords;
        let toward = normal.dot(&self.along);
        if toward.abs() < 1e-3 {
            return None;
        }
        let mut along_m = 0.0;
        let at = |along_m: f64| {
            let height_m = self.form.height_m(from_seam_m, along_m);
            self.centre + self.outward * from_seam_m + self.along * along_m + self.normal * height_m
        };
        for _ in 0..CUT_ROUNDS {
            along_m -= normal.dot(&(at(along_m) - on_sheet)) / toward;
        }
        Some(at(along_m))
    }
}
