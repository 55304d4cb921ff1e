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

/// What profiles look like.
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
}

impl Default for ProfileLook {
    /// 0.1 mm columns of 0.02 mm, of which 3 % do not return and 1 % are reflections.
    fn default() -> Self {
        Self { column_m: 1e-4, range_sigma_m: 2e-5, drop_outs: 0.03, mixed: 0.3, reflections: 0.01 }
    }
}

impl ProfileLook {
    /// The same columns without noise, drop-outs and reflections.
    #[must_use]
    pub fn without_noise(self) -> Self {
        Self { range_sigma_m: 0.0, drop_outs: 0.0, mixed: 0.0, reflections: 0.0, ..self }
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

/// The same where the robot moves as it is told: `base_from_tool` gives its true pose at a time since the start, s.
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
        let ahead = |arm: &Vec<[f64; 2]>| arm.last().map_or(0.0, |end| end[0] - arm[0][0]);
        let corner_x = arms[0].first().map_or(0.0, |at| at[0]);
        let side = usize::from((ahead(&arms[1]) > 0.0) == (x_m > corner_x));
        if self.pair == PlatePair::Edge && side == 1 {
            return None;
        }
        let range_m = range_at(&arms[side], x_m)?;
        let (look, noise, chance) = (&self.look, &mut self.noise, &mut self.chance);
        let mut z_m = range_m + noise.normal(look.range_sigma_m) + noise.normal(self.roughness_m);
        if chance.happens(look.drop_outs) {
            return None;
        }
        let from_corner_m = (x_m - corner_x).abs();
        match self.pair {
            // Between the plates of a fillet a column sees both, and the corner fills up.
            PlatePair::Meeting if from_corner_m < MIXED_M && chance.happens(look.mixed) => {
                z_m -= chance.uniform(0.0, 1.0) * (MIXED_M - from_corner_m);
            }
            // The column that the edge falls into sees both plates of a lap.
            PlatePair::Lap { step_m }
                if from_corner_m < 0.5 * look.column_m && chance.happens(look.mixed) =>
            {
                let towards = if side == 0 { 1.0 } else { -1.0 };
                z_m += towards * chance.uniform(0.0, step_m);
            }
            _ => {}
        }
        if chance.happens(look.reflections) {
            z_m += chance.uniform(-REFLECTED_M, REFLECTED_M);
        }
        let in_view = measure(&self.sensor, &nalgebra::Vector3::new(x_m, 0.0, z_m));
        in_view.is_some().then_some(z_m)
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
