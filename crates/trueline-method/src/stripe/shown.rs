//! Observability of the unknowns from the stripes, for the components of a seam.

use crate::assess::observability::{self, Group, Observability, Unobservable};
use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION, line_index};
use crate::stripe::fit::StripeFit;
use crate::stripe::unknowns::StripeUnknowns;
use nalgebra::DMatrix;
use std::collections::BTreeSet;
use trueline_lsq::Information;

/// Observability from the stripes. A target of unknown place does not make a translation observable that the attitudes leave open, nor a time offset
/// that only noise suggests. For both, the seam points' result applies, because it is tested against noise. The rank is that of flat plates. A
/// component is unobservable if the covariance lacks one of its directions.
pub(crate) fn observability(
    before: &Observability,
    fit: &StripeFit<'_>,
    (information, shown): (&Information, &Information),
    at: &Parameters,
) -> Observability {
    let null = &both_null(shown, information);
    let group_of_seam = |group: Group| before.unobservable.iter().find(|u| u.group == group).cloned();
    let shows_time_offset =
        !observability::is_null(null, TIME_OFFSET) && group_of_seam(Group::TimeOffset).is_none();
    let without_lines = Parameters { lines: Vec::new(), curvatures: Vec::new(), ..at.clone() };
    let mut unobservable = observability::named(null, &without_lines, shows_time_offset);
    if !unobservable.iter().any(|u| u.group == Group::Translation) {
        unobservable.extend(group_of_seam(Group::Translation));
    }
    let mut seen = vec![true; at.dimension()];
    seen[TIME_OFFSET] = shows_time_offset;
    let translation = unobservable.iter().any(|u| u.group == Group::Translation);
    for (k, seen) in seen.iter_mut().enumerate().take(LINES).skip(ROTATION) {
        let as_before = k < TRANSLATION || !translation || before.observable_components[k];
        *seen = as_before && !observability::is_null(null, k);
    }
    for joint in 0..at.lines.len() {
        let (one, other) = fit.state().joints[joint].at_seam();
        let surfaces = one.into_iter().flatten().chain([other]);
        let mut rows = surfaces.flat_map(|number| fit.problem.unknowns.plane(joint, number));
        if rows.any(|row| observability::is_null(null, row)) {
            seen[line_index(joint)..line_index(joint + 1)].fill(false);
            unobservable.push(Unobservable { group: Group::Line(joint), directions: Vec::new() });
        }
    }
    let known_before = fit.problem.unknowns.known_before().len();
    let only_noise = !shows_time_offset && !observability::is_null(shown.null_space(), TIME_OFFSET);
    let information = shown;
    let largest = information.singular_values().max().max(f64::MIN_POSITIVE);
    Observability {
        rank: information.rank().saturating_sub(usize::from(only_noise) + known_before),
        size: information.size().saturating_sub(known_before),
        condition: information.condition(),
        singular_values: information.singular_values().iter().map(|value| value / largest).collect(),
        composition: information
            .composition()
            .iter()
            .map(|parts| in_seam(parts, fit.problem.unknowns))
            .collect(),
        unobservable,
        observable_components: seen,
    }
}

/// The null directions of two information matrices, column by column.
pub(crate) fn both_null(one: &Information, other: &Information) -> DMatrix<f64> {
    let (one, other) = (one.null_space(), other.null_space());
    let mut both = one.clone().resize_horizontally(one.ncols() + other.ncols(), 0.0);
    both.columns_mut(one.ncols(), other.ncols()).copy_from(other);
    both
}

/// Maps components of the plates' tangent to the seam's. A plane counts as the line that it bounds.
fn in_seam(parts: &[usize], unknowns: StripeUnknowns) -> Vec<usize> {
    let place = |part: &usize| match *part {
        clock_or_hand_eye @ 0..LINES => clock_or_hand_eye,
        plane => line_index(((plane - LINES) / unknowns.planes_of_joint()).min(unknowns.joints - 1)),
    };
    let mut named: Vec<usize> = parts.iter().map(place).collect();
    let mut seen = BTreeSet::new();
    named.retain(|part| seen.insert(*part));
    named
}
