//! Plates that are bowed across their edge: the line through all of one passes beside its end, the edge point must not.

use crate::drawn;

use drawn::{Paper, Stroke, between, detector};
use trueline_dataset::{Measured, Profile, ProfilePoint};
use trueline_sim::noise::Noise;
use trueline_vision::profile::{ProfileJoint, ProfileSeams, seams};
use trueline_vision::{Joint, Picture};

const PITCH_MM: f64 = 0.1;
const SLOPE: f64 = 0.15;
const SIGMA_MM: f64 = 0.02;
const STEP_MM: f64 = 3.0;
const COUNT: usize = 300;
/// Distance from the edge at which a bow is what its number says, mm.
const REACH_MM: f64 = 25.0;

/// How a plate is bowed: `bow_mm (r / 25 mm)^power`.
#[derive(Clone, Copy, Debug)]
struct Bow {
    bow_mm: f64,
    power: i32,
}

fn edge_x(number: usize) -> f64 {
    6.0 * (0.21 * number as f64).sin()
}

/// A plate to the left of an edge that wanders by ± 6 mm, and another 3 mm below to its right unless it is alone.
fn profiles(bow: Bow, half_width_mm: f64, joint: ProfileJoint) -> Vec<Profile> {
    let mut noise = Noise::new(3, 1);
    let columns = (half_width_mm / PITCH_MM) as i32;
    let mut profile = |number: usize| {
        let point = |k: i32| {
            let x = PITCH_MM * f64::from(k);
            let from_edge = x - edge_x(number);
            let lower_mm = if from_edge < 0.0 { 0.0 } else { STEP_MM };
            let is_seen = from_edge < 0.0 || joint == ProfileJoint::Lap;
            let bowed_mm = bow.bow_mm * (from_edge.abs() / REACH_MM).powi(bow.power);
            let z = 130.0 + SLOPE * x + lower_mm + bowed_mm + noise.normal(SIGMA_MM);
            let seen = is_seen && !noise.happens(0.03);
            seen.then_some(ProfilePoint { x_m: x * 1e-3, z_m: z * 1e-3, intensity: None })
        };
        let points = (-columns..columns).filter_map(point).collect();
        Profile { stamp_ns: number as i64 * 30_000_000, frame: Some(number as u64), points }
    };
    (0..COUNT).map(&mut profile).collect()
}

/// Mean errors of the edge points along the plate and square to it, mm, and the mean square of the latter over what is said.
fn errors(found: &ProfileSeams) -> ([f64; 2], f64) {
    let length = SLOPE.hypot(1.0);
    let (along, across) = ([1.0 / length, SLOPE / length], [-SLOPE / length, 1.0 / length]);
    let (mut mean, mut square) = ([0.0; 2], 0.0);
    let count = found.found.features.len() as f64;
    for feature in &found.found.features {
        let (Measured::Profile([x, z]), Some([sx, sz])) = (feature.measured, feature.sigma) else { panic!() };
        let true_x = edge_x(feature.frame.unwrap() as usize);
        let off = [1e3 * x - true_x, 1e3 * z - (130.0 + SLOPE * true_x)];
        let by = |axis: [f64; 2]| axis[0] * off[0] + axis[1] * off[1];
        let [a, b] = across;
        let shared = 2.0 * a * b * feature.correlation * sx * sz;
        let variance_mm2 = 1e6 * (a * a * sx * sx + shared + b * b * sz * sz);
        mean = [mean[0] + by(along) / count, mean[1] + by(across) / count];
        square += by(across).powi(2) / variance_mm2 / count;
    }
    (mean, square)
}

