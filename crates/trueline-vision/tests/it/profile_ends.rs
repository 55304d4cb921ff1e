//! The edge of one plate and the gap between two in profiles with known truth, and who could make them wrong.

use trueline_dataset::{Measured, Profile, ProfilePoint};
use trueline_vision::Joint;
use trueline_vision::profile::{NoSeam, ProfileJoint, ProfileSeams, ProfileStream, seams};

/// Normal numbers from a linear congruence, so that the seed is the whole story.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    fn happens(&mut self, part: f64) -> bool {
        self.uniform() < part
    }
}

const PITCH_MM: f64 = 0.1;
const SLOPE: f64 = 0.15;
const SIGMA_MM: f64 = 0.02;

/// A plate over nothing, or two with a gap, as a profiler sees it: 40 mm in 400 columns.
#[derive(Clone, Copy)]
struct Scene {
    /// Ends of plates: `[from, to]` of each on x, mm.
    plates: [[f64; 2]; 2],
    /// How much the second one is lower, mm.
    lower_mm: f64,
    /// Part of the columns that are lost, anywhere and within half a millimetre of an end.
    lost: [f64; 2],
    /// Part of the columns at an end that report some range.
    mixed: f64,
    /// Part of the columns without a plate that see something below.
    filled: f64,
    /// Radius of the ends, mm.
    rounded_mm: f64,
    /// Bow of the plates, mm at 20 mm from their middle.
    bow_mm: f64,
}

const FAR: f64 = 1e3;
const NONE: [f64; 2] = [2.0 * FAR, 2.0 * FAR];

impl Scene {
    fn of(plates: [[f64; 2]; 2]) -> Self {
        let [lower_mm, filled, rounded_mm, bow_mm] = [0.0; 4];
        Self { plates, lower_mm, lost: [0.03, 0.2], mixed: 0.3, filled, rounded_mm, bow_mm }
    }

    fn column(&self, x: f64, noise: &mut Noise) -> Option<f64> {
        let ground = 100.0 + SLOPE * x;
        for (number, [from, to]) in self.plates.into_iter().enumerate() {
            let z = ground + if number == 1 { self.lower_mm } else { 0.0 };
            let from_end = (x - from).min(to - x);
            if from_end.abs() < 0.5 * PITCH_MM && noise.happens(self.mixed) {
                return Some(z + 5.0 * noise.uniform());
            }
            if from_end < 0.0 {
                continue;
            }
            if noise.happens(self.lost[usize::from(from_end < 0.5)]) {
                return None;
            }
            let reflected = if noise.happens(0.01) { 12.0 * (noise.uniform() - 0.5) } else { 0.0 };
            let bent = (self.rounded_mm - from_end).max(0.0);
            let drop = self.rounded_mm - (self.rounded_mm.powi(2) - bent * bent).sqrt();
            let bowed = self.bow_mm * (x / 20.0).powi(2);
            return Some(z + drop + bowed + SIGMA_MM * noise.normal() + reflected);
        }
        noise.happens(self.filled).then(|| ground + 1.0 + 4.0 * noise.uniform())
    }

    fn profile(&self, number: usize, noise: &mut Noise) -> Profile {
        let point = |k: i32| {
            let x = PITCH_MM * f64::from(k);
            Some(ProfilePoint { x_m: x * 1e-3, z_m: self.column(x, noise)? * 1e-3, intensity: None })
        };
        let points = (-200..200).filter_map(point).collect();
        Profile { stamp_ns: number as i64 * 30_000_000, frame: Some(number as u64), points }
    }
}

/// As a weaving robot sees it: the scene shifted by a sine of `amplitude_mm`.
fn weave(scene: &Scene, count: usize, amplitude_mm: f64, seed: u64) -> (Vec<Profile>, Vec<f64>) {
    let mut noise = Noise(seed);
    let shifts: Vec<f64> = (0..count).map(|k| amplitude_mm * (0.21 * k as f64).sin()).collect();
    let moved = |by: f64| Scene { plates: scene.plates.map(|plate| plate.map(|x| x + by)), ..*scene };
    let profiles = shifts.iter().enumerate().map(|(k, by)| moved(*by).profile(k, &mut noise)).collect();
    (profiles, shifts)
}

