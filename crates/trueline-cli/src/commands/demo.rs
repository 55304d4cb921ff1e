//! `trueline demo`: what README shows first.

use crate::args::DemoArgs;
use crate::failure::Failure;
use crate::output;
use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::Truth;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::{Calibration, Config};
use trueline_report::calibration_page::{self, Source};
use trueline_report::summary;
use trueline_sim::{Preset, simulate};

const FOLDER: &str = "trueline-demo";

/// Runs the command.
pub fn run(args: &DemoArgs) -> Result<ExitCode, Failure> {
    let scenario = Preset::Quick.scenario();
    let recording = simulate(&scenario, args.seed)
        .ok_or_else(|| Failure::new("the demo has no line", "this is a bug of trueline"))?;
    let calibration = trueline_method::calibrate(&recording, None, &Config::default())?;
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder).map_err(|error| Failure::cannot_write(folder, &error))?;
    let report = folder.join("report.html");
    let source = Source {
        calibration: &calibration,
        recording: &recording,
        title: "Demo: a simulated 20 s scan",
        command: &output::command_line(),
        images_ahead_s: None,
        frames: &[],
    };
    output::file(&report, &calibration_page::html(&source))?;
    if !args.quiet {
        let mut text = String::from("A simulated scan of 20 s, calibrated without any guess.\n\n");
        text.push_str(&summary::text(&calibration));
        if let Some(truth) = &recording.truth {
            text.push_str(&against_truth(&calibration, truth));
        }
        let _ = writeln!(text, "\nReport: {}", report.display());
        output::data(&output::coloured(&text))?;
    }
    Ok(super::calibrate::exit_code(&calibration))
}

/// How far the estimates are from what was simulated.
fn against_truth(calibration: &Calibration, truth: &Truth) -> String {
    let (estimate, truth) = (calibration.best_fit(), &truth.parameters);
    let offset_ms = (estimate.time_offset_s - truth.time_offset_s) * 1e3;
    let (a, b) = (&estimate.tool_from_camera, &truth.tool_from_camera);
    let shift_mm = (a.translation.vector - b.translation.vector) * MM_PER_M;
    let turn_deg = a.rotation.angle_to(&b.rotation).to_degrees();
    format!(
        "\nSimulated truth is off by {offset_ms:+.4} ms, ({:+.4}, {:+.4}, {:+.4}) mm and {turn_deg:.4}°.\n",
        shift_mm.x, shift_mm.y, shift_mm.z
    )
}
