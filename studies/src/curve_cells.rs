//! Scans over curved seams, calibrated from nothing: how many are accepted and right, and are the ± honest?
//!
//! `cargo run --release -p trueline-studies -- curve_cells [CELLS A KIND] [KIND] [FIRST SEED] [--cells] [--curve]
//! [--cad=MM]` prints a row for each kind of curve, and why scans were refused. With `--cells` it prints a line for each
//! cell as well. With `--curve` a curve is fitted even if a line explains the scan. With `--cad` it is fitted with a drawing
//! of the seam, at any pose, from which the seam deviates at each knot.
//! `--sensor=PER_MILLE` draws scales, shear and keystone of each sensor, `--stated` writes that into its file, `--held` holds the sensor,
//! `--bow=MM` bends its laser sheet. `--unseen=PART` leaves out the readings of that part of the curve. `--part=MM` moves the part
//! between passes, by that and by a third of a degree for each millimetre. With `--untold` the calibration is not told.
//! `--plates` adds the stripes on both surfaces beside the seam, `--form=MM` makes these wavy. `--use=seam` and `--use=both` choose
//! the measurements.

use crate::arguments::number;
use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::collections::BTreeMap;
use std::time::Instant;
use trueline_dataset::sensor_setup::{KEYSTONE_REACH_M, SensorUncertainty};
use trueline_dataset::{Guess, Measured, Recording, Truth};
use trueline_geometry::{Polyline, se3, so3};
use trueline_method::order_statistics::median;
use trueline_method::{
    Calibration, Config, Measurements, PartMoves, SeamCad, SensorMode, Status, Target, calibrate,
};
use trueline_model::{LaserSheet, SheetField};
use trueline_sim::curves::{BesideCurve, CurveKind, CurveScan, SensorError, scan_curve};

/// Cells of each kind, unless stated.
const CELLS: u64 = 60;
/// Time offset, rotation, translation.
const UNKNOWNS: usize = 7;
/// A time offset is right within this many of its ± …
const RIGHT_Z: f64 = 4.0;
/// … and within this, s.
const RIGHT_S: f64 = 1e-3;
/// An accepted answer is silently wrong beyond this many of its ±.
const WRONG_Z: f64 = 6.0;
/// Half a 95 % interval in standard deviations.
const HALF_95: f64 = 1.959_964;

/// Result of one scan.
#[derive(Default)]
struct Outcome {
    accepted: bool,
    /// Codes of the reasons, or the message of an error.
    reasons: Vec<String>,
    answer: Option<Answer>,
    seconds: f64,
}

/// An answer, against the truth.
struct Answer {
    is_curve: bool,
    /// Whether whole stripes were used, and why; empty without stripes.
    stripes: String,
    /// Error of the time offset, s.
    offset_s: f64,
    /// Each error over its standard deviation; NaN where the scan does not show the unknown.
    z: SVector<f64, UNKNOWNS>,
    /// eᵀ C⁻¹ e over the number of unknowns; NaN where not all are shown.
    normalised: f64,
    /// Its standard deviation of the time offset, s.
    said_s: f64,
    /// Error over the sheet ±30 mm, RMS, m, and its stated ±.
    seam_m: f64,
    said_seam_m: f64,
    /// The same over the field that the scan visited, with the sensor as it is and as it is corrected; NaN where nothing is said.
    field_m: f64,
    said_field_m: f64,
}

/// Options of each scan.
#[derive(Clone, Copy)]
struct Asked {
    /// How far the seam is off its drawing, m; `None` without one.
    tolerance_m: Option<f64>,
    /// Whether a curve is required.
    is_forced: bool,
    /// How far the sensors are off.
    sensors: Sensors,
    /// Part of each curve of which there are no readings.
    unseen: f64,
    /// How far each part moves between passes.
    part_moves: Option<PartMoves>,
    /// Whether nobody states that.
    is_untold: bool,
    /// The surfaces beside the curves, if their stripes are recorded.
    plates: Option<BesideCurve>,
    /// The measurements of the calibration.
    measurements: Measurements,
}