/// Along the plate and square to it: mean errors in mm, and mean squares in sigma.
fn errors(found: &ProfileSeams, truth_x: &[f64], lower_mm: f64) -> [[f64; 2]; 2] {
    let along = [1.0 / SLOPE.hypot(1.0), SLOPE / SLOPE.hypot(1.0)];
    let across = [-along[1], along[0]];
    let mut sums = [[0.0; 2]; 2];
    let count = found.found.features.len() as f64;
    for feature in &found.found.features {
        let (Measured::Profile([x, z]), Some([sx, sz])) = (feature.measured, feature.sigma) else { panic!() };
        let x_true = truth_x[feature.frame.unwrap() as usize];
        let off = [1e3 * x - x_true, 1e3 * z - (100.0 + SLOPE * x_true + lower_mm)];
        let (vx, vz, vxz) = (1e6 * sx * sx, 1e6 * sz * sz, 1e6 * feature.correlation * sx * sz);
        for (sum, axis) in sums.iter_mut().zip([along, across]) {
            let error = axis[0] * off[0] + axis[1] * off[1];
            let variance = axis[0] * axis[0] * vx + 2.0 * axis[0] * axis[1] * vxz + axis[1] * axis[1] * vz;
            sum[0] += error / count;
            sum[1] += error * error / variance / count;
        }
    }
    sums
}

/// Mean error of the support points of a plate square to it, mm, and their mean square in sigma.
fn support_errors(found: &ProfileSeams, plate: u32, lower_mm: f64, bow_mm: f64) -> [f64; 2] {
    let of_plate = found.found.stripes.iter().filter(|stripe| stripe.plate == plate);
    let points: Vec<_> =
        of_plate.flat_map(|stripe| stripe.points.map(|point| (point, 1e3 * stripe.sigma))).collect();
    let mut sums = [0.0; 2];
    for (point, sigma_mm) in &points {
        let Measured::Profile([x, z]) = point else { panic!() };
        let bowed_mm = bow_mm * (1e3 * x / 20.0).powi(2);
        let off_mm = (1e3 * z - (100.0 + SLOPE * 1e3 * x + lower_mm + bowed_mm)) / SLOPE.hypot(1.0);
        sums[0] += off_mm / points.len() as f64;
        sums[1] += (off_mm / sigma_mm).powi(2) / points.len() as f64;
    }
    sums
}

/// The mean square of the remainder over the stated variance.
fn within(errors: [f64; 2], most_bias_mm: f64, squares: [f64; 2]) {
    let fine = errors[0].abs() < most_bias_mm && errors[1] > squares[0] && errors[1] < squares[1];
    assert!(fine, "{errors:?}");
}

/// 600 numbers of unit variance: ± 0.06 for normal ones. A column on the edge that sees less than half of the plate may pass
/// as one behind it: half a column of bias in a seventh of the profiles.
const HONEST: [f64; 2] = [0.7, 1.3];

#[test]
fn the_edge_of_a_plate_is_as_good_as_it_says() {
    for (plates, side) in [([[-FAR, 2.03], NONE], 1), ([[-3.07, FAR], NONE], 0)] {
        let (profiles, shifts) = weave(&Scene::of(plates), 600, 6.0, 11);
        let found = seams(&profiles, None);
        assert_eq!(found.joint, ProfileJoint::Edge);
        assert!(found.found.features.len() > 570, "{:?}", found.reasons());
        let truth: Vec<f64> = shifts.iter().map(|by| plates[0][side] + by).collect();
        let [along, across] = errors(&found, &truth, 0.0);
        within(along, 0.02, HONEST);
        within(across, 0.001, HONEST);
        // One plate, as plate 0.
        assert_eq!(found.found.stripes.len(), found.found.features.len());
        assert!(found.found.stripes.iter().all(|stripe| stripe.plate == 0));
    }
}

