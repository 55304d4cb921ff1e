//! Welds with whole stripes: their statements about a change and their seams are right, as certain as stated, and more
//! precise.

use crate::common;

use common::{evidence, exact, information, part};
use nalgebra::{DVector, Vector3, Vector4};
use trueline_sim::Plates;
use trueline_sim::production::{Change, Layout, Production, ScheduledChange, piece};
use trueline_watch::PieceInformation;
use trueline_watch::detect::change::VISIBLE;
use trueline_watch::parameters::{CALIBRATION, Kind, ROTATION, UNITS};

/// Two seams, so that plates of different numbers are kept apart.
fn production() -> Production {
    striped(Layout::BoxWeave)
}

fn striped(layout: Layout) -> Production {
    let mut production = layout.production();
    production.seams.truncate(2);
    production.plates = Some(Plates::default());
    production
}

#[test]
fn a_change_of_each_kind_is_measured_within_its_sigma() {
    let mut production = production();
    let reference = exact(&production);
    let own = part(&production, &reference);
    let rotation = Vector3::new(1e-3, -2e-3, 1.5e-3);
    let translation = Vector3::new(2e-4, -1e-4, 3e-4);
    let shape = [3e-3, -6e-3, 2e-3, 0.0, 0.0];
    let bracket = [rotation.as_slice(), translation.as_slice()].concat();
    let changes = [
        (Kind::Timing, Change::Timing(0.4e-3), vec![0.4e-3]),
        (Kind::Bracket, Change::Bracket { rotation_rad: rotation, translation_m: translation }, bracket),
        (Kind::Sensor, Change::Sensor(shape), shape.to_vec()),
    ];
    for (kind, change, truth) in changes {
        production.change = Some(ScheduledChange { change, piece: 5, after: 0.0 });
        let about = information(&evidence(&production, &reference, &own, 5, 9), &own)
            .within
            .restricted(&kind.columns().collect::<Vec<_>>());
        let truth = DVector::from_fn(truth.len(), |k, _| truth[k] / UNITS[kind.columns().start + k]);
        let off = &about.vector - &about.matrix * &truth;
        let squared = |of: &DVector<f64>| of.dot(&(about.matrix.clone().pseudo_inverse(1e-12).unwrap() * of));
        // χ² of at most 6 at a probability of 1e-4 is 28. A flipped sign would leave twice the change.
        assert!(squared(&off) < 28.0, "{kind:?}: {}", squared(&off));
        assert!(squared(&about.vector) > 150.0, "{kind:?}: the change itself is {}", squared(&about.vector));
    }
}

#[test]
fn seams_are_found_where_they_are_and_what_is_said_of_them_scatters_as_said() {
    let mut production = production();
    let (rotation_rad, translation_m) = (Vector3::new(8e-3, -5e-3, 1e-2), Vector3::new(1.5e-3, -1e-3, 2e-3));
    let reference = exact(&production);
    let own = part(&production, &reference);
    let change = Change::Seam { rotation_rad, translation_m };
    production.change = Some(ScheduledChange { change, piece: 7, after: 0.0 });
    let said = evidence(&production, &reference, &own, 7, 3).statistic.evidence;
    let columns: Vec<usize> = (CALIBRATION..said.size()).collect();
    let about = said.restricted(&columns);
    let covariance = about.matrix.clone().try_inverse().unwrap();
    let found = &covariance * &about.vector;
    let truth = piece(&production, 7, 3).truth.unwrap();
    for (k, (line, known)) in own.lines.iter().zip(&truth.lines).enumerate() {
        let step = Vector4::from_fn(|row, _| found[4 * k + row]);
        let found = line.retract(&step);
        let sigma = |row: usize| covariance[(4 * k + row, 4 * k + row)].sqrt();
        // Two offsets and two turns of each of two seams: 5 standard deviations of their sum, and what is second order: 14 mrad of a
        // shift of 2.7 mm, and of themselves.
        let near = 5.0 * sigma(2).hypot(sigma(3)) + 5e-5;
        assert!(known.distance(found.anchor()) < near, "{k}: {} {near}", known.distance(found.anchor()));
        let alike = 5.0 * sigma(0).hypot(sigma(1)) + 2e-4;
        assert!(found.direction().angle(&known.direction()) < alike, "{k}: {alike}");
        assert!(near < 0.6e-3 && alike < 4e-3, "{k}: a flipped sign would pass: {near} {alike}");
    }
}

#[test]
fn what_welds_say_of_a_right_calibration_scatters_as_it_says() {
    // Without a weave hardly anything but noise varies: a derivative that shares an error with its residual shows there.
    for layout in [Layout::BoxWeave, Layout::Box] {
        let production = striped(layout);
        let reference = exact(&production);
        let own = part(&production, &reference);
        let (mut sum, mut dimensions) = (0.0, 0);
        for number in 1..=12 {
            let piece = information(&evidence(&production, &reference, &own, number, 3), &own);
            let eigen = piece.within.matrix.clone().symmetric_eigen();
            for (k, value) in eigen.eigenvalues.iter().enumerate().filter(|(_, value)| **value > VISIBLE) {
                sum += eigen.eigenvectors.column(k).dot(&piece.within.vector).powi(2) / value;
                dimensions += 1;
            }
        }
        let mean = sum / f64::from(dimensions);
        let sigma = (2.0 / f64::from(dimensions)).sqrt();
        // The noise of plates that are flat is less than the surface that is allowed for, and the robot's is smoothed.
        let is_as_said = mean > 0.8 - 3.0 * sigma && mean < 1.0 + 3.0 * sigma;
        assert!(is_as_said, "{layout:?}: {mean} ± {sigma}, {dimensions} dimensions");
    }
}

/// A turn of the sensor moves no seam point that rests at its middle, and turns every stripe.
#[test]
fn stripes_show_a_spin_that_seam_points_hardly_do() {
    let with = production();
    let without = Production { plates: None, ..with.clone() };
    let spin = ROTATION + 2;
    let [with, without] = [with, without].map(|production| {
        let reference = exact(&production);
        let own = part(&production, &reference);
        let statistic = evidence(&production, &reference, &own, 0, 1).statistic;
        PieceInformation::of(&statistic, 0, &own, None).within.matrix[(spin, spin)].sqrt().recip()
    });
    assert!(with < 0.5 * without, "one piece, units: {with} {without}");
}
