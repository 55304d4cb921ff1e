//! Frequency below which a joint in pictures or profiles does not count.

/// A joint in a smaller part of them than this does not count.
const LEAST: f64 = 0.1;

/// Whether this share of pictures or profiles is too small for a joint.
#[must_use]
pub fn is_rare(found: usize, of: usize) -> bool {
    (found as f64) < LEAST * of.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::is_rare;

    #[test]
    fn one_in_ten_is_a_joint_and_less_is_none() {
        assert!(is_rare(0, 0) && is_rare(0, 5) && is_rare(9, 100));
        assert!(!is_rare(1, 1) && !is_rare(10, 100));
    }
}
