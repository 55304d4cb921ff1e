//! Seam points and stripes of curves, against formulas of their own.

use super::cell::Cell;
use super::*;
use crate::plates::MeasuredLine;
use nalgebra::{Point3, Vector2};

/// Most of each curve is seen, and the same seed gives the same scan.
#[test]
fn every_curve_is_seen() {
    for kind in CurveKind::ALL {
        for plates in [None, Some(BesideCurve::default())] {
            let wanted = CurveScan { plates, ..CurveScan::good(kind) };
            let (scan, _) = scan_curve(&wanted, 1);
            assert!(scan.features.len() > 560, "{}: {}", kind.name(), scan.features.len());
            let stripes = if plates.is_some() { 2 * scan.features.len() } else { 0 };
            assert_eq!(scan.stripes.len(), stripes);
            let again = scan_curve(&wanted, 1).0;
            assert_eq!((again.features, again.stripes), (scan.features, scan.stripes));
        }
    }
}

/// Stripes are an addition: without them a scan has the random numbers that it always had. The numbers are those of the
/// simulator before it knew of stripes; rounding of other machines is below a picometre.
#[test]
fn without_plates_a_scan_is_as_ever() {
    let rows = [
        (CurveKind::Straight, 0.0031898993185257634, 0.15186340574750565),
        (CurveKind::Pipe, 0.0032323483416960624, 0.15185874288165088),
        (CurveKind::Saddle, 0.003231438654318303, 0.15184919052851734),
        (CurveKind::Corner, 0.0031898993185257634, 0.15186340574750581),
        (CurveKind::Wavy, 0.003127937225623107, 0.15188240528047578),
        (CurveKind::Free, 0.003202932049238056, 0.1518661641201369),
    ];
    for (kind, x, z) in rows {
        let (scan, _) = scan_curve(&CurveScan::good(kind), 7);
        assert_eq!(scan.features.len(), 660);
        let feature = scan.features[300];
        assert_eq!((feature.stamp_ns, feature.sigma), (109_401_098_035, None));
        let off = coordinates(feature.measured) - Vector2::new(x, z);
        assert!(off.norm() < 1e-12, "{}: {off}", kind.name());
    }
}

fn coordinates(measured: Measured) -> Vector2<f64> {
    match measured {
        Measured::Profile(at) => at.into(),
        other => unreachable!("{other:?}"),
    }
}

/// The lines of a recording's stripes, with their plates and stamps.
fn lines(recording: &Recording) -> Vec<(i64, u32, MeasuredLine)> {
    let line = |stripe: &trueline_dataset::PlateStripe| {
        let line = MeasuredLine { points: stripe.points.map(coordinates), sigma: stripe.sigma };
        (stripe.stamp_ns, stripe.plate, line)
    };
    recording.stripes.iter().map(line).collect()
}

fn exact(kind: CurveKind, plates: BesideCurve) -> CurveScan {
    CurveScan { plates: Some(plates), ..CurveScan::good(kind).exact() }
}

/// A point of the profiler's sheet in the part's own frame, by the pose of the sensor at the true exposure.
fn in_part(cell: &Cell, stamp_ns: i64, at: &Vector2<f64>) -> Vector3<f64> {
    let time_s = stamp_ns as f64 * 1e-9 - 100.0 - cell.guess.time_offset_s;
    let there = Point3::new(at.x, cell.scan.sensor.out_of_plane_m(at.x), at.y);
    let pass = (cell.scan.passes * time_s / cell.scan.lasts_s + 1e-9) as usize;
    let part_from_base = (cell.off_place[pass] * cell.base_from_part).inverse();
    (part_from_base * cell.base_from_camera(time_s) * there).coords
}

/// How far a point is off the two surfaces, m.
fn off_surfaces(kind: CurveKind, point: &Vector3<f64>) -> [f64; 2] {
    match kind {
        CurveKind::Straight => [point.z, point.y],
        CurveKind::Arc => [point.z, (point.xy() - Vector2::new(0.0, 0.28)).norm() - 0.28],
        CurveKind::Pipe => [point.z, point.xy().norm() - 0.05],
        CurveKind::Saddle => [point.x.hypot(point.z + 0.08) - 0.08, point.xy().norm() - 0.045],
        other => unreachable!("{other:?}"),
    }
}

