//! When the samples came.

use super::Shown;
use crate::page::{Axis, Block, Chart, Colour, Columns, Drawn, Series};
use trueline_method::input::timestamps::StampReport;

/// More intervals than this are thinned out for drawing; long ones never are.
const MOST: usize = 30_000;
/// An interval longer than this many typical ones is a gap.
const LONG: f64 = 1.5;

pub(super) fn blocks(shown: &Shown<'_>, columns: &mut Columns) -> Vec<Block> {
    let recording = shown.source.recording;
    let robot = recording.robot.iter().map(|sample| sample.stamp_ns).collect();
    let images = recording.features.iter().map(|feature| feature.stamp_ns).collect();
    let origin_ns = shown.calibration.findings.streams.origin_ns;
    let mut chart = |id, title, stamps_ns: Vec<i64>, report: &StampReport| {
        let period_s = report.median_period_s;
        let (times, steps) = intervals(&stamps_ns, origin_ns, period_s);
        let gaps = steps.iter().filter(|ms| **ms > LONG * period_s * 1e3).count();
        let (x, y) = (columns.add(times), columns.add(steps));
        Block::Chart(Chart {
            id,
            title,
            explanation: format!(
                "Time from each stamp to the next; the typical one is {:.4} ms. {gaps} are longer than \
                {LONG} times this: lost samples, or pictures without a feature. {}",
                period_s * 1e3,
                about_the_clock(report)
            ),
            alternative: format!("{title} in ms over time in s, {gaps} gaps"),
            wide: false,
            drawn: Drawn::Plot {
                x: Axis::of("time since the first robot row (s)"),
                y: Axis::of("to the next stamp (ms)"),
                series: vec![Series::points("stamps", x, y, Colour::A)],
                marks: Vec::new(),
            },
        })
    };
    let c = shown.calibration;
    vec![
        chart("stamps-robot", "Time between robot stamps", robot, &c.findings.streams.robot),
        chart("stamps-images", "Time between image stamps", images, &c.findings.streams.images),
    ]
}

/// The clock behind the stamps, if there is one.
fn about_the_clock(report: &StampReport) -> String {
    let (Some(period_s), Some(jitter_s)) = (report.period_s, report.jitter_s) else {
        return "No constant sampling period was found.".to_owned();
    };
    let used =
        if report.dejittered { "smoothed stamps were used" } else { "the stamps were used as recorded" };
    let latest_s = report.lateness_s.map_or(0.0, |[_, most_s]| most_s);
    format!(
        "The sampling period is {:.4} ms with a jitter of {:.3} ms; the largest delay is {:.2} ms; {used}.",
        period_s * 1e3,
        jitter_s * 1e3,
        latest_s * 1e3
    )
}

/// When each interval began, s, and how long it was, ms. Rows of one image count once.
fn intervals(stamps_ns: &[i64], origin_ns: i64, period_s: f64) -> (Vec<f64>, Vec<f64>) {
    let stride = stamps_ns.len().div_ceil(MOST).max(1);
    stamps_ns
        .windows(2)
        .filter(|pair| pair[1] > pair[0])
        .map(|pair| ((pair[0] - origin_ns) as f64 * 1e-9, (pair[1] - pair[0]) as f64 * 1e-6))
        .enumerate()
        .filter(|(k, (_, ms))| k % stride == 0 || *ms > LONG * period_s * 1e3)
        .map(|(_, both)| both)
        .unzip()
}
