//! Whole profiles of two plates: columns with noise, drop-outs, mixed pixels and second reflections.

use super::surface::{PlateInBase, PlatePair, Plates};
use crate::capture::{SheetAxes, measure};
use crate::noise::Noise;
use crate::scenario::{Scenario, SensorModel};
use crate::shutter::{Exposed, Shutter};
use crate::{motion::Motion, simulate_along};
use nalgebra::Point3;
use trueline_dataset::{Profile, ProfilePoint, Recording};
use trueline_geometry::Pose;

/// Appearance of profiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileLook {
    /// Distance of neighbouring columns, m.
    pub column_m: f64,
    /// Standard deviation of a range, m.
    pub range_sigma_m: f64,
    /// Part of the columns without a return.
    pub drop_outs: f64,
    /// Part of the columns within 2 mm of the corner, or at the edge of a lap, that lie between the plates.
    pub mixed: f64,
    /// Part of the columns that see the other plate's reflection, up to 6 mm off.
    pub reflections: f64,
    /// Part of the columns within 0.5 mm of the edge of a plate over nothing, or beside a gap, that do not return.
    pub edge_drop_outs: f64,
    /// Part of the columns in a gap that see something below it.
    pub gap_filled: f64,
    /// Radius of the edges of a plate over nothing and beside a gap, m.
    pub rounded_m: f64,
}

impl Default for ProfileLook {
    /// Columns of 0.1 mm with noise of 0.02 mm; 3 % do not return and 1 % are reflections. At sharp edges 20 % do not return, and
    /// in gaps 30 % hit something.
    fn default() -> Self {
        Self {
            column_m: 1e-4,
            range_sigma_m: 2e-5,
            drop_outs: 0.03,
            mixed: 0.3,
            reflections: 0.01,
            edge_drop_outs: 0.2,
            gap_filled: 0.3,
            rounded_m: 0.0,
        }
    }
}

impl ProfileLook {
    /// The same columns without noise, drop-outs and reflections.
    #[must_use]
    pub fn without_noise(self) -> Self {
        Self {
            range_sigma_m: 0.0,
            drop_outs: 0.0,
            mixed: 0.0,
            reflections: 0.0,
            edge_drop_outs: 0.0,
            gap_filled: 0.0,
            ..self
        }
    }
}

/// How far a plate is cast at most, m.
const FAR_M: f64 = 0.12;
/// Distance of the places at which it is cast, m.
const STEP_M: f64 = 5e-4;
/// Within this of the corner columns mix, m.
const MIXED_M: f64 = 2e-3;
/// How far off a reflection is at most, m.
const REFLECTED_M: f64 = 6e-3;
/// Within this of an edge columns are lost, m.
const LOST_M: f64 = 5e-4;
/// Largest distance of the background behind the plate at an edge over nothing, or below a gap, m.
const BEHIND_M: f64 = 5e-3;

/// Scans two plates with the profiler of a scenario: a recording without features, and the profiles. `None` for a scenario
/// without a profiler or a line.
#[must_use]
pub fn scan_profiles(
    scenario: &Scenario,
    plates: &Plates,
    look: &ProfileLook,
    seed: u64,
) -> Option<(Recording, Vec<Profile>)> {
    let motion = Motion::new(scenario)?;
    scan_profiles_along(scenario, plates, look, &|time_s| motion.base_from_tool(time_s), seed)
}

