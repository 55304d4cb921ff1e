//! The tables of `sensor.toml` beside the sensor: `[uncertainty]`, `[shape]`, `[robot]`, `[seam]`, `[region_of_interest]`.

use crate::error::Problem;
use crate::sensor_setup::{
    Mounted, RegionOfInterest, SensorCovariance, SensorParameter, SensorSetup, SensorUncertainty, SheetShape,
};
use crate::unit::MM_PER_M;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

const PERCENT: f64 = 100.0;

#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum MountedName {
    Tool,
    Fixed,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RobotTable {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    accuracy_mm: Option<f64>,
    // Also accepted here, since it reads as well under [robot].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mounted: Option<MountedName>,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SeamTable {
    #[serde(skip_serializing_if = "Option::is_none")]
    edge_radius_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    waviness_mm: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ShapeTable {
    h: [f64; 5],
    #[serde(default)]
    origin_mm: [f64; 2],
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RegionTable {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    u_px: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    v_px: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x_mm: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    z_mm: Option<[f64; 2]>,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct UncertaintyTable {
    #[serde(skip_serializing_if = "Option::is_none")]
    plane_offset_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    plane_normal_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    focal_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    principal_point_px: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    scale_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shear_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    keystone_percent: Option<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    found_from: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    covariance: Option<CovarianceTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CovarianceTable {
    order: Vec<String>,
    matrix: Vec<Vec<f64>>,
}

pub(crate) type Tables<'a> = (
    Option<MountedName>,
    &'a Option<ShapeTable>,
    &'a Option<RobotTable>,
    &'a Option<SeamTable>,
    &'a Option<RegionTable>,
    &'a Option<UncertaintyTable>,
);

/// The setup that the tables describe; some tables belong to cameras only, some to other sensors only.
pub(crate) fn setup_from(tables: Tables<'_>, of_camera: bool) -> Result<SensorSetup, Problem> {
    let (mounted, shape, robot, seam, region, uncertainty) = tables;
    if of_camera && shape.is_some() {
        return Err(Problem::Value {
            key: "shape",
            expected: "no shape for a camera: correct [camera] and [laser_plane] instead",
            found: "[shape]".to_owned(),
        });
    }
    let in_robot = robot.as_ref().and_then(|table| table.mounted);
    if mounted.is_some() && in_robot.is_some() && mounted != in_robot {
        return Err(Problem::Value {
            key: "mounted",
            expected: "one statement, at the top or under [robot]",
            found: "two that differ".to_owned(),
        });
    }
    let accuracy_mm = robot.as_ref().and_then(|table| table.accuracy_mm);
    Ok(SensorSetup {
        uncertainty: uncertainty.as_ref().map(|table| table.to_si(of_camera)).transpose()?,
        shape: shape.as_ref().map(ShapeTable::to_si).transpose()?,
        robot_accuracy_m: not_negative("robot.accuracy_mm", accuracy_mm)?.map(|x| x / MM_PER_M),
        edge_radius_m: seam.as_ref().map_or(Ok(None), SeamTable::edge_radius_m)?,
        waviness_m: seam.as_ref().map_or(Ok(None), SeamTable::waviness_m)?,
        mounted: match mounted.or(in_robot) {
            Some(MountedName::Fixed) => Mounted::Fixed,
            Some(MountedName::Tool) | None => Mounted::Tool,
        },
        region_of_interest: region.as_ref().map(|table| table.to_si(of_camera)).transpose()?,
    })
}

/// Largest statement about a cell, in its own unit: squares of it stay finite.
const LARGEST: f64 = 1e6;

fn not_negative(key: &'static str, value: Option<f64>) -> Result<Option<f64>, Problem> {
    match value {
        Some(x) if !(0.0..=LARGEST).contains(&x) => {
            Err(Problem::Value { key, expected: "a number from zero to a million", found: x.to_string() })
        }
        fine => Ok(fine),
    }
}

/// Larger edges and forms are in another unit, mm.
const LARGEST_OF_A_SEAM_MM: f64 = 20.0;

fn of_a_seam(key: &'static str, value_mm: Option<f64>) -> Result<Option<f64>, Problem> {
    match value_mm {
        Some(x) if !(0.0..=LARGEST_OF_A_SEAM_MM).contains(&x) => {
            Err(Problem::Value { key, expected: "a length from 0 to 20 mm", found: x.to_string() })
        }
        fine => Ok(fine),
    }
}

impl MountedName {
    /// The usual case is not written.
    pub(crate) fn of(mounted: Mounted) -> Option<Self> {
        match mounted {
            Mounted::Tool => None,
            Mounted::Fixed => Some(Self::Fixed),
        }
    }
}

impl RobotTable {
    pub(crate) fn of(accuracy_m: f64) -> Self {
        Self { accuracy_mm: Some(accuracy_m * MM_PER_M), mounted: None }
    }
}

impl SeamTable {
    /// `None` if nothing is stated.
    pub(crate) fn of(setup: &SensorSetup) -> Option<Self> {
        let [edge_radius_mm, waviness_mm] =
            [setup.edge_radius_m, setup.waviness_m].map(|stated| stated.map(|m| m * MM_PER_M));
        let says = edge_radius_mm.is_some() || waviness_mm.is_some();
        says.then_some(Self { edge_radius_mm, waviness_mm })
    }

    fn edge_radius_m(&self) -> Result<Option<f64>, Problem> {
        Ok(of_a_seam("seam.edge_radius_mm", self.edge_radius_mm)?.map(|x| x / MM_PER_M))
    }

    fn waviness_m(&self) -> Result<Option<f64>, Problem> {
        Ok(of_a_seam("seam.waviness_mm", self.waviness_mm)?.map(|x| x / MM_PER_M))
    }
}

impl ShapeTable {
    pub(crate) fn of(shape: &SheetShape) -> Self {
        let [h1, h2, h3, h4, h5] = shape.h;
        Self {
            h: [h1, h2, h3, h4 / MM_PER_M, h5 / MM_PER_M],
            origin_mm: shape.origin_m.map(|x| x * MM_PER_M),
        }
    }

    fn to_si(&self) -> Result<SheetShape, Problem> {
        let [h1, h2, h3, h4, h5] = self.h;
        if !(self.h.iter().chain(&self.origin_mm).all(|x| x.is_finite()) && h1 > -1.0 && h2 > -1.0) {
            return Err(Problem::Value {
                key: "shape.h",
                expected: "[h1, h2, h3, h4_per_mm, h5_per_mm], finite, with h1 and h2 above -1",
                found: format!("{:?} about {:?}", self.h, self.origin_mm),
            });
        }
        Ok(SheetShape {
            h: [h1, h2, h3, h4 * MM_PER_M, h5 * MM_PER_M],
            origin_m: self.origin_mm.map(|x| x / MM_PER_M),
        })
    }
}

impl RegionTable {
    pub(crate) fn of(region: &RegionOfInterest) -> Self {
        let none = Self { u_px: None, v_px: None, x_mm: None, z_mm: None };
        let mm = |range: [f64; 2]| Some(range.map(|x| x * MM_PER_M));
        match *region {
            RegionOfInterest::Pixels { u_px, v_px } => Self { u_px: Some(u_px), v_px: Some(v_px), ..none },
            RegionOfInterest::Sheet { x_m, z_m } => Self { x_mm: mm(x_m), z_mm: mm(z_m), ..none },
        }
    }

    fn to_si(&self, of_camera: bool) -> Result<RegionOfInterest, Problem> {
        let rising = |range: [f64; 2]| range.iter().all(|x| x.is_finite()) && range[0] < range[1];
        match (self.u_px, self.v_px, self.x_mm, self.z_mm) {
            (Some(u_px), Some(v_px), None, None) if of_camera && rising(u_px) && rising(v_px) => {
                Ok(RegionOfInterest::Pixels { u_px, v_px })
            }
            (None, None, Some(x), Some(z)) if !of_camera && rising(x) && rising(z) => {
                Ok(RegionOfInterest::Sheet { x_m: x.map(|x| x / MM_PER_M), z_m: z.map(|x| x / MM_PER_M) })
            }
            found => Err(Problem::Value {
                key: "region_of_interest",
                expected: if of_camera {
                    "u_px = [from, to] and v_px = [from, to], rising"
                } else {
                    "x_mm = [from, to] and z_mm = [from, to], rising"
                },
                found: format!("u, v, x, z = {found:?}"),
            }),
        }
    }
}

impl UncertaintyTable {
    pub(crate) fn of(uncertainty: &SensorUncertainty) -> Self {
        let of = uncertainty;
        Self {
            plane_offset_mm: of.plane_offset_m.map(|x| x * MM_PER_M),
            plane_normal_deg: of.plane_normal_rad.map(f64::to_degrees),
            focal_percent: of.focal.map(|x| x * PERCENT),
            principal_point_px: of.principal_point_px,
            scale_percent: of.scale.map(|x| x * PERCENT),
            shear_deg: of.shear_rad.map(f64::to_degrees),
            keystone_percent: of.keystone.map(|x| x * PERCENT),
            covariance: of.covariance.as_ref().map(CovarianceTable::of),
            found_from: of.found_from.clone(),
        }
    }

    fn to_si(&self, of_camera: bool) -> Result<SensorUncertainty, Problem> {
        let camera = [
            ("uncertainty.focal_percent", self.focal_percent),
            ("uncertainty.principal_point_px", self.principal_point_px),
        ];
        let other = [
            ("uncertainty.scale_percent", self.scale_percent),
            ("uncertainty.shear_deg", self.shear_deg),
            ("uncertainty.keystone_percent", self.keystone_percent),
        ];
        let misplaced = if of_camera { other.as_slice() } else { camera.as_slice() };
        if let Some((key, Some(value))) = misplaced.iter().find(|(_, value)| value.is_some()) {
            let expected = "a key of this kind of sensor: cameras have plane, focal length and principal point, others scale, shear and keystone";
            return Err(Problem::Value { key, expected, found: value.to_string() });
        }
        for (key, value) in camera.into_iter().chain(other) {
            not_negative(key, value)?;
        }
        Ok(SensorUncertainty {
            plane_offset_m: not_negative("uncertainty.plane_offset_mm", self.plane_offset_mm)?
                .map(|x| x / MM_PER_M),
            plane_normal_rad: not_negative("uncertainty.plane_normal_deg", self.plane_normal_deg)?
                .map(f64::to_radians),
            focal: self.focal_percent.map(|x| x / PERCENT),
            principal_point_px: self.principal_point_px,
            scale: self.scale_percent.map(|x| x / PERCENT),
            shear_rad: self.shear_deg.map(f64::to_radians),
            keystone: self.keystone_percent.map(|x| x / PERCENT),
            covariance: self.covariance.as_ref().map(|c| c.to_si(of_camera)).transpose()?,
            found_from: self.found_from.clone(),
        })
    }
}

/// Files have millimetres where the inside has metres.
fn per_si(parameter: SensorParameter) -> f64 {
    match parameter {
        SensorParameter::Offset => MM_PER_M,
        SensorParameter::H4 | SensorParameter::H5 => 1.0 / MM_PER_M,
        _ => 1.0,
    }
}

impl CovarianceTable {
    fn of(covariance: &SensorCovariance) -> Self {
        let scale: Vec<f64> = covariance.order.iter().map(|p| per_si(*p)).collect();
        let row =
            |i: usize| (0..scale.len()).map(|j| covariance.matrix[(i, j)] * scale[i] * scale[j]).collect();
        Self {
            order: covariance.order.iter().map(|p| p.name().to_owned()).collect(),
            matrix: (0..scale.len()).map(row).collect(),
        }
    }

    fn to_si(&self, of_camera: bool) -> Result<SensorCovariance, Problem> {
        let order = self.parameters(of_camera)?;
        let n = order.len();
        if n == 0 || self.matrix.len() != n || self.matrix.iter().any(|row| row.len() != n) {
            return Err(Problem::Value {
                key: "uncertainty.covariance.matrix",
                expected: "as many rows and columns as `order` has names",
                found: format!("{} names and {} rows", n, self.matrix.len()),
            });
        }
        let scale: Vec<f64> = order.iter().map(|p| per_si(*p)).collect();
        let matrix = DMatrix::from_fn(n, n, |i, j| self.matrix[i][j] / (scale[i] * scale[j]));
        if let Some(why) = no_covariance(&matrix) {
            return Err(Problem::Value {
                key: "uncertainty.covariance.matrix",
                expected: "a symmetric matrix without negative eigenvalues",
                found: why.to_owned(),
            });
        }
        Ok(SensorCovariance { order, matrix })
    }

    fn parameters(&self, of_camera: bool) -> Result<Vec<SensorParameter>, Problem> {
        let mut order = Vec::new();
        for name in &self.order {
            let known = SensorParameter::ALL.into_iter().find(|p| p.name() == name);
            let usable = known.filter(|p| {
                if of_camera { *p <= SensorParameter::Offset } else { *p >= SensorParameter::NormalE1 }
            });
            match usable {
                Some(parameter) if !order.contains(&parameter) => order.push(parameter),
                _ => {
                    return Err(Problem::Value {
                        key: "uncertainty.covariance.order",
                        expected: "parameters of this sensor, each once: fx_px, fy_px, cx_px, cy_px, k1, k2, p1, p2, k3, normal_e1_rad, normal_e2_rad, offset_mm; of a profiler h1, h2, h3, h4_per_mm, h5_per_mm",
                        found: name.clone(),
                    });
                }
            }
        }
        Ok(order)
    }
}

/// Why a matrix is not a covariance.
fn no_covariance(matrix: &DMatrix<f64>) -> Option<&'static str> {
    let n = matrix.nrows();
    if !matrix.iter().all(|x| x.is_finite()) {
        return Some("numbers that are not finite");
    }
    if (0..n).any(|i| matrix[(i, i)] < 0.0) {
        return Some("a negative variance");
    }
    // Compared as correlations, so that a pixel and a radian count alike; an exact parameter has a zero row.
    let sigma: Vec<f64> = (0..n).map(|i| matrix[(i, i)].sqrt()).collect();
    let unit = |i: usize, j: usize| {
        if sigma[i] > 0.0 && sigma[j] > 0.0 { matrix[(i, j)] / sigma[i] / sigma[j] } else { matrix[(i, j)] }
    };
    let correlation = DMatrix::from_fn(n, n, unit);
    // Sixteen printed digits leave 1e-15; files by hand may have six.
    if (&correlation - correlation.transpose()).amax() > 1e-6 {
        return Some("a matrix that is not symmetric");
    }
    let least = correlation.symmetric_eigenvalues().min();
    (least < -1e-6).then_some("a negative eigenvalue")
}
