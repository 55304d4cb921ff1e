//! The examples in C and C++ compile, and compute the same bytes as Rust; the header's structs are those of the library.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::Vector3;
use std::fmt::Write as _;
use std::mem::offset_of;
use std::path::{Path, PathBuf};
use std::process::Command;
use trueline_geometry::{Axis, AxisKind, Pose, se3};
use trueline_rt::{
    AxisCarries, AxisError, Carrier, ExternalAxis, LinksCovariance, PlaceError, Placer, PlacerCalibration,
    Points, SeamTrack, SensorModel, Settings, TrackSettings,
};
use trueline_rt_c::{
    AxisHealthPlain, AxisPlain, CalibrationPlain, HealthPlain, PlacedPlain, PosePlain, SettingsPlain,
    TargetPlain, TrackSettingsPlain,
};

/// The library as cargo built it for this test.
fn library() -> PathBuf {
    let deps = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    let is_ours = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        name.starts_with("libtrueline_rt_c") && name.ends_with(".a")
    };
    let files = std::fs::read_dir(deps).unwrap().map(|entry| entry.unwrap().path()).filter(is_ours);
    files.max_by_key(|path| path.metadata().unwrap().modified().unwrap()).unwrap()
}

/// Compiles a program and runs it; what it printed.
fn run(compiler: &str, standard: &str, source: &Path) -> String {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("program");
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    let compiled = Command::new(compiler)
        .args([standard, "-Wall", "-Wextra", "-Werror", "-pedantic", "-I"])
        .arg(include)
        .arg(source)
        .arg(library())
        .args(["-lm", "-lpthread", "-ldl", "-o"])
        .arg(&program)
        .output()
        .unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let ran = Command::new(program).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    String::from_utf8(ran.stdout).unwrap()
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name)
}

fn bits(numbers: &[f64], text: &mut String) {
    numbers.iter().for_each(|number| writeln!(text, "{:016x}", number.to_bits()).unwrap());
}

#[test]
fn the_c_example_gives_the_same_bytes() {
    let mut covariance = LinksCovariance::zeros();
    covariance.fill_diagonal(1e-8);
    let calibration = PlacerCalibration {
        sensor: SensorModel::Profiler,
        shape: None,
        tool_from_camera: se3::from_parts(
            nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(0.8, 0.0, 0.0, 0.6)),
            Vector3::new(0.05, 0.0, 0.1),
        ),
        time_offset_s: 0.017,
        covariance,
        reading_sigma_m: 2e-5,
        carrier: Carrier::Tool,
        axes: Vec::new(),
    };
    let mut placer = Placer::new(&calibration, &Settings::default()).unwrap();
    for k in 0..200 {
        let t = 0.004 * f64::from(k);
        let pose = Pose::translation(0.8 + 0.1 * t, 0.02 * t * t, 0.3);
        placer.push_pose(4_000_000 * i64::from(k), &pose).unwrap();
    }
    let points: Vec<[f64; 2]> = (0..5).map(|k| [0.001 * f64::from(k), 0.2 + 0.0005 * f64::from(k)]).collect();
    let (mut base, mut sigma) = ([[0.0; 3]; 5], [0.0; 5]);
    let placed = placer.place(517_000_000, Points::Profile(&points), &mut base, &mut sigma).unwrap();
    let mut wanted = format!("{} {} {}\n", placed.placed, placed.flagged, placed.exposed_ns);
    bits(base.as_flattened(), &mut wanted);
    bits(&sigma, &mut wanted);
    let ended = placer.place(900_000_000, Points::Profile(&points), &mut base, &mut sigma);
    assert!(matches!(ended, Err(PlaceError::PosesEnded { .. })));
    writeln!(wanted, "{}", trueline_rt_c::status::POSES_ENDED).unwrap();
    assert_eq!(run("cc", "-std=c99", &example("place.c")), wanted);
}

