//! A scan with points to be placed: its seam need not be found.

use crate::open::error::OpenError;
use crate::open::observer::{OpenObserver, Told, told_of_import};
use crate::open::opened::{How, open, sensor_beside};
use crate::open::place::{self, Place};
use std::ops::ControlFlow;
use std::path::Path;
use trueline_dataset::folder_profiles::FolderProfiles;
use trueline_dataset::profile_stream::EachProfile;
use trueline_dataset::{Profile, ProfilesRead, Recording, folder};
use trueline_mcap::{Choice, RecordedProfiles, import_without_profiles};

/// Points measured by a scan.
#[derive(Debug)]
pub struct Measurements {
    /// The recording; without seam points if there are whole profiles.
    pub recording: Recording,
    profiles: Option<Profiles>,
}

/// Whole profiles, which stay in their file.
#[derive(Debug)]
enum Profiles {
    Folder(FolderProfiles),
    Recorded(RecordedProfiles),
}

impl Measurements {
    /// Whether there are whole profiles; otherwise there are seam points and stripes alone.
    #[must_use]
    pub fn has_profiles(&self) -> bool {
        self.profiles.is_some()
    }

    /// Reads the whole profiles, and hands each over in the order of the file. In memory is a piece of the file at a time.
    /// Points at (0, 0) are left out unless they are to stay.
    ///
    /// # Errors
    /// A file that cannot be used; what is wrong with all profiles together is found at the end.
    pub fn each_profile(
        &self,
        takes_out_origins: bool,
        each: &mut EachProfile<'_>,
    ) -> Result<ProfilesRead, OpenError> {
        match &self.profiles {
            None => Ok(ProfilesRead::default()),
            Some(Profiles::Folder(profiles)) => Ok(profiles.each(takes_out_origins, each)?),
            Some(Profiles::Recorded(profiles)) => Ok(profiles.each(takes_out_origins, each)?),
        }
    }

    /// All whole profiles, by their stamps; empty if there are none.
    ///
    /// # Errors
    /// A file that cannot be used.
    pub fn profiles(&self) -> Result<Vec<Profile>, OpenError> {
        let mut all = Vec::new();
        let mut read = |takes_out_origins: bool| {
            all.clear();
            self.each_profile(takes_out_origins, &mut |profile| {
                all.push(profile);
                ControlFlow::Continue(())
            })
        };
        if read(true)?.origins_are_measured {
            read(false)?;
        }
        all.sort_by_key(|profile| profile.stamp_ns);
        Ok(all)
    }
}

/// Opens a scan whose points are to be placed: its whole profiles or, without these, its seam points and stripes.
///
/// # Errors
/// As [`open`], and a recording with neither.
pub fn open_measurements(
    path: &Path,
    how: &How,
    observer: &dyn OpenObserver,
) -> Result<Measurements, OpenError> {
    match place::of(path)? {
        Place::Folder => {
            // Features beside whole profiles contain less than these.
            if let Some(profiles) = FolderProfiles::of(path)? {
                let content = folder::read_without_profiles(path)?;
                content.notes.iter().for_each(|note| observer.told(&Told::Note(note)));
                let profiles = Some(Profiles::Folder(profiles));
                return Ok(Measurements { recording: content.recording, profiles });
            }
        }
        Place::Recording(file) => {
            let choice = Choice { sensor: sensor_beside(&file)?, ..Choice::default() };
            if let (imported, Some(profiles)) = import_without_profiles(&file, &choice)? {
                told_of_import(&imported, observer);
                let recording = imported.in_written_form()?;
                folder::refuse_what_is_not_applied(&file, &recording.setup)?;
                let profiles = Some(Profiles::Recorded(profiles));
                return Ok(Measurements { recording, profiles });
            }
        }
    }
    Ok(Measurements { recording: open(path, how, observer)?.recording, profiles: None })
}
