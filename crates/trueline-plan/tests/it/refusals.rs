//! A cell that cannot be is refused, with the key.

use std::path::Path;
use trueline_dataset::{Error, sensor_toml};
use trueline_plan::{Cell, cell_toml};

fn parsed(text: &str, sensor: &str) -> Result<Cell, Error> {
    let file = Path::new("cell.toml");
    cell_toml::parse(file, text, sensor_toml::parse(file, sensor).unwrap())
}

fn refusal(from: &str, to: &str) -> String {
    let text = cell_toml::EXAMPLE.replace(from, to);
    assert_ne!(text, cell_toml::EXAMPLE, "`{from}` is not in the example");
    parsed(&text, cell_toml::EXAMPLE_SENSOR).unwrap_err().to_string()
}

#[test]
fn wrong_values_are_named() {
    for (from, to, said) in [
        ("speed_mm_s = 250.0", "speed_mm_s = 0.0", "limits.speed_mm_s"),
        ("speed_mm_s = 250.0", "speed_mm_s = nan", "limits.speed_mm_s"),
        ("speed_mm_s = 250.0", "speed = 250.0", "unknown field"),
        ("stand_off_mm = [100.0, 250.0]", "stand_off_mm = [250.0, 100.0]", "limits.stand_off_mm"),
        ("tilt_deg = [25.0, 25.0, 25.0]", "tilt_deg = [25.0, -1.0, 25.0]", "limits.tilt_deg"),
        ("to_mm = [1298.0, 105.5, 121.5]", "to_mm = [1002.0, 54.5, 118.5]", "`seam`"),
        ("approach = [0.0, 0.0, -1.0]", "approach = [0.9854, 0.1698, 0.01]", "attitude.approach"),
        ("approach = [0.0, 0.0, -1.0]", "approach = [0.0, 0.0, 0.0]", "attitude.approach"),
        ("backward = false", "base_from_tool_wxyz = [0.0, 1.0, 0.0, 0.0]", "`attitude`"),
        ("rotation_wxyz = [0.7294", "rotation_wxyz = [1.7294", "quaternion of length 1"),
        ("line_mm = 20.0", "line_mm = -20.0", "guess_error.line_mm"),
        ("margin_px = 100.0", "width_mm = 80.0", "`view`"),
        ("frames_hz = 33.0", "frames_hz = 0.0", "rates.frames_hz"),
        ("robot_hz = 250.0 ", "robot_hz = 5.0 ", "rates.robot_hz"),
        ("robot_hz = 250.0 ", "robot_hz = 1e9 ", "rates.robot_hz"),
        ("rotation_deg = 5.0", "rotation_deg = 400.0", "guess_error.rotation_deg"),
        ("to_mm = [1298.0, 105.5, 121.5]", "to_mm = [1002.3, 54.5, 118.5]", "10 mm apart"),
        ("[seam]", "[seam", "line"),
        ("# [arm] ", "[arm]\nname = \"irb\" #", "abb-irb2600-12-1.65"),
        ("# [arm] ", "[arm]\n#", "one of `name`, `urdf`"),
        ("# [arm] ", "[arm]\nname = \"ur5e\"\nurdf = \"a.urdf\"#", "several"),
        ("# [arm] ", "[arm]\nurdf = \"a.urdf\"#", "arm.urdf"),
        ("# [arm] ", "[arm]\nname = \"ur5e\"\nwrist_deg = 95 #", "arm.wrist_deg"),
        ("# [arm] ", "[[arm.joints]]\nrange_deg = [-1, 1]\nspeed_deg_s = 9 #", "six tables"),
        ("# [[spheres]] ", "[[spheres]]\nat_mm = [0, 0, 0]\nradius_mm = 9 #", "beside"),
        (
            "# [[spheres]] ",
            "[[plates]]\nnormal = [0, 0, 1]\n[[spheres]]\nat_mm = [0, 0, 0]\nradius_mm = 9\njoint = 2 #",
            "spheres.joint",
        ),
        ("tip_speed_mm_s = 250.0", "tip_speed_mm_s = 0.0", "limits.tip_speed_mm_s"),
    ] {
        let message = refusal(from, to);
        assert!(message.contains(said), "{to}: {message}");
    }
}

