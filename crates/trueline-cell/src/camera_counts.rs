//! Counts of a camera's pictures so far.

use std::fmt;
use trueline_dataset::FrameSignals;

/// Counts of a camera's pictures so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CameraCounts {
    /// Frames that came, whole or not.
    pub frames: u64,
    /// Pictures that are incomplete or differ from the agreed format.
    pub unusable: u64,
    /// Numbers of the camera's counter that never came.
    pub missing: u64,
    /// Whole pictures or profiles in which a seam was found.
    pub seams: u64,
    /// Profiles of a profiler; a frame may hold several.
    pub profiles: u64,
    /// Columns of profiles without a return, which are left out.
    pub no_return: u64,
    /// Columns of profiles.
    pub columns: u64,
    /// Number of settings of the camera's clock.
    pub clock_set: u64,
    /// How often it went away; it was waited for and taken up again.
    pub interruptions: u64,
    /// It waits for a signal before each picture.
    pub is_triggered: bool,
    /// State of its inputs with the last picture.
    pub signals: FrameSignals,
}

/// A larger share of lost pictures makes a recording doubtful.
const DOUBTFUL_LOSS: f64 = 0.1;

impl CameraCounts {
    /// Pictures that the camera took, as far as its counter tells.
    #[must_use]
    pub fn taken(&self) -> u64 {
        self.frames + self.missing
    }

    /// Pictures that did not come, or not whole.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.missing + self.unusable
    }

    /// Whether too many pictures were lost, or stamped doubtfully, for the recording to pass as good.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        self.taken() == 0
            || self.lost() as f64 > DOUBTFUL_LOSS * self.taken() as f64
            || self.clock_set > 0
            || self.interruptions > 0
    }

    /// Missing or doubtful data, a sentence each.
    #[must_use]
    pub fn losses(&self) -> Vec<String> {
        let mut words = Vec::new();
        if self.taken() == 0 {
            words.push(match self.is_triggered {
                true => {
                    "no picture arrived: check that the trigger is wired to the named input and fires. A \
                         camera that waits for a trigger sends no pictures without it"
                        .to_owned()
                }
                false => "no picture came".to_owned(),
            });
        }
        if self.lost() > 0 {
            words.push(format!(
                "{} of {} pictures did not arrive or are incomplete: a lower frame rate, larger packets (jumbo frames) or a \
                 larger receive buffer (net.core.rmem_max) may help",
                self.lost(),
                self.taken()
            ));
        }
        if self.interruptions > 0 {
            words.push(format!(
                "the camera went away {} times and was waited for; the pictures of that time are missing",
                self.interruptions
            ));
        }
        if self.clock_set > 0 {
            words.push(format!(
                "the camera's clock was set {} times; pictures stamped by their exposure may have wrong stamps around those \
                 moments",
                self.clock_set
            ));
        }
        words
    }
}

impl fmt::Display for CameraCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frames, unusable, missing, seams, profiles, no_return, columns, .. } = self;
        if *frames == 0 && self.is_triggered {
            return f.write_str("no picture yet: it waits for its trigger");
        }
        if *profiles > 0 {
            write!(
                f,
                "{profiles} profiles in {frames} frames, {missing} frames missing, {unusable} incomplete, no return in {no_return} of {columns} \
                 columns, the seam found in {seams}"
            )?;
        } else {
            write!(
                f,
                "{frames} pictures, {missing} missing, {unusable} incomplete, the seam found in {seams}"
            )?;
        }
        if self.signals.is_empty() { Ok(()) } else { write!(f, "; {}", self.signals) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_of_which_nothing_came_is_doubtful_and_its_trigger_is_asked_for() {
        let none = CameraCounts { is_triggered: true, ..CameraCounts::default() };
        assert!(
            none.is_doubtful() && none.losses()[0].contains("the trigger is wired"),
            "{:?}",
            none.losses()
        );
        assert_eq!(none.to_string(), "no picture yet: it waits for its trigger");
        let by_itself = CameraCounts { is_triggered: false, ..none };
        assert!(by_itself.is_doubtful() && !by_itself.losses()[0].contains("trigger"));
        let some = CameraCounts { frames: 1, ..none };
        assert!(!some.is_doubtful() && some.losses().is_empty());
    }
}
