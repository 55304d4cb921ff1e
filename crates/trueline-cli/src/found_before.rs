//! Features that were found in the same pictures before: in the user's cache, never in the dataset.

use crate::failure::Failure;
use crate::output;
use std::env;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use trueline_dataset::feature_cache::FeatureCache;
use trueline_dataset::{FoundSeams, PictureFolder, Sensor};
use trueline_vision::Joint;

/// The seams of a dataset's pictures: those that are kept, or those that `find` finds; and a hash of what they are made from.
pub fn seams(
    dataset: &Path,
    pictures: &PictureFolder,
    sensor: &Sensor,
    joint: Option<Joint>,
    quiet: bool,
    find: impl FnOnce() -> Result<FoundSeams, Failure>,
) -> Result<(FoundSeams, String), Failure> {
    let how = format!("{} {} {}", env!("CARGO_PKG_VERSION"), joint.map_or("auto", Joint::name), program());
    let key = FeatureCache::key(dataset, pictures, &how)?;
    let Some(cache) = folder().map(FeatureCache::at) else {
        return Ok((find()?, key));
    };
    if let Some(found) = cache.get(&key, sensor) {
        if !quiet {
            output::words(&format!(
                "note: {} seam points as found in the same pictures before",
                found.features.len()
            ));
        }
        return Ok((found, key));
    }
    let found = find()?;
    if let Err(error) = cache.put(&key, &found)
        && !quiet
    {
        output::words(&format!("note: the seam points are not kept for the next time: {error}"));
    }
    Ok((found, key))
}

/// Where a user's programs keep what can be made again.
fn folder() -> Option<PathBuf> {
    let absolute = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let caches = absolute("XDG_CACHE_HOME")
        .or_else(|| absolute("LOCALAPPDATA"))
        .or_else(|| absolute("HOME").map(|home| home.join(".cache")))?;
    Some(caches.join("trueline").join("features"))
}

/// This very program: another build may find another pixel.
fn program() -> String {
    let built = env::current_exe().and_then(|file| file.metadata());
    let told = built.and_then(|meta| Ok((meta.len(), meta.modified()?)));
    told.map_or_else(
        |_| String::new(),
        |(bytes, at)| {
            format!("{bytes} {}", at.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos()))
        },
    )
}
