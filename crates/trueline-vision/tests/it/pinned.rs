//! Pinned answers: the estimator's statements about many cells, so that a rebuild changes none of them silently.
//!
//! A sample is compared on every run. All of them are too large for the repository: before a change
//! `PINNED=FILE UPDATE=1 cargo test --workspace --test pinned -- --ignored` writes them, after it the same without `UPDATE` compares.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use trueline_dataset::Recording;
use trueline_lsq::Loss;
use trueline_method::assess::seam_error::{SeamError, SeamErrorBudget};
use trueline_method::{Calibration, Config, Measurements, Reason, SensorMode, Status, Warning, calibrate};
use trueline_sim::{
    PlatePair, Plates, Preset, ProfileLook, Scenario, SensorModel, random_cell, scan_plates, scan_profiles,
};
use trueline_vision::profile;

/// A change of a value below this part of its standard deviation, or of the standard deviation itself, is none.
const NO_CHANGE: f64 = 0.01;

/// A value not even known to a second, a radian, a metre or the whole is arbitrary, and its standard deviation is rounding.
const UNKNOWN: f64 = 1.0;

/// A value without a standard deviation may differ in digits of this part of it.
const ROUNDING: f64 = 1e-6;

/// Cells of each preset: 8 × 21 × 3 are 504 answers, of which the sample has 48.
const CELLS: u64 = 21;
const SAMPLED: u64 = 2;

/// A value with its standard deviation; that is `None` where it is not seen or held.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Number(f64, Option<f64>);

impl Number {
    fn is_like(&self, other: &Self) -> bool {
        let close = |a: f64, b: f64, within: f64| (a - b).abs() <= within.max(ROUNDING * b.abs());
        match (self.1, other.1) {
            (Some(a), Some(b)) if a > UNKNOWN && b > UNKNOWN => true,
            (Some(a), Some(b)) => close(self.0, other.0, NO_CHANGE * b) && close(a, b, NO_CHANGE * b),
            // Unseen quantities are arbitrary.
            (None, None) => true,
            _ => false,
        }
    }
}

/// The statements about one cell.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Said {
    /// Status, the sights that the answer is of, reasons and warnings; or why there is none.
    codes: String,
    /// Off the truth by component of the tangent: s, rad, m.
    off: Vec<Number>,
    /// Shape of the sheet.
    shape: Vec<Number>,
    /// Error of a seam point, then its parts, m.
    seam_error_m: Vec<f64>,
    /// Residuals over the noise that was expected.
    noise_factor: f64,
}

impl Said {
    fn by(recording: &Recording, config: &Config) -> Self {
        match calibrate(recording, None, config) {
            Ok(calibration) => Self::of(recording, &calibration),
            Err(error) => Self {
                codes: format!("no answer: {error}"),
                off: Vec::new(),
                shape: Vec::new(),
                seam_error_m: Vec::new(),
                noise_factor: 0.0,
            },
        }
    }

    fn of(recording: &Recording, calibration: &Calibration) -> Self {
        let truth = recording.truth.as_ref().unwrap().parameters;
        let number = |value: f64, component: usize| Number(value, calibration.sigma(component));
        let off = calibration.best_fit().minus(&truth);
        let at = calibration.best_fit();
        let shape = at.shape.iter().flat_map(|shape| shape.h.iter().copied()).zip(at.unknowns().shape());
        let findings = &calibration.findings;
        let noise_factor = match &findings.stripes {
            Some(stripes) if stripes.used != Measurements::Seam => {
                stripes.estimate.as_ref().unwrap().noise_factor
            }
            _ => findings.fit.noise_factor,
        };
        Self {
            codes: codes(calibration),
            off: off.iter().enumerate().map(|(k, value)| number(*value, k)).collect(),
            shape: shape.map(|(value, k)| number(value, k)).collect(),
            seam_error_m: findings.checks.seam_error.map(|error| parts_m(&error)).unwrap_or_default(),
            noise_factor,
        }
    }

    /// Differences from the pinned answers, in words; empty without one.
    fn differs_from(&self, pinned: &Self) -> String {
        let mut what = Vec::new();
        if self.codes != pinned.codes {
            what.push(format!("says {}, not {}", self.codes, pinned.codes));
        }
        for (name, numbers, others) in
            [("off", &self.off, &pinned.off), ("shape", &self.shape, &pinned.shape)]
        {
            let is_alike =
                numbers.len() == others.len() && numbers.iter().zip(others).all(|(a, b)| a.is_like(b));
            if !is_alike {
                what.push(format!("{name} {numbers:?}, not {others:?}"));
            }
        }
        let (errors, others) = (&self.seam_error_m, &pinned.seam_error_m);
        let all = others.first().copied().unwrap_or_default();
        let is_alike = errors.len() == others.len()
            && errors.iter().zip(others).all(|(a, b)| (a - b).abs() <= NO_CHANGE * all);
        if !is_alike {
            what.push(format!("seam error {errors:?} m, not {others:?}"));
        }
        if (self.noise_factor - pinned.noise_factor).abs() > NO_CHANGE * pinned.noise_factor {
            what.push(format!("noise factor {}, not {}", self.noise_factor, pinned.noise_factor));
        }
        what.join("; ")
    }
}

fn parts_m(error: &SeamError) -> Vec<f64> {
    // The edge of these cells is stated to be sharp.
    let SeamErrorBudget { noise, stamps, sensor, robot, seam_form, feature_bias, held, .. } = error.budget_m;
    vec![error.rms_m, noise, stamps, sensor, robot, seam_form, feature_bias, held]
}

