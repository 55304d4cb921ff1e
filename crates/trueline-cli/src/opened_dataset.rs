//! Where a scan is read from: a dataset folder, a recording, or a folder that has a recording and nothing else yet.

use crate::failure::Failure;
use crate::found_before;
use crate::output;
use crate::pictures::{self, PictureOptions};
use std::path::{Path, PathBuf};
use trueline_cell::RECORDING;
use trueline_dataset::folder::FolderContent;
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::{
    FoundSeams, PictureFolder, PictureSource, Profile, Recording, SensorFile, folder, images, join,
    sensor_toml,
};
use trueline_mcap::{Choice, Imported, import};
use trueline_method::stripe::corners::with_corners;
use trueline_vision::Joint;
use trueline_vision::profile;
use trueline_vision::scan::ScanSeams;

/// A scan with its features, and its pictures where it has some.
pub struct OpenedDataset {
    /// What calibration takes.
    pub recording: Recording,
    /// Its pictures.
    pub pictures: Option<Box<dyn PictureSource>>,
    /// What its stamps mean, where the recording says so.
    pub stamp_meaning: Option<String>,
}

/// Reads a scan; where there are pictures and no features, the seam is looked for in the pictures.
///
/// # Errors
/// Whatever cannot be read, and pictures without a seam.
pub fn open(path: &Path, joint: Option<Joint>, quiet: bool) -> Result<OpenedDataset, Failure> {
    check(path)?;
    let mut opened = match recording_of(path) {
        Some(recording) => open_recording(&recording, joint, quiet),
        None => open_folder(path, joint, quiet),
    }?;
    if let Some(cornered) = with_corners(&opened.recording) {
        if !quiet {
            output::words("note: there are stripes and no seam points: where two stripes cross is one");
        }
        opened.recording = cornered;
    }
    Ok(opened)
}

/// Reads several scans of one sensor as one.
///
/// # Errors
/// As [`open`], and scans of different sensors.
pub fn open_all(paths: &[PathBuf], joint: Option<Joint>, quiet: bool) -> Result<OpenedDataset, Failure> {
    let mut opened =
        paths.iter().map(|path| open(path, joint, quiet)).collect::<Result<Vec<OpenedDataset>, Failure>>()?;
    let fixed = opened.iter().any(|scan| scan.recording.setup.mounted == Mounted::Fixed);
    if fixed && !quiet {
        output::words(
            "note: the sensor stands beside the robot: what is called tool_from_camera is base_from_camera, and lines are in the tool's frame",
        );
    }
    if opened.len() == 1 {
        return Ok(opened.remove(0));
    }
    let stamp_meaning = opened.iter().find_map(|scan| scan.stamp_meaning.clone());
    let joined = join::join(opened.into_iter().map(|scan| scan.recording).collect()).map_err(|error| {
        Failure::new(error.to_string(), "scans of different sensors, or set-ups, are calibrated one by one")
    })?;
    if !quiet {
        output::words(&format!("note: {} scans together, each with its own lines", paths.len()));
        for index in joined.shifted {
            output::words(&format!(
                "note: both streams of {} are shifted alike, to come after the scan before",
                paths[index].display()
            ));
        }
    }
    Ok(OpenedDataset { recording: joined.recording, pictures: None, stamp_meaning })
}

/// The two mistakes that are made most: a name that is mistyped, and a file instead of its folder.
fn check(path: &Path) -> Result<(), Failure> {
    if !path.exists() {
        return Err(Failure::new(
            format!("there is no file or folder `{}`", path.display()),
            "give a dataset folder, a recording.mcap or a rosbag2 folder",
        ));
    }
    let of_dataset = path.is_file() && path.extension().is_some_and(|end| end == "csv" || end == "toml");
    if of_dataset {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        return Err(Failure::new(
            format!("{}: is a file of a dataset", path.display()),
            format!("give its folder: `{}`", folder.display()),
        ));
    }
    Ok(())
}

fn open_folder(path: &Path, joint: Option<Joint>, quiet: bool) -> Result<OpenedDataset, Failure> {
    let pictures = if images::index_of(path).exists() { Some(PictureFolder::open(path)?) } else { None };
    let has_features = path.join("features.csv").exists();
    if let (Some(pictures), false) = (&pictures, has_features) {
        return open_pictures(path, pictures.clone(), joint, quiet);
    }
    if let (true, Some(joint)) = (has_features, joint) {
        return Err(Failure::new(
            format!(
                "{}: its seam is known already, and --joint {} would change nothing",
                path.join("features.csv").display(),
                joint.name()
            ),
            format!(
                "leave --joint out, or look again: `trueline features {} --joint {}`",
                path.display(),
                joint.name()
            ),
        ));
    }
    let FolderContent { mut recording, profiles, notes } = folder::read_content(path)?;
    if !quiet {
        for note in &notes {
            output::words(&format!("note: {note}"));
        }
    }
    if !profiles.is_empty() {
        let found = seams_of_profiles(&profiles, quiet)?;
        (recording.features, recording.stripes) = (found.features, found.stripes);
    }
    let pictures = pictures.map(|pictures| Box::new(pictures) as Box<dyn PictureSource>);
    Ok(OpenedDataset { recording, pictures, stamp_meaning: None })
}

