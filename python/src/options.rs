//! Settings of a calibration, by the names of the program's options.

use crate::failure::Failure;
use crate::named::{choice, not_negative, positive, sigmas};
use nalgebra::Vector3;
use pyo3::prelude::*;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use trueline::{Config, Hold, ResidualKind, Stamps};
use trueline_dataset::cad_file;
use trueline_lsq::Loss;
use trueline_method::config::known_of_cell::{KnownOfCell, ToolAxis};
use trueline_method::{
    DrawnLine, HeldSigma, Measurements, PartMoves, Requirement, SeamCad, SensorMode, Target,
};

/// Keywords of `calibrate`; `None` keeps the default.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Options {
    #[pyo3(item("use"))]
    measurements: Option<String>,
    residual: Option<String>,
    loss: Option<String>,
    fix: Vec<String>,
    stamps: Option<String>,
    sensor_mode: Option<String>,
    robot_accuracy_mm: Option<f64>,
    feature_bias_px: Option<f64>,
    edge_radius_mm: Option<f64>,
    waviness_mm: Option<f64>,
    require_seam_mm: Option<f64>,
    feature_sigma_px: Option<f64>,
    feature_sigma_mm: Option<f64>,
    robot_sigma_mm: Option<f64>,
    stamp_sigma_ms: Option<f64>,
    offset_within_s: Option<f64>,
    looks: Option<String>,
    speed_mm_s: Option<f64>,
    stand_off_mm: Option<f64>,
    accept_partial: bool,
    strict: bool,
    threads: Option<NonZeroUsize>,
    align_clocks: bool,
    require: [Option<f64>; 3],
    fixed_sigma: [Option<f64>; 3],
    drawn_line: Vec<[[f64; 3]; 2]>,
    drawn_line_sigma_mm: Option<f64>,
    target: Option<String>,
    seam_cad: Option<PathBuf>,
    cad_tolerance_mm: Option<f64>,
    part_moves: Option<[f64; 2]>,
}

impl Options {
    /// Whether robot and images were stamped by clocks that have nothing in common.
    pub(crate) fn align_clocks(&self) -> bool {
        self.align_clocks
    }

    /// The settings.
    ///
    /// # Errors
    /// An unknown name, an impossible number, contradicting options.
    pub(crate) fn config(self) -> Result<Config, Failure> {
        let held = sigmas("fixed_sigma", self.fixed_sigma)?;
        let mut config = Config {
            loss: self.loss.as_deref().map(|name| choice("loss", name, &LOSSES)).transpose()?,
            hold: self.fix.iter().map(|name| choice("fix", name, &HOLDS)).collect::<Result<_, _>>()?,
            accept_partial: self.accept_partial,
            known: KnownOfCell {
                offset_within_s: positive("offset_within_s", self.offset_within_s)?,
                looks: self.looks.as_deref().map(|name| choice("looks", name, &AXES)).transpose()?,
            },
            feature_sigma_px: positive("feature_sigma_px", self.feature_sigma_px)?,
            feature_sigma_m: positive("feature_sigma_mm", self.feature_sigma_mm)?.map(|mm| mm * 1e-3),
            robot_sigma_m: positive("robot_sigma_mm", self.robot_sigma_mm)?.map(|mm| mm * 1e-3),
            stamp_sigma_s: positive("stamp_sigma_ms", self.stamp_sigma_ms)?.map(|ms| ms * 1e-3),
            robot_accuracy_m: not_negative("robot_accuracy_mm", self.robot_accuracy_mm)?.map(|mm| mm * 1e-3),
            edge_radius_m: not_negative("edge_radius_mm", self.edge_radius_mm)?.map(|mm| mm * 1e-3),
            waviness_m: not_negative("waviness_mm", self.waviness_mm)?.map(|mm| mm * 1e-3),
            require: Requirement {
                seam_m: positive("require_seam_mm", self.require_seam_mm)?.map(|mm| mm * 1e-3),
                ..sigmas("require", self.require)?
            },
            held_sigma: HeldSigma {
                time_s: held.time_s,
                rotation_rad: held.rotation_rad,
                translation_m: held.translation_m,
            },
            drawn_lines: drawn_lines(&self.drawn_line, self.drawn_line_sigma_mm)?,
            seam_cad: seam_cad(self.seam_cad.as_deref(), self.cad_tolerance_mm)?,
            part_moves: part_moves(self.part_moves)?,
            threads: self.threads.map_or(1, NonZeroUsize::get),
            ..Config::default()
        };
        if let Some(name) = self.measurements {
            config.measurements = choice("use", &name, &MEASUREMENTS)?;
        }
        if let Some(name) = self.residual {
            config.residual = choice("residual", &name, &RESIDUALS)?;
        }
        if let Some(name) = self.target {
            config.target = choice("target", &name, &TARGETS)?;
        }
        if let Some(name) = self.stamps {
            config.stamps = choice("stamps", &name, &STAMPS)?;
        }
        if let Some(name) = self.sensor_mode {
            config.sensor = choice("sensor_mode", &name, &SENSORS)?;
        }
        if let Some(px) = not_negative("feature_bias_px", self.feature_bias_px)? {
            config.feature_bias_px = px;
        }
        if let Some(mm_s) = not_negative("speed_mm_s", self.speed_mm_s)? {
            config.used_at.speed_m_s = mm_s * 1e-3;
        }
        config.used_at.by_another_robot = self.strict;
        config.used_at.stand_off_m = positive("stand_off_mm", self.stand_off_mm)?.map(|mm| mm * 1e-3);
        check_sensor(&config)?;
        check_seam(&config)?;
        check_held(&config)?;
        Ok(config)
    }
}

