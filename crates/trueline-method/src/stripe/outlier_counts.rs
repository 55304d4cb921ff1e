//! Used and rejected stripes and edge points.

use crate::assess::outliers::Outliers;

/// Counts of the measurements of a scan, and of its outliers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutlierCounts {
    /// Stripes (and, with both, seam points) that were tested.
    pub stripes: usize,
    /// Stripes rejected as outliers.
    pub rejected_stripes: usize,
    /// Edge points that were tested.
    pub edge_points: usize,
    /// Edge points rejected as outliers.
    pub rejected_edge_points: usize,
    /// Stripes of frames in which a plate lies along the laser plane. They have no residuals and are not tested.
    pub along_sheet: usize,
}

impl OutlierCounts {
    /// Counts a stripe or an edge point. `None` if there is none, else whether it is kept.
    pub(crate) fn add(&mut self, is_edge: bool, kept: Option<bool>) {
        let (all, rejected) = match is_edge {
            true => (&mut self.edge_points, &mut self.rejected_edge_points),
            false => (&mut self.stripes, &mut self.rejected_stripes),
        };
        *all += usize::from(kept.is_some());
        *rejected += usize::from(kept == Some(false));
    }

    /// Stripes and edge points together.
    #[must_use]
    pub fn outliers(&self) -> Outliers {
        Outliers {
            count: self.rejected_stripes + self.rejected_edge_points,
            of: self.stripes + self.edge_points,
        }
    }
}

/// Rejected measurements of a scan.
#[derive(Clone, Debug, Default)]
pub struct Rejected {
    /// Counts over the scan.
    pub counts: OutlierCounts,
    /// Outliers of each joint.
    pub of_joints: Vec<Outliers>,
    /// Stamps of frames in which a stripe or the edge point was rejected, s.
    pub stamps_s: Vec<f64>,
}

impl Rejected {
    /// Adds a frame of a joint: of each plate and the edge point whether it is kept, `None` if it is missing.
    pub(crate) fn add(
        &mut self,
        (joint, stamp_s): (usize, f64),
        plates: &[Option<bool>],
        edge: Option<bool>,
    ) {
        plates.iter().for_each(|kept| self.counts.add(false, *kept));
        self.counts.add(true, edge);
        if self.of_joints.len() <= joint {
            self.of_joints.resize(joint + 1, Outliers::default());
        }
        let measured = || plates.iter().chain([&edge]).flatten();
        let rejected = measured().filter(|kept| !**kept).count();
        self.of_joints[joint].of += measured().count();
        self.of_joints[joint].count += rejected;
        if rejected > 0 {
            self.stamps_s.push(stamp_s);
        }
    }
}
