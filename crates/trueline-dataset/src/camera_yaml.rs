//! The camera of a YAML file, as OpenCV (`FileStorage`), ROS (`camera_info`) and Kalibr (camchain) write it.
//!
//! | by | size | matrix | distortion |
//! |---|---|---|---|
//! | OpenCV | `image_width`, `image_height` | `camera_matrix` of 9 numbers | `distortion_coefficients`: k1, k2, p1, p2[, k3] |
//! | ROS | the same; `width`, `height` | the same; `K`, `k` | the same, or `D`, `d`, with a `distortion_model` |
//! | Kalibr | `resolution` | `intrinsics`: fu, fv, pu, pv | `distortion_coeffs`: k1, k2, r1, r2 of `radtan` |
//!
//! Their pixels have their centres at whole numbers, as ours.

use crate::error::Problem;
use crate::log_problem::LogProblem;
use serde::de::{self, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;

/// The numbers of a camera as a file has them: px, and OpenCV's order of the distortion.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct YamlCamera {
    /// Width and height.
    pub size: [u32; 2],
    /// fx, fy, cx, cy.
    pub intrinsics: [f64; 4],
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// The laser plane, if somebody wrote it beside the camera.
    pub laser_plane: Option<([f64; 3], f64)>,
}

/// Numbers by themselves, in rows, or as the data of a matrix with its rows and columns.
struct Numbers(Vec<f64>);

impl<'de> Deserialize<'de> for Numbers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumbersVisitor)
    }
}

struct NumbersVisitor;

impl<'de> Visitor<'de> for NumbersVisitor {
    type Value = Numbers;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("numbers, or a matrix with its numbers as data")
    }

    fn visit_f64<E: de::Error>(self, number: f64) -> Result<Numbers, E> {
        Ok(Numbers(vec![number]))
    }

    fn visit_i64<E: de::Error>(self, number: i64) -> Result<Numbers, E> {
        self.visit_f64(number as f64)
    }

    fn visit_u64<E: de::Error>(self, number: u64) -> Result<Numbers, E> {
        self.visit_f64(number as f64)
    }

    /// OpenCV writes `0.` and `1.`, which some readers of YAML do not accept as numbers.
    fn visit_str<E: de::Error>(self, text: &str) -> Result<Numbers, E> {
        text.parse()
            .map_err(|_| E::custom(format!("expected a number, found `{text}`")))
            .and_then(|n| self.visit_f64(n))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Numbers, A::Error> {
        let mut all = Vec::new();
        while let Some(Numbers(some)) = items.next_element()? {
            all.extend(some);
        }
        Ok(Numbers(all))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Numbers, A::Error> {
        let mut data = Numbers(Vec::new());
        while let Some(key) = entries.next_key::<String>()? {
            if key == "data" {
                data = entries.next_value()?;
            } else {
                entries.next_value::<IgnoredAny>()?;
            }
        }
        Ok(data)
    }
}

#[derive(Deserialize)]
struct PlaneKeys {
    normal: [f64; 3],
    offset_mm: f64,
}

/// One camera, under every name that is used.
#[derive(Deserialize)]
struct CameraKeys {
    #[serde(alias = "width", alias = "imageWidth", alias = "Image_width", alias = "image_Width")]
    image_width: Option<u32>,
    #[serde(alias = "height", alias = "imageHeight", alias = "Image_height", alias = "image_Height")]
    image_height: Option<u32>,
    #[serde(alias = "image_size", alias = "imageSize")]
    resolution: Option<Vec<u32>>,
    #[serde(
        alias = "cameraMatrix",
        alias = "Camera_Matrix",
        alias = "K",
        alias = "k",
        alias = "mtx",
        alias = "intrinsic_matrix"
    )]
    camera_matrix: Option<Numbers>,
    intrinsics: Option<Vec<f64>>,
    #[serde(
        alias = "distCoeffs",
        alias = "dist_coeffs",
        alias = "dist_coeff",
        alias = "Distortion_Coefficients",
        alias = "distortion_coeffs",
        alias = "distortion",
        alias = "dist",
        alias = "D",
        alias = "d"
    )]
    distortion_coefficients: Option<Numbers>,
    distortion_model: Option<String>,
    camera_model: Option<String>,
    laser_plane: Option<PlaneKeys>,
}

