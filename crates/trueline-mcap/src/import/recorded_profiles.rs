//! Whole profiles of a recording, which stay in it until they are needed.

use crate::import::collect::{decoded, stamped};
use crate::import_error::ImportError;
use crate::message::content::{Content, Kind, StampedProfile};
use crate::message::decode::kind;
use crate::read::bag::Bag;
use crate::read::bag_item::BagItem;
use std::io::{Error, ErrorKind};
use std::path::Path;
use trueline_dataset::no_return::{self, NoReturns};
use trueline_dataset::profile_stream::EachProfile;
use trueline_dataset::{Profile, ProfilePoint, ProfilesRead};

/// The profiles of a recording.
pub struct RecordedProfiles {
    pub(super) bag: Bag,
    pub(super) topic: String,
    pub(super) is_own: bool,
    /// Range that means no return by the user's word, m.
    pub(super) no_return_m: Option<f64>,
}

impl std::fmt::Debug for RecordedProfiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "profiles of {}", self.topic)
    }
}

impl RecordedProfiles {
    /// Hands them over in the order of the recording. Points at (0, 0) are left out unless they are to stay.
    ///
    /// # Errors
    /// A message that cannot be decoded, an error of the operating system; at the end what is wrong with all profiles
    /// together.
    pub fn each(
        &self,
        takes_out_origins: bool,
        each: &mut EachProfile<'_>,
    ) -> Result<ProfilesRead, ImportError> {
        let (mut seen, mut number, mut is_stamped, mut is_ended) =
            (NoReturns::default(), 0_u64, false, false);
        let (mut no_return, mut points, mut taken) = (0, 0, 0);
        let read = self.bag.read(&mut |item| {
            let BagItem::Message(message) = item else { return Ok(()) };
            if message.topic != self.topic || kind(message.schema, message.encoding) != Kind::Profile {
                return Ok(());
            }
            number += 1;
            let Content::Profile(profile) = decoded(&message, number, self.is_own, false)? else {
                return Ok(());
            };
            let profile = stamped(&message, self.is_own, profile);
            is_stamped |= profile.stamp_ns != 0;
            no_return += profile.no_return;
            points += profile.points.len();
            let mut profile = of_message(profile, number - 1);
            if let Some(range_m) = self.no_return_m {
                taken += no_return::take_out(std::slice::from_mut(&mut profile), range_m);
            }
            seen.look(&mut profile, takes_out_origins);
            if each(profile).is_break() {
                is_ended = true;
                return Err(ImportError::io(Path::new(&self.topic), &Error::from(ErrorKind::Interrupted)));
            }
            Ok(())
        });
        if is_ended {
            return Ok(ProfilesRead::default());
        }
        // Damage was found when the recording was opened.
        let _damages = read?;
        if number > 1 && !is_stamped {
            return Err(ImportError::NotStamped { topic: self.topic.clone() });
        }
        let origins_are_measured = takes_out_origins && seen.origins_are_measured();
        if !origins_are_measured {
            seen.check().map_err(|problem| ImportError::Profiles { topic: self.topic.clone(), problem })?;
        }
        let stated = (self.no_return_m.is_some())
            .then(|| format!("{taken} points of the profiles have no return, as you stated it"));
        let origins = seen.origins().map(|said| format!("profiles: {said}"));
        let notes = no_return_note(no_return, points).into_iter().chain(stated).chain(origins);
        Ok(ProfilesRead { notes: notes.collect(), origins_are_measured })
    }
}

/// A profile of a message; `number` is its frame if the message has none.
pub(super) fn of_message(profile: StampedProfile, number: u64) -> Profile {
    let point = |[x_m, z_m]: [f64; 2]| ProfilePoint { x_m, z_m, intensity: None };
    Profile {
        stamp_ns: profile.stamp_ns,
        frame: Some(profile.frame.unwrap_or(number)),
        points: profile.points.into_iter().map(point).collect(),
    }
}

/// Remark on columns without a return.
pub(super) fn no_return_note(no_return: usize, points: usize) -> Option<String> {
    (no_return > 0).then(|| {
        format!(
            "{no_return} of {} columns of the profiles have no return and were left out",
            no_return + points
        )
    })
}
