//! First screen for a reader: the answers, and their limits.

use crate::export::{FORMATS, Format, Mounting, time_offset};
use crate::number::{digits_for, with_sigma};
use crate::page::{Block, Card, Form, Table, TableRow};
use crate::seam_error::{self, mm};
use crate::summary::AT_STOPS;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::euler::ZYX_INTRINSIC;
use trueline_method::assess::observability::Group;
use trueline_method::assess::seam_error::SeamError;
use trueline_method::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::{Calibration, Reason, Status};

/// Content of the first screen.
pub(super) fn blocks(c: &Calibration, probable_cause: Option<&str>) -> Vec<Block> {
    let offset_s = c.is_known(TIME_OFFSET).then(|| c.recorded_time_offset_s());
    let cause =
        |words: &str| Block::Notice { heading: "Probable cause", items: vec![words.to_owned()], bad: true };
    let mut blocks: Vec<Block> = probable_cause.map(cause).into_iter().collect();
    blocks.extend(against(c));
    blocks.push(Block::Cards(vec![seam_error_card(c), offset(c, offset_s), hand_eye(c)]));
    blocks.extend(c.findings.checks.seam_error.as_ref().map(|error| Block::Table(budget(c, error))));
    if !c.warnings().is_empty() {
        blocks.push(Block::Notice {
            heading: "Warnings",
            items: c.warnings().iter().map(ToString::to_string).collect(),
            bad: false,
        });
    }
    if c.status() == Status::Accepted {
        blocks.extend(to_use(c, offset_s));
    }
    blocks
}

/// Reasons against the result, the one that explains the others first.
fn against(c: &Calibration) -> Vec<Block> {
    // Undetermined quantities have a box of their own.
    let others = c.reasons().iter().filter(|reason| !matches!(reason, Reason::Unobservable(_)));
    let items: Vec<String> = others.map(ToString::to_string).collect();
    let reasons =
        |heading| (!items.is_empty()).then(|| Block::Notice { heading, items: items.clone(), bad: true });
    let unobservable = &c.findings.unknowns.observability.unobservable;
    // Data with a mistake in them make this meaningless.
    let is_of_data = matches!(c.reasons().first(), Some(Reason::ResidualsTooLarge { .. }));
    if unobservable.is_empty() || is_of_data {
        return reasons("Why it is not accepted").into_iter().collect();
    }
    let missing = Block::Notice {
        heading: "Not determined, and the motion that determines it",
        items: unobservable.iter().map(ToString::to_string).collect(),
        bad: true,
    };
    let is_of_tilt = unobservable.iter().any(|what| what.group == Group::Translation);
    let drawing = is_of_tilt.then_some(Block::Drawing(TILT));
    let motion = [Some(missing), drawing].into_iter().flatten();
    // Only an undetermined quantity that is the first reason explains the others.
    if matches!(c.reasons().first(), Some(Reason::Unobservable(_))) {
        motion.chain(reasons("Other reasons")).collect()
    } else {
        reasons("Why it is not accepted").into_iter().chain(motion).collect()
    }
}

/// Text to copy from an accepted result.
fn to_use(c: &Calibration, offset_s: Option<f64>) -> Vec<Block> {
    let mut blocks: Vec<Block> = offset_s.into_iter().flat_map(use_of_offset).collect();
    if (ROTATION..LINES).all(|k| c.is_known(k)) {
        let forms = forms(&Mounting::new(*c.file_tool_from_camera(), offset_s));
        blocks.push(Block::Choice { label: "Hand-eye transform: text to copy", forms });
    }
    blocks
}

/// Use of the time offset.
fn use_of_offset(offset_s: f64) -> [Block; 2] {
    let label = "Time offset: code to copy";
    let snippet = |snippet: time_offset::Snippet| Form {
        name: snippet.language,
        convention: "Interpolates the pose at the true exposure and transforms a seam point into base.",
        text: snippet.text,
    };
    let forms = time_offset::snippets(offset_s).into_iter().map(snippet).collect();
    [Block::Choice { label, forms }, Block::List(time_offset::advice(offset_s).to_vec())]
}

/// All ways to write the transform that have a place for it.
fn forms(mounting: &Mounting) -> Vec<Form> {
    let form = |format: &Format| {
        let text = format.text(mounting).ok()?;
        Some(Form { name: format.title, convention: format.convention, text })
    };
    // How the time offset is used stands above.
    FORMATS.iter().filter(|format| format.name != time_offset::FORMAT.name).filter_map(form).collect()
}

const UNSEEN: &str = "cannot be determined from this scan";

/// The motion that shows a translation: tilts to both sides, about the seam and along it.
const TILT: &str = include_str!("../../assets/tilt.svg");

