//! A scan that arrives bit by bit.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use trueline_dataset::Recording;
use trueline_lsq::{Information, LeastSquares, Loss, SolveOptions, solve};
use trueline_method::input::noise_levels::NoiseLevels;
use trueline_method::input::observations::{self, Observations};
use trueline_method::input::timestamps::Sampling;
use trueline_method::problem::line_problem::{Criterion, LineProblem};
use trueline_method::solve::streaming::Streaming;
use trueline_method::{Config, Parameters, ResidualKind};
use trueline_sim::{Preset, simulate};

const CRITERION: Criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Tukey { scale: 8.0 } };

fn observed(recording: &Recording) -> Observations {
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    observations::observe(recording, &sampling, &Config::default()).unwrap()
}

/// The first seconds of a recording.
fn beginning(recording: &Recording, lasts_s: f64) -> Recording {
    let end_ns = recording.robot[0].stamp_ns + (lasts_s * 1e9) as i64;
    let mut part = recording.clone();
    part.robot.retain(|s| s.stamp_ns <= end_ns);
    part.features.retain(|f| f.stamp_ns <= end_ns - 100_000_000);
    part
}

fn errors(found: &Parameters, truth: &Parameters, sigma: impl Fn(usize) -> f64) -> f64 {
    let (turn, shift) =
        trueline_geometry::se3::difference_decoupled(&found.tool_from_camera, &truth.tool_from_camera);
    let offset = found.time_offset_s - truth.time_offset_s;
    let errors = [offset, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
    errors.iter().enumerate().map(|(k, e)| (e / sigma(k)).abs()).fold(0.0, f64::max)
}

#[test]
fn the_estimate_follows_and_relinearised_is_the_batch_solution() {
    for preset in [Preset::Quick, Preset::TwoLines] {
        let recording = simulate(&preset.scenario(), 21).unwrap();
        let truth = recording.truth.as_ref().unwrap();
        let start = Parameters {
            time_offset_s: truth.parameters.time_offset_s + 5e-4,
            ..Parameters::straight(&truth.parameters, truth.lines.clone())
        };
        let start_dimension = start.dimension();
        let whole = observed(&recording);
        let noise = NoiseLevels { robot_sigma_m: whole.robot.noise_m, stamp_sigma_s: 1e-4, factor: 1.0 };
        let mut stream =
            Streaming::new(observed(&beginning(&recording, 2.0)), start.clone(), CRITERION, noise);
        let origin_ns = recording.robot[0].stamp_ns;
        let seconds = |ns: i64| (ns - origin_ns) as f64 * 1e-9;
        let from = stream.observations().list.len();
        let mut poses = recording.robot.iter().peekable();
        let mut sigmas = Vec::new();
        for frame in whole.list[from..].chunk_by(|a, b| a.frame == b.frame) {
            while let Some(s) = poses.next_if(|s| seconds(s.stamp_ns) <= frame[0].stamp_s) {
                stream.add_pose(seconds(s.stamp_ns), s.base_from_tool).unwrap();
            }
            let current = stream.add_frame(frame).unwrap();
            // Two seconds do not show everything; then a covariance is that of what they show.
            if current.rank == start_dimension {
                sigmas.push(current.covariance[(0, 0)].sqrt());
            }
            // At most the images of the window and the margin wait: 25 ms of one each 30 ms.
            assert!(current.waiting <= 2 * whole.line_count, "{}", current.waiting);
        }
        // More images never make it worse; at the end it is several times better than after three seconds.
        assert!(sigmas.windows(2).all(|w| w[1] <= w[0] * (1.0 + 1e-9)));
        assert!(sigmas[sigmas.len() - 1] < 0.5 * sigmas[30]);

        let before = stream.current().unwrap();
        stream.relinearise().unwrap();
        let after = stream.current().unwrap();
        let sigma = |k: usize| after.covariance[(k, k)].sqrt();
        // One step from half a millisecond off. The loss weighs a residual of s = 4 by (1 − s/64)² = 0.88 there, and by
        // a little more at the optimum: a tenth of the way may be left.
        let off = errors(&start, &after.parameters, sigma);
        let moved = errors(&before.parameters, &after.parameters, sigma);
        assert!(moved < 0.1 * off, "{moved} of {off}");

        // The same observations at once, from another start.
        let own = stream.observations();
        let problem = LineProblem::new(own, &own.list, CRITERION, &noise, &before.parameters);
        let options = SolveOptions::default();
        let batch = solve(&problem, stream.current().unwrap().parameters, &[], &options).unwrap();
        // Both end with a step below 1e-7 of a sigma, after which the next would be far smaller.
        assert!(errors(&after.parameters, &batch.state, sigma) < 1e-6);
        let covariance = Information::new(&batch.equations.hessian, &[], 1e-9).unwrap().covariance();
        assert!((after.covariance[(4, 4)] / covariance[(4, 4)] - 1.0).abs() < 1e-6);

        // And the whole recording read at once: the path differs only where the two parts join, 40 ms of 20 s.
        let list = &whole.list[..own.list.len()];
        let problem = LineProblem::new(&whole, list, CRITERION, &noise, &before.parameters);
        let read = solve(&problem, batch.state.clone(), &[], &options).unwrap();
        assert!(errors(&after.parameters, &read.state, sigma) < 0.1);
        assert_eq!(problem.dimension(), after.parameters.dimension());
    }
}

#[test]
fn poses_out_of_order_are_refused() {
    let recording = simulate(&Preset::Quick.scenario(), 22).unwrap();
    let part = observed(&recording);
    let truth = recording.truth.unwrap();
    let at = Parameters::straight(&truth.parameters, truth.lines);
    let noise = NoiseLevels { robot_sigma_m: 1e-5, stamp_sigma_s: 1e-4, factor: 1.0 };
    let mut stream = Streaming::new(part, at, CRITERION, noise);
    let pose = recording.robot[0].base_from_tool;
    stream.add_pose(100.0, pose).unwrap();
    assert!(stream.add_pose(100.0, pose).is_err());
    assert!(stream.add_pose(f64::NAN, pose).is_err());
}
