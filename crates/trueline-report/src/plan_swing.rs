//! A swing in words.

use trueline_plan::sweep::Sweep;

/// The swings in words: mean and swings, without those too small to show.
pub(crate) fn swung((name, sweep, unit, factor): (&str, Sweep, &str, f64)) -> (String, String) {
    // A tenth rounded from below must not be minus zero.
    let tenths = |x: f64| (10.0 * x).round() / 10.0 + 0.0;
    // "% of the stand-off" is written once.
    let (unit, of) =
        unit.split_once(" of ").map_or((unit, String::new()), |(unit, of)| (unit, format!(" of {of}")));
    let space = if unit == "°" { "" } else { " " };
    let mean = tenths(sweep.mean * factor);
    let swings: Vec<String> = (sweep.swings.iter())
        .map(|swing| (tenths(swing.amplitude * factor).abs(), swing.frequency_hz))
        .filter(|(amplitude, _)| *amplitude > 0.0)
        .map(|(amplitude, hz)| format!("± {amplitude:.1}{space}{unit} at {hz:.2} Hz"))
        .collect();
    let swings = if swings.is_empty() { "constant".to_owned() } else { swings.join(" and ") };
    (name.to_owned(), format!("{mean:.1}{space}{unit}{of}, {swings}"))
}