/// Whether a text is YAML: its first line with content has a colon and no equals sign before it.
pub(crate) fn is_yaml(text: &str) -> bool {
    let content = |line: &&str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let line = text.trim_start_matches('\u{feff}').lines().find(content).unwrap_or_default();
    let key = line.split_once(':').is_some_and(|(key, _)| !key.contains(['=', '[', '"']));
    line.starts_with("%YAML") || line.trim_end() == "---" || key
}

/// Reads the camera.
///
/// # Errors
/// Broken YAML with its line, a lens of another model, several cameras, or a key that is missing.
pub(crate) fn read(text: &str) -> Result<YamlCamera, (Option<u64>, Problem)> {
    let mut found: Option<YamlCamera> = None;
    for document in documents(text) {
        let this = camera(one_camera(&document)?).map_err(|problem| (None, problem))?;
        if found.as_ref().is_some_and(|camera| *camera != this) {
            let expected = "one camera in the file: leave the others out";
            return Err((None, value("camera", expected, "documents that differ")));
        }
        found = Some(this);
    }
    found.ok_or_else(|| (None, Problem::Toml("not readable as the YAML of a camera: it is empty".to_owned())))
}

/// The documents with content, each below empty lines in place of the text before it. `ros2 topic echo` writes one for each
/// message.
fn documents(text: &str) -> Vec<String> {
    let mut all = vec![String::new()];
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        // OpenCV's first line is a directive of its own.
        let is_directive = index == 0 && line.starts_with("%YAML");
        if is_directive || matches!(line.trim_end(), "---" | "...") {
            all.push("\n".repeat(index + 1));
        } else if let Some(last) = all.last_mut() {
            last.push_str(line);
            last.push('\n');
        }
    }
    let has_content = |document: &String| {
        document.lines().any(|line| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
    };
    all.retain(has_content);
    all
}

fn one_camera(text: &str) -> Result<CameraKeys, (Option<u64>, Problem)> {
    let broken = |error: &serde_saphyr::Error| {
        let line = error.location().map(|location| location.line());
        let words = error.to_string();
        let first = words.lines().find(|line| !line.trim().is_empty()).unwrap_or_default().trim().to_owned();
        (line, Problem::Toml(format!("not readable as the YAML of a camera: {first}")))
    };
    // Of Kalibr each camera has a name.
    let is_chain = text.lines().any(|line| line.starts_with("cam0:"));
    if !is_chain {
        return serde_saphyr::from_str(text).map_err(|error| broken(&error));
    }
    let mut cameras: BTreeMap<String, CameraKeys> =
        serde_saphyr::from_str(text).map_err(|error| broken(&error))?;
    let names = cameras.keys().cloned().collect::<Vec<_>>().join(", ");
    match (cameras.len(), cameras.remove("cam0")) {
        (1, Some(camera)) => Ok(camera),
        _ => Err((None, value("camera", "one camera in the file: leave the others out", names))),
    }
}

