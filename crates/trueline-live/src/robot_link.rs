//! A robot's stream in any protocol: ABB's with all of EGM, the others' poses.

use crate::endpoint::Endpoint;
use crate::link_report;
use crate::link_watch::{Brief, LinkReport, LinkWatch};
use crate::priority;
use crate::robot_answer::RobotAnswer;
use crate::robot_source::{RobotPacket, RobotSource, SourceAbout, SourceError};
use crate::source_report;
use crate::source_watch::{SourceReport, SourceWatch};
use serde_json::Value;
use std::fmt;
use std::thread;
use std::time::Duration;

/// Source of packets.
pub enum RobotLink {
    /// An ABB robot.
    Egm(Box<Endpoint>),
    /// A robot of another make.
    Other(Box<dyn RobotSource>),
}

/// A network or a PC that loses more of a robot's packets than this is to be mended: lone ones are bridged, runs of four periods are gaps.
const MOST_LOST_PART: f64 = 0.1;

/// Between calls of a robot that does not answer.
const RETRY: Duration = Duration::from_millis(50);

impl RobotLink {
    /// A robot of another make.
    #[must_use]
    pub fn other(source: impl RobotSource + 'static) -> Self {
        Self::Other(Box::new(source))
    }

    fn source(&self) -> &dyn RobotSource {
        match self {
            Self::Egm(endpoint) => endpoint.as_ref(),
            Self::Other(source) => source.as_ref(),
        }
    }

    fn source_mut(&mut self) -> &mut dyn RobotSource {
        match self {
            Self::Egm(endpoint) => endpoint.as_mut(),
            Self::Other(source) => source.as_mut(),
        }
    }

    /// Waits for the robot, and hands over every packet that is there.
    ///
    /// # Errors
    /// As [`RobotSource::receive`].
    pub fn receive(
        &mut self,
        timeout: Duration,
        each: &mut dyn FnMut(&RobotPacket<'_>),
    ) -> Result<(), SourceError> {
        self.source_mut().receive(timeout, each)
    }

    /// Its protocol, and the kind of its poses, as far as known now.
    #[must_use]
    pub fn about(&self) -> SourceAbout {
        self.source().about()
    }

    /// Whether the robot waits for answers; then this thread asks for real-time priority. `Some(false)`: it was not granted.
    #[must_use]
    pub fn prepare_to_answer(&self) -> Option<bool> {
        self.source().must_answer().then(priority::request_real_time)
    }

    /// Answers that were sent since this was last asked.
    pub fn take_answers(&mut self) -> Vec<RobotAnswer> {
        self.source_mut().take_answers()
    }

    /// Listens as long as `goes_on` returns true. A robot that is not there yet, or went away, is called again. Returns the
    /// last error, unless good packets came after it.
    pub fn listen(
        &mut self,
        watch: &mut StreamWatch,
        mut goes_on: impl FnMut(&StreamWatch) -> bool,
    ) -> Option<SourceError> {
        let _granted = self.prepare_to_answer();
        let mut wrong = None;
        while goes_on(watch) {
            let _nobody_keeps_them = self.take_answers();
            let before = watch.frames();
            match self.receive(RETRY, &mut |packet| watch.note(packet)) {
                Ok(()) if watch.frames() > before => wrong = None,
                Ok(()) => {}
                Err(error @ SourceError::Refused { .. }) => return Some(error),
                Err(error) => {
                    wrong = Some(error);
                    thread::sleep(RETRY);
                }
            }
        }
        wrong
    }
}

/// Observes the stream.
#[derive(Clone, Debug, Default)]
pub struct StreamWatch {
    /// Of an ABB robot.
    pub egm: LinkWatch,
    /// Of a robot of another make.
    pub other: SourceWatch,
}

impl StreamWatch {
    /// Takes notice of a packet.
    pub fn note(&mut self, packet: &RobotPacket<'_>) {
        match packet.egm {
            Some(received) => self.egm.note(received),
            None => self.other.note(packet),
        }
    }

    /// Good packets so far.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.egm.brief().frames + self.other.frames()
    }

    /// The stream in half a line.
    #[must_use]
    pub fn brief(&self) -> StreamBrief {
        match self.other.frames() {
            0 => StreamBrief::Egm(self.egm.brief()),
            poses => StreamBrief::Other { poses },
        }
    }

    /// Report on a link's stream.
    #[must_use]
    pub fn report(&self, link: &RobotLink) -> StreamReport {
        match link {
            RobotLink::Egm(_) => StreamReport::Egm(self.egm.report()),
            RobotLink::Other(source) => StreamReport::Other(self.other.report(), source.about()),
        }
    }
}

/// A stream in half a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StreamBrief {
    /// Of an ABB robot, or nothing yet.
    Egm(Brief),
    /// Of a robot of another make.
    Other {
        /// Good poses.
        poses: u64,
    },
}

impl Default for StreamBrief {
    fn default() -> Self {
        Self::Egm(Brief::default())
    }
}

impl fmt::Display for StreamBrief {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Egm(brief) => brief.fmt(f),
            Self::Other { poses } => write!(f, "{poses} poses"),
        }
    }
}

/// A stream so far; its `Display` is some lines for a person.
#[derive(Clone, Debug, PartialEq)]
pub enum StreamReport {
    /// Of an ABB robot.
    Egm(LinkReport),
    /// For a robot of another make, with its protocol.
    Other(SourceReport, SourceAbout),
}

impl StreamReport {
    /// Whether there was a robot.
    #[must_use]
    pub fn has_robot(&self) -> bool {
        match self {
            Self::Egm(report) => report.robot.is_some(),
            Self::Other(report, _) => report.robot.is_some(),
        }
    }

    /// The part of the robot's packets that never came, if a path through the others cannot bridge it: above a tenth.
    #[must_use]
    pub fn heavy_loss(&self) -> Option<f64> {
        let (Self::Egm(LinkReport { stream, .. }) | Self::Other(SourceReport { stream, .. }, _)) = self;
        Some(stream.lost_part()).filter(|part| *part > MOST_LOST_PART)
    }

    /// The report for programs.
    #[must_use]
    pub fn to_json(&self) -> Value {
        match self {
            Self::Egm(report) => link_report::json(report),
            Self::Other(report, about) => source_report::json(report, about),
        }
    }
}

impl fmt::Display for StreamReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Egm(report) => report.fmt(f),
            Self::Other(report, about) => source_report::text(f, report, about),
        }
    }
}