#[test]
fn the_middle_of_a_gap_is_as_good_as_it_says_filled_or_not() {
    for (filled, lower_mm) in [(0.0, 0.0), (0.5, 0.0), (0.3, 0.4)] {
        let scene = Scene { filled, lower_mm, ..Scene::of([[-FAR, -0.71], [0.84, FAR]]) };
        let (profiles, shifts) = weave(&scene, 600, 6.0, 12);
        let found = seams(&profiles, None);
        assert_eq!(found.joint, ProfileJoint::Butt, "filled {filled}, lower by {lower_mm}");
        assert!(found.found.features.len() > 560, "{:?}", found.reasons());
        let truth: Vec<f64> = shifts.iter().map(|by| 0.5 * (0.84 - 0.71) + by).collect();
        let [along, across] = errors(&found, &truth, 0.5 * lower_mm);
        within(along, 0.02, HONEST);
        within(across, 0.001, HONEST);
        // Both plates, each at its own height.
        assert_eq!(found.found.stripes.len(), 2 * found.found.features.len());
        for (plate, lower_mm) in [(0, 0.0), (1, lower_mm)] {
            within(support_errors(&found, plate, lower_mm, 0.0), 0.001, HONEST);
        }
    }
}

#[test]
fn a_rounded_edge_is_in_the_sigma_and_one_that_is_no_edge_is_refused() {
    for rounded_mm in [0.0, 0.3, 0.5, 1.0, 1.2] {
        let scene = Scene { rounded_mm, ..Scene::of([[-FAR, 2.03], NONE]) };
        let (profiles, shifts) = weave(&scene, 300, 6.0, 13);
        let found = seams(&profiles, Some(ProfileJoint::Edge));
        assert!(found.found.features.len() > 270, "{:?}", found.reasons());
        let truth: Vec<f64> = shifts.iter().map(|by| 2.03 + by).collect();
        let [along, _] = errors(&found, &truth, 0.0);
        // The plate leaves its line by three sigma √(2 r 3σ) after the rounding begins, and has gone away by as much as on shortly before its end: the edge is
        // stated in the middle between, in every profile alike.
        assert!(along[0] < 0.02 && along[0] > -0.8 * rounded_mm - 0.1, "{along:?}");
        let scatter = scatter(&found, &truth);
        println!(
            "radius {rounded_mm}: bias {:.3} mm, error²/said {:.2}, scatter {scatter:.2}",
            along[0], along[1]
        );
        // 300 numbers of unit variance: ± 0.08.
        assert!(scatter < 1.3, "radius {rounded_mm}: {scatter}");
        // An interval is known to its twelfth root: at either end of it the error is 1.73 of that.
        assert!(along[1] < 3.0, "radius {rounded_mm}: {along:?}");
    }
    // Several columns lost at once look like the end of a face: its neighbours correct this. Of 12 mm a half of what is seen
    // is bent.
    for (rounded_mm, joint) in
        [2.0, 4.0, 12.0].into_iter().flat_map(|mm| [(mm, ProfileJoint::Edge), (mm, ProfileJoint::Butt)])
    {
        let plates =
            if joint == ProfileJoint::Edge { [[-FAR, 2.03], NONE] } else { [[-FAR, -0.7], [0.8, FAR]] };
        let scene = Scene { rounded_mm, ..Scene::of(plates) };
        let found = seams(&weave(&scene, 100, 6.0, 14).0, Some(joint));
        println!("radius {rounded_mm}, {joint:?}: {} left", found.found.features.len());
        assert!(found.found.features.is_empty(), "{rounded_mm}, {joint:?}: {:?}", found.reasons());
        assert!(found.reasons().contains_key(&NoSeam::RoundedEnd), "{:?}", found.reasons());
    }
}

/// A plate that is bowed all along is not rounded at its end.
#[test]
fn a_bowed_plate_keeps_its_edge() {
    for bow_mm in [0.1, -0.1, 0.3] {
        let scene = Scene { bow_mm, ..Scene::of([[-FAR, 2.03], NONE]) };
        let (profiles, shifts) = weave(&scene, 300, 6.0, 16);
        let found = seams(&profiles, Some(ProfileJoint::Edge));
        assert!(found.found.features.len() > 285, "{bow_mm}: {:?}", found.reasons());
        let truth: Vec<f64> = shifts.iter().map(|by| 2.03 + by).collect();
        let scatter = scatter(&found, &truth);
        println!("bow {bow_mm} mm: scatter {scatter:.2}");
        // The end of a strongly bowed plate leaves its line by about as much as counts as off it, a column sooner or later.
        assert!(scatter < if bow_mm.abs() < 0.2 { 1.3 } else { 2.0 }, "{bow_mm}: {scatter}");
    }
}