#[test]
fn the_example_with_a_table_gives_the_same_bytes() {
    let covariance = ExternalAxis::covariance_of(1e-4, 1e-4, 0.0, 1e-4);
    let axis = Axis {
        time_offset_s: 0.012,
        ..Axis::new(AxisKind::Rotary, Vector3::z_axis(), Vector3::new(0.8, 0.1, 0.0))
    };
    let calibration = PlacerCalibration {
        sensor: SensorModel::Profiler,
        shape: None,
        tool_from_camera: Pose::translation(0.05, 0.0, 0.1),
        time_offset_s: 0.017,
        covariance: LinksCovariance::zeros(),
        reading_sigma_m: 2e-5,
        carrier: Carrier::Tool,
        axes: vec![ExternalAxis { axis, carries: AxisCarries::Part, in_pose: None, covariance }],
    };
    let mut placer = Placer::new(&calibration, &Settings::default()).unwrap();
    for k in 0..200 {
        placer.push_pose(4_000_000 * i64::from(k), &Pose::translation(0.8, 0.02, 0.3)).unwrap();
        placer.push_axis(0, 4_000_000 * i64::from(k), 0.5 * 0.004 * f64::from(k)).unwrap();
    }
    let (mut base, mut sigma) = ([[0.0; 3]; 1], [0.0; 1]);
    let mut wanted = String::new();
    for k in 0..5 {
        placer
            .place((300 + 100 * k) * 1_000_000, Points::Profile(&[[0.001, 0.2]]), &mut base, &mut sigma)
            .unwrap();
        bits(base.as_flattened(), &mut wanted);
        bits(&sigma, &mut wanted);
    }
    assert!(matches!(placer.push_axis(1, 0, 0.0), Err(AxisError::NoSuchAxis { .. })));
    writeln!(wanted, "{}", trueline_rt_c::status::NO_AXIS).unwrap();
    assert_eq!(run("cc", "-std=c99", &example("table.c")), wanted);
}

/// The loop checks itself: it ends with 1 where the torch leaves what its ± allows.
#[test]
fn the_control_loop_in_cpp_leads_a_torch() {
    let told = run("c++", "-std=c++11", &example("torch_loop.cpp"));
    assert!(told.starts_with("led ") && told.contains("worst "), "{told}");
}

#[test]
fn the_cpp_example_gives_the_same_bytes() {
    let mut track = SeamTrack::new(&TrackSettings::default()).unwrap();
    for k in 0..100 {
        let x = 0.001 * f64::from(k);
        track.push(&Vector3::new(x, 2.0 * x * x, 0.1), 5e-5).unwrap();
    }
    let torch = se3::from_parts(
        nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(0.0, 1.0, 0.0, 0.0)),
        Vector3::new(0.030, 0.0018, 0.1),
    );
    let target = track.ahead(&torch, 0.020, 0.080).unwrap();
    let mut wanted = String::new();
    bits(target.base_from_torch.translation.vector.as_slice(), &mut wanted);
    let q = target.base_from_torch.rotation.quaternion();
    bits(&[q.w, q.i, q.j, q.k, target.along_m, target.sigma_m], &mut wanted);
    writeln!(wanted, "{}", trueline_rt_c::status::NO_SEAM).unwrap();
    assert_eq!(run("c++", "-std=c++11", &example("follow.cpp")), wanted);
}

/// The name of a field in C, and its place in Rust.
macro_rules! fields {
    ($plain:ty, $c:literal, $($field:ident),+) => {
        (
            $c,
            size_of::<$plain>(),
            vec![$((stringify!($field), offset_of!($plain, $field))),+],
        )
    };
}

/// A struct's name in C, its size, and its fields with their places.
type Plain = (&'static str, usize, Vec<(&'static str, usize)>);

#[allow(clippy::too_many_lines, reason = "a table of all fields, a line each")]
fn structs() -> Vec<Plain> {
    vec![
        fields!(PosePlain, "trueline_pose", translation_m, rotation_wxyz),
        fields!(
            CalibrationPlain,
            "trueline_calibration",
            sensor,
            carrier,
            has_plane,
            has_shape,
            image_size_px,
            focal_px,
            centre_px,
            distortion,
            plane_normal,
            plane_offset_m,
            shape_h,
            shape_origin_m,
            tool_from_camera,
            time_offset_s,
            covariance,
            reading_sigma_m
        ),
        fields!(
            SettingsPlain,
            "trueline_settings",
            pose_stamps,
            frame_stamps,
            readout,
            poses_kept,
            axis_stamps,
            reserved,
            readout_step_s,
            stamp_sigma_s,
            half_window_s,
            longest_prediction_s,
            acceleration_m_s2,
            angular_acceleration_rad_s2,
            fastest_m_s,
            fastest_rad_s
        ),
        fields!(
            AxisPlain,
            "trueline_axis",
            kind,
            carries,
            direction,
            point_m,
            scale,
            time_offset_s,
            in_pose,
            reserved,
            pose_direction,
            pose_point_m,
            pose_scale,
            covariance
        ),
        fields!(
            AxisHealthPlain,
            "trueline_axis_health",
            is_settled,
            is_stalled,
            silent_s,
            period_s,
            noise,
            jumps,
            reserved
        ),
        fields!(PlacedPlain, "trueline_placed", placed, flagged, exposed_ns, age_s),
        fields!(
            HealthPlain,
            "trueline_health",
            is_settled,
            is_stalled,
            silent_s,
            pose_period_s,
            pose_noise_m,
            pose_noise_rad,
            usual_late_s,
            jumps
        ),
        fields!(
            TrackSettingsPlain,
            "trueline_track_settings",
            half_window_m,
            longest_extrapolation_m,
            curvature_per_m,
            jump_m,
            points_kept,
            reserved
        ),
        fields!(
            TargetPlain,
            "trueline_target",
            base_from_torch,
            along_m,
            tangent,
            across,
            upward,
            sigma_m,
            off_m
        ),
    ]
}