fn codes(calibration: &Calibration) -> String {
    let status = if calibration.status() == Status::Accepted { "accepted" } else { "not accepted" };
    let stripes = calibration.findings.stripes.as_ref();
    let of = stripes.map_or_else(String::new, |s| format!("{} ({})", s.used.name(), s.because.code()));
    let reasons: Vec<&str> = calibration.reasons().iter().map(Reason::code).collect();
    let warnings: Vec<&str> = calibration.warnings().iter().map(Warning::code).collect();
    format!("{status}; {of}; {}; {}", reasons.join(" "), warnings.join(" "))
}

/// One scan and the ways in which it is asked for.
struct Asked {
    preset: Preset,
    seed: u64,
}

/// The assumption about a robot when these answers were pinned.
fn usual_robot() -> Config {
    Config { robot_accuracy_m: Some(0.3e-3), ..Config::default() }
}

impl Asked {
    /// Cells differ by their plates, by what errs, and by what is asked, each in its own rhythm.
    fn scenario(&self) -> Scenario {
        let mut scenario = random_cell(&self.preset.scenario(), self.seed, 1.0);
        let disturbance = &mut scenario.disturbance;
        match self.seed % 4 {
            1 => disturbance.outlier_fraction = 0.05,
            2 => disturbance.robot_position_noise_m *= 3.0,
            3 => disturbance.clock_drift_ppm = 80.0,
            _ => {}
        }
        scenario
    }

    fn plates(&self) -> Plates {
        let pair = match self.seed % 5 {
            3 => PlatePair::Lap { step_m: 3e-3 },
            4 => PlatePair::Butt { gap_m: 1e-3, mismatch_m: 0.5e-3 },
            _ => PlatePair::Meeting,
        };
        Plates { pair, ..Plates::default() }
    }

    fn config(&self, measurements: Measurements) -> Config {
        let of_seed = match self.seed % 3 {
            0 => Config::noise_only(),
            1 => usual_robot(),
            _ => Config { sensor: SensorMode::Free, loss: Some(Loss::Huber { scale: 2.0 }), ..usual_robot() },
        };
        Config { measurements, ..of_seed }
    }

    fn recording(&self) -> Option<Recording> {
        let (scenario, plates) = (self.scenario(), self.plates());
        if !matches!(scenario.cell.sensor, SensorModel::Profiler { .. }) {
            return scan_plates(&scenario, &plates, self.seed);
        }
        let (mut recording, profiles) =
            scan_profiles(&scenario, &plates, &ProfileLook::default(), self.seed)?;
        let found = profile::seams(&profiles, None).found;
        (recording.features, recording.stripes) = (found.features, found.stripes);
        Some(recording)
    }

    fn answers(&self) -> Vec<(String, Said)> {
        let Some(recording) = self.recording() else { return Vec::new() };
        let said = |measurements: Measurements| {
            let name = format!("{}/{:02}/{}", self.preset.name(), self.seed, measurements.name());
            (name, Said::by(&recording, &self.config(measurements)))
        };
        [Measurements::Seam, Measurements::Stripe, Measurements::Both].map(said).into()
    }
}

fn answers(seeds: std::ops::RangeInclusive<u64>) -> BTreeMap<String, Said> {
    let all: Vec<Asked> = Preset::ALL
        .into_iter()
        .flat_map(|preset| seeds.clone().map(move |seed| Asked { preset, seed }))
        .collect();
    let half = all.len().div_ceil(2);
    std::thread::scope(|scope| {
        let workers: Vec<_> = all
            .chunks(half)
            .map(|asked| scope.spawn(move || asked.iter().flat_map(Asked::answers).collect::<Vec<_>>()))
            .collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    })
}

/// Compares with a file; with `UPDATE` writes it.
fn compare(answers: &BTreeMap<String, Said>, file: &Path) {
    if std::env::var_os("UPDATE").is_some() {
        let text = answers.iter().map(|(name, said)| {
            format!("{}:{}", serde_json::to_string(name).unwrap(), serde_json::to_string(said).unwrap())
        });
        std::fs::write(file, format!("{{\n{}\n}}\n", text.collect::<Vec<_>>().join(",\n"))).unwrap();
        return;
    }
    let text = std::fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let pinned: BTreeMap<String, Said> = serde_json::from_str(&text).unwrap();
    assert!(answers.keys().eq(pinned.keys()), "other cells than in {}", file.display());
    let changes =
        answers.iter().zip(pinned.values()).map(|((name, said), pinned)| (name, said.differs_from(pinned)));
    let changed: Vec<String> =
        changes.filter(|(_, what)| !what.is_empty()).map(|(name, what)| format!("{name}: {what}")).collect();
    assert!(changed.is_empty(), "{} of {} changed:\n{}", changed.len(), answers.len(), changed.join("\n"));
}

#[test]
fn answers_of_a_sample_of_cells_are_those_that_are_pinned() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pinned/answers.json");
    let sample = answers(1..=SAMPLED);
    assert_eq!(sample.len(), 48);
    compare(&sample, &file);
}

#[test]
#[ignore = "minutes, and what they are compared with is written before a change: see above"]
fn answers_of_all_cells_are_those_that_are_pinned() {
    let file = std::env::var_os("PINNED").expect("PINNED names the file of the answers before the change");
    compare(&answers(1..=CELLS), &PathBuf::from(file));
}