fn offset(c: &Calibration, offset_s: Option<f64>) -> Card {
    let Some(offset_s) = offset_s else {
        let why = if c.findings.stops.is_some() { AT_STOPS } else { UNSEEN };
        return Card { name: "Time offset", values: vec![why.to_owned()], meaning: String::new() };
    };
    let ms = offset_s * 1e3;
    let value = with_sigma(ms, c.sigma(TIME_OFFSET).map(|s| s * 1e3), "ms");
    if c.status() == Status::NotAccepted {
        let meaning = "Not accepted: do not use it.".to_owned();
        return Card { name: "Time offset", values: vec![value], meaning };
    }
    let meaning = format!(
        "Use the robot's pose at the true exposure, not at the stamp. Images are stamped {}.",
        if ms >= 0.0 { "late" } else { "early (the robot's stamps are late)" }
    );
    let rule = time_offset::rule_with(offset_s, c.sigma(TIME_OFFSET));
    Card { name: "Time offset", values: vec![value, rule], meaning }
}

fn hand_eye(c: &Calibration) -> Card {
    let name = "Hand-eye transform";
    if c.rotation().is_err() && (TRANSLATION..LINES).all(|k| !c.is_known(k)) {
        return Card { name, values: vec![UNSEEN.to_owned()], meaning: "From camera to tool.".to_owned() };
    }
    let mut values: Vec<String> = ["x", "y", "z"]
        .iter()
        .enumerate()
        .map(|(k, axis)| {
            let at = TRANSLATION + k;
            let mm = c.file_tool_from_camera().translation.vector[k] * MM_PER_M;
            let text = with_sigma(mm, c.sigma(at).map(|s| s * MM_PER_M), "mm");
            format!("{axis} {}", if c.is_known(at) { text.as_str() } else { UNSEEN })
        })
        .collect();
    values.extend(rotation(c));
    Card {
        name,
        values,
        meaning:
            "From camera to tool. The rotation is about z, then the new y, then the new x; its ± are about the tool's x, y, z."
                .to_owned(),
    }
}

/// The rotation as angles, and its uncertainty.
fn rotation(c: &Calibration) -> Vec<String> {
    if c.rotation().is_err() {
        return vec![format!("rotation {UNSEEN}")];
    }
    let sigmas: Option<Vec<f64>> = (ROTATION..TRANSLATION).map(|k| c.sigma(k).map(f64::to_degrees)).collect();
    let finest = sigmas.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let digits = digits_for(finest);
    let with_two_digits = |deg: &f64| format!("± {deg:.0$}°", digits_for(*deg));
    let [z, y, x] = ZYX_INTRINSIC.angles(&c.file_tool_from_camera().rotation).map(f64::to_degrees);
    let known = match &sigmas {
        Some(sigmas) => sigmas.iter().map(with_two_digits).collect::<Vec<_>>().join(", "),
        None => "held".to_owned(),
    };
    vec![format!("x {x:.digits$}°, y {y:.digits$}°, z {z:.digits$}°"), known]
}

/// Error of a seam point that is measured later: from the scan alone, and with all assumptions.
fn seam_error_card(c: &Calibration) -> Card {
    let name = "Error of a seam point";
    let Some(error) = &c.findings.checks.seam_error else {
        let meaning = "Not predicted: this scan does not determine the whole hand-eye transform.".to_owned();
        return Card { name, values: vec!["–".to_owned()], meaning };
    };
    let mut values = vec![format!("± {} from the scan alone", mm(error.scan_alone_m()))];
    let assumed = seam_error::assumed(c, error).map(|with| {
        values.push(format!("± {} in total", mm(error.rms_m)));
        format!(" The total includes {with}.")
    });
    let meaning = format!(
        "One standard deviation in space at {:.0} mm/s, over the scanned part of the laser plane.{} Each single point adds \
         its own noise: ± {}.",
        c.findings.config.used_at.speed_m_s * MM_PER_M,
        assumed.unwrap_or_default(),
        mm(c.findings.fit.residuals.rms_m),
    );
    Card { name, values, meaning }
}

/// Sources of the error, largest first, and a remedy for each part.
fn budget(c: &Calibration, error: &SeamError) -> Table {
    let row = |part: seam_error::BudgetPart| {
        TableRow::plain(vec![
            part.name.to_owned(),
            // Number and unit stay in one line of a narrow column.
            format!("± {}", mm(part.sigma_m)).replace(' ', "\u{a0}"),
            format!("{:.0} %", 100.0 * part.share),
            part.cure.to_owned(),
        ])
    };
    Table {
        head: ["source of the seam error", "1 σ", "share of the variance", "remedy"]
            .map(str::to_owned)
            .to_vec(),
        rows: seam_error::budget(error, c.findings.checks.robot_seems.is_some())
            .into_iter()
            .map(row)
            .collect(),
    }
}