/// Lines of a drawing, each through two points in mm, with an uncertainty of `sigma_mm`.
fn drawn_lines(lines: &[[[f64; 3]; 2]], sigma_mm: Option<f64>) -> Result<Vec<DrawnLine>, Failure> {
    let Some(sigma_mm) = positive("drawn_line_sigma_mm", sigma_mm)? else {
        return if lines.is_empty() {
            Ok(Vec::new())
        } else {
            Err(Failure::new(
                "drawn_line: the uncertainty of its points is missing",
                "add drawn_line_sigma_mm=0.05",
            ))
        };
    };
    if lines.is_empty() {
        return Err(Failure::new(
            "drawn_line_sigma_mm: no line is given",
            "add drawn_line=[((1150, 80, 120), (1450, 80, 120))]",
        ));
    }
    let line = |(k, points): (usize, &[[f64; 3]; 2])| {
        let finite = points.iter().flatten().all(|x| x.is_finite());
        let drawn = DrawnLine::through(k, points.map(|point| Vector3::from(point) * 1e-3), sigma_mm * 1e-3);
        drawn.filter(|_| finite).ok_or_else(|| {
            Failure::new(
                format!("drawn_line: {:?} and {:?} name no line", points[0], points[1]),
                "give two points of the seam in the robot's base, in mm, far apart",
            )
        })
    };
    lines.iter().enumerate().map(line).collect()
}

/// The drawing of a curved seam, with a tolerance in mm.
fn seam_cad(file: Option<&Path>, tolerance_mm: Option<f64>) -> Result<Option<SeamCad>, Failure> {
    /// As the program's.
    const TOLERANCE_MM: f64 = 0.2;
    let tolerance_mm = positive("cad_tolerance_mm", tolerance_mm)?;
    match (file, tolerance_mm) {
        (None, None) => Ok(None),
        (None, Some(_)) => {
            Err(Failure::new("cad_tolerance_mm: no drawing is given", "add seam_cad=\"seam.dxf\""))
        }
        (Some(file), tolerance_mm) => {
            let curve = cad_file::read(file)?;
            let tolerance_m = tolerance_mm.unwrap_or(TOLERANCE_MM) * 1e-3;
            Ok(Some(SeamCad { file: file.display().to_string(), curve, tolerance_m }))
        }
    }
}

