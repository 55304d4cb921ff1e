//! Report on a weld as one line of JSON.

use crate::alarm_message::Event;
use crate::detect::{Change, SeamError};
use crate::headline::headline;
use crate::parameters::Kind;
use crate::told::{State, Told};
use serde_json::{Value, json};

/// Progress of learning a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Learning {
    /// Pieces so far; those after the beginning of an alarm do not count.
    pub pieces: usize,
    /// Pieces that are needed.
    pub needed: usize,
}

/// The history to which a weld belongs: each calibration has its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HistoryOf {
    /// The same as for the weld before.
    Same,
    /// A state that begins with this weld; before came one of another calibration, by its name, if any.
    New(Option<String>),
    /// A history that continues after welds of another calibration, by its name.
    Resumed(String),
}

impl HistoryOf {
    /// From the calibration of the weld before, that of this weld, and the number of its known welds.
    #[must_use]
    pub(crate) fn after(before: Option<(i64, String)>, own: i64, welds: usize) -> Self {
        match before {
            Some((id, _)) if id == own => Self::Same,
            before if welds == 0 => Self::New(before.map(|(_, name)| name)),
            Some((_, name)) => Self::Resumed(name),
            None => Self::Same,
        }
    }

    /// The word in files.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Same => "same",
            Self::New(_) => "new",
            Self::Resumed(_) => "resumed",
        }
    }
}

/// Report on a weld.
#[derive(Clone, Debug)]
pub struct WeldLine {
    /// Its number: welds are counted from 0 in the order in which the state stored them, across calibrations.
    pub number: i64,
    /// Its name.
    pub weld: String,
    /// Features that count.
    pub used: usize,
    /// Features that belong to no seam.
    pub outliers: usize,
    /// Noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
    /// Changes that welds like these would not show.
    pub blind_to: Vec<String>,
    /// Whether blindness and the state of learning are reported: at the first weld of a shift, and when they
    /// differ from the weld before.
    pub blindness_is_news: bool,
    /// The change, within the tolerance or not.
    pub alarm: Option<Told>,
    /// Number and name of the first weld that is at the calibration again, if this weld ended a change.
    pub good_since: Option<(i64, String)>,
    /// How the alarm differs from that of the weld before: then it is worth all its words.
    pub event: Option<Event>,
    /// Whether its sensor file differs from the calibration's; `None` if one of them is unknown.
    pub sensor_file_differs: Option<bool>,
    /// Number of the part.
    pub part: i64,
    /// The name of the calibration.
    pub calibration: String,
    /// To which history it belongs.
    pub history: HistoryOf,
    /// Until the scatter of the part is in use: how far it has been learnt.
    pub learning: Option<Learning>,
    /// log₁₀ probability of the most significant change of each kind, in the order of [`Kind::ALL`].
    pub p_log10: [f64; 4],
    /// Whether the stamps could be treated as in the calibration.
    pub stamps_treated_alike: bool,
    /// The line as reported when this weld was first watched.
    pub told_before: Option<String>,
}

impl WeldLine {
    /// A weld that was watched before.
    #[must_use]
    pub fn again(number: i64, line: String) -> Self {
        let value: Value = serde_json::from_str(&line).unwrap_or(Value::Null);
        let strings = |key: &str| {
            let list = value[key].as_array().into_iter().flatten();
            list.filter_map(|v| v.as_str().map(str::to_owned)).collect()
        };
        Self {
            number,
            weld: value["weld"].as_str().unwrap_or_default().to_owned(),
            used: value["used"].as_u64().unwrap_or(0) as usize,
            outliers: value["outliers"].as_u64().unwrap_or(0) as usize,
            noise_factor: value["noise_factor"].as_f64().unwrap_or(1.0),
            blind_to: strings("blind_to"),
            blindness_is_news: false,
            alarm: None,
            good_since: None,
            event: None,
            sensor_file_differs: value["sensor_file_differs"].as_bool(),
            part: value["part"].as_i64().unwrap_or(0),
            calibration: value["calibration"].as_str().unwrap_or_default().to_owned(),
            history: HistoryOf::Same,
            learning: None,
            p_log10: [0.0; 4],
            stamps_treated_alike: true,
            told_before: Some(line),
        }
    }

    /// State after it.
    #[must_use]
    pub fn state(&self) -> State {
        match &self.told_before {
            Some(line) => {
                let value: Value = serde_json::from_str(line).unwrap_or(Value::Null);
                // Older lines have no word for it.
                match (value["state"].as_str(), value["alarm"].is_null()) {
                    (Some("changed-within-tolerance"), _) => State::WithinTolerance,
                    (_, false) => State::Alarm,
                    (_, true) => State::Good,
                }
            }
            None => self.alarm.as_ref().map_or(State::Good, Told::state),
        }
    }

