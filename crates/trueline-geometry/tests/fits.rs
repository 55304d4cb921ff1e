//! Tests fits of lines, planes and circles: exact figures, outliers, and degenerate inputs.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::{Circle, Line, Plane, PlueckerLine, Polyline, fit, so3};

/// A rotation that changes every axis.
fn turned(point: Vector3<f64>) -> Vector3<f64> {
    so3::exp(&Vector3::new(0.4, -0.7, 0.3)) * point + Vector3::new(0.5, -0.2, 1.1)
}

/// Points of a plane: a grid of 6 × 5, with spread √35/12 × 20 mm and √2 × 10 mm, alternating ± 1 mm.
fn plate() -> Vec<Vector3<f64>> {
    let grid = (0..6).flat_map(|x| (0..5).map(move |y| (x, y)));
    grid.map(|(x, y)| {
        let off = if (x + y) % 2 == 0 { 1e-3 } else { -1e-3 };
        turned(Vector3::new(0.02 * f64::from(x), 0.01 * f64::from(y), off))
    })
    .collect()
}

#[test]
fn a_plane_says_how_well_its_points_lie_in_it_and_how_far_they_reach() {
    let found = fit::plane(&plate()).unwrap();
    // Equally many above and below, and uncorrelated with the place except for 1/30 of a millimetre over the plate.
    assert!((found.rms - 1e-3).abs() < 2e-6, "{}", found.rms);
    // Five rows of 10 mm: standard deviation √2 × 10 mm.
    assert!((found.extent - 2_f64.sqrt() * 0.01).abs() < 1e-4, "{}", found.extent);
    let normal = turned(Vector3::z()) - turned(Vector3::zeros());
    assert!(found.plane.normal().dot(&normal).abs() > 1.0 - 1e-4);
    let three = [Vector3::zeros(), Vector3::x(), Vector3::y() * 2.0].map(turned);
    assert!(fit::plane(&three).unwrap().rms < 1e-15);
    assert!(fit::plane(&three[..2]).is_none());
    assert!(fit::plane(&[Vector3::repeat(f64::NAN); 4]).is_none());
}

/// Points beyond five times the median distance are rejected. Points within it are used.
#[test]
fn a_robust_plane_is_that_of_the_points_near_it() {
    let clean = fit::plane(&plate()).unwrap();
    let mut points = plate();
    let normal = *clean.plane.normal();
    for (k, side) in [(2, 1.0), (9, -1.0), (13, 1.0), (21, -1.0), (27, 1.0)] {
        points.push(plate()[k] + normal.into_inner() * (side * 0.02));
    }
    let found = fit::robust_plane(&points).unwrap();
    assert!((found.rms / clean.rms - 1.0).abs() < 1e-9, "{} {}", found.rms, clean.rms);
    assert!((found.plane.normal().into_inner() - normal.into_inner()).norm() < 1e-9);
    assert!((found.plane.offset() - clean.plane.offset()).abs() < 1e-12);
    // Four millimetres off with a median distance of one: it is used.
    let mut points = plate();
    points.push(plate()[12] + normal.into_inner() * 4e-3);
    let with = fit::plane(&points).unwrap();
    let found = fit::robust_plane(&points).unwrap();
    assert!((found.rms / with.rms - 1.0).abs() < 1e-9 && with.rms > 1.1 * clean.rms);
    // For exact points no point is rejected because of rounding.
    let flat: Vec<Vector3<f64>> =
        plate().iter().map(|p| p - normal.into_inner() * clean.plane.signed_distance(p)).collect();
    let found = fit::robust_plane(&flat).unwrap();
    // A spread is the root of a sum that is rounded at 1e-16 of the largest.
    assert!(found.rms < 1e-9 && (found.extent / clean.extent - 1.0).abs() < 1e-4);
}

#[test]
fn a_line_goes_through_the_mean_along_the_largest_spread() {
    let points: Vec<Vector3<f64>> = (0..10)
        .map(|k| turned(Vector3::new(f64::from(k), if k % 2 == 0 { 0.1 } else { -0.1 }, 0.0)))
        .collect();
    let mean = points.iter().sum::<Vector3<f64>>() / 10.0;
    let found = fit::line(&points).unwrap();
    assert!(found.distance(&mean) < 1e-14 && (found.anchor() - mean).norm() < 1e-14);
    // By hand: cov(x, y) = −0.05, var x = 8.25, var y = 0.01, so that tan 2θ = −0.1/8.24.
    let slope = (0.5 * (-0.1_f64 / 8.24).atan()).tan();
    let along = turned(Vector3::new(1.0, slope, 0.0)) - turned(Vector3::zeros());
    assert!(found.direction().cross(&along.normalize()).norm() < 1e-12);
    assert!(fit::line(&[]).is_none() && fit::line(&[Vector3::x(); 3]).is_none());
    assert!(fit::robust_line(&[Vector3::x(); 3]).is_none());
    // Two points give their exact line. The median distance is zero and no weights are needed.
    let two = fit::robust_line(&points[..2]).unwrap();
    assert!(points[..2].iter().all(|p| two.distance(p) < 1e-15));
}

