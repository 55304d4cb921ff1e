//! The corner of laser profiles with known truth: where it is, how well, and when there is none.

use nalgebra::Vector2;
use trueline_dataset::{Measured, Profile, ProfilePoint};
use trueline_vision::profile::{NoSeam, ProfileFinder, seams};

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
}

/// Two faces of given slopes that meet at a corner, every `dx` mm over ±20 mm about it.
fn profile(corner: [f64; 2], slopes: [f64; 2], sigma_mm: f64, noise: &mut Noise) -> Vec<[f64; 2]> {
    (0..400)
        .map(|k| {
            let x = corner[0] - 17.03 + 0.1 * f64::from(k);
            let from = x - corner[0];
            [x, corner[1] + from * slopes[usize::from(from > 0.0)] + sigma_mm * noise.normal()]
        })
        .collect()
}

#[test]
fn the_corner_is_exact_without_noise_at_any_angle() {
    for slopes in [[-1.0, 1.0], [0.2, -0.5], [-3.0, 0.4], [0.0, 1.7]] {
        let points = profile([1.25, -3.5], slopes, 0.0, &mut Noise(1));
        let found = ProfileFinder::default().find(&points).unwrap();
        // The faces are exact lines: rounding of 20 mm.
        assert!((found.point_mm - Vector2::new(1.25, -3.5)).norm() < 1e-9, "{slopes:?}: {found:?}");
        // A scan of such points is weighed by what is stated: never by nothing.
        let sigmas = found.covariance_mm2.diagonal().map(f64::sqrt);
        assert!(sigmas.iter().all(|sigma| *sigma > 1e-5), "{sigmas}");
        let angle = (slopes[1].atan() - slopes[0].atan()).abs();
        assert!((found.angle_rad - angle.min(std::f64::consts::PI - angle)).abs() < 1e-9);
    }
}

/// Mean of the squared errors of corners by what is said of them, of faces bowed by so much (standard deviation, mm, at 25 mm from the corner), by the square
/// of the distance and by its cube each.
fn squared_error_of_corners(bow_mm: f64, noise: &mut Noise) -> f64 {
    let slopes: [f64; 2] = [-0.9, 0.7];
    let mut finder = ProfileFinder::default();
    let runs = 400;
    let mut squared = 0.0;
    for _ in 0..runs {
        let bows_mm = [0; 4].map(|_| bow_mm * noise.normal());
        let mut points = profile([0.0, 5.0], slopes, 0.05, noise);
        for point in &mut points {
            let face = usize::from(point[0] > 0.0);
            let per_x = slopes[face].hypot(1.0);
            let from_corner = point[0].abs() * per_x / 25.0;
            // Square to the face; the range shows more of it.
            point[1] += per_x * from_corner.powi(2) * (bows_mm[face] + from_corner * bows_mm[2 + face]);
        }
        let found = finder.find(&points).unwrap();
        let off = found.point_mm - Vector2::new(0.0, 5.0);
        squared += (off.transpose() * found.covariance_mm2.try_inverse().unwrap() * off)[(0, 0)];
    }
    squared / f64::from(runs)
}

/// Ranges are noisy along z. A line by distances from its feet, which move along the face with the noise, is turned by as much in every profile: 0.03 mm at the
/// corner, ten times what 1,600 profiles are known by.
#[test]
fn much_noise_does_not_move_the_mean_of_many_corners() {
    let mut finder = ProfileFinder::default();
    for slopes in [[-1.0, 1.0], [1.0, -1.0], [0.2, 1.5]] {
        let mut noise = Noise(11);
        let (runs, mut mean, mut variance) = (1600, Vector2::zeros(), Vector2::zeros());
        for _ in 0..runs {
            let found = finder.find(&profile([0.0, 5.0], slopes, 0.3, &mut noise)).unwrap();
            mean += (found.point_mm - Vector2::new(0.0, 5.0)) / f64::from(runs);
            variance += found.covariance_mm2.diagonal() / f64::from(runs).powi(2);
        }
        println!("{slopes:?}: {mean:?} of {:?}", variance.map(f64::sqrt));
        assert!(mean.iter().zip(&variance).all(|(off, v)| off.abs() < 4.0 * v.sqrt()), "{mean} {variance}");
    }
}

