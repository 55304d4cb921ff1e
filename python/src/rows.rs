//! Rows of numpy arrays as the parts of a recording. The first row that cannot be used is named.

use crate::failure::Failure;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use numpy::ndarray::{ArrayView1, ArrayView2, ArrayView3, Axis};
use trueline::{Feature, Measured, Pose, RobotSample, Sensor};
use trueline_dataset::{LAST_LINE, MOST_CORRELATION, PlateStripe, stamp};
use trueline_geometry::se3;

/// A rotation matrix may be this far from orthonormal: four printed digits are.
const ORTHONORMAL_TOLERANCE: f64 = 1e-3;

/// No laser sensor on a tool sees, or is mounted, farther away, m: more are millimetres.
pub(crate) const FARTHEST_SEEN_M: f64 = 10.0;

/// No robot reaches farther, also on a gantry, m.
pub(crate) const FARTHEST_REACHED_M: f64 = 100.0;

/// Data of a feature besides its stamp and its point.
#[derive(Clone, Copy)]
pub(crate) struct Extras<'a> {
    /// Which line each lies on.
    pub line: Option<ArrayView1<'a, i64>>,
    /// Frame counters.
    pub frame: Option<ArrayView1<'a, i64>>,
    /// Standard deviations in the points' unit.
    pub sigma: Option<ArrayView2<'a, f64>>,
    /// Correlation of the errors with these standard deviations.
    pub correlation: Option<ArrayView1<'a, f64>>,
}

/// Robot poses; positions in m.
///
/// # Errors
/// Arrays of different length, time running backwards, or invalid poses.
pub(crate) fn poses(
    stamps_ns: ArrayView1<'_, i64>,
    base_from_tool: ArrayView3<'_, f64>,
) -> Result<Vec<RobotSample>, Failure> {
    rows_of("base_from_tool", base_from_tool.shape(), &[stamps_ns.len(), 4, 4])?;
    rising("robot_times", stamps_ns)?;
    let numbered = stamps_ns.iter().zip(base_from_tool.outer_iter()).enumerate();
    numbered
        .map(|(row, (&stamp_ns, matrix))| {
            let base_from_tool = pose(matrix, FARTHEST_REACHED_M).map_err(|wrong| {
                Failure::new(
                    format!("base_from_tool[{row}]: {wrong}"),
                    "poses are 4×4, tool to base, positions in metres; scipy's Rotation.as_matrix() gives the 3×3 part",
                )
            })?;
            Ok(RobotSample { stamp_ns, device_ns: None, base_from_tool })
        })
        .collect()
}

