//! The history as a table.

use crate::history_table::{Values, columns};
use crate::store::HistoryRow;

/// One row a weld. Each number has its visible part if nothing else has changed, with its standard deviation; it is
/// empty if the weld does not show it.
#[must_use]
pub fn csv(history: &[HistoryRow]) -> String {
    let table = columns(history);
    let names: Vec<&str> = table.iter().map(|(name, _)| name.as_str()).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..history.len() {
        let cells: Vec<String> =
            table.iter().map(|(_, values)| cell(values, row).unwrap_or_default()).collect();
        text += &(cells.join(",") + "\n");
    }
    text
}

fn cell(values: &Values, row: usize) -> Option<String> {
    match values {
        Values::Whole(list) => Some(list.get(row)?.as_ref()?.to_string()),
        Values::Number(list) => Some(format!("{:.6}", list.get(row)?.as_ref()?)),
        Values::Text(list) => Some(quoted(list.get(row)?.as_ref()?)),
    }
}

/// Names with a comma, a quote or a line break are quoted (RFC 4180).
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", name.replace('"', "\"\""));
    }
    name.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::CALIBRATION;

    #[test]
    fn every_row_has_as_many_cells_as_the_head() {
        let mut estimates = vec![Some([1e-3, 1e-5]); CALIBRATION];
        estimates[3] = None;
        let row = HistoryRow {
            number: 7,
            name: "a, \"b\"".to_owned(),
            part: 1,
            watched_s: 0,
            used: 100,
            outliers: 1,
            noise_factor: 1.0,
            estimates,
            p_log10: vec![-1.0, -2.0, -3.0, -4.0],
            blind_to: vec!["seam".to_owned(), "bracket shift along".to_owned()],
            alarm: None,
        };
        let text = csv(&[row]);
        let cells: Vec<usize> =
            text.replace("\"a, \"\"b\"\"\"", "name").lines().map(|l| l.split(',').count()).collect();
        assert_eq!(cells, [7 + 24 + 4 + 1 + 5 + 3; 2]);
        assert!(text.contains(",1.000000,0.010000,"), "1 ms ± 0.01 ms: {text}");
        assert!(text.contains(",seam; bracket shift along,"), "{text}");
    }
}
