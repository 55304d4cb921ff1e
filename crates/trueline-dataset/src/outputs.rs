//! The outputs of a command, checked before its work: no input is overwritten.

use crate::error::{Error, Problem};
use crate::whole_file;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// Files of a scan's folder that commands read from it, wherever in it they lie.
const READ_FROM_SCANS: [&str; 16] = [
    "sensor.toml",
    "cell.toml",
    "robot.csv",
    "axes.csv",
    "encoder.csv",
    "poses.csv",
    "features.csv",
    "sightings.csv",
    "stripes.csv",
    "profiles.csv",
    "profiles.parquet",
    "initial.toml",
    "truth.toml",
    "index.csv",
    "metadata.yaml",
    "recording.mcap",
];

/// Folders of a scan in which all is read.
const FOLDERS_OF_SCANS: [&str; 1] = ["images"];

/// Endings of files that are read wherever they lie in a folder that is an input, if they are there.
const READ_ENDINGS: [&str; 7] = ["png", "jpg", "jpeg", "tif", "tiff", "bmp", "db3"];

/// Output of data if no file is named.
pub const STDOUT: &str = "-";

/// Checks that all files of a command can be written, each at a place of its own and over no input. `inputs` are the files
/// and the folders of scans that it reads.
///
/// # Errors
/// The first file that cannot be written, that is named twice, or that the command or a later one reads.
pub fn check(inputs: &[&Path], outputs: &[&Path]) -> Result<(), Error> {
    let mut taken: Vec<PathBuf> = Vec::new();
    for output in outputs {
        if *output == Path::new(STDOUT) {
            if taken.iter().any(|other| other == output) {
                return Err(Error::in_file(output, Problem::OutputTwice));
            }
            taken.push(output.to_path_buf());
            continue;
        }
        whole_file::expect_writable(output)?;
        // Pipes and devices keep nothing that could be lost.
        if fs::metadata(output).is_ok_and(|meta| !meta.is_file()) {
            continue;
        }
        let place = place_of(output);
        if inputs.iter().any(|input| is_read(input, &place)) {
            return Err(Error::in_file(output, Problem::OutputIsInput));
        }
        if taken.contains(&place) {
            return Err(Error::in_file(output, Problem::OutputTwice));
        }
        taken.push(place);
    }
    Ok(())
}

/// Refuses a file that is there already: one that somebody may still need.
///
/// # Errors
/// A file that is there, or one that cannot be written.
pub fn must_be_new(output: &Path) -> Result<(), Error> {
    if output.exists() {
        return Err(Error::in_file(output, Problem::AlreadyExists));
    }
    whole_file::expect_writable(output)
}

/// Whether a place is an input, or a file of the scan in a folder.
fn is_read(input: &Path, place: &Path) -> bool {
    let input = place_of(input);
    if !input.is_dir() {
        return input == place;
    }
    let Ok(inside) = place.strip_prefix(&input) else { return false };
    let is_named = |names: &[&str], name: Option<&std::ffi::OsStr>| {
        name.is_some_and(|name| names.iter().any(|known| name.eq_ignore_ascii_case(known)))
    };
    let folder = inside.components().next().map(std::path::Component::as_os_str);
    is_named(&READ_FROM_SCANS, inside.file_name())
        || (place.exists() && is_named(&READ_ENDINGS, place.extension()))
        || (inside.components().count() > 1 && is_named(&FOLDERS_OF_SCANS, folder))
}

/// One name for every way to write a path; the file need not be there.
fn place_of(path: &Path) -> PathBuf {
    if let Ok(place) = path.canonicalize() {
        return place;
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.map_or_else(env::current_dir, Path::canonicalize);
    match (folder, path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_or_named_twice_is_no_output() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("scan/images")).unwrap();
        for name in ["scan/robot.csv", "scan/images/1.png", "result.json"] {
            fs::write(at(name), "data").unwrap();
        }
        let (scan, result) = (at("scan"), at("result.json"));
        let checked = |names: &[&str]| {
            let files: Vec<PathBuf> = names.iter().map(|name| at(name)).collect();
            check(&[&scan, &result], &files.iter().map(PathBuf::as_path).collect::<Vec<_>>())
        };
        for read in [
            "scan/robot.csv",
            "scan/images/1.png",
            "scan/images/new.csv",
            "scan/../scan/robot.csv",
            // Not there yet: the next command would read it.
            "scan/features.csv",
            "result.json",
            "scan/../result.json",
        ] {
            let problem = checked(&[read]).unwrap_err().problem;
            assert!(matches!(problem, Problem::OutputIsInput), "{read}: {problem}");
        }
        let problem = checked(&["a.json", "scan/../a.json"]).unwrap_err().problem;
        assert!(matches!(problem, Problem::OutputTwice), "{problem}");
        let twice = check(&[], &[Path::new(STDOUT), Path::new(STDOUT)]).unwrap_err().problem;
        assert!(matches!(twice, Problem::OutputTwice), "{twice}");
        assert!(matches!(checked(&["nowhere/a.json"]).unwrap_err().problem, Problem::NoFolder { .. }));
        assert!(matches!(checked(&["scan"]).unwrap_err().problem, Problem::OutputIsFolder));
        checked(&["scan/result.json", "scan/report.html", "other.json"]).unwrap();
        fs::write(at("scan/result.json"), "{}").unwrap();
        checked(&["scan/result.json"]).unwrap();
        assert!(matches!(must_be_new(&result).unwrap_err().problem, Problem::AlreadyExists));
        must_be_new(&at("new.json")).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_what_it_leads_to_and_a_device_takes_everything() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("result.json"), folder.path().join("link.json"));
        fs::write(&file, "{}").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        assert!(matches!(check(&[&file], &[&link]).unwrap_err().problem, Problem::OutputIsInput));
        let nothing = Path::new("/dev/null");
        check(&[], &[nothing, nothing]).unwrap();
    }
}
