//! The problem as plain numbers, the input of every side.

use nalgebra::{UnitQuaternion, Vector3};
use std::io::Write;
use trueline_method::input::noise_levels::Whitener;
use trueline_method::problem::line_problem::LineProblem;
use trueline_method::{Observation, Parameters};
use trueline_geometry::Segment;

/// Little-endian f64 throughout, in this order. Counts (observations, lines, segments). Sheet (x, y, n, origin). Start
/// (offset, rotation w x y z, translation, for each line anchor and three axes). Segments (start, duration, rotation w x
/// y z, position, body rate, velocity). Observations (stamp, point, whitener, line). Standard deviations (offset, turn,
/// shift).
pub fn write(
    problem: &LineProblem<'_>,
    start: &Parameters,
    sigma: &[f64],
    file: &str,
) -> std::io::Result<()> {
    let trajectory = &problem.observations.robot.trajectory;
    let mut numbers =
        vec![problem.list.len() as f64, start.lines.len() as f64, trajectory.segments().len() as f64];
    let sheet = &problem.observations.sheet;
    let (x, y) = (sheet.axes().column(0).into_owned(), sheet.axes().column(1).into_owned());
    for v in [x, y, x.cross(&y), *sheet.origin()] {
        numbers.extend(v.iter());
    }
    numbers.push(start.time_offset_s);
    numbers.extend(wxyz(&start.tool_from_camera.rotation));
    numbers.extend(start.tool_from_camera.translation.vector.iter());
    for line in &start.lines {
        numbers.extend(line.anchor().iter());
        numbers.extend(line.axes().iter());
    }
    trajectory.segments().iter().for_each(|s| numbers.extend(segment(s)));
    problem.selected().for_each(|(o, w)| numbers.extend(observation(o, w)));
    numbers.extend(sigma);
    let mut out = std::io::BufWriter::new(std::fs::File::create(file)?);
    for number in numbers {
        out.write_all(&number.to_le_bytes())?;
    }
    out.flush()
}

pub fn wxyz(q: &UnitQuaternion<f64>) -> [f64; 4] {
    [q.w, q.i, q.j, q.k]
}

fn segment(s: &Segment) -> Vec<f64> {
    let mut row = vec![s.start, s.duration];
    row.extend(wxyz(&s.base_from_tool.rotation));
    for v in [s.base_from_tool.translation.vector, s.body_rate, s.velocity] {
        row.extend(v.iter());
    }
    row
}

fn observation(o: &Observation, w: &Whitener) -> Vec<f64> {
    let point: Vector3<f64> = o.point_in_camera;
    let mut row = vec![o.stamp_s, point.x, point.y, point.z];
    row.extend(w.0.map(f64::from));
    row.push(f64::from(o.line));
    row
}
