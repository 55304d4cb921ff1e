//! Seam points in base, as files.

use crate::export::number::{fixed, m};
use std::fmt::Write;
use trueline_dataset::Feature;
use trueline_dataset::stamp::{exposed_ns, format_seconds};
use trueline_dataset::unit::MM_PER_M;

/// A seam point where the robot can go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedPoint {
    /// When it was exposed, by the robot's clock, ns: its stamp minus the time offset.
    pub exposed_ns: i64,
    /// The image.
    pub frame: u64,
    /// The line.
    pub line: u32,
    /// Its place in base, m.
    pub in_base_m: [f64; 3],
}

/// Seam points with their exposure and image: each is the row of its feature, its line, and its place in base, m. Images
/// without a counter are numbered by their stamps.
#[must_use]
pub fn placed(
    features: &[Feature],
    in_base: impl Iterator<Item = (usize, u32, [f64; 3])>,
    time_offset_s: f64,
) -> Vec<PlacedPoint> {
    let mut image = 0;
    let later = features.windows(2).map(|two| {
        image += u64::from(two[1].stamp_ns != two[0].stamp_ns);
        image
    });
    let numbers: Vec<u64> = std::iter::once(0).chain(later).collect();
    let point = |(row, line, in_base_m): (usize, u32, [f64; 3])| PlacedPoint {
        exposed_ns: exposed_ns(features[row].stamp_ns, time_offset_s),
        frame: features[row].frame.unwrap_or(numbers[row]),
        line,
        in_base_m,
    };
    in_base.map(point).collect()
}

/// `time_s,frame,line,x_mm,y_mm,z_mm`.
#[must_use]
pub fn csv(points: &[PlacedPoint]) -> String {
    let mut out = "time_s,frame,line,x_mm,y_mm,z_mm\n".to_owned();
    for point in points {
        let [x, y, z] = point.in_base_m.map(|value| fixed(value * MM_PER_M, 6));
        // Writing to a string cannot fail.
        let _ =
            writeln!(out, "{},{},{},{x},{y},{z}", format_seconds(point.exposed_ns), point.frame, point.line);
    }
    out
}

/// Ascii PLY, metres; time, frame and line are properties of each vertex.
#[must_use]
pub fn ply(points: &[PlacedPoint]) -> String {
    let mut out = format!(
        "ply\nformat ascii 1.0\ncomment seam points in base, metres; time in s at the exposure\nelement vertex {}\n\
         property double x\nproperty double y\nproperty double z\nproperty double time\nproperty uint frame\nproperty uint line\n\
         end_header\n",
        points.len()
    );
    for point in points {
        let [x, y, z] = point.in_base_m.map(m);
        let _ =
            writeln!(out, "{x} {y} {z} {} {} {}", format_seconds(point.exposed_ns), point.frame, point.line);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_written_in_the_units_of_their_names() {
        let points = [PlacedPoint {
            exposed_ns: 1_500_000_000,
            frame: 7,
            line: 1,
            in_base_m: [0.5, -1e-3, 1.234_567_891],
        }];
        assert_eq!(
            csv(&points),
            "time_s,frame,line,x_mm,y_mm,z_mm\n1.500000000,7,1,500.000000,-1.000000,1234.567891\n"
        );
        assert!(ply(&points).ends_with("end_header\n0.500000000 -0.001000000 1.234567891 1.500000000 7 1\n"));
    }
}
