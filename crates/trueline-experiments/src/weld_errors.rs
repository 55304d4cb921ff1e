//! Errors of calibrations on a weld: the straight one \[Yang2025, Fig. 9\] and the C-type of radius 600 mm
//! \[Yang2025, Fig. 10, Table I\].

use crate::calibrated::{self, Calibrated};
use crate::settings::Settings;
use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::{Circle, Line};
use trueline_method::evaluate::evaluation::Figures;
use trueline_method::evaluate::reference_curve::ReferenceCurve;
use trueline_method::{Config, Error, evaluate::seam_points};
use trueline_sim::scenario::Sine;
use trueline_sim::{KnownScan, Scenario, Weld, WeldScan, scan_weld};

/// The kind of weld.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeldKind {
    /// Straight, 400 mm, at 40 mm/s, weaving ±20 mm at 0.75 Hz: the path of the authors' simulation.
    Straight,
    /// A quarter of a circle of radius 600 mm.
    Round,
}

impl WeldKind {
    /// The name for a person.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Straight => "straight weld",
            Self::Round => "C-type weld",
        }
    }
}

/// Errors of one calibration over all repeats.
#[derive(Clone, Debug)]
pub struct Row {
    /// The calibration.
    pub name: &'static str,
    /// Remark on it; empty for most.
    pub remark: String,
    /// Duration of its recording, s.
    pub takes_s: Option<f64>,
    /// Distance of measured points from their true places, as for a robot that stops at each of them.
    pub position: Figures,
    /// Smallest and largest RMSE of that among the repeats, m.
    pub position_range_m: [f64; 2],
    /// Distance from the weld's curve: the miss of a robot that follows the points.
    pub from_curve: Figures,
}

/// One point of the first repeat.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Truth, m in base.
    pub truth_m: Vector3<f64>,
    /// Length along the weld, m.
    pub along_m: f64,
    /// Measured with the temporal calibration minus truth, m.
    pub with_offset_m: Vector3<f64>,
    /// Measured without it minus truth, m.
    pub without_offset_m: Vector3<f64>,
}

/// Results of one weld.
#[derive(Clone, Debug)]
pub struct WeldErrors {
    /// Which.
    pub kind: WeldKind,
    /// Speed along it, m/s.
    pub speed_m_s: f64,
    /// One row for each calibration.
    pub rows: Vec<Row>,
    /// Points of the first repeat.
    pub points: Vec<Point>,
}

/// Scans the weld once for each repeat, with that repeat's calibrations.
///
/// # Errors
/// Error of a calibration.
pub fn run(settings: &Settings, kind: WeldKind) -> Result<WeldErrors, Error> {
    let scenario = settings.scenario();
    let scan = weld_scan(settings, &scenario, kind);
    let reference = reference(&scan.weld);
    let mut errors: Vec<Gathered> = Vec::new();
    let mut points = Vec::new();
    for seed in settings.seed..settings.seed + settings.repeats {
        let calibrations = calibrated::all(settings, &scenario, seed)?;
        // Another seed than the calibration's own: the noise of one has nothing to do with that of the other.
        let known = scan_weld(&scenario, &scan, seed + 1000);
        if points.is_empty() {
            points = compare(&known, &scan, &calibrations)?;
        }
        errors.resize(calibrations.len(), Gathered::default());
        for (gathered, calibrated) in errors.iter_mut().zip(&calibrations) {
            gathered.add(&known, &reference, calibrated)?;
        }
    }
    let rows = errors.into_iter().map(Gathered::row).collect();
    Ok(WeldErrors { kind, speed_m_s: scan.speed_m_s, rows, points })
}

