//! `trueline apply`.

use crate::args::ApplyArgs;
use crate::failure::Failure;
use crate::{opening, output};
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::calibration_file;
use trueline_dataset::sensor_setup::Mounted;
use trueline_mcap::ImagePoints;
use trueline_method::Config;
use trueline_method::evaluate::seam_points;
use trueline_report::export::points::{self, PlacedPoint};
use trueline_report::export::time_offset;

/// Runs the command.
pub(crate) fn run(args: &ApplyArgs) -> Result<ExitCode, Failure> {
    let write = writer(&args.out)?;
    output::expect_files(&[&args.recording, &args.calibration], &[Some(&args.out)])?;
    let calibration = calibration_file::read_without_time_offset(&args.calibration)?;
    let recording = opening::open(&args.recording, None, args.quiet)?.recording;
    let is_trusted = output::fits(&args.calibration, &calibration, &recording)?;
    let recording = calibration.corrected(recording);
    let known = &calibration.with_correction();
    let seam = seam_points::place(&recording, known, &Config::default())?;
    if seam.list.is_empty() {
        return Err(Failure::new(
            format!("none of {} seam points can be placed", recording.features.len()),
            "`trueline doctor DATASET` looks for the reason",
        ));
    }
    let in_base = seam.list.iter().map(|point| (point.row as usize, point.line, point.point_in_base.into()));
    let placed = points::placed(&recording.features, in_base, known.time_offset_s);
    if args.out == Path::new("-") {
        output::data(&points::csv(&placed))?;
    } else {
        output::file(&args.out, &write(&placed)?)?;
    }
    if !args.quiet {
        let when = match calibration.at_stops {
            true => "pose of their stop".to_owned(),
            false => time_offset::rule(known.time_offset_s),
        };
        let frame = match calibration.mounted {
            Some(Mounted::Fixed) => "on the tool, which carries the part",
            _ => "in base",
        };
        output::words(&format!("{} seam points {frame}, at the {when}", placed.len()));
        for (reason, count) in &seam.skipped {
            output::words(&format!("not placed: {count} ({reason})"));
        }
    }
    Ok(ExitCode::from(u8::from(!is_trusted)))
}

/// Function that makes a file of points.
type Writer = fn(&[PlacedPoint]) -> Result<Vec<u8>, Failure>;

/// A cloud for each image.
fn mcap(placed: &[PlacedPoint]) -> Result<Vec<u8>, Failure> {
    let images = placed.chunk_by(|a, b| a.exposed_ns == b.exposed_ns).map(|image| ImagePoints {
        exposed_ns: image[0].exposed_ns,
        in_base_m: image.iter().map(|point| point.in_base_m).collect(),
    });
    trueline_mcap::seam_points(&images.collect::<Vec<_>>()).map_err(|error| {
        Failure::new(format!("the points cannot be written as MCAP: {error}"), "--out seam.csv works")
    })
}

/// Writer of a file by its name; known before the work is done.
fn writer(out: &Path) -> Result<Writer, Failure> {
    match out.extension().and_then(|extension| extension.to_str()) {
        Some("csv") => Ok(|placed| Ok(points::csv(placed).into_bytes())),
        Some("ply") => Ok(|placed| Ok(points::ply(placed).into_bytes())),
        Some("mcap") => Ok(mcap),
        _ if out == Path::new("-") => Ok(|placed| Ok(points::csv(placed).into_bytes())),
        _ => Err(Failure::new(
            format!("`--out {}`: expected a file that ends in .csv, .ply or .mcap", out.display()),
            "for example --out seam.csv",
        )),
    }
}
