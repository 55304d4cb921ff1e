//! Messages while a scan is opened.

use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::path::Path;
use trueline_dataset::laser_channel::Channel;
use trueline_mcap::Imported;
use trueline_vision::profile::{NoSeam, ProfileJoint};
use trueline_vision::scan::{ScanObserver, ScanSeams};

/// Something worth knowing of a scan that is being opened.
#[derive(Debug)]
pub enum Told<'a> {
    /// Data is missing because a file is damaged.
    Damage(String),
    /// Kind of stamps of a recording.
    StampMeaning(&'a str),
    /// Remarks about recognised, sorted or ignored data.
    Note(&'a str),
    /// The channel used of colour pictures.
    Channel(Channel),
    /// Remarks about the pictures.
    SeamsInPictures(&'a ScanSeams),
    /// Findings in whole profiles.
    SeamsInProfiles {
        /// Profiles with a seam.
        found: usize,
        /// Profiles.
        of: usize,
        /// How many have none, by reason.
        without: &'a BTreeMap<NoSeam, usize>,
        /// The joint or edge searched for.
        joint: ProfileJoint,
    },
    /// Number of seam points found earlier in the same pictures.
    FoundBefore(usize),
    /// Findings in pictures could not be cached.
    NotKept(&'a io::Error),
    /// Seam points are where stripes cross.
    CrossingsOfStripes {
        /// How many seam points there were, too few.
        in_place_of: usize,
    },
    /// The sensor stands beside the robot.
    FixedSensor,
    /// All of the robot's positions lie within so few millimetres.
    SmallPath(f64),
    /// Number of scans used together.
    Together(usize),
    /// Several scans are one with an external axis of this name: their seams are those of one part, by their numbers.
    OnAnAxis(usize, &'a str),
    /// Both streams of a scan were shifted alike, to come after the scan before.
    Shifted(&'a Path),
}

impl fmt::Display for Told<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damage(text) => f.write_str(text),
            Self::StampMeaning(text) | Self::Note(text) => f.write_str(text),
            Self::Channel(channel) => {
                write!(
                    f,
                    "colour pictures: the channel {} is used, where the stripe is clearest",
                    channel.name()
                )
            }
            Self::SeamsInPictures(scan) => write!(f, "{scan}"),
            Self::SeamsInProfiles { found, of, without, joint } => {
                write!(f, "the seam ({}) in {found} of {of} profiles", joint.seam())?;
                without.iter().try_for_each(|(reason, count)| write!(f, "\n  {count} without: {reason}"))
            }
            Self::FoundBefore(count) => write!(f, "{count} seam points as found in the same pictures before"),
            Self::NotKept(error) => write!(f, "the seam points are not kept for the next time: {error}"),
            Self::CrossingsOfStripes { in_place_of: 0 } => {
                f.write_str("there are stripes and no seam points: where two stripes cross is one")
            }
            Self::CrossingsOfStripes { in_place_of } => write!(
                f,
                "{in_place_of} seam points are too few to calibrate by and are left out: where two stripes cross is one"
            ),
            Self::FixedSensor => f.write_str(
                "the sensor stands beside the robot: tool_from_camera is base_from_camera, and lines are in \
                 the tool's frame",
            ),
            Self::SmallPath(shift_mm) => write!(
                f,
                "all positions of the robot lie within {shift_mm:.2} mm: check whether they are metres in a \
                    column named mm"
            ),
            Self::OnAnAxis(count, axis) => {
                write!(
                    f,
                    "{count} scans together: line 0 is the same seam in each, because axis `{axis}` \
                    moved its part"
                )
            }
            Self::Together(count) => write!(f, "{count} scans together, each with its own lines"),
            Self::Shifted(path) => {
                write!(
                    f,
                    "both streams of {} are shifted alike, to come after the scan before",
                    path.display()
                )
            }
        }
    }
}

/// Receives messages while a scan is opened. Every method does nothing unless it is written.
pub trait OpenObserver: Sync {
    /// Something worth knowing.
    fn told(&self, _told: &Told<'_>) {}

    /// Called while pictures are examined.
    fn of_pictures(&self) -> &dyn ScanObserver {
        &()
    }
}

/// No observer.
impl OpenObserver for () {}

/// Reports the import of a recording in MCAP or rosbag2.
pub fn told_of_import(imported: &Imported, observer: &dyn OpenObserver) {
    for damaged in &imported.damages {
        observer.told(&Told::Damage(damaged.to_string()));
    }
    if let Some(meaning) = &imported.stamp_meaning {
        observer.told(&Told::StampMeaning(meaning));
    }
    for note in &imported.notes {
        observer.told(&Told::Note(note));
    }
}
