//! `trueline calibrate`.

use super::{calibrate_board, calibrate_poses, calibrate_round, calibrate_sensors};
use crate::args::hints;
use crate::args::{CalibrateArgs, TargetName};
use crate::clocks;
use crate::failure::Failure;
use crate::{mistake, opening, output, progress};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline::open::Opened;
use trueline_dataset::calibration_file;
use trueline_dataset::result_file::SensorFileEntry;
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Recording, SensorFile, SensorSetup, cad_file, folder, sensor_toml, source_file};
use trueline_method::input::stops::stand_at_readings;
use trueline_method::{Calibration, Config, Hold, ResidualKind, SeamCad, SensorMode, Status};
use trueline_report::calibration_page::{self, FramePicture, Source};
use trueline_report::{certificate::Certificate, result, summary};
use trueline_sensor::round::RoundTarget;

/// Runs the command.
pub(crate) fn run(args: &CalibrateArgs) -> Result<ExitCode, Failure> {
    let inputs: Vec<&Path> =
        args.datasets.iter().chain(&args.initial).chain(&args.seam_cad).map(PathBuf::as_path).collect();
    let files = [&args.json, &args.report, &args.write_sensor, &args.certificate].map(|f| f.as_deref());
    output::expect_files(&inputs, &files)?;
    if let Some(board) = &args.board {
        return calibrate_board::run(args, board);
    }
    if let Some(code) = without_seam(args)? {
        return Ok(code);
    }
    check_sensor(args)?;
    check_seam(args)?;
    check_fixed(args)?;
    if let Some(sensors) = calibrate_sensors::sensors(args)? {
        return calibrate_sensors::run(args, &sensors);
    }
    let cad = seam_cad(args)?;
    let config = Config { seam_cad: cad, ..args.config() };
    let mut opened = opening::open_all(&args.datasets, args.joint, args.quiet)?;
    match (args.align_clocks, args.datasets.len()) {
        (false, _) => {}
        (true, _) if args.at_stops || opened.recording.at_stops || stand_at_readings(&opened.recording) => {
            return Err(Failure::new(
                "`--align-clocks`: the robot stands at each reading, and stops need no common clock",
                "leave --align-clocks out; --at-stops calibrates without a time offset",
            ));
        }
        (true, 1) => clocks::align_recording(&mut opened.recording, &config, args.quiet)?,
        (true, _) => {
            return Err(Failure::new(
                "`--align-clocks` supports one scan: several scans have several clocks",
                "align each separately: `trueline import csv DATASET --align-clocks --out ALIGNED`",
            ));
        }
    }
    take_named(args, &mut opened.recording)?;
    let recording = &opened.recording;
    let initial = recording.initial;
    let calibrate = || trueline_method::calibrate(recording, initial.as_ref(), &config);
    let calibration = progress::during("calibrating", args.quiet, calibrate)?;
    let calibration = match &args.write_sensor {
        Some(file) => with_written_sensor(file, &opened, calibration)?,
        None => calibration,
    };
    let mistake = mistake::found(&opened.recording, &calibration, &config, args.quiet);
    write_results(args, &opened, &calibration, mistake.as_deref())?;
    Ok(exit_code(&calibration))
}

/// A calibration without a seam: on poses of a target, or on a sphere or cylinder. `None` if the target is a seam.
fn without_seam(args: &CalibrateArgs) -> Result<Option<ExitCode>, Failure> {
    if let Some(dataset) = calibrate_poses::dataset(args)? {
        return calibrate_poses::run(args, dataset).map(Some);
    }
    if args.target == TargetName::Poses {
        return Err(Failure::new(
            "--target poses needs a dataset with `kind = \"poses\"` in its sensor.toml",
            "write the target's poses as sightings.csv, or leave --target out",
        ));
    }
    let round = match args.target {
        TargetName::Sphere => Some(RoundTarget::Sphere),
        TargetName::Cylinder => Some(RoundTarget::Cylinder),
        _ => None,
    };
    if let Some(round) = round {
        return calibrate_round::run(args, round).map(Some);
    }
    if args.radius_mm.is_some() {
        return Err(Failure::new(
            "--radius-mm belongs to --target sphere and --target cylinder",
            "add --target sphere, or leave it out",
        ));
    }
    Ok(None)
}