/// A line through x₁ and x₂ of a parabola is x₁ x₂ beside its vertex. Of a face with points evenly between 1.6 and 8 mm from the edge (x₁ x₂ =
/// 19.6 mm²) that is 0.0063 mm for 0.2 mm at 25 mm; of all of a face from 2 to 25 mm it is 0.044 mm, and to 40 mm 0.10 mm.
#[test]
fn edges_of_profiles_are_on_their_bowed_plates() {
    let bows = [(0.0, 2), (0.2, 2), (-0.2, 2), (0.2, 3)].map(|(bow_mm, power)| Bow { bow_mm, power });
    for (joint, half_width_mm) in
        [(ProfileJoint::Lap, 25.0), (ProfileJoint::Lap, 40.0), (ProfileJoint::Edge, 25.0)]
    {
        for bow in bows {
            let found = seams(&profiles(bow, half_width_mm, joint), Some(joint));
            let left = found.found.features.len();
            let ([along, across], square) = errors(&found);
            println!(
                "{joint:?}, ± {half_width_mm} mm, {bow:?}: {left}, {along:.4} {across:.4} mm, {square:.2}"
            );
            assert!(left * 100 > COUNT * 95, "{:?}", found.reasons());
            // 300 errors of 0.008 mm have a mean of ± 0.0005 mm, of half a column ± 0.002 mm; an end over nothing counts the lost columns.
            assert!(along.abs() < 0.02, "{bow:?}: {along}");
            assert!(across.abs() < 0.008, "{bow:?}: {across}");
            // Mean of 300 squares: 1 ± 0.08; with the bow's 0.0063 mm, ¾ of 0.008 mm, 1.6.
            assert!((0.7..2.0).contains(&square), "{bow:?}: {square}");
        }
    }
}

/// A stripe that leaves the line of its end by 4 px over 400 px, in short strokes.
#[test]
fn edges_in_pictures_are_on_their_bowed_stripes() {
    const RUNS: u64 = 4;
    let size = [1280, 1024];
    let edge = [700.3, 600.6];
    for bow_px in [4.0, -4.0, 0.0] {
        let at = |r: f64| [edge[0] - r, edge[1] + bow_px * (r / 400.0).powi(2)];
        let (mut mean, mut square) = (0.0, 0.0);
        for seed in 0..RUNS {
            let mut paper = Paper::new(size, seed);
            // Each overlaps the one before it: ends fade.
            (0..20).rev().for_each(|k| {
                let [from, to] = [f64::from(k + 1) * 20.0 + 3.0, f64::from(k) * 20.0].map(at);
                paper.stroke(&between(from, to, 2.0));
            });
            paper.stroke(&Stroke::new([edge[0], edge[1] - 60.0], 0.0, 400.0, 2.0));
            let levels = paper.levels(0.0);
            let picture = Picture::new(size[0], size[1], &levels).unwrap();
            let seam = detector(size).detect(&picture, Joint::Lap).unwrap().seam;
            let off_px = seam.pixel.y - edge[1];
            mean += off_px / RUNS as f64;
            square += off_px * off_px / seam.covariance_px2.m22 / RUNS as f64;
        }
        println!("bow {bow_px} px: {mean:.3} px, {square:.2}");
        // Four errors of 0.035 px; the 80 px that end 30 px before the edge leave x₁ x₂ = 47 · 93 px² of (400 px)²: 0.11 px.
        assert!(mean.abs() < 0.17, "{bow_px}: {mean}");
        // A mean of four squares: 1 ± 0.7.
        assert!(bow_px != 0.0 || square < 3.0, "{square}");
    }
}

/// Thickness of the stripes below, and how far they are known to be bowed, px.
const TIP_SIGMA_PX: f64 = 2.0;
const TIP_BOW_PX: f64 = 12.0;
const TIP_REACH_PX: f64 = 400.0;
/// How much of a stripe says how high its end is, px: 8 mm are 64 px here, and no less is looked at than this.
const TIP_PX: f64 = 80.0;
/// How far before its end the search for it begins, px.
const SEARCHED_PX: f64 = 30.0;

/// How far beside a parabola's end the line through a stretch of it passes that ends so far before, px: the parabola is
/// bow (r / reach)², and its line through a stretch of length L has the mean of r² about the middle, L² / 12, besides it.
fn beside_end_px(before_px: f64) -> f64 {
    let middle_px = before_px + 0.5 * TIP_PX;
    TIP_BOW_PX * (middle_px * middle_px - TIP_PX * TIP_PX / 12.0) / (TIP_REACH_PX * TIP_REACH_PX)
}

