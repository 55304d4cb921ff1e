//! The fit that conclusions are drawn from: to features without their bias with the tilt, where that is estimated, with the remaining residuals.

use crate::assess::cause_kind::CauseKind;
use crate::assess::correlated_noise::{Over, Structure};
use crate::assess::levels::SystematicLevels;
use crate::assess::misfit_cause::{self, MisfitCause};
use crate::assess::misfit_patterns::Patterns;
use crate::assess::observability::Observability;
use crate::config::Config;
use crate::error::Error;
use crate::hypotheses::clock_drift::DriftFree;
use crate::hypotheses::feature_bias::{BiasFree, BiasHypothesis, BiasSearch, TakenBias};
use crate::input::observations::Observations;
use crate::problem::parameters::LINES;
use crate::solve::fit::Fit;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use trueline_dataset::Recording;
use trueline_lsq::Information;

/// A fit to features without a bias with the tilt, and the remaining residuals.
pub struct Unbiased {
    /// The fit, at the optimum for the estimated correlation of the noise.
    pub assessed: Assessed,
    /// Structure of its residuals.
    pub structure: Structure,
    /// A cause of the residuals other than a bias with the tilt.
    pub cause: Option<MisfitCause>,
    /// The bias that was removed.
    pub bias: Option<TakenBias>,
}

impl Unbiased {
    /// An adjustment of all errors leaves only a wrong lens to find. The lens has no assumed error level and is corrected instead.
    #[must_use]
    pub(crate) fn beside_all(assessed: Assessed, recording: &Recording, settings: &FitSettings<'_>) -> Self {
        let cause = cause(recording, settings, &assessed).filter(|cause| cause.kind == CauseKind::Lens);
        Self { assessed, structure: Structure::Unknown, cause, bias: None }
    }

    /// Levels of the systematic errors. `taken` are the assumed ones.
    #[must_use]
    pub(crate) fn levels(&self, taken: SystematicLevels) -> SystematicLevels {
        let estimated = |bias: &TakenBias| SystematicLevels { bias_is_estimated: true, ..bias.levels };
        self.bias.as_ref().map_or(taken, estimated)
    }

    /// Whether a cause other than the robot's accuracy is known.
    #[must_use]
    pub(crate) fn is_explained(&self) -> bool {
        self.cause.is_some() || self.bias.as_ref().is_some_and(|bias| bias.is_plain)
    }
}

/// Residuals with a higher correlation than this after removal of a bias have another cause.
const ALIKE_WITHOUT_BIAS: f64 = 0.2;

/// Fits without a bias. Correlated residuals have less information on a bias than white ones, and their correlation is visible only after removal of
/// the bias.
///
/// # Errors
/// Those of the solver.
pub fn without_bias(
    assessed: Assessed,
    recording: &Recording,
    settings: &FitSettings<'_>,
    levels: &SystematicLevels,
) -> Result<Unbiased, Error> {
    let with = |mut assessed: Assessed, structure: Structure, bias: Option<TakenBias>| {
        let cause = cause(recording, settings, &assessed).filter(|cause| cause.kind != CauseKind::TiltBias);
        if let Structure::Correlated(noise) = &structure {
            assessed.drift_free.fit.solution.state = noise.at.clone();
        }
        Unbiased { assessed, structure, cause, bias }
    };
    let cause = cause(recording, settings, &assessed);
    // An error with another cause would only be mistaken for a bias.
    let other = cause.as_ref().is_some_and(|cause| cause.kind != CauseKind::TiltBias);
    let is_likely = cause.is_some_and(|cause| cause.left < ALIKE_WITHOUT_BIAS);
    let mut hypothesis = BiasHypothesis { levels: *levels, inflation: 1.0, is_likely };
    let search = if other { None } else { assessed.bias_search(settings, levels) };
    let free = search.as_ref().map_or(Ok(None), |search| search.remove(&hypothesis, None))?;
    let (Some(search), Some(mut free)) = (search, free) else {
        let structure = assessed.structure(settings.config);
        return Ok(with(assessed, structure, None));
    };
    let of_free = |free: &BiasFree, over: Over| {
        structure(&free.observations, &free.fit, &free.information, settings.config, over)
    };
    // Correlated noise reduces the information here. It is tested again when the bias is known.
    let structure = of_free(&free, Over::Stretches);
    hypothesis.inflation = inflation(&structure, &free.information);
    if hypothesis.inflation != 1.0 {
        let Some(again) = search.remove(&hypothesis, Some(&free))? else {
            let structure = assessed.structure(settings.config);
            return Ok(with(assessed, structure, None));
        };
        free = again;
    }
    let structure = match structure {
        Structure::Correlated(_) => of_free(&free, Over::Scan),
        white => white,
    };
    let taken = free.taken;
    Ok(with(assessed.freed(free), structure, Some(taken)))
}

