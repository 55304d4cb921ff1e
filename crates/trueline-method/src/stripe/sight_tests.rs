//! Tests stripes as sights of the adjustment against differences of residuals in worlds changed by hand.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::adjustment::adjust::Adjustment;
use crate::adjustment::coloured::Coloured;
use crate::adjustment::columns::Columns;
use crate::adjustment::sights::Sights;
use crate::adjustment::weights::Weights;
use crate::assess::tilt_bias::TiltBias;
use crate::config::{Config, Measurements};
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{observe, origin_ns};
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::parameters::Parameters;
use crate::stripe::fit::{StripeFit, StripeSolver};
use crate::stripe::frame_residual::ROWS;
use crate::stripe::frames::{Sight, frames};
use crate::stripe::motion_information;
use crate::stripe::plate_sights::{PlateFrame, PlateSights};
use crate::stripe::problem::StripeProblem;
use crate::stripe::start;
use crate::stripe::target::EDGE;
use crate::stripe::unknowns::OFFSET_OF_PLANE;
use crate::stripe::whitening::SharedNoise;
use nalgebra::{DMatrix, DVector, SVector, Vector2, Vector3};
use trueline_dataset::Recording;
use trueline_geometry::{Pose, Trajectory, lag, se3, so3};
use trueline_sim::{Disturbance, PlatePair, Plates, Preset, Scenario, scan_plates};

const LEVELS: NoiseLevels = NoiseLevels { robot_sigma_m: 3e-5, stamp_sigma_s: 1e-4, factor: 1.0 };

/// Checks the fit of a scan without noise, of a joint of this kind.
fn with_scan(pair: PlatePair, check: impl Fn(&Worlds<'_>)) {
    let mut scenario = Preset::Good.scenario();
    scenario.timing.duration_s = 6.0;
    scenario.disturbance = Disturbance::default();
    with_scan_of(&scenario, pair, check);
}

fn with_scan_of(scenario: &Scenario, pair: PlatePair, check: impl Fn(&Worlds<'_>)) {
    let recording = scan_plates(scenario, &Plates { pair, ..Plates::default() }, 3).unwrap();
    let sampling = Sampling::of(&recording, origin_ns(&recording));
    let config = Config::noise_only();
    let observed = observe(&recording, &sampling, &config).unwrap();
    let all = frames(&recording, &observed, Measurements::Stripe, &config).unwrap();
    let truth = recording.truth.as_ref().unwrap();
    let like = Parameters::straight(&truth.parameters, truth.lines.clone());
    let begin = start::start(&observed, &all, &like, None).unwrap();
    let fixed = start::held(&begin, &all.without_plates);
    let solver = StripeSolver {
        observations: &observed,
        frames: &all.list,
        shared: SharedNoise { levels: LEVELS, robot_sigma_rad: 1e-5 },
        loss: config.final_loss(),
        shape_prior: None,
        fixed: &fixed,
    };
    let robot_times_s = sampling.robot_times_s(Dejittered::default());
    check(&Worlds { recording: &recording, robot_times_s, fit: solver.fit(begin).unwrap() });
}

/// Some frames of a fit, and their residuals in a world with another path.
struct Worlds<'a> {
    recording: &'a Recording,
    robot_times_s: &'a [f64],
    fit: StripeFit<'a>,
}

impl Worlds<'_> {
    fn frames(&self) -> Vec<PlateFrame> {
        let sights = PlateSights::of(&self.fit, DMatrix::zeros(0, 0));
        let frames: Vec<PlateFrame> =
            sights.frames(self.fit.state()).into_iter().flatten().skip(8).step_by(17).collect();
        assert!(frames.len() > 8, "{}", frames.len());
        frames
    }

    /// Residuals of a frame along another path.
    fn along(&self, frame: &PlateFrame, path: Trajectory, later_s: f64) -> Option<SVector<f64, ROWS>> {
        let mut elsewhere = self.fit.problem.observations.clone();
        elsewhere.robot.trajectory = path;
        let weighed = self.fit.problem.frames[frame.index];
        let mut at = self.fit.state().clone();
        at.time_offset_s -= later_s;
        let there = StripeProblem {
            observations: &elsewhere,
            frames: Vec::new(),
            unknowns: self.fit.problem.unknowns,
            shape_prior: None,
        };
        let (parts, _) = there.linearized(&weighed, &at)?;
        Some(weighed.whitener * weighed.residual(&parts))
    }

    fn path(&self) -> &Trajectory {
        &self.fit.problem.observations.robot.trajectory
    }

    fn moved_path(&self, by: impl Fn(&Pose) -> [Vector3<f64>; 2]) -> Trajectory {
        let path = self.path();
        let moved = path.times().iter().map(|time| {
            let pose = path.pose_at(*time).unwrap();
            let [shift, turn] = by(&pose);
            se3::from_parts(so3::exp(&turn) * pose.rotation, pose.translation.vector + shift)
        });
        Trajectory::new(path.times().to_vec(), &moved.collect::<Vec<_>>()).unwrap()
    }
}

