//! The plates beside a curve: whether their stripes or the seam points give the answer.

use crate::assess::share::Share;
use crate::calibrate::curved::scan::Scan;
use crate::config::{Config, Measurements};
use crate::curve::answer::Answered;
use crate::curve::arrow::SHARED;
use crate::curve::drift::DriftFree;
use crate::curve::readings::{Light, SupportPoint};
use crate::curve::solve::READINGS_PER_KNOT;
use crate::curve::spline::LEAST_CONTROL;
use crate::curve::with_plates::WithPlates;
use crate::error::Error;
use crate::error::no_plates::NoPlates;
use crate::findings::ClockFindings;
use crate::stripe::agreement::sigmas_apart;
use crate::stripe::frames::{Sight, StripeFrames, Support, frames};
use crate::stripe::outcome::{AGREEMENT_SIGMAS, Answer, Apart, Because, StripeEstimate, StripeOutcome};
use crate::stripe::outlier_counts::OutlierCounts;
use nalgebra::{DMatrix, DVector};
use trueline_dataset::{Guess, Recording};

/// An answer with what belongs to it.
pub(crate) struct Chosen {
    /// The scan with its stamps.
    pub scan: Scan,
    /// Its clock.
    pub clock: ClockFindings,
    /// The answer.
    pub answer: Answered,
    /// What became of the stripes; `None` if there are none, or only seam points are requested.
    pub stripes: Option<StripeOutcome>,
}

impl Chosen {
    /// An answer without drift to a scan.
    #[must_use]
    pub(crate) fn of(scan: &Scan, free: DriftFree) -> Self {
        let DriftFree { answer, readings, drift, drifted } = free;
        let clock =
            ClockFindings { drift, drifted, step: None, stepped: None, noise_factor_without_step: None };
        Self { scan: scan.dated(readings.as_ref()), clock, answer, stripes: None }
    }
}

impl Scan {
    /// The answer of the seam points, or of the stripes beside them, as the user requests. A frame without a stripe on one of the plates gives its seam
    /// point only if both are requested and bends do not move it. The stripes have the recorded stamps: where seam points drift, these may not.
    ///
    /// # Errors
    /// The stripes were requested and cannot be used.
    pub(crate) fn chosen(
        &self,
        recording: &Recording,
        (guess, config): (Option<&Guess>, &Config),
        seam: Chosen,
    ) -> Result<Chosen, Error> {
        let is_asked = matches!(config.measurements, Measurements::Stripe | Measurements::Both);
        if config.measurements == Measurements::Seam || recording.stripes.is_empty() {
            return if is_asked { Err(Error::NoStripes) } else { Ok(seam) };
        }
        let frames = frames(recording, &self.observations, Measurements::Both, config)?;
        let lights = self.lights(&frames);
        let with_both = lights.iter().filter(|light| matches!(light, Light::Supports(_))).count();
        let kept = |because: Because, estimate: Option<StripeEstimate>| StripeOutcome {
            used: Measurements::Seam,
            because,
            frames: frames.total,
            with_both,
            skipped: frames.skipped_at(&self.observations, seam.answer.at().time_offset_s),
            stamped_later_s: frames.stamped_later_s,
            estimate: estimate.map(Box::new),
        };
        let found = match usable(&seam.answer, is_asked)? {
            Some(because) => Err(because),
            None if with_both < LEAST_FRAMES => {
                Err(Because::Plates(NoPlates::Missing { line: 0, unusable: frames.unplaced() }))
            }
            None => self.beside(recording, (guess, config), (&seam.answer, lights)),
        };
        let Beside { found, estimate, used } = match found {
            Ok(found) => found,
            Err(Because::Plates(why)) if is_asked => return Err(Error::NoPlates { why }),
            Err(because) => {
                let stripes = Some(kept(because, None));
                return Ok(Chosen { stripes, ..seam });
            }
        };
        let because = if is_asked { Because::Asked } else { decided(&estimate) };
        let outcome = kept(because, Some(estimate));
        Ok(match because {
            Because::Asked | Because::Agreement => {
                let stripes = Some(StripeOutcome { used, ..outcome });
                let scan = self.with_readings(found.as_measured(&self.readings));
                Chosen { stripes, ..Chosen::of(&scan, found.free) }
            }
            _ => Chosen { stripes: Some(outcome), ..seam },
        })
    }

    /// The answer of the stripes beside that of the seam points, or why there is none. Seam points of other frames are used if that is requested and
    /// they are no crossings of bent stripes.
    fn beside(
        &self,
        recording: &Recording,
        (guess, config): (Option<&Guess>, &Config),
        (seam, lights): (&Answered, Vec<Light>),
    ) -> Result<Beside, Because> {
        let (asked, rate_ppm) = (self.asked(guess, config), self.rate_sigma_ppm);
        let with = |others: Light| {
            let of = |light: &Light| if matches!(light, Light::Unused) { others } else { *light };
            let lights: Vec<Light> = lights.iter().map(of).collect();
            asked.with_plates(seam, (&lights, others), rate_ppm)
        };
        let alone = with(Light::Unused).ok_or(Because::Plates(NoPlates::NotConverged))?;
        let wants_points = config.measurements == Measurements::Both && !alone.are_bent(&self.readings);
        let both = wants_points.then(|| with(Light::Point)).flatten();
        let used = if both.is_some() { Measurements::Both } else { Measurements::Stripe };
        let found = both.unwrap_or(alone);
        let unbent = || asked.without_bends(seam, &found, rate_ppm);
        let sigmas_apart = unexplained((seam, &found.free.answer), unbent);
        let estimate = self.estimate(recording, config, (seam, &found), sigmas_apart);
        Ok(Beside { estimate: estimate.map_err(Because::Plates)?, found, used })
    }