/// The cause of the residuals at the optimum for white noise.
fn cause(recording: &Recording, settings: &FitSettings<'_>, assessed: &Assessed) -> Option<MisfitCause> {
    if !assessed.all_observable() || assessed.drift_free.fit.prior.is_some() || !settings.fixed.is_empty() {
        return None;
    }
    let fit = &assessed.drift_free.fit;
    let problem = fit.problem(&assessed.drift_free.observations, settings.config);
    let root = assessed.information.covariance_root();
    misfit_cause::find(&Patterns::of(recording, &problem, fit.parameters(), root))
}

/// Ratio of the covariance from correlated noise to that from white noise, averaged over time offset and hand-eye.
#[must_use]
pub(crate) fn inflation(structure: &Structure, information: &Information) -> f64 {
    let Structure::Correlated(noise) = structure else { return 1.0 };
    let white = information.covariance();
    // A held component has no variance.
    let ratios = (0..LINES).filter(|k| white[(*k, *k)] > 0.0);
    let ratios: Vec<f64> = ratios.map(|k| noise.covariance[(k, k)] / white[(k, k)]).collect();
    (ratios.iter().sum::<f64>() / ratios.len().max(1) as f64).max(1.0)
}

/// A fit with its information and observability.
pub struct Assessed {
    /// Observations and fit.
    pub drift_free: DriftFree,
    /// The information from it.
    pub information: Information,
    /// Observability of the scan.
    pub observability: Observability,
}

impl Assessed {
    /// Whether time offset and hand-eye are both fully observable.
    #[must_use]
    pub(crate) fn all_observable(&self) -> bool {
        self.observability.observable_components[..LINES].iter().all(|seen| *seen)
    }

    /// The search for a bias with the tilt, if one can be estimated.
    fn bias_search<'a>(
        &'a self,
        settings: &FitSettings<'a>,
        levels: &SystematicLevels,
    ) -> Option<BiasSearch<'a>> {
        let DriftFree { observations, fit, .. } = &self.drift_free;
        // The errors of a held sensor, or of components held at a guess, would be absorbed by the bias.
        let held = settings.shape_prior.is_none() || fit.prior.is_some();
        let assumed = levels.feature_bias_px > 0.0;
        if held || !settings.fixed.is_empty() || !assumed || !self.all_observable() {
            return None;
        }
        let solver = Solver { observations, settings: *settings };
        Some(BiasSearch::new(solver, fit, &self.information, levels))
    }

    /// The same with features whose bias was removed.
    fn freed(&self, free: BiasFree) -> Self {
        let BiasFree { observations, fit, information, .. } = free;
        let drift_free = DriftFree { observations, fit, ..self.drift_free };
        Self { drift_free, information, observability: self.observability.clone() }
    }

    fn structure(&self, config: &Config) -> Structure {
        let DriftFree { observations, fit, .. } = &self.drift_free;
        structure(observations, fit, &self.information, config, Over::Scan)
    }
}

/// Structure of the residuals. Generalised least squares ignores components held at a guess.
fn structure(
    observations: &Observations,
    fit: &Fit,
    information: &Information,
    config: &Config,
    over: Over,
) -> Structure {
    if fit.prior.is_some() {
        return Structure::Unknown;
    }
    let problem = fit.problem(observations, config);
    Structure::of(&problem, fit.parameters(), information.covariance_root(), over)
}
