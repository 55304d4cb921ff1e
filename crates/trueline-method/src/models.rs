//! Records of the fitted models of a scan, with the reason that each is or is not the answer.

use crate::config::Measurements;

/// Treatment of a group of unknowns in a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Estimated from the scan, with a prior if there is one.
    Estimated,
    /// Considered: known with a covariance that the scan does not improve.
    Considered,
    /// Held as exact.
    Held,
}

impl Role {
    /// The name in the result.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Estimated => "estimated",
            Self::Considered => "considered",
            Self::Held => "held",
        }
    }
}

/// Image clock in a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// One time offset for the whole scan.
    Even,
    /// It drifts at a constant rate, which was removed.
    Drifts,
    /// It steps once.
    Steps,
    /// None: the robot stands at each reading.
    None,
}

impl Clock {
    /// The name in the result.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Even => "even",
            Self::Drifts => "drifts",
            Self::Steps => "steps",
            Self::None => "none",
        }
    }
}

/// Reason that a model was fitted, and whether it is the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Because {
    /// The user requested it. It is the answer.
    Asked,
    /// It tests whether the scan contradicts a held quantity, or one from the sensor's file.
    TestsWhatIsHeld,
    /// It includes noise alone. The adjustment of all errors starts at its optimum.
    NoiseAlone,
    /// It tests whether the recorded poses were commanded poses. It is not clearly likelier, or no likelier than the same filter reversed in time.
    TestsLag,
    /// The residuals show its lag behind commanded poses. It is the answer.
    ResidualsShowLag,
    /// The residuals show its lens. The answer keeps the stated lens, and the corrected file has this one.
    ResidualsShowLens,
    /// It is of other measurements of the same scan: of the seam points where the stripes give the answer, or of the stripes.
    OtherMeasurements,
    /// It is a straight line with a bow. A curve explains the scan better.
    LineRefused,
    /// It is a curve and explains a scan that no line explains. It is the answer.
    CurveExplains,
    /// It is a curve and no likelier than the line.
    CurveNoBetter,
}

impl Because {
    /// The name in the result.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            Self::Asked => "asked",
            Self::TestsWhatIsHeld => "tests-what-is-held",
            Self::NoiseAlone => "noise-alone",
            Self::TestsLag => "tests-lag",
            Self::ResidualsShowLag => "residuals-show-lag",
            Self::ResidualsShowLens => "residuals-show-lens",
            Self::OtherMeasurements => "other-measurements",
            Self::LineRefused => "line-refused",
            Self::CurveExplains => "curve-explains",
            Self::CurveNoBetter => "curve-no-better",
        }
    }

    /// Whether this model gives the answer.
    #[must_use]
    pub fn is_taken(self) -> bool {
        matches!(self, Self::Asked | Self::ResidualsShowLag | Self::CurveExplains)
    }
}

/// A quantity of a model that has a role.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// The time offset.
    TimeOffset,
    /// The hand-eye transform.
    HandEye,
    /// The seams. Held lines are at their drawn positions.
    Line,
    /// The bow of each seam.
    Bow,
    /// The form of each seam beyond its bow.
    SeamForm,
    /// The sensor's own shape.
    Sensor,
    /// The bias of the detector's point with the tilt.
    Detector,
    /// The radius of the edge.
    EdgeRadius,
    /// The robot's errors over its poses.
    Robot,
    /// Lag of the robot behind its recorded poses.
    PoseLag,
    /// The external axes.
    Axes,
}

impl Block {
    /// All of them, in the order of the result.
    pub const ALL: [Self; 11] = [
        Self::TimeOffset,
        Self::HandEye,
        Self::Line,
        Self::Bow,
        Self::SeamForm,
        Self::Sensor,
        Self::Detector,
        Self::EdgeRadius,
        Self::Robot,
        Self::PoseLag,
        Self::Axes,
    ];

    /// The name in the result.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::TimeOffset => "time_offset",
            Self::HandEye => "hand_eye",
            Self::Line => "line",
            Self::Bow => "bow",
            Self::SeamForm => "seam_form",
            Self::Sensor => "sensor",
            Self::Detector => "detector",
            Self::EdgeRadius => "edge_radius",
            Self::Robot => "robot",
            Self::PoseLag => "pose_lag",
            Self::Axes => "axes",
        }
    }
}

/// Form of the seam in a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeamModel {
    /// A line, with its bow and its form.
    Line,
    /// A spline.
    Curve,
}

impl SeamModel {
    /// The name in the result.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Curve => "curve",
        }
    }
}

/// A model fitted to a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelTried {
    /// Reason.
    pub because: Because,
    /// Measurements that it was fitted to: seam points, stripes, or both.
    pub measurements: Measurements,
    /// The role of each block, in the order of [`Block::ALL`].
    pub roles: [Role; Block::ALL.len()],
    /// Form of the seam.
    pub target: SeamModel,
    /// The clock of the images.
    pub clock: Clock,
    /// Lag of the robot behind its recorded poses, s.
    pub robot_lag_s: f64,
    /// Log likelihood of all measurements and of the prior at the best fit, up to a constant. For an adjustment it is the restricted likelihood.
    /// Models of one kind with the same measurements and stamps can be compared by it.
    pub log_evidence: f64,
    /// Noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
}