/// Weights of (1 + d²/median d²)⁻² and ten rounds, against an explicit computation.
#[test]
fn a_robust_line_weighs_by_the_median_distance() {
    let points: Vec<Vector3<f64>> = (0..20)
        .map(|k| {
            let off = if k % 6 == 5 { 3.0 } else { 0.01 * (f64::from(k) * 2.3).sin() };
            turned(Vector3::new(f64::from(k), off, 0.004 * (f64::from(k) * 4.1).cos()))
        })
        .collect();
    let mut expected = fit::line(&points).unwrap();
    for _ in 0..10 {
        let squared: Vec<f64> = points.iter().map(|p| expected.distance(p).powi(2)).collect();
        let mut sorted = squared.clone();
        sorted.sort_by(f64::total_cmp);
        let weights: Vec<f64> = squared.iter().map(|d2| 1.0 / (1.0 + d2 / sorted[10]).powi(2)).collect();
        let total: f64 = weights.iter().sum();
        let mean = points.iter().zip(&weights).map(|(p, w)| p * *w).sum::<Vector3<f64>>() / total;
        // The largest spread from powers of the scatter matrix instead of a decomposition.
        let scatter: nalgebra::Matrix3<f64> =
            points.iter().zip(&weights).map(|(p, w)| (p - mean) * (p - mean).transpose() * *w).sum();
        let mut along = scatter.column(0).normalize();
        for _ in 0..20 {
            along = (scatter * along).normalize();
        }
        expected = Line::new(mean, &UnitVector3::new_normalize(along));
    }
    let found = fit::robust_line(&points).unwrap();
    assert!(found.distance(expected.anchor()) < 1e-12);
    assert!(found.direction().cross(&expected.direction()).norm() < 1e-12);
    // Three of twenty are 3 m off. The seam of the others is kept to within a centimetre.
    let seam = turned(Vector3::new(10.0, 0.0, 0.0));
    assert!(found.distance(&seam) < 0.01, "{}", found.distance(&seam));
}

#[test]
fn a_plane_has_its_normal_towards_it_whatever_the_sign() {
    let normal = Vector3::new(0.0, 3.0, 4.0);
    for sign in [1.0, -1.0] {
        let plane = Plane::new(normal * sign, 10.0 * sign).unwrap();
        assert!((plane.normal().into_inner() - Vector3::new(0.0, 0.6, 0.8)).norm() < 1e-15);
        assert_eq!(plane.offset(), 2.0);
    }
    let away = Plane::new(normal, -10.0).unwrap();
    assert!((away.normal().into_inner() + Vector3::new(0.0, 0.6, 0.8)).norm() < 1e-15);
    assert_eq!(away.offset(), 2.0);
    // Through the origin the sign stays.
    assert_eq!(Plane::new(normal, 0.0).unwrap().normal().z, 0.8);
    assert_eq!(away.signed_distance(&Vector3::new(5.0, 0.0, -5.0)), 2.0);
    let refused = [(Vector3::zeros(), 1.0), (Vector3::repeat(f64::INFINITY), 1.0), (normal, f64::NAN)];
    assert!(refused.iter().all(|(normal, offset)| Plane::new(*normal, *offset).is_none()));
    let height = Plane::from_height(0.5, -0.25, 0.1).unwrap();
    for (x, y) in [(0.0, 0.0), (1.0, 2.0), (-3.0, 0.5)] {
        let on_it = Vector3::new(x, y, 0.5 * x - 0.25 * y + 0.1);
        assert!(height.signed_distance(&on_it).abs() < 1e-15);
    }
}

#[test]
fn lines_that_run_against_x_or_through_the_origin_are_lines() {
    let back = Line::new(Vector3::y(), &-Vector3::x_axis());
    assert!((back.direction() + Vector3::x()).norm() < 1e-15);
    let along = UnitVector3::new_normalize(Vector3::new(1.0, 2.0, -2.0));
    let line = Line::new(Vector3::new(0.3, -0.1, 0.2), &along);
    let probe = Vector3::new(2.0, 1.0, -4.0);
    let near = line.anchored_near(&probe);
    assert!(line.distance(near.anchor()) < 1e-15 && (near.axes() - line.axes()).norm() == 0.0);
    assert!(along.dot(&(probe - near.anchor())).abs() < 1e-15);
    // To the left of it and above, in its own axes.
    let beside = line.anchor() + line.axes() * Vector3::new(0.7, 0.02, -0.03);
    assert!((line.offset_of(&beside) - nalgebra::Vector2::new(0.02, -0.03)).norm() < 1e-15);
    // The paper's form: U = [v, n/|n|, v × n/|n|] and its logarithm.
    let pluecker = line.to_pluecker();
    let nearest = pluecker.nearest_point_to_origin();
    assert!(line.distance(&nearest) < 1e-15 && nearest.dot(&along).abs() < 1e-15);
    let orthonormal = pluecker.to_orthonormal().unwrap();
    assert!((orthonormal.distance - nearest.norm()).abs() < 1e-15);
    let turn = so3::exp(&orthonormal.rotation_vector());
    assert!((turn * Vector3::x() - along.into_inner()).norm() < 1e-14);
    assert!((turn * Vector3::y() - pluecker.moment.normalize()).norm() < 1e-14);
    // A moment of a picometre has a direction, and a smaller one has none.
    let through = |moment_m: f64| PlueckerLine { moment: Vector3::z() * moment_m, direction: Vector3::x() };
    assert!(through(1.1e-12).to_orthonormal().is_some() && through(0.9e-12).to_orthonormal().is_none());
}

