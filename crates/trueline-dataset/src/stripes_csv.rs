//! `stripes.csv`: the laser's stripe on each of two plates, picture by picture, as two support points of it.
//!
//! | sensor | columns |
//! |---|---|
//! | camera | `time_s`, `plate`, `u1_px`, `v1_px`, `u2_px`, `v2_px`, `sigma_px`; optional `frame` |
//! | profiler, points | `time_s`, `plate`, `x1_mm`, `z1_mm`, `x2_mm`, `z2_mm`, `sigma_mm`; optional `frame` |
//!
//! For a sensor that reports points, x and z are those of the camera frame; y follows from its laser plane.

use crate::error::{Error, Problem};
use crate::recording::{Measured, PlateStripe, Sensor};
use crate::stamp;
use crate::stop_poses::{Pairing, RowKey};
use crate::table::{ColumnSpec, Header, Table, optional, required};
use crate::unit::{MM_PER_M, Quantity};
use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;
use trueline_geometry::Plane;

const TIME: usize = 0;
const FRAME: usize = 1;
const PLATE: usize = 2;
/// First column of the coordinates; their standard deviation follows them.
const FIRST: usize = 3;
const SIGMA: usize = 7;

const SHARED: [ColumnSpec<'static>; 2] =
    [optional("frame", Quantity::Count), required("plate", Quantity::Count)];

const PIXELS: [ColumnSpec<'static>; 5] = [
    required("u1", Quantity::Pixel),
    required("v1", Quantity::Pixel),
    required("u2", Quantity::Pixel),
    required("v2", Quantity::Pixel),
    required("sigma", Quantity::Pixel),
];

const LENGTHS: [ColumnSpec<'static>; 5] = [
    required("x1", Quantity::Length),
    required("z1", Quantity::Length),
    required("x2", Quantity::Length),
    required("z2", Quantity::Length),
    required("sigma", Quantity::Length),
];

/// A laser plane that is steeper than this against the y axis (cosine) does not say y of x and z.
const LEAST_Y: f64 = 0.05;

/// Reads the stripes of a sensor that looks at one line.
///
/// # Errors
/// Anything that is not a clean table of these columns with rising stamps, plates 0 and 1, positive sigmas and two points
/// that are not the same.
pub fn read(file: &Path, bytes: &[u8], sensor: &Sensor) -> Result<Vec<PlateStripe>, Error> {
    read_of_lines(file, bytes, sensor, 1, Pairing::default())
}

/// The same for several lines: plates 2k and 2k + 1 are those of line k. Rows may name a stop, or the count of an encoder.
///
/// # Errors
/// As [`read`].
pub(crate) fn read_of_lines(
    file: &Path,
    bytes: &[u8],
    sensor: &Sensor,
    lines: u32,
    pairing: Pairing<'_>,
) -> Result<Vec<PlateStripe>, Error> {
    let last_plate = 2 * lines.max(1) - 1;
    let own = if matches!(sensor, Sensor::CameraLaser { .. }) { PIXELS } else { LENGTHS };
    let header = Header::read(file, bytes)?;
    let key = RowKey::of(&header, pairing)?;
    let columns: Vec<ColumnSpec<'static>> = [key.spec()].into_iter().chain(SHARED).chain(own).collect();
    let mut table = header.find(&columns)?;
    let mut stripes: Vec<PlateStripe> = Vec::new();
    let mut plates = BTreeSet::new();
    while table.next_row()? {
        let last_ns = stripes.last().map(|last| last.stamp_ns);
        let stamp_ns = key.stamp_ns(&table, TIME, last_ns)?;
        if key.rises() && last_ns != Some(stamp_ns) {
            plates.clear();
        }
        let stripe = PlateStripe { stamp_ns, ..read_row(&table, file, sensor, last_plate)? };
        if !plates.insert((stamp_ns, stripe.plate)) {
            return Err(table.error_in(PLATE, Problem::PlateTwice { plate: stripe.plate }));
        }
        stripes.push(stripe);
    }
    stripes.sort_by_key(|stripe| stripe.stamp_ns);
    if stripes.is_empty() {
        return Err(Error::in_file(file, Problem::NoRows));
    }
    Ok(stripes)
}

fn read_row(table: &Table<'_>, file: &Path, sensor: &Sensor, last_plate: u32) -> Result<PlateStripe, Error> {
    let at = |k: usize| table.required_number(FIRST + k);
    let number = table.count(PLATE)?.unwrap_or_default();
    let plate = u32::try_from(number).ok().filter(|plate| *plate <= last_plate).ok_or_else(|| {
        table.error_in(PLATE, Problem::NotAPlate { plate: number, last: u64::from(last_plate) })
    })?;
    let ends = [[at(0)?, at(1)?], [at(2)?, at(3)?]];
    if ends[0] == ends[1] {
        return Err(table.error_in(FIRST, Problem::StripeWithoutLength));
    }
    let sigma = table.sigma(SIGMA)?.unwrap_or(f64::NAN);
    let length = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
    // NaN passes no comparison.
    if !(sigma < length && length.is_finite()) {
        return Err(table.error_in(SIGMA, without_direction(sigma, length, sensor)));
    }
    let points = match sensor {
        Sensor::CameraLaser { .. } => ends.map(Measured::Pixel),
        Sensor::Profiler => ends.map(Measured::Profile),
        Sensor::Points { laser_plane_in_camera } => {
            let plane = laser_plane_in_camera.filter(|plane| plane.normal().y.abs() > LEAST_Y);
            let plane = plane.ok_or_else(|| Error::in_file(file, Problem::StripesWithoutLaserPlane))?;
            ends.map(|end| on_plane(&plane, end))
        }
    };
    Ok(PlateStripe { stamp_ns: 0, frame: table.count(FRAME)?, plate, points, sigma })
}

fn without_direction(sigma: f64, length: f64, sensor: &Sensor) -> Problem {
    let in_table = if matches!(sensor, Sensor::CameraLaser { .. }) { 1.0 } else { MM_PER_M };
    Problem::StripeWithoutDirection { sigma: sigma * in_table, length: length * in_table }
}

fn on_plane(plane: &Plane, [x, z]: [f64; 2]) -> Measured {
    let normal = plane.normal();
    Measured::Point([x, (plane.offset() - normal.x * x - normal.z * z) / normal.y, z])
}

/// Writes stripes; the columns follow from the first one.
///
/// # Errors
/// Error of the writer.
pub fn write(mut out: impl Write, stripes: &[PlateStripe]) -> std::io::Result<()> {
    let are_pixels = stripes.iter().all(|stripe| matches!(stripe.points[0], Measured::Pixel(_)));
    let frames = stripes.iter().all(|stripe| stripe.frame.is_some());
    let (names, scale) = if are_pixels {
        ("u1_px,v1_px,u2_px,v2_px,sigma_px", 1.0)
    } else {
        ("x1_mm,z1_mm,x2_mm,z2_mm,sigma_mm", MM_PER_M)
    };
    writeln!(out, "time_s,{}plate,{names}", if frames { "frame," } else { "" })?;
    for PlateStripe { stamp_ns, frame, plate, points, sigma } in stripes {
        let frame = frame.filter(|_| frames).map_or(String::new(), |frame| format!("{frame},"));
        write!(out, "{},{frame}{plate}", stamp::format_seconds(*stamp_ns))?;
        for point in points {
            let (Measured::Pixel([a, b]) | Measured::Profile([a, b]) | Measured::Point([a, _, b])) = *point;
            write!(out, ",{},{}", a * scale, b * scale)?;
        }
        writeln!(out, ",{}", sigma * scale)?;
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::{read, read_of_lines, write};
    use crate::recording::{Measured, PlateStripe, Sensor};
    use crate::stripes_csv::Pairing;
    use std::path::Path;
    use trueline_geometry::Plane;

    const HEADER: &str = "time_s,frame,plate,x1_mm,z1_mm,x2_mm,z2_mm,sigma_mm";

    fn refusal(rows: &str) -> String {
        let text = format!("{HEADER}\n{rows}");
        read(Path::new("stripes.csv"), text.as_bytes(), &Sensor::Profiler).unwrap_err().to_string()
    }

    fn camera() -> Sensor {
        let text = "kind = \"camera_laser\"\n[camera]\nwidth = 640\nheight = 480\nfx = 800\nfy = 800\ncx = 320\ncy = 240\n\
                    distortion = [0, 0, 0, 0, 0]\n[laser_plane]\nnormal = [0, 0.6, 0.8]\noffset_mm = 100\n";
        crate::sensor_toml::parse(Path::new("sensor.toml"), text).unwrap()
    }

    #[test]
    fn what_is_written_is_read_again() {
        let plane = Plane::from_height(0.1, 2.0, 0.13).unwrap();
        let point = |x: f64, z: f64| Measured::Point([x, (z - 0.13 - 0.1 * x) / 2.0, z]);
        let kinds = [
            (camera(), [Measured::Pixel([1.25, 2.5]), Measured::Pixel([300.1, 40.7])]),
            (Sensor::Profiler, [Measured::Profile([0.001, 0.12]), Measured::Profile([0.015, 0.13])]),
            (Sensor::Points { laser_plane_in_camera: Some(plane) }, [point(0.001, 0.12), point(0.015, 0.13)]),
        ];
        for (sensor, points) in kinds {
            for frame in [Some(7), None] {
                let stripe = |plate: u32| PlateStripe {
                    stamp_ns: 1_700_000_000_123_456_789,
                    frame,
                    plate,
                    points,
                    sigma: 0.003125,
                };
                let mut text = Vec::new();
                write(&mut text, &[stripe(0), stripe(1)]).unwrap();
                let back = read(Path::new("stripes.csv"), text.as_slice(), &sensor).unwrap();
                for (back, plate) in back.iter().zip(0..) {
                    let expected = stripe(plate);
                    assert_eq!((back.stamp_ns, back.frame, back.plate), (expected.stamp_ns, frame, plate));
                    let numbers = |stripe: &PlateStripe| -> Vec<f64> {
                        let of = |point: &Measured| match *point {
                            Measured::Pixel(p) | Measured::Profile(p) => p.to_vec(),
                            Measured::Point(p) => p.to_vec(),
                        };
                        stripe.points.iter().flat_map(of).chain([stripe.sigma]).collect()
                    };
                    // Through millimetres and back: rounding, of y after a division by 0.9.
                    for (a, b) in numbers(back).iter().zip(numbers(&expected)) {
                        assert!((a - b).abs() <= 1e-15 * b.abs().max(1.0), "{a} {b}");
                    }
                }
            }
        }
    }

    #[test]
    fn plates_of_several_lines_are_those_lines_and_no_others() {
        let text = format!("{HEADER}\n0,0,2,1,1,2,2,0.1\n0,0,3,1,1,2,2,0.1\n");
        let of = |text: &str, lines| {
            read_of_lines(
                Path::new("stripes.csv"),
                text.as_bytes(),
                &Sensor::Profiler,
                lines,
                Pairing::default(),
            )
        };
        assert_eq!(of(&text, 2).unwrap().iter().map(|stripe| stripe.plate).collect::<Vec<_>>(), [2, 3]);
        let refused = of(&text.replace("0,0,3", "0,0,4"), 2).unwrap_err().to_string();
        assert!(refused.contains("line 3, column `plate`: expected plate 0 to 3, found 4"), "{refused}");
    }

    #[test]
    fn what_is_no_stripe_is_refused_with_its_place() {
        assert!(refusal("").contains("no data rows"));
        assert!(
            refusal("0,0,2,1,1,2,2,0.1\n").contains("line 2, column `plate`: expected plate 0 or 1, found 2")
        );
        assert!(refusal("0,0,0,1,1,2,2,0\n").contains("expected a standard deviation above zero"));
        assert!(refusal("1,0,0,1,1,2,2,1\n0,1,0,1,1,2,2,1\n").contains("time runs backwards"));
        assert!(
            refusal("0,0,0,1,1,2,2,1\n0,0,0,1,1,2,2,1\n").contains("line 3, column `plate`: plate 0 twice")
        );
        assert!(refusal("0,0,0,1,1,1,1,1\n").contains("line 2, column `x1_mm`: the two points are the same"));
        let wide = refusal("0,0,0,1,1,2,2,1.5\n");
        assert!(wide.contains("line 2, column `sigma_mm`: the standard deviation 1.5"), "{wide}");
        let huge = refusal("0,0,0,1,1e300,2,2,0.1\n");
        assert!(huge.contains("line 2, column `z1_mm`: expected a measured number, found `1e300`"), "{huge}");
        let text = format!("{HEADER}\n0,0,0,1,1,2,2,1\n");
        let without = Sensor::Points { laser_plane_in_camera: None };
        let error = read(Path::new("stripes.csv"), text.as_bytes(), &without).unwrap_err();
        assert!(error.to_string().contains("laser plane"), "{error}");
        let error = read(Path::new("stripes.csv"), text.as_bytes(), &camera()).unwrap_err();
        assert!(error.to_string().contains("u1"), "{error}");
    }
}
