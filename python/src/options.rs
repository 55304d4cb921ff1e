//! Settings of a calibration, by the names of the program's options.

use crate::failure::Failure;
use pyo3::prelude::*;
use trueline::{Config, Hold, Requirement, ResidualKind, Stamps};
use trueline_lsq::Loss;
use trueline_method::SensorMode;
use trueline_method::hypotheses::choice::{KnownOfCell, ToolAxis};

/// Keywords of `calibrate`; what is `None` keeps its default.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Options {
    residual: Option<String>,
    loss: Option<String>,
    fix: Vec<String>,
    stamps: Option<String>,
    sensor_mode: Option<String>,
    robot_accuracy_mm: Option<f64>,
    feature_bias_px: Option<f64>,
    feature_sigma_px: Option<f64>,
    feature_sigma_mm: Option<f64>,
    robot_sigma_mm: Option<f64>,
    stamp_sigma_ms: Option<f64>,
    offset_within_s: Option<f64>,
    looks: Option<String>,
    speed_mm_s: Option<f64>,
    stand_off_mm: Option<f64>,
    accept_partial: bool,
    require: [Option<f64>; 3],
}

impl Options {
    /// The settings.
    ///
    /// # Errors
    /// A name that is none, a number that cannot be.
    pub fn config(self) -> Result<Config, Failure> {
        let mut config = Config {
            loss: self.loss.as_deref().map(|name| choice("loss", name, &LOSSES)).transpose()?,
            hold: self.fix.iter().map(|name| choice("fix", name, &HOLDS)).collect::<Result<_, _>>()?,
            accept_partial: self.accept_partial,
            known: KnownOfCell {
                offset_within_s: positive("offset_within_s", self.offset_within_s)?,
                looks: self.looks.as_deref().map(|name| choice("looks", name, &AXES)).transpose()?,
            },
            robot_sigma_m: positive("robot_sigma_mm", self.robot_sigma_mm)?.map(|mm| mm * 1e-3),
            stamp_sigma_s: positive("stamp_sigma_ms", self.stamp_sigma_ms)?.map(|ms| ms * 1e-3),
            ..Config::default()
        };
        if let Some(name) = self.residual {
            config.residual = choice("residual", &name, &RESIDUALS)?;
        }
        if let Some(name) = self.stamps {
            config.stamps = choice("stamps", &name, &STAMPS)?;
        }
        if let Some(name) = self.sensor_mode {
            config.sensor = choice("sensor_mode", &name, &SENSORS)?;
        }
        if let Some(mm) = not_negative("robot_accuracy_mm", self.robot_accuracy_mm)? {
            config.robot_accuracy_m = Some(mm * 1e-3);
        }
        if let Some(px) = not_negative("feature_bias_px", self.feature_bias_px)? {
            config.feature_bias_px = px;
        }
        if let Some(px) = positive("feature_sigma_px", self.feature_sigma_px)? {
            config.feature_sigma_px = px;
        }
        if let Some(mm) = positive("feature_sigma_mm", self.feature_sigma_mm)? {
            config.feature_sigma_m = mm * 1e-3;
        }
        if let Some(mm_s) = positive("speed_mm_s", self.speed_mm_s)? {
            config.used_at.speed_m_s = mm_s * 1e-3;
        }
        config.used_at.stand_off_m = positive("stand_off_mm", self.stand_off_mm)?.map(|mm| mm * 1e-3);
        let [time_ms, rotation_deg, translation_mm] = self.require;
        config.require = Requirement {
            time_s: positive("require_ms", time_ms)?.map(|ms| ms * 1e-3),
            rotation_rad: positive("require_deg", rotation_deg)?.map(f64::to_radians),
            translation_m: positive("require_mm", translation_mm)?.map(|mm| mm * 1e-3),
        };
        Ok(config)
    }
}

const RESIDUALS: [(&str, ResidualKind); 2] =
    [("sheet", ResidualKind::Sheet), ("point-to-line", ResidualKind::PointToLine)];
const HOLDS: [(&str, Hold); 2] = [("time-offset", Hold::TimeOffset), ("hand-eye", Hold::HandEye)];
const SENSORS: [(&str, SensorMode); 3] =
    [("fixed", SensorMode::Fixed), ("prior", SensorMode::Prior), ("free", SensorMode::Free)];
const STAMPS: [(&str, Stamps); 3] =
    [("auto", Stamps::Auto), ("raw", Stamps::Raw), ("regular", Stamps::Regular)];
const LOSSES: [(&str, Loss); 5] = [
    ("squared", Loss::Squared),
    ("huber", Loss::Huber { scale: 3.0 }),
    ("cauchy", Loss::Cauchy { scale: 3.0 }),
    ("geman-mcclure", Loss::GemanMcClure { scale: 4.0 }),
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

fn choice<T: Copy>(option: &str, name: &str, known: &[(&str, T)]) -> Result<T, Failure> {
    known.iter().find(|(known, _)| *known == name).map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<_> = known.iter().map(|(name, _)| *name).collect();
        Failure::new(format!("{option}: there is no {name:?}"), format!("one of {}", names.join(", ")))
    })
}

fn not_negative(option: &str, value: Option<f64>) -> Result<Option<f64>, Failure> {
    match value {
        Some(x) if !(x >= 0.0 && x.is_finite()) => Err(Failure::new(
            format!("{option}: expected a number of at least zero, found {x}"),
            "leave it out for the default",
        )),
        _ => Ok(value),
    }
}

fn positive(option: &str, value: Option<f64>) -> Result<Option<f64>, Failure> {
    match value {
        Some(x) if !(x > 0.0 && x.is_finite()) => Err(Failure::new(
            format!("{option}: expected a number above zero, found {x}"),
            "leave it out for the default",
        )),
        _ => Ok(value),
    }
}
