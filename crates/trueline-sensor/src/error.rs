//! Why a sensor could not be calibrated.

/// Reasons why there is no calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Too few pictures show the board.
    #[error("the board was found in only {found} pictures; {needed} are needed")]
    TooFewPictures {
        /// Pictures with a board.
        found: usize,
        /// The fewest that will do.
        needed: usize,
    },
    /// Too few sightings of a target.
    #[error("only {found} sightings of the target are consistent; {needed} are needed")]
    TooFewSightings {
        /// Sightings that do.
        found: usize,
        /// The fewest that will do.
        needed: usize,
    },
    /// Too few profiles show a round target.
    #[error("the arc of a {target} was found in {found} of {profiles} profiles; {needed} are needed")]
    TooFewArcs {
        /// Name of the target.
        target: &'static str,
        /// Profiles with an arc.
        found: usize,
        /// Profiles in all.
        profiles: usize,
        /// The fewest that will do.
        needed: usize,
    },
    /// Too few corners for the unknowns.
    #[error("{found} corners were found; {needed} are needed")]
    TooFewCorners {
        /// Corners found.
        found: usize,
        /// The fewest that will do.
        needed: usize,
    },
    /// The board's pose cannot be found from its corners.
    #[error("the pose of the board cannot be found from its corners")]
    NoPose,
    /// The pictures leave a camera parameter free.
    #[error("the pictures do not determine the camera")]
    NotFixed,
    /// Too few boards or points for a plane.
    #[error("the stripe was found on only {found} boards; {needed} are needed")]
    TooFewBoards {
        /// Boards with a stripe.
        found: usize,
        /// The fewest that will do.
        needed: usize,
    },
    /// The bright lines of the pictures lie in no plane.
    #[error(
        "no laser plane explains the bright lines of the pictures: the best has a stripe in {found} of them; {needed} are needed"
    )]
    NoCommonPlane {
        /// Boards with a stripe in the plane of most.
        found: usize,
        /// The fewest that will do.
        needed: usize,
    },
    /// Too few stops before a plate.
    #[error("the stripe was found at only {found} stops; {needed} are needed")]
    TooFewStops {
        /// Stops with a stripe.
        found: usize,
        /// The fewest that will do.
        needed: usize,
    },
    /// No plate and no laser plane explain the stripes.
    #[error("no flat plate and no laser plane explain the stripes at the robot's poses")]
    NoPlate,
    /// All points lie on one line.
    #[error("all points lie on one line: any plane through it fits")]
    OneLine,
    /// The motion does not fix the hand-eye transform.
    #[error("the robot's motion does not determine the hand-eye transform")]
    HandEyeNotFixed,
    /// The motion does not show the time offset.
    #[error("the robot's motion does not determine the time offset")]
    TimeOffsetNotFixed,
    /// Pictures and robot poses share no time.
    #[error("the pictures and the robot's poses do not overlap in time")]
    NoCommonTime,
}

impl Error {
    /// The same for a target's sightings, which correspond to a board's pictures in the joint fit.
    pub(crate) fn of_sightings(self) -> Self {
        match self {
            Self::TooFewPictures { found, needed } => Self::TooFewSightings { found, needed },
            other => other,
        }
    }

    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::TooFewPictures { .. } => {
                "take 10 to 20 pictures of the whole board, tilted by about 30 degrees in different directions"
            }
            Self::TooFewSightings { .. } => {
                "check that each row is camera_from_target and robot.csv is base_from_tool, of one target in \
                one recording. Take 20 or more sightings"
            }
            Self::TooFewArcs { .. } => {
                "sweep the laser over the upper half of the target, so that each profile shows 40 degrees of its arc or more; \
                 check --radius-mm"
            }
            Self::TooFewCorners { .. } => "use a board with more squares, or more pictures",
            Self::NoPose => {
                "check that the board is flat and that --board COLSxROWS is the number of inner \
                corners"
            }
            Self::NotFixed => "tilt the board by about 30 degrees in different directions",
            Self::HandEyeNotFixed => "turn the tool about two or more axes, by 15 degrees or more",
            Self::TimeOffsetNotFixed => {
                "take pictures while the robot moves; if it stands at each of them, use --at-stops"
            }
            Self::NoCommonTime => "were robot and camera recorded together, with stamps of one clock?",
            Self::TooFewStops { .. } => {
                "stop 15 to 20 times before the plate, near and far, the tool tilted by 20 degrees to every side"
            }
            Self::NoPlate => {
                "check that each pose belongs to its picture, that the plate stands still, and that the \
                initial hand-eye transform is right to 10 degrees"
            }
            Self::TooFewBoards { found: 0, .. } | Self::NoCommonPlane { .. } => {
                "the stripe must lie on the board or on its sheet, be 0.7 to 40 px wide and brighter than \
                 both sides: check that the laser is on and the exposure short"
            }
            Self::TooFewBoards { .. } | Self::OneLine => {
                "put the board at several distances and tilts, so that the stripes spread over the plane"
            }
        }
    }
}
