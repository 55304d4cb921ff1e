//! The robot's motion: speed, turning and tilt over time, the information of each second on the time offset, and whether the tilt suffices.

use super::Shown;
use crate::page::{Axis, Block, Chart, Colour, Columns, Drawn, Mark, Series, Table, TableRow};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use trueline_dataset::RobotSample;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::so3;
use trueline_method::assess::residuals::FeatureResidual;
use trueline_method::order_statistics::median;

/// Over how long a speed is taken, s: shorter is noise, longer hides turns.
const WINDOW_S: f64 = 0.1;
/// Between two joined recordings the motion is unknown, s.
const GAP_S: f64 = 1.0;
/// Places at which the motion is drawn.
const PLACES: usize = 1500;
/// Tilt about an axis that is plenty, and that is little, from end to end: ± 10° and ± 3°.
const ENOUGH_DEG: f64 = 20.0;
const LITTLE_DEG: f64 = 6.0;

/// The motion at one time.
struct Moment {
    time_s: f64,
    speed_m_s: f64,
    turning_rad_s: f64,
    /// Turn from the mean attitude, about the tool's axes, rad.
    tilt_rad: Vector3<f64>,
}

impl Moment {
    /// A gap in every line.
    fn unknown(time_s: f64) -> Self {
        let none = f64::NAN;
        Self { time_s, speed_m_s: none, turning_rad_s: none, tilt_rad: Vector3::repeat(none) }
    }
}

pub(super) fn blocks(shown: &Shown<'_>, columns: &mut Columns) -> Vec<Block> {
    let moments = moments(&shown.source.recording.robot);
    if moments.is_empty() {
        return vec![Block::Text("The robot's recording is too short to show a motion.".to_owned())];
    }
    let mut blocks = vec![Block::Table(coverage(&moments))];
    blocks.extend([speeds(&moments, columns), tilts(&moments, columns)].map(Block::Chart));
    blocks.extend(information(shown, columns).map(Block::Chart));
    blocks.extend(over_tilt(shown, &moments, columns).map(Block::Chart));
    blocks
}

fn moments(robot: &[RobotSample]) -> Vec<Moment> {
    let Some(first) = robot.first() else { return Vec::new() };
    let time_s = |sample: &RobotSample| (sample.stamp_ns - first.stamp_ns) as f64 * 1e-9;
    let mean = mean_attitude(robot);
    let step = robot.len().div_ceil(PLACES).max(1);
    let mut moments = Vec::new();
    for start in (0..robot.len()).step_by(step) {
        let begin = &robot[start];
        let end = robot[start..].iter().find(|sample| time_s(sample) - time_s(begin) >= WINDOW_S);
        let Some(end) = end else { break };
        let passed_s = time_s(end) - time_s(begin);
        if passed_s > GAP_S {
            moments.push(Moment::unknown(time_s(begin)));
            continue;
        }
        let way = end.base_from_tool.translation.vector - begin.base_from_tool.translation.vector;
        moments.push(Moment {
            time_s: time_s(begin),
            speed_m_s: way.norm() / passed_s,
            turning_rad_s: begin.base_from_tool.rotation.angle_to(&end.base_from_tool.rotation) / passed_s,
            tilt_rad: so3::log(&(mean.inverse() * begin.base_from_tool.rotation)),
        });
    }
    moments
}

/// The mean of attitudes: of their quaternions, all on the side of the first.
fn mean_attitude(robot: &[RobotSample]) -> UnitQuaternion<f64> {
    let first = robot.first().map_or_else(UnitQuaternion::identity, |sample| sample.base_from_tool.rotation);
    let sum = robot.iter().fold(Quaternion::from_parts(0.0, Vector3::zeros()), |sum, sample| {
        let q = sample.base_from_tool.rotation.into_inner();
        if q.dot(&first) < 0.0 { sum - q } else { sum + q }
    });
    UnitQuaternion::new_normalize(sum)
}

/// Lights for those who read no matrices.
fn coverage(moments: &[Moment]) -> Table {
    let range = |of: &dyn Fn(&Moment) -> f64| {
        let values = || moments.iter().map(of);
        (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max))
    };
    let mut rows: Vec<TableRow> = ["x", "y", "z"]
        .iter()
        .enumerate()
        .map(|(k, axis)| {
            let (low, high) = range(&|moment| moment.tilt_rad[k].to_degrees());
            let light = match high - low {
                span if span >= ENOUGH_DEG => "● enough",
                span if span >= LITTLE_DEG => "◐ little",
                _ => "○ hardly any",
            };
            // No minus before a zero.
            let [low, high] = [low, high].map(|deg| (10.0 * deg).round() / 10.0 + 0.0);
            let reached = format!("{low:.1}° … {high:.1}°");
            TableRow::plain(vec![format!("turn about the tool's {axis}"), reached, light.to_owned()])
        })
        .collect();
    let (slowest, fastest) = range(&|moment| moment.speed_m_s * MM_PER_M);
    rows.push(TableRow::plain(vec![
        "speed of the tool".to_owned(),
        format!("{slowest:.0} … {fastest:.0} mm/s"),
        if fastest > 2.0 * slowest { "● varies" } else { "○ hardly varies" }.to_owned(),
    ]));
    Table {
        head: ["Coverage", "reached", "±10° about two axes is sufficient"].map(str::to_owned).to_vec(),
        rows,
    }
}

