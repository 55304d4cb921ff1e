//! One recorded piece of a production.

use super::change::Change;
use super::settings::{PlacementScatter, Production, SeamPass};
use crate::capture::{SheetAxes, measure, point_on_sheet};
use crate::noise::Noise;
use crate::plates::SeamView;
use crate::scenario::{Scenario, SensorModel};
use crate::shutter::{Exposed, Shutter};
use crate::simulate::simulate_along;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, UnitVector3, Vector3};
use trueline_dataset::{Feature, Measured, PlateStripe, Recording};
use trueline_geometry::{Line, Pose, so3};
use trueline_model::LaserSheet;

/// Time in which the robot goes from one seam to the next, s.
const TRANSIT_S: f64 = 2.0;
/// Stream of random numbers for where pieces lie.
const PLACEMENT_STREAM: u64 = 31;
/// The same for the noise of stripes.
const STRIPES_STREAM: u64 = 32;

/// Simulates a piece. The same production, number and seed give the same recording, bit for bit; its truth has the clock,
/// the bracket and the seams of the end of the weld.
#[must_use]
pub fn piece(production: &Production, number: usize, seed: u64) -> Recording {
    let seed = seed.wrapping_mul(1_000_003).wrapping_add(number as u64);
    let lines = placed_seams(production, seed);
    let taught = Taught::of(production);
    let mut scenario: Scenario = production.scenario.clone();
    scenario.cell.lines.clear();
    scenario.timing.duration_s = taught.duration_s;
    let mut recording = simulate_along(&scenario, &|time_s| taught.base_from_tool(time_s), seed);
    let view = View {
        production,
        sheet: SheetAxes::of(&scenario.cell.sensor),
        laser: laser_sheet(&scenario.cell.sensor),
        lines: &lines,
    };
    let (mut noise, mut chance) = (Noise::new(seed, 2), Noise::new(seed, 3));
    let mut noise_of_stripes = Noise::new(seed, STRIPES_STREAM);
    let mut shutter = Shutter::new(&scenario);
    for _ in 0..shutter.count() {
        let Exposed { frame, exposed_s, stamp_ns } = shutter.expose(&mut noise);
        let Some(seam) = taught.seam_at(exposed_s) else { continue };
        if chance.happens(scenario.disturbance.drop_fraction) {
            continue;
        }
        let change = production.change.as_ref().and_then(|c| c.at(number, taught.done(exposed_s)));
        let base_from_tool = taught.base_from_tool(exposed_s);
        let Some(seen) = view.seen(seam, &base_from_tool, change) else { continue };
        let late_ns = (change.map_or(0.0, Change::late_s) * 1e9).round() as i64;
        recording.features.push(Feature {
            stamp_ns: stamp_ns + late_ns,
            line: seam as u32,
            frame: Some(frame),
            device_ns: None,
            measured: noise.feature(&seen, &view.sheet, &scenario.disturbance),
            sigma: None,
            correlation: 0.0,
        });
        let stripes = view.stripes(seam, &base_from_tool, change, &mut noise_of_stripes);
        recording.stripes.extend(stripes.into_iter().flatten().enumerate().map(|(k, (points, sigma))| {
            let plate = 2 * seam as u32 + k as u32;
            PlateStripe { stamp_ns: stamp_ns + late_ns, frame: Some(frame), plate, points, sigma }
        }));
    }
    if let Some(truth) = &mut recording.truth {
        let change = production.change.as_ref().and_then(|c| c.at(number, 1.0));
        truth.parameters.time_offset_s += change.map_or(0.0, Change::late_s);
        truth.parameters.tool_from_camera = view.mounting(change);
        truth.lines = (0..lines.len()).map(|seam| view.line(seam, change)).collect();
    }
    recording
}

/// Places of a piece's seams, before anything changed.
fn placed_seams(production: &Production, seed: u64) -> Vec<Line> {
    let PlacementScatter { translation_m, rotation_rad, seam_m } = production.scatter;
    let mut noise = Noise::new(seed, PLACEMENT_STREAM);
    let mut vector = |sigma: f64| Vector3::from_fn(|_, _| noise.normal(sigma));
    let (turn, shift) = (vector(rotation_rad), vector(translation_m));
    let middle = production.middle();
    let mut stray = |line: Line| {
        let axes = line.axes();
        let across = axes.column(1) * noise.normal(seam_m) + axes.column(2) * noise.normal(seam_m);
        moved(&line, &Vector3::zeros(), &across, &middle)
    };
    let taught = production.seams.iter().map(SeamPass::line);
    taught.map(|line| stray(moved(&line, &turn, &shift, &middle))).collect()
}

/// A line turned about a point and shifted.
fn moved(line: &Line, turn: &Vector3<f64>, shift: &Vector3<f64>, about: &Vector3<f64>) -> Line {
    let rotation = so3::exp(turn);
    let direction = UnitVector3::new_normalize(rotation * line.direction());
    Line::new(about + rotation * (line.anchor() - about) + shift, &direction)
}

fn laser_sheet(sensor: &SensorModel) -> LaserSheet {
    match sensor {
        SensorModel::CameraLaser { laser_plane_in_camera, .. }
        | SensorModel::Points { laser_plane_in_camera, .. } => LaserSheet::from_plane(*laser_plane_in_camera),
        SensorModel::Profiler { .. } => LaserSheet::of_profiler(),
    }
}

/// The sensor's view.
struct View<'a> {
    production: &'a Production,
    sheet: SheetAxes,
    laser: LaserSheet,
    lines: &'a [Line],
}

