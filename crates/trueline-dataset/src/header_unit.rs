//! Units in the headers of other programs: `A [°]`, `X_mm`, `Zeit (ms)`.

use crate::error::Problem;

/// A header's statement of its column's unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum HeaderUnit {
    /// Nothing.
    Absent,
    /// Our suffix.
    Known(&'static str),
    /// Words in brackets that are not a known unit.
    Unknown(String),
}

impl HeaderUnit {
    /// Our suffix, or none where the header has no unit.
    ///
    /// # Errors
    /// A unit that is not known.
    pub(crate) fn suffix(&self) -> Result<Option<&'static str>, Problem> {
        match self {
            Self::Absent => Ok(None),
            Self::Known(suffix) => Ok(Some(suffix)),
            Self::Unknown(unit) => Err(Problem::UnknownUnit { unit: unit.clone() }),
        }
    }
}

/// `A [°]` → `a`, `_deg`; `X_mm` → `x`, `_mm`; `Y` → `y` and no unit. `O_T_EE[12]` is an element, not a unit.
pub(crate) fn stem_and_unit(header: &str) -> (String, HeaderUnit) {
    let lower = header.trim().trim_start_matches('$').to_lowercase();
    if let Some((stem, unit)) = lower.split_once(['[', '(']) {
        let unit = unit.trim_end_matches([']', ')']).trim();
        let is_number = !unit.is_empty() && unit.bytes().all(|byte| byte.is_ascii_digit());
        if is_number && (unit != "1" || !stem.ends_with(' ')) {
            return (format!("{}_{unit}", stem.trim()), HeaderUnit::Absent);
        }
        let known = suffix_of(unit).map(HeaderUnit::Known);
        return (stem.trim().to_owned(), known.unwrap_or_else(|| HeaderUnit::Unknown(unit.to_owned())));
    }
    match lower.rsplit_once('_').and_then(|(stem, unit)| Some((stem.to_owned(), suffix_of(unit)?))) {
        Some((stem, suffix)) if !suffix.is_empty() => (stem, HeaderUnit::Known(suffix)),
        _ => (lower, HeaderUnit::Absent),
    }
}

/// Our suffix of a unit; empty for an explicit "no unit". Two letters of Unicode are micro.
pub(crate) fn suffix_of(unit: &str) -> Option<&'static str> {
    Some(match unit {
        "" | "-" | "1" => "",
        "mm" => "_mm",
        "m" => "_m",
        "cm" => "_cm",
        "um" | "µm" | "μm" => "_um",
        "in" | "inch" => "_in",
        // German for degrees; no robot logs gradians under this name.
        "deg" | "°" | "degree" | "degrees" | "grad" => "_deg",
        "rad" => "_rad",
        "mrad" => "_mrad",
        "gon" => "_gon",
        "s" | "sec" => "_s",
        "ms" => "_ms",
        "us" | "µs" | "μs" => "_us",
        "ns" => "_ns",
        _ => return None,
    })
}

/// Whether the unit of a header is `Grad`: degrees in German, gradians in some other languages.
pub(crate) fn is_in_grad(header: &str) -> bool {
    let lower = header.trim().to_lowercase();
    let unit = lower.split_once(['[', '(']).map(|(_, unit)| unit.trim_end_matches([']', ')']).trim());
    unit.or_else(|| lower.rsplit_once('_').map(|(_, unit)| unit)) == Some("grad")
}

/// Whether a cell contains only a unit, with or without brackets: some programs write units in a row below the names.
pub(crate) fn is_unit(cell: &str) -> bool {
    let bare = cell.trim_matches(['[', ']', '(', ')', ' ']).to_lowercase();
    suffix_of(&bare).is_some()
}

/// Names of columns with the time of a row, in lower case and without unit.
const TIME_NAMES: [&str; 12] = [
    "t",
    "time",
    "timestamp",
    "time stamp",
    "time_stamp",
    "stamp",
    "zeit",
    "uhrzeit",
    "zeitstempel",
    "datetime",
    "date time",
    "temps",
];

/// Whether a name, without its unit, is that of a column of time.
pub(crate) fn is_time_name(stem: &str) -> bool {
    TIME_NAMES.contains(&stem)
}

/// Our name for a column of time: `t` is in seconds, other names contain their unit.
#[must_use]
pub(crate) fn time_column(header: &str) -> Option<String> {
    let (stem, unit) = stem_and_unit(header);
    match (stem.as_str(), unit) {
        ("t", HeaderUnit::Absent) if header.trim() == "t" => Some("time_s".to_owned()),
        (stem, HeaderUnit::Known(unit)) if unit.ends_with('s') && is_time_name(stem) => {
            Some(format!("time{unit}"))
        }
        _ => None,
    }
}

/// Whether a header names a time without a unit. Then its cells show the unit.
pub(crate) fn is_bare_time(header: &str) -> bool {
    let (stem, unit) = stem_and_unit(header);
    unit == HeaderUnit::Absent && is_time_name(&stem)
}
