//! The plates beside a curve: whether their stripes or the seam points give the answer.

use crate::assess::seam_error::Share;
use crate::calibrate::curved::scan::Scan;
use crate::config::{Config, Measurements};
use crate::curve::answer::Answered;
use crate::curve::arrow::SHARED;
use crate::curve::drift::DriftFree;
use crate::curve::readings::{Light, SupportPoint};
use crate::curve::with_plates::WithPlates;
use crate::error::Error;
use crate::error::no_plates::NoPlates;
use crate::findings::ClockFindings;
use crate::stripe::agreement::{AGREEMENT_SIGMAS, sigmas_apart};
use crate::stripe::frames::{Sight, StripeFrames, Support, frames};
use crate::stripe::outcome::{
    Answer, Apart, Because, LEAST_WITH_BOTH, StripeEstimate, StripeOutcome, decided,
};
use crate::stripe::outlier_counts::OutlierCounts;
use nalgebra::{DMatrix, DVector, Vector3};
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
    /// point only if both are requested. The stripes have the recorded stamps: where seam points drift, these may not.
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
        let (used, others) = match config.measurements {
            Measurements::Both => (Measurements::Both, Light::Point),
            _ => (Measurements::Stripe, Light::Unused),
        };
        let found = usable(&seam.answer).and_then(|()| {
            let asked = self.asked(guess, config);
            let found =
                asked.with_plates(&seam.answer, (&self.lights(&frames, others), others), self.rate_sigma_ppm);
            let found = found.ok_or(Because::Plates(NoPlates::NoPlane))?;
            let unbent = || asked.without_bends(&seam.answer, &found, self.rate_sigma_ppm);
            let distance = Distance::between((&seam.answer, &found.free.answer), unbent);
            let estimate = self.estimate(recording, config, (&seam.answer, &found), distance.sigmas);
            Ok((found, estimate.map_err(Because::Plates)?, distance.is_of_bends))
        });
        let kept = |because: Because, estimate: Option<StripeEstimate>| StripeOutcome {
            used: Measurements::Seam,
            because,
            frames: frames.total,
            with_both: frames.with_both,
            skipped: frames.skipped_at(&self.observations, seam.answer.at().time_offset_s),
            stamped_later_s: frames.stamped_later_s,
            estimate: estimate.map(Box::new),
        };
        let (found, estimate, is_of_bends) = match found {
            Ok(found) => found,
            Err(Because::Plates(why)) if is_asked => return Err(Error::NoPlates { why }),
            Err(_) if is_asked => return Err(Error::StripesHeldAtGuess),
            Err(because) => {
                let stripes = Some(kept(because, None));
                return Ok(Chosen { stripes, ..seam });
            }
        };
        let enough = frames.with_both as f64 >= LEAST_WITH_BOTH * frames.total as f64;
        let because = match (is_asked, enough || is_of_bends) {
            (true, _) => Because::Asked,
            (false, false) => Because::TooFewFrames,
            (false, true) => match decided(&estimate) {
                // The seam points are the worse ones, however many and sure they are.
                Because::KnowsLess if is_of_bends && estimate.stripe.seam_error.is_some() => {
                    Because::Agreement
                }
                because => because,
            },
        };
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

    /// The light of each reading: the support points of those with stripes on both plates, and that of the others.
    fn lights(&self, frames: &StripeFrames, others: Light) -> Vec<Light> {
        let sheet = &self.observations.sheet;
        let point = |support: Support| SupportPoint {
            point: sheet.point(&support.reported),
            in_sheet: support.reported,
            variance: support.sigma_m.powi(2),
        };
        let mut lights = vec![others; self.readings.list.len()];
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
            planes: Vec::new(),
            angles: Vec::new(),
            steps: Vec::new(),
            sigmas_apart,
            apart: self.in_lengths(seam, &found.free.answer),
            noise_factor: found.free.answer.finished.factor,
            counts,
            explains_robot: false,
            seam: answer(seam),
            stripe: answer(&found.free.answer),
        })
    }

    /// Distance of two answers: in time, and at the middle of the visible part.
    fn in_lengths(&self, one: &Answered, other: &Answered) -> Apart {
        let points = || self.readings.list.iter().map(|reading| reading.point);
        let middle = points().sum::<Vector3<f64>>() / points().count().max(1) as f64;
        let in_tool = |of: &Answered| of.at().tool_from_camera.transform_point(&middle.into());
        Apart {
            time_offset_s: other.at().time_offset_s - one.at().time_offset_s,
            point_m: (in_tool(other) - in_tool(one)).norm(),
        }
    }
}

/// Whether plates can improve an answer: they need one that is not refused anyway.
fn usable(seam: &Answered) -> Result<(), Because> {
    let is_held = seam.is_held || seam.curve.is_one_pass;
    let is_free = seam.finished.fitted.state.placed.is_none() && seam.curve.seams.len() == 1;
    let is_seen = seam.components.iter().all(|seen| *seen) && seam.open().next().is_none();
    match (is_held, is_free && is_seen) {
        (true, _) => Err(Because::HeldAtGuess),
        (false, false) => Err(Because::ShowsLess),
        (false, true) => Ok(()),
    }
}

/// Distance of the answers.
struct Distance {
    /// σ, without the part that the bends of the stripes explain.
    sigmas: Option<f64>,
    /// Whether they disagree but for that part: the seam points are beside the seam.
    is_of_bends: bool,
}

impl Distance {
    fn between((seam, plates): (&Answered, &Answered), unbent: impl Fn() -> Option<DriftFree>) -> Self {
        let disagree = |sigmas: &f64| *sigmas >= AGREEMENT_SIGMAS;
        let plain = apart(seam, plates);
        let explained = plain.filter(disagree).and_then(|_| apart(&unbent()?.answer, plates));
        let explained = explained.filter(|sigmas| !disagree(sigmas));
        Self { sigmas: explained.or(plain), is_of_bends: explained.is_some() }
    }
}

/// Distance of the answers, σ. Of errors that both share only the difference of their effects counts.
fn apart(seam: &Answered, plates: &Answered) -> Option<f64> {
    let difference = crate::curve::sight::step_between(&seam.at(), &plates.at());
    let of_noise = seam.noise + plates.noise;
    let mut covariance = DMatrix::from_fn(SHARED, SHARED, |i, j| of_noise[(i, j)]);
    for share in &plates.shares {
        let is_same = |other: &&Share| other.of == share.of && other.columns.shape() == share.columns.shape();
        let columns = match seam.shares.iter().find(is_same) {
            Some(other) => &share.columns - &other.columns,
            None => share.columns.clone(),
        };
        covariance += &columns * columns.transpose();
    }
    sigmas_apart(&DVector::from_column_slice(difference.as_slice()), &covariance)
}
