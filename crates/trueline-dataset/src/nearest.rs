//! The name intended by a missing one.

/// Names that are less alike than this, from 0 to 1, are not meant.
const LEAST_ALIKE: f64 = 0.75;

/// The most similar of some names, if any is similar at all.
pub(crate) fn nearest<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<String> {
    let lower = name.to_lowercase();
    let alike = |other: &str| {
        let other = other.to_lowercase();
        // A part of a name is as good as a name with a wrong letter.
        let part = other.contains(&lower) || (other.len() > 1 && lower.contains(&other));
        strsim::jaro_winkler(&lower, &other).max(if part { 0.9 } else { 0.0 })
    };
    let best = names.map(|other| (alike(other), other)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > LEAST_ALIKE).then(|| best.1.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_that_was_meant_is_found_or_none() {
        let names = ["Zeit [s]", "$POS_ACT_MES.X", "temperature"];
        let meant = |name| nearest(name, names.into_iter());
        assert_eq!(meant("Zeit"), Some("Zeit [s]".to_owned()));
        assert_eq!(meant("zeit [ms]"), Some("Zeit [s]".to_owned()));
        assert_eq!(meant("POS_ACT_MES.X"), Some("$POS_ACT_MES.X".to_owned()));
        assert_eq!(meant("qqq"), None);
    }
}
