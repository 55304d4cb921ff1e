//! `trueline cloud`.

use crate::args::CloudArgs;
use crate::cloud_file::CloudOut;
use crate::failure::Failure;
use crate::measured_frames;
use crate::side_view::Thinned;
use crate::{opening, output};
use std::collections::BTreeMap;
use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline::open::Measurements;
use trueline_dataset::stamp::exposed_ns;
use trueline_dataset::whole_file::Unfinished;
use trueline_dataset::{Guess, KnownCalibration, calibration_file};
use trueline_method::Config;
use trueline_method::evaluate::cloud::{CloudFrame, CloudNoise, CloudPath, CloudReading};
use trueline_method::evaluate::thickness::{Pass, PatchSide, Patches, Thickness};
use trueline_method::input::skip::Skip;
use trueline_report::cloud_page::{self, CloudView, SideView};
use trueline_report::export::cloud::{CloudColumns, CloudPoint, CloudSink};
use trueline_report::export::time_offset;

/// Standard deviation of a profiler's reading that nothing states, m.
const READING_SIGMA_M: f64 = 20e-6;

/// Runs the command.
pub(crate) fn run(args: &CloudArgs) -> Result<ExitCode, Failure> {
    let form = CloudOut::of(&args.out)?;
    let inputs: Vec<&Path> = args.scans.iter().chain([&args.calibration]).map(PathBuf::as_path).collect();
    output::expect_files(&inputs, &[Some(&args.out), args.report.as_deref()])?;
    let calibration = calibration_file::read_without_time_offset(&args.calibration)?;
    let noise = args.sigma.then(|| noise(&args.calibration, &calibration)).transpose()?;
    let (mut scans, is_trusted) = scans(args, &calibration)?;
    let mut columns = CloudColumns { intensity: false, sigma: args.sigma, frame: args.frame };
    for scan in &scans {
        columns.intensity |= measured_frames::has_intensity(&scan.measured)?;
    }
    if let [first, ..] = form.leaves_out(columns)[..] {
        return Err(Failure::new(
            format!("`--{first}`: {} has no place for it", args.out.display()),
            "write .ply, .pcd, .mcap or .parquet, or leave the option out",
        ));
    }
    let with_patches = args.thickness || args.report.is_some();
    let stage = tracing::info_span!("place", points = tracing::field::Empty).entered();
    let (cloud, unfinished) = loop {
        let unfinished =
            Unfinished::create(&args.out).map_err(|error| Failure::cannot_write(&args.out, &error))?;
        let mut cloud = Cloud::new(&calibration, noise, with_patches);
        let mut is_whole = true;
        form.write(unfinished.file(), columns, &mut |sink| {
            scans.iter_mut().try_for_each(|scan| {
                let origins_are_measured = cloud.place(scan, sink)?;
                is_whole &= !origins_are_measured;
                scan.takes_out_origins &= !origins_are_measured;
                Ok(())
            })
        })
        .map_err(|error: Unwritten| error.told(&args.out))?;
        // Only the last profile shows that points at (0, 0) are measurements.
        if is_whole {
            break (cloud, unfinished);
        }
    };
    stage.record("points", cloud.points);
    drop(stage);
    if cloud.points == 0 {
        return Err(Failure::new(
            format!("none of {} frames can be placed", cloud.frames),
            "`trueline doctor DATASET` looks for the reason",
        ));
    }
    unfinished.finish().map_err(|error| Failure::cannot_write(&args.out, &error))?;
    if let Some(file) = &args.report {
        let title = format!("Cloud of {}", args.scans[0].display());
        let view = cloud.view(&scans, &args.out)?;
        output::file(file, &cloud_page::html(&view, &title, &output::command_line()))?;
    }
    if !args.quiet {
        cloud.tell(&calibration);
    }
    Ok(ExitCode::from(u8::from(!is_trusted)))
}