fn weld_scan(settings: &Settings, scenario: &Scenario, kind: WeldKind) -> WeldScan {
    let line = scenario.cell.lines.first().copied();
    let line = line.unwrap_or_else(|| Line::new(Vector3::zeros(), &Vector3::x_axis()));
    match kind {
        WeldKind::Straight => WeldScan {
            weld: Weld::Straight(line),
            length_m: 0.4,
            speed_m_s: 0.040,
            weave: Sine { amplitude: 0.020, frequency_hz: 0.75, phase_rad: 0.0 },
        },
        WeldKind::Round => {
            let radius_m = 0.6;
            let axis = UnitVector3::new_normalize(Vector3::new(0.01, -0.02, 1.0));
            let towards_start = (Vector3::y() - axis.into_inner() * axis.y).normalize();
            let centre = line.anchor() - towards_start * radius_m;
            let circle =
                Circle::new(centre, axis, radius_m).unwrap_or_else(|| unreachable!("600 mm is above zero"));
            WeldScan {
                weld: Weld::Round { circle, towards_start },
                length_m: radius_m * std::f64::consts::FRAC_PI_2,
                speed_m_s: settings.round_speed_m_s,
                weave: Sine::default(),
            }
        }
    }
}

fn reference(weld: &Weld) -> ReferenceCurve {
    match weld {
        Weld::Straight(line) => ReferenceCurve::Line(*line),
        Weld::Round { circle, .. } => ReferenceCurve::Circle(*circle),
    }
}

/// Every measured point minus its truth, m; points without a pose are left out on both sides.
fn position_errors(known: &KnownScan, by: &Calibrated) -> Result<Vec<(usize, Vector3<f64>)>, Error> {
    let placed = seam_points::place(&known.recording, &by.result, &Config::default())?;
    let errors = placed.list.iter().map(|point| {
        let row = point.row as usize;
        (row, point.point_in_base - known.truth[row])
    });
    Ok(errors.collect())
}

/// The first repeat's points, with and without the temporal calibration of the first method.
fn compare(known: &KnownScan, scan: &WeldScan, all: &[Calibrated]) -> Result<Vec<Point>, Error> {
    let Some(first) = all.first() else { return Ok(Vec::new()) };
    let mut without = first.clone();
    without.result.time_offset_s = 0.0;
    let (with_offset, without_offset) = (position_errors(known, first)?, position_errors(known, &without)?);
    let other: std::collections::BTreeMap<usize, Vector3<f64>> = without_offset.into_iter().collect();
    let start = scan.weld.at(0.0).0;
    let mut along_m = 0.0;
    let mut before = start;
    let points = with_offset.into_iter().filter_map(|(row, with_offset_m)| {
        let truth_m = known.truth[row];
        along_m += (truth_m - before).dot(&scan.weld.at(along_m).1);
        before = truth_m;
        Some(Point { truth_m, along_m, with_offset_m, without_offset_m: *other.get(&row)? })
    });
    Ok(points.collect())
}

/// Errors of one calibration as they come.
#[derive(Clone, Debug, Default)]
struct Gathered {
    name: &'static str,
    remark: String,
    takes_s: Option<f64>,
    position: Vec<Vector3<f64>>,
    repeats_rmse_m: Vec<f64>,
    from_curve: Vec<Vector3<f64>>,
}

impl Gathered {
    fn add(&mut self, known: &KnownScan, reference: &ReferenceCurve, by: &Calibrated) -> Result<(), Error> {
        (self.name, self.takes_s) = (by.name, by.takes_s);
        self.remark.clone_from(&by.remark);
        let errors = position_errors(known, by)?;
        self.repeats_rmse_m.push(Figures::of(errors.iter().map(|(_, e)| *e)).rmse_m);
        let measured = errors.iter().map(|(row, error)| known.truth[*row] + error);
        self.from_curve.extend(measured.filter_map(|point| reference.deviation(&point)));
        self.position.extend(errors.iter().map(|(_, error)| *error));
        Ok(())
    }

    fn row(self) -> Row {
        let low = self.repeats_rmse_m.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self.repeats_rmse_m.iter().copied().fold(0.0, f64::max);
        Row {
            name: self.name,
            remark: self.remark,
            takes_s: self.takes_s,
            position: Figures::of(self.position.into_iter()),
            position_range_m: [low, high],
            from_curve: Figures::of(self.from_curve.into_iter()),
        }
    }
}
