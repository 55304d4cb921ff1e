//! Every form says the same pose as the table that scipy's `Rotation` computed.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use trueline_geometry::Pose;
use trueline_model::{BrownConrady, Camera};
use trueline_report::export::{FORMATS, Mounting, Unsupported, named, time_offset};

const Q: [f64; 4] = [0.729383791, 0.150630140, 0.166590790, 0.646186781];

fn mounting() -> Mounting {
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(Q[0], Q[1], Q[2], Q[3]));
    Mounting::new(
        Pose::from_parts(Vector3::new(0.06197, -0.017996, 0.145008).into(), rotation),
        Some(0.017663),
    )
}

/// The numbers with a decimal point in a text, in their order.
fn numbers(text: &str) -> Vec<f64> {
    let words = text.split(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-' | 'e')));
    words.filter(|word| word.contains('.')).filter_map(|word| word.parse().ok()).collect()
}

fn assert_says(name: &str, expected: &[f64]) {
    let text = named(name).unwrap().text(&mounting()).unwrap();
    let found = numbers(&text);
    assert!(found.len() >= expected.len(), "{name}: {text}");
    for (a, b) in found.iter().zip(expected) {
        // The table has nine digits, angles six decimals.
        assert!((a - b).abs() < 6e-7, "{name}: {a} is not {b}:\n{text}");
    }
}

#[test]
fn robots() {
    let t = [61.97, -17.996, 145.008];
    let with = |rotation: &[f64]| [&t[..], rotation].concat();
    assert_says("abb-tooldata", &with(&Q));
    assert_says("abb-wobjdata", &with(&Q));
    assert_says("abb-pose", &with(&Q));
    assert_says("kuka", &with(&[83.713024, 2.771150, 25.819737]));
    assert_says("kuka-frame", &with(&[83.713024, 2.771150, 25.819737]));
    assert_says("fanuc", &with(&[25.819737, 2.771150, 83.713024]));
    assert_says("yaskawa", &with(&[25.819737, 2.771150, 83.713024]));
    assert_says("ur", &[0.06197, -0.017996, 0.145008, 0.331765184, 0.366918760, 1.423236255]);
    let staubli = named("staubli").unwrap().text(&mounting()).unwrap();
    assert!((numbers(&staubli)[3] - 0.282733).abs() < 6e-7, "{staubli}");
    assert_eq!(
        named("abb-pose").unwrap().text(&mounting()).unwrap().split("],[").next().unwrap(),
        "CONST pose pSensor:=[[61.970000,-17.996000,145.008000"
    );
}

#[test]
fn ros_and_programs() {
    let m = [0.06197, -0.017996, 0.145008];
    assert_says("ros2", &[&m[..], &[Q[1], Q[2], Q[3], Q[0]]].concat());
    assert_says("easy-handeye2", &[&m[..], &[Q[1], Q[2], Q[3], Q[0]]].concat());
    let urdf = [0.450639428, 0.048365688, 1.461067900];
    assert_says("urdf", &[&m[..], &urdf].concat());
    let rows = [
        [0.109380306, -0.892449139, 0.437687655, 61.97],
        [0.992823515, 0.119506411, -0.004436832, -17.996],
        [-0.048346833, 0.435031898, 0.899116139, 145.008],
    ];
    assert_says("matrix", rows.as_flattened());
    assert_says("matlab", rows.as_flattened());
    // Kalibr's transform is the inverse, and its shift has the other sign.
    let kalibr = named("kalibr").unwrap().text(&mounting()).unwrap();
    let found = numbers(&kalibr);
    let expected = [0.109380306, 0.992823515, -0.048346833, 0.018099232];
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{kalibr}");
    assert!(kalibr.ends_with("timeshift_cam_imu: -0.017663000"), "{kalibr}");
}

#[test]
fn names_are_unique_and_every_form_explains_itself() {
    let mut names: Vec<&str> =
        FORMATS.iter().flat_map(|f| std::iter::once(f.name).chain(f.aliases.iter().copied())).collect();
    let all = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), all);
    for format in FORMATS {
        assert!(
            format.convention.len() > 20 && !format.text(&mounting()).unwrap().contains("-0.000000 "),
            "{}",
            format.name
        );
    }
}

#[test]
fn what_kalibr_cannot_say_is_refused() {
    let camera = |k3: f64| Camera {
        size: [2448, 2048],
        focal: nalgebra::Vector2::new(3598.0, 3597.0),
        centre: nalgebra::Vector2::new(1211.0, 1007.0),
        distortion: BrownConrady::from_opencv([0.1, 0.0, 0.0, 0.0, k3]),
    };
    let kalibr = named("kalibr").unwrap();
    let with = |k3| Mounting { camera: Some(camera(k3)), ..mounting() };
    assert_eq!(kalibr.text(&with(0.01)), Err(Unsupported::ThirdRadialCoefficient));
    assert!(kalibr.text(&with(0.0)).unwrap().contains("intrinsics: [3598, 3597, 1211, 1007]"));
    assert_eq!(kalibr.text(&Mounting { time_offset_s: None, ..mounting() }), Err(Unsupported::NoTimeOffset));
}

#[test]
fn the_rule_of_the_time_offset_has_its_sign() {
    assert_eq!(time_offset::rule(0.017663), "true exposure = stamp − 17.663 ms");
    assert_eq!(time_offset::rule(-0.004), "true exposure = stamp + 4.000 ms");
    for snippet in time_offset::snippets(0.017663) {
        assert!(snippet.text.contains("stamp - (0.017663)"), "{}", snippet.language);
    }
}

#[test]
fn the_use_of_the_time_offset_is_a_form_of_its_own() {
    let text = named("time-offset").unwrap().text(&mounting()).unwrap();
    assert!(text.starts_with("true exposure = stamp − 17.663 ms\n"), "{text}");
    // Each program subtracts the offset once, whatever its sign.
    assert_eq!(text.matches("stamp - (0.017663)").count(), 3, "{text}");
    for words in ["enter it there", "Calibrate again when", "Python:", "C++:", "RAPID:"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let unknown = Mounting { time_offset_s: None, ..mounting() };
    assert_eq!(named("time-offset").unwrap().text(&unknown), Err(Unsupported::NoTimeOffset));
}
