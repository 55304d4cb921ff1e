//! Cross-validation: each pass over the line, or block of time, is left out in turn and predicted from the rest.

use crate::assess::leave_one_out::{LeftOut, PartSums};
use crate::config::Config;
use crate::input::observations::{Observation, Observations};
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::{LINES, Parameters};
use crate::problem::placement::placement;
use crate::solve::fit::Fit;
use nalgebra::{DMatrix, SVector};
use trueline_lsq::Information;

/// Result of leaving out one part.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// First and last stamp, s.
    pub span_s: [f64; 2],
    /// RMS distance of its points from the line predicted by the rest, m.
    pub rms_m: f64,
    /// Change of the estimate without it (s, rad, m).
    pub moved: SVector<f64, LINES>,
    /// The same in standard deviations from noise. 0 where it is undefined.
    pub sigmas: SVector<f64, LINES>,
}

/// The check's result.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Whether the parts are passes over the line; else blocks of time.
    pub passes: bool,
    /// The parts.
    pub parts: Vec<Part>,
    /// RMS over all parts, m.
    pub rms_m: f64,
    /// RMS of the fit over the same points, m.
    pub fitted_rms_m: f64,
    /// Expected value of `rms_m` from noise alone: fitted residual and uncertainty of the unknowns from the rest, m.
    pub expected_rms_m: f64,
}

/// Blocks of time, if there are fewer passes.
const BLOCKS: usize = 5;
/// A turn-around counts if the scan then runs back by this fraction of its length.
const PASS_PART: f64 = 0.3;
/// If a variance grows by more than this without a part, the information came from that part.
const FAR_WIDER: f64 = 24.0;
/// Features of less weight are ignored.
const LEAST_WEIGHT: f64 = 1e-2;

/// Inputs of the check from a finished fit.
pub struct Subject<'a> {
    /// Observations.
    pub observations: &'a Observations,
    /// The fit.
    pub fit: &'a Fit,
    /// Components that were held.
    pub fixed: &'a [usize],
    /// Threshold of the rank.
    pub rank_threshold: f64,
    /// For each component, whether it is observable.
    pub seen: &'a [bool],
    /// Ratio of each sensor unknown's variance to that of H⁻¹.
    pub inflation: SVector<f64, LINES>,
}

/// Leaves each part out in turn; `None` if the scan is too short for parts.
#[must_use]
pub fn check(subject: &Subject<'_>, config: &Config) -> Option<HeldOut> {
    let _stage = tracing::debug_span!("cross_validation").entered();
    let list = subject.fit.placed.of(subject.observations);
    let at = subject.fit.parameters();
    let edges = pass_edges(subject.observations, list, at);
    let passes = edges.len() > 3;
    let edges = if passes { edges } else { block_edges(list)? };
    let problem = problem(subject, config, list);
    let carried = carrying(&problem, at);
    let ranges = edges.windows(2).map(|edge| edge[0]..edge[1]);
    let sums = PartSums::of(&problem, ranges.clone(), at, subject.fixed);
    let covariance = covariance_of(&subject.fit.solution.equations.hessian, subject)?;
    let mut parts = Vec::new();
    let (mut sum, mut fitted_sum, mut lever_sum, mut count) = (0.0, 0.0, 0.0, 0_usize);
    for (k, range) in ranges.enumerate() {
        let (part, weights) = (&list[range.clone()], &carried[range]);
        let LeftOut { at: without, hessian } = sums.without(k)?;
        let own = squared_distances(subject.observations, part, weights, &without);
        let fitted = squared_distances(subject.observations, part, weights, at);
        let moved = without.minus(&at.guess());
        let wide = covariance_of(&hessian, subject)?;
        lever_sum += lever(subject, part, weights, &without, &wide);
        let wider = wide - &covariance;
        let sigmas = SVector::from_fn(|k, _| {
            let variance = wider[(k, k)] * subject.inflation[k];
            // A component that the rest hardly determines is skipped.
            let knows = wider[(k, k)] < FAR_WIDER * covariance[(k, k)];
            if subject.seen[k] && knows && variance > 1e-6 * covariance[(k, k)] {
                moved[k] / variance.sqrt()
            } else {
                0.0
            }
        });
        sum += own.iter().sum::<f64>();
        fitted_sum += fitted.iter().sum::<f64>();
        count += own.len();
        parts.push(Part {
            span_s: [part.first()?.stamp_s, part.last()?.stamp_s],
            rms_m: root_mean(own.iter().sum(), own.len()),
            moved,
            sigmas,
        });
    }
    let (rms_m, fitted_rms_m) = (root_mean(sum, count), root_mean(fitted_sum, count));
    let expected_rms_m = root_mean(fitted_sum + lever_sum, count);
    Some(HeldOut { passes, parts, rms_m, fitted_rms_m, expected_rms_m })
}

fn root_mean(sum: f64, count: usize) -> f64 {
    (sum / count.max(1) as f64).sqrt()
}

fn covariance_of(hessian: &DMatrix<f64>, subject: &Subject<'_>) -> Option<DMatrix<f64>> {
    let known = subject.fit.parameters().unknowns().known_before();
    Some(Information::beside(hessian, subject.fixed, known, subject.rank_threshold)?.covariance())
}

fn problem<'a>(subject: &Subject<'a>, config: &Config, list: &'a [Observation]) -> LineProblem<'a> {
    let criterion = Criterion { residual: config.residual, loss: config.final_loss() };
    let fit = subject.fit;
    LineProblem::new(subject.observations, list, criterion, &fit.noise, &fit.whitened_at)
        .with_prior(fit.prior.clone())
        .with_shape_prior(fit.shape_prior)
}

