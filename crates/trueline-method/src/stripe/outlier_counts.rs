//! Counts of used and rejected stripes and edge points.

use crate::assess::outliers::Outliers;

/// Counts of what the frames of a scan show, and of what was left out as an outlier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutlierCounts {
    /// Stripes (and, with both, seam points) that were looked at.
    pub stripes: usize,
    /// Of these, how many were left out as outliers.
    pub rejected_stripes: usize,
    /// Edge points that were looked at.
    pub edge_points: usize,
    /// Of these, how many were left out as outliers.
    pub rejected_edge_points: usize,
    /// Stripes of frames in which a plate lies along the laser plane: they have no residuals and are not looked at.
    pub along_sheet: usize,
}

impl OutlierCounts {
    /// Counts a stripe or an edge point, if it is there (`Some`) and whether it is kept.
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
