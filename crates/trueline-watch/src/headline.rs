//! Headline of a change: its size, and the remedy; the same in a line, a message and on a page.

use crate::detect::SeamError;
use crate::detect::sensor_axes::IN_WORDS;
use crate::parameters::Kind;
use crate::told::{State, Told};
use crate::words::{millimetres, numbered, what_changed};
use trueline_report::number::digits_for;

/// Both sentences.
#[must_use]
pub fn headline(told: &Told) -> String {
    let since = since_text(told);
    let size = size_text(told.alarm.change.kind, &told.seam_error);
    let kind = told.alarm.change.kind;
    let what = match (kind, size) {
        (Kind::Timing, size) => {
            let offset_ms = told.alarm.change.value[0].unwrap_or(0.0) * 1e3;
            let direction = if offset_ms < 0.0 { "earlier" } else { "later" };
            let effect = size.map(|size| format!(", seam points are {size}")).unwrap_or_default();
            let digits = told.alarm.change.sigma[0].map_or(3, |sigma_s| digits_for(sigma_s * 1e3));
            format!("Pictures arrive {:.digits$} ms {direction} {since}{effect}", offset_ms.abs())
        }
        (Kind::Bracket, Some(size)) => format!("Seam points are {size} {since}"),
        (Kind::Sensor, Some(size)) => {
            format!("Seam points are {size} {since}, the sensor itself has changed")
        }
        (Kind::Seam, Some(size)) => format!("The parts are {size} {since}"),
        (_, None) => {
            format!("{} {since}; these welds do not determine by how much", capital(what_changed(kind)))
        }
    };
    let first = (told.out_since.0 != told.since_number)
        .then(|| format!(" The first wrong weld is {}.", numbered(told.out_since.0, &told.out_since.1)));
    let beyond = told.tolerance_m.filter(|_| told.state() == State::Alarm);
    let beyond = beyond.map(|m| format!(" (tolerance {})", millimetres(m)));
    format!("{what}{}.{} {}", beyond.unwrap_or_default(), first.unwrap_or_default(), what_to_do(told))
}

/// Hint for the user.
#[must_use]
pub fn what_to_do(told: &Told) -> String {
    let tolerance = told.tolerance_m.map(millimetres);
    match (told.state(), tolerance, told.alarm.change.kind) {
        (State::WithinTolerance, Some(tolerance), _) => {
            format!("This is within the tolerance of {tolerance}.")
        }
        _ if told.is_of_axis() => {
            "Look at the axis that carries the part: foot, bearing, zero. Calibrate it again.".to_owned()
        }
        (_, _, Kind::Timing) => {
            "Look at exposure, driver, network and clocks, or calibrate again.".to_owned()
        }
        (_, _, Kind::Bracket) => "Calibrate again.".to_owned(),
        (_, _, Kind::Sensor) => {
            "Look at the sensor's window and temperature, and calibrate the sensor again.".to_owned()
        }
        (_, _, Kind::Seam) => "Look at the fixture; the calibration is still good.".to_owned(),
    }
}

/// When it changed, in words.
#[must_use]
pub(crate) fn since_text(told: &Told) -> String {
    let since = numbered(told.since_number, &told.since);
    match told.alarm.since.inside_s {
        Some(at_s) => format!("since {at_s:.1} s into {since}"),
        None => format!("since {since}"),
    }
}

/// The axis along which most of it lies, if that is nearly all of it; else all together.
const NEARLY_ALL: f64 = 0.8;

fn size_text(kind: Kind, error: &SeamError) -> Option<String> {
    let [total, _] = error.total?;
    if kind == Kind::Seam {
        return Some(format!("{} elsewhere", millimetres(total)));
    }
    let by_axis = error.by_axis.iter().zip(IN_WORDS);
    let shown = by_axis.filter_map(|(axis, words)| axis.map(|[value, _]| (value.abs(), words)));
    let (largest, words) = shown.max_by(|a, b| a.0.total_cmp(&b.0))?;
    if largest * largest >= NEARLY_ALL * total * total {
        return Some(format!("{} off {words}", millimetres(largest)));
    }
    Some(format!("{} off", millimetres(total)))
}

fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_that_has_nearly_all_is_named() {
        let along = SeamError {
            by_axis: [Some([1e-5, 1e-5]), Some([-3.8e-4, 1e-5]), None],
            total: Some([3.801e-4, 1e-5]),
        };
        assert_eq!(size_text(Kind::Bracket, &along).as_deref(), Some("0.38 mm off along the seam"));
        let both =
            SeamError { by_axis: [Some([3e-4, 1e-5]), Some([-4e-4, 1e-5]), None], total: Some([5e-4, 1e-5]) };
        assert_eq!(size_text(Kind::Bracket, &both).as_deref(), Some("0.50 mm off"));
        assert_eq!(size_text(Kind::Bracket, &SeamError::default()), None);
        assert_eq!(size_text(Kind::Seam, &both).as_deref(), Some("0.50 mm elsewhere"));
        assert_eq!([0.3e-3, 3e-6, 2e-2].map(millimetres), ["0.30 mm", "0.003 mm", "20.0 mm"]);
    }
}
