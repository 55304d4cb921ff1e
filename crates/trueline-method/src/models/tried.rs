//! A record of each model of a scan that was fitted, and of why it is the answer or not.

use crate::assess::systematic::SystematicLevels;
use crate::config::Target;
use crate::hypotheses::clock_drift::DriftFree;
use crate::problem::parameters::TIME_OFFSET;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;

/// What a group of unknowns was in a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Estimated from the scan, with a prior where there is one.
    Estimated,
    /// Known with a covariance that the scan does not improve.
    Considered,
    /// Held as if it were exact.
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

/// What the clock of the images does in a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// One time offset for the whole scan.
    Even,
    /// It drifts at a constant rate, which was taken out.
    Drifts,
    /// It steps once.
    Steps,
    /// There is none: the robot stands at each reading.
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

    fn of(settings: &FitSettings<'_>, found: &DriftFree) -> Self {
        match (found.stepped, found.drifted) {
            _ if settings.config.at_stops => Self::None,
            (Some(_), _) => Self::Steps,
            (None, Some(_)) => Self::Drifts,
            (None, None) => Self::Even,
        }
    }
}

/// Why a model was fitted, and so whether it is the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Because {
    /// The user asked for it: it is the answer.
    Asked,
    /// It tests whether the scan contradicts what the answer holds or takes from the sensor's file.
    TestsWhatIsHeld,
    /// It knows of noise alone: an adjustment with all errors begins at its optimum.
    NoiseAlone,
    /// It tests whether the recorded poses were commanded, and is not likelier.
    TestsLag,
    /// It has a lag behind commanded poses that the residuals show: it is the answer.
    ResidualsShowLag,
    /// It has a lens that the residuals show. The answer stays that of the stated lens, and the corrected file has this one.
    ResidualsShowLens,
    /// It is a straight line with a bow, which does not explain the scan as well as a curve does.
    LineRefused,
    /// It is a curve, and explains what no line does: it is the answer.
    CurveExplains,
    /// It is a curve, and no likelier than the line.
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
            Self::LineRefused => "line-refused",
            Self::CurveExplains => "curve-explains",
            Self::CurveNoBetter => "curve-no-better",
        }
    }

    /// Whether the answer is of this model.
    #[must_use]
    pub fn is_taken(self) -> bool {
        matches!(self, Self::Asked | Self::ResidualsShowLag | Self::CurveExplains)
    }
}

/// A model that was fitted to the seam points of a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelTried {
    /// Why.
    pub because: Because,
    /// What it takes the seam for: [`Target::Seam`] is a straight line with a bow.
    pub target: Target,
    /// Restricted log likelihood, where line and curve were compared.
    pub log_evidence: Option<f64>,
    /// How far the robot lags behind its recorded poses, s.
    pub robot_lag_s: f64,
    /// The sensor's own shape.
    pub sensor: Role,
    /// The time offset.
    pub time_offset: Role,
    /// Lines that are held where a drawing has them.
    pub drawn_lines: usize,
    /// The bias of the features with the tilt.
    pub feature_bias: Role,
    /// The clock of the images.
    pub clock: Clock,
    /// Logarithm of the likelihood of all features and of what was known beforehand, at the best fit; 0 for no residuals at all. Models of the same
    /// features and stamps compare by it.
    pub log_likelihood: f64,
    /// How much larger the residuals are than expected.
    pub noise_factor: f64,
}

impl ModelTried {
    /// The model that was asked for, as it was fitted.
    pub(crate) fn asked(settings: &FitSettings<'_>, levels: &SystematicLevels, found: &DriftFree) -> Self {
        let solver = Solver { observations: &found.observations, settings: *settings };
        Self {
            because: Because::Asked,
            target: Target::Seam,
            log_evidence: None,
            robot_lag_s: 0.0,
            sensor: role(settings.shape_prior.is_some(), levels.held_shape.is_some()),
            time_offset: role(
                !settings.fixed.contains(&TIME_OFFSET),
                settings.config.held_sigma.time_s.is_some(),
            ),
            drawn_lines: settings.config.drawn_lines.len(),
            feature_bias: role(levels.bias_is_estimated, levels.feature_bias_px > 0.0),
            clock: Clock::of(settings, found),
            log_likelihood: -0.5 * solver.twice_negative_log_likelihood(found.fit.parameters()),
            noise_factor: found.fit.noise.factor,
        }
    }
}

/// The models of an adjustment that began at a fit, with how far the robot lags (s) and minus twice the log likelihood of each; one of them is the answer, and comes
/// first.
pub(crate) fn of_adjustment(begun: &ModelTried, tried: &[(f64, f64)], taken_lag_s: f64) -> Vec<ModelTried> {
    let of = |(lag_s, twice_negative_log): &(f64, f64)| {
        let because = match (*lag_s == taken_lag_s, *lag_s > 0.0) {
            (true, false) => Because::Asked,
            (true, true) => Because::ResidualsShowLag,
            (false, _) => Because::TestsLag,
        };
        let log_likelihood = -0.5 * twice_negative_log;
        let feature_bias = role(begun.feature_bias != Role::Held, false);
        ModelTried { because, robot_lag_s: *lag_s, log_likelihood, feature_bias, ..begun.clone() }
    };
    let mut models: Vec<ModelTried> = tried.iter().map(of).collect();
    models.sort_by_key(|model| !model.because.is_taken());
    models.push(ModelTried { because: Because::NoiseAlone, ..begun.clone() });
    models
}

fn role(is_estimated: bool, is_considered: bool) -> Role {
    match (is_estimated, is_considered) {
        (true, _) => Role::Estimated,
        (false, true) => Role::Considered,
        (false, false) => Role::Held,
    }
}

/// The models of another calibration of the scan, which was made beside the answer.
pub(crate) fn beside(models: &[ModelTried], because: Because) -> impl Iterator<Item = ModelTried> {
    models.iter().map(move |model| {
        let own = if model.because.is_taken() { because } else { model.because };
        ModelTried { because: own, ..model.clone() }
    })
}
