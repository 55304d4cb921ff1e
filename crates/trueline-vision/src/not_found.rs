//! Why a picture has no seam point.

/// Reasons why there is no seam point, with the deciding numbers.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NotFound {
    /// The picture cannot be read, or is of another size than the camera's.
    #[error("the picture cannot be used")]
    Unreadable,
    /// Nothing in the picture looks like a stripe.
    #[error(
        "no laser stripe in the picture: the brightest place is {contrast:.0} levels above its surroundings"
    )]
    NoStripe {
        /// How far the brightest tile stands out, in grey levels.
        contrast: f64,
    },
    /// One straight stripe.
    #[error("a single straight piece of stripe, {length_px:.0} px long: no joint")]
    OnePiece {
        /// Its length, px.
        length_px: f64,
    },
    /// Arms that are too short, or not continuous.
    #[error(
        "the two longest arms are {:.0} and {:.0} px long; {needed_px:.0} px are needed",
        arms_px[0],
        arms_px[1]
    )]
    ArmsTooShort {
        /// How far the arms of the most likely joint are continuous, px.
        arms_px: [f64; 2],
        /// How far they must be, px.
        needed_px: f64,
    },
    /// Arms that are almost in line.
    #[error("the stripe bends by {bend_deg:.1}° in the picture; {needed_deg:.1}° are needed")]
    TooFlat {
        /// The bend, degrees.
        bend_deg: f64,
        /// The least bend that is a corner, degrees.
        needed_deg: f64,
    },
    /// The stripe lies on something round.
    #[error(
        "the stripe is curved, as on a round part: {whole_deg:.0}° in all, {corner_deg:.0}° at the corner; \
         at least half must be at the corner"
    )]
    TurnsAllAlong {
        /// How far it turns at the corner, degrees in the sheet.
        corner_deg: f64,
        /// How far it turns in all, degrees in the sheet.
        whole_deg: f64,
    },
    /// The stripe is missing about the place where the arms would meet.
    #[error(
        "the stripe is interrupted over {:.0} and {:.0} px beside the corner; {most_px:.0} px in total are \
         allowed",
        gaps_px[0],
        gaps_px[1]
    )]
    ArmsApart {
        /// Starts of the arms, px from the crossing.
        gaps_px: [f64; 2],
        /// The most that both may be, px.
        most_px: f64,
    },
    /// The corner points the other way: towards the camera instead of away, or the reverse.
    #[error("the corner points {}; is it another joint?", if *towards_camera { "towards the camera" } else { "away from the camera" })]
    WrongSide {
        /// Whether the corner is nearer to the camera than its arms.
        towards_camera: bool,
    },
    /// Faces with another opening angle than those of this joint.
    #[error(
        "the angle between the faces in the laser plane is {opening_deg:.0}°; {least_deg:.0}° to \
        {most_deg:.0}° are expected"
    )]
    OtherOpening {
        /// The angle between the faces, degrees.
        opening_deg: f64,
        /// The least that is expected, degrees.
        least_deg: f64,
        /// The most, degrees.
        most_deg: f64,
    },
    /// Several pieces, but not as this joint has them.
    #[error("the {pieces} pieces of the stripe do not form this joint")]
    NotThisJoint {
        /// Number of straight pieces.
        pieces: usize,
    },
    /// The stripe continues beyond its expected end.
    #[error("the stripe continues beyond the crossing of its pieces")]
    GoesOn,
    /// The stripe does not end where its segment does.
    #[error(
        "the end of the stripe is unclear: it fades over {fades_px:.0} px; at most {most_px:.0} px are \
        allowed"
    )]
    NoClearEnd {
        /// Length of the fall of the light, px.
        fades_px: f64,
        /// The most that an edge may blur, px.
        most_px: f64,
    },
    /// The stripe leaves its line before it ends.
    #[error(
        "the plate's edge is rounded: the end of the stripe is {shift_px:.1} px off its line; {most_px:.1} \
        px are allowed"
    )]
    RoundedEnd {
        /// Its distance from its line, px.
        shift_px: f64,
        /// The most that it may be, px.
        most_px: f64,
    },
    /// The gap is not the one that the other pictures show.
    #[error("the gap width differs from most other pictures")]
    OddGap,
    /// The point is not where the pictures before and after have the seam.
    #[error(
        "the point is {distance_px:.0} px from the seam in the neighbouring pictures; {most_px:.0} px are \
        allowed"
    )]
    Jumps {
        /// How far it is from there, px.
        distance_px: f64,
        /// The most that it may be, px.
        most_px: f64,
    },
    /// The points of the scan lie on two tracks, and this one on the less frequented, or no track is preferred.
    #[error("the seam alternates between two places {distance_px:.0} px apart")]
    TwoPlaces {
        /// How far the places are apart, px.
        distance_px: f64,
    },
    /// Two places are as likely.
    #[error("two places {distance_px:.0} px apart are equally likely")]
    Ambiguous {
        /// How far they are apart, px.
        distance_px: f64,
    },
    /// Too little of the stripe is to be seen.
    #[error("too little of the stripe is visible beside the seam: {:.1} % of its arm; at least {:.0} % is \
        needed", 100.0 * visible, 100.0 * needed)]
    TooLittle {
        /// Part of the cross-sections that show the stripe.
        visible: f64,
        /// The least that is used.
        needed: f64,
    },
    /// The uncertainty of the point is too large.
    #[error("the seam point is too uncertain: ± {sigma_px:.1} px; {most_px:.0} px are allowed")]
    Uncertain {
        /// Its standard deviation, px.
        sigma_px: f64,
        /// The most that is used, px.
        most_px: f64,
    },
    /// The pieces meet outside the picture.
    #[error("the seam is out of view")]
    OutOfView,
}