#[test]
fn the_covariance_is_the_spread_of_many_profiles() {
    let mut noise = Noise(7);
    // Mean of 400 chi-squares of two: 2 ± 0.1. The robust fit is some 5 % less sure than least squares, and its scale is
    // estimated: 20 % are allowed.
    let mean = squared_error_of_corners(0.2, &mut noise);
    assert!((1.6..2.4).contains(&mean), "{mean}");
    // Flat faces scatter by less: what is allowed for their bow is not there. Never by more, and not by nothing.
    let mean = squared_error_of_corners(0.0, &mut noise);
    assert!((1.0..2.2).contains(&mean), "{mean}");
}

/// Half of what a profiler sees of bowed faces, mm.
const HALF_VIEW_MM: f64 = 30.0;
/// Slopes of faces that meet at the origin.
const BOWED_SLOPES: [f64; 2] = [-1.4, 0.7];

/// The height of a bowed face above the seam.
fn bowed(x: f64, bow_mm: f64, power: i32) -> f64 {
    BOWED_SLOPES[usize::from(x > 0.0)] * x + bow_mm * (x.abs() / 25.0).powi(power)
}

/// Faces bowed by this amount 25 mm from the seam, with new column positions in each profile. Of a hundred columns one is a
/// reflection, three are lost, and beyond the view's border one returns something.
fn bowed_profile(bow_mm: f64, power: i32, noise: &mut Noise) -> Vec<[f64; 2]> {
    let phase = noise.uniform();
    let column = |k: i32| {
        let x = 0.1 * (f64::from(k) + phase);
        let is_in_view = x.abs() < HALF_VIEW_MM;
        let is_false = noise.uniform() < 0.01;
        let is_seen = if is_in_view { noise.uniform() > 0.03 } else { is_false };
        let off = if is_false { 12.0 * noise.uniform() - 6.0 } else { 0.02 * noise.normal() };
        is_seen.then_some([x, bowed(x, bow_mm, power) + off])
    };
    (-340..340).filter_map(column).collect()
}

#[test]
fn bowed_faces_meet_where_their_surfaces_do_wherever_the_columns_end() {
    for (bow_mm, power) in [(0.0, 2), (0.05, 2), (0.2, 2), (-0.2, 2), (0.2, 3)] {
        let mut noise = Noise(11);
        let mut finder = ProfileFinder::default();
        let runs = 400;
        let (mut squared, mut mean) = (0.0, Vector2::zeros());
        for _ in 0..runs {
            let found = finder.find(&bowed_profile(bow_mm, power, &mut noise)).unwrap();
            let off = found.point_mm;
            let inverse = found.covariance_mm2.try_inverse().unwrap();
            squared += (off.transpose() * inverse * off)[(0, 0)] / f64::from(runs);
            mean += off / f64::from(runs);
        }
        // As above; a line that ended at whatever column comes next gave 8 for 0.2 mm.
        assert!((1.6..2.4).contains(&squared), "{bow_mm} mm, power {power}: {squared}");
        // Four standard deviations (1.6 µm) of a mean of 400, and the half column and the one in thirty that is lost before the border, by which a bow of
        // 0.2 mm moves the corner by 0.5 µm.
        assert!(mean.amax() < 2.1e-3, "{bow_mm} mm, power {power}: {mean}");
    }
}

#[test]
fn spatter_and_holes_do_not_move_it() {
    let mut noise = Noise(3);
    let mut points = profile([0.0, 0.0], [-0.8, 0.8], 0.02, &mut noise);
    for point in points.iter_mut().step_by(7) {
        point[1] += 1.0 + 20.0 * noise.uniform();
    }
    points.drain(150..165);
    let found = ProfileFinder::default().find(&points).unwrap();
    // 0.02 mm over the root of some 150 points of a face, extrapolated to its end: 0.005 mm; five of them.
    assert!(found.point_mm.norm() < 0.025, "{found:?}");
}

#[test]
fn the_order_of_the_points_does_not_matter() {
    let mut points = profile([0.3, 0.1], [-0.8, 0.5], 0.02, &mut Noise(5));
    let forwards = ProfileFinder::default().find(&points).unwrap();
    points.reverse();
    assert_eq!(ProfileFinder::default().find(&points).unwrap(), forwards);
}

