//! Plans with whole stripes: they promise the spread of the estimates from simulated stripes, and leave less than plans for
//! seam points.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test fails by panicking, and prints what it measured"
)]

use crate::cells;

use cells::{exact, example, scenario};
use nalgebra::{SMatrix, SVector, UnitVector3};
use trueline_geometry::se3;
use trueline_method::problem::parameters::{LINES, ROTATION, TRANSLATION};
use trueline_method::{Config, Measurements, Status, calibrate};
use trueline_plan::surroundings::Plate;
use trueline_plan::{Cell, Plan, PlanRequest, Shape, plan};
use trueline_sim::{PlatePair, Plates, scan_plates_along};

/// The example's cell at the exact guess, with plates about the seam in the simulator's form. Each states whether it is on
/// the right, its slope from the seam, and its depth below it.
fn with_plates(plates: &[(bool, f64, f64)], pair: PlatePair) -> (Cell, Plates) {
    let mut cell = exact(example());
    let along = cell.seam.direction().unwrap().into_inner();
    let away = -scenario_of(&cell, 1.0).cell.approach.into_inner();
    let up = (away - along * along.dot(&away)).normalize();
    let middle = 0.5 * (cell.seam.from_m + cell.seam.to_m);
    let plate = |&(is_right, slope, below_m): &(bool, f64, f64)| {
        // The simulator's left plate is on the side on which the sensor's stripe begins.
        let right = up.cross(&along) * if is_right { 1.0 } else { -1.0 };
        let normal = UnitVector3::new_normalize(up - right * slope);
        let toward = Some(UnitVector3::new_normalize(right + up * slope));
        Plate { point_m: middle - normal.as_ref() * below_m, normal, toward }
    };
    cell.surroundings.plates = plates.iter().map(plate).collect();
    let noise_px = cell.noise.feature_px;
    let plates = Plates { pair, column_sigma_px: noise_px, edge_sigma_px: noise_px, ..Plates::default() };
    (cell, plates)
}

/// A fillet of 90°, open towards the sensor.
fn fillet() -> (Cell, Plates) {
    with_plates(&[(false, 1.0, 0.0), (true, 1.0, 0.0)], PlatePair::Meeting)
}

/// A lap of which the left plate lies 3 mm higher.
fn lap() -> (Cell, Plates) {
    with_plates(&[(false, 0.0, 0.0), (true, 0.0, 3e-3)], PlatePair::Lap { step_m: 3e-3 })
}

/// The edge of a plate on the left.
fn edge() -> (Cell, Plates) {
    with_plates(&[(false, 0.0, 0.0)], PlatePair::Edge)
}

fn scenario_of(cell: &Cell, duration_s: f64) -> trueline_sim::Scenario {
    scenario(cell, (cell.tool_from_camera, cell.seam), duration_s)
}

fn planned(cell: &Cell, measurements: Measurements) -> Plan {
    let ask = PlanRequest {
        measurements,
        shapes: vec![Shape::TwoPasses],
        evaluations: 800,
        duration_s: 10.0,
        ..PlanRequest::default()
    };
    plan(cell, &ask, &|| ()).unwrap()
}

/// Spread of the estimates from the simulator's scans.
struct Achieved {
    /// Root mean square of their errors.
    spread: SVector<f64, LINES>,
    /// The mean of the covariances that they state.
    stated: SMatrix<f64, LINES, LINES>,
    /// The mean of eᵀ P⁻¹ e / 7, with what they state.
    consistency: f64,
}

fn achieved(
    (cell, plates): (&Cell, &Plates),
    plan: &Plan,
    measurements: Measurements,
    runs: u64,
) -> Achieved {
    let scenario = scenario_of(cell, plan.motion.design().duration_s);
    let config = Config { measurements, ..Config::noise_only() };
    let (mut squares, mut stated) = (SVector::<f64, LINES>::zeros(), SMatrix::zeros());
    let mut consistency = 0.0;
    for seed in 0..runs {
        let along = |time_s| plan.motion.base_from_tool(time_s);
        let recording = scan_plates_along(&scenario, plates, &along, seed).unwrap();
        let truth = recording.truth.as_ref().unwrap().parameters;
        let found = calibrate(&recording, Some(&truth), &config).unwrap();
        assert_eq!(found.status(), Status::Accepted, "{:?}", found.reasons());
        let (turn, shift) =
            se3::difference_decoupled(&found.best_fit().tool_from_camera, &truth.tool_from_camera);
        let mut error = SVector::<f64, LINES>::zeros();
        error[0] = found.best_fit().time_offset_s - truth.time_offset_s;
        error.fixed_rows_mut::<3>(ROTATION).copy_from(&turn);
        error.fixed_rows_mut::<3>(TRANSLATION).copy_from(&shift);
        let covariance = SMatrix::<f64, LINES, LINES>::from_fn(|i, j| found.covariance(i, j).unwrap());
        squares += error.component_mul(&error);
        consistency += error.dot(&(covariance.try_inverse().unwrap() * error)) / LINES as f64;
        stated += covariance;
    }
    let mean = 1.0 / runs as f64;
    Achieved {
        spread: (squares * mean).map(f64::sqrt),
        stated: stated * mean,
        consistency: consistency * mean,
    }
}