/// A line through a bowed face lies beside it nearly everywhere: its two support points are where it meets it. At 11 mm from
/// the middle of a face with a bow of 0.4 mm the two differ by 0.02 mm for each millimetre along the face, so a place wrong
/// by half a millimetre would be four sigma.
#[test]
fn support_points_of_a_bowed_plate_lie_on_it() {
    for bow_mm in [0.0, 0.2, -0.2, 0.4] {
        for plates in [[[-FAR, 15.0], NONE], [[-FAR, -0.71], [0.84, FAR]]] {
            let scene = Scene { bow_mm, ..Scene::of(plates) };
            let found = seams(&weave(&scene, 600, 3.0, 25).0, None);
            assert!(found.found.stripes.len() > 500, "{bow_mm}: {:?}", found.reasons());
            for plate in 0..if plates[1] == NONE { 1 } else { 2 } {
                let errors = support_errors(&found, plate, 0.0, bow_mm);
                println!("bow {bow_mm} mm, plate {plate}: {errors:?}");
                // 1200 errors of 0.003 mm: 0.0001 mm.
                within(errors, 0.001, HONEST);
            }
        }
    }
}

/// Mean square of errors along x about their mean, in sigma.
fn scatter(found: &ProfileSeams, truth_x: &[f64]) -> f64 {
    let off: Vec<[f64; 2]> = (found.found.features.iter())
        .map(|feature| {
            let (Measured::Profile([x, _]), Some([sx, _])) = (feature.measured, feature.sigma) else {
                panic!()
            };
            [1e3 * x - truth_x[feature.frame.unwrap() as usize], 1e3 * sx]
        })
        .collect();
    let mean = off.iter().map(|off| off[0]).sum::<f64>() / off.len() as f64;
    off.iter().map(|off| ((off[0] - mean) / off[1]).powi(2)).sum::<f64>() / off.len() as f64
}

#[test]
fn the_end_of_the_view_is_no_edge() {
    // All of the view is plate.
    let (profiles, _) = weave(&Scene::of([[-FAR, FAR], NONE]), 100, 6.0, 15);
    let found = seams(&profiles, Some(ProfileJoint::Edge));
    assert_eq!(found.found.features.len(), 0, "{:?}", found.reasons());
    assert_eq!(found.reasons().keys().collect::<Vec<_>>(), [&NoSeam::EndOfView]);
    // By default it is no joint either.
    assert_eq!(seams(&profiles, None).joint, ProfileJoint::Meeting);
    // The edge leaves the view now and then.
    let (profiles, shifts) = weave(&Scene::of([[-FAR, 16.0], NONE]), 400, 8.0, 16);
    let found = seams(&profiles, Some(ProfileJoint::Edge));
    let truth: Vec<f64> = shifts.iter().map(|by| 16.0 + by).collect();
    let visible = truth.iter().filter(|x| **x < 19.4).count();
    assert!(found.found.features.len() as f64 > 0.95 * visible as f64, "{visible}: {:?}", found.reasons());
    for feature in &found.found.features {
        let Measured::Profile([x, _]) = feature.measured else { panic!() };
        let off = 1e3 * x - truth[feature.frame.unwrap() as usize];
        assert!(off.abs() < 0.6, "{off} mm in profile {:?}", feature.frame);
    }
}

/// A trapezium that widens with the range, and a robot that also comes and goes.
#[test]
fn the_slanted_side_of_a_view_is_no_edge() {
    let mut noise = Noise(17);
    let profile = |number: usize| {
        let z = 100.0 + 20.0 * (0.17 * number as f64).sin();
        let half_width = 10.0 + 0.2 * (z - 80.0);
        let point = |k: i32| {
            let x = PITCH_MM * f64::from(k);
            let seen = x.abs() < half_width && !noise.happens(0.03);
            let z_m = (z + 0.02 * x + SIGMA_MM * noise.normal()) * 1e-3;
            seen.then_some(ProfilePoint { x_m: x * 1e-3, z_m, intensity: None })
        };
        Profile { stamp_ns: number as i64, frame: None, points: (-300..300).filter_map(point).collect() }
    };
    let profiles: Vec<Profile> = (0..200).map(profile).collect();
    let found = seams(&profiles, Some(ProfileJoint::Edge));
    assert_eq!(found.found.features.len(), 0, "{:?}", found.reasons());
}

#[test]
fn a_strip_with_both_ends_in_view_is_refused_by_name() {
    let (profiles, _) = weave(&Scene::of([[-8.0, 7.0], NONE]), 100, 6.0, 18);
    let found = seams(&profiles, Some(ProfileJoint::Edge));
    assert!(found.found.features.is_empty());
    assert_eq!(found.reasons().get(&NoSeam::BothEnds), Some(&100));
}

