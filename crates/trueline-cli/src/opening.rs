//! Scans are opened with words on stderr and a progress bar.

use crate::failure::Failure;
use crate::output;
use crate::picture_progress::PictureProgress;
use crate::wrong_file;
use std::env;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use trueline::open::error::folder_of;
use trueline::open::{How, Measurements, OpenError, OpenObserver, Opened, Told};
use trueline_dataset::feature_cache::FeatureCache;
use trueline_dataset::profile_stream::EachProfile;
use trueline_dataset::{FoundSeams, Profile, ProfilesRead};
use trueline_mcap::{ImportError, Imported};
use trueline_vision::Joint;
use trueline_vision::scan::ScanObserver;

/// Reads a scan. If there are pictures and no features, the seam is searched in the pictures.
pub(crate) fn open(path: &Path, joint: Option<Joint>, quiet: bool) -> Result<Opened, Failure> {
    trueline::open::open(path, &how(joint), &Words::new(quiet)).map_err(|error| failure(&error, joint))
}

/// Opens a scan's measurements: whole profiles, or seam points and stripes.
pub(crate) fn measurements(path: &Path, quiet: bool) -> Result<Measurements, Failure> {
    trueline::open::open_measurements(path, &how(None), &Words::new(quiet))
        .map_err(|error| failure(&error, None))
}

/// Reads the whole profiles of such a scan, and hands each over.
pub(crate) fn profiles(
    measured: &Measurements,
    takes_out_origins: bool,
    each: &mut EachProfile<'_>,
) -> Result<ProfilesRead, Failure> {
    measured.each_profile(takes_out_origins, each).map_err(|error| failure(&error, None))
}

/// All whole profiles of such a scan.
pub(crate) fn all_profiles(measured: &Measurements) -> Result<Vec<Profile>, Failure> {
    measured.profiles().map_err(|error| failure(&error, None))
}

/// Reads several scans of one sensor as one.
pub(crate) fn open_all(paths: &[PathBuf], joint: Option<Joint>, quiet: bool) -> Result<Opened, Failure> {
    trueline::open::open_all(paths, &how(joint), &Words::new(quiet)).map_err(|error| failure(&error, joint))
}

/// The seams of profiles, with the findings in words.
pub(crate) fn in_profiles(all: &[Profile], joint: Option<Joint>, quiet: bool) -> Result<FoundSeams, Failure> {
    trueline::open::seams_of_profiles(all, joint, &Words::new(quiet)).map_err(|error| failure(&error, joint))
}

/// The same; `None`, with the reason in words, if no profile shows one.
pub(crate) fn in_profiles_if_any(
    all: &[Profile],
    joint: Option<Joint>,
    quiet: bool,
) -> Result<Option<FoundSeams>, Failure> {
    match trueline::open::seams_of_profiles(all, joint, &Words::new(quiet)) {
        Err(error @ OpenError::NoSeamInProfiles { .. }) => {
            output::words(&error.to_string());
            Ok(None)
        }
        found => found.map(Some).map_err(|error| failure(&error, joint)),
    }
}

/// Reports on a recording in MCAP or rosbag2.
pub(crate) fn tell(imported: &Imported) {
    trueline::open::told_of_import(imported, &Words::new(false));
}

struct Words {
    quiet: bool,
    progress: PictureProgress,
}

impl Words {
    fn new(quiet: bool) -> Self {
        Self { quiet, progress: PictureProgress::new(quiet) }
    }
}

impl OpenObserver for Words {
    /// Damage is reported even with --quiet: data are missing because of it.
    fn told(&self, told: &Told<'_>) {
        match told {
            Told::Damage(_) => output::words(&format!("warning: {told}")),
            _ if self.quiet => {}
            Told::SeamsInPictures(_) | Told::SeamsInProfiles { .. } | Told::Channel(_) => {
                output::words(&told.to_string());
            }
            Told::StampMeaning(_) => output::words(&format!("stamps: {told}")),
            _ => output::words(&format!("note: {told}")),
        }
        if let (Told::SeamsInPictures(scan), false) = (told, self.quiet)
            && scan.second_place_px.is_some()
        {
            output::words(
                "hint: `trueline features` draws both places with --overlay, and chooses one with --stripe",
            );
        }
    }

    fn of_pictures(&self) -> &dyn ScanObserver {
        &self.progress
    }
}

fn how(joint: Option<Joint>) -> How {
    let found_by = format!("{} {}", env!("CARGO_PKG_VERSION"), this_program());
    How { joint, cache: cache_folder().map(FeatureCache::at), found_by }
}

/// Cache folder of the user's programs.
fn cache_folder() -> Option<PathBuf> {
    let absolute = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let caches = absolute("XDG_CACHE_HOME")
        .or_else(|| absolute("LOCALAPPDATA"))
        .or_else(|| absolute("HOME").map(|home| home.join(".cache")))?;
    Some(caches.join("trueline").join("features"))
}

/// Another build may find another pixel. Inside a Python module the program is Python's; only the version identifies it.
fn this_program() -> String {
    let built = env::current_exe().and_then(|file| file.metadata());
    let told = built.and_then(|meta| Ok((meta.len(), meta.modified()?)));
    told.map_or_else(
        |_| String::new(),
        |(bytes, at)| {
            let at_ns = at.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos());
            format!("{} {bytes} {at_ns}", env!("CARGO_PKG_VERSION"))
        },
    )
}

/// A file where the folder of a scan is needed.
pub(crate) fn not_a_folder(file: &Path) -> Failure {
    failure(&OpenError::Import(ImportError::NotARecording { file: file.to_owned() }), None)
}

/// Advice for the user, with the options that help.
fn failure(error: &OpenError, joint: Option<Joint>) -> Failure {
    let hint = match error {
        OpenError::SeamKnown(features) => {
            let joint = joint.map_or("JOINT", Joint::name);
            let dataset = folder_of(features).display();
            format!("leave --joint out, or look again: `trueline features {dataset} --joint {joint}`")
        }
        OpenError::NoSeamInPictures(_) => {
            "`trueline features DATASET --overlay FOLDER` draws the findings; --joint names the joint"
                .to_owned()
        }
        OpenError::NothingSeen(_) => {
            "record the camera as well: `trueline record --camera IP --sensor sensor.toml`".to_owned()
        }
        other => other.hint(),
    };
    let of_another_kind = match error {
        OpenError::File(error) => wrong_file::failure(error),
        OpenError::Import(error) => wrong_file::of_recording(error),
        _ => None,
    };
    let (message, hint) = of_another_kind.unwrap_or_else(|| (error.to_string(), hint));
    Failure::new(message, hint)
}

impl From<trueline_mcap::ImportError> for Failure {
    fn from(error: trueline_mcap::ImportError) -> Self {
        let of_another_kind = wrong_file::of_recording(&error);
        let (message, hint) =
            of_another_kind.unwrap_or_else(|| (error.to_string(), error.hint().to_string()));
        Self::new(message, hint)
    }
}