#[test]
fn what_is_no_corner_says_so() {
    let mut finder = ProfileFinder::default();
    let mut noise = Noise(11);
    assert_eq!(finder.find(&profile([0.0, 0.0], [0.3, 0.3], 0.02, &mut noise)), Err(NoSeam::NoAngle));
    assert_eq!(finder.find(&[[0.0, 1.0]; 5]), Err(NoSeam::TooFewPoints));
    assert_eq!(finder.find(&[]), Err(NoSeam::TooFewPoints));
    let wild: Vec<[f64; 2]> = (0..300).map(|k| [0.1 * f64::from(k), 30.0 * noise.uniform()]).collect();
    assert!(finder.find(&wild).is_err());
    // All at one place: no direction.
    assert!(finder.find(&[[1.0, 2.0]; 50]).is_err());
}

/// Mean of chi-squares with one degree each, of errors square to a face at its two support points, and how they correlate.
#[test]
fn support_points_of_the_faces_are_as_good_as_they_say_and_independent() {
    let mut noise = Noise(21);
    let mut finder = ProfileFinder::default();
    let slopes = [-0.9, 0.7];
    let runs = 400;
    for (face, slope) in slopes.into_iter().enumerate() {
        let (mut squared, mut product) = (0.0, 0.0);
        for _ in 0..runs {
            let found =
                finder.find(&profile([0.0, 5.0], slopes, 0.05, &mut noise)).unwrap().faces[face].unwrap();
            let off =
                found.points_mm.map(|at| (at.y - 5.0 - slope * at.x) / slope.hypot(1.0) / found.sigma_mm);
            squared += 0.5 * (off[0] * off[0] + off[1] * off[1]);
            product += off[0] * off[1];
            // The one nearer to the corner is first, and both lie on the face.
            assert!(found.points_mm[0].x.abs() < found.points_mm[1].x.abs());
            assert_eq!(found.points_mm[0].x > 0.0, face == 1);
        }
        // Means of 800 and of 400 numbers of unit variance: ± 0.05; as above, 20 % for the robust fit.
        assert!((0.8..1.25).contains(&(squared / f64::from(runs))), "{}", squared / f64::from(runs));
        assert!((product / f64::from(runs)).abs() < 0.2, "{}", product / f64::from(runs));
    }
}

/// Profiles of one pair of faces, one every 30 ms, each with its own noise.
fn scan(count: i64, mut points: impl FnMut(i64) -> Vec<[f64; 2]>) -> Vec<Profile> {
    let profile = |k: i64| {
        let point = |at: [f64; 2]| ProfilePoint { x_m: at[0] * 1e-3, z_m: at[1] * 1e-3, intensity: None };
        let points = points(k).into_iter().map(point).collect();
        Profile { stamp_ns: k * 30_000_000, frame: Some(k as u64), points }
    };
    (0..count).map(profile).collect()
}

#[test]
fn what_is_stated_of_faces_hardly_scatters_so_that_many_together_are_not_too_sure() {
    let (mut noise, slopes) = (Noise(31), [-0.9, 0.7]);
    let found = seams(&scan(300, |_| profile([0.0, 5.0], slopes, 0.05, &mut noise)), None).found.stripes;
    for plate in [0, 1] {
        let variances = found.iter().filter(|stripe| stripe.plate == plate).map(|s| s.sigma.powi(2));
        let count = variances.clone().count() as f64;
        assert_eq!(count, 300.0);
        let mean = variances.clone().sum::<f64>() / count;
        let weight = variances.map(f64::recip).sum::<f64>() / count;
        // 1 + c² with c ≈ 15 %/√33 = 3 %, and the edge of the cut, which moves with the corner; alone it were 1.025.
        assert!((1.0..1.003).contains(&(mean * weight)), "{}", mean * weight);
    }
}

#[test]
fn columns_that_see_both_faces_do_not_draw_these_together() {
    let (mut noise, slopes) = (Noise(41), [-0.9, 0.7]);
    let mixed = |_| {
        let mut points = profile([0.0, 5.0], slopes, 0.02, &mut noise);
        // What a column of 4 mm sees of both: up to 0.2 mm, which no robust line recognises as foreign.
        points.iter_mut().for_each(|p| p[1] += 0.05 * (2.0 - p[0].abs()).max(0.0) * noise.uniform());
        points
    };
    let found = seams(&scan(300, mixed), None).found.stripes;
    for stripe in [0, 1].map(|plate| found.iter().filter(move |s| s.plate == plate)) {
        let (mut mean, mut count) = (0.0, 0.0);
        for s in stripe {
            let slope = slopes[s.plate as usize];
            let Measured::Profile([x, z]) = s.points[0] else { panic!("a profile") };
            mean += (z - 5e-3 - slope * x) / f64::hypot(slope, 1.0) / s.sigma;
            count += 1.0;
        }
        // Mean of 300 numbers of unit variance: ± 0.058; four of them. With the columns of the corner it is 1.8.
        assert!((mean / count).abs() < 0.24, "{}", mean / count);
    }
}