/// A pose from a 4×4 matrix, m, no farther away than that.
///
/// # Errors
/// The fault.
pub(crate) fn pose(m: ArrayView2<'_, f64>, farthest_m: f64) -> Result<Pose, String> {
    if let Some(bad) = m.iter().find(|x| !x.is_finite()) {
        return Err(format!("{bad} is not a number to calculate with"));
    }
    if m.row(3).iter().ne([0.0, 0.0, 0.0, 1.0].iter()) {
        return Err(format!("the last row must be 0 0 0 1, found {}", m.row(3)));
    }
    let matrix = Matrix3::from_fn(|row, column| m[[row, column]]);
    let off = (matrix.transpose() * matrix - Matrix3::identity()).abs().max();
    if off > ORTHONORMAL_TOLERANCE {
        return Err(format!("its 3×3 part is not a rotation: columns are {off:.2e} from orthonormal"));
    }
    if matrix.determinant() < 0.0 {
        return Err("its 3×3 part mirrors: its determinant is −1".into());
    }
    if let Some(far) = (0..3).map(|axis| m[[axis, 3]]).find(|x| x.abs() > farthest_m) {
        return Err(format!("a position of {far} is in millimetres, or wrong; metres are expected"));
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    Ok(se3::from_parts(rotation, Vector3::new(m[[0, 3]], m[[1, 3]], m[[2, 3]])))
}

/// Seam features.
///
/// # Errors
/// Arrays of different length, time running backwards, or points that are not of this sensor.
pub(crate) fn features(
    sensor: &Sensor,
    stamps_ns: ArrayView1<'_, i64>,
    points: ArrayView2<'_, f64>,
    extras: Extras<'_>,
) -> Result<Vec<Feature>, Failure> {
    let count = stamps_ns.len();
    rows_of("points", points.shape(), &[count, coordinates(sensor)])?;
    rising("feature_times", stamps_ns)?;
    for (name, numbers) in [("line", extras.line), ("frame", extras.frame)] {
        numbers.map_or(Ok(()), |numbers| rows_of(name, numbers.shape(), &[count]))?;
    }
    extras.sigma.map_or(Ok(()), |sigma| rows_of("feature_sigma", sigma.shape(), &[count, 2]))?;
    if let Some(correlation) = extras.correlation {
        rows_of("feature_correlation", correlation.shape(), &[count])?;
        if extras.sigma.is_none() {
            return Err(Failure::new(
                "feature_correlation: needs feature_sigma, the standard deviations of these errors",
                "give feature_sigma as well",
            ));
        }
    }
    (0..count)
        .map(|row| {
            Ok(Feature {
                stamp_ns: stamps_ns[row],
                line: extras.line.map_or(Ok(0), |line| line_of(line, row))?,
                frame: extras.frame.map(|frame| counted("frame", frame, row)).transpose()?,
                device_ns: None,
                measured: measured(sensor, points.row(row)).map_err(|wrong| wrong.at("points", row))?,
                sigma: extras.sigma.map(|sigma| sigma_of(sigma, row)).transpose()?,
                correlation: extras
                    .correlation
                    .map_or(Ok(0.0), |correlation| correlation_in(correlation, row))?,
            })
        })
        .collect()
}

/// Stripes on plates, each known by two of its points.
///
/// # Errors
/// As [`features`].
pub(crate) fn stripes(
    sensor: &Sensor,
    (stamps_ns, plate): (ArrayView1<'_, i64>, ArrayView1<'_, i64>),
    points: ArrayView3<'_, f64>,
    sigma: ArrayView1<'_, f64>,
) -> Result<Vec<PlateStripe>, Failure> {
    let count = stamps_ns.len();
    rows_of("stripes.points", points.shape(), &[count, 2, coordinates(sensor)])?;
    rows_of("stripes.plate", plate.shape(), &[count])?;
    rows_of("stripes.sigma", sigma.shape(), &[count])?;
    rising("stripes.times", stamps_ns)?;
    (0..count)
        .map(|row| {
            let point = |end: usize| {
                let point = points.index_axis(Axis(0), row).index_axis_move(Axis(0), end);
                measured(sensor, point).map_err(|wrong| wrong.at("stripes.points", row))
            };
            Ok(PlateStripe {
                stamp_ns: stamps_ns[row],
                frame: None,
                plate: plate_of(plate, row)?,
                points: [point(0)?, point(1)?],
                sigma: deviation("stripes.sigma", row, sigma[row])?,
            })
        })
        .collect()
}

fn coordinates(sensor: &Sensor) -> usize {
    if matches!(sensor, Sensor::Points { .. }) { 3 } else { 2 }
}

/// A number that counts from 0.
fn counted<T: TryFrom<i64>>(name: &str, numbers: ArrayView1<'_, i64>, row: usize) -> Result<T, Failure> {
    T::try_from(numbers[row]).map_err(|_| {
        Failure::new(
            format!("{name}[{row}] cannot be {}", numbers[row]),
            "lines, plates and frames count from 0",
        )
    })
}

/// The line that a seam point lies on.
fn line_of(lines: ArrayView1<'_, i64>, row: usize) -> Result<u32, Failure> {
    let line: u32 = counted("line", lines, row)?;
    if line <= LAST_LINE {
        return Ok(line);
    }
    Err(Failure::new(format!("line[{row}] is {line}"), format!("lines are numbered from 0 to {LAST_LINE}")))
}

/// The plate that a stripe lies on: two for each line.
fn plate_of(plates: ArrayView1<'_, i64>, row: usize) -> Result<u32, Failure> {
    let plate: u32 = counted("stripes.plate", plates, row)?;
    let last = 2 * LAST_LINE + 1;
    if plate <= last {
        return Ok(plate);
    }
    Err(Failure::new(
        format!("stripes.plate[{row}] is {plate}"),
        format!("plates are numbered from 0 to {last}"),
    ))
}

/// Fault of a number.
enum WrongNumber {
    NotFinite,
    NotMetres(f64),
}

impl WrongNumber {
    fn at(&self, name: &str, row: usize) -> Failure {
        match self {
            Self::NotFinite => Failure::new(
                format!("{name}[{row}] has a number that is not finite"),
                "leave out the frames in which nothing was found",
            ),
            Self::NotMetres(far) => not_metres(&format!("{name}[{row}]"), *far),
        }
    }
}

/// A length that no laser sensor measures.
pub(crate) fn not_metres(place: &str, far: f64) -> Failure {
    Failure::new(
        format!("{place}: {far} is farther away than a laser sensor sees, in metres"),
        "lengths are in metres: divide millimetres by 1000; pixels need a camera",
    )
}

fn measured(sensor: &Sensor, point: ArrayView1<'_, f64>) -> Result<Measured, WrongNumber> {
    if point.iter().any(|x| !x.is_finite()) {
        return Err(WrongNumber::NotFinite);
    }
    let far = point.iter().find(|x| x.abs() > FARTHEST_SEEN_M);
    match (sensor, far) {
        (Sensor::CameraLaser { .. }, _) => Ok(Measured::Pixel([point[0], point[1]])),
        (_, Some(far)) => Err(WrongNumber::NotMetres(*far)),
        (Sensor::Profiler, None) => Ok(Measured::Profile([point[0], point[1]])),
        (Sensor::Points { .. }, None) => Ok(Measured::Point([point[0], point[1], point[2]])),
    }
}

fn sigma_of(sigma: ArrayView2<'_, f64>, row: usize) -> Result<[f64; 2], Failure> {
    Ok([deviation("feature_sigma", row, sigma[[row, 0]])?, deviation("feature_sigma", row, sigma[[row, 1]])?])
}

/// The correlation of a row's two errors.
fn correlation_in(correlation: ArrayView1<'_, f64>, row: usize) -> Result<f64, Failure> {
    let value = correlation[row];
    if value.abs() <= MOST_CORRELATION {
        return Ok(value);
    }
    Err(Failure::new(
        format!("feature_correlation[{row}] is {value}"),
        format!("correlations are numbers of at most ±{MOST_CORRELATION}"),
    ))
}

fn deviation(name: &str, row: usize, sigma: f64) -> Result<f64, Failure> {
    if sigma > 0.0 && sigma.is_finite() {
        return Ok(sigma);
    }
    Err(Failure::new(format!("{name}[{row}] is {sigma}"), "standard deviations are numbers above zero"))
}

fn rising(name: &str, stamps_ns: ArrayView1<'_, i64>) -> Result<(), Failure> {
    if let Some((row, far)) = stamps_ns.iter().enumerate().find(|(_, ns)| !stamp::is_in_range(**ns)) {
        return Err(Failure::new(
            format!("{name}[{row}] is {} s, further from zero than any clock", stamp::seconds(*far)),
            "times are within 95 years of the clock's zero: are they in another unit?",
        ));
    }
    let mut pairs = stamps_ns.iter().zip(stamps_ns.iter().skip(1)).enumerate();
    match pairs.find(|(_, (before, after))| after < before) {
        None => Ok(()),
        Some((row, (before, after))) => Err(Failure::new(
            format!(
                "{name}: time runs backwards at row {}: {} s after {} s",
                row + 1,
                *after as f64 * 1e-9,
                *before as f64 * 1e-9
            ),
            "sort by time; stamps of two clocks do not belong into one array",
        )),
    }
}

fn rows_of(name: &str, found: &[usize], expected: &[usize]) -> Result<(), Failure> {
    if found == expected {
        return Ok(());
    }
    Err(Failure::new(
        format!("{name}: expected an array of shape {expected:?}, found {found:?}"),
        "one row for each stamp; pixels and profiles have two columns, points three",
    ))
}