/// Correlation of two unknowns.
fn alike(c: &SMatrix<f64, LINES, LINES>, i: usize, j: usize) -> f64 {
    c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()
}

#[test]
fn a_plan_for_stripes_keeps_what_it_promises_and_beats_one_for_seam_points() {
    let (cell, plates) = fillet();
    let (by_stripes, by_points) = (planned(&cell, Measurements::Stripe), planned(&cell, Measurements::Seam));
    let of_plan = |plan| achieved((&cell, &plates), plan, Measurements::Stripe, 60);
    let (own, other) = (of_plan(&by_stripes), of_plan(&by_points));
    for k in 0..LINES {
        let ratio = own.spread[k] / by_stripes.prediction.sigma(k);
        // 60 scans know their spread to 1/√120 = 9 %: three of that above. Below, the robot's noise counts for too much in each frame:
        // slow swings see √(33/250/0.205) = 0.8 of it, as for seam points, and here it is nearly all of the noise.
        assert!((0.8 - 3.0 * 0.09 * 0.8..1.27).contains(&ratio), "unknown {k}: {ratio}");
    }
    // By the requested score, the worst in units of the wish, from the estimator's statement: 60 scans know their spread to
    // 9 %.
    let goal = PlanRequest::default().goal;
    let worst = |stated: &SMatrix<f64, LINES, LINES>| {
        (0..LINES).filter_map(|k| Some(stated[(k, k)].sqrt() / goal.wanted(k)?)).fold(0.0, f64::max)
    };
    let (by_its_own, by_the_other) = (worst(&own.stated), worst(&other.stated));
    assert!(by_its_own < by_the_other, "{by_its_own} and {by_the_other}");
    // A common part in two unknowns shows signs, which their sigmas do not.
    let promised = &by_stripes.prediction.covariance;
    for (i, j) in (0..LINES).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let (expected, stated) = (alike(promised, i, j), alike(&own.stated, i, j));
        assert!((expected - stated).abs() < 0.2, "{i}, {j}: {expected} and {stated}");
    }
}

/// The promise for a lap and for an edge, with and without their stripes, equals the result and the statement.
#[test]
fn plans_for_laps_and_edges_keep_what_they_promise() {
    const RUNS: u64 = 60;
    for (name, (cell, plates)) in [("lap", lap()), ("edge", edge())] {
        let mut scores = Vec::new();
        for measurements in [Measurements::Stripe, Measurements::Seam] {
            let plan = planned(&cell, measurements);
            let promised = &plan.prediction;
            assert!(promised.shows_all(), "{name}: {} of {}", promised.rank, promised.asked);
            let own = achieved((&cell, &plates), &plan, measurements, RUNS);
            tell(name, measurements, &plan, &own);
            // A χ²₇ over 7 has a variance of 2/7: three of the deviations of its mean over 60.
            assert!((0.79..1.21).contains(&own.consistency), "{name}: NEES/7 {}", own.consistency);
            for k in 0..LINES {
                let said = own.spread[k] / own.stated[(k, k)].sqrt();
                assert!((0.73..1.27).contains(&said), "{name}, unknown {k}: {said} of what is said");
                let kept = own.spread[k] / promised.sigma(k);
                // As for plates that meet. An edge point is measured far better across its stripe than along it, which seam points are not
                // promised.
                let least = if measurements == Measurements::Seam { 0.0 } else { 0.8 - 3.0 * 0.09 * 0.8 };
                assert!((least..1.27).contains(&kept), "{name}, unknown {k}: {kept} of what is promised");
            }
            if measurements == Measurements::Stripe {
                for (i, j) in (0..LINES).flat_map(|i| (0..i).map(move |j| (i, j))) {
                    let (expected, stated) = (alike(&promised.covariance, i, j), alike(&own.stated, i, j));
                    assert!((expected - stated).abs() < 0.2, "{name} {i}, {j}: {expected} and {stated}");
                }
            }
            scores.push(PlanRequest::default().goal.score(&promised.covariance));
        }
        assert!(scores[0] < scores[1], "{name}: stripes promise more: {scores:?}");
    }
}

fn tell(name: &str, measurements: Measurements, plan: &Plan, own: &Achieved) {
    let sigma = SVector::<f64, LINES>::from_fn(|k, _| plan.prediction.sigma(k));
    let range = |of: &dyn Fn(usize) -> f64| {
        let ratios: Vec<f64> = (0..LINES).map(|k| own.spread[k] / of(k)).collect();
        let (low, high) = ratios.iter().fold((f64::MAX, 0.0_f64), |(l, h), r| (l.min(*r), h.max(*r)));
        format!("{low:.2} to {high:.2}")
    };
    println!(
        "{name}, {measurements:?}: promised {:.4} ms, {:.4}°, {:.4} mm; error over promised {}, over said {}, NEES/7 {:.2}",
        sigma[0] * 1e3,
        sigma.fixed_rows::<3>(ROTATION).max().to_degrees(),
        sigma.fixed_rows::<3>(TRANSLATION).max() * 1e3,
        range(&|k| sigma[k]),
        range(&|k| own.stated[(k, k)].sqrt()),
        own.consistency
    );
}
