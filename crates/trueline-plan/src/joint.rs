//! The plates of a cell that make its seam: two that meet in it, two parallel ones, or one that ends there.
//!
//! | joint | the plates in the cell's file |
//! |---|---|
//! | fillet, V | two normals: each plate reaches from the seam to the free side of the other |
//! | outside corner | two normals, and on which side of the seam each plate lies |
//! | lap, step | two parallel plates, one through the seam and one below it, and on which side each lies |
//! | edge of a plate | one plate, and on which side it lies |
//!
//! Of parallel plates the one that the seam lies on bears the edge, as in [`trueline_method::stripe::target`].

use crate::cell::Cell;
use crate::surroundings::Plate;
use nalgebra::{UnitVector3, Vector3};
use trueline_method::stripe::start::LEAST_ANGLE_SINE;

/// A plate that is further off the ends of the seam does not hold it, m: the seam may have been found elsewhere since it was written down.
const OFF_SEAM_M: f64 = 20e-3;
/// Parallel plates nearer to each other than this lie in one plane, m: it cannot be determined which of them has the
/// edge.
const LEAST_STEP_M: f64 = 0.1e-3;

/// The plates of the seam, and how they end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// The plates; the second is missing if [`Joint::seen`] states it, and then repeats the first.
    pub plates: [JointPlate; 2],
    /// Whether there is each of them.
    pub seen: [bool; 2],
    /// Number of the plate with the seam as its edge; `None` if the plates meet.
    pub edge_on: Option<usize>,
}

/// A plate of the seam, in base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointPlate {
    /// Into the free side.
    pub normal: UnitVector3<f64>,
    /// In the plate, square to the seam, away from it.
    pub outward: UnitVector3<f64>,
    /// How far it lies above the seam along its normal, m: negative for the lower plate of a lap.
    pub above_m: f64,
}

/// Why the plates of a cell's file make no joint.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoJoint {
    /// None are named, or more than two.
    #[error("the cell's file does not define the two plates of the seam")]
    Unnamed,
    /// Parallel plates, or a single one, on an unstated side of the seam.
    #[error("a single or parallel plate ends in the seam, but the cell's file does not state its side")]
    NoSide,
    /// Plates that meet, with only one side stated.
    #[error("only one of the two plates of the seam states its side")]
    OneSide,
    /// Parallel plates on one side of the seam.
    #[error("the two parallel plates lie on the same side of the seam")]
    SameSide,
    /// Parallel plates without a step between them.
    #[error("the two plates lie in one plane, and neither has an edge that the stripe shows")]
    NoStep,
    /// A plate with its free side turned away from the sensor.
    #[error(
        "plate {plate} faces away from the sensor: its normal is {turned_deg:.0}° from the direction to \
        it"
    )]
    FacesAway {
        /// Its number among the joint's plates, from 1 in the order of the file.
        plate: usize,
        /// Angle between its normal and the direction towards the sensor, degrees; more than 90.
        turned_deg: f64,
    },
    /// No plate is where the seam is.
    #[error("the seam is {:.1} mm off its plate", 1e3 * off_m)]
    OffSeam {
        /// Distance of the nearest one, m.
        off_m: f64,
    },
}

impl NoJoint {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Unnamed => {
                "add two tables [[plates]] to cell.toml, each with its normal, which points out of the plate into the free side; the planes run \
                 through the seam, or through point_mm"
            }
            Self::NoSide => {
                "give each of its [[plates]] `toward`, a direction in base from the seam into the plate, and the lower one of a lap `below_mm`"
            }
            Self::OneSide => {
                "give both [[plates]] `toward`, as an outside corner needs it, or neither: each then reaches to the free side of the other"
            }
            Self::SameSide => "`toward` points from the seam into the plate: those of a lap point apart",
            Self::NoStep => {
                "a lap's lower plate needs `below_mm` or `point_mm`; a gap between two plates in one plane is planned with `--use seam`"
            }
            Self::FacesAway { .. } => {
                "`normal` must point out of the plate to the free side, where the sensor is; check its sign \
                    and `approach`"
            }
            Self::OffSeam { .. } => "check that point_mm is a point of the plate, in base and in mm",
        }
    }
}

