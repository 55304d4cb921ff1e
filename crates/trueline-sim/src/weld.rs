//! Scans of welds with every point known: straight or round, followed at a speed, with or without weaving.

use crate::capture::{SheetAxes, measure};
use crate::noise::Noise;
use crate::scenario::{Scenario, Sine};
use crate::shutter::{Exposed, Shutter};
use crate::simulate::simulate_along;
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use trueline_dataset::{Feature, Recording};
use trueline_geometry::{Circle, Line, Pose};

/// The form of a weld.
#[derive(Clone, Debug, PartialEq)]
pub enum Weld {
    /// Straight, from the line's anchor along its direction.
    Straight(Line),
    /// Along a circle from a point of it, right-handed about the axis.
    Round {
        /// The circle.
        circle: Circle,
        /// Direction from the centre to where the weld begins; square to the axis.
        towards_start: Vector3<f64>,
    },
}

impl Weld {
    /// Point (m) and unit direction after some length, m.
    #[must_use]
    pub fn at(&self, length_m: f64) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Straight(line) => (line.anchor() + line.direction() * length_m, line.direction()),
            Self::Round { circle, towards_start } => {
                let angle = length_m / circle.radius();
                let axis = circle.axis().into_inner();
                let outward = towards_start * angle.cos() + axis.cross(towards_start) * angle.sin();
                (circle.centre() + outward * circle.radius(), axis.cross(&outward))
            }
        }
    }

    /// The point in the camera (m) where the weld meets the sheet, of several the one nearest to `near`.
    fn on_sheet(
        &self,
        sheet: &SheetAxes,
        base_from_camera: &Pose,
        near: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        match self {
            Self::Straight(line) => crate::capture::point_on_sheet(sheet, base_from_camera, line),
            Self::Round { circle, .. } => {
                let camera_from_base = base_from_camera.inverse();
                let centre = (camera_from_base * Point3::from(*circle.centre())).coords;
                let axis = camera_from_base * circle.axis().into_inner();
                // On the circle n·(c + r(u cos a + v sin a)) = d, which is A cos(a − a₀) = d − n·c.
                let u = axis.cross(&sheet.normal).try_normalize(1e-9)?;
                let v = axis.cross(&u);
                let steep = circle.radius() * sheet.normal.dot(&v);
                let sine = (sheet.offset - sheet.normal.dot(&centre)) / steep;
                let angle = (sine.abs() <= 1.0).then(|| sine.asin())?;
                let at = |a: f64| centre + (u * a.cos() + v * a.sin()) * circle.radius();
                let both = [at(angle), at(std::f64::consts::PI - angle)];
                both.into_iter().min_by(|a, b| (a - near).norm().total_cmp(&(b - near).norm()))
            }
        }
    }
}

/// How a weld is scanned.
#[derive(Clone, Debug)]
pub struct WeldScan {
    /// The weld.
    pub weld: Weld,
    /// Its length, m.
    pub length_m: f64,
    /// Speed along it, m/s.
    pub speed_m_s: f64,
    /// Place of the weld along the stripe while it is followed, m.
    pub weave: Sine,
}

/// A scan and where each feature of it truly is.
#[derive(Clone, Debug)]
pub struct KnownScan {
    /// The recording; its truth has no lines.
    pub recording: Recording,
    /// True point in base of each feature, m: as measured by a robot that stops there.
    pub truth: Vec<Vector3<f64>>,
}

/// Simulates the scan of a weld with the sensor, mounting, clocks and disturbances of a scenario; its lines, movement
/// and duration are not used, and its outliers do not happen. The sheet stands across the weld, the sensor looks along
/// the cell's approach.
#[must_use]
pub fn scan_weld(scenario: &Scenario, scan: &WeldScan, seed: u64) -> KnownScan {
    let mut scenario = scenario.clone();
    scenario.cell.lines.clear();
    // A moment before and after, so that late images still find their pose.
    let margin_s = scenario.timing.time_offset_s.abs() + 0.2;
    scenario.timing.duration_s = scan.length_m / scan.speed_m_s + 2.0 * margin_s;
    let sheet = SheetAxes::of(&scenario.cell.sensor);
    let pose = |time_s: f64| base_from_tool(&scenario, scan, &sheet, time_s - margin_s);
    let mut recording = simulate_along(&scenario, &pose, seed);
    let mut truth = Vec::new();
    let (mut noise, mut chance) = (Noise::new(seed, 2), Noise::new(seed, 3));
    let mut shutter = Shutter::new(&scenario);
    for _ in 0..shutter.count() {
        let Exposed { frame, exposed_s, stamp_ns } = shutter.expose(&mut noise);
        if chance.happens(scenario.disturbance.drop_fraction) {
            continue;
        }
        let base_from_camera = pose(exposed_s) * scenario.cell.tool_from_camera;
        let Some(point) = scan.weld.on_sheet(&sheet, &base_from_camera, &sheet.middle) else { continue };
        let Some(seen) = measure(&scenario.cell.sensor, &point) else { continue };
        let measured = noise.feature(&seen, &sheet, &scenario.disturbance);
        truth.push((base_from_camera * Point3::from(point)).coords);
        recording.features.push(Feature {
            stamp_ns,
            line: 0,
            frame: Some(frame),
            device_ns: None,
            measured,
            sigma: None,
            correlation: 0.0,
        });
    }
    KnownScan { recording, truth }
}

fn base_from_tool(scenario: &Scenario, scan: &WeldScan, sheet: &SheetAxes, time_s: f64) -> Pose {
    let (point, along) = scan.weld.at(time_s * scan.speed_m_s);
    let approach = scenario.cell.approach.into_inner();
    let range = (approach - along * along.dot(&approach)).normalize();
    let axes = Matrix3::from_columns(&[along.cross(&range), along, range]);
    let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), scenario.scan.attitude_rad[0])
        * Rotation3::from_axis_angle(&Vector3::x_axis(), scenario.scan.attitude_rad[1])
        * Rotation3::from_axis_angle(&Vector3::z_axis(), scenario.scan.attitude_rad[2]);
    let base_from_camera = Rotation3::from_matrix_unchecked(axes) * tilt * sheet.camera_from_sheet.inverse();
    let origin = point - base_from_camera * sheet.point(scan.weave.at(time_s), 0.0);
    let rotation = UnitQuaternion::from_rotation_matrix(&base_from_camera);
    Pose::from_parts(origin.into(), rotation) * scenario.cell.tool_from_camera.inverse()
}
