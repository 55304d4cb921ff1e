//! From a recording to the input of a calibration.
//!
//! Stamps of a recording of trueline are those of its steady clock, with the senders' own as well. In foreign recordings
//! they are those in the messages' headers, which the drivers set. The time of recording is when a program got round to it,
//! and is not used.

use crate::import::axes::AxisJoints;
use crate::import::choice::{Choice, StampClock};
use crate::import::chosen::{Chain, Chosen, RobotSource};
use crate::import::collect::Collector;
use crate::import::common_clock;
use crate::import::frame_stamps::recorded_frames;
use crate::import::in_order::{late_note, not_stamped, repetitions, sort};
use crate::import::recorded_pictures::RecordedPictures;
use crate::import::recorded_profiles::{self, RecordedProfiles};
use crate::import::stored_picture::RecordedFrame;
use crate::import::transform_chain::compose;
use crate::import_error::ImportError;
use crate::message::content::PictureOrigin;
use crate::read::bag::Bag;
use crate::read::damage::DamagedFile;
use crate::read::survey::{self, Survey};
use crate::write::entry::{COMPLETE, InputsEntry};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use trueline_dataset::{
    Feature, Measured, Profile, Recording, RobotSample, Sensor, SensorFile, folder, no_return, sensor_toml,
    written_form,
};

/// A recording read from any form.
#[derive(Debug)]
pub struct Imported {
    /// Poses, seam points and the sensor, with all the digits that were recorded.
    pub recording: Recording,
    /// The text of `sensor.toml`, if the recording contains it.
    pub sensor_toml: Option<String>,
    /// The pictures, which stay in the recording until requested; `None` if there are none.
    pub pictures: Option<RecordedPictures>,
    /// Whole profiles, in place of seam points.
    pub profiles: Vec<Profile>,
    /// Changes of the robot's digital inputs, as they came.
    pub inputs: Vec<InputsEntry>,
    /// Exposure time of the pictures as reported by the camera, s; the median of several.
    pub exposure_s: Option<f64>,
    /// Meaning of its stamps, in the words of the recording, if it states one.
    pub stamp_meaning: Option<String>,
    /// Remarks: sorted, interpolated or ignored data.
    pub notes: Vec<String>,
    /// Damaged parts of the recording.
    pub damages: Vec<DamagedFile>,
}

/// Reads a recording: an .mcap file, a folder of rosbag2, a .db3 or .db3.zstd file.
///
/// # Errors
/// A recording that cannot be opened, in which more than one thing could be meant, or in which a message that is needed
/// cannot be used.
pub fn import(path: &Path, choice: &Choice) -> Result<Imported, ImportError> {
    Ok(imported(path, choice, true)?.0)
}

/// The same without whole profiles, which stay in the recording until they are needed; `None` if there are none.
///
/// # Errors
/// As [`import`].
pub fn import_without_profiles(
    path: &Path,
    choice: &Choice,
) -> Result<(Imported, Option<RecordedProfiles>), ImportError> {
    imported(path, choice, false)
}

fn imported(
    path: &Path,
    choice: &Choice,
    keeps_profiles: bool,
) -> Result<(Imported, Option<RecordedProfiles>), ImportError> {
    let bag = Bag::open(path)?;
    let survey = survey::of(&bag)?;
    let chosen = Chosen::of(&survey, choice)?;
    let mut notes = Vec::new();
    let (sensor, sensor_toml) = sensor(path, &survey, choice, chosen.profiles.is_some(), &mut notes)?;
    let mut collected = Collector::new(&chosen, survey.is_own, choice, keeps_profiles);
    let damages = bag.read(&mut |item| collected.add(item))?;

    let left = chosen.profiles.clone().filter(|_| !keeps_profiles);
    let exposure_s = exposure_s(&collected);
    let mut frames = frames(&mut collected, &chosen, survey.is_own, &mut notes)?;
    let mut features = features(&mut collected, &sensor.sensor, &mut notes)?;
    let mut robot = robot(&mut collected, &chosen, &mut notes)?;
    if choice.clock == StampClock::Ptp {
        common_clock::refuse_profiles(collected.profiles.len() + usize::from(left.is_some()))?;
        common_clock::stamp(&mut robot, &mut frames, &mut features, &collected.ptp_ns)?;
        collected.axes.stamp(&collected.ptp_ns)?;
        notes.push("stamps are IEEE 1588 times of controller and camera".to_owned());
    }
    notes.extend(collected.origins.iter().filter_map(|(origin, count)| origin_note(*origin, *count)));
    let profiles = profiles(&mut collected, &chosen, (&sensor.sensor, choice), &mut notes)?;
    if left.is_some() && sensor.sensor != Sensor::Profiler {
        return Err(ImportError::OtherSensor { sensor: sensor.sensor.kind() });
    }
    if frames.is_empty() && features.is_empty() && profiles.is_empty() && left.is_none() {
        notes.push("the recording has neither pictures nor profiles nor seam points".to_owned());
    }
    let SensorFile { sensor, setup } = sensor;
    let axes = std::mem::replace(&mut collected.axes, AxisJoints::new(&[]));
    let axes = axes.records(survey.is_own, &mut notes)?;
    let recording =
        Recording { inputs: hashes(&bag)?, axes, ..Recording::new(sensor, setup, robot, features) };
    let stamp_meaning = survey.about.get("stamp_meaning").filter(|words| !words.is_empty()).cloned();
    let types = std::mem::take(&mut collected.picture_types);
    let inputs = std::mem::take(&mut collected.inputs);
    let (pictures, left) = match left {
        Some(topic) => (
            None,
            Some(RecordedProfiles { bag, topic, is_own: survey.is_own, no_return_m: choice.no_return_m }),
        ),
        None if frames.is_empty() => (None, None),
        None => {
            let topic = chosen.pictures.unwrap_or_default();
            (Some(RecordedPictures::new(bag, topic, types, frames)), None)
        }
    };
    let imported = Imported {
        recording,
        sensor_toml,
        pictures,
        profiles,
        inputs,
        exposure_s,
        stamp_meaning,
        notes,
        damages,
    };
    Ok((imported, left))
}

