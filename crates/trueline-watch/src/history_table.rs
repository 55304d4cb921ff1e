//! The history as columns, for every format of a file.

use crate::parameters::{CALIBRATION, Kind, ROTATION, SHAPE, TRANSLATION};
use crate::store::HistoryRow;

/// The values of a column, one a weld.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Whole numbers; `None` is nothing.
    Whole(Vec<Option<i64>>),
    /// Numbers; `None` if a weld does not show it.
    Number(Vec<Option<f64>>),
    /// Words.
    Text(Vec<Option<String>>),
}

/// A column of θ as a person reads it: its name with the unit of files, and the factor from SI.
#[must_use]
pub fn column(k: usize) -> (&'static str, f64) {
    const NAMES: [&str; CALIBRATION] = [
        "time_offset_ms",
        "rotation_x_deg",
        "rotation_y_deg",
        "rotation_z_deg",
        "translation_x_mm",
        "translation_y_mm",
        "translation_z_mm",
        "width_percent",
        "depth_percent",
        "shear_percent",
        "keystone_across_percent_per_mm",
        "keystone_depth_percent_per_mm",
    ];
    let factor = match k {
        0 => 1e3,
        ROTATION..TRANSLATION => 1f64.to_degrees(),
        TRANSLATION..SHAPE => 1e3,
        7..=9 => 100.0,
        _ => 0.1,
    };
    (NAMES[k], factor)
}

/// All columns with their names; units are in the names.
#[must_use]
pub fn columns(history: &[HistoryRow]) -> Vec<(String, Values)> {
    let whole = |of: &dyn Fn(&HistoryRow) -> Option<i64>| Values::Whole(history.iter().map(of).collect());
    let number = |of: &dyn Fn(&HistoryRow) -> Option<f64>| Values::Number(history.iter().map(of).collect());
    let text = |of: &dyn Fn(&HistoryRow) -> Option<String>| Values::Text(history.iter().map(of).collect());
    let mut all = vec![
        ("weld".to_owned(), whole(&|row| Some(row.number))),
        ("name".to_owned(), text(&|row| Some(row.name.clone()))),
        ("watched_unix_s".to_owned(), whole(&|row| Some(row.watched_s))),
        ("part".to_owned(), whole(&|row| Some(row.part))),
        ("used".to_owned(), whole(&|row| i64::try_from(row.used).ok())),
        ("outliers".to_owned(), whole(&|row| i64::try_from(row.outliers).ok())),
        ("noise_factor".to_owned(), number(&|row| Some(row.noise_factor))),
    ];
    for k in 0..CALIBRATION {
        let (name, factor) = column(k);
        let part =
            |row: &HistoryRow, which: usize| Some(row.estimates.get(k).copied().flatten()?[which] * factor);
        all.push((format!("change_{name}"), number(&|row| part(row, 0))));
        all.push((format!("sigma_{name}"), number(&|row| part(row, 1))));
    }
    for (k, kind) in Kind::ALL.into_iter().enumerate() {
        all.push((format!("p_log10_{}", kind.name()), number(&|row| row.p_log10.get(k).copied())));
    }
    all.push(("blind_to".to_owned(), text(&|row| Some(row.blind_to.join("; ")))));
    all.push(("state".to_owned(), text(&|row| Some(row.state().name().to_owned()))));
    all.push(("alarm".to_owned(), text(&|row| row.alarm.as_ref().map(|alarm| alarm.kind.clone()))));
    all.push(("alarm_since_weld".to_owned(), whole(&|row| row.alarm.as_ref().map(|alarm| alarm.since))));
    let name_of = |number: i64| {
        let at = history.binary_search_by_key(&number, |row| row.number).ok()?;
        Some(history[at].name.clone())
    };
    all.push(("alarm_since_name".to_owned(), text(&|row| name_of(row.alarm.as_ref()?.since))));
    all.push(("alarm_p_log10".to_owned(), number(&|row| row.alarm.as_ref().map(|alarm| alarm.p_log10))));
    let error = |row: &HistoryRow, which: usize| Some(row.alarm.as_ref()?.seam_error?[which] * 1e3);
    all.push(("alarm_seam_error_mm".to_owned(), number(&|row| error(row, 0))));
    all.push(("alarm_seam_error_sigma_mm".to_owned(), number(&|row| error(row, 1))));
    all.push(("alarm_text".to_owned(), text(&|row| row.alarm.as_ref()?.text.clone())));
    all
}
