//! Ends of faces that hardly move from one profile to the next.
//!
//! An edge is somewhere between two columns. If it moves on through them, neighbouring profiles see it at other places
//! between theirs, and their errors are independent. If it stays, it lies between the same columns in all of them, and they
//! measure it only once. The same holds if one of the columns is lost. For an edge that creeps through the columns this is
//! less than their noise implies.

use super::face_end::FaceEnd;
use super::seen_joint::SeenJoint;
use crate::measure::regression::median;
use std::collections::BTreeMap;

/// Parts of a column: ends that are in the same one are between the same columns.
const PARTS: f64 = 10.0;
/// An end that moves by less counts as resting, parts of a column: a resting end seems to move by a column if one is
/// lost.
const HARDLY: u64 = 15;

/// Inflates the noise of edges that stay in the same column: such readings are not independent.
pub(super) fn count_once(joints: &mut [(i64, &mut SeenJoint)]) {
    for number in 0..2 {
        let mut ends: Vec<&mut FaceEnd> =
            joints.iter_mut().filter_map(|(_, joint)| joint.ends_mut().nth(number)).collect();
        let column_mm = median(&mut ends.iter().map(|end| end.pitch_mm).collect::<Vec<_>>());
        let places: Vec<i64> =
            ends.iter().map(|end| (end.between().x / column_mm * PARTS).round() as i64).collect();
        let lingering = lingering(&places);
        let mut counts: BTreeMap<i64, u32> = BTreeMap::new();
        for place in places.iter().zip(&lingering).filter_map(|(place, lingers)| lingers.then_some(place)) {
            *counts.entry(*place).or_default() += 1;
        }
        for ((end, place), _) in ends.iter_mut().zip(&places).zip(&lingering).filter(|(_, lingers)| **lingers)
        {
            let about = place.saturating_sub_unsigned(HARDLY - 1)..=place.saturating_add_unsigned(HARDLY - 1);
            let alike: u32 = counts.range(about).map(|(_, count)| count).sum();
            end.scatter *= f64::from(alike).sqrt();
        }
    }
}

/// The places, in order, that hardly differ from the one before or after them.
fn lingering(places: &[i64]) -> Vec<bool> {
    let is_near = |a: usize, b: Option<usize>| {
        b.and_then(|b| places.get(b)).is_some_and(|place| place.abs_diff(places[a]) < HARDLY)
    };
    (0..places.len()).map(|k| is_near(k, k.checked_sub(1)) || is_near(k, Some(k + 1))).collect()
}

#[cfg(test)]
mod tests {
    use super::lingering;

    #[test]
    fn what_moves_on_does_not_linger() {
        assert!(lingering(&[]).is_empty());
        assert_eq!(lingering(&[40]), [false]);
        // Two profiles at the turning point.
        assert_eq!(lingering(&[10, 70, 120, 130, 80, 20]), [false, false, true, true, false, false]);
    }

    /// Columns of a file that are all at one place have zero distance.
    #[test]
    fn places_without_end_are_compared_as_well() {
        assert_eq!(lingering(&[i64::MAX, i64::MIN, i64::MAX, i64::MAX]), [false, false, true, true]);
    }

    #[test]
    fn what_stays_lingers_though_a_column_is_lost() {
        assert_eq!(lingering(&[70, 70, 80, 70, 75]), [true; 5]);
    }
}
