//! Names that were mistyped: the nearest one that there is.

use std::path::{Path, PathBuf};

/// Names that are less similar (Jaro–Winkler, 0 to 1) are not a typing error: `huber` and `hubber` have 0.96, `camera` and
/// `cell` 0.61.
const ALIKE: f64 = 0.8;

/// The name most similar to another one; `None` if none is similar.
pub fn nearest<T: AsRef<str>>(name: &str, known: impl IntoIterator<Item = T>) -> Option<T> {
    let alike =
        |known: T| (strsim::jaro_winkler(&name.to_lowercase(), &known.as_ref().to_lowercase()), known);
    let near = known.into_iter().map(alike).filter(|(alike, _)| *alike >= ALIKE);
    near.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, known)| known)
}

/// The neighbour of a missing file or folder with the most similar name.
pub(crate) fn nearest_place(place: &Path) -> Option<PathBuf> {
    let name = place.file_name()?.to_str()?;
    let folder = place.parent()?;
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let mut names: Vec<String> =
        here.read_dir().ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
    // The order in a folder is not the same everywhere.
    names.sort_unstable();
    nearest(name, names).map(|near| folder.join(near))
}

#[cfg(test)]
mod tests {
    use super::{nearest, nearest_place};

    #[test]
    fn a_slip_of_the_fingers_finds_its_name_and_another_word_none() {
        let losses = ["squared", "huber", "cauchy", "geman-mc-clure", "tukey"];
        assert_eq!(nearest("hubber", losses), Some("huber"));
        assert_eq!(nearest("Tuckey", losses), Some("tukey"));
        assert_eq!(nearest("geman-mcclure", losses), Some("geman-mc-clure"));
        assert_eq!(nearest("time", losses), None);
    }

    #[test]
    fn the_nearest_place_is_beside_the_missing_one() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        std::fs::create_dir(folder.path().join("scan"))?;
        std::fs::write(folder.path().join("report.html"), "")?;
        assert_eq!(nearest_place(&folder.path().join("scann")), Some(folder.path().join("scan")));
        assert_eq!(nearest_place(&folder.path().join("nowhere")), None);
        assert_eq!(nearest_place(&folder.path().join("missing/scan")), None);
        Ok(())
    }
}
