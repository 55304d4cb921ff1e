//! Several seams of one part: one spline in pieces.

use super::*;
use crate::curve::spline::Spline;

/// Scans over two seams of one part, one after the other.
fn two_seams(seed: u64) -> Recording {
    const LATER_NS: i64 = 30_000_000_000;
    let (mut recording, _) = scan_curve(&CurveScan::good(CurveKind::Wavy), seed);
    let (other, _) = scan_curve(&CurveScan::good(CurveKind::Pipe), seed);
    recording.robot.extend(other.robot.into_iter().map(|mut sample| {
        sample.stamp_ns += LATER_NS;
        sample
    }));
    recording.features.extend(other.features.into_iter().map(|mut feature| {
        (feature.stamp_ns, feature.line) = (feature.stamp_ns + LATER_NS, 1);
        feature
    }));
    recording
}

/// Each seam determines clock and hand-eye transform; both together determine them better than either, and within their ±.
#[test]
fn two_seams_have_one_answer() {
    let recording = two_seams(31);
    let (both, truth) = readings(&recording, false);
    let alone = |label: u32| {
        let list = both.list.iter().filter(|reading| reading.line == label).copied().collect();
        answered(&Readings { list, ..both.clone() }).unwrap()
    };
    let (first, second, found) = (alone(0), alone(1), answered(&both).unwrap());
    assert_eq!(found.curve.seams.len(), 2);
    assert!(found.components.iter().all(|seen| *seen));
    assert_eq!(found.open().count(), 0);
    let squared = squared_sigmas(&truth, &found.at(), &found.noise).unwrap();
    // Seven squared sigmas exceed 30 in one of ten thousand scans.
    assert!(squared < 30.0, "{squared}");
    for k in 0..7 {
        let least = first.noise[(k, k)].min(second.noise[(k, k)]);
        assert!(found.noise[(k, k)] < least, "{k}: {} {least}", found.noise[(k, k)]);
    }
    let lengths: Vec<f64> = found.curve.seams.iter().map(|seam| seam.length_m).collect();
    // The pipe alone is closed. Among others it is cut, and extends beyond its ends by at most a knot.
    assert!((lengths[0] - first.curve.length_m).abs() < 5e-3, "{lengths:?}");
    assert!((lengths[1] - second.curve.length_m).abs() < 12e-3, "{lengths:?}");
}

/// A place on a piece equals the place on that piece alone, and no difference connects two pieces.
#[test]
fn a_spline_in_pieces_is_each_of_them() {
    let control = |from: u32, count: u32| {
        (from..from + count)
            .map(|k| Vector3::new(f64::from(k), f64::from(k * k % 7), 1.0))
            .collect::<Vec<_>>()
    };
    let pieces = [control(0, 9), control(40, 11)];
    let whole =
        Spline { control: pieces.concat(), spacing_m: 0.5, closed: false, breaks: vec![pieces[0].len()] };
    for (control, own) in whole.pieces().zip(&pieces) {
        let alone = Spline { control: own.clone(), breaks: Vec::new(), ..whole.clone() };
        let first_m = control.start as f64 * whole.spacing_m;
        for part in [0.0, 0.3, 0.77, 1.0] {
            let u_m = part * alone.span_m();
            assert!((whole.point(first_m + u_m) - alone.point(u_m)).norm() < 1e-12);
            assert!(whole.holds(first_m + u_m));
        }
        assert!(!whole.holds(first_m + alone.span_m() + 0.7));
        let normals = &whole.normals()[control];
        let ends = [own[1] - own[0], own[own.len() - 1] - own[own.len() - 2]];
        assert!(normals[0][0].dot(&ends[0]).abs() < 1e-12);
        assert!(normals[own.len() - 1][0].dot(&ends[1]).abs() < 1e-12);
    }
    assert_eq!(whole.third_differences(), (0..6).chain(9..17).collect::<Vec<_>>());
}