/// Whether each observation has weight in the fit.
fn carrying(problem: &LineProblem<'_>, at: &Parameters) -> Vec<bool> {
    let carries = |squared: f64| problem.loss.weight(squared) > LEAST_WEIGHT;
    problem.squared_residual_of_each(at).into_iter().map(carries).collect()
}

fn squared_distances(
    observations: &Observations,
    list: &[Observation],
    carried: &[bool],
    at: &Parameters,
) -> Vec<f64> {
    let squared = |(o, _): (&Observation, &bool)| {
        let point = at.corrected(&observations.sheet, &o.point_in_camera);
        let point = placement(observations, o, at)?.point_in_base(&point);
        Some(at.offset_from_seam(o.line as usize, &point).norm_squared())
    };
    list.iter().zip(carried).filter(|(_, carried)| **carried).filter_map(squared).collect()
}

/// Sum of the squared distances of a part's points from the line, from the uncertainty of the unknowns in the rest.
fn lever(
    subject: &Subject<'_>,
    list: &[Observation],
    carried: &[bool],
    at: &Parameters,
    covariance: &DMatrix<f64>,
) -> f64 {
    let squared = |(o, _): (&Observation, &bool)| {
        let placement = placement(subject.observations, o, at)?;
        let line = &at.lines[o.line as usize];
        let point = at.corrected(&subject.observations.sheet, &o.point_in_camera);
        let parts = trueline_model::point_to_line::linearize(&placement, &point, line);
        let mut jacobian = DMatrix::zeros(2, covariance.nrows());
        jacobian.view_mut((0, 0), (2, LINES)).copy_from(&parts.by_links(&placement));
        jacobian
            .view_mut((0, crate::problem::parameters::line_index(o.line as usize)), (2, 4))
            .copy_from(&parts.d_line);
        Some((&jacobian * covariance * jacobian.transpose()).trace())
    };
    // Every tenth point is sufficient.
    let (mut sum, mut count) = (0.0, 0);
    for value in list.iter().zip(carried).filter(|(_, carried)| **carried).step_by(10).filter_map(squared) {
        sum += value;
        count += 1;
    }
    sum / f64::from(count.max(1)) * carried.iter().filter(|carried| **carried).count() as f64
}

/// Blocks of about equal numbers of observations. `None` with fewer observations than blocks, which happens if a fit ended far from its start.
fn block_edges(list: &[Observation]) -> Option<Vec<usize>> {
    if list.len() < BLOCKS {
        return None;
    }
    let mut edges: Vec<usize> = (0..=BLOCKS).map(|k| k * list.len() / BLOCKS).collect();
    // An image is never divided.
    for edge in &mut edges[1..BLOCKS] {
        while *edge < list.len() && list[*edge].frame == list[*edge - 1].frame {
            *edge += 1;
        }
    }
    edges.dedup();
    Some(edges)
}

/// Indices at which the scan turns around along the line.
fn pass_edges(observations: &Observations, list: &[Observation], at: &Parameters) -> Vec<usize> {
    let along: Vec<f64> = list
        .iter()
        .map(|o| {
            let line = &at.lines[o.line as usize];
            placement(observations, o, at).map_or(f64::NAN, |placement| {
                line.direction().dot(&(placement.base_from_tool.translation.vector - line.anchor()))
            })
        })
        .collect();
    let (low, high) =
        along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| (low.min(*a), high.max(*a)));
    let reach = PASS_PART * (high - low);
    let mut edges = vec![0];
    let (mut extreme, mut forward) = (0, None);
    for (k, value) in along.iter().enumerate() {
        let gone = value - along[extreme];
        match forward {
            None if gone.abs() > reach => (forward, extreme) = (Some(gone > 0.0), k),
            Some(ahead) if (gone > 0.0) == ahead => extreme = k,
            Some(ahead) if gone.abs() > reach => {
                edges.push(extreme);
                (forward, extreme) = (Some(!ahead), k);
            }
            _ => {}
        }
    }
    edges.push(list.len());
    edges
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    /// Observations of images, a number of each.
    fn observations(of_images: &[usize]) -> Vec<Observation> {
        let frames = of_images.iter().enumerate().flat_map(|(frame, count)| vec![frame as u32; *count]);
        let one = |frame| Observation {
            stamp_s: f64::from(frame),
            frame,
            line: 0,
            row: 0,
            per_px: [1.0, 0.0, 1.0],
            point_in_camera: nalgebra::Vector3::zeros(),
            covariance: [1.0, 0.0, 1.0],
        };
        frames.map(one).collect()
    }

    #[test]
    fn blocks_divide_no_image_and_of_fewer_observations_there_are_none() {
        for count in 0..BLOCKS {
            assert_eq!(block_edges(&observations(&vec![1; count])), None, "{count}");
        }
        for images in [vec![1; 5], vec![1; 23], vec![3; 7], vec![9, 1, 1], vec![1, 9, 1], vec![20]] {
            let list = observations(&images);
            let edges = block_edges(&list).unwrap();
            assert_eq!((edges[0], edges.last().copied()), (0, Some(list.len())), "{images:?}");
            for edge in &edges[1..edges.len() - 1] {
                assert_ne!(list[edge - 1].frame, list[*edge].frame, "{images:?}");
            }
            assert!(edges.windows(2).all(|pair| pair[0] < pair[1]), "{images:?}: {edges:?}");
        }
    }
}
