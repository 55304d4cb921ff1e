//! The certificate of a sensor calibrated by a scan: who, when and what, its figures with their uncertainty, and the passed
//! checks. As a page for people, or as JSON.

use crate::number::digits_for;
use crate::page::render::render;
use crate::page::{Block, Page, Section, Table, TableRow, Tone, Verdict};
use crate::result;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};
use trueline_dataset::result_file::{Fact, ResultFile};
use trueline_method::{Calibration, Status};

/// Expanded uncertainties are this number of standard deviations: about 95 %.
const COVERAGE: f64 = 2.0;

/// Distance from the middle at which a change of scale along an axis is stated, mm.
const KEYSTONE_REACH_MM: f64 = 30.0;

/// A certificate.
#[derive(Clone, Debug, Serialize)]
pub struct Certificate {
    /// Whether the calibration was accepted.
    pub passed: bool,
    /// The responsible person, if stated.
    pub operator: Option<String>,
    /// When it was made, UTC.
    pub made_utc: String,
    /// Program and version.
    pub program: String,
    /// The command.
    pub command: String,
    /// The files that it rests on, with their SHA-256.
    pub inputs: BTreeMap<String, String>,
    /// The figures; empty where the sensor was held.
    pub figures: Vec<Figure>,
    /// Share of a seam point's error that the sensor is left with, mm, one standard deviation.
    pub seam_error_of_sensor_mm: Option<f64>,
    /// The checks.
    pub checks: Vec<Check>,
}

/// A figure of the sensor.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// Its name.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// By how much the sensor's readings are to be corrected.
    pub value: f64,
    /// One standard deviation.
    pub sigma: f64,
    /// Expanded uncertainty, at about 95 %.
    pub expanded: f64,
    /// One standard deviation before the scan.
    pub sigma_before: f64,
}

/// A check and its outcome.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// Name of the requirement.
    pub name: &'static str,
    /// Whether nothing speaks against it.
    pub passed: bool,
    /// Why not.
    pub reasons: Vec<String>,
    /// Other remarks.
    pub notes: Vec<String>,
}

/// The checks, each with the codes of reasons and warnings that belong to it.
const CHECKS: [(&str, &[&str]); 6] = [
    (
        "The scan determines every unknown",
        &[
            "unobservable",
            "undetermined-turn",
            "poorly-known",
            "requirement-missed",
            "requirement-unobservable",
            "held-at-guess",
        ],
    ),
    (
        "No other solution explains the scan",
        &[
            "mirror-ambiguity",
            "mirror-by-sensor",
            "worse-minimum",
            "wrong-time-offset",
            "ambiguous-time-offset",
            "other-time-offset",
            "statement-contradicted",
            "decided-by-user",
        ],
    ),
    (
        "Residuals agree with the noise",
        &[
            "residuals-too-large",
            "unusual-noise",
            "structured-residuals",
            "stripe-noise",
            "too-many-outliers",
            "many-outliers",
            "outlier-stretch",
            "other-line",
            "too-few-used",
            "not-converged",
        ],
    ),
    (
        "Parts of the scan agree",
        &[
            "cross-validation-misfit",
            "cross-validation-shift",
            "stripes-contradict",
            "stripes-disagree",
            "bent-stripes",
        ],
    ),
    ("The sensor agrees with its file", &["sensor-off", "lens-off", "feature-bias"]),
    ("Clocks, robot and everything else", &[]),
];

impl Certificate {
    /// Of a calibration, by an operator and a command.
    #[must_use]
    pub fn of(calibration: &Calibration, (operator, command): (Option<&str>, String)) -> Self {
        let result = result::of(calibration);
        Self {
            passed: calibration.status() == Status::Accepted,
            operator: operator.map(str::to_owned),
            made_utc: utc(SystemTime::now()),
            program: format!("{} {}", result.tool.name, result.tool.version),
            command,
            figures: figures(&result),
            seam_error_of_sensor_mm: result.seam_error.as_ref().map(|error| error.budget_mm.sensor),
            checks: checks(&result.reasons, &result.warnings),
            inputs: result.inputs,
        }
    }

