//! Round faces, and shapes between straight ones: a pipe, a ball or a groove is not a corner, and beads, throats and rounded
//! edges are not part of the faces.

use std::path::{Path, PathBuf};
use trueline_dataset::{Measured, Profile, ProfilePoint};
use trueline_sim::noise::Noise;
use trueline_vision::profile::{NoSeam, ProfileJoint, ProfileSeams, RadiusUm, seams};

/// How a profiler sees.
#[derive(Clone, Copy, Debug)]
struct Look {
    sigma_mm: f64,
    step_mm: f64,
    /// Ranges are whole multiples of this, mm.
    quantum_mm: f64,
    /// Half of its view, mm.
    half_mm: f64,
}

const USUAL: Look = Look { sigma_mm: 0.02, step_mm: 0.1, quantum_mm: 0.0, half_mm: 30.0 };
const COUNT: usize = 60;

/// Place of the shape in a profile, mm.
fn middle_mm(number: usize) -> f64 {
    4.0 * (0.31 * number as f64).sin()
}

/// Profiles of a shape: its range at a distance from its middle, mm. Two columns in a hundred are lost, and one in two hundred is false.
fn scan(look: Look, shape: impl Fn(f64) -> Option<f64>) -> Vec<Profile> {
    let mut noise = Noise::new(3, 1);
    let columns = (look.half_mm / look.step_mm) as i32;
    let mut profile = |number: usize| {
        let point = |k: i32| {
            let x = look.step_mm * (f64::from(k) + 0.013 * number as f64);
            let mut z = shape(x - middle_mm(number))? + noise.normal(look.sigma_mm);
            if look.quantum_mm > 0.0 {
                z = (z / look.quantum_mm).round() * look.quantum_mm;
            }
            if noise.happens(0.005) {
                z += 3.0;
            }
            let is_seen = !noise.happens(0.02);
            is_seen.then_some(ProfilePoint { x_m: x * 1e-3, z_m: (150.0 + z) * 1e-3, intensity: None })
        };
        let points = (-columns..columns).filter_map(point).collect();
        Profile { stamp_ns: number as i64 * 30_000_000, frame: Some(number as u64), points }
    };
    (0..COUNT).map(&mut profile).collect()
}

/// The range of a circle whose nearest point is at the middle, as far as it is seen: to a part of its radius.
fn arc(radius_mm: f64, part: f64, x: f64) -> Option<f64> {
    (x.abs() < part * radius_mm).then(|| radius_mm - (radius_mm * radius_mm - x * x).sqrt())
}

fn is_round(found: &ProfileSeams) -> Option<f64> {
    let radii = found.not_found.iter().filter_map(|(_, reason)| match reason {
        NoSeam::RoundFace(radius) => Some(radius.mm()),
        _ => None,
    });
    let radii: Vec<f64> = radii.collect();
    (2 * radii.len() >= found.not_found.len()).then(|| radii[0])
}

#[test]
fn a_round_face_is_no_corner_and_its_radius_is_told() {
    let looks = [
        USUAL,
        Look { sigma_mm: 0.003, step_mm: 0.03, ..USUAL },
        Look { sigma_mm: 0.1, step_mm: 0.3, quantum_mm: 0.1, ..USUAL },
        Look { sigma_mm: 0.01, quantum_mm: 0.05, ..USUAL },
    ];
    for radius_mm in [8.0, 12.7, 20.0, 40.0, 80.0] {
        for look in looks {
            for (part, sign) in [(0.7, 1.0), (0.86, 1.0), (0.97, 1.0), (0.86, -1.0)] {
                let found = seams(&scan(look, |x| Some(sign * arc(radius_mm, part, x)?)), None);
                assert!(
                    found.found.features.is_empty(),
                    "{radius_mm} mm, {part}, {look:?}: {:?}",
                    found.joint
                );
                let told_mm = is_round(&found)
                    .unwrap_or_else(|| panic!("{radius_mm} mm, {look:?}: {:?}", found.reasons()));
                println!("{} mm, {} x {sign}: {} mm", radius_mm, part, told_mm);
                // By chords of noisy faces from a third of a radius on: a fifth.
                assert!(
                    (told_mm / radius_mm - 1.0).abs() < 0.2,
                    "{radius_mm} mm, {part}, {look:?}: {told_mm} mm"
                );
            }
        }
    }
}

#[test]
fn small_and_large_radii_are_no_corner() {
    for radius_mm in [5.0, 200.0] {
        for (part, sign) in [(0.5, 1.0), (0.86, 1.0), (0.86, -1.0)] {
            let found = seams(&scan(USUAL, |x| Some(sign * arc(radius_mm, part, x)?)), None);
            assert!(
                found.found.features.is_empty(),
                "{radius_mm} mm, {part}: {:?}, {:?}",
                found.joint,
                found.reasons()
            );
        }
    }
}