/// Takes the guess of a file that is named, and the names of all files beside the datasets.
fn take_named(args: &CalibrateArgs, recording: &mut Recording) -> Result<(), Failure> {
    if let Some(file) = &args.initial {
        let text = sensor_toml::read_text(file)?;
        recording.inputs.insert(file.display().to_string(), folder::sha256(text.as_bytes()));
        recording.initial = Some(calibration_file::parse_guess(file, &text)?);
    }
    if let Some(file) = &args.seam_cad {
        recording.inputs.insert(file.display().to_string(), folder::sha256(&source_file::bytes(file)?));
    }
    Ok(())
}

fn names(datasets: &[PathBuf]) -> String {
    datasets.iter().map(|dataset| dataset.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// 0 if accepted, else 1.
pub(crate) fn exit_code(calibration: &Calibration) -> ExitCode {
    match calibration.status() {
        Status::Accepted => ExitCode::SUCCESS,
        Status::NotAccepted => ExitCode::from(1),
    }
}

/// Writes the requested outputs. A mistake in the data that explains a refusal comes first.
fn write_results(
    args: &CalibrateArgs,
    opened: &Opened,
    calibration: &Calibration,
    mistake: Option<&str>,
) -> Result<(), Failure> {
    if let Some(file) = &args.json {
        let mut result = result::of(calibration);
        result.stamps.meaning = opened.stamp_meaning.clone();
        result.probable_cause = mistake.map(str::to_owned);
        if opened.recording.setup.mounted == Mounted::Fixed {
            result.mounted = Some("fixed".to_owned());
        }
        output::result(file, &result)?;
    }
    let source = Source {
        calibration,
        recording: &opened.recording,
        title: &format!("Calibration of {}", names(&args.datasets)),
        command: &output::command_line(),
        probable_cause: mistake,
        frames: &match args.report {
            Some(_) => trueline::open::outlier_pictures(opened, calibration)?
                .into_iter()
                .map(|picture| FramePicture { row: picture.row, png: picture.png })
                .collect(),
            None => Vec::new(),
        },
    };
    if let Some(file) = &args.report {
        output::file(file, &calibration_page::html(&source))?;
    }
    if let Some(file) = &args.certificate {
        let by = (args.operator.as_deref(), output::command_line());
        output::file(file, &Certificate::of(calibration, by).text(file))?;
    }
    if let Some(mistake) = mistake {
        let datasets = names(&args.datasets);
        let before = if args.quiet { "not accepted: " } else { "" };
        output::words(&format!(
            "{before}probable cause: {mistake} (`trueline doctor {datasets} --fix MENDED`)"
        ));
    }
    if args.quiet {
        calibration.reasons().iter().for_each(|reason| output::words(&format!("not accepted: {reason}")));
    } else {
        output::summary(args.json.as_deref(), &summary::text(calibration))?;
        if let Some(measured) = opened.measured_offset(calibration) {
            let level = if measured.offset.agrees() { "" } else { "warning: " };
            output::words(&format!("{level}{measured}"));
        }
        let hints = hints::of(calibration).into_iter().map(str::to_owned).chain(hints::pages(calibration));
        hints.for_each(|hint| output::words(&format!("hint: {hint}")));
    }
    Ok(())
}

/// Writes the sensor's file as the scan corrects it, and gives the calibration with the hand-eye transform of that file. The
/// stated file's uncertainty was that of the stated sensor.
fn with_written_sensor(
    file: &Path,
    opened: &Opened,
    calibration: Calibration,
) -> Result<Calibration, Failure> {
    if calibration.status() == Status::NotAccepted {
        output::words(&format!("{}: not written, because the calibration is not accepted", file.display()));
        return Ok(calibration);
    }
    let is_curve = calibration.findings.curve.is_some();
    let missing = || {
        if is_curve {
            return of_curve("--write-sensor");
        }
        Failure::new(
            "`--write-sensor`: this scan gives no corrected sensor",
            "`trueline doctor DATASET` looks for the reason",
        )
    };
    let corrected = calibration.findings.unknowns.corrected.as_ref().ok_or_else(missing)?;
    let (shape, uncertainty) = (corrected.shape, corrected.uncertainty.clone());
    let setup = SensorSetup { uncertainty, shape, ..opened.recording.setup.clone() };
    let text = sensor_toml::format_file(&SensorFile { sensor: corrected.sensor.clone(), setup });
    output::file(file, &text)?;
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
    let written = SensorFileEntry { name, sha256: folder::sha256(text.as_bytes()), corrected: true };
    calibration.for_corrected_sensor(written).ok_or_else(missing)
}

/// A curve does not show the shape of the sensor.
fn of_curve(option: &str) -> Failure {
    Failure::new(
        format!("`{option}`: a curved seam does not determine the sensor's shape; the file's shape is used"),
        "scan a straight seam to correct the sensor",
    )
}

/// The paper's residual takes the sensor for exact, and so does a sensor that is held.
fn check_sensor(args: &CalibrateArgs) -> Result<(), Failure> {
    let papers = args.residual == ResidualKind::PointToLine;
    let asked = args.write_sensor.as_ref().map(|_| "--write-sensor");
    let asked = asked.or(args.certificate.as_ref().map(|_| "--certificate"));
    if let (Some(option), SensorMode::Fixed) = (asked, args.sensor) {
        return Err(Failure::new(
            format!("`{option}`: with `--sensor fixed` nothing is corrected"),
            "use --sensor prior or --sensor free",
        ));
    }
    let is_curve = args.config().asks_for_curve() || args.seam_cad.is_some();
    if let (Some(option), true) = (asked, is_curve) {
        return Err(of_curve(option));
    }
    let option = match (args.sensor, asked) {
        (SensorMode::Free, _) if papers => "--sensor free",
        (_, Some(option)) if papers => option,
        _ => return Ok(()),
    };
    Err(Failure::new(
        format!("`{option}`: the point-to-line residual assumes an exact sensor"),
        "use it with --residual sheet",
    ))
}

/// The paper's residual assumes a straight seam with a sharp edge: statements about another one would be ignored.
fn check_seam(args: &CalibrateArgs) -> Result<(), Failure> {
    let is_paper = args.residual == ResidualKind::PointToLine;
    let stated = [("--edge-radius-mm", args.edge_radius_mm), ("--waviness-mm", args.waviness_mm)];
    let ignored = stated.into_iter().find(|(_, mm)| is_paper && mm.is_some_and(|mm| mm > 0.0));
    ignored.map_or(Ok(()), |(option, _)| {
        Err(Failure::new(
            format!("`{option}`: the point-to-line residual assumes a straight seam with a sharp edge"),
            "use it with --residual sheet",
        ))
    })
}

/// The drawing of the seam.
fn seam_cad(args: &CalibrateArgs) -> Result<Option<SeamCad>, Failure> {
    let needs_curve = [("--seam-cad", args.seam_cad.is_some()), ("--part-moves", args.part_moves.is_some())];
    if let (TargetName::Line, Some((option, _))) = (args.target, needs_curve.iter().find(|(_, given)| *given))
    {
        return Err(Failure::new(
            format!("`{option}` needs a curve, but `--target line` requires a straight seam"),
            "leave one of the two out; `--drawn-line` holds a straight seam where a drawing has it",
        ));
    }
    let Some(file) = &args.seam_cad else { return Ok(None) };
    let (curve, tolerance_m) = (cad_file::read(file)?, args.cad_tolerance_mm / MM_PER_M);
    Ok(Some(SeamCad { file: file.display().to_string(), curve, tolerance_m }))
}

/// A statement about a quantity that is not held fixed would be ignored.
fn check_fixed(args: &CalibrateArgs) -> Result<(), Failure> {
    let Some(sigma) = args.fixed_sigma else { return Ok(()) };
    let hand_eye = sigma.rotation_rad.is_some() || sigma.translation_m.is_some();
    let missing = match () {
        () if sigma.time_s.is_some() && !args.fix.contains(&Hold::TimeOffset) => "time-offset",
        () if hand_eye && !args.fix.contains(&Hold::HandEye) => "hand-eye",
        () => return Ok(()),
    };
    Err(Failure::new(
        format!("`--fixed-sigma` names the {missing}, which is not held by --fix"),
        format!("add --fix {missing}"),
    ))
}