fn camera(keys: CameraKeys) -> Result<YamlCamera, Problem> {
    let size = match (keys.image_width, keys.image_height, keys.resolution.as_deref()) {
        (Some(width), Some(height), _) => [width, height],
        (_, _, Some(&[width, height])) => [width, height],
        _ => return Err(LogProblem::CameraWithoutSize.into()),
    };
    let is_pinhole = keys.camera_model.as_deref().is_none_or(|model| model == "pinhole");
    if !is_pinhole {
        return Err(value("camera_model", "pinhole", keys.camera_model.unwrap_or_default()));
    }
    let matrix = keys.camera_matrix.map(|numbers| numbers.0);
    let intrinsics = match (matrix.as_deref(), keys.intrinsics.as_deref()) {
        (Some(&[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]), _) => [fx, fy, cx, cy],
        (Some(&[_, _, 0.0, _, _, 0.0, _, _, 1.0]), _) => {
            return Err(value("camera_matrix", "its numbers row by row", "numbers column by column"));
        }
        (Some(&[_, skew, _, _, _, _, 0.0, 0.0, 1.0]), _) => {
            return Err(value("camera_matrix", "no skew: 0 as its second number", skew.to_string()));
        }
        (Some(&[_, _, _, _, _, _, a, b, c]), _) => {
            return Err(value("camera_matrix", "0, 0, 1 as its third row", format!("{a}, {b}, {c}")));
        }
        (Some(few), _) => return Err(value("camera_matrix", "9 numbers, row by row", few.len().to_string())),
        (None, Some(&[fx, fy, cx, cy])) => [fx, fy, cx, cy],
        (None, Some(few)) => return Err(value("intrinsics", "fu, fv, pu, pv", few.len().to_string())),
        (None, None) => {
            return Err(value("camera_matrix", "camera_matrix with 9 numbers as its data", "none"));
        }
    };
    let coefficients = keys.distortion_coefficients.map(|numbers| numbers.0).unwrap_or_default();
    let distortion = distortion(&coefficients, keys.distortion_model.as_deref())?;
    let laser_plane = keys.laser_plane.map(|plane| (plane.normal, plane.offset_mm));
    Ok(YamlCamera { size, intrinsics, distortion, laser_plane })
}

/// k1, k2, p1, p2, k3 of the coefficients; the model must be that of Brown and Conrady.
fn distortion(coefficients: &[f64], model: Option<&str>) -> Result<[f64; 5], Problem> {
    const KNOWN: [&str; 6] = ["plumb_bob", "radtan", "rational_polynomial", "brown_conrady", "none", ""];
    if let Some(model) = model.filter(|model| !KNOWN.contains(model)) {
        let expected = "plumb_bob or radtan (k1, k2, p1, p2[, k3]): calibrate the lens with that model";
        return Err(value("distortion_model", expected, model));
    }
    if coefficients.iter().skip(5).any(|value| *value != 0.0) {
        let expected = "five coefficients, k1, k2, p1, p2, k3: calibrate without the rational model";
        return Err(value(
            "distortion_coefficients",
            expected,
            format!("{} that are not 0", coefficients.len()),
        ));
    }
    let mut five = [0.0; 5];
    for (to, from) in five.iter_mut().zip(coefficients) {
        *to = *from;
    }
    Ok(five)
}

