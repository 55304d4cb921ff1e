//! Cells of a shop: the same for the same seed, with errors as frequent and as large as in the table, and the changes by
//! each error.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use trueline_dataset::{Measured, PlateStripe, Recording};
use trueline_geometry::Pose;
use trueline_sim::shop::{DrawnErrors, Level, Shop, ShopCell, ShopError, TABLE};

const SEED: u64 = 3;

fn cell(seed: u64, only: &[ShopError]) -> ShopCell {
    Shop { only: Some(only.to_vec()), ..Shop::new(Level::Ordinary, seed) }.cast().unwrap()
}

/// A cell of a kind of sensor, and its seed.
fn with_sensor(kind: &str) -> (u64, ShopCell) {
    (1..60).map(|seed| (seed, cell(seed, &[]))).find(|(_, cell)| cell.truth.sensor == kind).unwrap()
}

fn numbers(measured: &Measured) -> Vec<f64> {
    match measured {
        Measured::Pixel(two) | Measured::Profile(two) => two.to_vec(),
        Measured::Point(three) => three.to_vec(),
    }
}

/// Root mean square of the difference of features that have the same place in both scans, px or m.
fn features_moved(one: &Recording, other: &Recording) -> f64 {
    let pairs: Vec<f64> = (one.features.iter().zip(&other.features))
        .flat_map(|(a, b)| {
            numbers(&a.measured).into_iter().zip(numbers(&b.measured)).map(|(a, b)| (a - b).powi(2))
        })
        .collect();
    (pairs.iter().sum::<f64>() / pairs.len() as f64).sqrt()
}

fn poses_moved_m(one: &Recording, other: &Recording) -> f64 {
    let place = |pose: &Pose| pose.translation.vector;
    let gap = |(a, b): (&trueline_dataset::RobotSample, &trueline_dataset::RobotSample)| {
        (place(&a.base_from_tool) - place(&b.base_from_tool)).norm()
    };
    one.robot.iter().zip(&other.robot).map(gap).fold(0.0, f64::max)
}

#[test]
fn a_seed_gives_one_cell() {
    let (a, b) =
        (Shop::new(Level::Rough, SEED).cast().unwrap(), Shop::new(Level::Rough, SEED).cast().unwrap());
    assert!(a.recording.robot == b.recording.robot && a.recording.features == b.recording.features);
    assert!(a.truth.to_json() == b.truth.to_json());
    let other = Shop::new(Level::Rough, SEED + 1).cast().unwrap();
    assert!(a.truth.to_json() != other.truth.to_json());
}

#[test]
fn levels_have_the_same_cell_with_other_errors() {
    let cells = Level::ALL.map(|level| Shop::new(level, SEED).cast().unwrap().truth);
    for cell in &cells {
        assert_eq!((cell.arm, cell.sensor, cell.motion), (cells[1].arm, cells[1].sensor, cells[1].motion));
        assert_eq!(cell.tool_from_camera, cells[1].tool_from_camera);
    }
    for (kind, size) in &cells[0].errors {
        // A calm cell has no error that the ordinary one has not, and each is 0.6 times as large.
        let ordinary = cells[1].errors.iter().find(|(row, _)| row.error == kind.error).unwrap().1;
        let factor = if kind.error == ShopError::MillisecondStamps { 1.0 } else { 0.6 };
        assert!((size / ordinary - factor).abs() < 1e-9, "{}", kind.name);
    }
}

#[test]
fn sizes_and_shares_are_those_of_the_table() {
    const DRAWS: u64 = 300;
    let drawn: Vec<DrawnErrors> = (0..DRAWS).map(|seed| DrawnErrors::draw(Level::Ordinary, seed)).collect();
    for row in &TABLE {
        let mut sizes: Vec<f64> = drawn.iter().filter_map(|errors| errors.size(row.error)).collect();
        let share = sizes.len() as f64 / DRAWS as f64;
        // Four standard deviations of a share, and of the logarithm of a median (1.2533 σ/√n): of 68 figures one in 230 tables is beyond.
        let sigma = (row.share * (1.0 - row.share) / DRAWS as f64).sqrt();
        assert!((share - row.share).abs() <= 4.0 * sigma, "{}: {share}", row.name);
        sizes.sort_by(f64::total_cmp);
        let median = sizes[sizes.len() / 2] / row.unit.1;
        let tolerance = 4.0 * 1.2533 * row.spread / (sizes.len() as f64).sqrt() + 1e-9;
        assert!((median / row.median).ln().abs() <= tolerance, "{}: {median}", row.name);
    }
}