fn exposure_s(collected: &Collector<'_>) -> Option<f64> {
    let mut told_us: Vec<f64> = collected.frames.iter().filter_map(|frame| frame.exposure_us).collect();
    told_us.sort_by(f64::total_cmp);
    told_us.get(told_us.len() / 2).map(|us| us * 1e-6)
}

impl Imported {
    /// The recording with the numbers that the written dataset folder would give. A calibration from either is then the
    /// same to the last digit.
    ///
    /// # Errors
    /// A sensor that cannot be written.
    pub fn in_written_form(&self) -> Result<Recording, ImportError> {
        Ok(written_form::of(self.recording.clone(), self.sensor_toml.is_some())?)
    }
}

/// SHA-256 of every file, by name.
fn hashes(bag: &Bag) -> Result<BTreeMap<String, String>, ImportError> {
    let hash = |file: &Path| {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let hash = File::open(file).and_then(folder::sha256_of);
        Ok((name, hash.map_err(|error| ImportError::io(file, &error))?))
    };
    bag.files().map(hash).collect()
}

/// The sensor, and its text if the recording contains it.
fn sensor(
    path: &Path,
    survey: &Survey,
    choice: &Choice,
    has_profiles: bool,
    notes: &mut Vec<String>,
) -> Result<(SensorFile, Option<String>), ImportError> {
    match (&choice.sensor, &survey.sensor_toml) {
        (Some(sensor), recorded) => {
            if recorded.is_some() {
                notes.push("the recorded sensor was left aside for the given one".to_owned());
            }
            Ok((sensor.clone(), None))
        }
        (None, Some(text)) => {
            Ok((sensor_toml::parse_file(&path.join("sensor.toml"), text)?, Some(text.clone())))
        }
        (None, None) if has_profiles => {
            notes.push("no sensor.toml: profiles need a profiler".to_owned());
            Ok((Sensor::Profiler.into(), None))
        }
        (None, None) => Err(ImportError::NoSensor),
    }
}

fn robot(
    collected: &mut Collector<'_>,
    chosen: &Chosen,
    notes: &mut Vec<String>,
) -> Result<Vec<RobotSample>, ImportError> {
    const WHAT: &str = "robot poses";
    let mut robot = std::mem::take(&mut collected.robot);
    let topic = match &chosen.robot {
        RobotSource::Chain(chain) => {
            robot = composed(chain, collected, notes)?;
            format!("{} → {}", chain.base, chain.tool)
        }
        RobotSource::Poses { topic, .. } => topic.clone(),
        RobotSource::Joints { topic, arm } => {
            notes.push(format!(
                "{} robot poses are those of `{}` in `{}` by the URDF",
                robot.len(),
                arm.tool,
                arm.base
            ));
            if collected.of_other_joints > 0 {
                notes.push(format!(
                    "{} messages are of other joints and were left out",
                    collected.of_other_joints
                ));
            }
            topic.clone()
        }
        RobotSource::Own => {
            notes.extend(sort(&mut robot, |s| s.stamp_ns, WHAT));
            notes.extend(repetitions(&robot, |s| s.stamp_ns, WHAT));
            return Ok(robot);
        }
    };
    if not_stamped(robot.iter().map(|s| s.stamp_ns)) {
        return Err(ImportError::NotStamped { topic });
    }
    notes.extend(sort(&mut robot, |s| s.stamp_ns, WHAT));
    notes.extend(repetitions(&robot, |s| s.stamp_ns, WHAT));
    Ok(robot)
}