fn speeds(moments: &[Moment], columns: &mut Columns) -> Chart {
    let time = columns.add(moments.iter().map(|m| m.time_s));
    let speed = columns.add(moments.iter().map(|m| m.speed_m_s * MM_PER_M));
    let turning = columns.add(moments.iter().map(|m| m.turning_rad_s.to_degrees()));
    Chart {
        id: "speed",
        title: "Speed and turning of the tool",
        explanation: "The time offset is determined where the tool is fast, or turns.".to_owned(),
        alternative: "Speed of the tool in mm/s and its turning in degrees a second over time".to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("time since the first robot row (s)"),
            y: Axis::of("mm/s, °/s"),
            series: vec![
                Series::line("speed (mm/s)", time, speed, Colour::A),
                Series::line("turning (°/s)", time, turning, Colour::B),
            ],
            marks: Vec::new(),
        },
    }
}

fn tilts(moments: &[Moment], columns: &mut Columns) -> Chart {
    let time = columns.add(moments.iter().map(|m| m.time_s));
    let series = (0..3)
        .map(|k| {
            let tilt = columns.add(moments.iter().map(|m| m.tilt_rad[k].to_degrees()));
            Series::line(["about tool x", "about tool y", "about tool z"][k], time, tilt, Colour::of(k))
        })
        .collect();
    Chart {
        id: "tilt",
        title: "Attitude of the tool",
        explanation: "Rotation from the mean attitude. Tilts of ±10° about two axes determine the hand-eye \
            transform."
            .to_owned(),
        alternative: "Turn of the tool about its x, y and z from its mean attitude in degrees over time"
            .to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("time since the first robot row (s)"),
            y: Axis::of("turn (°)"),
            series,
            marks: Vec::new(),
        },
    }
}

/// Information of each second on the time offset: the squared distance that the seam moves in the laser plane during one
/// standard deviation of a point, summed, with all else known.
fn information(shown: &Shown<'_>, columns: &mut Columns) -> Option<Chart> {
    let used: Vec<&FeatureResidual> = shown.features.iter().filter(|f| !f.is_outlier()).copied().collect();
    let sigma_m = median(used.iter().filter_map(|f| {
        let sigma = f.in_sheet_m?.norm() / f.normalised;
        sigma.is_finite().then_some(sigma)
    }))?;
    let last = used.last()?.stamp_s;
    let mut seconds = vec![0.0; last.max(0.0) as usize + 1];
    for f in used {
        if let (Some(velocity), Some(second)) = (f.crossing_m_s, seconds.get_mut(f.stamp_s.max(0.0) as usize))
        {
            *second += velocity.norm_squared() / sigma_m.powi(2);
        }
    }
    let all: f64 = seconds.iter().sum();
    if all <= 0.0 {
        return None;
    }
    let x = columns.add((0..seconds.len()).map(|k| k as f64 + 0.5));
    let y = columns.add(seconds.iter().map(|second| 100.0 * second / all));
    Some(Chart {
        id: "information",
        title: "Information on the time offset by second",
        explanation: "Share of the information on the time offset. Seconds near zero add nothing.".to_owned(),
        alternative: "Share of the information on the time offset in each second of the scan, in per cent"
            .to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("time since the first robot row (s)"),
            y: Axis::of("part (%)"),
            series: vec![Series::steps("of each second", x, y, Colour::C)],
            marks: Vec::new(),
        },
    })
}

/// Residuals against the attitude: a slope or a bow is the robot's kinematics, or the sensor's own calibration.
fn over_tilt(shown: &Shown<'_>, moments: &[Moment], columns: &mut Columns) -> Option<Chart> {
    let tilt_deg = |time_s: f64| {
        let k = moments.partition_point(|moment| moment.time_s < time_s);
        moments.get(k.min(moments.len() - 1)).map(|moment| moment.tilt_rad.norm().to_degrees())
    };
    let inliers = || shown.features.iter().filter(|f| !f.is_outlier());
    let tilts: Vec<f64> = inliers().filter_map(|f| tilt_deg(f.stamp_s)).collect();
    if tilts.is_empty() {
        return None;
    }
    let x = columns.add(tilts);
    let y = columns.add(inliers().map(|f| f.normalised));
    Some(Chart {
        id: "residual-tilt",
        title: "Residual over tilt",
        explanation: "Length of the residual over the rotation from the mean attitude. It should be level; \
            growth with the tilt means an error of the sensor's calibration or of the robot's kinematics."
            .to_owned(),
        alternative: "Length of the residual in standard deviations over the tilt of the tool in degrees"
            .to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("rotation from the mean attitude (°)"),
            y: Axis::of("residual (σ)"),
            series: vec![Series::points("features", x, y, Colour::A)],
            marks: vec![Mark { name: "expected median".to_owned(), at: 1.177, upright: false }],
        },
    })
}
