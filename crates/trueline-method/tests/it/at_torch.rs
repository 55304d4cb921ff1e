//! Tests the predicted error at the torch against samples of the covariance, propagated through the measurement itself.

use nalgebra::{DMatrix, Matrix3, SVector, Vector3};
use trueline_dataset::Recording;
use trueline_geometry::{Pose, se3, so3};
use trueline_method::config::Use;
use trueline_method::input::timestamps::Sampling;
use trueline_method::{Config, calibrate, input::observations};
use trueline_sim::{Preset, simulate};

const SAMPLES: usize = 20_000;

/// Standard normal numbers from the recording's own generator would correlate the two. These are sums of twelve
/// uniform ones of a linear congruential generator: mean 0, variance 1 exactly.
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }
}

#[test]
fn predicted_error_is_that_of_sampled_calibrations() {
    let recording = simulate(&Preset::Quick.scenario(), 5).unwrap();
    let used_at = Use { speed_m_s: 0.08, ..Use::default() };
    // An estimated and removed feature bias would move the point that represents the scan.
    let config = Config { used_at, feature_bias_px: 0.0, ..Config::default() };
    let c = calibrate(&recording, None, &config).unwrap();
    let torch = c.findings.checks.seam_point_error.unwrap();
    // The middle of the scan as in robot.csv, 4 ms apart. At 30°/s of tilting this is 0.1°, which rotates the ellipsoid by 0.002 of its size.
    let stamps = &c.findings.fit.features;
    let middle_s = stamps[stamps.len() / 2].stamp_s - c.best_fit().time_offset_s;
    let origin_ns = recording.robot[0].stamp_ns.min(recording.features[0].stamp_ns);
    let pose = recording
        .robot
        .iter()
        .min_by(|a, b| {
            let off =
                |s: &trueline_dataset::RobotSample| ((s.stamp_ns - origin_ns) as f64 * 1e-9 - middle_s).abs();
            off(a).total_cmp(&off(b))
        })
        .unwrap()
        .base_from_tool;
    let hand_eye = c.best_fit().tool_from_camera;
    let along = c.best_fit().lines[0].direction();
    let point_in_camera = middle_point(&recording, &config);
    assert!((torch.stand_off_m - point_in_camera.norm()).abs() < 1e-12);

    let root = DMatrix::from(c.best_fit_covariance().view((0, 0), (7, 7))).cholesky().unwrap().l();
    let seen_from = |base_from_tool: &Pose, tool_from_camera: &Pose| {
        base_from_tool.transform_point(&tool_from_camera.transform_point(&point_in_camera.into())).coords
    };
    let truth = seen_from(&pose, &hand_eye);
    let mut normal = Normal(1);
    let mut spread = Matrix3::zeros();
    for _ in 0..SAMPLES {
        let error = &root * SVector::<f64, 7>::from_fn(|_, _| normal.next());
        let turn = so3::exp(&error.fixed_rows::<3>(1).into_owned());
        let shift: Vector3<f64> = error.fixed_rows::<3>(4).into_owned();
        let wrong = se3::from_parts(turn * hand_eye.rotation, hand_eye.translation.vector + shift);
        // With too large a time offset the tool's pose is looked up that much earlier.
        let earlier =
            se3::from_parts(pose.rotation, pose.translation.vector - along * used_at.speed_m_s * error[0]);
        let found = seen_from(&earlier, &wrong);
        spread += (found - truth) * (found - truth).transpose() / SAMPLES as f64;
    }
    // A standard deviation from N samples is known to 1/√(2 N) = 0.5 %. The limit is four of those, and 0.2 % for the attitude.
    let towards = -(pose.rotation * (hand_eye.rotation * point_in_camera));
    let height = (towards - along * along.dot(&towards)).normalize();
    let across = height.cross(&along);
    for (axis, predicted) in [along, across, height].iter().zip(torch.sigma_m) {
        let sampled = axis.dot(&(spread * axis)).sqrt();
        assert!((sampled / predicted - 1.0).abs() < 0.025, "{sampled} {predicted}");
    }
    let mut values: Vec<f64> = spread.symmetric_eigenvalues().iter().map(|v| v.sqrt()).collect();
    values.sort_by(|a, b| b.total_cmp(a));
    for (sampled, predicted) in values.iter().zip(torch.semi_axes_m) {
        assert!((sampled / predicted - 1.0).abs() < 0.025, "{values:?} {:?}", torch.semi_axes_m);
    }
}

#[test]
fn another_stand_off_is_along_the_sheet() {
    let recording = simulate(&Preset::Quick.scenario(), 5).unwrap();
    let predicted = |stand_off_m| {
        let used_at = Use { speed_m_s: 0.0, stand_off_m, ..Use::default() };
        calibrate(&recording, None, &Config { used_at, ..Config::default() })
            .unwrap()
            .findings
            .checks
            .seam_point_error
            .unwrap()
    };
    let [near, own, far] = [Some(0.2), None, Some(1.5)].map(predicted);
    assert!((near.stand_off_m - 0.2).abs() < 1e-12 && (far.stand_off_m - 1.5).abs() < 1e-12);
    // Rotation errors grow with the lever and dominate at large distance.
    assert!(far.semi_axes_m[0] > 2.0 * own.semi_axes_m[0]);
}

/// Median of the points on the sheet, axis by axis.
fn middle_point(recording: &Recording, config: &Config) -> Vector3<f64> {
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    let observed = observations::observe(recording, &sampling, config).unwrap();
    Vector3::from_fn(|axis, _| {
        let mut values: Vec<f64> = observed.list.iter().map(|o| o.point_in_camera[axis]).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    })
}

/// Another robot needs the true transform: the errors of the scanning robot count by a quarter of its accuracy instead of a
/// sixth.
#[test]
fn for_another_robot_its_own_errors_count_half_as_much_again() {
    let robot_m = |by_another_robot: bool| {
        let used_at = Use { by_another_robot, ..Use::default() };
        let config = Config { used_at, feature_bias_px: 0.0, ..Config::default() };
        let recording = simulate(&Preset::Quick.scenario(), 5).unwrap();
        let found = calibrate(&recording, None, &config).unwrap();
        found.findings.checks.seam_error.unwrap().budget_m.robot
    };
    let [same, another] = [false, true].map(robot_m);
    // The robot errors of an ideal seam are considered, so their contribution equals the assumed level.
    assert!((another / same - 1.5).abs() < 1e-6, "{another} {same}");
}