impl Joint {
    /// The joint that the plates of a cell make.
    ///
    /// # Errors
    /// [`NoJoint`].
    pub fn of(cell: &Cell) -> Result<Self, NoJoint> {
        let along = cell.seam.direction().ok_or(NoJoint::Unnamed)?;
        let holds = |plate: &&Plate| plate.toward.is_some() || off_m(cell, plate) < OFF_SEAM_M;
        let named: Vec<Plate> = cell.surroundings.plates.iter().filter(holds).copied().collect();
        faces_sensor(cell, &named)?;
        match named[..] {
            [one] => Self::ending(cell, &along, [one; 2], [true, false]),
            [one, other] if one.normal.cross(&other.normal).norm() < LEAST_ANGLE_SINE => {
                Self::ending(cell, &along, [one, other], [true; 2])
            }
            [one, other] => Self::meeting(cell, &along, [one, other]),
            _ => Err(NoJoint::Unnamed),
        }
    }

    /// Two plates that meet in the seam.
    fn meeting(cell: &Cell, along: &UnitVector3<f64>, plates: [Plate; 2]) -> Result<Self, NoJoint> {
        let off_m = plates.map(|plate| off_m(cell, &plate)).into_iter().fold(0.0, f64::max);
        if off_m >= OFF_SEAM_M {
            return Err(NoJoint::OffSeam { off_m });
        }
        if plates[0].toward.is_some() != plates[1].toward.is_some() {
            return Err(NoJoint::OneSide);
        }
        let free = [1, 0].map(|other: usize| plates[other].normal);
        let of = |k: usize| JointPlate::new(along, &plates[k], &plates[k].toward.unwrap_or(free[k]), 0.0);
        Ok(Self { plates: [of(0), of(1)], seen: [true; 2], edge_on: None })
    }

    /// Parallel plates, or one alone.
    fn ending(
        cell: &Cell,
        along: &UnitVector3<f64>,
        plates: [Plate; 2],
        seen: [bool; 2],
    ) -> Result<Self, NoJoint> {
        let [Some(one), Some(other)] = plates.map(|plate| plate.toward) else { return Err(NoJoint::NoSide) };
        let on = usize::from(off_m(cell, &plates[1]) < off_m(cell, &plates[0]));
        let off_m = off_m(cell, &plates[on]);
        if off_m >= OFF_SEAM_M {
            return Err(NoJoint::OffSeam { off_m });
        }
        let middle = 0.5 * (cell.seam.from_m + cell.seam.to_m);
        let above_seam_m = |k: usize| plates[k].normal.dot(&(plates[k].point_m - middle));
        // The edge is where the seam is, and the other plate as far off as the plates are from each other.
        let of =
            |k: usize, toward| JointPlate::new(along, &plates[k], toward, above_seam_m(k) - above_seam_m(on));
        let joint = Self { plates: [of(0, &one), of(1, &other)], seen, edge_on: Some(on) };
        if seen == [true; 2] {
            let [one, other] = &joint.plates;
            if one.outward.dot(&other.outward) > 0.0 {
                return Err(NoJoint::SameSide);
            }
            if joint.plates[1 - on].above_m.abs() < LEAST_STEP_M {
                return Err(NoJoint::NoStep);
            }
        }
        Ok(joint)
    }

    /// The same about a seam that is turned a little: its plates turn with it.
    #[must_use]
    pub(crate) fn about(&self, along: &Vector3<f64>) -> Self {
        Self { plates: self.plates.map(|plate| plate.about(along)), ..*self }
    }
}

/// A sensor sees the free side of a plate. One that it looks along is not turned away from it.
fn faces_sensor(cell: &Cell, plates: &[Plate]) -> Result<(), NoJoint> {
    let to_sensor = -cell.sensor_pose.range_in_base();
    let cosines = plates.iter().map(|plate| plate.normal.dot(&to_sensor));
    match cosines.enumerate().find(|(_, cosine)| *cosine < -LEAST_ANGLE_SINE) {
        Some((k, cosine)) => {
            Err(NoJoint::FacesAway { plate: k + 1, turned_deg: cosine.clamp(-1.0, 1.0).acos().to_degrees() })
        }
        None => Ok(()),
    }
}

impl JointPlate {
    fn new(along: &UnitVector3<f64>, plate: &Plate, toward: &UnitVector3<f64>, above_m: f64) -> Self {
        Self { normal: plate.normal, outward: *toward, above_m }.about(along)
    }

    fn about(&self, along: &Vector3<f64>) -> Self {
        let normal = UnitVector3::new_normalize(self.normal.as_ref() - along * along.dot(&self.normal));
        let outward = along.cross(&normal);
        let outward = UnitVector3::new_normalize(outward * outward.dot(&self.outward).signum());
        Self { normal, outward, above_m: self.above_m }
    }
}

/// Distance of a plate from the further end of the seam, m.
fn off_m(cell: &Cell, plate: &Plate) -> f64 {
    let off = |end: &Vector3<f64>| plate.normal.dot(&(end - plate.point_m)).abs();
    off(&cell.seam.from_m).max(off(&cell.seam.to_m))
}
