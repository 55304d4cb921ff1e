//! The part of the robot's stated errors that differs from stop to stop.
//!
//! A stated accuracy bounds all errors of the robot within a scan. Some differ from stop to stop, and the residuals show how large these are. The rest
//! changes slowly over the workspace. With the whole accuracy as both, every error counts twice.

use super::unknowns::ErrorModel;

/// Rounds of fit and part in turn.
pub(crate) const ROUNDS: usize = 2;
/// Fewer degrees of freedom leave the errors as stated.
pub(crate) const FEWEST_FREE: f64 = 12.0;
/// Least part: the residuals of a few stops may be small by chance.
const LEAST: f64 = 0.05;
/// Halvings of the part: to a thousandth.
const HALVINGS: usize = 10;

/// The same errors times a part.
pub(crate) fn scaled(noise: &ErrorModel, part: f64) -> ErrorModel {
    ErrorModel { position_m: part * noise.position_m, rotation_rad: part * noise.rotation_rad, ..*noise }
}

/// The least part that explains the residuals, at most 1.
pub(crate) fn least_part(explains: impl Fn(f64) -> bool) -> f64 {
    if explains(LEAST) {
        return LEAST;
    }
    let (mut low, mut high) = (LEAST, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if explains(middle) { high = middle } else { low = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::least_part;

    #[test]
    fn the_least_part_is_found_to_a_thousandth_and_is_one_at_most() {
        assert!((least_part(|part| part > 0.37) - 0.37).abs() < 1e-3);
        assert_eq!(least_part(|_| false), 1.0);
        assert_eq!(least_part(|_| true), 0.05);
    }
}