/// A ball on a plate is not a gap, and a ball with only a flank in view is not an edge.
#[test]
fn a_ball_on_a_plate_is_no_joint() {
    for radius_mm in [5.0, 8.0, 12.7, 20.0] {
        for part in [0.8, 1.0] {
            let on_plate = scan(USUAL, |x| {
                arc(radius_mm, part, x).or(Some(radius_mm * if part < 1.0 { 0.4 } else { 2.0 }))
            });
            let found = seams(&on_plate, None);
            assert!(found.found.features.is_empty(), "{radius_mm} mm, {part}: {:?}", found.joint);
        }
        let cut = seams(&scan(USUAL, |x| arc(radius_mm, 0.9, x + 25.0)), None);
        assert!(cut.found.features.is_empty(), "{radius_mm} mm: {:?}", cut.joint);
    }
}

#[test]
fn a_radius_is_told_with_two_digits() {
    for (mm, words) in [(3.456, "3.5 mm"), (12.7, "13 mm"), (203.0, "203 mm")] {
        let reason = NoSeam::RoundFace(RadiusUm::of_mm(mm)).to_string();
        assert_eq!(reason, format!("a round face (radius about {words}) and no corner"));
    }
}

/// Half of the median of the squares of two normal numbers: ln 2.
const MEDIAN_OF_TWO: f64 = std::f64::consts::LN_2;

/// Root mean square of the errors of seams, mm, the median of their squares over the stated variance (1 is honest), and the
/// number found.
fn errors(found: &ProfileSeams) -> ([f64; 2], f64, usize) {
    let (mut squares, mut stated) = ([0.0; 2], Vec::new());
    for feature in &found.found.features {
        let (Measured::Profile([x, z]), Some([sx, sz])) = (feature.measured, feature.sigma) else {
            panic!("a profile")
        };
        let off = [1e3 * x - middle_mm(feature.frame.unwrap() as usize), 1e3 * z - 150.0];
        let [a, b] = [off[0] / (1e3 * sx), off[1] / (1e3 * sz)];
        let r = feature.correlation;
        stated.push((a * a - 2.0 * r * a * b + b * b) / (1.0 - r * r) / 2.0 / MEDIAN_OF_TWO);
        squares = [squares[0] + off[0] * off[0], squares[1] + off[1] * off[1]];
    }
    let count = stated.len();
    stated.sort_by(f64::total_cmp);
    (squares.map(|square| (square / count as f64).sqrt()), stated[count / 2], count)
}

/// The median of 60 squares of two normal numbers is known to a fifth (its density there is 1/2, and 1 / (2 √60 · ½ ln 2) is 0.19); what is allowed for a bow that is not there makes it less.
fn assert_honest(name: &str, found: &ProfileSeams, most_mm: f64) {
    let (rms_mm, stated, count) = errors(found);
    assert_eq!(found.joint, ProfileJoint::Meeting, "{name}");
    assert!(count * 10 >= COUNT * 9, "{name}: {:?}", found.reasons());
    assert!(rms_mm.iter().all(|rms_mm| *rms_mm < most_mm), "{name}: {rms_mm:?} mm");
    assert!((0.1..1.6).contains(&stated), "{name}: {stated}");
}

/// A fillet of 90° under a bead: a circle about the corner that bulges to the sensor, or a throat, a circle that touches both plates. Without a bead the corner is known to
/// 0.006 mm; a bead of 12 mm of plates of 26 to 34 mm leaves half of them, and what their bow may be over the rest, 0.1 mm.
#[test]
fn a_fillet_under_a_bead_is_where_its_plates_meet() {
    for half_mm in [30.0, 20.0] {
        for radius_mm in [0.0, 3.0, 5.0, 8.0, 10.0, 12.0] {
            let reach_mm = radius_mm / 2.0_f64.sqrt();
            let circle = |x: f64| (radius_mm * radius_mm - x * x).max(0.0).sqrt();
            let convex = |x: f64| if x.abs() < reach_mm { (-x.abs()).min(-circle(x)) } else { -x.abs() };
            let throat = |x: f64| if x.abs() < reach_mm { circle(x) - 2.0 * reach_mm } else { -x.abs() };
            let look = Look { half_mm, ..USUAL };
            // A bead of 12 mm covers more than half of plates of 16 mm: it is a round face then.
            if half_mm > 20.0 || radius_mm < 12.0 {
                assert_honest(
                    &format!("bead {radius_mm} mm, ± {half_mm} mm"),
                    &seams(&scan(look, |x| Some(convex(x))), None),
                    0.15,
                );
            }
            assert_honest(
                &format!("throat {radius_mm} mm, ± {half_mm} mm"),
                &seams(&scan(look, |x| Some(throat(x))), None),
                0.15,
            );
        }
    }
}

