//! Tests that correlated errors of u and v are weighted by their correlation, against an independent solver.

use nalgebra::{Matrix2, SMatrix, SVector, UnitQuaternion, Vector2, Vector3};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::{Plane, Pose, se3};
use trueline_lsq::Loss;
use trueline_method::{Calibration, Config, Stamps, calibrate};
use trueline_model::{Camera, LaserSheet};
use trueline_sim::noise::Noise;
use trueline_sim::{Disturbance, Preset, simulate};

/// Correlation of a seam point's pixels. A stripe seen at 45° moves u and v equally.
const CORRELATION: f64 = 0.95;
const SIGMA_PX: f64 = 0.2;

/// A scan with pixel errors only, drawn with the stated correlation of each.
fn scan_with(seed: u64, correlation: impl Fn(usize) -> f64) -> Recording {
    let mut scenario = Preset::Quick.scenario();
    scenario.disturbance = Disturbance::default();
    let mut recording = simulate(&scenario, seed).unwrap();
    let mut noise = Noise::new(seed, 0xc0);
    for (k, feature) in recording.features.iter_mut().enumerate() {
        let correlation = correlation(k);
        let Measured::Pixel([u, v]) = feature.measured else { panic!("a camera was simulated") };
        let [a, b] = [noise.normal(SIGMA_PX), noise.normal(SIGMA_PX)];
        let other = correlation * a + (1.0 - correlation * correlation).sqrt() * b;
        feature.measured = Measured::Pixel([u + a, v + other]);
        feature.sigma = Some([SIGMA_PX; 2]);
        feature.correlation = correlation;
    }
    recording
}

/// The same estimate by independent code: pixels predicted through the camera, slopes by differences, all features summed with the inverses of their
/// covariances, Newton steps from the truth. Between samples the robot moves linearly.
struct Oracle<'a> {
    recording: &'a Recording,
    camera: &'a Camera,
    plane: &'a Plane,
}

/// Time offset, hand-eye transform, a point of the line and its direction.
#[derive(Clone)]
struct Answer {
    time_offset_s: f64,
    tool_from_camera: Pose,
    point: Vector3<f64>,
    direction: Vector3<f64>,
}

impl Answer {
    /// Time (s), rotation in the tool's frame (rad), translation (m), and the line: a point in two directions (m), a direction (rad).
    fn moved(&self, step: &SVector<f64, 11>) -> Self {
        let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(1).into_owned());
        let sides = Plane::new(self.direction, 0.0).map(LaserSheet::from_plane).unwrap();
        Self {
            time_offset_s: self.time_offset_s + step[0],
            tool_from_camera: Pose::from_parts(
                (self.tool_from_camera.translation.vector + step.fixed_rows::<3>(4)).into(),
                turn * self.tool_from_camera.rotation,
            ),
            point: self.point + sides.axes() * step.fixed_rows::<2>(7),
            direction: (self.direction + sides.axes() * step.fixed_rows::<2>(9)).normalize(),
        }
    }
}

