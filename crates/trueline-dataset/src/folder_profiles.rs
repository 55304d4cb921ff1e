//! Whole profiles of a dataset folder, which stay in their file until they are needed.

use crate::encoder_log::EncoderFile;
use crate::error::Error;
use crate::folder::{check_is_profiler, read_sensor};
use crate::profile::Profile;
use crate::profile_file::{ProfileFile, ProfilesRead};
use crate::profile_stream::EachProfile;
use crate::several_sensors::robot_folder;
use crate::stop_poses::{Pairing, StopPoses};
use std::collections::BTreeMap;
use std::path::Path;

/// Reads the profiles of a dataset folder alone, features or not; `None` if it has none.
///
/// # Errors
/// An unusable file, or a sensor that is not a profiler.
pub fn read(folder: &Path) -> Result<Option<Vec<Profile>>, Error> {
    FolderProfiles::of(folder)?.map(|profiles| profiles.read()).transpose()
}

/// The profiles of a folder.
#[derive(Debug)]
pub struct FolderProfiles {
    file: ProfileFile,
    stops: Option<StopPoses>,
    encoder: Option<EncoderFile>,
}

impl FolderProfiles {
    /// Those of a folder; `None` if it has none.
    ///
    /// # Errors
    /// Two files of profiles, an unusable one, or a sensor that is not a profiler.
    pub fn of(folder: &Path) -> Result<Option<Self>, Error> {
        let Some(file) = ProfileFile::of(folder)? else { return Ok(None) };
        check_is_profiler(&folder.join("sensor.toml"), &read_sensor(folder)?)?;
        let encoder = EncoderFile::of(robot_folder(folder));
        Ok(Some(Self { file, stops: StopPoses::of(folder)?, encoder }))
    }

    fn pairing(&self) -> Pairing<'_> {
        Pairing { stops: self.stops.as_ref(), encoder: self.encoder.as_ref() }
    }

    /// All of them.
    ///
    /// # Errors
    /// Unusable content.
    fn read(&self) -> Result<Vec<Profile>, Error> {
        self.file.read(&mut Vec::new(), self.pairing())
    }

    /// Hands them over in the order of the file. Points at (0, 0) are left out unless they are to stay.
    ///
    /// # Errors
    /// Unusable content. What is wrong with all profiles together is found at the end.
    pub fn each(&self, takes_out_origins: bool, each: &mut EachProfile<'_>) -> Result<ProfilesRead, Error> {
        let mut read = self.file.each(self.pairing(), takes_out_origins, each)?;
        read.notes.extend(self.encoder.as_ref().and_then(|file| file.noted(&mut BTreeMap::new())));
        Ok(read)
    }
}