#[test]
fn a_profile_with_noise_of_its_own_keeps_it() {
    let (mut noise, slopes) = (Noise(51), [-0.9, 0.7]);
    let of = |k: i64| if k == 20 { 0.3 } else { 0.03 };
    let found = seams(&scan(41, |k| profile([0.0, 5.0], slopes, of(k), &mut noise)), None).found.stripes;
    let sigma = |frame: u64| found.iter().find(|s| s.frame == Some(frame)).unwrap().sigma;
    // Ten times the noise, of which one face knows 10 %; the others have nothing of it.
    assert!((7.0..13.0).contains(&(sigma(20) / sigma(10))), "{}", sigma(20) / sigma(10));
    assert!((0.97..1.03).contains(&(sigma(21) / sigma(19))), "{}", sigma(21) / sigma(19));
}

/// A lap in columns of 0.1 mm: the upper plate, on the side that is said, ends at `edge_mm`, the lower one lies `step_mm` behind it.
fn lap(edge_mm: f64, upper_is_left: bool, step_mm: f64, noise: &mut Noise) -> Vec<[f64; 2]> {
    let column = |k: i32| {
        let x = 0.1 * f64::from(k);
        let is_upper = (x < edge_mm) == upper_is_left;
        [x, 100.0 + 0.15 * x + if is_upper { 0.0 } else { step_mm } + 0.02 * noise.normal()]
    };
    (-150..150).map(column).collect()
}

#[test]
fn the_edge_of_a_lap_is_as_good_as_it_says() {
    let mut noise = Noise(11);
    let mut finder = ProfileFinder::default();
    for upper_is_left in [true, false] {
        let (mut along, mut across, mut count) = (0.0, 0.0, 0.0);
        for _ in 0..400 {
            let edge_mm = 3.0 * (noise.uniform() - 0.5);
            let mut points = lap(edge_mm, upper_is_left, 2.0, &mut noise);
            // Three in a hundred do not return, and one is a reflection.
            points.retain(|_| noise.uniform() > 0.03);
            points.iter_mut().filter(|_| noise.uniform() < 0.01).for_each(|point| point[1] += 3.0);
            let found = finder.find(&points).unwrap();
            let edge = [edge_mm, 100.0 + 0.15 * edge_mm];
            along += (found.point_mm.x - edge[0]).powi(2) / found.covariance_mm2.m11;
            let square = |x: f64, z: f64| (z - 0.15 * x) / 0.15_f64.hypot(1.0);
            let off = square(found.point_mm.x, found.point_mm.y) - square(edge[0], edge[1]);
            let normal = nalgebra::Vector2::new(-0.15, 1.0).normalize();
            across += off * off / normal.dot(&(found.covariance_mm2 * normal));
            count += 1.0;
            let [one, other] =
                found.faces.map(|face| square(face.unwrap().points_mm[0].x, face.unwrap().points_mm[0].y));
            let step = (other - one).abs() - 2.0 / 0.15_f64.hypot(1.0);
            assert!(
                step.abs() < 5.0 * found.faces[0].unwrap().sigma_mm.hypot(found.faces[1].unwrap().sigma_mm),
                "{step}"
            );
        }
        let (along, across): (f64, f64) = (along / count, across / count);
        println!("{upper_is_left}: {along:.3} along, {across:.3} across");
        // Mean squares of 400: normal ones ± 0.07; even ones, which edges are, ± 0.045.
        assert!((along - 1.0).abs() < 0.2 && (across - 1.0).abs() < 0.28, "{along} {across}");
    }
}

#[test]
fn a_step_that_the_noise_hides_is_none() {
    let mut noise = Noise(12);
    let mut finder = ProfileFinder::default();
    for _ in 0..50 {
        assert!(finder.find(&lap(0.0, true, 0.05, &mut noise)).is_err());
        assert!(finder.find(&lap(0.0, true, 0.0, &mut noise)).is_err());
    }
}
