//! Tests the doctor: it reports the mistake that was made, and none if there is none.

use nalgebra::{Quaternion, UnitQuaternion};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::{Plane, se3, so3};
use trueline_method::Config;
use trueline_method::diagnose::doctor::{Diagnosis, diagnose};
use trueline_model::{BrownConrady, Camera};
use trueline_sim::{Plates, Preset, SensorModel, random_cell, scan_plates, simulate};

fn examined(recording: &Recording) -> Diagnosis {
    diagnose(recording, &Config::default(), None, |_| {})
}

fn good() -> Recording {
    simulate(&Preset::Quick.scenario(), 11).unwrap()
}

/// Corrupts a good recording, and expects the first finding to name the mistake.
fn assert_named(spoil: impl Fn(&mut Recording), words: &str) {
    let mut recording = good();
    spoil(&mut recording);
    let found = examined(&recording);
    assert!(found.findings.first().is_some_and(|f| f.contains(words)), "{words}: {found:#?}");
}

#[test]
fn a_good_recording_is_left_alone() {
    for preset in [Preset::Quick, Preset::Profiler, Preset::ConstantAttitude] {
        let mut recording = simulate(&preset.scenario(), 12).unwrap();
        recording.initial = Some(recording.truth.as_ref().unwrap().parameters);
        let found = examined(&recording);
        assert!(found.findings.is_empty(), "{}: {:?}", preset.name(), found.findings);
        assert!(found.trials.is_empty());
    }
}

#[test]
fn units_of_the_robot() {
    let scale = |recording: &mut Recording, by: f64| {
        for s in &mut recording.robot {
            s.base_from_tool.translation.vector *= by;
        }
    };
    assert_named(|r| scale(r, 1e-3), "1000 times too small");
    assert_named(|r| scale(r, 1e3), "1000 times too large");
}

#[test]
fn orders_and_inversions_of_the_robots_poses() {
    assert_named(
        |r| {
            for s in &mut r.robot {
                let q = *s.base_from_tool.rotation.quaternion();
                // Written x, y, z, w; read as w, x, y, z.
                s.base_from_tool.rotation =
                    UnitQuaternion::new_normalize(Quaternion::new(q.i, q.j, q.k, q.w));
            }
        },
        "x, y, z, w",
    );
    assert_named(
        |r| {
            for s in &mut r.robot {
                let q = *s.base_from_tool.rotation.quaternion();
                // Written w, x, y, z; read as x, y, z, w.
                s.base_from_tool.rotation =
                    UnitQuaternion::new_normalize(Quaternion::new(q.k, q.w, q.i, q.j));
            }
        },
        "their names say qx, qy, qz, qw",
    );
    assert_named(
        |r| r.robot.iter_mut().for_each(|s| s.base_from_tool = s.base_from_tool.inverse()),
        "tool_from_base: invert",
    );
    assert_named(
        |r| {
            for s in &mut r.robot {
                s.base_from_tool.rotation = s.base_from_tool.rotation.inverse();
            }
        },
        "conjugate",
    );
    assert_named(
        |r| {
            for s in &mut r.robot {
                s.base_from_tool.translation.vector = se3::log(&s.base_from_tool).1;
            }
        },
        "logarithm",
    );
}

fn with_positions(r: &mut Recording, change: fn([f64; 3]) -> [f64; 3]) {
    for s in &mut r.robot {
        let p: [f64; 3] = s.base_from_tool.translation.vector.into();
        s.base_from_tool.translation.vector = change(p).into();
    }
}

#[test]
fn axes_of_the_robots_positions() {
    assert_named(|r| with_positions(r, |[x, y, z]| [y, x, z]), "x and y swapped");
    assert_named(|r| with_positions(r, |[x, y, z]| [x, z, y]), "y and z swapped");
    assert_named(|r| with_positions(r, |[x, y, z]| [-x, y, z]), "robot's x has the wrong sign");
    assert_named(|r| with_positions(r, |[x, y, z]| [x, y, -z]), "robot's z has the wrong sign");
    assert_named(
        |r| with_positions(r, |[x, y, z]| [x, y, z * 1e-3]),
        "z is 1000 times too small or too large",
    );
    assert_named(|r| with_positions(r, |[x, y, z]| [x, y * 1.02, z]), "y is +2.0");
}

/// A cell with attitudes far from those at which Euler angles of different orders are alike.
fn good_elsewhere() -> Recording {
    simulate(&random_cell(&Preset::Quick.scenario(), 4, 0.1), 11).unwrap()
}