/// A folder of pictures whose seam has not been looked for: nothing is written into it.
fn open_pictures(
    path: &Path,
    pictures: PictureFolder,
    joint: Option<Joint>,
    quiet: bool,
) -> Result<OpenedDataset, Failure> {
    let sensor = folder::read_sensor_file(path)?;
    let (found, key) = found_before::seams(path, &pictures, &sensor.sensor, joint, quiet, || {
        Ok(find_seams(&pictures, &sensor, path, &options(joint, quiet))?.found())
    })?;
    pictures::tell_channel(&pictures, quiet);
    let mut recording = folder::read_with_features(path, found)?;
    recording.inputs.insert("images".to_owned(), key);
    Ok(OpenedDataset { recording, pictures: Some(Box::new(pictures)), stamp_meaning: None })
}

fn open_recording(file: &Path, joint: Option<Joint>, quiet: bool) -> Result<OpenedDataset, Failure> {
    let choice = Choice { sensor: sensor_of(file)?, ..Choice::default() };
    let imported = import(file, &choice)?;
    tell(&imported, quiet);
    let mut recording = imported.in_written_form()?;
    folder::refuse_what_is_not_applied(file, &recording.setup)?;
    if recording.features.is_empty() && !imported.profiles.is_empty() {
        let found = seams_of_profiles(&imported.profiles, quiet)?;
        (recording.features, recording.stripes) = (found.features, found.stripes);
    }
    let Imported { pictures, stamp_meaning, .. } = imported;
    if recording.features.is_empty() {
        let Some(pictures) = &pictures else {
            return Err(Failure::new(
                format!("{}: there are neither pictures nor seam points in it", file.display()),
                "record the camera as well: `trueline record --camera IP --sensor sensor.toml`",
            ));
        };
        let sensor = SensorFile { sensor: recording.sensor.clone(), setup: recording.setup.clone() };
        let found = find_seams(pictures, &sensor, file, &options(joint, quiet))?.found();
        (recording.features, recording.stripes) = (found.features, found.stripes);
    }
    let pictures = pictures.map(|pictures| Box::new(pictures) as Box<dyn PictureSource>);
    Ok(OpenedDataset { recording, pictures, stamp_meaning })
}

fn options(joint: Option<Joint>, quiet: bool) -> PictureOptions {
    PictureOptions { joint, quiet, ..PictureOptions::default() }
}

fn find_seams(
    pictures: &dyn PictureSource,
    sensor: &SensorFile,
    name: &Path,
    options: &PictureOptions,
) -> Result<ScanSeams, Failure> {
    let scan = pictures::examine_source(pictures, sensor, name, options)?;
    if !options.quiet {
        output::words(&scan.to_string());
    }
    if scan.detections().next().is_none() {
        return Err(Failure::new(
            format!("there is no seam in any of {} pictures", scan.frames.len()),
            "`trueline features DATASET --overlay FOLDER` draws what is seen; --joint names the joint",
        ));
    }
    Ok(scan)
}

/// Says what became of a recording. Damage is told even if all is to be quiet: data is missing because of it.
pub fn tell(imported: &Imported, quiet: bool) {
    for damaged in &imported.damages {
        output::words(&format!("warning: {damaged}"));
    }
    if !quiet {
        if let Some(meaning) = &imported.stamp_meaning {
            output::words(&format!("stamps: {meaning}"));
        }
        for note in &imported.notes {
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
    Ok(Some(sensor_toml::read(&file)?))
}

/// The seams of profiles, with what was found in words.
pub fn seams_of_profiles(profiles: &[Profile], quiet: bool) -> Result<FoundSeams, Failure> {
    let seams = profile::seams(profiles);
    if !quiet {
        output::words(&format!("the seam in {} of {} profiles", seams.found.features.len(), profiles.len()));
        for (reason, count) in &seams.not_found {
            output::words(&format!("  {count} without: {reason}"));
        }
    }
    if seams.found.features.is_empty() {
        return Err(Failure::new(
            format!("there is no corner in any of {} profiles", profiles.len()),
            "two straight faces that meet at an angle are looked for: a fillet, or an inner or outer edge",
        ));
    }
    Ok(seams.found)
}

impl From<trueline_mcap::ImportError> for Failure {
    fn from(error: trueline_mcap::ImportError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}
