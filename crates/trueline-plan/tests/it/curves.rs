//! Scans over curves: what a plan promises is what a calibration of the scan states.

use crate::cells;

use cells::{exact, example, scan, scenario};
use nalgebra::Vector3;
use trueline_method::config::Target;
use trueline_method::{Config, Status, calibrate};
use trueline_plan::{Cell, PlanRequest, Shape, plan};

/// A whole pipe of 60 mm, and two lines with a corner, about the middle of the example's seam.
fn curves(about: Vector3<f64>) -> [(&'static str, Vec<Vector3<f64>>); 2] {
    let ring = (0..=360).map(|k| {
        let turn = f64::from(k % 360).to_radians();
        about + Vector3::new(turn.cos(), turn.sin(), 0.0) * 0.06
    });
    let corner = [[-0.1, -0.02, 0.0], [0.0, -0.02, 0.0], [0.08, 0.06, 0.0]];
    [("ring", ring.collect()), ("corner", corner.map(|at| about + Vector3::from(at)).to_vec())]
}

/// The example's cell over a curve, at its guess.
fn over(points: &[Vector3<f64>]) -> Cell {
    let mut cell = exact(example());
    cell.follow(points).unwrap();
    cell
}

#[test]
fn a_scan_over_a_curve_keeps_what_its_plan_promises() {
    let seam = example().seam;
    for (name, points) in curves(0.5 * (seam.from_m + seam.to_m)) {
        let cell = over(&points);
        let closed = name == "ring";
        assert_eq!(cell.course.as_ref().unwrap().closed, closed);
        let ask = PlanRequest {
            shapes: vec![Shape::ThreePasses],
            evaluations: 600,
            duration_s: 25.0,
            ..PlanRequest::default()
        };
        let planned = plan(&cell, &ask, &|| ()).unwrap();
        assert!(planned.prediction.shows_all(), "{name}");
        let mut scenario = scenario(&cell, (cell.tool_from_camera, cell.seam), 25.0);
        scenario.cell.curve = cell.course.as_ref().map(|course| course.drawn().clone());
        let recording = scan(&scenario, &planned.motion, 3);
        // The sensor sees the curve all along: the path is smoothed, the curve is not.
        let frames = 25.0 / cell.frame_period_s;
        assert!(recording.features.len() as f64 > 0.97 * frames, "{name}: {}", recording.features.len());
        let config = Config { target: Target::Curve, ..Config::noise_only() };
        let found = calibrate(&recording, None, &config).unwrap();
        assert_eq!(found.status(), Status::Accepted, "{name}: {:?}", found.reasons());
        let truth = recording.truth.as_ref().unwrap().parameters;
        let off_s = found.best_fit().time_offset_s - truth.time_offset_s;
        assert!(off_s.abs() < 4.0 * found.sigma(0).unwrap(), "{name}: {off_s}");
        for k in 0..7 {
            let (promised, said) = (planned.prediction.sigma(k), found.sigma(k).unwrap());
            // The plan's curve is one of free pieces, the estimate's as stiff as the scan shows.
            assert!((0.7..1.3).contains(&(said / promised)), "{name} {k}: {said} {promised}");
        }
    }
}
