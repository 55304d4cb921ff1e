//! The fit that is concluded from: to features that do not shift with the tilt, where that is estimated, and what is left of
//! their residuals.

use crate::assess::cause_kind::CauseKind;
use crate::assess::correlated_noise::Structure;
use crate::assess::misfit_cause::{self, MisfitCause};
use crate::assess::misfit_patterns::Patterns;
use crate::assess::observability::Observability;
use crate::assess::systematic::SystematicLevels;
use crate::config::Config;
use crate::error::Error;
use crate::hypotheses::clock_drift::DriftFree;
use crate::hypotheses::feature_bias::{BiasFree, BiasHypothesis, TakenBias, remove_bias};
use crate::problem::parameters::LINES;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use trueline_dataset::Recording;
use trueline_lsq::Information;

/// A fit to features that do not shift with the tilt, and what is left of their residuals.
pub struct Unbiased {
    /// The fit, at the optimum by noise as correlated as it was found to be.
    pub assessed: Assessed,
    /// What its residuals are.
    pub structure: Structure,
    /// What explains the residuals and is no bias with the tilt.
    pub cause: Option<MisfitCause>,
    /// The bias that was taken out.
    pub bias: Option<TakenBias>,
}

impl Unbiased {
    /// How large the errors that are no noise are taken to be, `taken` being what was assumed of them.
    #[must_use]
    pub(crate) fn levels(&self, taken: SystematicLevels) -> SystematicLevels {
        let estimated = |bias: &TakenBias| SystematicLevels { bias_is_estimated: true, ..bias.levels };
        self.bias.as_ref().map_or(taken, estimated)
    }

    /// Whether a cause is known that is not the robot's accuracy.
    #[must_use]
    pub(crate) fn is_explained(&self) -> bool {
        self.cause.is_some() || self.bias.as_ref().is_some_and(|bias| bias.is_plain)
    }
}

/// Residuals that are alike by more than this once a bias is taken out are not those of a bias.
const ALIKE_WITHOUT_BIAS: f64 = 0.2;

/// The fit without a bias. Residuals that are alike from one to the next tell less of a bias than they seem to, and only
/// without a bias it is seen whether they are.
///
/// # Errors
/// As `remove_bias`.
pub fn without_bias(
    assessed: Assessed,
    recording: &Recording,
    settings: &FitSettings<'_>,
    levels: &SystematicLevels,
) -> Result<Unbiased, Error> {
    let left = |assessed: &Assessed| structure(&assessed.drift_free, settings.config, &assessed.information);
    let with = |mut assessed: Assessed, structure: Structure, bias: Option<TakenBias>| {
        let cause = cause(recording, settings, &assessed).filter(|cause| cause.kind != CauseKind::TiltBias);
        if let Structure::Correlated(noise) = &structure {
            assessed.drift_free.fit.solution.state = noise.at.clone();
        }
        Unbiased { assessed, structure, cause, bias }
    };
    let cause = cause(recording, settings, &assessed);
    // What has another cause would only be taken for a bias.
    let other = cause.as_ref().is_some_and(|cause| cause.kind != CauseKind::TiltBias);
    let is_likely = cause.is_some_and(|cause| cause.left < ALIKE_WITHOUT_BIAS);
    let mut hypothesis = BiasHypothesis { levels: *levels, inflation: 1.0, is_likely };
    let free = if other { None } else { assessed.without_bias(settings, &hypothesis)? };
    let Some((free, taken)) = free else {
        let structure = left(&assessed);
        return Ok(with(assessed, structure, None));
    };
    let structure = left(&free);
    hypothesis.inflation = inflation(&structure, &free.information);
    if hypothesis.inflation == 1.0 {
        return Ok(with(free, structure, Some(taken)));
    }
    let again = assessed.without_bias(settings, &hypothesis)?;
    let (assessed, taken) = again.map_or((assessed, None), |(free, taken)| (free, Some(taken)));
    let structure = left(&assessed);
    Ok(with(assessed, structure, taken))
}

/// What explains the residuals at the optimum of white noise.
fn cause(recording: &Recording, settings: &FitSettings<'_>, assessed: &Assessed) -> Option<MisfitCause> {
    if !assessed.all_observable() || assessed.drift_free.fit.prior.is_some() || !settings.fixed.is_empty() {
        return None;
    }
    let fit = &assessed.drift_free.fit;
    let problem = fit.problem(&assessed.drift_free.observations, settings.config);
    let root = assessed.information.covariance_root();
    misfit_cause::find(&Patterns::of(recording, &problem, fit.parameters(), root))
}

/// How much larger the covariance by noise is than by white noise, on average over time offset and hand-eye.
#[must_use]
pub(crate) fn inflation(structure: &Structure, information: &Information) -> f64 {
    let Structure::Correlated(noise) = structure else { return 1.0 };
    let white = information.covariance();
    let ratios = (0..LINES).map(|k| noise.covariance[(k, k)] / white[(k, k)]);
    (ratios.sum::<f64>() / LINES as f64).max(1.0)
}

/// A fit and what the scan shows of its unknowns.
pub struct Assessed {
    /// Observations and fit.
    pub drift_free: DriftFree,
    /// What is known from it.
    pub information: Information,
    /// What the scan shows.
    pub observability: Observability,
}

impl Assessed {
    /// Whether the scan shows all of time offset and hand-eye.
    #[must_use]
    pub(crate) fn all_observable(&self) -> bool {
        self.observability.observable_components[..LINES].iter().all(|seen| *seen)
    }

    /// The same with features that do not shift with the tilt, and how far they did; `None` where that bias cannot be
    /// estimated or it does not pay.
    fn without_bias(
        &self,
        settings: &FitSettings<'_>,
        hypothesis: &BiasHypothesis,
    ) -> Result<Option<(Self, TakenBias)>, Error> {
        // A sensor that is held would leave its errors to the bias, and so would what is held at a guess.
        let held = settings.shape_prior.is_none() || self.drift_free.fit.prior.is_some();
        let assumed = hypothesis.levels.feature_bias_px > 0.0;
        if held || !settings.fixed.is_empty() || !assumed || !self.all_observable() {
            return Ok(None);
        }
        let solver = Solver { observations: &self.drift_free.observations, settings: *settings };
        let free = remove_bias(&solver, &self.drift_free.fit, &self.information, hypothesis)?;
        Ok(free.map(|BiasFree { observations, fit, information, taken }| {
            let drift_free = DriftFree { observations, fit, ..self.drift_free };
            (Self { drift_free, information, observability: self.observability.clone() }, taken)
        }))
    }
}

/// What the residuals are; where something is held at a guess, generalised least squares does not know of it.
fn structure(drift_free: &DriftFree, config: &Config, information: &Information) -> Structure {
    let fit = &drift_free.fit;
    if fit.prior.is_some() {
        return Structure::Unknown;
    }
    let problem = fit.problem(&drift_free.observations, config);
    Structure::of(&problem, fit.parameters(), information.covariance_root())
}
