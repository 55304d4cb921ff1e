//! One weld: Jacobians against differences, noise against its stated level, changes against the truth.

use crate::common;

use common::{evidence, exact, information, part};
use nalgebra::{DVector, Vector2, Vector3, Vector4};
use trueline_dataset::Guess;
use trueline_geometry::se3;
use trueline_method::Config;
use trueline_method::evaluate::placed_features::{PlacedFeatures, place};
use trueline_method::input::timestamps::Dejittered;
use trueline_model::sheet_residual;
use trueline_sim::production::{Change, Layout, Production, ScheduledChange, piece};
use trueline_watch::innovation::fitted_seams;
use trueline_watch::innovation::linearized::{BOW, SEAM, linearized};
use trueline_watch::parameters::{Kind, ROTATION, SHAPE, TRANSLATION, UNITS};

fn placed_at(production: &Production, guess: &Guess) -> PlacedFeatures {
    place(&piece(production, 0, 1), guess, Dejittered::default(), &Config::default()).unwrap()
}

/// Moves one column of θ of the stored calibration by a step.
fn stepped(guess: &Guess, column: usize, step: f64) -> Guess {
    let mut moved = *guess;
    let axis = |first: usize| Vector3::from_fn(|k, _| if first + k == column { step } else { 0.0 });
    if column == 0 {
        moved.time_offset_s += step;
    }
    moved.tool_from_camera =
        se3::retract_decoupled(&guess.tool_from_camera, &axis(ROTATION), &axis(TRANSLATION));
    moved
}

/// The robot's noise as a velocity is smoothed away; a difference has all of it.
fn of_an_exact_robot() -> Production {
    let mut production = Layout::BoxAngles.production();
    let disturbance = &mut production.scenario.disturbance;
    disturbance.robot_position_noise_m = 0.0;
    disturbance.robot_rotation_noise_rad = 0.0;
    disturbance.robot_jitter_s = 0.0;
    production
}

#[test]
fn jacobians_are_the_differences_of_the_residual() {
    let production = of_an_exact_robot();
    let reference = exact(&production);
    let (guess, origin) = (reference.guess, reference.shape_origin_m);
    let of = placed_at(&production, &guess);
    let seams: Vec<_> = fitted_seams(&of, origin).unwrap().iter().map(|fit| fit.seam).collect();
    let some: Vec<usize> = (0..of.list.len()).step_by(97).collect();
    for (column, unit) in UNITS.iter().enumerate().take(SHAPE) {
        // A thousandth of a unit: curvature over it is below 1e-7 of the slope, rounding 1e-9. The robot's path is of straight
        // pieces of 4 ms: over one on either side.
        let step = if column == 0 { 4e-3 } else { 1e-3 * unit };
        let (low, high) = (
            placed_at(&production, &stepped(&guess, column, -step)),
            placed_at(&production, &stepped(&guess, column, step)),
        );
        for &k in &some {
            let seam = &seams[of.list[k].line as usize];
            let Some(one) = linearized(&of, &of.list[k], seam, origin) else { continue };
            let at = |p: &PlacedFeatures| {
                let f = &p.list[k];
                sheet_residual::residual(&f.placement, &p.sheet, &f.point_in_camera, &seam.line).unwrap()
            };
            let difference = (at(&high) - at(&low)) / (2.0 * step);
            let own: Vector2<f64> = one.jacobian.column(column).into();
            // The Jacobian is taken at the predicted point, which noise keeps some 0.1 mm from the measured one: of the
            // 130 mm that a rotation acts over that is a thousandth. The slope of a cubic through ±60 ms of a weave of 2 Hz is
            // right to 0.4 %, and its change over the 2 ms between samples is some 0.1 mm/s.
            let size = own.norm().max(1e-2 * difference.norm()) + 1e-6;
            let rest = if column == 0 { 0.3e-3 } else { 0.0 };
            assert!(
                (difference - own).norm() < 5e-3 * size + rest,
                "column {column}, feature {k}: {difference} {own}"
            );
        }
    }
    for &k in &some {
        let f = &of.list[k];
        let seam = &seams[f.line as usize];
        let one = linearized(&of, f, seam, origin).unwrap();
        for column in 0..4 {
            let at = |step: f64| {
                let line = seam.line.retract(&Vector4::from_fn(|r, _| if r == column { step } else { 0.0 }));
                sheet_residual::residual(&f.placement, &of.sheet, &f.point_in_camera, &line).unwrap()
            };
            let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
            let own: Vector2<f64> = one.jacobian.column(SEAM + column).into();
            // Rounding of coordinates of 1 m over a step of 1 µm: 1e-9.
            assert!((difference - own).norm() < 1e-6, "seam {column}: {difference} {own}");
        }
        // A bow is an offset that depends on the place along the seam alone.
        let predicted = f.placement.point_in_base(&(f.point_in_camera - of.sheet.axes() * one.residual));
        let along =
            seam.line.direction().dot(&(predicted - seam.line.anchor())) / seam.curvature.half_length_m;
        let offsets = one.jacobian.fixed_columns::<2>(SEAM + 2) * (along * along - 1.0 / 3.0);
        assert!((offsets - one.jacobian.fixed_columns::<2>(BOW)).norm() < 1e-12);
        // The shape moves the measured point of the sheet; its Jacobian is taken at the best estimate of it.
        let gain = one.covariance * one.total_covariance().try_inverse().unwrap();
        let measured = of.sheet.coordinates(&f.point_in_camera) - gain * one.residual - Vector2::from(origin);
        for h in 0..5 {
            let mapped = |step: f64| {
                let s = |k: usize| if h == k { step } else { 0.0 };
                let w = 1.0 + s(3) * measured.x + s(4) * measured.y;
                Vector2::new((1.0 + s(0)) * measured.x + s(2) * measured.y, (1.0 + s(1)) * measured.y) / w
            };
            let difference = (mapped(1e-5) - mapped(-1e-5)) / 2e-5;
            let own: Vector2<f64> = one.jacobian.column(SHAPE + h).into();
            // Third order of a rational function of h·(30 mm): 1e-10 · 0.03³.
            assert!((difference - own).norm() < 1e-9, "h{}: {difference} {own}", h + 1);
        }
    }
}

