//! `trueline demo`: the first command of README.

use crate::args::DemoArgs;
use crate::failure::Failure;
use crate::output;
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::folder as dataset_folder;
use trueline_method::Config;
use trueline_report::calibration_page::{self, Source};
use trueline_report::{against_truth, result, summary};
use trueline_sim::{Preset, simulate};

const FOLDER: &str = "trueline-demo";

/// Next steps to try.
const NEXT: &str = "
Written to trueline-demo: report.html (open it in a browser), result.json, scan.

Try next:
  trueline calibrate trueline-demo/scan                    the same scan by hand
  trueline export trueline-demo/result.json --as kuka      the transform for a robot
  trueline apply trueline-demo/scan -c trueline-demo/result.json -o seam.csv
  trueline import csv --help                               your own data
";

/// Runs the command.
pub(crate) fn run(args: &DemoArgs) -> Result<ExitCode, Failure> {
    let scenario = Preset::Quick.scenario();
    let recording = simulate(&scenario, args.seed)
        .ok_or_else(|| Failure::new("the demo has no line", "this is a bug of trueline"))?;
    let calibration = trueline_method::calibrate(&recording, None, &Config::default())?;
    let folder = Path::new(FOLDER);
    std::fs::create_dir_all(folder).map_err(|error| Failure::cannot_write(folder, &error))?;
    let scan = folder.join("scan");
    output::former_folder(&scan, dataset_folder::write_whole(&scan, &recording, true)?);
    output::result(&folder.join("result.json"), &result::of(&calibration))?;
    let report = folder.join("report.html");
    let source = Source {
        calibration: &calibration,
        recording: &recording,
        title: "Demo: a simulated 20 s scan",
        command: &output::command_line(),
        probable_cause: None,
        frames: &[],
    };
    output::file(&report, &calibration_page::html(&source))?;
    if !args.quiet {
        let mut text = String::from("A simulated scan of 20 s, calibrated without any guess.\n\n");
        text.push_str(&summary::text(&calibration));
        if let Some(truth) = &recording.truth {
            text.push_str(&against_truth::text(&calibration, truth));
        }
        text.push_str(NEXT);
        output::summary(None, &text)?;
    }
    Ok(super::calibrate::exit_code(&calibration))
}
