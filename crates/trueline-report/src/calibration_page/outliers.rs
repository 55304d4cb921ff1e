//! Features that do not fit, with their frames.

use super::Shown;
use crate::page::{Block, Table, TableRow};
use trueline_dataset::stamp;
use trueline_dataset::unit::MM_PER_M;

/// Rows of the table; the worst come first.
const MOST: usize = 200;

pub(super) fn blocks(shown: &Shown<'_>) -> Vec<Block> {
    let c = shown.calibration;
    let mut outliers: Vec<_> = c
        .findings
        .fit
        .features
        .iter()
        .zip(&c.findings.fit.feature_stamps_ns)
        .filter(|(f, _)| f.is_outlier())
        .collect();
    if outliers.is_empty() {
        return vec![Block::Text("None: all features are within 5 σ.".to_owned())];
    }
    outliers.sort_by(|a, b| b.0.normalised.total_cmp(&a.0.normalised));
    let mut blocks = vec![Block::Text(format!(
        "{} of {} features are more than 5 σ off and have little or no weight.{}",
        outliers.len(),
        c.findings.fit.features.len(),
        if outliers.len() > MOST {
            format!(" The worst {MOST} are listed; the JSON has all.")
        } else {
            String::new()
        }
    ))];
    let features = &shown.source.recording.features;
    let rows = outliers.iter().take(MOST).map(|(f, stamp_ns)| {
        let has_picture = shown.source.frames.iter().any(|frame| frame.row == f.row);
        TableRow {
            id: Some(format!("frame-{}", f.row)),
            link: has_picture.then(|| format!("picture-{}", f.row)),
            cells: vec![
                (f.row + 1).to_string(),
                features[f.row as usize].frame.map_or_else(|| "–".to_owned(), |frame| frame.to_string()),
                stamp::format_seconds(**stamp_ns),
                f.line.to_string(),
                format!("{:.1}", f.normalised),
                format!("{:.3}", f.offset_m.norm() * MM_PER_M),
            ],
        }
    });
    blocks.push(Block::Table(Table {
        head: ["row", "frame", "stamp (s)", "line", "off by (σ)", "from the line (mm)"]
            .map(str::to_owned)
            .to_vec(),
        rows: rows.collect(),
    }));
    for frame in shown.source.frames {
        blocks.push(Block::Picture {
            id: format!("picture-{}", frame.row),
            caption: format!("Row {}: the feature in its picture", frame.row + 1),
            png: frame.png.clone(),
        });
    }
    blocks
}
