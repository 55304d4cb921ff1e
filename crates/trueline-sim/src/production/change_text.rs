//! A scheduled change in words: `timing=0.5@20` is 0.5 ms from piece 20 on, `bracket-x=0.1@20.6` 0.1 mm after 60 % of it.

use super::change::{Change, ScheduledChange};
use nalgebra::Vector3;
use std::str::FromStr;

/// The words, with the unit of their number.
pub const CHANGE_WORDS: &str = "timing (ms), bracket-x|y|z (mm, tool axes), bracket-turn-x|y|z (deg), sensor-width, sensor-depth, \
                                sensor-shear (%), sensor-keystone (1/mm), seam-x|y|z (mm, base axes), seam-turn-x|y|z (deg)";

impl FromStr for ScheduledChange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected WHAT=AMOUNT@PIECE, with WHAT one of {CHANGE_WORDS}");
        let (what, rest) = text.split_once('=').ok_or_else(wrong)?;
        let (amount, when) = rest.split_once('@').ok_or_else(wrong)?;
        let amount: f64 = amount.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(wrong)?;
        let when: f64 = when.parse().ok().filter(|x: &f64| *x >= 0.0 && x.is_finite()).ok_or_else(wrong)?;
        let change = change(what, amount).ok_or_else(wrong)?;
        Ok(Self { change, piece: when as usize, after: when.fract() })
    }
}

fn change(what: &str, amount: f64) -> Option<Change> {
    let (mm, degrees) = (1e-3 * amount, amount.to_radians());
    let zero = Vector3::zeros();
    let shape = |k: usize, value: f64| {
        let mut h = [0.0; 5];
        h[k] = value;
        Some(Change::Sensor(h))
    };
    match what {
        "timing" => return Some(Change::Timing(1e-3 * amount)),
        "sensor-width" => return shape(0, 1e-2 * amount),
        "sensor-depth" => return shape(1, 1e-2 * amount),
        "sensor-shear" => return shape(2, 1e-2 * amount),
        // Per metre.
        "sensor-keystone" => return shape(3, 1e3 * amount),
        _ => {}
    }
    let (what, axis) = what.rsplit_once('-')?;
    let axis = match axis {
        "x" => Vector3::x(),
        "y" => Vector3::y(),
        "z" => Vector3::z(),
        _ => return None,
    };
    match what {
        "bracket" => Some(Change::Bracket { rotation_rad: zero, translation_m: axis * mm }),
        "bracket-turn" => Some(Change::Bracket { rotation_rad: axis * degrees, translation_m: zero }),
        "seam" => Some(Change::Seam { rotation_rad: zero, translation_m: axis * mm }),
        "seam-turn" => Some(Change::Seam { rotation_rad: axis * degrees, translation_m: zero }),
        _ => None,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn words_are_changes_in_si_units() {
        let read = |text: &str| text.parse::<ScheduledChange>().unwrap();
        assert_eq!(read("timing=-0.5@20").change, Change::Timing(-0.5e-3));
        let bracket = read("bracket-turn-y=90@3.25");
        assert_eq!((bracket.piece, bracket.after), (3, 0.25));
        let Change::Bracket { rotation_rad, .. } = bracket.change else { unreachable!() };
        assert!((rotation_rad.y - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert_eq!(read("sensor-keystone=1e-4@0").change, Change::Sensor([0.0, 0.0, 0.0, 0.1, 0.0]));
        for wrong in ["timing=1", "timing@3", "bracket=1@2", "bracket-w=1@2", "timing=nan@1", "seam-x=1@-1"] {
            assert!(wrong.parse::<ScheduledChange>().is_err(), "{wrong}");
        }
    }
}