    /// Whether an alarm stands.
    #[must_use]
    pub fn is_alarm(&self) -> bool {
        self.state() == State::Alarm
    }

    /// As JSON.
    #[must_use]
    pub fn to_json(&self) -> Value {
        if let Some(told) = &self.told_before {
            return serde_json::from_str(told).unwrap_or(Value::Null);
        }
        let by_kind: serde_json::Map<String, Value> =
            Kind::ALL.iter().zip(self.p_log10).map(|(kind, p)| (kind.name().to_owned(), json!(p))).collect();
        let told = |state: State| self.alarm.as_ref().filter(|told| told.state() == state).map(told_json);
        let learning = self.learning.map(|l| json!({ "pieces": l.pieces, "needed": l.needed }));
        json!({
            "number": self.number, "weld": self.weld, "used": self.used, "outliers": self.outliers, "noise_factor": self.noise_factor,
            "calibration": self.calibration, "history": self.history.name(),
            "sensor_file_differs": self.sensor_file_differs, "part": self.part, "learning": learning, "blind_to": self.blind_to, "p_log10": by_kind,
            "state": self.state().name(), "alarm": told(State::Alarm), "change_within_tolerance": told(State::WithinTolerance),
            "good_since_number": self.good_since.as_ref().map(|(number, _)| number),
            "good_since": self.good_since.as_ref().map(|(_, name)| name),
        })
    }
}

/// A change with its numbers and sentences.
fn told_json(told: &Told) -> Value {
    let alarm = &told.alarm;
    let mut change = change_json(&alarm.change);
    let SeamError { by_axis, total } = told.seam_error;
    if alarm.change.kind != Kind::Seam {
        let of = |k: usize| by_axis.map(|axis| axis.map(|pair| pair[k] * 1e3));
        change["seam_point_mm"] = json!(of(0));
        change["sigma"]["seam_point_mm"] = json!(of(1));
    }
    let of = |k: usize| total.map(|pair| pair[k] * 1e3);
    json!({
        "kind": alarm.change.kind.name(),
        "since": told.since,
        "since_number": told.since_number,
        "since_time_s": alarm.since.inside_s,
        "wrong_since": told.out_since.1,
        "wrong_since_number": told.out_since.0,
        "seam_error_mm": of(0),
        "seam_error_sigma_mm": of(1),
        "tolerance_mm": told.tolerance_m.map(|m| m * 1e3),
        "text": headline(told),
        "change": change,
        "p_log10": alarm.change.p_log10,
        "links": told.links(),
        "not_told_apart": alarm.not_told_apart.iter().map(|kind| kind.name()).collect::<Vec<_>>(),
        "in_spite_of_repair": told.was_claimed,
    })
}

/// A change in the units of files, with its standard deviations; null if not determined.
#[must_use]
fn change_json(change: &Change) -> Value {
    let part = |from: usize, to: usize, factor: f64| {
        let scaled = |list: &[Option<f64>]| {
            list[from..to].iter().map(|x| x.map(|x| x * factor)).collect::<Vec<Option<f64>>>()
        };
        (scaled(&change.value), scaled(&change.sigma))
    };
    let degrees = 1f64.to_degrees();
    match change.kind {
        Kind::Timing => {
            let (value, sigma) = part(0, 1, 1e3);
            json!({ "time_offset_ms": value[0], "sigma": { "time_offset_ms": sigma[0] } })
        }
        Kind::Bracket | Kind::Seam => {
            // The bracket's rotation comes first, the part's translation.
            let bracket = change.kind == Kind::Bracket;
            let (turns, shifts) = if bracket { ((0, 3), (3, 6)) } else { ((3, 6), (0, 3)) };
            let (rotation, rotation_sigma) = part(turns.0, turns.1, degrees);
            let (translation, translation_sigma) = part(shifts.0, shifts.1, 1e3);
            json!({
                "translation_mm": translation, "rotation_deg": rotation,
                "frame": if bracket { "tool" } else { "base" },
                "sigma": { "translation_mm": translation_sigma, "rotation_deg": rotation_sigma },
            })
        }
        Kind::Sensor => {
            let (scales, scale_sigma) = part(0, 3, 1.0);
            let (keystones, keystone_sigma) = part(3, 5, 1e-3);
            json!({
                "shape": (scales.into_iter().chain(keystones).collect::<Vec<_>>()),
                "sigma": { "shape": (scale_sigma.into_iter().chain(keystone_sigma).collect::<Vec<_>>()) },
            })
        }
    }
}