/// The same under a bead of 8 mm with other noise and columns: 0.03 mm of the usual ones, in proportion to the noise and to the root of the columns' distance.
#[test]
fn beads_are_left_out_however_noisy_and_coarse_the_profiles_are() {
    let (radius_mm, reach_mm) = (8.0, 8.0 / 2.0_f64.sqrt());
    let bead = |x: f64| {
        let circle = (radius_mm * radius_mm - x * x).max(0.0_f64).sqrt();
        if x.abs() < reach_mm { (-x.abs()).min(-circle) } else { -x.abs() }
    };
    for (sigma_mm, step_mm, most_mm) in
        [(0.003, 0.02, 0.005), (0.1, 0.1, 0.3), (0.05, 0.3, 0.25), (0.02, 0.6, 0.15)]
    {
        let found = seams(&scan(Look { sigma_mm, step_mm, ..USUAL }, |x| Some(bead(x))), None);
        assert_honest(&format!("{sigma_mm} mm, columns of {step_mm} mm"), &found, most_mm);
    }
}

/// An edge that is rounded lies where its faces would meet.
#[test]
fn a_rounded_edge_is_where_its_faces_would_meet() {
    for slope in [1.0, 0.577] {
        for radius_mm in [0.3, 1.0, 2.0, 3.0, 5.0, 8.0] {
            let angle = f64::atan(slope);
            let rounded = |x: f64| {
                let circle = radius_mm / angle.cos() - (radius_mm * radius_mm - x * x).max(0.0).sqrt();
                Some(if x.abs() < radius_mm * angle.sin() { circle } else { slope * x.abs() })
            };
            assert_honest(
                &format!("{radius_mm} mm, slope {slope}"),
                &seams(&scan(Look { half_mm: 25.0, ..USUAL }, rounded), None),
                0.06,
            );
        }
    }
}

/// A plate that stands on a pipe: the pipe is round, and there is a corner all the same. Its ± allows for the bend.
#[test]
fn a_plate_on_a_pipe_is_a_corner() {
    for radius_mm in [30.0, 50.0, 100.0, 200.0] {
        // The pipe falls away to the left of the corner by 45°.
        let from_axis_mm = radius_mm / 2.0_f64.sqrt();
        let shape = |x: f64| {
            let from_axis = x + from_axis_mm;
            let is_seen = from_axis.abs() < 0.95 * radius_mm;
            let pipe = from_axis_mm - (radius_mm * radius_mm - from_axis * from_axis).max(0.0).sqrt();
            if x >= 0.0 { Some(-x) } else { is_seen.then_some(pipe) }
        };
        assert_honest(
            &format!("pipe of {radius_mm} mm"),
            &seams(&scan(Look { half_mm: 25.0, ..USUAL }, shape), None),
            0.05,
        );
    }
}

fn real_profiles() -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")).join("data/robcalibrator_fanuc")
}

/// The profile in a file of OpenCV's YAML: `scan_line` lists x, 0, z of each column in mm, `.Nan` where nothing came back.
fn read_profile(file: &Path, number: usize) -> Profile {
    let text = std::fs::read_to_string(file).unwrap();
    let list = text.split_once("scan_line: [").unwrap().1.split_once(']').unwrap().0;
    let numbers: Vec<f64> = list.split(',').map(|cell| cell.trim().parse().unwrap_or(f64::NAN)).collect();
    let columns = numbers.chunks_exact(3).filter(|column| column.iter().all(|number| number.is_finite()));
    let points =
        columns.map(|column| ProfilePoint { x_m: column[0] * 1e-3, z_m: column[2] * 1e-3, intensity: None });
    Profile { stamp_ns: number as i64 * 1_000_000_000, frame: Some(number as u64), points: points.collect() }
}

/// Profiles of a ball of 12.7 mm radius and of one of 40 mm: circles of these radii or smaller. Three of the first ten see hardly more than reflections.
#[test]
fn real_balls_are_no_corners() {
    let folder = real_profiles();
    if !folder.exists() {
        use std::io::Write;
        writeln!(std::io::stderr(), "SKIPPED: real_balls_are_no_corners: no {}", folder.display()).unwrap();
        return;
    }
    let small: Vec<PathBuf> = (1..=10).map(|k| folder.join(format!("ball/{k}_3C_line.yml"))).collect();
    let large: Vec<PathBuf> = (1..=15).map(|k| folder.join(format!("p{k}.yml"))).collect();
    for (files, radius_mm) in [(small, 12.7), (large, 40.0)] {
        let profiles: Vec<Profile> =
            files.iter().enumerate().map(|(k, file)| read_profile(file, k)).collect();
        assert!(profiles.iter().all(|profile| profile.points.len() > 50), "{radius_mm} mm");
        let found = seams(&profiles, None);
        println!("{radius_mm} mm: {:?}", found.reasons());
        assert!(found.found.features.is_empty(), "{radius_mm} mm: {:?}", found.joint);
        let told_mm = is_round(&found).unwrap();
        // A plane cuts a ball beside its middle.
        assert!((0.3 * radius_mm..1.1 * radius_mm).contains(&told_mm), "{told_mm}");
    }
}
