//! Contents of `sensor.toml` besides the sensor: read, written, converted, refused.

use nalgebra::DMatrix;
use std::path::Path;
use trueline_dataset::sensor_setup::{
    Mounted, RegionOfInterest, SensorCovariance, SensorParameter, SensorSetup, SensorUncertainty,
};
use trueline_dataset::sensor_toml::{self, CameraFile};
use trueline_dataset::{Sensor, SensorFile, folder};
use trueline_geometry::Plane;

const CAMERA: &str =
    "[camera]\nwidth = 2448\nheight = 2000\nfx = 3598.0\nfy = 3597.0\ncx = 1211.0\ncy = 1007.0\n";
const PLANE: &str = "[laser_plane]\nnormal = [0.0, 0.6, 0.8]\noffset_mm = 100.0\n";

fn parse(text: &str) -> Result<SensorFile, trueline_dataset::Error> {
    sensor_toml::parse_file(Path::new("sensor.toml"), text)
}

fn camera_with(rest: &str) -> String {
    format!("kind = \"camera_laser\"\n{CAMERA}{PLANE}{rest}")
}

#[test]
fn units_of_the_uncertainty_are_converted() {
    let text = camera_with(
        "[robot]\naccuracy_mm = 0.3\n[uncertainty]\nplane_offset_mm = 0.3\nplane_normal_deg = 0.2\nfocal_percent = 0.3\nprincipal_point_px = 10\n",
    );
    let setup = parse(&text).unwrap().setup;
    let uncertainty = setup.uncertainty.unwrap();
    assert_eq!(setup.robot_accuracy_m, Some(0.3e-3));
    assert_eq!(uncertainty.plane_offset_m, Some(0.3e-3));
    assert_eq!(uncertainty.plane_normal_rad, Some(0.2_f64.to_radians()));
    assert_eq!(uncertainty.focal, Some(0.003));
    assert_eq!(uncertainty.principal_point_px, Some(10.0));
    assert_eq!((uncertainty.scale, uncertainty.covariance), (None, None));
    assert_eq!(setup.mounted, Mounted::Tool);
}

#[test]
fn profilers_have_keys_of_their_own() {
    let setup = parse(
        "kind = \"profiler\"\nmounted = \"fixed\"\n[shape]\nh = [0.01, 0.02, 0.03, 0.0004, 0.0005]\norigin_mm = [1, 90]\n[region_of_interest]\nx_mm = [-20, 20]\nz_mm = [60, 120]\n[uncertainty]\nscale_percent = 0.5\nshear_deg = 0.3\nkeystone_percent = 0.4\n",
    )
    .unwrap()
    .setup;
    assert_eq!(setup.mounted, Mounted::Fixed);
    // Per millimetre in the file, per metre inside.
    let shape = setup.shape.unwrap();
    assert_eq!(shape.h, [0.01, 0.02, 0.03, 0.0004 * 1000.0, 0.0005 * 1000.0]);
    assert_eq!(shape.origin_m, [0.001, 0.09]);
    let region = RegionOfInterest::Sheet { x_m: [-0.02, 0.02], z_m: [0.06, 0.12] };
    assert_eq!(setup.region_of_interest, Some(region));
    let uncertainty = setup.uncertainty.unwrap();
    assert_eq!((uncertainty.scale, uncertainty.keystone), (Some(0.005), Some(0.004)));
    assert_eq!(uncertainty.shear_rad, Some(0.3_f64.to_radians()));
}

#[test]
fn a_covariance_is_written_in_millimetres_and_read_back() {
    let order = vec![SensorParameter::Fx, SensorParameter::NormalE2, SensorParameter::Offset];
    let root = DMatrix::from_row_slice(3, 3, &[0.5, 0.0, 0.0, 1e-4, 2e-4, 0.0, 1e-5, -3e-5, 4e-5]);
    let covariance = SensorCovariance { order, matrix: &root * root.transpose() };
    let uncertainty = SensorUncertainty {
        plane_offset_m: Some(5e-5),
        covariance: Some(covariance.clone()),
        ..SensorUncertainty::default()
    };
    let plane = Plane::from_height(0.036, 2.12, 0.1307).unwrap();
    let mut file = parse(&camera_with("")).unwrap();
    let Sensor::CameraLaser { laser_plane_in_camera, .. } = &mut file.sensor else { panic!("a camera") };
    *laser_plane_in_camera = plane;
    let region = RegionOfInterest::Pixels { u_px: [10.0, 2000.0], v_px: [0.0, 1999.0] };
    file.setup = SensorSetup {
        uncertainty: Some(uncertainty),
        edge_radius_m: Some(0.25e-3),
        waviness_m: Some(0.0),
        robot_accuracy_m: Some(0.0002),
        mounted: Mounted::Fixed,
        region_of_interest: Some(region),
        shape: None,
    };
    let text = sensor_toml::format_file(&file);
    let back = parse(&text).unwrap();
    assert_eq!(back.setup.mounted, Mounted::Fixed, "{text}");
    assert_eq!(back.setup.region_of_interest, Some(region));
    let read = back.setup.uncertainty.unwrap().covariance.unwrap();
    assert_eq!(read.order, covariance.order);
    // Millimetres and back: two roundings each way.
    assert!((&read.matrix - &covariance.matrix).abs().max() <= 1e-15 * covariance.matrix.amax());
    // The variance of the offset, 2.6e-9 m² (1e-10 + 9e-10 + 16e-10), stands in the file as 2.6e-3 mm².
    let wire: toml::Table = text.parse().unwrap();
    let corner = wire["uncertainty"]["covariance"]["matrix"][2][2].as_float().unwrap();
    assert!((corner - 2.6e-3).abs() < 1e-12, "{corner}");
}