/// How far the sensors of the cells are off.
#[derive(Clone, Copy)]
struct Sensors {
    /// Standard deviation of scales and shear, and of keystone over 30 mm, as a part.
    sigma: f64,
    /// Whether the sensor's file states that.
    is_stated: bool,
    /// Standard deviation of how far the laser sheet bends at ±30 mm, m.
    bow_m: f64,
    /// Whether the scan may improve it.
    mode: SensorMode,
}

impl Sensors {
    fn error(self, seed: u64) -> SensorError {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5E45);
        let mut part = |sigma: f64| sigma * random.sample::<f64, _>(StandardNormal);
        SensorError {
            width: part(self.sigma),
            depth: part(self.sigma),
            shear: part(self.sigma),
            keystone_per_m: [part(self.sigma / KEYSTONE_REACH_M), part(self.sigma / KEYSTONE_REACH_M)],
            bow_m: part(self.bow_m),
        }
    }

    fn stated(self) -> Option<SensorUncertainty> {
        self.is_stated.then(|| SensorUncertainty {
            scale: Some(self.sigma),
            shear_rad: Some(self.sigma),
            keystone: Some(self.sigma),
            ..SensorUncertainty::default()
        })
    }
}

/// A drawing of a curve in a frame of its own, off by a tolerance every 5 mm.
fn drawn(kind: CurveKind, tolerance_m: f64, seed: u64) -> Option<SeamCad> {
    const KNOT_M: f64 = 5e-3;
    /// Chords of an eighth of a millimetre have no effect beside a noise of 0.04 mm.
    const POINTS: u32 = 3000;
    let points: Vec<Vector3<f64>> =
        (0..=POINTS).map(|k| kind.point(f64::from(k) / f64::from(POINTS))).collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0xCAD);
    let mut three = |size: f64| Vector3::from_fn(|_, _| size * random.sample::<f64, _>(StandardNormal));
    let pose = se3::from_parts(UnitQuaternion::from_scaled_axis(three(1.0)), three(0.5));
    let length_m: f64 = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let off: Vec<Vector3<f64>> = (0..=(length_m / KNOT_M) as usize + 1).map(|_| three(tolerance_m)).collect();
    let is_ring = (points[0] - points[points.len() - 1]).norm() < 1e-6;
    let mut along_m = 0.0;
    let mut own = Vec::with_capacity(points.len());
    for (k, point) in points.iter().enumerate() {
        along_m += if k > 0 { (point - points[k - 1]).norm() } else { 0.0 };
        let (knot, part) = ((along_m / KNOT_M) as usize, (along_m / KNOT_M).fract());
        own.push(pose * nalgebra::Point3::from(point + off[knot] * (1.0 - part) + off[knot + 1] * part));
    }
    let mut own: Vec<Vector3<f64>> = own.into_iter().map(|point| point.coords).collect();
    if is_ring {
        let last = own.len() - 1;
        own[last] = own[0];
    }
    let curve = Polyline::new(own)?;
    Some(SeamCad { file: "drawn".to_owned(), curve, tolerance_m: tolerance_m.max(1e-6) })
}

/// Error of a point of the sheet, RMS over ±30 mm about the middle of the scan, in the tool; true and stated, m.
fn seam(
    error: &SVector<f64, UNKNOWNS>,
    covariance: &SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    truth: &Guess,
    recording: &Recording,
) -> (f64, f64) {
    const HALF_M: f64 = 30e-3;
    let places = recording.features.iter().filter_map(|feature| match feature.measured {
        Measured::Profile(place) => Some(place),
        _ => None,
    });
    let count = recording.features.len().max(1) as f64;
    let middle = places.fold([0.0; 2], |sum, [x, z]| [sum[0] + x / count, sum[1] + z / count]);
    let (mut own, mut said) = (0.0, 0.0);
    for [x, z] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
        let point = Vector3::new(middle[0] + x * HALF_M, 0.0, middle[1] + z * HALF_M);
        let in_tool = truth.tool_from_camera.rotation * point;
        let mut by_pose = SMatrix::<f64, 3, UNKNOWNS>::zeros();
        by_pose.fixed_columns_mut::<3>(1).copy_from(&-so3::hat(&in_tool));
        by_pose.fixed_columns_mut::<3>(4).fill_with_identity();
        own += (by_pose * error).norm_squared() / 4.0;
        said += (by_pose * covariance * by_pose.transpose()).trace() / 4.0;
    }
    (own.sqrt(), said.sqrt())
}

