//! Where one sensor is beside another on a robot that errs slowly: calibrated together, and each by itself.
//!
//! `cargo run --release -p trueline-studies -- two_sensors [CELLS [FIRST SEED]]` prints the RMS errors of the transform between them beside
//! the stated ±, and the mean normalised square of its six numbers (1 is honest).
#![allow(clippy::unwrap_used, reason = "a study fails by panicking")]

use crate::arguments::number;
use nalgebra::{Matrix6, Vector3, Vector6};
use trueline_geometry::{Pose, se3};
use trueline_method::several_sensors::tied;
use trueline_method::{Calibration, Config, Status, calibrate};
use trueline_sim::noise::Noise;
use trueline_sim::{Preset, SlowErrors, random_cell, simulate_sensors};

/// Accuracy of the robot, as it is stated and drawn, m.
const ACCURACY_M: f64 = 0.3e-3;
/// Standard deviation of each axis of the position for this accuracy, as the method takes it, m.
const POSITION_M: f64 = ACCURACY_M / 6.0;
/// Waviness of the seam, as it is stated, m. The seam is straight.
const WAVINESS_M: f64 = 1e-6;
/// Length that turns a position into an attitude, m.
const ARM_M: f64 = 1.5;
/// Step of the differences, rad and m.
const STEP: f64 = 1e-6;

/// Sums over the cells.
#[derive(Default)]
struct Sums {
    squares: Vector6<f64>,
    variances: Vector6<f64>,
    normalised: f64,
    cells: f64,
}

impl Sums {
    fn add(&mut self, off: &Vector6<f64>, variances: &Vector6<f64>) {
        self.squares += off.component_mul(off);
        self.variances += variances;
        self.normalised += off.component_mul(off).component_div(variances).sum() / 6.0;
        self.cells += 1.0;
    }

    fn print(&self, name: &str) {
        let rms = |sums: &Vector6<f64>, first: usize| (sums.fixed_rows::<3>(first).sum() / self.cells).sqrt();
        let [turn, said_turn] = [&self.squares, &self.variances].map(|sums| rms(sums, 0).to_degrees());
        let [shift, said_shift] = [&self.squares, &self.variances].map(|sums| rms(sums, 3) * 1e3);
        let nees = self.normalised / self.cells;
        println!(
            "| {name} | {} | {nees:.2} | {turn:.4}° ({said_turn:.4}°) | {shift:.3} ({said_shift:.3}) mm |",
            self.cells
        );
    }
}

fn apart(found: &Pose, truth: &Pose) -> Vector6<f64> {
    let (turn, shift) = se3::difference_decoupled(found, truth);
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}

/// The transform between two sensors, and the variances of its six numbers, if each was calibrated by itself.
fn separately(each: &[(String, Calibration)]) -> (Pose, Vector6<f64>) {
    let poses = [0, 1].map(|k| each[k].1.tool_from_camera().unwrap().tool_from_camera);
    let between = poses[0].inverse() * poses[1];
    let mut variances = Vector6::zeros();
    for (k, (_, one)) in each.iter().enumerate() {
        let slope = Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|j| {
            let mut moved = poses;
            let part = |first: usize| Vector3::from_fn(|axis, _| if first + axis == j { STEP } else { 0.0 });
            moved[k] = se3::retract_decoupled(&poses[k], &part(0), &part(3));
            apart(&(moved[0].inverse() * moved[1]), &between) / STEP
        }));
        let covariance = one.tool_from_camera().unwrap().covariance;
        variances += (slope * covariance * slope.transpose()).diagonal();
    }
    (between, variances)
}

/// Runs the study.
///
/// # Errors
/// An argument that is no number.
pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let (cells, first): (u64, u64) = (number(arguments, 0, 40)?, number(arguments, 1, 7000)?);
    // The sensors and the detector are exact. A seam that is stated to be exact too is fitted with noise alone, and the robot's errors count twice: as
    // noise and beside it.
    let robot_accuracy_m = Some(ACCURACY_M);
    let config = Config { robot_accuracy_m, waviness_m: Some(WAVINESS_M), ..Config::noise_only() };
    let (mut together, mut separate) = (Sums::default(), Sums::default());
    for seed in first..first + cells {
        let scenario = random_cell(&Preset::Good.scenario(), seed, 0.05);
        let Some(mut all) = simulate_sensors(&scenario, 2, seed) else { continue };
        let middle = all[0].robot[0].base_from_tool;
        let errors = SlowErrors::drawn(&mut Noise::new(seed, 80), middle, POSITION_M, POSITION_M / ARM_M);
        all.iter_mut().for_each(|recording| errors.add_to(&mut recording.robot));
        let [one, other] = [0, 1].map(|k: usize| all[k].truth.as_ref().unwrap().parameters.tool_from_camera);
        let truth = one.inverse() * other;
        let calibrated = |(k, recording)| {
            let calibration = calibrate(recording, None, &config).ok()?;
            (calibration.status() == Status::Accepted).then(|| (format!("sensor {k}"), calibration))
        };
        let each: Vec<(String, Calibration)> = all.iter().enumerate().filter_map(calibrated).collect();
        let Some(found) = (each.len() == 2).then(|| tied(&each)).flatten() else {
            eprintln!("cell {seed} is not answered");
            continue;
        };
        let between = &found.between[0];
        let variances = Vector6::from(between.sigma).map(|sigma| sigma * sigma);
        together.add(&apart(&between.transform, &truth), &variances);
        let (between, variances) = separately(&each);
        separate.add(&apart(&between, &truth), &variances);
    }
    println!("| calibrated | cells | NEES | rotation: true (stated) | translation: true (stated) |");
    println!("|---|---|---|---|---|");
    together.print("together");
    separate.print("each by itself");
    Ok(())
}