/// Scatter of the part's place between passes over its seam: of the shift in mm, of the turn in degrees.
fn part_moves(scatter: Option<[f64; 2]>) -> Result<Option<PartMoves>, Failure> {
    let Some([shift_mm, turn_deg]) = scatter else { return Ok(None) };
    let shift_mm = positive("part_moves", Some(shift_mm))?.unwrap_or_default();
    let turn_deg = positive("part_moves", Some(turn_deg))?.unwrap_or_default();
    Ok(Some(PartMoves { shift_m: shift_mm * 1e-3, turn_rad: turn_deg.to_radians() }))
}

/// The paper's residual takes the sensor for exact.
fn check_sensor(config: &Config) -> Result<(), Failure> {
    if config.residual == ResidualKind::PointToLine && config.sensor == SensorMode::Free {
        return Err(Failure::new(
            "sensor_mode: the point-to-line residual takes the sensor for exact",
            "use \"free\" with residual=\"sheet\"",
        ));
    }
    Ok(())
}

/// The paper's residual assumes a straight seam with a sharp edge.
fn check_seam(config: &Config) -> Result<(), Failure> {
    let is_paper = config.residual == ResidualKind::PointToLine;
    let stated = [("edge_radius_mm", config.edge_radius_m), ("waviness_mm", config.waviness_m)];
    let ignored = stated.into_iter().find(|(_, m)| is_paper && m.is_some_and(|m| m > 0.0));
    ignored.map_or(Ok(()), |(option, _)| {
        Err(Failure::new(
            format!("{option}: the point-to-line residual takes the seam for straight, with a sharp edge"),
            "use it with residual=\"sheet\"",
        ))
    })
}

/// A statement about a quantity that is not held fixed would be ignored.
fn check_held(config: &Config) -> Result<(), Failure> {
    let sigma = config.held_sigma;
    let of_hand_eye = sigma.rotation_rad.is_some() || sigma.translation_m.is_some();
    let missing = match () {
        () if sigma.time_s.is_some() && !config.hold.contains(&Hold::TimeOffset) => "time-offset",
        () if of_hand_eye && !config.hold.contains(&Hold::HandEye) => "hand-eye",
        () => return Ok(()),
    };
    Err(Failure::new(
        format!("fixed_sigma: names the {missing}, which is not held fixed"),
        format!("add fix=[\"{missing}\"]"),
    ))
}

const MEASUREMENTS: [(&str, Measurements); 4] = [
    ("auto", Measurements::Auto),
    ("seam", Measurements::Seam),
    ("stripe", Measurements::Stripe),
    ("both", Measurements::Both),
];
const RESIDUALS: [(&str, ResidualKind); 2] =
    [("sheet", ResidualKind::Sheet), ("point-to-line", ResidualKind::PointToLine)];
const HOLDS: [(&str, Hold); 2] = [("time-offset", Hold::TimeOffset), ("hand-eye", Hold::HandEye)];
const SENSORS: [(&str, SensorMode); 3] =
    [("fixed", SensorMode::Fixed), ("prior", SensorMode::Prior), ("free", SensorMode::Free)];
const TARGETS: [(&str, Target); 3] =
    [("seam", Target::Seam), ("line", Target::Line), ("curve", Target::Curve)];
const STAMPS: [(&str, Stamps); 3] =
    [("auto", Stamps::Auto), ("raw", Stamps::Raw), ("regular", Stamps::Regular)];
const LOSSES: [(&str, Loss); 5] = [
    ("squared", Loss::Squared),
    ("huber", Loss::Huber { scale: 3.0 }),
    ("cauchy", Loss::Cauchy { scale: 3.0 }),
    ("geman-mc-clure", Loss::GemanMcClure { scale: 4.0 }),
    ("tukey", Loss::Tukey { scale: 8.0 }),
];
const AXES: [(&str, ToolAxis); 6] = [
    ("+x", ToolAxis::PlusX),
    ("-x", ToolAxis::MinusX),
    ("+y", ToolAxis::PlusY),
    ("-y", ToolAxis::MinusY),
    ("+z", ToolAxis::PlusZ),
    ("-z", ToolAxis::MinusZ),
];