/// Error of what the sensor reports of the field that the scan visited, in the tool, RMS over the field as in the stated seam error, m.
fn field(found: &Calibration, truth: &Guess, recording: &Recording, sensor: &SensorError) -> f64 {
    let places = |axis: usize| {
        let of = |feature: &trueline_dataset::Feature| match feature.measured {
            Measured::Profile(place) => Some(place[axis]),
            _ => None,
        };
        let mut places: Vec<f64> = recording.features.iter().filter_map(of).collect();
        places.sort_by(f64::total_cmp);
        let last = places.len() - 1;
        [places[last / 50], places[last - last / 50]]
    };
    let (seen, at) = (SheetField { width_m: places(0), depth_m: places(1) }, found.best_fit());
    let mut sum = 0.0;
    for place in seen.grid() {
        let [x, z] = [place.x, place.y];
        let [own_x, own_z] = sensor.reported([x, z]);
        let reported = Vector3::new(own_x, 0.0, own_z);
        let there = nalgebra::Point3::from(at.corrected(&LaserSheet::of_profiler(), &reported));
        let truly = truth.tool_from_camera * nalgebra::Point3::new(x, sensor.out_of_plane_m(x), z);
        sum += (at.tool_from_camera * there - truly).norm_squared();
    }
    (sum / seen.grid().count() as f64).sqrt()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0, 0.0), |(count, sum), value| (count + 1, sum + value * value));
    (sum / f64::from(count.max(1))).sqrt()
}

/// A number behind an option; 0 without it.
fn part(options: &[String], name: &str) -> Result<f64, String> {
    let stated = options.iter().find_map(|option| option.strip_prefix(name));
    stated.map_or(Ok(0.0), |number| number.parse().map_err(|error| format!("{name} {error}")))
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let (options, places): (Vec<String>, Vec<String>) =
        arguments.iter().cloned().partition(|word| word.starts_with('-'));
    let (kinds, numbers): (Vec<String>, Vec<String>) =
        places.into_iter().partition(|word| CurveKind::ALL.iter().any(|kind| kind.name() == word));
    let count: u64 = number(&numbers, 0, CELLS)?;
    let first: u64 = number(&numbers, 1, 1)?;
    let prints_cells = options.iter().any(|option| option == "--cells");
    let cad = options.iter().find_map(|option| option.strip_prefix("--cad="));
    let asked = Asked {
        tolerance_m: cad
            .map(|mm| mm.parse::<f64>().map(|mm| mm * 1e-3))
            .transpose()
            .map_err(|error| format!("--cad: {error}"))?,
        is_forced: options.iter().any(|option| option == "--curve"),
        sensors: Sensors {
            sigma: part(&options, "--sensor=")? * 1e-3,
            is_stated: options.iter().any(|option| option == "--stated"),
            bow_m: part(&options, "--bow=")? * 1e-3,
            mode: if options.iter().any(|option| option == "--held") {
                SensorMode::Fixed
            } else {
                SensorMode::Prior
            },
        },
        unseen: part(&options, "--unseen=")?,
        part_moves: Some(part(&options, "--part=")?)
            .filter(|mm| *mm > 0.0)
            .map(|mm| PartMoves { shift_m: mm * 1e-3, turn_rad: (mm / 3.0).to_radians() }),
        is_untold: options.iter().any(|option| option == "--untold"),
        plates: options
            .iter()
            .any(|option| option == "--plates")
            .then_some(BesideCurve { form_m: part(&options, "--form=")? * 1e-3, ..BesideCurve::default() }),
        measurements: match options.iter().find_map(|option| option.strip_prefix("--use=")) {
            None => Measurements::Auto,
            Some("seam") => Measurements::Seam,
            Some("both") => Measurements::Both,
            Some(other) => return Err(format!("--use={other} is neither seam nor both")),
        },
    };
    let is_wanted = |kind: &CurveKind| kinds.is_empty() || kinds.iter().any(|name| name == kind.name());
    println!("Right: time offset within 4 of its ± and 1 ms; wrong: accepted, and beyond 6 of its ±.\n");
    println!(
        "| curve | accepted | as a curve | by stripes | as a line | right | offset wrong | any of the seven wrong | NEES/7 | t_d in 95 % | t_d true (said) ms | seam true (said) mm | field true (said) mm | median s | refused for |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for kind in CurveKind::ALL.into_iter().filter(is_wanted) {
        let outcome = |seed: u64| {
            let outcome = Outcome::of(kind, seed, asked);
            if prints_cells {
                println!("{}-{seed:03} {}", kind.name(), outcome.in_words());
            }
            outcome
        };
        print_row(kind, &(first..first + count).map(outcome).collect::<Vec<_>>());
    }
    Ok(())
}

