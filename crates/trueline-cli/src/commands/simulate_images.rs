//! `trueline simulate --images`.

use crate::args::SimulateArgs;
use crate::failure::Failure;
use crate::output;
use crate::progress;
use rayon::prelude::*;
use std::fs;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::{
    Error, Feature, FrameFile, Measured, Problem, features_csv, folder, gray_png, images,
};
use trueline_sim::faults::Event;
use trueline_sim::images::Picture;
use trueline_sim::{Exposed, Fault, Joint, PictureScan, Scenario, simulate_with_faults};

/// Runs the command.
pub fn run(args: &SimulateArgs, scenario: &Scenario) -> Result<ExitCode, Failure> {
    let scan = scan(args, scenario)?;
    let mut recording = simulate_with_faults(scenario, &args.faults, args.seed).ok_or_else(no_pictures)?;
    recording.features.clear();
    // The joint may have other lines than the scenario's one seam; without a joint, that is where the seam would be.
    if let Some(truth) = recording.truth.as_mut().filter(|_| !scan.lines().is_empty()) {
        truth.lines = scan.lines();
    }
    folder::write(&args.out, &recording)?;
    let pictures = args.out.join("images");
    fs::create_dir_all(&pictures).map_err(|e| Error::in_file(&pictures, Problem::Io(e)))?;
    let frames = draw(args, &scan)?;
    let index: Vec<FrameFile> = frames.iter().map(|(frame, _)| frame.clone()).collect();
    images::write_index(&args.out, &index)?;
    let seen = frames.iter().filter(|(_, features)| !features.is_empty()).count();
    let truth: Vec<Feature> = frames.into_iter().flat_map(|(_, features)| features).collect();
    write_truth(&args.out.join("truth_features.csv"), &truth)?;
    if !args.quiet {
        output::words(&format!(
            "{}: {} robot poses, {} pictures, the seam in {} of them, time offset {} ms",
            args.out.display(),
            recording.robot.len(),
            index.len(),
            seen,
            scenario.timing.time_offset_s * 1e3,
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Faults of the robot's stream alone, whatever the camera sees.
const ROBOT_STREAM_FAULTS: [Fault; 3] =
    [Fault::Event(Event::RobotGaps), Fault::Event(Event::DuplicateRows), Fault::Event(Event::RobotClockStep)];

fn no_pictures() -> Failure {
    Failure::new(
        "this preset has no camera, or no line",
        "--images needs a preset with a camera: paper or quick",
    )
}

fn scan<'a>(args: &SimulateArgs, scenario: &'a Scenario) -> Result<PictureScan<'a>, Failure> {
    if scenario.cell.lines.len() != 1 {
        return Err(Failure::new(
            "pictures show one seam, and this preset has several",
            "choose another preset",
        ));
    }
    if !args.faults.iter().all(|fault| ROBOT_STREAM_FAULTS.contains(fault)) {
        return Err(Failure::new(
            "`--fault` changes features, and pictures have none",
            "leave one of them out; robot-gaps, duplicate-rows and robot-clock-step work with both",
        ));
    }
    let mut look = (args.look)();
    look.bits = if args.bits > 8 { 16 } else { 8 };
    look.exposure_s = args.exposure_ms.map_or(look.exposure_s, |ms| ms * 1e-3);
    let joint = match (args.joint)() {
        Joint::Fillet { .. } => Joint::Fillet {
            opening_rad: args.opening_deg.to_radians(),
            roll_rad: args.roll_deg.to_radians(),
            gap_m: args.corner_gap_mm.map_or(0.0, |mm| mm * 1e-3),
        },
        other => other,
    };
    PictureScan::new(scenario, joint, look, args.seed).ok_or_else(no_pictures)
}

/// Draws and writes every picture; returns where each one is and where its seam is.
fn draw(args: &SimulateArgs, scan: &PictureScan<'_>) -> Result<Vec<(FrameFile, Vec<Feature>)>, Failure> {
    let bar = progress::bar(scan.exposures().len() as u64, "pictures", args.quiet);
    let drawn: Result<Vec<_>, Error> = scan
        .exposures()
        .par_iter()
        .map_init(
            || scan.renderer(),
            |renderer, exposed| {
                let Picture { image, seam_px, second_px } = scan.draw(renderer, exposed);
                let path = args.out.join("images").join(format!("{:06}.png", exposed.frame));
                gray_png::write(&path, &image)?;
                bar.inc(1);
                let frame =
                    FrameFile { stamp_ns: exposed.stamp_ns, frame: exposed.frame, device_ns: None, path };
                let lines = [seam_px, second_px].into_iter().flatten().zip(0..);
                Ok((frame, lines.map(|(pixel, line)| feature(exposed, line, pixel.into())).collect()))
            },
        )
        .collect();
    bar.finish_and_clear();
    Ok(drawn?)
}

fn feature(exposed: &Exposed, line: u32, pixel: [f64; 2]) -> Feature {
    Feature {
        stamp_ns: exposed.stamp_ns,
        line,
        frame: Some(exposed.frame),
        device_ns: None,
        measured: Measured::Pixel(pixel),
        sigma: None,
    }
}

fn write_truth(file: &Path, truth: &[Feature]) -> Result<(), Failure> {
    let mut text = Vec::new();
    let written = features_csv::write(&mut text, truth).and_then(|()| fs::write(file, text));
    written.map_err(|error| Failure::cannot_write(file, &error))
}