/// The largest distances of all support points from their surfaces, m.
fn worst_off_surfaces(scan: CurveScan, seed: u64) -> [f64; 2] {
    let cell = Cell::drawn(scan, seed);
    let mut worst_m = [0.0_f64; 2];
    for (stamp_ns, plate, line) in lines(&scan_curve(&scan, seed).0) {
        let k = plate as usize;
        for at in line.points {
            let off_m = off_surfaces(scan.kind, &in_part(&cell, stamp_ns, &at))[k];
            worst_m[k] = worst_m[k].max(off_m.abs());
        }
    }
    worst_m
}

/// A stamp is whole nanoseconds, and the sensor moves by less than 0.2 m/s.
const OF_STAMPS_M: f64 = 1e-10;

/// A parabola and the straight line of least squares through it cross one standard deviation of the places beside their middle. What
/// remains is of third order. A stripe at an angle α to the rulings of a cylinder of radius R bends by q = sin² α/2R. Its places are even in
/// the distance from the seam; along the stripe, of half length a, their density changes by ε = tan α · a sin α/R from the middle to
/// an end. This skews them by 0.7 ε, so the line leaves the support points by 0.7 ε q a²/3. Half a stripe has a = 6.5 mm/cos α. Tilts of ±18° about
/// two axes make α < 26° on a pipe: 0.6 µm. An arc has 280 mm instead of 50 mm, and the error the inverse square of it: 0.02 µm. On a saddle the
/// seam climbs by 25° more: 8 µm. The bow of a stripe itself, q a², is 0.1 mm on the pipe.
#[test]
fn exact_support_points_lie_on_the_surfaces() {
    for (kind, most_m) in [
        (CurveKind::Straight, [OF_STAMPS_M, OF_STAMPS_M]),
        (CurveKind::Arc, [OF_STAMPS_M, 2e-8]),
        (CurveKind::Pipe, [OF_STAMPS_M, 0.6e-6]),
        (CurveKind::Saddle, [8e-6, 8e-6]),
    ] {
        let worst_m = worst_off_surfaces(exact(kind, BesideCurve::default()), 5);
        assert!((0..2).all(|k| worst_m[k] < most_m[k]), "{}: {worst_m:?}", kind.name());
    }
}

/// The first support point is the nearer one, and both are where even places from 2 to 15 mm have them: 8.5 ∓ 3.85 mm from the seam. The floor
/// of a pipe is outside it. Places of a bent stripe are skewed by 2 %, 0.08 mm.
#[test]
fn support_points_are_at_their_distance_from_the_seam() {
    let scan = exact(CurveKind::Pipe, BesideCurve::default());
    let (cell, recording) = (Cell::drawn(scan, 5), scan_curve(&scan, 5).0);
    for (stamp_ns, plate, line) in lines(&recording) {
        for (at, from_seam_m) in line.points.iter().zip([4.65e-3, 12.35e-3]) {
            let point = in_part(&cell, stamp_ns, at);
            let found_m = if plate == 0 { point.xy().norm() - 0.05 } else { point.z };
            assert!((found_m - from_seam_m).abs() < 1e-4, "plate {plate}: {found_m}");
        }
    }
}

/// Between two planes the lines meet in the seam, twice as far from a support point as these are from each other. The floor
/// is on the left.
#[test]
fn exact_lines_meet_in_a_straight_seam() {
    let scan = exact(CurveKind::Straight, BesideCurve::default());
    let (cell, recording) = (Cell::drawn(scan, 5), scan_curve(&scan, 5).0);
    for (feature, both) in recording.features.iter().zip(lines(&recording).chunks(2)) {
        let at = coordinates(feature.measured);
        let off_m = in_part(&cell, feature.stamp_ns, &at).yz().norm();
        assert!(off_m < 3.0 * OF_STAMPS_M, "{off_m}");
        assert!(both[0].2.points[0].x < at.x && both[1].2.points[0].x > at.x);
        assert!(both.iter().all(|(stamp_ns, ..)| *stamp_ns == feature.stamp_ns));
    }
}

