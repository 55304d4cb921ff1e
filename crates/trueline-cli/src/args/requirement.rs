//! `--require` and `--want`: time=0.1ms,translation=0.1mm,rotation=0.05deg,seam=0.5mm.

use trueline_method::Requirement;

/// Units of each quantity and their size in SI.
const UNITS: [(&str, &[(&str, f64)]); 4] = [
    ("time", &[("ms", 1e-3), ("us", 1e-6), ("s", 1.0)]),
    ("translation", LENGTHS),
    ("rotation", &[("deg", std::f64::consts::PI / 180.0), ("mrad", 1e-3), ("rad", 1.0)]),
    ("seam", LENGTHS),
];
const LENGTHS: &[(&str, f64)] = &[("mm", 1e-3), ("um", 1e-6), ("m", 1.0)];

/// Reads the list of `--fixed-sigma`: as [`parse`], without the seam, which is not held.
pub(crate) fn parse_held(text: &str) -> Result<Requirement, String> {
    let sigmas = parse(text)?;
    match sigmas.seam_m {
        None => Ok(sigmas),
        Some(_) => {
            Err("the name is one of time, translation, rotation: --fix does not hold the seam".to_owned())
        }
    }
}

/// Reads the list.
pub(crate) fn parse(text: &str) -> Result<Requirement, String> {
    let wrong = |item: &str, why: &str| {
        format!("`{item}`: {why}; for example time=0.1ms,translation=0.1mm,rotation=0.05deg")
    };
    let mut limits = [None; 4];
    for item in text.split(',') {
        let (name, value) = item.split_once('=').ok_or_else(|| wrong(item, "expected NAME=LIMIT"))?;
        let quantity = UNITS
            .iter()
            .position(|(known, _)| *known == name.trim())
            .ok_or_else(|| wrong(item, "the name is one of time, translation, rotation, seam"))?;
        if limits[quantity].is_some() {
            return Err(wrong(item, "it is given twice"));
        }
        limits[quantity] = Some(limit(value.trim(), UNITS[quantity].1).map_err(|why| wrong(item, &why))?);
    }
    let [time_s, translation_m, rotation_rad, seam_m] = limits;
    Ok(Requirement { time_s, rotation_rad, translation_m, seam_m })
}

/// Requirement of a plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Want {
    /// Standard deviations.
    pub(crate) sigmas: Requirement,
    /// Seam error, m.
    pub(crate) seam_m: Option<f64>,
}

/// Reads the list of `plan --want`: as [`parse`], the seam apart.
pub(crate) fn parse_want(text: &str) -> Result<Want, String> {
    let all = parse(text)?;
    Ok(Want { sigmas: Requirement { seam_m: None, ..all }, seam_m: all.seam_m })
}

/// Reads a length with its unit, m.
pub(crate) fn length_m(text: &str) -> Result<f64, String> {
    limit(text.trim(), UNITS[1].1).map_err(|why| format!("`{text}`: {why}; for example 0.5mm"))
}

fn limit(value: &str, units: &[(&str, f64)]) -> Result<f64, String> {
    let known: Vec<&str> = units.iter().map(|(name, _)| *name).collect();
    let unit = value.trim_start_matches(|c: char| !c.is_ascii_alphabetic() || c == 'e');
    let number = value.strip_suffix(unit).unwrap_or(value).trim();
    let scale = units.iter().find(|(name, _)| *name == unit).map(|(_, scale)| *scale);
    match (number.parse::<f64>(), scale) {
        (Ok(number), Some(scale)) if number > 0.0 && number.is_finite() => Ok(number * scale),
        (Ok(_), Some(_)) => Err("the limit must be above zero".to_owned()),
        _ => Err(format!("expected a number with a unit of {}", known.join(", "))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_with_their_units() {
        let Ok(read) = parse("translation=0.1mm, time=50us,rotation=0.05deg") else {
            unreachable!("it is well formed")
        };
        assert_eq!(read.translation_m, Some(0.1 * 1e-3));
        assert_eq!(read.time_s, Some(50.0 * 1e-6));
        assert!((read.rotation_rad.unwrap_or(0.0) - 0.05_f64.to_radians()).abs() < 1e-15);
    }

    #[test]
    fn a_plan_may_want_a_seam_error_too() {
        let Ok(want) = parse_want("time=0.1ms, seam=0.05mm") else { unreachable!("it is well formed") };
        assert_eq!((want.sigmas.time_s, want.seam_m), (Some(0.1 * 1e-3), Some(0.05 * 1e-3)));
        let Ok(alone) = parse_want("seam=50um") else { unreachable!("it is well formed") };
        assert_eq!(alone, Want { seam_m: Some(50.0 * 1e-6), ..Want::default() });
        for bad in ["seam=1", "seam=0mm", "seam=1mm,seam=2mm", "seam", "", "seam=1mm,tilt=1deg"] {
            assert!(parse_want(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn anything_else_is_refused() {
        for bad in
            ["", "time", "time=0.1", "time=0.1mm", "time=-1ms", "time=1ms,time=2ms", "tilt=1deg", "time=ms"]
        {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
