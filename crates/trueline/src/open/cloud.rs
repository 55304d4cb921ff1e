//! A scan with points to be placed: its seam need not be found.

use crate::open::error::OpenError;
use crate::open::observer::{OpenObserver, Told, told_of_import};
use crate::open::opened::{How, open, sensor_beside};
use crate::open::place::{self, Place};
use std::path::Path;
use trueline_dataset::{Profile, Recording, folder};
use trueline_mcap::{Choice, import};

/// Points measured by a scan.
#[derive(Debug)]
pub struct Measurements {
    /// The recording; without seam points if there are whole profiles.
    pub recording: Recording,
    /// Whole profiles; empty if there are seam points and stripes alone.
    pub profiles: Vec<Profile>,
}

/// Reads a scan's whole profiles or, without these, its seam points and stripes.
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
            let profiles = folder::read_profiles(path)?.unwrap_or_default();
            if !profiles.is_empty() {
                let content = folder::read_content(path)?;
                content.notes.iter().for_each(|note| observer.told(&Told::Note(note)));
                return Ok(Measurements { recording: content.recording, profiles });
            }
        }
        Place::Recording(file) => {
            let choice = Choice { sensor: sensor_beside(&file)?, ..Choice::default() };
            let imported = import(&file, &choice)?;
            if !imported.profiles.is_empty() {
                told_of_import(&imported, observer);
                let recording = imported.in_written_form()?;
                folder::refuse_what_is_not_applied(&file, &recording.setup)?;
                return Ok(Measurements { recording, profiles: imported.profiles });
            }
        }
    }
    Ok(Measurements { recording: open(path, how, observer)?.recording, profiles: Vec::new() })
}