/// Corrupts the attitudes of two recordings, and expects the first finding to name the mistake.
fn assert_attitude_named(spoil: fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>, words: &str) {
    for mut recording in [good(), good_elsewhere()] {
        for s in &mut recording.robot {
            s.base_from_tool.rotation = spoil(s.base_from_tool.rotation);
        }
        let found = examined(&recording);
        assert!(found.findings.first().is_some_and(|f| f.contains(words)), "{words}: {:#?}", found.findings);
    }
}

fn about(axis: usize, angle: f64) -> UnitQuaternion<f64> {
    so3::exp(&nalgebra::Vector3::ith(axis, angle))
}

#[test]
fn orders_and_signs_of_euler_angles() {
    // Angles of Rz Ry Rx, composed as Rx Ry Rz.
    assert_attitude_named(
        |r| {
            let (x, y, z) = r.euler_angles();
            about(0, x) * about(1, y) * about(2, z)
        },
        "(ZYX, as KUKA's A, B, C), and were composed as XYZ",
    );
    assert_attitude_named(
        |r| {
            let (x, y, z) = r.euler_angles();
            UnitQuaternion::from_euler_angles(z, y, x)
        },
        "first and last were swapped",
    );
    assert_attitude_named(
        |r| {
            let (x, y, z) = r.euler_angles();
            UnitQuaternion::from_euler_angles(x, -y, z)
        },
        "about y has the wrong sign",
    );
    assert_attitude_named(
        |r| {
            let v = r.scaled_axis();
            UnitQuaternion::from_euler_angles(v.x, v.y, v.z)
        },
        "rotation vector (UR's rx, ry, rz)",
    );
}

#[test]
fn degrees_and_radians() {
    assert_named(
        |r| {
            for s in &mut r.robot {
                let (a, b, c) = s.base_from_tool.rotation.euler_angles();
                s.base_from_tool.rotation =
                    UnitQuaternion::from_euler_angles(a.to_radians(), b.to_radians(), c.to_radians());
            }
        },
        "radians",
    );
    assert_named(
        |r| {
            for s in &mut r.robot {
                let (a, b, c) = s.base_from_tool.rotation.euler_angles();
                s.base_from_tool.rotation =
                    UnitQuaternion::from_euler_angles(a.to_degrees(), b.to_degrees(), c.to_degrees());
            }
        },
        "faster than any robot",
    );
}

#[test]
fn pixels_and_the_sensors_own_calibration() {
    let pixels = |r: &mut Recording, change: fn([f64; 2]) -> [f64; 2]| {
        for f in &mut r.features {
            if let Measured::Pixel(p) = f.measured {
                f.measured = Measured::Pixel(change(p));
            }
        }
    };
    assert_named(|r| pixels(r, |[u, v]| [v, u]), "swapped");
    assert_named(|r| pixels(r, |uv| uv.map(|x| 0.5 * (x + 0.5) - 0.5)), "half the resolution");
    assert_named(
        |r| {
            let Sensor::CameraLaser { laser_plane_in_camera, .. } = &mut r.sensor else { panic!() };
            let n = laser_plane_in_camera.normal().into_inner();
            *laser_plane_in_camera = Plane::new(n, laser_plane_in_camera.offset() * 1e-3).unwrap();
        },
        "laser plane",
    );
}

fn with_lens(preset: Preset, distortion: BrownConrady) -> Recording {
    let mut scenario = preset.scenario();
    let SensorModel::CameraLaser { camera, .. } = &mut scenario.cell.sensor else { panic!() };
    camera.distortion = distortion;
    simulate(&scenario, 11).unwrap()
}

fn assert_first(recording: &Recording, words: &str) {
    let found = examined(recording);
    assert!(found.findings.first().is_some_and(|f| f.contains(words)), "{words}: {:#?}", found.findings);
}

fn with_camera(recording: &mut Recording, change: impl Fn(&mut Camera)) {
    let Sensor::CameraLaser { camera, .. } = &mut recording.sensor else { panic!("a camera") };
    change(camera);
}

fn with_pixels(recording: &mut Recording, change: impl Fn([f64; 2]) -> [f64; 2]) {
    for f in &mut recording.features {
        let Measured::Pixel(p) = f.measured else { panic!("pixels") };
        f.measured = Measured::Pixel(change(p));
    }
}