/// The scans, and whether the calibration may be trusted for all of them.
fn scans(args: &CloudArgs, calibration: &KnownCalibration) -> Result<(Vec<Scan>, bool), Failure> {
    let (mut scans, mut is_trusted) = (Vec::new(), true);
    for scan in &args.scans {
        let mut measured = opening::measurements(scan, args.quiet)?;
        is_trusted &= output::fits(&args.calibration, calibration, &measured.recording)?;
        measured.recording = calibration.corrected(measured.recording);
        scans.push(Scan { measured, takes_out_origins: true });
    }
    Ok((scans, is_trusted))
}

/// A scan, and whether its points at (0, 0) are no return.
struct Scan {
    measured: Measurements,
    takes_out_origins: bool,
}

fn noise(file: &Path, calibration: &KnownCalibration) -> Result<CloudNoise, Failure> {
    let links = calibration.links_covariance.ok_or_else(|| {
        Failure::new(
            format!("`--sigma`: {} states no covariance of time offset and hand-eye", file.display()),
            "take the JSON of `trueline calibrate --json`, or leave --sigma out",
        )
    })?;
    Ok(CloudNoise { links, reading_m: READING_SIGMA_M })
}

/// Why a cloud is not finished.
enum Unwritten {
    /// The file.
    File(io::Error),
    /// A recording.
    Recording(Failure),
}

impl From<io::Error> for Unwritten {
    fn from(error: io::Error) -> Self {
        Self::File(error)
    }
}

impl Unwritten {
    fn told(self, out: &Path) -> Failure {
        match self {
            Self::File(error) => Failure::cannot_write(out, &error),
            Self::Recording(failure) => failure,
        }
    }
}

/// The points so far.
struct Cloud {
    known: Guess,
    noise: Option<CloudNoise>,
    /// Patches with the time offset and without it.
    patches: Option<[Patches; 2]>,
    points: usize,
    frames: u64,
    skipped: BTreeMap<Skip, usize>,
    notes: Vec<String>,
}

impl Cloud {
    fn new(calibration: &KnownCalibration, noise: Option<CloudNoise>, thickness: bool) -> Self {
        Self {
            known: calibration.with_correction(),
            noise,
            patches: thickness.then(Default::default),
            points: 0,
            frames: 0,
            skipped: BTreeMap::new(),
            notes: Vec::new(),
        }
    }