const PAIRS: [PlatePair; 3] = [PlatePair::Meeting, PlatePair::Lap { step_m: 3e-3 }, PlatePair::Edge];

#[test]
fn a_shift_and_a_turn_of_the_robot_move_residuals_as_another_path_does() {
    let (shift, turn) = (Vector3::new(1.1, -0.7, 0.9) * 1e-5, Vector3::new(-0.6, 1.2, 0.8) * 1e-5);
    let check = |worlds: &Worlds<'_>| {
        let path = worlds.moved_path(|_| [shift, turn]);
        for frame in worlds.frames() {
            let by_path = worlds.along(&frame, path.clone(), 0.0).unwrap() - frame.residual;
            let found = frame.by_shift * shift + frame.by_turn * turn;
            // Second order of 1e-5, over residuals of some hundred units a millimetre.
            assert!((found - by_path).norm() < 1e-3 * by_path.norm() + 1e-6, "{found} {by_path}");
        }
    };
    PAIRS.into_iter().for_each(|pair| with_scan(pair, check));
}

#[test]
fn half_the_square_of_a_lag_moves_residuals_as_a_lagging_robot_does() {
    with_scan(PlatePair::Meeting, |worlds| {
        let lag_s = 0.008;
        let late = lag::first_order(worlds.path(), lag_s).unwrap();
        let (mut off, mut all) = (0.0, 0.0);
        for frame in worlds.frames() {
            let Some(there) = worlds.along(&frame, late.clone(), lag_s) else { continue };
            let by_path = there - frame.residual;
            let found = frame.by_lag * (0.5 * lag_s * lag_s);
            off += (found - by_path).norm_squared();
            all += by_path.norm_squared();
        }
        // The third order of 8 ms in swings of 3 rad/s, and differences over 60 ms of the same: a tenth.
        assert!(off.sqrt() < 0.1 * all.sqrt(), "{} of {}", off.sqrt(), all.sqrt());
    });
}

#[test]
fn a_form_of_one_height_moves_residuals_as_the_offset_of_its_surface_does() {
    let check = |worlds: &Worlds<'_>| {
        let at = worlds.fit.state();
        let sights = PlateSights::of(&worlds.fit, DMatrix::zeros(0, 0));
        let surfaces = if at.joints[0].edge.is_some() { EDGE + 1 } else { EDGE };
        for (frame, surface) in
            worlds.frames().iter().flat_map(|frame| (0..surfaces).map(move |surface| (frame, surface)))
        {
            let mut step = DVector::zeros(at.unknowns().dimension());
            step[at.unknowns().plane(0, surface).start + OFFSET_OF_PLANE] = 1e-5;
            let by_offset = sights.residual(frame, &at.retract(&step)).unwrap().0 - frame.residual;
            let found = frame.by_form[surface] * SVector::<f64, ROWS>::repeat(1e-5);
            // Second order of 0.01 mm.
            assert!((found - by_offset).norm() < 1e-3 * by_offset.norm() + 1e-6, "{found} {by_offset}");
        }
    };
    PAIRS.into_iter().for_each(|pair| with_scan(pair, check));
}

