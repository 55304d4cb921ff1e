//! An alarm's numbers in words, from the report of its weld.

use serde_json::Value;
use trueline_report::number::change_with_sigma;
use trueline_watch::Kind;
use trueline_watch::words::{numbered, what_changed, where_to_look};

/// Name of the change, and the place to check.
#[must_use]
pub(super) fn what(alarm: &Value) -> [&'static str; 2] {
    let kind = Kind::ALL.into_iter().find(|kind| alarm["kind"].as_str() == Some(kind.name()));
    kind.map_or(["something has changed", ""], |kind| [what_changed(kind), where_to_look(kind)])
}

/// Its size and the remedy, in words; older lines have less.
#[must_use]
pub(super) fn text(alarm: &Value) -> String {
    alarm["text"]
        .as_str()
        .map_or_else(|| format!("{}, since {}", what(alarm)[0], since(alarm)), str::to_owned)
}

/// When it changed.
#[must_use]
pub(super) fn since(alarm: &Value) -> String {
    let weld = weld(alarm, "since_number", "since");
    match alarm["since_time_s"].as_f64() {
        Some(at_s) => format!("{at_s:.1} s into {weld}"),
        None => weld,
    }
}

/// A weld by its number and name; older lines have the name alone.
#[must_use]
pub(super) fn weld(of: &Value, number: &str, name: &str) -> String {
    let name = of[name].as_str().unwrap_or("an unknown weld");
    of[number].as_i64().map_or_else(|| name.to_owned(), |number| numbered(number, name))
}

/// Every number that shows, with its ± and unit; the names of the others in a row.
#[must_use]
pub(super) fn numbers(alarm: &Value) -> Vec<(&'static str, String)> {
    let (shown, hidden): (Vec<_>, Vec<_>) =
        all_numbers(alarm).into_iter().partition(|(_, text)| text.is_some());
    let mut rows: Vec<_> = shown.into_iter().filter_map(|(name, text)| Some((name, text?))).collect();
    if !hidden.is_empty() {
        let names: Vec<&str> = hidden.iter().map(|(name, _)| *name).collect();
        rows.push(("not determined by these welds", names.join(", ")));
    }
    rows
}

type Row = (&'static str, Option<String>);

fn all_numbers(alarm: &Value) -> Vec<Row> {
    let change = &alarm["change"];
    let sigma = &change["sigma"];
    let one = |value: &Value, sigma: &Value, factor: f64, unit: &str| match (value.as_f64(), sigma.as_f64()) {
        (Some(value), Some(sigma)) => Some(change_with_sigma(value * factor, sigma * factor, unit)),
        _ => None,
    };
    let list = |key: &str, names: &[&'static str], factor: f64, unit: &str| -> Vec<Row> {
        let row =
            |(k, name): (usize, &&'static str)| (*name, one(&change[key][k], &sigma[key][k], factor, unit));
        names.iter().enumerate().map(row).collect()
    };
    // Older lines do not have it of every kind.
    let mut rows = if change["seam_point_mm"].is_array() {
        let names = ["seam point across", "seam point along", "seam point, depth"];
        list("seam_point_mm", &names, 1.0, "mm")
    } else {
        Vec::new()
    };
    rows.extend(match alarm["kind"].as_str() {
        Some("timing") => {
            vec![("time offset", one(&change["time_offset_ms"], &sigma["time_offset_ms"], 1.0, "ms"))]
        }
        Some("sensor") => {
            let all = list(
                "shape",
                &["width", "depth", "shear", "keystone across", "keystone in depth"],
                100.0,
                "",
            );
            let unit = |k: usize| if k < 3 { "%" } else { "% per mm" };
            all.into_iter()
                .enumerate()
                .map(|(k, (name, text))| (name, text.map(|text| format!("{text}{}", unit(k)))))
                .collect()
        }
        Some("bracket" | "seam") => {
            let mut rows = list("translation_mm", &["shift x", "shift y", "shift z"], 1.0, "mm");
            rows.extend(list("rotation_deg", &["turn x", "turn y", "turn z"], 1.0, "°"));
            rows
        }
        _ => Vec::new(),
    });
    rows
}

/// Words of a list in a line.
#[must_use]
pub(super) fn words(list: &Value) -> Vec<String> {
    list.as_array().into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_keep_their_units_and_what_does_not_show_is_no_number() {
        let bracket = json!({ "kind": "bracket", "since": "weld-3", "since_number": 3, "since_time_s": 2.25, "change": {
            "translation_mm": [0.1, null, -0.2], "rotation_deg": [null, null, 0.05], "seam_point_mm": [0.3, null, 0.1],
            "sigma": { "seam_point_mm": [0.02, null, 0.01], "translation_mm": [0.01, null, 0.02], "rotation_deg": [null, null, 0.004] } } });
        let rows = numbers(&bracket);
        assert_eq!(rows[0], ("seam point across", "+0.300 ± 0.020 mm".to_owned()));
        assert_eq!(rows[2], ("shift x", "+0.100 ± 0.010 mm".to_owned()));
        assert_eq!(rows[4], ("turn z", "+0.0500 ± 0.0040 °".to_owned()));
        assert_eq!(rows[5].1, "seam point along, shift y, turn x, turn y");
        assert_eq!(since(&bracket), "2.2 s into weld 3 (weld-3)");
        let sensor = json!({ "kind": "sensor", "change": {
            "shape": [0.003, 0.0, 0.0, 1e-4, 0.0], "sigma": { "shape": [1e-4, 1e-4, 1e-4, 1e-5, 1e-5] } } });
        assert_eq!(numbers(&sensor)[0], ("width", "+0.300 ± 0.010 %".to_owned()));
        assert_eq!(numbers(&sensor)[3], ("keystone across", "+0.0100 ± 0.0010 % per mm".to_owned()));
    }
}