/// What says how high an end is reaches to where its light begins to fade, and not only to where the search for it begins.
#[test]
fn the_last_of_a_stripe_says_how_high_its_end_is() {
    const RUNS: u64 = 4;
    let size = [1280, 1024];
    // The other end lies so near to the picture's border that it is not the plate's.
    let edge = [440.3, 600.6];
    // The end fades over two blurs of at most 0.9 px, and a slant would take one flank 1.5 thicknesses before the other.
    let [expected_px, earlier_px] = [2.0 * 0.9 + 1.5 * TIP_SIGMA_PX, SEARCHED_PX].map(beside_end_px);
    for sign in [1.0, -1.0] {
        let at = |r: f64| [edge[0] - r, edge[1] + sign * TIP_BOW_PX * (r / TIP_REACH_PX).powi(2)];
        let mut mean_px = 0.0;
        for seed in 0..RUNS {
            let mut paper = Paper::new(size, 40 + seed);
            // Each overlaps the one before it: ends fade. Chords of 20 px leave the parabola by less than 0.01 px.
            (0..20).rev().for_each(|k| {
                let [from, to] = [f64::from(k + 1) * 20.0 + 3.0, f64::from(k) * 20.0].map(at);
                paper.stroke(&between(from, to, TIP_SIGMA_PX));
            });
            let levels = paper.levels(0.0);
            let picture = Picture::new(size[0], size[1], &levels).unwrap();
            let seam = detector(size).detect(&picture, Joint::Edge).unwrap().seam;
            // The parabola's end lies on the other side of the line than its bow.
            mean_px -= sign * (seam.pixel.y - edge[1]) / RUNS as f64;
        }
        println!(
            "bow {sign}: {mean_px:.3} px, expected {expected_px:.3}, {earlier_px:.3} px from {SEARCHED_PX} px before"
        );
        // Four errors of 0.035 px.
        let chance_px = 4.0 * 0.035 / (RUNS as f64).sqrt();
        assert!(earlier_px > expected_px + 2.0 * chance_px);
        assert!((-chance_px..expected_px + chance_px).contains(&mean_px), "{sign}: {mean_px}");
    }
}

/// A stretch of 80 px has 20 grains of speckle in a row, and what they scatter by says little of how well they are known: all of
/// the stripe, more than a thousand px, says that. Told from n values with a kurtosis κ, the logarithm of a standard deviation
/// scatters by √((κ − 1) / 4n): light that has an exponential distribution has κ = 9, 0.32 for 20 grains and 0.09 for 270.
#[test]
fn the_height_of_an_end_has_the_noise_of_all_of_its_stripe() {
    const RUNS: u64 = 48;
    const GRAIN_PX: usize = 4;
    let size = [1280, 1024];
    let (mut count, mut square, mut sum, mut sum2) = (0.0, 0.0, 0.0, 0.0);
    for seed in 0..RUNS {
        let mut paper = Paper::new(size, 80 + seed);
        paper.stroke(&Stroke {
            grain_px: GRAIN_PX,
            brightness: 0.25,
            ..between([-50.0, 600.6], [1150.3, 600.6], 3.0)
        });
        let levels = paper.levels(0.0);
        let picture = Picture::new(size[0], size[1], &levels).unwrap();
        // Where the last few grains are on one side an end looks rounded, and is refused.
        let Ok(found) = detector(size).detect(&picture, Joint::Edge) else { continue };
        let (off_px, sigma_px) = (found.seam.pixel.y - 600.6, found.seam.covariance_px2.m22.sqrt());
        count += 1.0;
        square += (off_px / sigma_px).powi(2);
        sum += sigma_px.ln();
        sum2 += sigma_px.ln().powi(2);
    }
    let [square, sum, sum2] = [square, sum, sum2].map(|sum| sum / count);
    let scatter = (sum2 - sum * sum).sqrt();
    assert!(count > 0.9 * RUNS as f64, "{count}");
    println!(
        "{count} found, ± {:.3} px, scatter of its logarithm {scatter:.3}, mean square {square:.2}",
        sum.exp()
    );
    assert!(scatter < 0.3, "{scatter}");
    // A mean of 48 squares: 1 ± 0.2.
    assert!((0.4..1.6).contains(&square), "{square}");
}
