//! An alarm's numbers in words, from the line that was told of its weld.

use serde_json::Value;

/// What the change is called.
#[must_use]
pub(super) fn what(alarm: &Value) -> &'static str {
    match alarm["kind"].as_str() {
        Some("timing") => "the camera's time offset has changed",
        Some("bracket") => "the sensor has moved on the robot: look at its bracket and at the tool",
        Some("sensor") => "the sensor itself has changed: look at its window, camera and laser",
        Some("seam") => "the part lies elsewhere: look at the fixture; the calibration is still good",
        _ => "something has changed",
    }
}

/// When it changed.
#[must_use]
pub(super) fn since(alarm: &Value) -> String {
    let weld = alarm["since"].as_str().unwrap_or("an unknown weld");
    match alarm["since_time_s"].as_f64() {
        Some(at_s) => format!("{at_s:.1} s into {weld}"),
        None => weld.to_owned(),
    }
}

/// Every number with its ± and unit.
#[must_use]
pub(super) fn numbers(alarm: &Value) -> Vec<(&'static str, String)> {
    let change = &alarm["change"];
    let sigma = &change["sigma"];
    let one = |value: &Value, sigma: &Value, factor: f64, unit: &str| match (value.as_f64(), sigma.as_f64()) {
        (Some(value), Some(sigma)) => format!("{:+.3} ± {:.3} {unit}", value * factor, sigma * factor),
        _ => "does not show in these welds".to_owned(),
    };
    let list = |key: &str, names: &[&'static str], factor: f64, unit: &str| -> Vec<(&'static str, String)> {
        let row =
            |(k, name): (usize, &&'static str)| (*name, one(&change[key][k], &sigma[key][k], factor, unit));
        names.iter().enumerate().map(row).collect()
    };
    match alarm["kind"].as_str() {
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
                .map(|(k, (name, text))| (name, format!("{text}{}", unit(k))))
                .collect()
        }
        Some("bracket" | "seam") => {
            let mut rows = list("translation_mm", &["shift x", "shift y", "shift z"], 1.0, "mm");
            rows.extend(list("rotation_deg", &["turn x", "turn y", "turn z"], 1.0, "°"));
            rows
        }
        _ => Vec::new(),
    }
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
        let bracket = json!({ "kind": "bracket", "since": "weld-3", "since_time_s": 2.25, "change": {
            "translation_mm": [0.1, null, -0.2], "rotation_deg": [null, null, 0.05],
            "sigma": { "translation_mm": [0.01, null, 0.02], "rotation_deg": [null, null, 0.004] } } });
        let rows = numbers(&bracket);
        assert_eq!(rows[0], ("shift x", "+0.100 ± 0.010 mm".to_owned()));
        assert_eq!(rows[1].1, "does not show in these welds");
        assert_eq!(rows[5], ("turn z", "+0.050 ± 0.004 °".to_owned()));
        assert_eq!(since(&bracket), "2.2 s into weld-3");
        let sensor = json!({ "kind": "sensor", "change": {
            "shape": [0.003, 0.0, 0.0, 1e-4, 0.0], "sigma": { "shape": [1e-4, 1e-4, 1e-4, 1e-5, 1e-5] } } });
        assert_eq!(numbers(&sensor)[0], ("width", "+0.300 ± 0.010 %".to_owned()));
        assert_eq!(numbers(&sensor)[3], ("keystone across", "+0.010 ± 0.001 % per mm".to_owned()));
    }
}