/// Without errors the seam is straight, the log exact and every reading the projection of the line.
#[test]
fn a_cell_without_errors_is_free_of_noise() {
    let perfect = cell(SEED, &[]);
    let (recording, truth) = (&perfect.recording, &perfect.truth);
    assert_eq!(truth.outlier_share, 0.0);
    let [low, high] = truth.time_offset_interval_s;
    assert_eq!((low, high), (truth.time_offset_s, truth.time_offset_s));
    let gaps = recording.robot.windows(2).map(|pair| pair[1].stamp_ns - pair[0].stamp_ns);
    let (least, most) = gaps.fold((i64::MAX, 0), |(least, most), gap| (least.min(gap), most.max(gap)));
    assert!(most - least <= 1, "stamps are even to a nanosecond: {least} {most}");
    for point in &truth.points {
        let torch = point.torch_reference.unwrap();
        let sent = (point.reported * nalgebra::Point3::from(point.in_tool)).coords;
        // The joints are solved to 1e-10, and the tip's attitude by a least-squares fit of that.
        assert!((torch - sent).norm() < 1e-8, "{torch} {sent}");
    }
}

/// Quantities that must change, and those that must not: (error, sensor, poses, readings, stamps).
#[test]
fn each_error_changes_what_it_should() {
    use ShopError as E;
    let robot = [E::MovingMean, E::QuantisedPoses, E::PolledLog];
    let readings = [
        (E::ArmGeometry, "any"),
        (E::GearRipple, "any"),
        (E::Hysteresis, "any"),
        (E::Sag, "any"),
        (E::WarmUp, "any"),
        (E::CommandedPoses, "any"),
        (E::ProfileShape, "profiler"),
        (E::Linearity, "profiler"),
        (E::BentSheet, "any"),
        (E::LensTerms, "camera"),
        (E::RollingShutter, "camera"),
        (E::AutomaticExposure, "any"),
        (E::SensorWarming, "any"),
        (E::FeatureNoise, "any"),
        (E::Bow, "any"),
        (E::Waviness, "any"),
        (E::Tacks, "any"),
        (E::HeatBend, "any"),
        (E::RoundedEdge, "any"),
        (E::Spatter, "any"),
        (E::Reflections, "any"),
        (E::OtherEdge, "any"),
    ];
    let (camera, profiler) = (with_sensor("camera"), with_sensor("profiler"));
    for kind in robot {
        let changed = cell(camera.0, &[kind]);
        assert!(poses_moved_m(&camera.1.recording, &changed.recording) > 1e-7, "{kind:?}");
        assert_eq!(features_moved(&camera.1.recording, &changed.recording), 0.0, "{kind:?}");
    }
    for (kind, sensor) in readings {
        let (seed, perfect) = if sensor == "profiler" { &profiler } else { &camera };
        let changed = cell(*seed, &[kind]);
        assert_eq!(poses_moved_m(&perfect.recording, &changed.recording), 0.0, "{kind:?}");
        // Above the rounding of a pixel of 1e3 and of a length of 0.1 m.
        assert!(features_moved(&perfect.recording, &changed.recording) > 1e-9, "{kind:?}");
    }
    for kind in [E::Intrinsics, E::LaserPlane] {
        let changed = cell(camera.0, &[kind]);
        assert_ne!(changed.recording.sensor, camera.1.recording.sensor, "{kind:?}");
        assert_eq!(features_moved(&camera.1.recording, &changed.recording), 0.0, "{kind:?}");
    }
}

#[test]
fn errors_of_streams_change_stamps_alone() {
    use ShopError as E;
    let perfect = cell(SEED, &[]).recording;
    for kind in [E::LatePackets, E::Stalls, E::MillisecondStamps, E::ClockSkew, E::ClockStep] {
        let changed = cell(SEED, &[kind]).recording;
        let stamps = |recording: &Recording| -> Vec<i64> {
            recording
                .robot
                .iter()
                .map(|s| s.stamp_ns)
                .chain(recording.features.iter().map(|f| f.stamp_ns))
                .collect()
        };
        assert!(stamps(&perfect) != stamps(&changed), "{kind:?}");
        assert_eq!(poses_moved_m(&perfect, &changed), 0.0, "{kind:?}");
        assert_eq!(features_moved(&perfect, &changed), 0.0, "{kind:?}");
    }
    for kind in [E::LostPackets, E::Gaps] {
        assert!(cell(SEED, &[kind]).recording.features.len() < perfect.features.len(), "{kind:?}");
    }
}