#[test]
fn gaps_of_another_width_and_second_gaps_are_refused_by_name() {
    let plain = Scene::of([[-FAR, -0.71], [0.84, FAR]]);
    let (mut profiles, shifts) = weave(&plain, 100, 6.0, 19);
    let mut noise = Noise(20);
    // A tack closes half of the gap in every tenth profile.
    for k in (0..100).step_by(10) {
        let tacked = Scene { plates: [[-FAR, -0.71 + shifts[k]], [0.1 + shifts[k], FAR]], ..plain };
        profiles[k] = tacked.profile(k, &mut noise);
    }
    let found = seams(&profiles, Some(ProfileJoint::Butt));
    assert!(found.reasons().get(&NoSeam::OddGap).is_some_and(|count| *count >= 8), "{:?}", found.reasons());
    // A scratch as wide as the gap.
    let scratched: Vec<Profile> = weave(&plain, 50, 3.0, 21)
        .0
        .into_iter()
        .map(|mut profile| {
            profile.points.retain(|point| !(8e-3..9.5e-3).contains(&point.x_m));
            profile
        })
        .collect();
    let found = seams(&scratched, Some(ProfileJoint::Butt));
    assert!(
        found.reasons().get(&NoSeam::SeveralGaps).is_some_and(|count| *count >= 40),
        "{:?}",
        found.reasons()
    );
    // No gap at all.
    let closed = weave(&Scene::of([[-FAR, FAR], NONE]), 50, 3.0, 22).0;
    assert_eq!(seams(&closed, Some(ProfileJoint::Butt)).reasons().get(&NoSeam::NoGap), Some(&50));
}

#[test]
fn what_is_seen_decides_the_joint() {
    // A lap whose lower plate is 2 mm behind, with and without half a millimetre of shadow.
    for shadow_mm in [0.0, 0.5] {
        let lap = Scene { lower_mm: 2.0, ..Scene::of([[-FAR, 0.0], [shadow_mm, FAR]]) };
        assert_eq!(seams(&weave(&lap, 60, 6.0, 23).0, None).joint, ProfileJoint::Lap, "{shadow_mm}");
    }
    // A gap of 1.5 mm between plates that are 0.5 mm out of line.
    let gap = Scene { lower_mm: 0.5, ..Scene::of([[-FAR, -0.75], [0.75, FAR]]) };
    assert_eq!(seams(&weave(&gap, 60, 6.0, 24).0, None).joint, ProfileJoint::Butt);
    assert_eq!(ProfileJoint::of(Joint::Groove), None);
    assert_eq!(ProfileJoint::of(Joint::VGroove), Some(ProfileJoint::Meeting));
}

/// As they come, profiles give the joint and the seams that all of them together do, a second later.
#[test]
fn a_stream_of_profiles_finds_what_is_found_afterwards() {
    for (plates, joint, seed) in [
        ([[-FAR, 2.03], NONE], ProfileJoint::Edge, 31),
        ([[-FAR, -0.71], [0.84, FAR]], ProfileJoint::Butt, 32),
        ([[-FAR, 0.0], [0.0, FAR]], ProfileJoint::Lap, 33),
    ] {
        let lower_mm = if joint == ProfileJoint::Lap { 3.0 } else { 0.0 };
        let (profiles, _) = weave(&Scene { lower_mm, ..Scene::of(plates) }, 610, 6.0, seed);
        let afterwards = seams(&profiles, None);
        assert_eq!(afterwards.joint, joint);
        for named in [None, Some(joint)] {
            let mut stream = ProfileStream::new(named);
            let mut found = Vec::new();
            for (number, profile) in profiles.iter().enumerate() {
                found.extend(stream.push(profile.clone()));
                // 34 profiles are a second and more.
                assert!(found.last().is_none_or(|last| last.frame.unwrap() as usize + 34 > number - 34));
            }
            found.extend(stream.finish());
            assert_eq!(stream.joint(), Some(joint));
            assert!(stream.finish().is_empty());
            let (here, there) = (found.len(), afterwards.found.features.len());
            assert!(
                here as f64 > 0.97 * there as f64 && here <= profiles.len(),
                "{joint:?}: {here} of {there}"
            );
            let mut compared = 0;
            for feature in &found {
                let same = afterwards.found.features.iter().find(|other| other.frame == feature.frame);
                let Some(other) = same else { continue };
                let (Measured::Profile(a), Measured::Profile(b)) = (feature.measured, other.measured) else {
                    panic!()
                };
                // What is lost at an end is told from fewer profiles: a share of a column's width.
                assert!((a[0] - b[0]).abs() < 0.3e-3 * PITCH_MM, "{joint:?}: {a:?} and {b:?}");
                compared += 1;
            }
            assert!(compared as f64 > 0.97 * here as f64);
        }
    }
}

