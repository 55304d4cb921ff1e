//! The plates beside a curve: whether their stripes or the seam points give the answer.

use crate::assess::seam_error::Share;
use crate::calibrate::curved::scan::Scan;
use crate::config::{Config, Measurements};
use crate::curve::answer::Answered;
use crate::curve::arrow::SHARED;
use crate::curve::readings::SupportPoint;
use crate::curve::rows::ROWS;
use crate::curve::with_plates::WithPlates;
use crate::error::Error;
use crate::error::no_plates::NoPlates;
use crate::stripe::agreement::sigmas_apart;
use crate::stripe::frames::{Sight, StripeFrames, Support, frames};
use crate::stripe::outcome::{Answer, Apart, Because, LEAST_WITH_BOTH, StripeEstimate, StripeOutcome, decided};
use crate::stripe::outlier_counts::OutlierCounts;
use nalgebra::{DMatrix, DVector, Vector3};
use trueline_dataset::{Guess, Recording};

/// An answer, and what became of the stripes. `None` if there are none, or only seam points are requested.
type Chosen = (Answered, Option<StripeOutcome>);

impl Scan {
    /// The answer of the seam points, or of the stripes beside them, as the user requests. Where a frame has no stripe on one of the plates, its seam
    /// point is used.
    ///
    /// # Errors
    /// The stripes were requested and cannot be used.
    pub(crate) fn with_plates(
        &self,
        recording: &Recording,
        (guess, config): (Option<&Guess>, &Config),
        seam: Answered,
    ) -> Result<Chosen, Error> {
        let is_asked = matches!(config.measurements, Measurements::Stripe | Measurements::Both);
        if config.measurements == Measurements::Seam || recording.stripes.is_empty() {
            return if is_asked { Err(Error::NoStripes) } else { Ok((seam, None)) };
        }
        let frames = frames(recording, &self.observations, Measurements::Both, config)?;
        let kept = |because: Because, estimate: Option<StripeEstimate>| StripeOutcome {
            used: Measurements::Seam,
            because,
            frames: frames.total,
            with_both: frames.with_both,
            skipped: frames.skipped_at(&self.observations, seam.at().time_offset_s),
            stamped_later_s: frames.stamped_later_s,
            estimate: estimate.map(Box::new),
        };
        let found = match usable(&seam) {
            Ok(()) => self.asked(guess, config).with_plates(&seam, &self.supports(&frames)),
            Err(_) if is_asked => return Err(Error::StripesHeldAtGuess),
            Err(because) => {
                let outcome = kept(because, None);
                return Ok((seam, Some(outcome)));
            }
        };
        let estimate = found.ok_or(NoPlates::NoPlane).and_then(|found| {
            let estimate = self.estimate(recording, config, (&seam, &found))?;
            Ok((found.answer, estimate))
        });
        let (answer, estimate) = match estimate {
            Ok(found) => found,
            Err(why) if is_asked => return Err(Error::NoPlates { why }),
            Err(why) => {
                let outcome = kept(Because::Plates(why), None);
                return Ok((seam, Some(outcome)));
            }
        };
        let enough = frames.with_both as f64 >= LEAST_WITH_BOTH * frames.total as f64;
        let because = match (is_asked, enough) {
            (true, _) => Because::Asked,
            (false, false) => Because::TooFewFrames,
            (false, true) => decided(&estimate),
        };
        let outcome = kept(because, Some(estimate));
        Ok(match because {
            Because::Asked | Because::Agreement => {
                (answer, Some(StripeOutcome { used: Measurements::Both, ..outcome }))
            }
            _ => (seam, Some(outcome)),
        })
    }

    /// The support points of each reading with stripes on both plates.
    fn supports(&self, frames: &StripeFrames) -> Vec<Option<[SupportPoint; ROWS]>> {
        let sheet = &self.observations.sheet;
        let point = |support: Support| SupportPoint {
            point: sheet.point(&support.reported),
            in_sheet: support.reported,
            variance: support.sigma_m.powi(2),
        };
        let mut supports = vec![None; self.readings.list.len()];
        for frame in &frames.list {
            if let (Sight::Stripes([Some([a, b]), Some([c, d])]), Some(seam)) = (&frame.sight, &frame.edge) {
                supports[seam.observation] = Some([*a, *b, *c, *d].map(point));
            }
        }
        supports
    }

    /// Both answers and the distance between them.
    fn estimate(
        &self,
        recording: &Recording,
        config: &Config,
        (seam, found): (&Answered, &WithPlates),
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
            sigmas_apart: apart(seam, &found.answer),
            apart: self.in_lengths(seam, &found.answer),
            noise_factor: found.answer.finished.factor,
            counts,
            explains_robot: false,
            seam: answer(seam),
            stripe: answer(&found.answer),
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