/// A profiler that looks straight at the seam sees a rounded edge nearer by the radius; only the attitude of the view decides where to.
#[test]
fn a_rounded_edge_moves_the_point_by_its_radius() {
    let (seed, perfect) = with_sensor("profiler");
    let changed = cell(seed, &[ShopError::RoundedEdge]);
    let radius_m = changed.truth.errors[0].1 * 1e-3;
    let pairs = perfect.recording.features.iter().zip(&changed.recording.features);
    for (a, b) in pairs {
        let (Measured::Profile(a), Measured::Profile(b)) = (a.measured, b.measured) else { unreachable!() };
        // In the sheet, which stands across the seam but for travel angle and spin of up to 40°: the radius over the cosine at most.
        let moved = (b[0] - a[0]).hypot(b[1] - a[1]);
        assert!(moved > 0.98 * radius_m && moved < 1.6 * radius_m, "{moved} {radius_m}");
        assert!(b[1] < a[1], "nearer");
    }
}

#[test]
fn a_robot_that_logs_commands_is_behind_its_log() {
    let perfect = cell(SEED, &[]).truth;
    let changed = cell(SEED, &[ShopError::CommandedPoses]).truth;
    let lag_s = changed.errors[0].1 * 1e-3;
    let later_s = changed.time_offset_s - perfect.time_offset_s;
    // The mean of six joints that differ by 8 %: four standard deviations of it.
    assert!((later_s / lag_s - 1.0).abs() < 4.0 * 0.08 / 6_f64.sqrt(), "{later_s} {lag_s}");
    let [low, high] = changed.time_offset_interval_s;
    assert!(low < changed.time_offset_s && changed.time_offset_s < high);
}

#[test]
fn the_torch_misses_by_the_arms_own_errors() {
    let truth = cell(SEED, &[ShopError::ArmGeometry]).truth;
    let accuracy_m = truth.errors[0].1 * 1e-3;
    let squares = truth.points.iter().filter_map(|point| {
        let sent = (point.reported * nalgebra::Point3::from(point.in_tool)).coords;
        Some((point.torch_reference? - sent).norm_squared())
    });
    let squares: Vec<f64> = squares.collect();
    let miss_m = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // Two poses that err each by about the accuracy, nearly alike: between a tenth of it and three times it.
    assert!(miss_m > 0.1 * accuracy_m && miss_m < 3.0 * accuracy_m, "{miss_m} {accuracy_m}");
}

/// Without errors both stripes of an image cross where the seam is seen, and a bowed plate's as far beside it as the plate is bowed.
#[test]
fn stripes_cross_where_the_seam_is() {
    for kind in ["profiler", "camera"] {
        let (seed, plain) = with_sensor(kind);
        let shop = Shop { only: Some(Vec::new()), plates: true, ..Shop::new(Level::Ordinary, seed) };
        let cell = shop.cast().unwrap();
        assert!(plain.recording.stripes.is_empty());
        let mut seen = 0;
        for feature in cell.recording.features.iter().step_by(13) {
            let mut both = cell.recording.stripes.iter().filter(|stripe| stripe.stamp_ns == feature.stamp_ns);
            let (Some(one), Some(other)) = (both.next(), both.next()) else { continue };
            let ends = |stripe: &PlateStripe| {
                stripe.points.map(|point| {
                    let two = numbers(&point);
                    nalgebra::Vector2::new(two[0], two[1])
                })
            };
            let ([a, b], [c, d]) = (ends(one), ends(other));
            let (first, second) = (b - a, d - c);
            let along = (c - a).perp(&second) / first.perp(&second);
            let at = numbers(&feature.measured);
            let off = (a + first * along - nalgebra::Vector2::new(at[0], at[1])).norm();
            // A camera's lens bends a stripe of 12 mm by some hundredths of a pixel; own bows of the plates are 0.1 mm, over 40 µm a pixel.
            let most = if kind == "camera" { 6.0 } else { 0.5e-3 };
            assert!(off < most, "{kind}: {off}");
            seen += 1;
        }
        assert!(seen > 20, "{kind}: {seen}");
    }
}