#[test]
fn a_profiler_needs_its_window() {
    let without = parsed(&cell_toml::EXAMPLE.replace("margin_px = 100.0", ""), "kind = \"profiler\"");
    assert!(without.unwrap_err().to_string().contains("width_mm"));
    let text = cell_toml::EXAMPLE.replace("margin_px = 100.0", "width_mm = 80.0\ndepth_mm = [80.0, 280.0]");
    assert!(parsed(&text, "kind = \"profiler\"").is_ok());
}

#[test]
fn a_cell_written_with_another_guess_reads_back() {
    let mut cell = parsed(cell_toml::EXAMPLE, cell_toml::EXAMPLE_SENSOR).unwrap();
    cell.guess_error.line_m = 1.25e-3;
    cell.seam.to_m.x += 0.01;
    let text = cell_toml::with_guess(Path::new("cell.toml"), cell_toml::EXAMPLE, &cell).unwrap();
    let read = parsed(&text, cell_toml::EXAMPLE_SENSOR).unwrap();
    assert!((read.guess_error.line_m - 1.25e-3).abs() < 1e-15);
    assert!((read.seam.to_m - cell.seam.to_m).norm() < 1e-12);
    assert!(read.sensor_pose.nominal_attitude().angle_to(&cell.sensor_pose.nominal_attitude()) < 1e-9);
    assert_eq!(read.limits, cell.limits);
}

#[test]
fn a_sensor_that_cannot_see_at_its_stand_off_is_told_where_it_does() {
    // The example's camera sees the seam from some 100 mm on: 300 mm further away than it may stand here.
    let text = cell_toml::EXAMPLE.replace("stand_off_mm = [100.0, 250.0]", "stand_off_mm = [2000.0, 2500.0]");
    let cell = parsed(&text, cell_toml::EXAMPLE_SENSOR).unwrap();
    let ask = trueline_plan::PlanRequest { evaluations: 1, ..trueline_plan::PlanRequest::default() };
    let refused = trueline_plan::plan(&cell, &ask, &|| ()).map(|plan| plan.score).unwrap_err();
    let trueline_plan::PlanError::Blind { seen_m: Some([near, far]), allowed_m } = refused else {
        panic!("{refused:?}")
    };
    assert!(near < far && far < allowed_m[0], "{near} {far}");
    assert!(refused.to_string().contains("it is in view from"), "{refused}");
    // Independent of the planner's own view: the seam's pixel, by the sensor's model, is in the picture at the stated
    // frames, with the margin of 100 px, and not beyond.
    let trueline_dataset::Sensor::CameraLaser { camera, .. } = &cell.sensor else { unreachable!() };
    let in_picture = |stand_off_m: f64| {
        let plane = cell.sheet.plane();
        // The point of the sheet at this depth in the middle of the stripe: n·p = d along the normal's own direction in the picture.
        let n = plane.normal();
        let sideways = nalgebra::Vector2::new(n.x, n.y);
        let at = sideways * ((plane.offset() - n.z * stand_off_m) / sideways.norm_squared());
        camera.project(&nalgebra::Vector3::new(at.x, at.y, stand_off_m)).is_some_and(|pixel| {
            let [width, height] = camera.size.map(f64::from);
            (99.5..width - 100.5).contains(&pixel.x) && (99.5..height - 100.5).contains(&pixel.y)
        })
    };
    // Distances are looked at in steps of 2 %.
    assert!(in_picture(near) && in_picture(far) && !in_picture(near / 1.03) && !in_picture(far * 1.03));
}

#[test]
fn the_profilers_example_can_be_planned() {
    let cell = parsed(cell_toml::PROFILER_EXAMPLE, cell_toml::PROFILER_EXAMPLE_SENSOR).unwrap();
    let shapes = vec![trueline_plan::Shape::TwoPasses];
    let ask =
        trueline_plan::PlanRequest { evaluations: 400, shapes, ..trueline_plan::PlanRequest::default() };
    let plan = trueline_plan::plan(&cell, &ask, &|| ()).unwrap();
    assert!(plan.prediction.shows_all() && plan.loss.used() <= 1.0);
}
