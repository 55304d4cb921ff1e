//! Profiles as drivers of profilers publish them in ROS: a point cloud of one row, or a laser scan.

use crate::message::content_error::ContentError;
use crate::message::ros_cursor::RosCursor;

type Read<T> = Result<T, ContentError>;

/// Points further than this from the plane y = 0 are of no profile, m.
const OFF_PLANE_M: f64 = 1e-6;

/// Points of a profile, x and z in m, and how many columns have none.
#[derive(Debug, Default)]
pub(super) struct Points {
    /// The points.
    pub points: Vec<[f64; 2]>,
    /// Columns without a return.
    pub no_return: usize,
}

/// The points of a `PointCloud2` behind its header: a profiler's frame has y = 0. Points that are not finite are left out.
///
/// # Errors
/// A cloud without x, y and z in single or double precision, or one that is not a profile.
pub(super) fn point_cloud(cursor: &mut RosCursor<'_>) -> Read<Points> {
    let (height, width) = (cursor.u32("height")?, cursor.u32("width")?);
    let fields = fields(cursor)?;
    let big_endian = cursor.u8("is_bigendian")? != 0;
    let (point_step, row_step) = (cursor.u32("point_step")? as usize, cursor.u32("row_step")? as usize);
    let data = cursor.bytes("data")?;
    cursor.u8("is_dense")?;
    let axis = |name| {
        fields.iter().find(|field| field.name == name).ok_or(ContentError::Missing { field: "x, y or z" })
    };
    let axes = [axis("x")?, axis("y")?, axis("z")?];
    let fits = axes.iter().all(|axis| axis.fits(point_step))
        && row_step >= width as usize * point_step
        && data.len() >= row_step * height as usize;
    if !fits {
        return Err(ContentError::CutOff { field: "the points" });
    }
    let mut points = Points::default();
    for row in data.chunks_exact(row_step.max(1)).take(height as usize) {
        for point in row.chunks_exact(point_step.max(1)).take(width as usize) {
            points.add(axes.map(|axis| axis.read(point, big_endian)))?;
        }
    }
    Ok(points)
}

impl Points {
    /// Takes a point of the plane y = 0; one that is not finite is a column without a return.
    ///
    /// # Errors
    /// A point that is not in the plane.
    pub(super) fn add(&mut self, [x, y, z]: [f64; 3]) -> Read<()> {
        if ![x, y, z].iter().all(|value| value.is_finite()) {
            self.no_return += 1;
        } else if y.abs() > OFF_PLANE_M {
            return Err(ContentError::NoProfile { y_m: y });
        } else {
            self.points.push([x, z]);
        }
        Ok(())
    }
}

/// The points of a `LaserScan` behind its header, m. Its x axis looks ahead, its beams turn about z: x along the stripe is its y, and
/// the range is its x.
///
/// # Errors
/// A message that is cut off.
pub(crate) fn laser_scan(cursor: &mut RosCursor<'_>) -> Read<Points> {
    let [first_rad, _, step_rad, _, _, least_m, most_m] = {
        let mut head = [0.0; 7];
        for value in &mut head {
            *value = f64::from(cursor.any_f32("the scan's angles and limits")?);
        }
        head
    };
    let ranges = cursor.count(4, "ranges")?;
    let mut points = Vec::with_capacity(ranges);
    for k in 0..ranges {
        let range_m = f64::from(cursor.any_f32("ranges")?);
        // Outside of the limits, and for no return, the message has any number.
        if range_m >= least_m && range_m <= most_m {
            let (sin, cos) = (first_rad + k as f64 * step_rad).sin_cos();
            points.push([range_m * sin, range_m * cos]);
        }
    }
    for _ in 0..cursor.count(4, "intensities")? {
        cursor.any_f32("intensities")?;
    }
    Ok(Points { no_return: ranges - points.len(), points })
}

/// A field of a point.
pub(super) struct PointField {
    /// Its name.
    pub name: String,
    /// Its place in a point, bytes.
    pub offset: usize,
    /// Whether it has 8 bytes instead of 4.
    pub double: bool,
}

impl PointField {
    fn bytes(&self) -> usize {
        if self.double { 8 } else { 4 }
    }

    /// Whether it lies within a point of `point_step` bytes.
    pub(super) fn fits(&self, point_step: usize) -> bool {
        self.offset.saturating_add(self.bytes()) <= point_step
    }

    /// Its number in a point that it fits into.
    pub(super) fn read(&self, point: &[u8], big_endian: bool) -> f64 {
        let mut bytes = [0; 8];
        let taken = &mut bytes[..self.bytes()];
        taken.copy_from_slice(&point[self.offset..self.offset + self.bytes()]);
        if big_endian {
            taken.reverse();
        }
        let [a, b, c, d, ..] = bytes;
        if self.double { f64::from_le_bytes(bytes) } else { f64::from(f32::from_le_bytes([a, b, c, d])) }
    }
}

/// The fields that are single or double precision; the others are of no interest here.
fn fields(cursor: &mut RosCursor<'_>) -> Read<Vec<PointField>> {
    const FLOAT32: u8 = 7;
    const FLOAT64: u8 = 8;
    // Name, offset, type, count.
    let count = cursor.count(4 + 4 + 1 + 4, "fields")?;
    let mut fields = Vec::new();
    for _ in 0..count {
        let name = cursor.text("fields")?.to_owned();
        let offset = cursor.u32("fields")? as usize;
        let kind = cursor.u8("fields")?;
        cursor.u32("fields")?;
        if matches!(kind, FLOAT32 | FLOAT64) {
            fields.push(PointField { name, offset, double: kind == FLOAT64 });
        }
    }
    Ok(fields)
}