#[test]
fn the_structs_of_the_header_are_those_of_the_library() {
    let structs = structs();
    let (mut program, mut wanted) =
        (String::from("#include <stdio.h>\n#include \"trueline_rt.h\"\nint main(void) {\n"), String::new());
    for (name, size, fields) in &structs {
        writeln!(program, "printf(\"{name} %zu\\n\", sizeof({name}));").unwrap();
        writeln!(wanted, "{name} {size}").unwrap();
        for (field, offset) in fields {
            writeln!(program, "printf(\"{field} %zu\\n\", offsetof({name}, {field}));").unwrap();
            writeln!(wanted, "{field} {offset}").unwrap();
        }
    }
    program.push_str("return 0;\n}\n");
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("structs.c");
    std::fs::write(&source, program).unwrap();
    assert_eq!(run("cc", "-std=c99", &source), wanted);
}

/// Every number that the header defines for a status is the one of the library.
#[test]
fn the_numbers_of_the_header_are_those_of_the_library() {
    use trueline_rt_c::status;
    let header = include_str!("../include/trueline_rt.h");
    let of = |name: &str| -> i32 {
        let line =
            header.lines().find(|line| line.starts_with(&format!("#define TRUELINE_{name} "))).unwrap();
        line.split_whitespace().nth(2).unwrap().parse().unwrap()
    };
    for (name, number) in [
        ("OK", status::OK),
        ("NULL_POINTER", status::NULL_POINTER),
        ("BAD_SETTING", status::BAD_SETTING),
        ("NOT_FINITE", status::NOT_FINITE),
        ("NOT_LATER", status::NOT_LATER),
        ("CLOCK_WENT_BACK", status::CLOCK_WENT_BACK),
        ("UNSETTLED", status::UNSETTLED),
        ("STAMP_JUMPED", status::STAMP_JUMPED),
        ("NO_POSE", status::NO_POSE),
        ("DOUBTFUL_POSES", status::DOUBTFUL_POSES),
        ("POSES_ENDED", status::POSES_ENDED),
        ("OTHER_SENSOR", status::OTHER_SENSOR),
        ("OFF_SEAM", status::OFF_SEAM),
        ("ANOTHER_SEAM", status::ANOTHER_SEAM),
        ("NO_SEAM", status::NO_SEAM),
        ("PANIC", status::PANIC),
        ("NO_AXIS", status::NO_AXIS),
        ("NO_AXIS_VALUE", status::NO_AXIS_VALUE),
    ] {
        assert_eq!(of(name), number, "{name}");
    }
    assert_eq!(of("RT_ABI").unsigned_abs(), trueline_rt_c::trueline_rt_abi());
}

#[test]
#[allow(unsafe_code, reason = "the functions of the header are called as C calls them")]
fn null_is_refused_and_may_be_freed() {
    use std::ptr::{null, null_mut};
    use trueline_rt_c::{status, trueline_placer_free, trueline_placer_new, trueline_placer_place};
    // SAFETY: null is allowed everywhere.
    unsafe {
        assert_eq!(trueline_placer_new(null(), null(), null_mut()), status::NULL_POINTER);
        let (base, sigma, placed) = (null_mut(), null_mut(), null_mut());
        assert_eq!(
            trueline_placer_place(null_mut(), 0, null(), 5, base, sigma, placed),
            status::NULL_POINTER
        );
        trueline_placer_free(null_mut());
        trueline_rt_c::trueline_seam_track_free(null_mut());
    }
}
