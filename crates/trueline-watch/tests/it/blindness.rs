//! Invisible changes are reported before anything has changed.

use crate::common;

use common::{evidence, exact, part};
use nalgebra::{DMatrix, DVector, Matrix3};
use trueline_dataset::Sensor;
use trueline_model::LaserSheet;
use trueline_sim::production::{Layout, PlacementScatter, piece};
use trueline_watch::detect::blindness::blind_to;
use trueline_watch::detect::sensor_axes::SensorAxes;
use trueline_watch::{Part, PieceInformation, Scatter};

/// The scatter as it would have been learnt from very many pieces.
fn known(part: &Part, scatter: PlacementScatter) -> Scatter {
    let map = part.seams_from_placement();
    let place =
        DVector::from_fn(
            6,
            |k, _| {
                if k < 3 { scatter.translation_m.powi(2) } else { scatter.rotation_rad.powi(2) }
            },
        );
    let mut covariance = &map * DMatrix::from_diagonal(&place) * map.transpose();
    for k in 0..covariance.nrows() {
        covariance[(k, k)] += if k % 4 >= 2 { scatter.seam_m.powi(2) } else { 1e-10 };
    }
    Scatter { covariance, pieces: 1_000_000, dispersion: [1.0; 4] }
}

fn blind(layout: Layout) -> Vec<String> {
    let production = layout.production();
    let reference = exact(&production);
    let part = part(&production, &reference);
    let statistic = evidence(&production, &reference, &part, 0, 1).statistic;
    let first = piece(&production, 0, 1);
    let Sensor::CameraLaser { laser_plane_in_camera, .. } = first.sensor else { panic!("a camera") };
    let sheet = LaserSheet::from_plane(laser_plane_in_camera);
    let [across, depth] = [0, 1].map(|k| sheet.axes().column(k).into_owned());
    let turn = reference.guess.tool_from_camera.rotation.to_rotation_matrix();
    let tool_from_axes = turn * Matrix3::from_columns(&[across, across.cross(&depth), depth]);
    let axes = SensorAxes { tool_from_axes };
    let scatter = known(&part, production.scatter);
    blind_to(&[PieceInformation::of(&statistic, 0, &part, Some(&scatter))], &axes)
}

/// The tool goes along the seam and turns about the sensor's point: a time offset moves this point along the seam,
/// invisibly. Noise of the poses must not pass for a velocity across it.
#[test]
fn welds_straight_along_their_seams_are_blind_to_timing_and_say_so() {
    for layout in [Layout::OneSeam, Layout::Box] {
        let blind = blind(layout);
        assert!(blind.iter().any(|b| b == "timing"), "{layout:?}: {blind:?}");
    }
}

#[test]
fn plain_welds_are_blind_to_width_and_keystone_and_say_so() {
    // Cases in which no simulation finds the change, with any number of pieces: a stripe that always stands at one place of
    // the sheet does not show the sheet's width.
    for layout in [Layout::OneSeam, Layout::Box] {
        let blind = blind(layout);
        for hidden in ["sensor width", "sensor keystone across"] {
            assert!(
                blind.iter().any(|b| b == hidden || b == "sensor"),
                "{layout:?}: {hidden} is not in {blind:?}"
            );
        }
    }
}

#[test]
fn what_shows_is_not_said_to_be_hidden() {
    let angles = blind(Layout::BoxAngles);
    for shown in [
        "timing",
        "bracket",
        "sensor",
        "sensor width",
        "sensor depth",
        "bracket shift across",
        "bracket shift depth",
    ] {
        assert!(!angles.iter().any(|b| b == shown), "{shown} is in {angles:?}");
    }
    assert_eq!(blind(Layout::CheckScan), Vec::<String>::new());
}