/// The same with a prescribed motion of the robot: `base_from_tool` gives its true pose at a time since the start, s.
#[must_use]
pub fn scan_profiles_along(
    scenario: &Scenario,
    plates: &Plates,
    look: &ProfileLook,
    base_from_tool: &dyn Fn(f64) -> Pose,
    seed: u64,
) -> Option<(Recording, Vec<Profile>)> {
    let mut caster = ProfileCaster::new(scenario, plates, look, seed)?;
    let mut recording = simulate_along(scenario, base_from_tool, seed);
    recording.features.clear();
    let mut stamps = Noise::new(seed, 2);
    let mut shutter = Shutter::new(scenario);
    let mut profiles = Vec::new();
    for _ in 0..shutter.count() {
        let Exposed { frame, exposed_s, stamp_ns } = shutter.expose(&mut stamps);
        if caster.chance.happens(scenario.disturbance.drop_fraction) {
            continue;
        }
        let ranges = caster.cast(&(base_from_tool(exposed_s) * scenario.cell.tool_from_camera));
        let point = |(column, range_m): (usize, Option<f64>)| {
            Some(ProfilePoint { x_m: caster.x_m(column), z_m: range_m?, intensity: None })
        };
        let points = ranges.into_iter().enumerate().filter_map(point).collect();
        profiles.push(Profile { stamp_ns, frame: Some(frame), points });
    }
    Some((recording, profiles))
}

/// Casts profiles of two plates one after the other.
pub struct ProfileCaster {
    sensor: SensorModel,
    sheet: SheetAxes,
    both: [PlateInBase; 2],
    look: ProfileLook,
    pair: PlatePair,
    edge_on: usize,
    roughness_m: f64,
    half_width_m: f64,
    noise: Noise,
    chance: Noise,
}

impl ProfileCaster {
    /// For the profiler of a scenario; `None` for a scenario without a profiler or a line.
    #[must_use]
    pub fn new(scenario: &Scenario, plates: &Plates, look: &ProfileLook, seed: u64) -> Option<Self> {
        let sensor = scenario.cell.sensor.clone();
        let SensorModel::Profiler { half_width_m, .. } = sensor else { return None };
        Some(Self {
            sheet: SheetAxes::of(&sensor),
            both: PlateInBase::both(scenario, plates)?,
            sensor,
            look: *look,
            pair: plates.pair,
            edge_on: plates.edge_on,
            roughness_m: plates.roughness_m,
            half_width_m,
            noise: Noise::new(seed, 4),
            chance: Noise::new(seed, 3),
        })
    }

    /// Columns of a profile.
    #[must_use]
    pub fn columns(&self) -> usize {
        (2.0 * self.half_width_m / self.look.column_m) as usize
    }

    /// Position of a column along the stripe, m.
    #[must_use]
    pub fn x_m(&self, column: usize) -> f64 {
        (column as f64 + 0.5) * self.look.column_m - self.half_width_m
    }

    /// The range of every column, m; `None` without a return.
    pub fn cast(&mut self, base_from_camera: &Pose) -> Vec<Option<f64>> {
        let arms = self.both.each_ref().map(|plate| arm(plate, &self.sheet, base_from_camera));
        (0..self.columns()).map(|column| self.range(&arms, self.x_m(column))).collect()
    }

    fn range(&mut self, arms: &[Vec<[f64; 2]>; 2], x_m: f64) -> Option<f64> {
        let edges_x = arms.each_ref().map(|arm| arm.first().map_or(0.0, |at| at[0]));
        let z_m = match self.pair {
            PlatePair::Meeting | PlatePair::Lap { .. } => self.of_two(arms, x_m, edges_x[self.edge_on]),
            PlatePair::Edge => self.of_ending(&arms[self.edge_on], x_m),
            PlatePair::Butt { .. } => {
                let nearer = usize::from((x_m - edges_x[1]).abs() < (x_m - edges_x[0]).abs());
                self.of_ending(&arms[nearer], x_m).or_else(|| {
                    self.in_gap(arms, x_m, [edges_x[0].min(edges_x[1]), edges_x[0].max(edges_x[1])])
                })
            }
        }?;
        let reflected_m = if self.chance.happens(self.look.reflections) {
            self.chance.uniform(-REFLECTED_M, REFLECTED_M)
        } else {
            0.0
        };
        let in_view = measure(&self.sensor, &nalgebra::Vector3::new(x_m, 0.0, z_m + reflected_m));
        in_view.is_some().then_some(z_m + reflected_m)
    }

    /// The surface of an arm with the sensor's noise; `None` without a return.
    fn surface(&mut self, arm: &[[f64; 2]], x_m: f64) -> Option<f64> {
        let range_m = range_at(arm, x_m)?;
        let z_m = range_m + self.noise.normal(self.look.range_sigma_m) + self.noise.normal(self.roughness_m);
        (!self.chance.happens(self.look.drop_outs)).then_some(z_m)
    }