/// A bent sheet and a part that moves between passes reach the stripes. A bow of 1 mm at 30 mm bends a stripe by 1.1/m · tan 26°; the skew of
/// its places is 0.7 · 2 · 1.1/m · 6.5 mm · tan² 26°: 0.02 µm.
#[test]
fn stripes_have_the_errors_of_sensor_and_part() {
    let usual = exact(CurveKind::Straight, BesideCurve::default());
    let sensor = SensorError { bow_m: 1e-3, ..SensorError::default() };
    let worst_m = worst_off_surfaces(CurveScan { sensor, part_moves: [3e-4, 2e-3], ..usual }, 5);
    assert!(worst_m.iter().all(|m| *m < 4e-8), "{worst_m:?}");
    // The same points as those of a flat sheet, or of a part that stays.
    let points =
        |scan: CurveScan| lines(&scan_curve(&scan, 5).0).into_iter().map(|(.., line)| line.points[1]);
    for changed in [CurveScan { sensor, ..usual }, CurveScan { part_moves: [3e-4, 2e-3], ..usual }] {
        let moved_m = points(usual).zip(points(changed)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(moved_m > 2e-5, "{moved_m}");
    }
    let wide = SensorError { width: 0.01, ..SensorError::default() };
    for (a, b) in points(usual).zip(points(CurveScan { sensor: wide, ..usual })) {
        // The places are wider, the line through them is the same; they are apart by a percent of 4 mm at most along it.
        assert!((b.x - 1.01 * a.x).abs() < 4e-5 && (b.y - a.y).abs() < 4e-5, "{a} {b}");
    }
}

/// Errors square to the lines, in their σ, are normal and independent, and so are those of seam points. With 5 standard deviations of
/// each mean one run in a million fails; the seeds are fixed.
#[test]
fn support_points_scatter_by_their_sigma() {
    for kind in [CurveKind::Straight, CurveKind::Pipe, CurveKind::Saddle] {
        let noisy =
            CurveScan { outliers: 0.0, plates: Some(BesideCurve::default()), ..CurveScan::good(kind) };
        let [found, truth] = [noisy, noisy.exact()].map(|scan| scan_curve(&scan, 9).0);
        let pairs = || lines(&found).into_iter().zip(lines(&truth));
        let count = found.stripes.len() as f64;
        let (mut squares, mut products) = (0.0, 0.0);
        for ((stamp_ns, plate, line), (true_ns, true_plate, exact)) in pairs() {
            assert_eq!((stamp_ns, plate), (true_ns, true_plate));
            // σ √2/√40 of 0.04 mm.
            assert!((line.sigma - 0.04e-3 * 0.05_f64.sqrt()).abs() < 1e-12);
            let normal = exact.normal();
            let error = [0, 1].map(|k| normal.dot(&(line.points[k] - exact.points[k])) / line.sigma);
            squares += error[0].powi(2) + error[1].powi(2);
            products += error[0] * error[1];
        }
        let chi2 = squares / (2.0 * count);
        assert!((chi2 - 1.0).abs() < 5.0 * (2.0 / (2.0 * count)).sqrt(), "{}: {chi2}", kind.name());
        assert!((products / count).abs() < 5.0 / count.sqrt(), "{}: {products}", kind.name());
        let number = found.features.len() as f64;
        let normalised = found.features.iter().zip(&truth.features).map(|(found, truth)| {
            let error = coordinates(found.measured) - coordinates(truth.measured);
            let inverse = found.covariance([1.0; 2]).try_inverse().unwrap_or_default();
            error.dot(&(inverse * error))
        });
        let chi2 = normalised.sum::<f64>() / number;
        // χ² of two numbers has the variance 4.
        assert!((chi2 - 2.0).abs() < 5.0 * (4.0 / number).sqrt(), "{}: {chi2}", kind.name());
    }
}

/// Each stripe alone is off now and then, square to itself; the seam point is where the lines meet nevertheless.
#[test]
fn outliers_move_stripes_and_their_seam_point() {
    let usual =
        CurveScan { plates: Some(BesideCurve::default()), ..CurveScan::good(CurveKind::Pipe).exact() };
    let (found, truth) = (scan_curve(&CurveScan { outliers: 0.2, ..usual }, 9).0, scan_curve(&usual, 9).0);
    let moved_m: Vec<f64> = lines(&found)
        .iter()
        .zip(lines(&truth))
        .map(|((.., found), (.., exact))| {
            let shifts = [0, 1].map(|k| found.points[k] - exact.points[k]);
            assert!((shifts[0] - shifts[1]).norm() < 1e-12);
            let distance_m = exact.normal().dot(&shifts[0]);
            assert!((shifts[0].norm() - distance_m.abs()).abs() < 1e-12);
            distance_m
        })
        .collect();
    assert!(moved_m.iter().all(|m| m.abs() < 8e-3));
    // 5 standard deviations of a binomial share of 0.2 of the stripes, and of 0.32 of the frames.
    let is_off = |m: &f64| *m != 0.0;
    let share = moved_m.iter().filter(|m| is_off(m)).count() as f64 / moved_m.len() as f64;
    assert!((share - 0.2).abs() < 5.0 * (0.16 / moved_m.len() as f64).sqrt(), "{share}");
    let frames = moved_m.chunks(2);
    let number = frames.len() as f64;
    let one = frames.filter(|both| is_off(&both[0]) != is_off(&both[1])).count() as f64 / number;
    assert!((one - 0.32).abs() < 5.0 * (0.32 * 0.68 / number).sqrt(), "{one}");
    for (feature, both) in found.features.iter().zip(lines(&found).chunks(2)) {
        for (.., line) in both {
            let off_m = line.normal().dot(&(coordinates(feature.measured) - line.points[0]));
            assert!(off_m.abs() < 1e-12, "{off_m}");
        }
    }
}

/// Support points of wavy planes are off them by less than the amplitude; at 12 mm it is 0.66 of that.
#[test]
fn waves_move_the_support_points() {
    let form_m = 1e-4;
    let wavy = exact(CurveKind::Straight, BesideCurve { form_m, ..BesideCurve::default() });
    let worst_m = worst_off_surfaces(wavy, 5);
    assert!(worst_m.iter().all(|m| (0.5 * form_m..0.75 * form_m).contains(m)), "{worst_m:?}");
}

/// Without one of the lights a frame has neither stripes nor a seam point: beyond the end of the seam, and where it is unseen.
#[test]
fn a_frame_without_light_is_left_out() {
    let far = exact(CurveKind::Arc, BesideCurve { reach_m: [2e-3, 60e-3], ..BesideCurve::default() });
    let (recording, _) = scan_curve(&far, 5);
    let count = recording.features.len();
    assert!((600..660).contains(&count), "{count}");
    assert_eq!(recording.stripes.len(), 2 * count);
    for kind in [CurveKind::Arc, CurveKind::Pipe] {
        let half = CurveScan { unseen: 0.3, ..exact(kind, BesideCurve::default()) };
        let [with, without] = [half, CurveScan { plates: None, ..half }].map(|scan| scan_curve(&scan, 5).0);
        let stamps = |of: &Recording| of.features.iter().map(|f| f.stamp_ns).collect::<Vec<_>>();
        assert_eq!(stamps(&with), stamps(&without));
        assert!(with.features.len() < 600);
    }
}

/// Parts of a production have their stripes at the stamps of their seam points.
#[test]
fn stripes_of_a_part_are_late_with_its_seam_points() {
    let scan = CurveScan { plates: Some(BesideCurve::default()), ..CurveScan::good(CurveKind::Arc) };
    let piece = CurveProduction { scan, off_m: 1e-3, turned_rad: 0.01, seed: 3 }.piece(2, 0.004);
    for (feature, both) in piece.features.iter().zip(piece.stripes.chunks(2)) {
        assert!(both.iter().all(|stripe| stripe.stamp_ns == feature.stamp_ns));
    }
}
