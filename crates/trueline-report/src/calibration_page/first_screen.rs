//! What a reader sees first: the answers, and what they cannot be relied on for.

use crate::number::{digits_for, with_sigma};
use crate::page::{Block, Card, Form};
use trueline_dataset::unit::MM_PER_M;
use trueline_export::{FORMATS, Format, Mounting, time_offset};
use trueline_geometry::euler::ZYX_INTRINSIC;
use trueline_method::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::{Calibration, Reason, Status};

pub(super) fn blocks(c: &Calibration) -> Vec<Block> {
    let mut blocks = Vec::new();
    if !c.reasons().is_empty() {
        // What could not be seen has a box of its own.
        let others = c.reasons().iter().filter(|reason| !matches!(reason, Reason::Unobservable(_)));
        let items: Vec<String> = others.map(ToString::to_string).collect();
        if !items.is_empty() {
            blocks.push(Block::Notice { heading: "Why it is not accepted", items, bad: true });
        }
    }
    let advice: Vec<String> =
        c.findings.unknowns.observability.unobservable.iter().map(ToString::to_string).collect();
    if !advice.is_empty() {
        blocks.push(Block::Notice {
            heading: "What could not be seen, and the motion that shows it",
            items: advice,
            bad: true,
        });
    }
    blocks.push(Block::Cards(vec![offset(c), hand_eye(c), at_torch(c)]));
    if !c.warnings().is_empty() {
        blocks.push(Block::Notice {
            heading: "Warnings",
            items: c.warnings().iter().map(ToString::to_string).collect(),
            bad: false,
        });
    }
    if c.is_known(TIME_OFFSET) {
        blocks.extend(use_of_offset(c.best_fit().time_offset_s));
    }
    if (ROTATION..LINES).all(|k| c.is_known(k)) {
        let offset_s = c.is_known(TIME_OFFSET).then_some(c.best_fit().time_offset_s);
        let forms = forms(&Mounting::new(c.best_fit().tool_from_camera, offset_s));
        let label = match c.status() {
            Status::Accepted => "The hand-eye transform, to copy",
            Status::NotAccepted => "The hand-eye transform (not accepted), to copy",
        };
        blocks.push(Block::Choice { label, forms });
    }
    blocks
}

/// What to do with the time offset.
fn use_of_offset(offset_s: f64) -> [Block; 2] {
    let snippet = |snippet: time_offset::Snippet| Form {
        name: snippet.language,
        convention: "The pose at the true exposure, then the transform: a seam point in base.",
        text: snippet.text,
    };
    let forms = time_offset::snippets(offset_s).into_iter().map(snippet).collect();
    [
        Block::Choice { label: "How to use the time offset, to copy", forms },
        Block::List(time_offset::advice(offset_s).to_vec()),
    ]
}

/// All ways to write the transform that have a place for it.
fn forms(mounting: &Mounting) -> Vec<Form> {
    let form = |format: &Format| {
        let text = format.text(mounting).ok()?;
        Some(Form { name: format.title, convention: format.convention, text })
    };
    FORMATS.iter().filter_map(form).collect()
}

const UNSEEN: &str = "not visible in this scan";

fn offset(c: &Calibration) -> Card {
    let ms = c.best_fit().time_offset_s * 1e3;
    let value = if c.is_known(TIME_OFFSET) {
        with_sigma(ms, c.sigma(TIME_OFFSET).map(|s| s * 1e3), "ms")
    } else {
        UNSEEN.to_owned()
    };
    if !c.is_known(TIME_OFFSET) {
        return Card { name: "Time offset", values: vec![value], meaning: String::new() };
    }
    let meaning = format!(
        "Use the robot's pose at the true exposure, not at the stamp: images are stamped {}.",
        if ms >= 0.0 { "late" } else { "early: the robot's stamps are the late ones" }
    );
    let rule = time_offset::rule(c.best_fit().time_offset_s);
    Card { name: "Time offset", values: vec![value, rule], meaning }
}

fn hand_eye(c: &Calibration) -> Card {
    let mut values: Vec<String> = ["x", "y", "z"]
        .iter()
        .enumerate()
        .map(|(k, axis)| {
            let at = TRANSLATION + k;
            let mm = c.best_fit().tool_from_camera.translation.vector[k] * MM_PER_M;
            let text = with_sigma(mm, c.sigma(at).map(|s| s * MM_PER_M), "mm");
            format!("{axis} {}", if c.is_known(at) { text.as_str() } else { UNSEEN })
        })
        .collect();
    values.extend(rotation(c));
    Card {
        name: "Hand-eye transform",
        values,
        meaning:
            "From camera to tool. Angles about z, then the new y, then the new x; ± about the tool's x, y, z."
                .to_owned(),
    }
}

/// The rotation as angles, and how well it is known.
fn rotation(c: &Calibration) -> Vec<String> {
    if c.rotation().is_err() {
        return vec![format!("rotation {UNSEEN}")];
    }
    let sigmas: Option<Vec<f64>> = (ROTATION..TRANSLATION).map(|k| c.sigma(k).map(f64::to_degrees)).collect();
    let finest = sigmas.iter().flatten().copied().fold(f64::INFINITY, f64::min);
    let digits = digits_for(finest);
    let [z, y, x] = ZYX_INTRINSIC.angles(&c.best_fit().tool_from_camera.rotation).map(f64::to_degrees);
    let known = match &sigmas {
        Some(sigmas) => {
            let each: Vec<String> = sigmas.iter().map(|deg| format!("{deg:.0$}", digits_for(*deg))).collect();
            format!("± {}°", each.join(", "))
        }
        None => "held".to_owned(),
    };
    vec![format!("z {z:.digits$}°, y {y:.digits$}°, x {x:.digits$}°"), known]
}

/// The error of a seam point: what the calibration adds, what each point brings by itself, and both.
fn at_torch(c: &Calibration) -> Card {
    let name = "Error of a seam point";
    let Some(torch) = &c.findings.checks.at_torch else {
        let meaning =
            "Not predicted: something of the hand-eye transform cannot be determined from this scan."
                .to_owned();
        return Card { name, values: vec!["–".to_owned()], meaning };
    };
    let share_mm = torch.sigma_m.map(|m| m * MM_PER_M);
    let of_share = share_mm.iter().map(|mm| mm * mm).sum::<f64>().sqrt();
    let point_mm = c.findings.fit.residuals.rms_m * MM_PER_M;
    let both = of_share.hypot(point_mm);
    let text = |mm: f64| format!("{mm:.0$}", digits_for(mm));
    let values = vec![
        format!("± {} mm", text(both)),
        format!("of it the calibration ± {} mm", text(of_share)),
        format!("noise of one point ± {} mm", text(point_mm)),
    ];
    let meaning = format!(
        "In passing at {:.0} mm/s, {:.0} mm from the sensor; one standard deviation. The calibration's share is {} along, {} across, {} in \
         height. Errors of the sensor's own calibration and of the robot's kinematics are not in it.",
        torch.speed_m_s * MM_PER_M,
        torch.stand_off_m * MM_PER_M,
        text(share_mm[0]),
        text(share_mm[1]),
        text(share_mm[2]),
    );
    Card { name, values, meaning }
}
