//! Plans that use whole stripes: what they promise is the spread of the estimates from simulated stripes, and they leave less than
//! plans for seam points do.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod cells;

use cells::{exact, example, scenario};
use nalgebra::{SMatrix, SVector, UnitVector3};
use trueline_geometry::se3;
use trueline_method::problem::parameters::{LINES, ROTATION, TRANSLATION};
use trueline_method::{Config, Measurements, Status, calibrate};
use trueline_plan::surroundings::Plate;
use trueline_plan::{Cell, Plan, PlanRequest, Shape, plan};
use trueline_sim::{Plates, scan_plates_along};

/// The example's cell where the guess is right, with the two plates of a fillet of 90° about the seam, open towards the sensor.
fn fillet() -> Cell {
    let mut cell = exact(example());
    let along = cell.seam.direction().unwrap().into_inner();
    let away = -scenario_of(&cell, 1.0).cell.approach.into_inner();
    let up = (away - along * along.dot(&away)).normalize();
    let side = along.cross(&up);
    let plate = |turn: f64| Plate {
        point_m: 0.5 * (cell.seam.from_m + cell.seam.to_m),
        normal: UnitVector3::new_normalize(up + side * turn),
    };
    // The simulator's left plate first: it is on the side of which the sensor's stripe begins.
    cell.surroundings.plates = vec![plate(-1.0), plate(1.0)];
    cell
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

/// What the estimates from the simulator's stripes do.
struct Achieved {
    /// Root mean square of their errors.
    spread: SVector<f64, LINES>,
    /// The mean of the covariances that they state.
    stated: SMatrix<f64, LINES, LINES>,
}

fn achieved(cell: &Cell, plan: &Plan, runs: u64) -> Achieved {
    let scenario = scenario_of(cell, plan.motion.design().duration_s);
    let plates = Plates { column_sigma_px: cell.noise.feature_px, ..Plates::default() };
    let config = Config { measurements: Measurements::Stripe, ..Config::noise_only() };
    let (mut squares, mut stated) = (SVector::<f64, LINES>::zeros(), SMatrix::zeros());
    for seed in 0..runs {
        let along = |time_s| plan.motion.base_from_tool(time_s);
        let recording = scan_plates_along(&scenario, &plates, &along, seed).unwrap();
        let truth = recording.truth.as_ref().unwrap().parameters;
        let found = calibrate(&recording, Some(&truth), &config).unwrap();
        assert_eq!(found.status(), Status::Accepted, "{:?}", found.reasons());
        let (turn, shift) =
            se3::difference_decoupled(&found.best_fit().tool_from_camera, &truth.tool_from_camera);
        squares[0] += (found.best_fit().time_offset_s - truth.time_offset_s).powi(2);
        for axis in 0..3 {
            squares[ROTATION + axis] += turn[axis].powi(2);
            squares[TRANSLATION + axis] += shift[axis].powi(2);
        }
        stated += SMatrix::<f64, LINES, LINES>::from_fn(|i, j| found.covariance(i, j).unwrap());
    }
    Achieved { spread: (squares / runs as f64).map(f64::sqrt), stated: stated / runs as f64 }
}

#[test]
fn a_plan_for_stripes_keeps_what_it_promises_and_beats_one_for_seam_points() {
    let cell = fillet();
    let (by_stripes, by_points) = (planned(&cell, Measurements::Stripe), planned(&cell, Measurements::Seam));
    let (own, other) = (achieved(&cell, &by_stripes, 60), achieved(&cell, &by_points, 60));
    for k in 0..LINES {
        let ratio = own.spread[k] / by_stripes.prediction.sigma(k);
        // 60 scans know their spread to 1/√120 = 9 %: three of that above. Below, the robot's noise counts for too much in each frame:
        // slow swings see √(33/250/0.205) = 0.8 of it, as for seam points, and here it is nearly all of the noise.
        assert!((0.8 - 3.0 * 0.09 * 0.8..1.27).contains(&ratio), "unknown {k}: {ratio}");
    }
    // By the score that is asked for: the worst in units of what is wanted, of what the estimator states: 60 scans know their spread to 9 %.
    let goal = PlanRequest::default().goal;
    let worst = |stated: &SMatrix<f64, LINES, LINES>| {
        (0..LINES).filter_map(|k| Some(stated[(k, k)].sqrt() / goal.wanted(k)?)).fold(0.0, f64::max)
    };
    let (by_its_own, by_the_other) = (worst(&own.stated), worst(&other.stated));
    assert!(by_its_own < by_the_other, "{by_its_own} and {by_the_other}");
    // What is alike in two unknowns tells signs apart, which their sigmas do not.
    let promised = &by_stripes.prediction.covariance;
    let alike =
        |c: &SMatrix<f64, LINES, LINES>, i: usize, j: usize| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt();
    for (i, j) in (0..LINES).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let (expected, stated) = (alike(promised, i, j), alike(&own.stated, i, j));
        assert!((expected - stated).abs() < 0.2, "{i}, {j}: {expected} and {stated}");
    }
}