#[test]
fn small_mistakes_with_the_pixels() {
    let lens = BrownConrady { k1: -0.2, k2: 0.1, p1: 2e-3, p2: -1e-3, k3: 0.05 };
    // Pixels of an ideal lens, read with the lens of the file.
    let mut undistorted = with_lens(Preset::Good, BrownConrady::default());
    with_camera(&mut undistorted, |camera| camera.distortion = lens);
    assert_first(&undistorted, "undistorted images");
    let mut reversed = with_lens(Preset::Good, lens);
    with_camera(&mut reversed, |camera| {
        let BrownConrady { k1, k2, p1, p2, k3 } = lens;
        camera.distortion = BrownConrady { k1: -k1, k2: -k2, p1: -p1, p2: -p2, k3: -k3 };
    });
    assert_first(&reversed, "distortion has the wrong sign");
    let mut from_one = with_lens(Preset::Good, lens);
    with_pixels(&mut from_one, |uv| uv.map(|x| x + 1.0));
    assert_first(&from_one, "counted from 1");
    let mut cropped = with_lens(Preset::Good, lens);
    with_pixels(&mut cropped, |[u, v]| [u - 320.0, v - 400.0]);
    assert_first(&cropped, "region of interest");
}

/// A correction of the seam points also corrects the stripes: `--fix` writes one recording and no mixture.
#[test]
fn stripes_are_mended_like_the_seam_points() {
    let truth = scan_plates(&Preset::Quick.scenario(), &Plates::default(), 3).unwrap();
    let mut recording = truth.clone();
    with_pixels(&mut recording, |[u, v]| [2447.0 - u, v]);
    for stripe in &mut recording.stripes {
        stripe.points = stripe.points.map(|point| match point {
            Measured::Pixel([u, v]) => Measured::Pixel([2447.0 - u, v]),
            other => other,
        });
    }
    let mended = examined(&recording).mended(&recording).unwrap();
    let [before, after] = [&truth, &mended].map(|recording| recording.stripes[7]);
    assert_eq!(before.points.map(rounded), after.points.map(rounded));
    assert!((before.sigma / after.sigma - 1.0).abs() < 1e-12);
}

fn rounded(measured: Measured) -> [i64; 2] {
    let Measured::Pixel(uv) = measured else { panic!("a camera sees pixels") };
    uv.map(|x| (x * 1e6).round() as i64)
}

#[test]
fn scale_of_a_profiler() {
    for (scale, words) in [
        ([0.1, 1.0], "x is 10 times too small"),
        ([1.0, 2.0], "z is twice the true size"),
        ([0.5, 1.0], "x is half the true size"),
    ] {
        let mut recording = simulate(&Preset::Profiler.scenario(), 11).unwrap();
        for f in &mut recording.features {
            let Measured::Profile([x, z]) = f.measured else { panic!("a profile") };
            f.measured = Measured::Profile([x * scale[0], z * scale[1]]);
        }
        assert_first(&recording, words);
    }
}

/// A lens with visible distortion. With the preset's weak one the wrong order fits as well, and is equally harmless.
#[test]
fn order_of_the_distortion() {
    let strong = BrownConrady { k1: -0.2, k2: 0.1, p1: 2e-3, p2: -1e-3, k3: 0.05 };
    let mut scenario = Preset::Quick.scenario();
    let SensorModel::CameraLaser { camera, .. } = &mut scenario.cell.sensor else { panic!() };
    camera.distortion = strong;
    let mut recording = simulate(&scenario, 11).unwrap();
    let Sensor::CameraLaser { camera, .. } = &mut recording.sensor else { panic!() };
    // Written k1, k2, k3, p1, p2; read as k1, k2, p1, p2, k3.
    camera.distortion = BrownConrady { p1: strong.k3, p2: strong.p1, k3: strong.p2, ..strong };
    let found = examined(&recording);
    assert!(found.findings.first().is_some_and(|f| f.contains("distortion")), "{found:#?}");
}

#[test]
fn stamps_of_another_unit_say_nothing_about_the_angles() {
    let mut recording = good();
    recording.robot.iter_mut().for_each(|sample| sample.stamp_ns /= 1000);
    let found = examined(&recording);
    assert!(found.findings.first().is_some_and(|first| first.contains("they are seconds")), "{found:#?}");
    assert!(!found.findings.iter().any(|finding| finding.contains("radians")), "{found:#?}");
}

#[test]
fn clocks_and_frames() {
    assert_named(|r| r.features.iter_mut().for_each(|f| f.stamp_ns /= 1000), "they are seconds");
    assert_named(
        |r| r.features.iter_mut().for_each(|f| f.stamp_ns += 3_600_000_000_000),
        "clocks that start at different times",
    );
    assert_named(
        |r| {
            let half = r.robot.len() / 2;
            let other = se3::from_parts(
                so3::exp(&nalgebra::Vector3::new(0.0, 0.3, 0.0)),
                nalgebra::Vector3::z() * 0.2,
            );
            for s in &mut r.robot[half..] {
                s.base_from_tool *= other;
            }
        },
        "switched",
    );
}

