//! Progress of a live estimate, in words.

use crate::cell::CellState;
use crate::live_estimate::{Estimated, Progress};
use std::fmt;

/// The estimate in one line.
impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Waiting { seam_points, needed } => {
                write!(f, "{seam_points} of {needed} seam points needed for a first estimate")
            }
            Self::Refused { seam_points, why } => write!(f, "{seam_points} seam points; {why}"),
            Self::Estimated(estimated) => estimated.fmt(f),
        }
    }
}

impl Progress {
    /// Quantities that cannot be determined yet, and the motion that would help.
    #[must_use]
    pub fn advice(&self) -> &[String] {
        match self {
            Self::Estimated(estimated) => &estimated.advice,
            Self::Waiting { .. } | Self::Refused { .. } => &[],
        }
    }
}

impl fmt::Display for Estimated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.time_offset_s.map(|numbers| numbers.map(|s| s * 1e3)) {
            Some([offset_ms, sigma_ms]) => write!(f, "time offset {offset_ms:+.2} ± {sigma_ms:.2} ms")?,
            None => f.write_str("time offset not determined yet")?,
        }
        match (self.translation_sigma_m, self.rotation_sigma_rad) {
            (Some(m), Some(rad)) => write!(f, ", hand-eye ± {:.2} mm ± {:.3}°", m * 1e3, rad.to_degrees())?,
            _ => f.write_str(", hand-eye not fully determined yet")?,
        }
        write!(f, ", {} seam points", self.seam_points)?;
        match self.is_enough {
            Some(true) => f.write_str(": ENOUGH"),
            Some(false) => f.write_str(": not yet as accurate as required"),
            None => Ok(()),
        }
    }
}

impl CellState {
    /// State of camera and estimate, in some lines.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        lines.extend(self.camera.as_ref().map(|counts| format!("camera: {counts}")));
        if let Some(progress) = &self.estimate {
            lines.push(format!("estimate: {progress}"));
            lines.extend(progress.advice().iter().map(|advice| format!("not determined: {advice}")));
        }
        lines
    }
}
