//! Summary of a scan of pictures, for people and for programs.

use super::scan_seams::{JointSource, ScanSeams, SkippedPictures};
use crate::seam::Joint;
use serde_json::{Value, json};
use std::fmt;

/// Gaps that are typically further than this from where their neighbours have them deserve a look, px: soot makes
/// gaps as well. Corners and edges may just move fast.
const DOUBTFUL_PX: f64 = 20.0;

/// Pictures that could not be used and are named at most.
const MOST_NAMED: usize = 10;

impl fmt::Display for ScanSeams {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let how = match self.joint_source {
            JointSource::Given => "",
            JointSource::Pictures => " (detected in the pictures)",
            JointSource::Default => " (default: the pictures show no joint)",
        };
        writeln!(f, "Joint            {}{how}", self.joint.name())?;
        writeln!(f, "Found            {} of {} pictures", self.detections().count(), self.frames.len())?;
        for error in self.unreadable.iter().take(MOST_NAMED) {
            writeln!(f, "                 skipped: {error}")?;
        }
        for skipped in self.reasons() {
            writeln!(f, "                 {}: {}", skipped.count, skipped.typical)?;
        }
        if let Some([u, v]) = self.spread() {
            writeln!(
                f,
                "Uncertainty      ± {:.3} px in u, ± {:.3} px in v (median; 95 % below {:.3}, {:.3})",
                u[0], v[0], u[1], v[1]
            )?;
        }
        if let Some([quality, _]) = self.median_and_p95(|seam| seam.quality) {
            writeln!(
                f,
                "Quality          {quality:.2} visible part of the weaker stripe beside the seam \
                (median)"
            )?;
        }
        if let Some(distance_px) = self.neighbour_distance_px {
            let is_doubtful = self.joint == Joint::Butt && distance_px > DOUBTFUL_PX;
            let doubt =
                if is_doubtful { ": check in the pictures that these gaps are the joint" } else { "" };
            writeln!(
                f,
                "Next picture     {distance_px:.2} px off the motion of the pictures beside it (median){doubt}"
            )?;
        }
        for fault in &self.faults {
            writeln!(f, "Pictures         {fault}")?;
        }
        if let Some(distance_px) = self.second_place_px {
            writeln!(
                f,
                "Two places       the seam alternates between two places {distance_px:.0} px apart: choose \
                one of them"
            )?;
        }
        if let Some(gap_mm) = self.median_gap_mm() {
            writeln!(f, "Gap              {gap_mm:.2} mm (median)")?;
        }
        write!(
            f,
            "Time             {:.2} ms per picture on one core, without reading the file",
            self.ms_per_picture()
        )
    }
}

impl ScanSeams {
    /// Median and 95th percentile of the sigma along u and v, px.
    fn spread(&self) -> Option<[[f64; 2]; 2]> {
        let along = |axis: usize| self.median_and_p95(|seam| seam.sigma_px()[axis]);
        Some([along(0)?, along(1)?])
    }

    fn median_gap_mm(&self) -> Option<f64> {
        let gap_m = self.median_and_p95(|seam| seam.gap_m).filter(|_| self.joint == Joint::Butt)?;
        Some(gap_m[0] * 1e3)
    }

    /// The same for programs.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let reasons: Vec<Value> = (self.reasons().into_iter())
            .map(|SkippedPictures { count, typical }| {
                json!({ "code": typical.code(), "count": count, "text": typical.to_string() })
            })
            .collect();
        json!({
            "joint": self.joint.name(),
            "joint_chosen_by_pictures": self.joint_source == JointSource::Pictures,
            "pictures": self.frames.len(),
            "found": self.detections().count(),
            "not_found": reasons,
            "unreadable": self.unreadable.iter().map(ToString::to_string).collect::<Vec<_>>(),
            "median_sigma_px": self.spread().map(|[u, v]| [u[0], v[0]]),
            "median_quality": self.median_and_p95(|seam| seam.quality).map(|[median, _]| median),
            "median_px_from_neighbours": self.neighbour_distance_px,
            "picture_faults": self.faults.iter().map(|fault| {
                json!({ "code": fault.code(), "text": fault.to_string() })
            }).collect::<Vec<_>>(),
            "second_place_px": self.second_place_px,
            "median_gap_mm": self.median_gap_mm(),
            "ms_per_picture": self.ms_per_picture(),
        })
    }
}