    /// As JSON for a file that ends so, else as a page.
    #[must_use]
    pub fn text(&self, file: &Path) -> String {
        if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
            self.json()
        } else {
            self.html()
        }
    }

    /// As JSON.
    #[must_use]
    pub fn json(&self) -> String {
        // Strings and numbers always have a form.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// As a page that opens offline.
    #[must_use]
    pub fn html(&self) -> String {
        let verdict = if !self.passed {
            "Not passed: the calibration is not accepted."
        } else if self.figures.is_empty() {
            "Nothing is certified: the sensor was held fixed."
        } else {
            "Passed: the sensor is calibrated."
        };
        render(&Page {
            title: "Certificate of a sensor".to_owned(),
            verdict: Verdict {
                text: verdict.to_owned(),
                tone: Tone::of(self.passed && !self.figures.is_empty()),
            },
            sections: vec![
                Section { id: "who", heading: "", blocks: vec![Block::Facts(self.facts())], folded: false },
                Section { id: "figures", heading: "Figures", blocks: self.figure_blocks(), folded: false },
                Section { id: "checks", heading: "Checks", blocks: vec![self.check_table()], folded: false },
                Section { id: "inputs", heading: "Files", blocks: vec![self.input_table()], folded: false },
            ],
            ..Page::default()
        })
    }

    fn facts(&self) -> Vec<(String, String)> {
        let rows = [
            ("made by", self.operator.as_deref().unwrap_or("not stated")),
            ("when", &self.made_utc),
            ("program", &self.program),
            ("command", &self.command),
        ];
        rows.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec()
    }

    fn figure_blocks(&self) -> Vec<Block> {
        let cells = |figure: &Figure| {
            let digits = digits_for(figure.sigma);
            let number = |x: f64| format!("{x:.digits$}");
            let numbers = [figure.value, figure.sigma, figure.expanded, figure.sigma_before].map(number);
            TableRow::plain(
                [figure.name.to_owned()].into_iter().chain(numbers).chain([figure.unit.to_owned()]).collect(),
            )
        };
        let table = Table {
            head: ["", "correction", "± (1 sigma)", "± (95 %)", "± before", "unit"]
                .map(str::to_owned)
                .to_vec(),
            rows: self.figures.iter().map(cells).collect(),
        };
        let seam = self.seam_error_of_sensor_mm.map(|mm| {
            let digits = digits_for(mm);
            Block::Text(format!(
                "The remaining sensor error displaces a seam point by ± {mm:.digits$} mm (1 σ)."
            ))
        });
        [Block::Table(table)].into_iter().chain(seam).collect()
    }

    fn check_table(&self) -> Block {
        let row = |check: &Check| {
            let outcome = if check.passed { "passed" } else { "not passed" };
            let words = check.reasons.iter().chain(&check.notes).cloned().collect::<Vec<_>>().join("; ");
            TableRow::plain(vec![check.name.to_owned(), outcome.to_owned(), words])
        };
        let head = ["check", "outcome", "remarks"].map(str::to_owned).to_vec();
        Block::Table(Table { head, rows: self.checks.iter().map(row).collect() })
    }

    fn input_table(&self) -> Block {
        let row = |(file, sum): (&String, &String)| TableRow::plain(vec![file.clone(), sum.clone()]);
        let head = ["file", "SHA-256"].map(str::to_owned).to_vec();
        Block::Table(Table { head, rows: self.inputs.iter().map(row).collect() })
    }
}

/// The shape in units of people: parts of the width and depth in percent, an angle, a change of scale over 30 mm.
fn figures(result: &ResultFile) -> Vec<Figure> {
    let sensor = &result.sensor;
    let (Some(shape), Some(sigma), Some(before)) = (sensor.shape, sensor.shape_sigma, sensor.prior_sigma)
    else {
        return Vec::new();
    };
    let keystone = 100.0 * KEYSTONE_REACH_MM;
    let units = [
        ("width", "%", 100.0),
        ("depth", "%", 100.0),
        ("shear", "degrees", 1.0_f64.to_degrees()),
        ("scale along the stripe, over 30 mm", "%", keystone),
        ("scale with the depth, over 30 mm", "%", keystone),
    ];
    let figure = |(k, (name, unit, per)): (usize, (&'static str, &'static str, f64))| Figure {
        name,
        unit,
        value: shape[k] * per,
        sigma: sigma[k] * per,
        expanded: COVERAGE * sigma[k] * per,
        sigma_before: before[k] * per,
    };
    units.into_iter().enumerate().map(figure).collect()
}

fn checks(reasons: &[Fact], warnings: &[Fact]) -> Vec<Check> {
    let named = |code: &str| CHECKS.iter().position(|(_, codes)| codes.contains(&code));
    // The last check has the facts of none.
    let texts = |facts: &[Fact], k: usize| -> Vec<String> {
        let of_check = |fact: &&Fact| named(&fact.code).unwrap_or(CHECKS.len() - 1) == k;
        facts.iter().filter(of_check).map(|fact| fact.text.clone()).collect()
    };
    let check = |(k, (name, _)): (usize, &(&'static str, &[&str]))| {
        let (reasons, notes) = (texts(reasons, k), texts(warnings, k));
        Check { name, passed: reasons.is_empty(), reasons, notes }
    };
    CHECKS.iter().enumerate().map(check).collect()
}

/// A moment as 2026-01-31 12:00:00 UTC.
fn utc(moment: SystemTime) -> String {
    let seconds = moment.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (days, of_day) = (seconds / 86_400, seconds % 86_400);
    // Years of 400 are 146 097 days; counted from March, the leap day is the last of a year.
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let (hour, minute, second) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
    format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02} UTC")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_moment_is_written_as_the_calendar_has_it() {
        // By `date -u -d @…`.
        for (seconds, expected) in [
            (0, "1970-01-01 00:00:00 UTC"),
            (951_782_399, "2000-02-28 23:59:59 UTC"),
            (951_782_400, "2000-02-29 00:00:00 UTC"),
            (1_709_251_199, "2024-02-29 23:59:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00:00 UTC"),
        ] {
            assert_eq!(utc(UNIX_EPOCH + Duration::from_secs(seconds)), expected);
        }
    }

    #[test]
    fn a_reason_fails_its_check_and_a_warning_is_a_note() {
        let fact = |code: &str| Fact { code: code.to_owned(), text: code.to_owned(), ..Fact::default() };
        let checks = checks(&[fact("unobservable"), fact("clock-step")], &[fact("unusual-noise")]);
        let outcome: Vec<(bool, usize)> = checks.iter().map(|c| (c.passed, c.notes.len())).collect();
        assert_eq!(outcome, [(false, 0), (true, 0), (true, 1), (true, 0), (true, 0), (false, 0)]);
    }
}
