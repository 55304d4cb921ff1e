//! What a reader sees first: the answers, and what they cannot be relied on for.

use crate::number::{digits_for, with_sigma};
use crate::page::{Block, Card};
use crate::transform_formats;
use trueline_dataset::unit::MM_PER_M;
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
    blocks.push(Block::Cards(vec![time_offset(c), hand_eye(c), at_torch(c)]));
    if !c.warnings().is_empty() {
        blocks.push(Block::Notice {
            heading: "Mind",
            items: c.warnings().iter().map(ToString::to_string).collect(),
            bad: false,
        });
    }
    if (ROTATION..LINES).all(|k| c.is_known(k)) {
        let forms = transform_formats::all(&c.best_fit().tool_from_camera);
        let label = match c.status() {
            Status::Accepted => "The hand-eye transform, to copy",
            Status::NotAccepted => "The hand-eye transform (not accepted), to copy",
        };
        blocks.push(Block::Choice { label, forms });
    }
    blocks
}

const UNSEEN: &str = "not visible in this scan";

fn time_offset(c: &Calibration) -> Card {
    let ms = c.best_fit().time_offset_s * 1e3;
    let value = if c.is_known(TIME_OFFSET) {
        with_sigma(ms, c.sigma(TIME_OFFSET).map(|s| s * 1e3), "ms")
    } else {
        UNSEEN.to_owned()
    };
    let meaning = if !c.is_known(TIME_OFFSET) {
        String::new()
    } else if ms >= 0.0 {
        "The image stamped t was exposed so much earlier.".to_owned()
    } else {
        "The image stamped t was exposed so much later: the robot's stamps are the late ones.".to_owned()
    };
    Card { name: "Time offset", values: vec![value], meaning }
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
    let sigmas: Option<Vec<f64>> = (ROTATION..TRANSLATION).map(|k| c.sigma(k)).collect();
    values.push(match sigmas {
        Some(sigmas) => {
            let degrees: Vec<String> = sigmas
                .iter()
                .map(|s| s.to_degrees())
                .map(|deg| format!("{deg:.0$}", digits_for(deg)))
                .collect();
            format!("rotation ± {}°", degrees.join(", "))
        }
        None if c.rotation().is_ok() => "rotation held".to_owned(),
        None => format!("rotation {UNSEEN}"),
    });
    Card {
        name: "Hand-eye transform",
        values,
        meaning: "From camera to tool; ± of the rotation about the tool's x, y, z.".to_owned(),
    }
}

fn at_torch(c: &Calibration) -> Card {
    let name = "Error at the torch";
    let Some(torch) = &c.findings.checks.at_torch else {
        let meaning = "Not predicted: something of the hand-eye transform is not seen.".to_owned();
        return Card { name, values: vec!["–".to_owned()], meaning };
    };
    let values = ["along", "across", "in height"]
        .iter()
        .zip(torch.sigma_m)
        .map(|(axis, m)| {
            let mm = m * MM_PER_M;
            format!("± {mm:.0$} mm {axis}", digits_for(mm))
        })
        .collect();
    let meaning = format!(
        "Of a seam point measured in passing at {:.0} mm/s and {:.0} mm from the sensor; one standard deviation.",
        torch.speed_m_s * MM_PER_M,
        torch.stand_off_m * MM_PER_M
    );
    Card { name, values, meaning }
}