impl NotFound {
    /// A stable word for programs.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unreadable => "unreadable",
            Self::NoStripe { .. } => "no-stripe",
            Self::OnePiece { .. } => "single-segment",
            Self::ArmsTooShort { .. } => "arms-too-short",
            Self::TooFlat { .. } => "too-flat",
            Self::TurnsAllAlong { .. } => "turns-all-along",
            Self::ArmsApart { .. } => "arms-apart",
            Self::WrongSide { .. } => "wrong-side",
            Self::OtherOpening { .. } => "other-opening",
            Self::NotThisJoint { .. } => "not-this-joint",
            Self::GoesOn => "stripe-continues",
            Self::NoClearEnd { .. } => "no-clear-end",
            Self::RoundedEnd { .. } => "rounded-end",
            Self::OddGap => "odd-gap",
            Self::Jumps { .. } => "far-from-neighbours",
            Self::TwoPlaces { .. } => "two-places",
            Self::Ambiguous { .. } => "ambiguous",
            Self::TooLittle { .. } => "too-little-stripe",
            Self::Uncertain { .. } => "uncertain",
            Self::OutOfView => "out-of-view",
        }
    }

    /// The deciding number, to sort reasons of one kind; zero if there is none.
    #[must_use]
    pub fn value(&self) -> f64 {
        match *self {
            Self::NoStripe { contrast } => contrast,
            Self::OnePiece { length_px } => length_px,
            Self::ArmsTooShort { arms_px: [a, b], .. } => a.min(b),
            Self::TooFlat { bend_deg, .. } => bend_deg,
            Self::TurnsAllAlong { corner_deg, .. } => corner_deg,
            Self::OtherOpening { opening_deg, .. } => opening_deg,
            Self::ArmsApart { gaps_px: [a, b], .. } => a + b,
            Self::NoClearEnd { fades_px, .. } => fades_px,
            Self::Jumps { distance_px, .. }
            | Self::Ambiguous { distance_px }
            | Self::TwoPlaces { distance_px } => distance_px,
            Self::RoundedEnd { shift_px, .. } => shift_px,
            Self::TooLittle { visible, .. } => visible,
            Self::Uncertain { sigma_px, .. } => sigma_px,
            Self::NotThisJoint { pieces } => pieces as f64,
            Self::Unreadable | Self::WrongSide { .. } | Self::GoesOn | Self::OddGap | Self::OutOfView => 0.0,
        }
    }

    /// The same reason for a picture with pixels `factor` times as small and levels `level_scale` times.
    #[must_use]
    pub(crate) fn scaled(self, factor: f64, level_scale: f64) -> Self {
        match self {
            Self::NoStripe { contrast } => Self::NoStripe { contrast: contrast / level_scale },
            Self::OnePiece { length_px } => Self::OnePiece { length_px: length_px * factor },
            Self::ArmsTooShort { arms_px, needed_px } => {
                Self::ArmsTooShort { arms_px: arms_px.map(|px| px * factor), needed_px: needed_px * factor }
            }
            Self::ArmsApart { gaps_px, most_px } => {
                Self::ArmsApart { gaps_px: gaps_px.map(|px| px * factor), most_px: most_px * factor }
            }
            Self::NoClearEnd { fades_px, most_px } => {
                Self::NoClearEnd { fades_px: fades_px * factor, most_px: most_px * factor }
            }
            Self::RoundedEnd { shift_px, most_px } => {
                Self::RoundedEnd { shift_px: shift_px * factor, most_px: most_px * factor }
            }
            Self::Ambiguous { distance_px } => Self::Ambiguous { distance_px: distance_px * factor },
            Self::Uncertain { sigma_px, most_px } => {
                Self::Uncertain { sigma_px: sigma_px * factor, most_px: most_px * factor }
            }
            other => other,
        }
    }
}
