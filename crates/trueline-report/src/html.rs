//! The report: one HTML file that opens offline, with its data and its charting library inside.

use crate::{json, summary};
use serde_json::{Value, json};
use trueline::{Calibration, Status};
use trueline_dataset::unit::MM_PER_M;

const TEMPLATE: &str = include_str!("../assets/report.html");
const SCRIPT: &str = include_str!("../assets/report.js");
const STYLE: &str = include_str!("../assets/report.css");
/// uPlot 1.6.32, MIT: see assets/third_party/uplot/LICENSE.
const UPLOT_SCRIPT: &str = include_str!("../assets/third_party/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../assets/third_party/uplot/uPlot.min.css");

/// Renders the report; `title` is what was calibrated.
#[must_use]
pub fn render(c: &Calibration, title: &str) -> String {
    let verdict_class = match c.status {
        Status::Accepted => "accepted",
        Status::NotAccepted => "not-accepted",
    };
    let parts = [
        ("{{title}}", escape(title)),
        ("{{uplot_style}}", UPLOT_STYLE.to_owned()),
        ("{{style}}", STYLE.to_owned()),
        ("{{verdict_class}}", verdict_class.to_owned()),
        ("{{verdict}}", escape(&summary::verdict(c))),
        ("{{reasons}}", list(c.reasons.iter().chain(&c.warnings))),
        ("{{rows}}", rows(c)),
        ("{{inputs}}", list(c.inputs.iter().map(|(file, hash)| format!("{file} {hash}")))),
        ("{{version}}", env!("CARGO_PKG_VERSION").to_owned()),
        ("{{uplot_script}}", UPLOT_SCRIPT.to_owned()),
        ("{{data}}", in_script(&data(c))),
        ("{{script}}", SCRIPT.to_owned()),
    ];
    // One pass over the template, so that nothing inside a part is taken for a placeholder.
    let mut out = String::new();
    let mut rest = TEMPLATE;
    while let Some(start) = rest.find("{{") {
        out.push_str(&rest[..start]);
        rest = &rest[start..];
        match parts.iter().find(|(name, _)| rest.starts_with(name)) {
            Some((name, text)) => {
                out.push_str(text);
                rest = &rest[name.len()..];
            }
            None => {
                out.push_str("{{");
                rest = &rest[2..];
            }
        }
    }
    out.push_str(rest);
    out
}

fn rows(c: &Calibration) -> String {
    let row = |(name, value): (String, String)| {
        format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>", escape(&name), escape(&value))
    };
    summary::rows(c).into_iter().map(row).collect()
}

fn list<S: AsRef<str>>(items: impl Iterator<Item = S>) -> String {
    items.map(|item| format!("<li>{}</li>", escape(item.as_ref()))).collect()
}

/// The series of the plots, and the whole result.
fn data(c: &Calibration) -> Value {
    let features = &c.features;
    let column = |f: &dyn Fn(&trueline::residuals::FeatureResidual) -> f64| -> Vec<f64> {
        features.iter().map(f).collect()
    };
    let along = |f: &trueline::residuals::FeatureResidual| {
        let line = &c.parameters.lines[f.line as usize];
        line.direction().dot(&(f.point_in_base - line.anchor())) * MM_PER_M
    };
    json!({
        "features": {
            "stamp_s": column(&|f| f.stamp_s),
            "along_mm": column(&along),
            "offset_2_mm": column(&|f| f.offset_m.x * MM_PER_M),
            "offset_3_mm": column(&|f| f.offset_m.y * MM_PER_M),
            "sigmas": column(&|f| f.normalised),
            "line": features.iter().map(|f| f.line).collect::<Vec<_>>(),
            "outlier": features.iter().map(trueline::residuals::FeatureResidual::is_outlier).collect::<Vec<_>>(),
        },
        "result": json::result(c),
    })
}

/// JSON inside a script element: no text of the data may end it.
fn in_script(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