    /// Hands the points of a scan over, a frame at a time. Returns whether points at (0, 0) were wrongly left out.
    fn place(&mut self, scan: &Scan, sink: &mut dyn CloudSink) -> Result<bool, Unwritten> {
        let path = CloudPath::of(&scan.measured.recording, &self.known, &Config::default())
            .map_err(|error| Unwritten::Recording(error.into()))?;
        let (mut placed, mut points, mut written) = (Vec::new(), Vec::new(), Ok(()));
        let read = measured_frames::each(&scan.measured, scan.takes_out_origins, &mut |frame| {
            let number = frame.number.unwrap_or(self.frames);
            self.frames += 1;
            let at = match path.at(frame.stamp_ns, self.noise.as_ref()) {
                Ok(at) => at,
                Err(reason) => {
                    *self.skipped.entry(reason).or_insert(0) += frame.readings.len();
                    return ControlFlow::Continue(());
                }
            };
            path.place(&at, &frame.readings, &mut placed, &mut self.skipped);
            if let Some(patches) = &mut self.patches {
                add_to_patches(patches, &path, frame.stamp_ns, &at, &placed);
            }
            let exposed_ns = exposed_ns(frame.stamp_ns, self.known.time_offset_s);
            points.clear();
            points.extend(placed.iter().map(|reading| CloudPoint {
                in_base_m: reading.in_base.into(),
                exposed_ns,
                intensity: frame.intensities.get(reading.index).copied().flatten(),
                sigma_m: reading.sigma_m,
                frame: number,
            }));
            self.points += points.len();
            written = sink.take(&points);
            if written.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        written?;
        let read = read.map_err(Unwritten::Recording)?;
        self.notes.extend(read.notes);
        Ok(read.origins_are_measured)
    }

    /// Data of the report. The scans are read again for the points of one patch.
    fn view(&self, scans: &[Scan], out: &Path) -> Result<CloudView, Failure> {
        let patches = self.patches.as_ref();
        let sides = patches.and_then(|[with, without]| {
            let side = with.typical()?;
            // Without the offset the same patch lies elsewhere, or nowhere.
            Some([side, without.typical().unwrap_or(side)])
        });
        let mut views = None;
        if let (Some(sides), Some(patches)) = (sides, patches) {
            let mut points: [[Thinned; 2]; 2] = Default::default();
            for scan in scans {
                self.look(scan, &sides, &mut patches[0].clone(), &mut points)?;
            }
            views = Some(points.map(|passes| -> SideView { passes.map(Thinned::into_points) }));
        }
        Ok(CloudView {
            points: self.points,
            frames: self.frames,
            file: out.display().to_string(),
            time_offset_s: self.known.time_offset_s,
            thickness: patches.map_or([None; 2], |patches| patches.each_ref().map(Patches::thickness)),
            views,
        })
    }

    fn look(
        &self,
        scan: &Scan,
        sides: &[PatchSide; 2],
        passes: &mut Patches,
        points: &mut [[Thinned; 2]; 2],
    ) -> Result<(), Failure> {
        let path = CloudPath::of(&scan.measured.recording, &self.known, &Config::default())?;
        let mut placed = Vec::new();
        measured_frames::each(&scan.measured, scan.takes_out_origins, &mut |frame| {
            let (Ok(with), Ok(without)) = (path.at(frame.stamp_ns, None), path.at_stamp(frame.stamp_ns))
            else {
                return ControlFlow::Continue(());
            };
            let Some(pass) = passes.pass(&with.velocity) else { return ControlFlow::Continue(()) };
            let pass = usize::from(pass == Pass::Back);
            path.place(&with, &frame.readings, &mut placed, &mut BTreeMap::new());
            for reading in &placed {
                let in_base = [reading.in_base, without.point_in_base(&reading.in_camera)];
                for ((in_base, side), points) in in_base.iter().zip(sides).zip(&mut *points) {
                    points[pass].add(side.of(in_base));
                }
            }
            ControlFlow::Continue(())
        })?;
        Ok(())
    }

    fn tell(&self, calibration: &KnownCalibration) {
        let when = match calibration.at_stops {
            true => "pose of their stop".to_owned(),
            false => time_offset::rule(self.known.time_offset_s),
        };
        output::words(&format!("{} points of {} frames in base, at the {when}", self.points, self.frames));
        self.notes.iter().for_each(|note| output::words(&format!("note: {note}")));
        for (reason, count) in &self.skipped {
            output::words(&format!("not placed: {count} ({reason})"));
        }
        if let Some(patches) = &self.patches {
            let [with, without] = patches.each_ref().map(Patches::thickness);
            output::words(&thickness(with, without));
        }
    }
}

/// Sorts the points of a frame into patches, placed with the time offset and without it.
fn add_to_patches(
    [with, without]: &mut [Patches; 2],
    path: &CloudPath,
    stamp_ns: i64,
    at: &CloudFrame,
    placed: &[CloudReading],
) {
    let (pass, _) = (with.pass(&at.velocity), without.pass(&at.velocity));
    let (Some(pass), Ok(uncorrected)) = (pass, path.at_stamp(stamp_ns)) else { return };
    for reading in placed {
        with.add(pass, &reading.in_base);
        without.add(pass, &uncorrected.point_in_base(&reading.in_camera));
    }
}

/// Both thicknesses, side by side.
fn thickness(with: Option<Thickness>, without: Option<Thickness>) -> String {
    let Some(with) = with else {
        return "thickness: no flat patch was scanned in both directions".to_owned();
    };
    let told = |thickness: Thickness| {
        let [thick, apart] = [thickness.thickness_m, thickness.apart_m].map(|m| m * 1e3);
        format!("{thick:.3} mm thick, passes {apart:.3} mm apart")
    };
    let without = without.map_or_else(|| "no flat patch remains".to_owned(), told);
    format!(
        "thickness of {} flat patches scanned in both directions:\n  with the time offset: {}\n  without it: {without}",
        with.patches,
        told(with)
    )
}