fn value(key: &'static str, expected: &'static str, found: impl Into<String>) -> Problem {
    Problem::Value { key, expected, found: found.into() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    const SAME: YamlCamera = YamlCamera {
        size: [2448, 2000],
        intrinsics: [3598.0, 3597.0, 1211.0, 1007.5],
        distortion: [-0.08, 0.12, 2e-4, -3e-4, 0.0],
        laser_plane: None,
    };

    #[test]
    fn one_camera_by_opencv_ros_and_kalibr() {
        let opencv = "%YAML:1.0\n---\ncalibration_time: \"Sat Nov 28 2026\"\nimage_width: 2448\nimage_height: 2000\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 3598., 0., 1211., 0., 3597., 1.0075e+03, 0.,\n       0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ -8.0e-02, 0.12, 2.0e-04, -3.0e-04, 0. ]\navg_reprojection_error: 0.2\n";
        let ros = "image_width: 2448\nimage_height: 2000\ncamera_name: laser\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [3598.0, 0.0, 1211.0, 0.0, 3597.0, 1007.5, 0.0, 0.0, 1.0]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.08, 0.12, 0.0002, -0.0003, 0.0]\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]\n";
        let kalibr = "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: [-0.08, 0.12, 0.0002, -0.0003]\n  distortion_model: radtan\n  intrinsics: [3598.0, 3597.0, 1211.0, 1007.5]\n  resolution: [2448, 2000]\n  rostopic: /cam\n";
        let echo = "header:\n  frame_id: laser\nheight: 2000\nwidth: 2448\ndistortion_model: plumb_bob\nd:\n- -0.08\n- 0.12\n- 0.0002\n- -0.0003\n- 0.0\nk: [3598.0, 0.0, 1211.0, 0.0, 3597.0, 1007.5, 0.0, 0.0, 1.0]\n";
        for text in [opencv, ros, kalibr, echo] {
            assert!(is_yaml(text), "{text}");
            assert_eq!(read(text).map_err(|(_, problem)| problem.to_string()), Ok(SAME), "{text}");
        }
        // Messages of one camera, and a line that ends the last one.
        let messages = format!("{echo}---\n{}---\n", echo.replace("frame_id: laser", "frame_id: camera"));
        assert_eq!(read(&messages).map_err(|(_, problem)| problem.to_string()), Ok(SAME));
        let old = opencv.replace("image_width", "image_Width").replace("image_height", "image_Height");
        assert_eq!(read(&old).unwrap(), SAME);
        let with_plane = format!("{ros}laser_plane: {{normal: [0.0, -0.9, 0.43588989], offset_mm: 55.7}}\n");
        assert_eq!(read(&with_plane).unwrap().laser_plane, Some(([0.0, -0.9, 0.435_889_89], 55.7)));
    }

    #[test]
    fn what_is_no_such_camera_is_named() {
        let refused = |text: &str| read(text).unwrap_err().1.to_string();
        let kalibr = "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0, 0, 0]\n  distortion_model: equidistant\n  intrinsics: [1, 1, 1, 1]\n  resolution: [2, 2]\n";
        assert!(refused(kalibr).contains("`distortion_model`: expected plumb_bob or radtan"));
        let two = format!("{}{}", kalibr, kalibr.replace("cam0", "cam1"));
        assert!(refused(&two).contains("found cam0, cam1"));
        let (_, sizeless) = read("camera_matrix:\n  data: [1, 0, 1, 0, 1, 1, 0, 0, 1]\n").unwrap_err();
        assert!(sizeless.to_string().contains("size of its pictures"), "{sizeless}");
        assert!(sizeless.hint().contains("`image_width: WIDTH`"), "{}", sizeless.hint());
        let columns = "width: 9\nheight: 9\nk: [7, 0, 0, 0, 7, 0, 4, 4, 1]\n";
        assert!(refused(columns).contains("found numbers column by column"), "{}", refused(columns));
        let echo = "width: 2\nheight: 2\nk: [1, 0, 1, 0, 1, 1, 0, 0, 1]\n---\n";
        assert!(refused(&format!("{echo}{}", echo.replace("[1,", "[2,"))).contains("documents that differ"));
        assert_eq!(read(&format!("{echo}width: [1\n---\n")).unwrap_err().0, Some(5));
        assert!(refused("---\n").contains("it is empty"));
        let rational =
            "width: 2\nheight: 2\nK: [1, 0, 1, 0, 1, 1, 0, 0, 1]\nD: [0.1, 0, 0, 0, 0, 0.3, 0, 0]\n";
        assert!(refused(rational).contains("without the rational model"));
        let (line, problem) = read("image_width: 2448\nimage_height: [1\n").unwrap_err();
        assert!(problem.to_string().contains("not readable as the YAML of a camera"), "{line:?} {problem}");
        assert!(!is_yaml("kind = \"profiler\"\n") && !is_yaml("[camera]\nwidth = 2\n") && !is_yaml(""));
    }
}
