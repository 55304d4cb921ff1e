//! Where a dataset is read from: a folder, or a recording that is unpacked into one for the time being.

use crate::failure::Failure;
use crate::output;
use crate::pictures::{self, PictureOptions};
use crate::planned_scan::read_text;
use std::fs::File;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use trueline_cell::RECORDING;
use trueline_dataset::{Error, Problem, Recording, SensorFile, folder, images, sensor_toml};
use trueline_mcap::{Choice, unpack};
use trueline_vision::Joint;

/// A dataset folder that can be read.
pub struct OpenedDataset {
    folder: PathBuf,
    /// The recording it was unpacked from, and the folder that goes when this goes.
    unpacked: Option<(PathBuf, TempDir)>,
    stamp_meaning: Option<String>,
}

/// Opens a dataset folder, a recording, or a folder that has a recording and nothing else yet.
pub fn open(path: &Path, quiet: bool) -> Result<OpenedDataset, Failure> {
    match recording_of(path) {
        None => Ok(OpenedDataset { folder: path.to_owned(), unpacked: None, stamp_meaning: None }),
        Some(recording) => {
            let place = tempfile::tempdir().map_err(|error| {
                Failure::new(
                    format!("no folder to unpack {} into: {error}", recording.display()),
                    "is the disk full? `trueline import mcap FILE --out DIR` unpacks to where you say",
                )
            })?;
            let folder = place.path().join("dataset");
            let choice = Choice { sensor: sensor_of(&recording)?, ..Choice::default() };
            let unpacked = unpack(&recording, &choice, &folder)?;
            tell(&unpacked, quiet);
            if unpacked.frames == 0 && unpacked.features == 0 {
                return Err(Failure::new(
                    format!("{}: there are neither pictures nor seam points in it", recording.display()),
                    "record the camera as well: `trueline record --camera IP --sensor sensor.toml`",
                ));
            }
            let stamp_meaning = unpacked.stamp_meaning;
            Ok(OpenedDataset { folder, unpacked: Some((recording, place)), stamp_meaning })
        }
    }
}

/// Says what became of a recording. Damage is told even if all is to be quiet: data is missing because of it.
pub fn tell(unpacked: &trueline_mcap::Unpacked, quiet: bool) {
    for damaged in &unpacked.damages {
        output::words(&format!("warning: {damaged}"));
    }
    if !quiet {
        if let Some(meaning) = &unpacked.stamp_meaning {
            output::words(&format!("stamps: {meaning}"));
        }
        for note in &unpacked.notes {
            output::words(&format!("note: {note}"));
        }
    }
}

fn recording_of(path: &Path) -> Option<PathBuf> {
    if path.is_file() {
        return Some(path.to_owned());
    }
    let inside = path.join(RECORDING);
    if inside.exists() && !path.join("robot.csv").exists() {
        return Some(inside);
    }
    let is_bag = path.join("metadata.yaml").exists() && !path.join("robot.csv").exists();
    is_bag.then(|| path.to_owned())
}

/// The sensor that was laid into a bag's folder.
fn sensor_of(recording: &Path) -> Result<Option<SensorFile>, Failure> {
    let file = recording.join("sensor.toml");
    if !(recording.is_dir() && file.exists()) {
        return Ok(None);
    }
    Ok(Some(sensor_toml::parse_file(&file, &read_text(&file)?)?))
}

impl OpenedDataset {
    /// Its folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What its stamps mean, where the recording says so.
    pub fn stamp_meaning(&self) -> Option<&str> {
        self.stamp_meaning.as_deref()
    }

    /// Finds the features of a dataset that has pictures only, and keeps them in its folder.
    pub fn find_features(&self, joint: Option<Joint>, quiet: bool) -> Result<(), Failure> {
        if self.folder.join("features.csv").exists() || !images::index_of(&self.folder).exists() {
            return Ok(());
        }
        let options = PictureOptions { joint, overlay: None, threads: None, quiet };
        let scan = pictures::examine(&self.folder, &options)?;
        if !quiet {
            output::words(&pictures::summary(&scan));
        }
        let features = scan.features();
        if features.is_empty() {
            return Err(Failure::new(
                format!("there is no seam in any of {} pictures", scan.frames.len()),
                "`trueline features DATASET --overlay FOLDER` draws what is seen; --joint names the joint",
            ));
        }
        folder::replace_features(&self.folder, &features)?;
        if !quiet && self.unpacked.is_none() {
            output::words(&format!("written to {}\n", self.folder.join("features.csv").display()));
        }
        Ok(())
    }

    /// Reads it. What was read is the recording, if it came out of one.
    pub fn read(&self) -> Result<Recording, Failure> {
        let mut recording = folder::read(&self.folder)?;
        if let Some((file, _)) = self.unpacked.as_ref().filter(|(file, _)| file.is_file()) {
            let hash = File::open(file)
                .and_then(folder::sha256_of)
                .map_err(|error| Error::in_file(file, Problem::Io(error)))?;
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            recording.inputs = [(name, hash)].into();
        }
        Ok(recording)
    }
}

impl From<trueline_mcap::ImportError> for Failure {
    fn from(error: trueline_mcap::ImportError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}
