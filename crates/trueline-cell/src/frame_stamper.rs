//! Which of a picture's stamps calibration uses.

use crate::camera_clock::{CameraClock, Exchange};
use crate::error::CellError;
use trueline_camera::{CameraError, CameraFrame, FrameSource};

/// Which of a picture's stamps calibration uses; all others are recorded as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StampChoice {
    /// Arrival of the first packet, by the kernel.
    FirstPacket,
    /// Arrival of the last packet.
    Complete,
    /// Start of the exposure by the camera's own clock, mapped to this PC's by asking for it (latch).
    Exposure,
}

impl StampChoice {
    /// Kind of stamp, in the words of the recording.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::FirstPacket => "arrival of the first packet (kernel)",
            Self::Complete => "arrival of the last packet",
            Self::Exposure => "the camera's own stamp, mapped by asking it for its time",
        }
    }
}

/// Stamps pictures as chosen.
pub struct FrameStamper {
    choice: StampChoice,
    clock: Option<CameraClock>,
    /// How long pictures usually take from their stamp to their arrival, ns.
    usual_ns: Option<i64>,
}

impl FrameStamper {
    /// Reads the camera's clock some times where the choice needs it.
    ///
    /// # Errors
    /// A camera that fails or whose clock cannot be read.
    pub fn new(choice: StampChoice, source: &mut dyn FrameSource) -> Result<Self, CellError> {
        let clock = match choice {
            StampChoice::Exposure => Some(CameraClock::begin(source)?),
            StampChoice::FirstPacket | StampChoice::Complete => None,
        };
        Ok(Self { choice, clock, usual_ns: None })
    }

    /// The choice.
    #[must_use]
    pub fn choice(&self) -> StampChoice {
        self.choice
    }

    /// Whether stamps are made when a frame comes, and not when its exposure begins.
    #[must_use]
    pub(crate) fn is_of_arrival(&self) -> bool {
        self.choice != StampChoice::Exposure
    }

    /// Whether pictures have to wait for the next exchange with the camera's clock before they can be stamped.
    #[must_use]
    pub(crate) fn needs_exchanges(&self) -> bool {
        self.clock.is_some()
    }

    /// Reads the camera's clock again if it is time to, or `at_once`.
    ///
    /// # Errors
    /// A camera that fails.
    pub(crate) fn keep_up(
        &mut self,
        source: &mut dyn FrameSource,
        at_once: bool,
    ) -> Result<Option<Exchange>, CameraError> {
        match &mut self.clock {
            Some(clock) => clock.keep_up(source, at_once),
            None => Ok(None),
        }
    }

    /// A picture's stamp by the steady clock, ns. `was_set`: the camera's clock was set since the exchange before.
    pub fn stamp_ns(&mut self, frame: &CameraFrame, was_set: bool) -> i64 {
        let arrival_ns = frame.first_packet_ns.unwrap_or(frame.complete_ns);
        match (self.choice, frame.device_ns, &self.clock) {
            (StampChoice::Exposure, Some(device_ns), Some(clock)) if was_set => {
                clock.likely_steady_ns(device_ns, arrival_ns, self.usual_ns)
            }
            (StampChoice::Exposure, Some(device_ns), Some(clock)) => {
                let stamp_ns = clock.steady_ns(device_ns);
                self.usual_ns = Some(arrival_ns - stamp_ns);
                stamp_ns
            }
            (StampChoice::Complete | StampChoice::Exposure, ..) => frame.complete_ns,
            (StampChoice::FirstPacket, ..) => arrival_ns,
        }
    }
}