impl ModelTried {
    /// The role of a block.
    #[must_use]
    pub fn role(&self, block: Block) -> Role {
        let place = Block::ALL.iter().position(|other| *other == block);
        place.map_or(Role::Held, |place| self.roles[place])
    }

    /// The same with other roles for some blocks.
    pub(crate) fn with(&self, of: impl Fn(Block) -> Option<Role>) -> Self {
        Self { roles: Block::ALL.map(|block| of(block).unwrap_or_else(|| self.role(block))), ..self.clone() }
    }
}

impl ModelTried {
    /// The same as an adjustment that estimates these blocks beside its unknowns.
    fn adjusted_with(&self, blocks: &[Block], lags: bool) -> Self {
        self.with(|block| match block {
            Block::PoseLag => Some(role(lags, false)),
            Block::SeamForm | Block::Detector | Block::Robot | Block::Axes => {
                Some(role(blocks.contains(&block), false))
            }
            _ => None,
        })
    }
}

/// A lag of the robot behind its recorded poses that was tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriedLag {
    /// That of all joints, s.
    pub lag_s: f64,
    /// Whether each joint has its own beside it.
    pub of_joints: bool,
    /// Minus twice the log likelihood.
    pub twice_negative_log: f64,
}

impl TriedLag {
    /// Whether both are one model.
    pub(crate) fn is_of(&self, other: &Self) -> bool {
        (self.lag_s, self.of_joints) == (other.lag_s, other.of_joints)
    }

    /// No lag.
    pub(crate) fn none(twice_negative_log: f64) -> Self {
        Self { lag_s: 0.0, of_joints: false, twice_negative_log }
    }

    fn is_none(&self) -> bool {
        self.lag_s == 0.0 && !self.of_joints
    }
}

/// The models of an adjustment that started at a fit and estimates these blocks beside its unknowns, by the lag of the robot. The first is the
/// answer.
pub(crate) fn of_adjustment(begun: &ModelTried, blocks: &[Block], tried: &[TriedLag]) -> Vec<ModelTried> {
    let of = |(place, lag): (usize, &TriedLag)| {
        let because = match (place == 0, !lag.is_none()) {
            (true, false) => Because::Asked,
            (true, true) => Because::ResidualsShowLag,
            (false, _) => Because::TestsLag,
        };
        let adjusted = begun.adjusted_with(blocks, !lag.is_none());
        let log_evidence = -0.5 * lag.twice_negative_log;
        ModelTried { because, robot_lag_s: lag.lag_s, log_evidence, ..adjusted }
    };
    let mut models: Vec<ModelTried> = tried.iter().enumerate().map(of).collect();
    let is_of_errors = |block| matches!(block, Block::Detector | Block::EdgeRadius | Block::Robot);
    let alone = begun.with(|block| is_of_errors(block).then_some(Role::Held));
    models.push(ModelTried { because: Because::NoiseAlone, ..alone });
    models
}

/// An adjustment of stripes.
#[derive(Clone, Debug)]
pub(crate) struct OfStripes<'a> {
    /// Measurements that it was fitted to.
    pub measurements: Measurements,
    /// The blocks that it estimates beside its unknowns.
    pub blocks: &'a [Block],
    /// Log likelihood.
    pub log_evidence: f64,
    /// Noise factor of the fit that it started at.
    pub noise_factor: f64,
    /// Whether it gives the answer.
    pub is_answer: bool,
}

/// Adds the adjustment of the stripes, and makes it the answer if it is.
pub(crate) fn add_stripes(models: &mut Vec<ModelTried>, stripes: OfStripes<'_>) {
    let OfStripes { measurements, blocks, log_evidence, noise_factor, is_answer } = stripes;
    let Some(answer) = models.iter_mut().find(|model| model.because.is_taken()) else { return };
    let of_stripes = ModelTried {
        because: if is_answer { answer.because } else { Because::OtherMeasurements },
        measurements,
        log_evidence,
        noise_factor,
        ..answer.adjusted_with(blocks, answer.role(Block::PoseLag) == Role::Estimated)
    };
    // The light of a stripe is on the plates, not on their edge, and plates have bows.
    let of_plates = of_stripes.with(|block| match block {
        Block::EdgeRadius => Some(Role::Held),
        Block::Bow => Some(Role::Estimated),
        _ => None,
    });
    if is_answer {
        answer.because = Because::OtherMeasurements;
    }
    models.insert(usize::from(!is_answer), of_plates);
}

/// The role of a block that is estimated, or considered, or neither.
pub(crate) fn role(is_estimated: bool, is_considered: bool) -> Role {
    match (is_estimated, is_considered) {
        (true, _) => Role::Estimated,
        (false, true) => Role::Considered,
        (false, false) => Role::Held,
    }
}

/// The models of another calibration of the scan, made beside the answer.
pub(crate) fn beside(models: &[ModelTried], because: Because) -> impl Iterator<Item = ModelTried> {
    models.iter().map(move |model| {
        let own = if model.because.is_taken() { because } else { model.because };
        ModelTried { because: own, ..model.clone() }
    })
}