    /// Two plates that go on into each other at the corner or the edge.
    fn of_two(&mut self, arms: &[Vec<[f64; 2]>; 2], x_m: f64, corner_x: f64) -> Option<f64> {
        let ahead = |arm: &Vec<[f64; 2]>| arm.last().map_or(0.0, |end| end[0] - arm[0][0]);
        let side = usize::from((ahead(&arms[1]) > 0.0) == (x_m > corner_x));
        let from_corner_m = (x_m - corner_x).abs();
        // The column at the edge covers the upper plate of a lap and the background, independent of its middle.
        if let PlatePair::Lap { step_m } = self.pair
            && from_corner_m < 0.5 * self.look.column_m
            && self.chance.happens(self.look.mixed)
        {
            return Some(arms[self.edge_on].first()?[1] + self.chance.uniform(0.0, step_m));
        }
        let mut z_m = self.surface(&arms[side], x_m)?;
        // Between the plates of a fillet a column sees both, and the corner fills up.
        if self.pair == PlatePair::Meeting && from_corner_m < MIXED_M && self.chance.happens(self.look.mixed)
        {
            z_m -= self.chance.uniform(0.0, 1.0) * (MIXED_M - from_corner_m);
        }
        Some(z_m)
    }

    /// A plate that ends where its arm begins.
    fn of_ending(&mut self, arm: &[[f64; 2]], x_m: f64) -> Option<f64> {
        let [edge_x, edge_z] = *arm.first()?;
        let from_edge_m = (x_m - edge_x).abs();
        // A column is as wide as its distance: the one at the edge covers a part of the plate, and reports some range.
        let sees_edge = from_edge_m < 0.5 * self.look.column_m;
        if sees_edge && self.chance.happens(self.look.mixed) {
            return Some(edge_z + self.chance.uniform(0.0, BEHIND_M));
        }
        let z_m = self.surface(arm, x_m)?;
        if from_edge_m < LOST_M && self.chance.happens(self.look.edge_drop_outs) {
            return None;
        }
        let bent_m = (self.look.rounded_m - from_edge_m).max(0.0);
        Some(z_m + self.look.rounded_m - (self.look.rounded_m.powi(2) - bent_m.powi(2)).sqrt())
    }

    /// View through a gap.
    fn in_gap(&mut self, arms: &[Vec<[f64; 2]>; 2], x_m: f64, gap_x: [f64; 2]) -> Option<f64> {
        let is_inside = x_m > gap_x[0] && x_m < gap_x[1];
        let plate_z = arms[0].first()?[1];
        (is_inside && self.chance.happens(self.look.gap_filled))
            .then(|| plate_z + self.chance.uniform(0.2 * BEHIND_M, BEHIND_M))
    }
}

/// The cut of a plate in the profiler's frame, from the corner outwards.
fn arm(plate: &PlateInBase, sheet: &SheetAxes, base_from_camera: &Pose) -> Vec<[f64; 2]> {
    let camera_from_base = base_from_camera.inverse();
    let count = (FAR_M / STEP_M) as usize;
    let cut = |k: usize| {
        let point = plate.cut(sheet, base_from_camera, k as f64 * STEP_M)?;
        let there = (camera_from_base * Point3::from(point)).coords;
        Some([there.x, there.z])
    };
    (0..count).map_while(cut).collect()
}

/// Range of an arm at a column, between the places at which it was cast.
fn range_at(arm: &[[f64; 2]], x_m: f64) -> Option<f64> {
    let (first, last) = (arm.first()?[0], arm.last()?[0]);
    let rising = last > first;
    let beyond = arm.partition_point(|at| if rising { at[0] < x_m } else { at[0] > x_m });
    let (before, after) = (arm.get(beyond.checked_sub(1)?)?, arm.get(beyond)?);
    let part = (x_m - before[0]) / (after[0] - before[0]);
    Some(before[1] + part * (after[1] - before[1]))
}
