//! Numbers as people read them: enough digits to see one sigma, always with ±.

/// Digits after the point that show two digits of `sigma`.
#[must_use]
pub fn digits_for(sigma: f64) -> usize {
    if !(sigma.is_finite() && sigma > 0.0) {
        return 3;
    }
    // Two significant digits of sigma: 0.0123 → 4; 0.0998 is rounded to 0.10, which has them at 2.
    let exponent = sigma.log10().floor();
    let rounded_up = sigma * 10_f64.powf(1.0 - exponent) >= 99.5;
    (1.0 - exponent - f64::from(rounded_up)).clamp(0.0, 9.0) as usize
}

/// `value ± sigma unit`; without a sigma, the value alone.
#[must_use]
pub fn with_sigma(value: f64, sigma: Option<f64>, unit: &str) -> String {
    match sigma {
        Some(sigma) => {
            let digits = digits_for(sigma);
            format!("{value:.digits$} ± {sigma:.digits$} {unit}")
        }
        None => format!("{value:.4} {unit} (held)"),
    }
}

/// A change with its sign: `+value ± sigma unit`.
#[must_use]
pub fn change_with_sigma(value: f64, sigma: f64, unit: &str) -> String {
    let digits = digits_for(sigma);
    format!("{value:+.digits$} ± {sigma:.digits$} {unit}")
}

/// A rotation as \[w, x, y, z\] with w ≥ 0: of the two quaternions that mean it, always the same one.
#[must_use]
pub(crate) fn positive_w(rotation: &nalgebra::UnitQuaternion<f64>) -> [f64; 4] {
    let q = rotation.quaternion();
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|x| x * sign)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_digits_of_sigma_are_shown() {
        assert_eq!(with_sigma(17.7312, Some(0.0123), "ms"), "17.731 ± 0.012 ms");
        assert_eq!(with_sigma(-4.0, Some(2.5), "mm"), "-4.0 ± 2.5 mm");
        assert_eq!(with_sigma(1234.5, Some(150.0), "mm"), "1234 ± 150 mm");
        assert_eq!(with_sigma(0.5, Some(0.0998), "mm"), "0.50 ± 0.10 mm");
        assert_eq!(with_sigma(0.5, Some(0.0994), "mm"), "0.500 ± 0.099 mm");
        assert_eq!(with_sigma(5.0, None, "ms"), "5.0000 ms (held)");
        assert_eq!(change_with_sigma(0.08012, 3.1e-4, "mm"), "+0.08012 ± 0.00031 mm");
    }
}