#[test]
fn a_bias_with_the_tilt_moves_residuals_as_moved_support_points_do() {
    with_scan(PlatePair::Lap { step_m: 3e-3 }, |worlds| {
        let (fit, observed) = (&worlds.fit, worlds.fit.problem.observations);
        let sights = PlateSights::of(fit, DMatrix::zeros(0, 0));
        let tilt = TiltBias::about(&sights.poses(fit.state()));
        let bias_px = [0.03, -0.05, 0.04, 0.02, -0.06, 0.05];
        let (mut off, mut all) = (0.0, 0.0);
        for frame in sights.frames(fit.state()).iter().flatten() {
            let mut moved = fit.problem.frames[frame.index];
            let placement = moved.placement(observed, fit.state()).unwrap();
            let in_sensor = tilt.in_sensor(&fit.state().tool_from_camera, &placement);
            let of_axis = |k: usize| Vector2::new(bias_px[2 * k], bias_px[2 * k + 1]) * in_sensor[k];
            let px: Vector2<f64> = (0..3).map(of_axis).sum();
            let Sight::Stripes(stripes) = &mut moved.frame.sight else { continue };
            for support in stripes.iter_mut().flatten().flatten() {
                support.reported += support.sheet_per_px * px;
            }
            if let Some(edge) = &mut moved.frame.edge {
                edge.reported += edge.sheet_per_px * px;
            }
            let (parts, _) = fit.problem.linearized(&moved, fit.state()).unwrap();
            let by_points = moved.whitener * moved.residual(&parts) - frame.residual;
            off += (frame.by_bias * SVector::from(bias_px) - by_points).norm_squared();
            all += by_points.norm_squared();
        }
        // Support points move along their stripe as well, and it bends by some 1e-3.
        assert!(off.sqrt() < 1e-2 * all.sqrt(), "{} of {}", off.sqrt(), all.sqrt());
    });
}

/// Noise of the poses in the information, by rows that pass the filter of the noise, against the plain sums of the fit. With white noise of the expected
/// size both are the same.
#[test]
fn noise_of_the_poses_is_that_of_the_plain_sums() {
    let mut scenario = Preset::Good.scenario();
    scenario.timing.duration_s = 6.0;
    with_scan_of(&scenario, PlatePair::Meeting, |worlds| {
        let (fit, at) = (&worlds.fit, worlds.fit.state());
        let mut scan = PlateSights::of(fit, DMatrix::zeros(0, 0));
        let exposures_s = scan.exposures_s(at.time_offset_s);
        let robot = &fit.problem.observations.robot;
        let halves = robot.halves(worlds.recording, worlds.robot_times_s, &exposures_s).unwrap();
        let plain = motion_information::of_noise(fit, &halves);
        scan.halves = Some(halves);
        let (columns, count) = (Columns::of(at, &[], Vec::new()), fit.problem.frames.len());
        let adjustment = Adjustment {
            scan,
            shape_prior: None,
            coefficients: DVector::zeros(columns.estimated()),
            columns,
            at: at.clone(),
            unseen: DMatrix::zeros(0, 0),
            sigmas: [1.0; ROWS],
            noise: [Coloured::NONE; ROWS],
            known_noise: None,
            weights: Weights { of: vec![1.0; count], ..Weights::default() },
            threads: 1,
        };
        let found = adjustment.pose_noise().unwrap();
        assert!(plain.norm() > 0.0 && (&found - &plain).norm() < 1e-9 * plain.norm(), "{found} {plain}");
    });
}