#[test]
fn a_change_of_each_kind_is_measured_within_its_sigma() {
    let mut production = Layout::BoxAngles.production();
    let reference = exact(&production);
    let own = part(&production, &reference);
    let changes = [
        (Kind::Timing, Change::Timing(0.4e-3), vec![0.4e-3]),
        (
            Kind::Bracket,
            Change::Bracket {
                rotation_rad: Vector3::new(1e-3, -2e-3, 1e-3),
                translation_m: Vector3::new(2e-4, -1e-4, 3e-4),
            },
            vec![1e-3, -2e-3, 1e-3, 2e-4, -1e-4, 3e-4],
        ),
        (Kind::Sensor, Change::Sensor([3e-3, -6e-3, 2e-3, 0.0, 0.0]), vec![3e-3, -6e-3, 2e-3, 0.0, 0.0]),
    ];
    for (kind, change, truth) in changes {
        production.change = Some(ScheduledChange { change, piece: 5, after: 0.0 });
        let before = information(&evidence(&production, &reference, &own, 4, 9), &own);
        let after = information(&evidence(&production, &reference, &own, 5, 9), &own);
        let columns: Vec<usize> = kind.columns().collect();
        let units: Vec<f64> = columns.iter().map(|c| UNITS[*c]).collect();
        for (piece, truth) in [(before, vec![0.0; truth.len()]), (after, truth)] {
            let about = piece.within.restricted(&columns);
            let truth = DVector::from_fn(units.len(), |k, _| truth[k] / units[k]);
            let off = &about.vector - &about.matrix * truth;
            let squared = off.dot(&(about.matrix.clone().pseudo_inverse(1e-12).unwrap() * &off));
            // χ² of at most 6 at a probability of 1e-4 is 28; the change itself is hundreds.
            assert!(squared < 28.0, "{kind:?}: {squared}");
        }
    }
}

#[test]
fn what_welds_say_of_a_right_calibration_scatters_as_it_says() {
    let production = Layout::BoxWeave.production();
    let reference = exact(&production);
    let own = part(&production, &reference);
    let (mut sum, mut dimensions) = (0.0, 0);
    for number in 1..=24 {
        let piece = information(&evidence(&production, &reference, &own, number, 3), &own);
        let eigen = piece.within.matrix.clone().symmetric_eigen();
        for (k, value) in eigen.eigenvalues.iter().enumerate().filter(|(_, value)| **value > 1e-3) {
            sum += eigen.eigenvectors.column(k).dot(&piece.within.vector).powi(2) / value;
            dimensions += 1;
        }
    }
    let mean = sum / f64::from(dimensions);
    let sigma = (2.0 / f64::from(dimensions)).sqrt();
    // The robot's noise is smoothed, so features err up to 10 % less than they say (README, "How well").
    assert!(
        mean > 0.85 - 3.0 * sigma && mean < 1.0 + 3.0 * sigma,
        "{mean} ± {sigma}, {dimensions} dimensions"
    );
}