impl Outcome {
    fn of(kind: CurveKind, seed: u64, asked: Asked) -> Self {
        let sensor = asked.sensors.error(seed);
        let part_moves = asked.part_moves.map_or([0.0; 2], |moves| [moves.shift_m, moves.turn_rad]);
        let (unseen, plates) = (asked.unseen, asked.plates);
        let scan = CurveScan { sensor, unseen, part_moves, plates, ..CurveScan::good(kind) };
        let (mut recording, _) = scan_curve(&scan, seed);
        recording.setup.uncertainty = asked.sensors.stated();
        // The simulated robot has noise, and no error that lasts.
        let config = Config {
            robot_accuracy_m: Some(0.0),
            sensor: asked.sensors.mode,
            target: if asked.is_forced { Target::Curve } else { Target::Seam },
            part_moves: asked.part_moves.filter(|_| !asked.is_untold),
            measurements: asked.measurements,
            seam_cad: asked.tolerance_m.and_then(|tolerance_m| drawn(kind, tolerance_m, seed)),
            ..Config::default()
        };
        let began = Instant::now();
        let found = calibrate(&recording, None, &config);
        let seconds = began.elapsed().as_secs_f64();
        match found {
            Err(error) => Self { seconds, reasons: vec![format!("error: {error}")], ..Self::default() },
            Ok(found) => Self {
                seconds,
                accepted: found.status() == Status::Accepted,
                reasons: found.reasons().iter().map(|reason| reason.code().to_owned()).collect(),
                answer: recording.truth.as_ref().map(|truth| Answer::of(&found, truth, &recording, &sensor)),
            },
        }
    }

    /// The answer, if it is accepted.
    fn taken(&self) -> Option<&Answer> {
        self.answer.as_ref().filter(|_| self.accepted)
    }

    fn in_words(&self) -> String {
        let status = if self.accepted { "accepted" } else { "refused" };
        let answer = self.answer.as_ref().map_or_else(String::new, |answer| {
            let z: Vec<String> = answer.z.iter().map(|z| format!("{z:.1}")).collect();
            let kind = if answer.is_curve { "curve" } else { "line" };
            format!(
                "{kind} {} t_d {:.4} ms z {} NEES/7 {:.2}",
                answer.stripes,
                answer.offset_s * 1e3,
                z.join(" "),
                answer.normalised
            )
        });
        format!("{status} {answer} {:.2} s {}", self.seconds, self.reasons.join(" "))
    }
}

