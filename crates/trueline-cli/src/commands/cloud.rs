//! `trueline cloud`.

use crate::args::CloudArgs;
use crate::cloud_file::CloudOut;
use crate::failure::Failure;
use crate::measured_frames::{self, MeasuredPoint};
use crate::side_view::Thinned;
use crate::{opening, output};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline::open::Measurements;
use trueline_dataset::stamp::exposed_ns;
use trueline_dataset::whole_file::Unfinished;
use trueline_dataset::{Guess, KnownCalibration, calibration_file};
use trueline_method::Config;
use trueline_method::evaluate::cloud::{CloudNoise, CloudPath};
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
    let mut scans = Vec::new();
    let mut is_trusted = true;
    for scan in &args.scans {
        let mut measured = opening::measurements(scan, args.quiet)?;
        is_trusted &= output::fits(&args.calibration, &calibration, &measured.recording)?;
        measured.recording = calibration.corrected(measured.recording);
        scans.push(measured);
    }
    let mut columns = CloudColumns { intensity: false, sigma: args.sigma, frame: args.frame };
    columns.intensity = scans.iter().any(measured_frames::has_intensity);
    if let [first, ..] = form.leaves_out(columns)[..] {
        return Err(Failure::new(
            format!("`--{first}`: {} has no place for it", args.out.display()),
            "write .ply, .pcd, .mcap or .parquet, or leave the option out",
        ));
    }
    let mut cloud = Cloud::new(&calibration, noise, args.thickness || args.report.is_some());
    let unfinished =
        Unfinished::create(&args.out).map_err(|error| Failure::cannot_write(&args.out, &error))?;
    let stage = tracing::info_span!("place", points = tracing::field::Empty).entered();
    form.write(unfinished.file(), columns, &mut |sink| {
        scans.iter().try_for_each(|measured| cloud.place(measured, sink))
    })
    .map_err(|error: Unwritten| error.told(&args.out))?;
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
        }
    }

    /// Hands the points of a scan over, a frame at a time.
    fn place(&mut self, measured: &Measurements, sink: &mut dyn CloudSink) -> Result<(), Unwritten> {
        let path = CloudPath::of(&measured.recording, &self.known, &Config::default())
            .map_err(|error| Unwritten::Recording(error.into()))?;
        let late = path.by(&Guess { time_offset_s: 0.0, ..self.known });
        let mut placed = Vec::new();
        for frame in measured_frames::of(measured) {
            let number = frame.number.unwrap_or(self.frames);
            self.frames += 1;
            placed.clear();
            let at = path.at(frame.stamp_ns);
            let uncorrected = late.at(frame.stamp_ns);
            let pass = match (&mut self.patches, &at) {
                (Some(patches), Ok(at)) => {
                    let passes = patches.each_mut().map(|patches| patches.pass(&at.velocity));
                    passes[0]
                }
                _ => None,
            };
            for MeasuredPoint { measured, intensity } in frame.points {
                let point = at.and_then(|at| Ok((at, path.point_in_camera(measured)?)));
                let (at, in_camera) = match point {
                    Ok(point) => point,
                    Err(reason) => {
                        *self.skipped.entry(reason).or_insert(0) += 1;
                        continue;
                    }
                };
                let in_base = at.point_in_base(&in_camera);
                if let (Some([with, without]), Some(pass), Ok(uncorrected)) =
                    (&mut self.patches, pass, &uncorrected)
                {
                    with.add(pass, &in_base);
                    without.add(pass, &uncorrected.point_in_base(&in_camera));
                }
                placed.push(CloudPoint {
                    in_base_m: in_base.into(),
                    exposed_ns: exposed_ns(frame.stamp_ns, self.known.time_offset_s),
                    intensity,
                    sigma_m: self.noise.map(|noise| path.sigma_m(&at, &in_camera, &noise)),
                    frame: number,
                });
            }
            self.points += placed.len();
            sink.take(&placed)?;
        }
        Ok(())
    }

    /// Data of the report. The scans are read again for the points of one patch.
    fn view(&self, scans: &[Measurements], out: &Path) -> Result<CloudView, Failure> {
        let patches = self.patches.as_ref();
        let sides = patches.and_then(|[with, without]| {
            let side = with.typical()?;
            // Without the offset the same patch lies elsewhere, or nowhere.
            Some([side, without.typical().unwrap_or(side)])
        });
        let mut views = None;
        if let (Some(sides), Some(patches)) = (sides, patches) {
            let mut points: [[Thinned; 2]; 2] = Default::default();
            for measured in scans {
                self.look(measured, &sides, &mut patches[0].clone(), &mut points)?;
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
        measured: &Measurements,
        sides: &[PatchSide; 2],
        passes: &mut Patches,
        points: &mut [[Thinned; 2]; 2],
    ) -> Result<(), Failure> {
        let path = CloudPath::of(&measured.recording, &self.known, &Config::default())?;
        let late = path.by(&Guess { time_offset_s: 0.0, ..self.known });
        for frame in measured_frames::of(measured) {
            let (Ok(with), Ok(without)) = (path.at(frame.stamp_ns), late.at(frame.stamp_ns)) else {
                continue;
            };
            let Some(pass) = passes.pass(&with.velocity) else { continue };
            let pass = usize::from(pass == Pass::Back);
            for MeasuredPoint { measured, .. } in frame.points {
                let Ok(in_camera) = path.point_in_camera(measured) else { continue };
                for ((placement, side), points) in [&with, &without].into_iter().zip(sides).zip(&mut *points)
                {
                    points[pass].add(side.of(&placement.point_in_base(&in_camera)));
                }
            }
        }
        Ok(())
    }

    fn tell(&self, calibration: &KnownCalibration) {
        let when = match calibration.at_stops {
            true => "pose of their stop".to_owned(),
            false => time_offset::rule(self.known.time_offset_s),
        };
        output::words(&format!("{} points of {} frames in base, at the {when}", self.points, self.frames));
        for (reason, count) in &self.skipped {
            output::words(&format!("not placed: {count} ({reason})"));
        }
        if let Some(patches) = &self.patches {
            let [with, without] = patches.each_ref().map(Patches::thickness);
            output::words(&thickness(with, without));
        }
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