impl Oracle<'_> {
    fn base_from_tool(&self, time_s: f64) -> Pose {
        let robot = &self.recording.robot;
        let second = |k: usize| (robot[k].stamp_ns - robot[0].stamp_ns) as f64 * 1e-9;
        let after = (1..robot.len()).find(|&k| second(k) >= time_s).unwrap();
        let part = (time_s - second(after - 1)) / (second(after) - second(after - 1));
        robot[after - 1].base_from_tool.lerp_slerp(&robot[after].base_from_tool, part)
    }

    fn pixel(&self, answer: &Answer, stamp_ns: i64) -> Vector2<f64> {
        let stamp_s = (stamp_ns - self.recording.robot[0].stamp_ns) as f64 * 1e-9;
        let base_from_camera = self.base_from_tool(stamp_s - answer.time_offset_s) * answer.tool_from_camera;
        let point = base_from_camera.inverse_transform_point(&answer.point.into()).coords;
        let direction = base_from_camera.inverse_transform_vector(&answer.direction);
        let normal = self.plane.normal();
        let seen = point + direction * ((self.plane.offset() - normal.dot(&point)) / normal.dot(&direction));
        self.camera.project(&seen).unwrap()
    }

    /// The answer with its covariance.
    fn solve(&self, truth: &Answer) -> (Answer, SMatrix<f64, 11, 11>) {
        const STEP: f64 = 1e-6;
        let (mut answer, mut covariance) = (truth.clone(), SMatrix::zeros());
        for _ in 0..8 {
            let (mut hessian, mut gradient) = (SMatrix::<f64, 11, 11>::zeros(), SVector::<f64, 11>::zeros());
            for feature in &self.recording.features {
                let Measured::Pixel(measured) = feature.measured else { panic!("a camera was simulated") };
                let ([a, b], c) = (feature.sigma.unwrap(), feature.correlation);
                let weight = Matrix2::new(a * a, c * a * b, c * a * b, b * b).try_inverse().unwrap();
                let slope = SMatrix::<f64, 2, 11>::from_columns(&std::array::from_fn::<_, 11, _>(|k| {
                    let [there, back] = [STEP, -STEP].map(|step| {
                        let mut moved = SVector::zeros();
                        moved[k] = step;
                        self.pixel(&answer.moved(&moved), feature.stamp_ns)
                    });
                    (there - back) / (2.0 * STEP)
                }));
                let residual = Vector2::from(measured) - self.pixel(&answer, feature.stamp_ns);
                hessian += slope.transpose() * weight * slope;
                gradient += slope.transpose() * weight * residual;
            }
            covariance = hessian.try_inverse().unwrap();
            answer = answer.moved(&(covariance * gradient));
        }
        (answer, covariance)
    }
}

#[test]
fn a_dense_solver_with_full_covariances_says_the_same() {
    let mut recording = scan_with(7, |k| CORRELATION * (0.37 * k as f64).sin());
    let config = Config {
        loss: Some(Loss::Squared),
        robot_sigma_m: Some(1e-9),
        stamp_sigma_s: Some(1e-9),
        stamps: Stamps::Raw,
        ..Config::noise_only()
    };
    let calibration = calibrate(&recording, None, &config).unwrap();
    recording.features.iter_mut().for_each(|feature| feature.correlation *= -1.0);
    let reverse = calibrate(&recording, None, &config).unwrap();
    recording.features.iter_mut().for_each(|feature| feature.correlation *= -1.0);

    let Sensor::CameraLaser { camera, laser_plane_in_camera: plane, .. } = &recording.sensor else {
        panic!("a camera was simulated")
    };
    let simulated = recording.truth.as_ref().unwrap();
    let truth = Answer {
        time_offset_s: simulated.parameters.time_offset_s,
        tool_from_camera: simulated.parameters.tool_from_camera,
        point: *simulated.lines[0].anchor(),
        direction: simulated.lines[0].direction(),
    };
    let (oracle, covariance) = Oracle { recording: &recording, camera, plane }.solve(&truth);
    let differences = |found: &Calibration| -> [f64; 7] {
        let found = found.best_fit();
        let (turn, shift) = se3::difference_decoupled(&found.tool_from_camera, &oracle.tool_from_camera);
        let parts =
            [found.time_offset_s - oracle.time_offset_s, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
        std::array::from_fn(|k| parts[k] / covariance[(k, k)].sqrt())
    };
    let [right, wrong] = [differences(&calibration), differences(&reverse)];
    let ratios: [f64; 7] = std::array::from_fn(|k| calibration.sigma(k).unwrap() / covariance[(k, k)].sqrt());
    println!("differences {right:.4?} σ, with the sign turned {wrong:.2?} σ; ratios of σ {ratios:.4?}");
    // Measured: 0.08 of a σ for any noise. With the wrong sign 2.4. Two estimates of the same numbers, one of them 1.01 times as certain, differ by
    // √(1.01² − 1) = 0.14 of a σ. A σ is scaled by the actual noise: 1 ± 1 / √(2 · 2N), three of them for N = 300.
    assert!(right.iter().all(|z| z.abs() < 0.15));
    assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.09));
    assert!(wrong.iter().any(|z| z.abs() > 0.5));
}