impl View<'_> {
    fn mounting(&self, change: Option<&Change>) -> Pose {
        let taught = self.production.scenario.cell.tool_from_camera;
        change.map_or(taught, |change| change.tool_from_camera(&taught))
    }

    fn line(&self, seam: usize, change: Option<&Change>) -> Line {
        let (turn, shift) = change.map_or((Vector3::zeros(), Vector3::zeros()), Change::fixture);
        moved(&self.lines[seam], &turn, &shift, &self.production.middle())
    }

    fn seen(&self, seam: usize, base_from_tool: &Pose, change: Option<&Change>) -> Option<Measured> {
        let base_from_camera = base_from_tool * self.mounting(change);
        let point = point_on_sheet(&self.sheet, &base_from_camera, &self.line(seam, change))?;
        let point = change.map_or(point, |change| change.reported(&self.laser, &self.sheet.middle, &point));
        measure(&self.production.scenario.cell.sensor, &point)
    }

    /// Both plates' stripes, if the production has plates, its sensor is a camera and both are in view.
    fn stripes(
        &self,
        seam: usize,
        base_from_tool: &Pose,
        change: Option<&Change>,
        noise: &mut Noise,
    ) -> Option<[([Measured; 2], f64); 2]> {
        let SensorModel::CameraLaser { camera, .. } = &self.production.scenario.cell.sensor else {
            return None;
        };
        let reported = |point| change.map_or(point, |c| c.reported(&self.laser, &self.sheet.middle, &point));
        let view = SeamView {
            camera,
            sheet: &self.sheet,
            plates: self.production.plates.as_ref()?,
            line: self.line(seam, change),
            approach: self.production.seams[seam].approach,
            reported: &reported,
        };
        view.seen(&(base_from_tool * self.mounting(change)), noise)
    }
}

impl SeamPass {
    fn line(&self) -> Line {
        let direction = UnitVector3::new_normalize(self.end - self.start);
        Line::new(0.5 * (self.start + self.end), &direction)
    }
}

/// The path as taught: seam after seam, with the sensor at its first mounting.
struct Taught<'a> {
    production: &'a Production,
    sheet: SheetAxes,
    /// When each seam begins and ends, s.
    spans_s: Vec<[f64; 2]>,
    duration_s: f64,
}

impl<'a> Taught<'a> {
    fn of(production: &'a Production) -> Self {
        // A moment before and after, so that late images still find their pose.
        let late_s = production.change.map_or(0.0, |c| c.change.late_s().abs());
        let margin_s = production.scenario.timing.time_offset_s.abs() + late_s + 0.2;
        let mut time_s = margin_s;
        let mut spans_s = Vec::new();
        for seam in &production.seams {
            let end_s = time_s + (seam.end - seam.start).norm() / production.speed_m_s;
            spans_s.push([time_s, end_s]);
            time_s = end_s + TRANSIT_S;
        }
        let duration_s = time_s - TRANSIT_S + margin_s;
        Self { production, sheet: SheetAxes::of(&production.scenario.cell.sensor), spans_s, duration_s }
    }

    fn seam_at(&self, time_s: f64) -> Option<usize> {
        self.spans_s.iter().position(|[start, end]| (*start..=*end).contains(&time_s))
    }

    fn done(&self, time_s: f64) -> f64 {
        let (first, last) = (self.spans_s.first(), self.spans_s.last());
        let (Some([start, _]), Some([_, end])) = (first, last) else { return 0.0 };
        (time_s - start) / (end - start)
    }

    /// True pose of the tool at a time, s.
    fn base_from_tool(&self, time_s: f64) -> Pose {
        let next = self.spans_s.iter().position(|[_, end]| time_s <= *end).unwrap_or(self.spans_s.len() - 1);
        let start_s = self.spans_s[next][0];
        if time_s >= start_s || next == 0 {
            return self.over_seam(next, time_s);
        }
        let end_s = self.spans_s[next - 1][1];
        let (from, to) = (self.over_seam(next - 1, time_s), self.over_seam(next, time_s));
        let part = (time_s - end_s) / (start_s - end_s);
        let part = part * part * (3.0 - 2.0 * part);
        let turn = (from.rotation.inverse() * to.rotation).scaled_axis();
        let position = from.translation.vector.lerp(&to.translation.vector, part);
        Pose::from_parts(position.into(), from.rotation * UnitQuaternion::new(turn * part))
    }

    fn over_seam(&self, number: usize, time_s: f64) -> Pose {
        let (production, seam) = (self.production, &self.production.seams[number]);
        let along = (seam.end - seam.start).normalize();
        let place = seam.start + along * (production.speed_m_s * (time_s - self.spans_s[number][0]));
        let approach = seam.approach.into_inner();
        let range = (approach - along * along.dot(&approach)).normalize();
        let across =
            Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[along.cross(&range), along, range]));
        let tilts = [0, 1, 2].map(|axis| production.tilts[axis].at(time_s));
        let attitude = |[work, travel, spin]: [f64; 3]| {
            let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), seam.work_angle_rad + work)
                * Rotation3::from_axis_angle(&Vector3::x_axis(), travel)
                * Rotation3::from_axis_angle(&Vector3::z_axis(), spin);
            across * tilt * self.sheet.camera_from_sheet.inverse()
        };
        let (steady, base_from_camera) = (attitude([0.0; 3]), attitude(tilts));
        let aim = self.sheet.point(production.weave.at(time_s), production.range.at(time_s));
        let pivot = production.pivot_m.unwrap_or(aim);
        let rotation = UnitQuaternion::from_rotation_matrix(&base_from_camera);
        let origin = place + steady * (pivot - aim) - base_from_camera * pivot;
        Pose::from_parts(origin.into(), rotation) * production.scenario.cell.tool_from_camera.inverse()
    }
}
