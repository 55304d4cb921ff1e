//! The history as a table.

use crate::parameters::{CALIBRATION, Kind, ROTATION, SHAPE, TRANSLATION};
use crate::store::HistoryRow;

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

/// One row a weld: what of each number it would show if nothing else had changed, with its standard deviation; empty is
/// what it does not show.
#[must_use]
pub fn csv(history: &[HistoryRow]) -> String {
    let mut head = "weld,name,watched_unix_s,part,used,outliers,noise_factor".to_owned();
    for k in 0..CALIBRATION {
        let (name, _) = column(k);
        head += &format!(",change_{name},sigma_{name}");
    }
    for kind in Kind::ALL {
        head += &format!(",p_log10_{}", kind.name());
    }
    head += ",alarm,alarm_since_weld,alarm_p_log10\n";
    history.iter().fold(head, |text, row| text + &line(row))
}

fn line(row: &HistoryRow) -> String {
    let mut text = format!(
        "{},{},{},{},{},{},{:.4}",
        row.id,
        quoted(&row.name),
        row.watched_s,
        row.part,
        row.used,
        row.outliers,
        row.noise_factor
    );
    for k in 0..CALIBRATION {
        let factor = column(k).1;
        text += &match row.estimates.get(k).copied().flatten() {
            Some([value, sigma]) => format!(",{:.6},{:.6}", value * factor, sigma * factor),
            None => ",,".to_owned(),
        };
    }
    for k in 0..Kind::ALL.len() {
        text += &row.p_log10.get(k).map_or_else(|| ",".to_owned(), |p| format!(",{p:.3}"));
    }
    text += &match &row.alarm {
        Some(alarm) => format!(",{},{},{:.3}\n", alarm.kind, alarm.since, alarm.p_log10),
        None => ",,,\n".to_owned(),
    };
    text
}

/// Names with a comma, a quote or a line break stand in quotes (RFC 4180).
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", name.replace('"', "\"\""));
    }
    name.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_has_as_many_cells_as_the_head() {
        let mut estimates = vec![Some([1e-3, 1e-5]); CALIBRATION];
        estimates[3] = None;
        let row = HistoryRow {
            id: 7,
            name: "a, \"b\"".to_owned(),
            part: 1,
            watched_s: 0,
            used: 100,
            outliers: 1,
            noise_factor: 1.0,
            estimates,
            p_log10: vec![-1.0, -2.0, -3.0, -4.0],
            alarm: None,
        };
        let text = csv(&[row]);
        let cells: Vec<usize> =
            text.replace("\"a, \"\"b\"\"\"", "name").lines().map(|l| l.split(',').count()).collect();
        assert_eq!(cells, [7 + 24 + 4 + 3; 2]);
        assert!(text.contains(",1.000000,0.010000,"), "1 ms ± 0.01 ms: {text}");
    }
}