impl Answer {
    fn of(found: &Calibration, truth: &Truth, recording: &Recording, sensor: &SensorError) -> Self {
        let truth = &truth.parameters;
        let (turn, shift) = se3::difference_decoupled(found.file_tool_from_camera(), &truth.tool_from_camera);
        let offset_s = found.best_fit().time_offset_s - truth.time_offset_s;
        let error = SVector::from([offset_s, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]);
        let covariance =
            SMatrix::<f64, UNKNOWNS, UNKNOWNS>::from_fn(|i, j| found.covariance(i, j).unwrap_or(f64::NAN));
        let normalised = covariance.cholesky().map_or(f64::NAN, |factor| error.dot(&factor.solve(&error)));
        let (seam_m, said_seam_m) = seam(&error, &covariance, truth, recording);
        Self {
            seam_m,
            said_seam_m,
            field_m: field(found, truth, recording, sensor),
            said_field_m: found.findings.checks.seam_error.map_or(f64::NAN, |error| error.rms_m),
            said_s: covariance[(0, 0)].sqrt(),
            is_curve: found.findings.curve.is_some(),
            stripes: found.findings.stripes.as_ref().map_or_else(String::new, |stripes| {
                let apart = stripes.estimate.as_ref().and_then(|estimate| estimate.sigmas_apart);
                let factor = stripes.estimate.as_ref().map_or(f64::NAN, |estimate| estimate.noise_factor);
                let apart = apart.unwrap_or(f64::NAN);
                format!("{} {} {apart:.1} σ × {factor:.2}", stripes.used.name(), stripes.because.code())
            }),
            offset_s,
            z: SVector::from_fn(|k, _| error[k] / covariance[(k, k)].sqrt()),
            normalised: normalised / UNKNOWNS as f64,
        }
    }

    fn is_right(&self) -> bool {
        self.z[0].abs() <= RIGHT_Z && self.offset_s.abs() <= RIGHT_S
    }
}

fn print_row(kind: CurveKind, outcomes: &[Outcome]) {
    let taken: Vec<&Answer> = outcomes.iter().filter_map(Outcome::taken).collect();
    let count = |of: &dyn Fn(&Answer) -> bool| taken.iter().filter(|answer| of(answer)).count();
    let curves = count(&|answer| answer.is_curve);
    let striped = count(&|answer| answer.stripes.starts_with("both"));
    let nees: Vec<f64> = taken.iter().map(|answer| answer.normalised).filter(|n| n.is_finite()).collect();
    // χ²₇/7 of each cell.
    let deviation = (2.0 / (UNKNOWNS * nees.len()) as f64).sqrt();
    let mut refused: BTreeMap<&str, usize> = BTreeMap::new();
    for reason in outcomes.iter().filter(|outcome| !outcome.accepted).flat_map(|outcome| &outcome.reasons) {
        *refused.entry(reason).or_default() += 1;
    }
    let refused: Vec<String> = refused.iter().map(|(code, count)| format!("{code} {count}")).collect();
    println!(
        "| {} | {} of {} | {curves} | {striped} | {} | {} | {} | {} | {:.2} (1 ± {deviation:.2}) | {:.0} % | {:.3} ({:.3}) | {:.3} ({:.3}) | {:.3} ({:.3}) | {:.2} | {} |",
        kind.name(),
        taken.len(),
        outcomes.len(),
        taken.len() - curves,
        count(&Answer::is_right),
        count(&|answer| answer.z[0].abs() > WRONG_Z),
        count(&|answer| answer.z.iter().any(|z| z.abs() > WRONG_Z)),
        nees.iter().sum::<f64>() / nees.len() as f64,
        100.0 * count(&|answer| answer.z[0].abs() <= HALF_95) as f64 / taken.len() as f64,
        rms(taken.iter().map(|answer| answer.offset_s)) * 1e3,
        rms(taken.iter().map(|answer| answer.said_s)) * 1e3,
        rms(taken.iter().map(|answer| answer.seam_m)) * 1e3,
        rms(taken.iter().map(|answer| answer.said_seam_m)) * 1e3,
        rms(taken.iter().map(|answer| answer.field_m)) * 1e3,
        rms(taken.iter().map(|answer| answer.said_field_m)) * 1e3,
        median(outcomes.iter().map(|outcome| outcome.seconds)).unwrap_or(f64::NAN),
        refused.join(", ")
    );
}
