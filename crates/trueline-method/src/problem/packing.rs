//! Samples kept between sweeps.
//!
//! A solve sweeps a scan at nearly constant time offsets, and gathering the samples takes half of a sweep. The samples are kept from the second
//! sweep at nearly the same time offset on, or from the first if that is known. Scans of more than one chunk would not stay in the processor's
//! caches and are gathered each time.

use crate::problem::simd::{CHUNK, Gathering, Samples, Scan};
use std::sync::{Arc, Mutex, PoisonError};

/// The samples of a scan, in sweep order.
pub(crate) struct Packed {
    /// The samples.
    pub samples: Vec<Samples>,
    time_offset_s: f64,
}

impl Packed {
    fn of(scan: &Scan<'_>) -> Self {
        let (lines, time_offset_s) = (scan.at.lines.len(), scan.at.time_offset_s);
        let gathering = Gathering::new(scan.observations, scan.list, lines, time_offset_s);
        Self { samples: gathering.all(), time_offset_s }
    }
}

/// Keeps the samples of one problem.
#[derive(Default)]
pub(crate) struct Packing(Mutex<Kept>);

#[derive(Default)]
enum Kept {
    /// No sweep yet.
    #[default]
    Nothing,
    /// One sweep, at this time offset, s.
    Offset(f64),
    /// The samples.
    Samples(Arc<Packed>),
}

/// Samples are reused for another time offset within this fraction of the robot's period. Then one of four stamps leaves its segment in the same
/// fraction of cases.
const SAME_PART: f64 = 0.1;

impl Packing {
    /// For a problem that will be swept near this time offset, s.
    pub(crate) fn beside(time_offset_s: f64) -> Self {
        Self(Mutex::new(Kept::Offset(time_offset_s)))
    }

    /// The kept samples for a sweep, if there are any.
    pub(crate) fn samples(&self, scan: &Scan<'_>) -> Option<Arc<Packed>> {
        if scan.list.len() > CHUNK {
            return None;
        }
        // A panic leaves the content intact, because it is replaced in one step.
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let offset_s = scan.at.time_offset_s;
        let same_s = SAME_PART * scan.observations.robot.trajectory.median_period();
        let is_same = |other_s: f64| (offset_s - other_s).abs() < same_s;
        match &*kept {
            Kept::Samples(packed) if is_same(packed.time_offset_s) => return Some(Arc::clone(packed)),
            Kept::Offset(last_s) if is_same(*last_s) => {}
            _ => {
                *kept = Kept::Offset(offset_s);
                return None;
            }
        }
        let packed = Arc::new(Packed::of(scan));
        *kept = Kept::Samples(Arc::clone(&packed));
        Some(packed)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::{Kept, SAME_PART};
    use crate::config::{Config, ResidualKind};
    use crate::input::noise_levels::NoiseLevels;
    use crate::input::observations::{observe, origin_ns};
    use crate::input::timestamps::Sampling;
    use crate::problem::line_problem::{Criterion, LineProblem};
    use crate::problem::parameters::Parameters;
    use trueline_lsq::{LeastSquares, Loss, NormalEquations};
    use trueline_sim::{Preset, simulate};

    /// Samples gathered at another time offset, some of whose stamps have left their segments, give the same sums as new ones. Two lines, with
    /// observations outside the robot's recording.
    #[test]
    fn kept_samples_give_what_new_ones_do() {
        let mut scenario = Preset::TwoLines.scenario();
        scenario.timing.duration_s = 6.0;
        let recording = simulate(&scenario, 3).unwrap();
        let sampling = Sampling::of(&recording, origin_ns(&recording));
        let observed = observe(&recording, &sampling, &Config::default()).unwrap();
        let truth = recording.truth.clone().unwrap();
        let mut at = Parameters::straight(&truth.parameters, truth.lines);
        at.time_offset_s += 0.3;
        let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::GemanMcClure { scale: 1e3 } };
        let noise = NoiseLevels { robot_sigma_m: 2e-5, stamp_sigma_s: 1e-4, factor: 1.0 };
        let sums = |problem: &LineProblem<'_>, at: &Parameters| {
            let mut sums = NormalEquations::zeros(problem.dimension());
            problem.linearize(at, &mut sums);
            sums
        };
        let is_kept =
            |problem: &LineProblem<'_>| matches!(&*problem.packing.0.lock().unwrap(), Kept::Samples(_));
        let problem = LineProblem::new(&observed, &observed.list, criterion, &noise, &at);
        let _gathered_here = sums(&problem, &at);
        let period_s = observed.robot.trajectory.median_period();
        for part in [-0.9 * SAME_PART, 0.0, 0.9 * SAME_PART] {
            let mut beside = at.clone();
            beside.time_offset_s += part * period_s;
            let kept = sums(&problem, &beside);
            assert!(is_kept(&problem), "{part}");
            let whiteners = &problem.whiteners;
            let fresh = LineProblem {
                packing: super::Packing::default(),
                ..problem.of_some(problem.list, whiteners)
            };
            let new = sums(&fresh, &beside);
            assert!(!is_kept(&fresh));
            // Equal except for the order of summation, because some lie outside the recording: some thousand roundings.
            assert!((kept.hessian - &new.hessian).amax() < 1e-11 * new.hessian.amax(), "{part}");
            assert!((kept.gradient - &new.gradient).amax() < 1e-11 * new.gradient.amax(), "{part}");
            assert!((kept.cost - new.cost).abs() < 1e-11 * new.cost, "{part}");
        }
        // Far away they are dropped, and kept again where the offset stays.
        let mut away = at.clone();
        away.time_offset_s -= 0.3;
        let first = sums(&problem, &away);
        assert!(!is_kept(&problem));
        let second = sums(&problem, &away);
        assert!(is_kept(&problem));
        assert!((first.hessian - &second.hessian).amax() < 1e-11 * second.hessian.amax());
    }
}