fn composed(
    chain: &Chain,
    collected: &mut Collector<'_>,
    notes: &mut Vec<String>,
) -> Result<Vec<RobotSample>, ImportError> {
    let (base, tool) = (chain.base.clone(), chain.tool.clone());
    let transforms = std::mem::take(&mut collected.transforms);
    for (step, samples) in chain.steps.iter().zip(&transforms) {
        if !step.is_static && not_stamped(samples.iter().map(|(stamp, _)| *stamp)) {
            return Err(ImportError::NotStamped { topic: format!("{} → {}", step.parent, step.child) });
        }
    }
    let Some(composed) = compose(&chain.steps, transforms)? else {
        return Err(ImportError::NothingMoves { base, tool });
    };
    if composed.poses.is_empty() {
        return Err(ImportError::NeverTogether { base, tool });
    }
    let count = composed.poses.len();
    let told = [
        (composed.left_out, "stamps were left out, because a transform is missing there"),
        (composed.interpolated, "poses have a transform that was interpolated between its own stamps"),
        (composed.repeated, "transforms repeated a stamp; of those the last one counts"),
    ];
    notes.push(format!("{count} robot poses were composed of {} transforms", chain.steps.len()));
    notes.extend(late_note(composed.late, "transforms"));
    notes.extend(told.iter().filter(|(n, _)| *n > 0).map(|(n, words)| format!("{n} {words}")));
    let sample = |(stamp_ns, base_from_tool)| RobotSample { stamp_ns, device_ns: None, base_from_tool };
    Ok(composed.poses.into_iter().map(sample).collect())
}

fn frames(
    collected: &mut Collector<'_>,
    chosen: &Chosen,
    is_own: bool,
    notes: &mut Vec<String>,
) -> Result<Vec<RecordedFrame>, ImportError> {
    let pictures = std::mem::take(&mut collected.pictures);
    if !is_own && not_stamped(pictures.iter().map(|picture| picture.stamp_ns)) {
        return Err(ImportError::NotStamped { topic: chosen.pictures.clone().unwrap_or_default() });
    }
    let mut stamps = is_own.then(|| std::mem::take(&mut collected.frames));
    if chosen.profiles.is_some() {
        // A frame of profiles has no picture. Only incomplete frames are reported.
        stamps.iter_mut().for_each(|stamps| stamps.retain(|frame| frame.status != COMPLETE));
    }
    let (frames, told) = recorded_frames(pictures, stamps);
    notes.extend(told);
    Ok(frames)
}

/// Remark about pictures that were not gray.
fn origin_note(origin: PictureOrigin, count: usize) -> Option<String> {
    let words = match origin {
        PictureOrigin::Gray => return None,
        PictureOrigin::Colour => "pictures are in colour: their luma is used",
        PictureOrigin::Mosaic => "pictures are a mosaic of colours: the mean about each pixel is used",
        PictureOrigin::Jpeg => "pictures are JPEG, which moves edges by fractions of a pixel",
    };
    Some(format!("{count} {words}"))
}

fn profiles(
    collected: &mut Collector<'_>,
    chosen: &Chosen,
    (sensor, choice): (&Sensor, &Choice),
    notes: &mut Vec<String>,
) -> Result<Vec<Profile>, ImportError> {
    let mut profiles = std::mem::take(&mut collected.profiles);
    if profiles.is_empty() {
        return Ok(Vec::new());
    }
    if *sensor != Sensor::Profiler {
        return Err(ImportError::OtherSensor { sensor: sensor.kind() });
    }
    if not_stamped(profiles.iter().map(|profile| profile.stamp_ns)) {
        return Err(ImportError::NotStamped { topic: chosen.profiles.clone().unwrap_or_default() });
    }
    notes.extend(sort(&mut profiles, |profile| profile.stamp_ns, "profiles"));
    let no_return: usize = profiles.iter().map(|profile| profile.no_return).sum();
    let points: usize = profiles.iter().map(|profile| profile.points.len()).sum();
    notes.extend(recorded_profiles::no_return_note(no_return, points));
    let numbered = profiles.into_iter().zip(0..);
    let numbered = numbered.map(|(profile, frame)| recorded_profiles::of_message(profile, frame));
    let mut profiles: Vec<Profile> = numbered.collect();
    if let Some(range_m) = choice.no_return_m {
        let taken = no_return::take_out(&mut profiles, range_m);
        notes.push(format!("{taken} points of the profiles have no return, as you stated it"));
    }
    let origins = no_return::take_out_origins(&mut profiles);
    notes.extend(origins.map(|said| format!("profiles: {said}")));
    // As for a dataset's profiles: a recording and its import give the same calibration, or the same refusal.
    no_return::check(&profiles).map_err(|problem| ImportError::Profiles {
        topic: chosen.profiles.clone().unwrap_or_default(),
        problem,
    })?;
    Ok(profiles)
}

fn features(
    collected: &mut Collector<'_>,
    sensor: &Sensor,
    notes: &mut Vec<String>,
) -> Result<Vec<Feature>, ImportError> {
    let mut features = std::mem::take(&mut collected.features);
    let fits = |feature: &Feature| {
        matches!(
            (sensor, feature.measured),
            (Sensor::CameraLaser { .. }, Measured::Pixel(_))
                | (Sensor::Profiler, Measured::Profile(_))
                | (Sensor::Points { .. }, Measured::Point(_))
        )
    };
    if !features.iter().all(fits) {
        return Err(ImportError::OtherSensor { sensor: sensor.kind() });
    }
    notes.extend(sort(&mut features, |feature| feature.stamp_ns, "seam points"));
    Ok(features)
}
