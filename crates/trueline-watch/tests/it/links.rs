//! Which link of the cell an alarm is of, with a table under the part: clock, bracket, sensor, fixture, or the table.

use crate::common::drawn;

use drawn::Drawn;
use nalgebra::{DMatrix, DVector, UnitVector3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use trueline_geometry::{Axis, AxisKind, Pose, se3, so3};
use trueline_sim::production::Layout;
use trueline_watch::detect::moved_axis::part_from_axis;
use trueline_watch::detect::{Alarm, History, Link, judge};
use trueline_watch::parameters::{CALIBRATION, UNITS};
use trueline_watch::{PieceInformation, Scatter};

/// Good welds before a change, and welds after it.
const BEFORE: usize = 12;
const AFTER: usize = 24;
/// Angles of the table from weld to weld, degrees.
const ANGLES: [f64; 3] = [0.0, 70.0, 160.0];

/// A table that stands upright 0.4 m beside the part.
fn table(drawn: &Drawn) -> Axis {
    let direction = UnitVector3::new_normalize(Vector3::new(0.05, -0.02, 1.0));
    Axis::new(AxisKind::Rotary, direction, drawn.part.middle() + Vector3::new(0.4, 0.1, -0.2))
}

/// The scatter of the part as a long production teaches it.
fn scatter(drawn: &Drawn) -> Scatter {
    let own = 4 * drawn.part.lines.len();
    let mut covariance = DMatrix::zeros(own, own);
    let by_place = drawn.part.seams_from_placement();
    // 0.3 mm and 0.1° of the fixture, and 0.1 mm of the seams.
    let place = |k: usize| if k < 3 { 0.3e-3 } else { 0.1_f64.to_radians() };
    for k in 0..6 {
        let column = by_place.column(k) * place(k);
        covariance += &column * column.transpose();
    }
    for k in 0..own {
        covariance[(k, k)] += if k % 4 >= 2 { 0.1e-3_f64.powi(2) } else { 1e-12 };
    }
    Scatter { covariance, pieces: 1_000, dispersion: [1.0; 4] }
}

/// A change, from the first weld after it on.
#[derive(Clone, Copy)]
enum Moved {
    /// A column of θ by so many units.
    Calibration(usize, f64),
    /// The part on the table, mm.
    Fixture([f64; 3]),
    /// The table in base, mm and degrees about the part's middle at zero.
    Table([f64; 3], [f64; 3]),
}

/// How the part is displaced on the table, by composing poses: translation of its middle and rotation.
fn on_table(drawn: &Drawn, base_from_part: &Pose, moved: Moved) -> DVector<f64> {
    let mut place = DVector::zeros(6);
    match moved {
        Moved::Calibration(..) => {}
        Moved::Fixture(shift_mm) => place.rows_mut(0, 3).copy_from(&(Vector3::from(shift_mm) * 1e-3)),
        Moved::Table(shift_mm, turn_deg) => {
            let middle = drawn.part.middle();
            let turn = so3::exp(&Vector3::from(turn_deg).map(f64::to_radians));
            let shift = Vector3::from(shift_mm) * 1e-3;
            let in_base = se3::from_parts(turn, middle + shift - turn * middle);
            let on_table = base_from_part.inverse() * in_base * base_from_part;
            let moved = on_table.rotation * middle + on_table.translation.vector - middle;
            place.rows_mut(0, 3).copy_from(&moved);
            place.rows_mut(3, 3).copy_from(&so3::log(&on_table.rotation));
        }
    }
    place
}

/// The last alarm that was raised in a production whose table stands at these angles in turn.
fn alarm(drawn: &Drawn, angles: &[f64], moved: Moved, seed: u64) -> Option<Alarm> {
    let (table, scatter) = (table(drawn), scatter(drawn));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scatters = [Some(scatter.clone())];
    let (mut pieces, mut regimes, mut last) = (Vec::new(), Vec::new(), None);
    for number in 0..BEFORE + AFTER {
        let base_from_part = table.motion(angles[number % angles.len()].to_radians());
        let (mut theta, mut place) = (DVector::zeros(CALIBRATION), DVector::zeros(6));
        if number >= BEFORE {
            place = on_table(drawn, &base_from_part, moved);
            if let Moved::Calibration(column, units) = moved {
                theta[column] = units * UNITS[column];
            }
        }
        let mut statistic = drawn.piece(&theta, &place, &mut random);
        statistic.base_from_part = Some(base_from_part);
        pieces.push(PieceInformation::of(&statistic, 0, &drawn.part, Some(&scatter)));
        let prior = &drawn.reference.prior;
        let judgement =
            judge(&History { pieces: &pieces, prior, scatters: &scatters, regimes: &regimes }, None);
        regimes = judgement.regimes;
        last = judgement.alarm.or(last);
    }
    last
}

#[test]
fn a_change_of_each_link_is_named_and_none_is_taken_for_another() {
    let drawn = Drawn::of(&Layout::BoxAngles.production());
    let cases = [
        (Moved::Table([1.5, 0.5, 0.0], [0.0; 3]), Link::Axis),
        (Moved::Table([0.0; 3], [0.4, 0.0, 0.0]), Link::Axis),
        (Moved::Calibration(0, 10.0), Link::Clock),
        (Moved::Calibration(5, 10.0), Link::Bracket),
        (Moved::Calibration(2, 8.0), Link::Bracket),
        (Moved::Calibration(8, 12.0), Link::Sensor),
        (Moved::Fixture([1.2, -0.8, 0.0]), Link::Fixture),
        (Moved::Fixture([-1.2, -0.6, 0.0]), Link::Fixture),
    ];
    let mut alone = 0;
    for (k, (moved, truth)) in cases.into_iter().enumerate() {
        for seed in 0..2 {
            let alarm = alarm(&drawn, &ANGLES, moved, 10 * k as u64 + seed);
            let links = alarm.unwrap_or_else(|| panic!("case {k}, seed {seed}: no alarm")).links;
            assert!(links.contains(&truth), "case {k}, seed {seed}: {links:?}");
            let is_table = truth == Link::Axis;
            alone += usize::from(is_table && links == [Link::Axis]);
            // A fixture is told from the table at three angles. A table is where the detector sees one change, and not one after another.
            assert!(is_table || !links.contains(&Link::Axis), "case {k}, seed {seed}: {links:?}");
        }
    }
    assert!(alone > 0, "a moved table is always named together with the fixture");
}

#[test]
fn a_table_at_one_angle_is_named_together_with_the_fixture() {
    let drawn = Drawn::of(&Layout::BoxAngles.production());
    let moves = [Moved::Fixture([1.2, -0.8, 0.0]), Moved::Table([1.5, 0.5, 0.0], [0.0; 3])];
    for (k, moved) in moves.into_iter().enumerate() {
        let links = alarm(&drawn, &ANGLES[1..2], moved, k as u64).expect("a change").links;
        assert!(links.contains(&Link::Fixture) && links.contains(&Link::Axis), "{links:?}");
    }
    // A lift along the axis is the same at every angle, on the table and in base.
    let lift = table(&drawn).direction.into_inner() * 1.2;
    let links = alarm(&drawn, &ANGLES, Moved::Fixture(lift.into()), 7).expect("a change").links;
    assert!(links.contains(&Link::Fixture) && links.contains(&Link::Axis), "{links:?}");
}

#[test]
fn the_part_follows_the_table_as_poses_say() {
    let drawn = Drawn::of(&Layout::BoxAngles.production());
    for angle in ANGLES {
        let base_from_part = table(&drawn).motion(angle.to_radians());
        let map = part_from_axis(&drawn.part, &base_from_part);
        for k in 0..6 {
            // Small, so that the order of translation and rotation makes no difference: 1e-6 m and rad leave 1e-12.
            let mut of = [[0.0; 3]; 2];
            of[k / 3][k % 3] = if k < 3 { 1e-3 } else { 1e-6_f64.to_degrees() };
            let place = on_table(&drawn, &base_from_part, Moved::Table(of[0], of[1]));
            for j in 0..6 {
                let by = map[(j, k)] * UNITS[CALIBRATION + j] / UNITS[CALIBRATION + k] * 1e-6;
                assert!((place[j] - by).abs() < 1e-11, "{angle} {j} {k}: {} {by}", place[j]);
            }
        }
    }
}