    /// The light of each reading: the support points of those with stripes on both plates.
    fn lights(&self, frames: &StripeFrames) -> Vec<Light> {
        let sheet = &self.observations.sheet;
        let point = |support: Support| SupportPoint {
            point: sheet.point(&support.reported),
            in_sheet: support.reported,
            variance: support.sigma_m.powi(2),
        };
        let mut lights = vec![Light::Unused; self.readings.list.len()];
        for frame in &frames.list {
            if let (Sight::Stripes([Some([a, b]), Some([c, d])]), Some(seam)) = (&frame.sight, &frame.edge) {
                lights[seam.observation] = Light::Supports([*a, *b, *c, *d].map(point));
            }
        }
        lights
    }

    /// Both answers and the distance between them.
    fn estimate(
        &self,
        recording: &Recording,
        config: &Config,
        (seam, found): (&Answered, &WithPlates),
        sigmas_apart: Option<f64>,
    ) -> Result<StripeEstimate, NoPlates> {
        let outliers = found.outliers();
        let (rejected, stripes) = (2 * outliers.count, 2 * outliers.of);
        if !outliers.leave_a_majority() {
            return Err(NoPlates::Scattered { rejected, stripes });
        }
        let answer = |answered: &Answered| {
            let unknowns = self.unknowns(recording, answered);
            let is_seen = answered.components.iter().all(|seen| *seen);
            Answer {
                seam_error: is_seen.then(|| self.seam_error(answered, config)).flatten(),
                parameters: unknowns.parameters,
                covariance: unknowns.covariance,
                noise_covariance: unknowns.noise_covariance,
                observability: unknowns.observability,
            }
        };
        let counts = OutlierCounts { stripes, rejected_stripes: rejected, ..OutlierCounts::default() };
        Ok(StripeEstimate {
            of_robot: None,
            planes: Vec::new(),
            angles: Vec::new(),
            steps: Vec::new(),
            sigmas_apart,
            apart: {
                let points = self.readings.list.iter().map(|reading| reading.point);
                let [one, other] = [seam.at(), found.free.answer.at()];
                Apart::at(points, [one, other].map(|at| (at.time_offset_s, at.tool_from_camera)))
            },
            noise_factor: found.free.answer.finished.factor,
            counts,
            adjustment: None,
            explains_robot: false,
            seam: answer(seam),
            stripe: answer(&found.free.answer),
        })
    }
}

/// An answer of the stripes.
struct Beside {
    found: WithPlates,
    estimate: StripeEstimate,
    /// Measurements that it uses.
    used: Measurements,
}

/// Fewer frames with both stripes give no answer: those of a curve with eight knots.
const LEAST_FRAMES: usize = READINGS_PER_KNOT * LEAST_CONTROL;

/// Chooses the answer. Over a curve seam points may be beside the seam, however many and sure they are, so the stripes are used if they agree and show
/// everything.
fn decided(estimate: &StripeEstimate) -> Because {
    match estimate.sigmas_apart {
        Some(apart) if apart >= AGREEMENT_SIGMAS => Because::Disagreement,
        _ if estimate.stripe.seam_error.is_none() => Because::ShowsLess,
        _ => Because::Agreement,
    }
}

/// Why stripes are not tried beside an answer; `None` if they are.
///
/// # Errors
/// If there is no way to use them.
fn usable(seam: &Answered, is_asked: bool) -> Result<Option<Because>, Error> {
    let is_held = seam.is_held || seam.curve.is_one_pass;
    let is_seen = seam.components.iter().all(|seen| *seen) && seam.open().next().is_none();
    let why = if seam.finished.fitted.state.placed.is_some() {
        "they are not used together with a drawing. Leave the drawing out"
    } else if seam.curve.seams.len() > 1 {
        "there are several seams. Scan one of them"
    } else if is_held && is_asked {
        "they need more than one pass. Go over the seam two or three times"
    } else {
        return Ok(if is_held {
            Some(Because::HeldAtGuess)
        } else {
            (!is_seen).then_some(Because::ShowsLess)
        });
    };
    Err(Error::StripesBesideCurve { why })
}

/// Distance of the answers, σ, without the part that the bends of the stripes explain.
fn unexplained(
    (seam, plates): (&Answered, &Answered),
    unbent: impl Fn() -> Option<DriftFree>,
) -> Option<f64> {
    let disagree = |sigmas: &f64| *sigmas >= AGREEMENT_SIGMAS;
    let plain = apart(seam, plates);
    let explained = plain.filter(disagree).and_then(|_| apart(&unbent()?.answer, plates));
    explained.filter(|sigmas| !disagree(sigmas)).or(plain)
}

/// Distance of the answers, σ. Of errors that both share only the difference of their effects counts.
fn apart(seam: &Answered, plates: &Answered) -> Option<f64> {
    let difference = crate::curve::sight::step_between(&seam.at(), &plates.at());
    let of_noise = seam.noise + plates.noise;
    let mut covariance = DMatrix::from_fn(SHARED, SHARED, |i, j| of_noise[(i, j)]);
    for share in &plates.shares {
        let is_same = |other: &&Share| other.of == share.of && other.columns.shape() == share.columns.shape();
        let columns = seam.shares.iter().find(is_same).map(|other| &share.columns - &other.columns);
        let columns = columns.unwrap_or_else(|| share.columns.clone());
        covariance += &columns * columns.transpose();
    }
    for share in &seam.shares {
        let is_same = |other: &&Share| other.of == share.of && other.columns.shape() == share.columns.shape();
        if !plates.shares.iter().any(|other| is_same(&other)) {
            covariance += &share.columns * share.columns.transpose();
        }
    }
    sigmas_apart(&DVector::from_column_slice(difference.as_slice()), &covariance)
}