#[test]
fn a_camera_without_its_laser_plane_is_a_camera_file_and_no_sensor() {
    let text = format!("kind = \"camera_laser\"\n{CAMERA}");
    let file = sensor_toml::parse_camera(Path::new("sensor.toml"), &text).unwrap();
    assert_eq!(file.laser_plane_in_camera, None);
    let again = sensor_toml::parse_camera(Path::new("s"), &sensor_toml::format_camera(&file)).unwrap();
    assert_eq!(again, CameraFile { ..file });
    let error = parse(&text).unwrap_err().to_string();
    assert!(error.contains("laser_plane") && error.contains("trueline sensor laser-plane"), "{error}");
}

#[test]
fn what_cannot_be_is_refused_with_its_key() {
    let table =
        |rows: &str| format!("[uncertainty.covariance]\norder = [\"fx_px\", \"fy_px\"]\nmatrix = {rows}\n");
    for (rest, key) in [
        ("[uncertainty]\nplane_offset_mm = -1\n".to_owned(), "uncertainty.plane_offset_mm"),
        ("[uncertainty]\nfocal_percent = nan\n".to_owned(), "uncertainty.focal_percent"),
        ("[uncertainty]\nscale_percent = 1\n".to_owned(), "uncertainty.scale_percent"),
        ("[robot]\naccuracy_mm = inf\n".to_owned(), "robot.accuracy_mm"),
        ("[shape]\nh = [0, 0, 0, 0, 0]\n".to_owned(), "shape"),
        ("[region_of_interest]\nu_px = [5, 1]\nv_px = [0, 9]\n".to_owned(), "region_of_interest"),
        ("[region_of_interest]\nx_mm = [0, 1]\nz_mm = [0, 9]\n".to_owned(), "region_of_interest"),
        (table("[[1, 2], [2, 1]]"), "negative eigenvalue"),
        (table("[[1, 0.5], [0, 1]]"), "not symmetric"),
        (table("[[1, 0]]"), "as many rows"),
        (table("[[1, 0], [0, -1]]"), "negative variance"),
        ("[uncertainty.covariance]\norder = [\"fx\"]\nmatrix = [[1]]\n".to_owned(), "order"),
        (
            "[uncertainty.covariance]\norder = [\"k1\", \"k1\"]\nmatrix = [[1, 0], [0, 1]]\n".to_owned(),
            "order",
        ),
    ] {
        let error = parse(&camera_with(&rest)).unwrap_err().to_string();
        assert!(error.contains(key), "{rest}: {error}");
    }
    let error = parse(&format!("kind = \"profiler\"\n{CAMERA}")).unwrap_err();
    assert!(error.to_string().contains("camera"), "{error}");
    let error = parse(&format!("kind = \"profiler\"\n{PLANE}")).unwrap_err().to_string();
    assert!(error.contains("laser_plane"), "{error}");
}

#[test]
fn an_unknown_key_is_named_with_its_line() {
    let error = parse(&camera_with("[uncertainty]\nplane_ofset_mm = 1\n")).unwrap_err();
    // kind, [camera] and six rows, [laser_plane] and two rows, [uncertainty]: the twelfth line is [uncertainty].
    assert_eq!(error.line, Some(13), "{error}");
    assert!(error.to_string().contains("plane_ofset_mm"), "{error}");
}

#[test]
fn what_no_command_applies_yet_is_not_ignored() {
    let dir = tempfile::tempdir().unwrap();
    let rest = "[region_of_interest]\nx_mm = [-20, 20]\nz_mm = [60, 120]\n";
    std::fs::write(dir.path().join("sensor.toml"), format!("kind = \"profiler\"\n{rest}")).unwrap();
    let error = folder::read_sensor(dir.path()).unwrap_err().to_string();
    assert!(error.contains("yet"), "{error}");
}

#[test]
fn a_profilers_covariance_is_written_in_millimetres_and_read_in_metres() {
    let sigma = [1e-3, 2e-3, 3e-3, 0.04, 0.05];
    let covariance =
        nalgebra::SMatrix::<f64, 5, 5>::from_fn(|i, j| sigma[i] * sigma[j] * if i == j { 1.0 } else { 0.3 });
    let uncertainty = SensorUncertainty::of_shape(&covariance);
    // Half a tenth per metre over 30 mm.
    assert!((uncertainty.keystone.unwrap() - 0.05 * 0.03).abs() < 1e-15);
    let setup = SensorSetup { uncertainty: Some(uncertainty), ..SensorSetup::default() };
    let text = sensor_toml::format_file(&SensorFile { sensor: Sensor::Profiler, setup });
    // (0.04/m)² is 1.6e-9/mm².
    let table: toml::Table = text.parse().unwrap();
    let of_h4 = table["uncertainty"]["covariance"]["matrix"][3][3].as_float().unwrap();
    assert!((of_h4 / 1.6e-9 - 1.0).abs() < 1e-12 && text.contains("h4_per_mm"), "{text}");
    let read = parse(&text).unwrap().setup.uncertainty.unwrap();
    let back = read.covariance.unwrap().shape().unwrap();
    assert!((back - covariance).component_div(&covariance).amax() < 1e-12, "{back}");
    // A profiler has no focal length, and a camera no such shape.
    let wrong = text.replace("h4_per_mm", "fx_px");
    assert!(parse(&wrong).is_err());
}

/// OpenCV writes XML where the name of the file says so.
#[test]
fn a_camera_as_xml_is_named_for_what_it_is() {
    let text =
        "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>640</image_width>\n</opencv_storage>\n";
    let error = parse(text).unwrap_err();
    assert_eq!(error.to_string(), "sensor.toml: is a camera by OpenCV as XML; this format is not supported");
    assert!(error.hint().contains("write it as YAML"), "{}", error.hint());
}