/// The robot comes from a place with one plate in view: the second profile with its end does not decide for all others.
#[test]
fn a_stream_goes_over_to_the_joint_that_most_profiles_show() {
    let mut profiles = weave(&Scene::of([[-FAR, 2.03], NONE]), 45, 6.0, 34).0;
    let lap = Scene { lower_mm: 3.0, ..Scene::of([[-FAR, 0.0], [0.0, FAR]]) };
    profiles.extend(weave(&lap, 300, 6.0, 35).0);
    (0..).zip(&mut profiles).for_each(|(k, profile)| profile.stamp_ns = k * 30_000_000);
    let mut stream = ProfileStream::default();
    let found = profiles.into_iter().flat_map(|profile| stream.push(profile)).count();
    assert_eq!(stream.joint(), Some(ProfileJoint::Lap));
    assert!(found > 250, "{found}");
    // Nothing to be seen is nothing found.
    let mut nothing = ProfileStream::default();
    let empty = |k: i64| Profile { stamp_ns: k * 30_000_000, frame: None, points: Vec::new() };
    assert_eq!((0..200).flat_map(|k| nothing.push(empty(k))).count(), 0);
    assert_eq!(nothing.joint(), None);
}

/// The edge of a lap in a scan that weaves so much, by all profiles: mean error and combined standard deviation along x, mm.
/// Three lost columns in a row look like a shadow, in three of 8000 profiles: these outliers are left to the calibration.
fn edge_of_lap(at_mm: f64, amplitude_mm: f64, seed: u64) -> [f64; 2] {
    let plates = [[-FAR, at_mm], [at_mm, FAR]];
    let scene = Scene { lower_mm: 3.0, lost: [0.03; 2], mixed: 0.0, ..Scene::of(plates) };
    let (profiles, shifts) = weave(&scene, 200, amplitude_mm, seed);
    let found = seams(&profiles, Some(ProfileJoint::Lap));
    assert!(found.found.features.len() > 180, "{:?}", found.reasons());
    let (mut weights, mut sum) = (0.0, 0.0);
    for feature in &found.found.features {
        let (Measured::Profile([x, _]), Some([sx, _])) = (feature.measured, feature.sigma) else { panic!() };
        let off_mm = 1e3 * x - at_mm - shifts[feature.frame.unwrap() as usize];
        if off_mm.abs() < 1.5 * PITCH_MM {
            let weight = (1e3 * sx).powi(-2);
            weights += weight;
            sum += weight * off_mm;
        }
    }
    [sum / weights, weights.powf(-0.5)]
}

/// All profiles of an edge that stays between two columns have the same error, up to half a column; if the edge moves
/// through the columns, the errors differ.
#[test]
fn an_edge_that_stays_between_two_columns_is_known_to_a_column() {
    const PLACES: usize = 40;
    let mut square = 0.0;
    for k in 0..PLACES {
        let [off_mm, sigma_mm] = edge_of_lap(2.0 + 0.137 * k as f64, 0.0, 30 + k as u64);
        square += (off_mm / sigma_mm).powi(2) / PLACES as f64;
        assert!(sigma_mm > 0.9 * PITCH_MM / 12_f64.sqrt(), "{sigma_mm}");
    }
    // Squares of even distributions scatter by 0.9: the mean of 40 by 0.14.
    assert!((0.4..1.6).contains(&square), "{square}");
    let [off_mm, sigma_mm] = edge_of_lap(2.03, 6.0, 30);
    assert!(
        sigma_mm < 0.15 * PITCH_MM / 12_f64.sqrt() && off_mm.abs() < 4.0 * sigma_mm,
        "{off_mm} ± {sigma_mm}"
    );
}