#[test]
fn a_circle_has_a_nearest_point_even_for_its_axis() {
    for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
        let circle = Circle::new(Vector3::new(0.1, 0.2, 0.3), axis, 0.5).unwrap();
        assert_eq!(
            (*circle.centre(), *circle.axis(), circle.radius()),
            (Vector3::new(0.1, 0.2, 0.3), axis, 0.5)
        );
        let nearest = circle.nearest(&(circle.centre() + axis.into_inner() * 3.0));
        let outward = nearest - circle.centre();
        assert!((outward.norm() - 0.5).abs() < 1e-15 && outward.dot(&axis).abs() < 1e-15);
        // A nanometre off the axis there is a direction.
        let aside = axis.yzx();
        let nearest = circle.nearest(&(circle.centre() + aside * 1e-9));
        assert!((nearest - circle.centre() - aside * 0.5).norm() < 1e-7);
    }
    assert!(Circle::new(Vector3::zeros(), Vector3::z_axis(), f64::INFINITY).is_none());
    assert!(Circle::new(Vector3::zeros(), Vector3::z_axis(), -0.1).is_none());
}

#[test]
fn a_circle_is_fitted_in_any_plane_to_what_noise_leaves() {
    for axis in
        [Vector3::x_axis(), UnitVector3::new_normalize(Vector3::new(0.5, 0.5, -0.7)), Vector3::z_axis()]
    {
        let truth = Circle::new(Vector3::new(0.4, -0.3, 0.9), axis, 0.25).unwrap();
        let u = axis.yzx().cross(&axis).normalize();
        let v = axis.cross(&u);
        let points: Vec<Vector3<f64>> = (0..90)
            .map(|k| {
                let a = 0.07 * f64::from(k);
                // Equal parts outward and inward, above and below.
                let (out, up) = (1e-4 * (f64::from(k) * 2.4).sin(), 1e-4 * (f64::from(k) * 3.7).cos());
                let wild = if k % 8 == 3 { 0.03 } else { 0.0 };
                truth.centre()
                    + (u * a.cos() + v * a.sin()) * (truth.radius() + out + wild)
                    + axis.into_inner() * (up - wild)
            })
            .collect();
        let found = fit::robust_circle(&points).unwrap();
        // 79 points within 0.07 mm (RMS) an axis on the whole circle give 0.02 mm at the centre. The limit is three times that.
        assert!((found.centre() - truth.centre()).norm() < 6e-5, "{}", found.centre() - truth.centre());
        assert!((found.radius() - truth.radius()).abs() < 6e-5, "{}", found.radius());
        assert!(found.axis().cross(&axis).norm() < 2e-4);
    }
}

#[test]
fn a_curve_that_ends_where_it_began_has_no_ends() {
    let square = |gap_m: f64| {
        Polyline::new(vec![Vector3::zeros(), Vector3::x(), Vector3::new(1.0, 1.0, 0.0), Vector3::y() * gap_m])
            .unwrap()
    };
    let before = Vector3::new(-0.1, 0.0, 0.0);
    assert!(!square(0.9e-6).nearest(&before).beyond_end && square(1.1e-6).nearest(&before).beyond_end);
    // Two points are a segment with two ends, however short.
    let short = Polyline::new(vec![Vector3::zeros(), Vector3::x() * 1e-7]).unwrap();
    assert!(short.nearest(&before).beyond_end && short.points().len() == 2);
    // At an end, and not beyond it.
    let straight = Polyline::new(vec![Vector3::zeros(), Vector3::x(), Vector3::x() * 3.0]).unwrap();
    for (x, beyond) in [(0.0, false), (-1e-9, true), (3.0, false), (3.0 + 1e-9, true), (1.0, false)] {
        let found = straight.nearest(&Vector3::new(x, 0.2, 0.0));
        assert_eq!(found.beyond_end, beyond, "{x}");
        assert!((found.point - Vector3::x() * x.clamp(0.0, 3.0)).norm() < 1e-15);
    }
    assert!(Polyline::new(vec![]).is_none());
}
