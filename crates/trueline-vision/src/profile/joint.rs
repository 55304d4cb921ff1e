//! The joint in profiles.

use crate::seam::Joint;

/// A joint in profiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ProfileJoint {
    /// Two faces that meet at an angle: fillet, V, corner. The direction of the sensor's heights determines which of them it is.
    Meeting,
    /// Two parallel faces, one behind the other; the seam is the edge of the nearer one.
    Lap,
    /// Two faces in line; the seam is the middle of the gap.
    Butt,
    /// One face over nothing; the seam is its edge.
    Edge,
}

impl ProfileJoint {
    /// All of them, in the order in which they are tested: the special ones before the general ones.
    pub const ALL: [Self; 4] = [Self::Meeting, Self::Lap, Self::Butt, Self::Edge];

    /// The joint of a name; `None` for one that profiles are not searched for.
    #[must_use]
    pub fn of(joint: Joint) -> Option<Self> {
        match joint {
            Joint::Fillet | Joint::VGroove | Joint::Corner => Some(Self::Meeting),
            Joint::Lap => Some(Self::Lap),
            Joint::Butt => Some(Self::Butt),
            Joint::Edge => Some(Self::Edge),
            Joint::Step | Joint::Groove | Joint::VBlock => None,
        }
    }

    /// Its seam, in words.
    #[must_use]
    pub fn seam(self) -> &'static str {
        match self {
            Self::Meeting => "corner of two faces",
            Self::Lap => "edge of the nearer of two parallel faces",
            Self::Butt => "middle of a gap",
            Self::Edge => "edge of one face",
        }
    }
}