/// Poses that turn as no wrist can are not explained by pixels, stamps or a sensor. All mistakes are fitted in most of a minute.
#[test]
fn what_leaves_poses_that_turn_as_no_robot_can_is_not_tried() {
    let mut recording = good();
    for s in &mut recording.robot {
        let (a, b, c) = s.base_from_tool.rotation.euler_angles();
        s.base_from_tool.rotation =
            UnitQuaternion::from_euler_angles(a.to_degrees(), b.to_degrees(), c.to_degrees());
    }
    let found = examined(&recording);
    assert!(
        matches!(&found.findings[..], [only] if only.contains("faster than any robot")),
        "{:#?}",
        found.findings
    );
    let tried: Vec<&str> = found.trials.iter().map(|trial| trial.name.as_str()).collect();
    assert!(!tried.iter().any(|name| name.contains("pixel") || name.contains("stamps")), "{tried:?}");
}

#[test]
fn guesses() {
    let with_guess = |change: &dyn Fn(&mut trueline_dataset::Guess), words: &str| {
        assert_named(
            |r| {
                let mut guess = r.truth.as_ref().unwrap().parameters;
                change(&mut guess);
                r.initial = Some(guess);
            },
            words,
        );
    };
    with_guess(&|g| g.time_offset_s = -g.time_offset_s, "wrong sign");
    with_guess(&|g| g.tool_from_camera = g.tool_from_camera.inverse(), "camera_from_tool");
    with_guess(&|g| g.tool_from_camera.translation.vector *= 1e-3, "wrong unit");
    with_guess(
        &|g| {
            let q = *g.tool_from_camera.rotation.quaternion();
            g.tool_from_camera.rotation = UnitQuaternion::new_normalize(Quaternion::new(q.i, q.j, q.k, q.w));
        },
        "initial quaternion",
    );
    with_guess(&|g| g.tool_from_camera.translation.vector.z += 0.25, "another tool frame");
}

/// A profiler of 250 profiles per second, read as 240, and one of 125 read as 240.
#[test]
fn stamps_counted_with_another_rate() {
    for factor in [1.0417, 0.52] {
        let mut recording = simulate(&Preset::Profiler.scenario(), 11).unwrap();
        let first_ns = recording.features[0].stamp_ns;
        for feature in &mut recording.features {
            feature.stamp_ns = first_ns + ((feature.stamp_ns - first_ns) as f64 * factor).round() as i64;
        }
        let found = examined(&recording);
        let said = found.findings.first().cloned().unwrap_or_default();
        assert!(said.contains("made with a wrong rate"), "{factor}: {:#?}", found.findings);
        // Their intervals must be multiplied by 1/factor, to a tenth of a percent.
        assert!(said.contains(&format!(" Hz, {factor:.2}")), "{factor}: {said}");
    }
}

/// Stamps in ms read as s give no result at all, and are still reported.
#[test]
fn stamps_of_the_robot_in_another_unit() {
    for (factor, words) in [(1_000, "they are milliseconds"), (1_000_000, "they are microseconds")] {
        assert_named(|r| r.robot.iter_mut().for_each(|s| s.stamp_ns *= factor), words);
    }
}

#[test]
fn inches() {
    assert_named(|r| with_positions(r, |p| p.map(|x| x / 25.4)), "they are inches");
}

/// Kawasaki's O, A, T composed as if they were KUKA's A, B, C.
#[test]
fn angles_of_a_sequence_that_few_know() {
    let written: trueline_geometry::euler::EulerSequence = "zyz-intrinsic".parse().unwrap();
    let composed: trueline_geometry::euler::EulerSequence = "zyx-intrinsic".parse().unwrap();
    let mut recording = good_elsewhere();
    for s in &mut recording.robot {
        s.base_from_tool.rotation = composed.rotation(written.angles(&s.base_from_tool.rotation));
    }
    assert_first(&recording, "zyz-intrinsic");
}

/// A sensor of 60 Hz whose stamps were counted with 50 Hz: the ratio to a thousandth, and the rate in Hz.
#[test]
fn a_rate_is_refined() {
    let mut recording = simulate(&Preset::Profiler.scenario(), 11).unwrap();
    let first_ns = recording.features[0].stamp_ns;
    for feature in &mut recording.features {
        feature.stamp_ns = first_ns + ((feature.stamp_ns - first_ns) as f64 * 1.2).round() as i64;
    }
    let found = examined(&recording);
    let said = found.findings.first().cloned().unwrap_or_default();
    assert!(said.contains("1.200 times the stamped") && said.contains(" Hz"), "{said}");
}
