//! Residuals over time, along the line, over the image, over speed, and as a whole.

use super::Shown;
use crate::page::{Axis, Block, Chart, Colour, Columns, Drawn, Heat, Histogram, Mark, Series};
use crate::stripes;
use nalgebra::Vector3;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Measured, Sensor};
use trueline_method::assess::residuals::FeatureResidual;
use trueline_method::curve::estimate::CurveEstimate;
use trueline_method::order_statistics::median;

pub(super) fn blocks(shown: &Shown<'_>, columns: &mut Columns) -> Vec<Block> {
    let mut blocks = Vec::new();
    if shown.stride > 1 {
        blocks.push(Block::Text(format!(
            "One feature in {} is drawn, and every outlier; all numbers include all features.",
            shown.stride
        )));
    }
    if stripes::are_the_answer(shown.calibration) {
        blocks.push(Block::Text(
            "These residuals are from the fit to the seam points alone. The result comes from the whole \
            stripes, whose residuals are shown with the plates."
                .to_owned(),
        ));
    }
    let charts = [
        Some(over_time(shown, columns)),
        Some(along_line(shown, columns)),
        over_image(shown),
        vectors(shown, columns),
        Some(histogram(shown)),
        over_speed(shown, columns),
        over_direction(shown, columns),
    ];
    blocks.extend(charts.into_iter().flatten().map(Block::Chart));
    blocks
}

fn two_sides(shown: &Shown<'_>, columns: &mut Columns, x: impl Fn(&FeatureResidual) -> f64) -> Vec<Series> {
    let at = columns.add(shown.inliers(&x));
    let across = columns.add(shown.inliers(|f| f.offset_m.x * MM_PER_M));
    let square = columns.add(shown.inliers(|f| f.offset_m.y * MM_PER_M));
    let mut series = vec![
        Series::points("across", at, across, Colour::A),
        Series::points("perpendicular to it", at, square, Colour::B),
    ];
    if shown.features.iter().any(|f| f.is_outlier()) {
        let wild = columns.add(shown.outliers(&x));
        let edge = edge_mm(shown);
        let largest = |f: &FeatureResidual| {
            let off = if f.offset_m.x.abs() > f.offset_m.y.abs() { f.offset_m.x } else { f.offset_m.y };
            (off * MM_PER_M).clamp(-edge, edge)
        };
        let off = columns.add(shown.outliers(largest));
        let mut outliers = Series::points(
            "outliers, at the edge if further (a click leads to the list)",
            wild,
            off,
            Colour::Bad,
        );
        outliers.leads_to = Some(columns.add(shown.outliers(|f| f64::from(f.row))));
        series.push(outliers);
    }
    series
}

/// End of the vertical axis: a little beyond all inliers, mm.
fn edge_mm(shown: &Shown<'_>) -> f64 {
    1.15 * shown.inliers(|f| f.offset_m.amax() * MM_PER_M).into_iter().fold(1e-6, f64::max)
}

/// The vertical axis of offsets.
fn offset_axis(shown: &Shown<'_>) -> Axis {
    let axis = Axis::of("offset (mm)");
    if shown.features.iter().any(|f| f.is_outlier()) {
        axis.between(-edge_mm(shown), edge_mm(shown))
    } else {
        axis
    }
}

fn over_time(shown: &Shown<'_>, columns: &mut Columns) -> Chart {
    Chart {
        id: "residual-time",
        title: "Distance from the line over time",
        explanation:
            "In two directions perpendicular to the line and to each other. Should look like random noise."
                .to_owned(),
        alternative: "Offset of each seam point from the line in mm over time in s".to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("time since the first robot row (s)"),
            y: offset_axis(shown),
            series: two_sides(shown, columns, |f| f.stamp_s),
            marks: Vec::new(),
        },
    }
}

/// Place of the curve's point that is nearest, along the curve, mm; of several seams one after the other.
fn along_curve_mm(curve: &CurveEstimate, point: &Vector3<f64>) -> f64 {
    let squared = |k: &usize| (curve.points_m[*k] - point).norm_squared();
    let nearest = (0..curve.points_m.len()).min_by(|a, b| squared(a).total_cmp(&squared(b))).unwrap_or(0);
    let mut before_m = 0.0;
    for seam in &curve.seams {
        if seam.points.contains(&nearest) {
            let steps = seam.points.len().saturating_sub(1).max(1);
            before_m += (nearest - seam.points.start) as f64 / steps as f64 * seam.length_m;
            break;
        }
        before_m += seam.length_m;
    }
    before_m * MM_PER_M
}

/// Words of a line, and of a curve that is unrolled.
const ALONG: [[&str; 4]; 2] = [
    [
        "Distance from the line along it",
        "A bend or a step here means that the edge is not straight.",
        "Offset of each seam point from the line in mm over its place along the line in mm",
        "along the line (mm)",
    ],
    [
        "Distance from the curve along its length",
        "The curve is unrolled. Differences between passes are errors that neither curve nor calibration \
        explains.",
        "Offset of each seam point from the curve in mm over its place along the unrolled curve in mm",
        "along the curve (mm)",
    ],
];

fn along_line(shown: &Shown<'_>, columns: &mut Columns) -> Chart {
    let lines = &shown.calibration.best_fit().lines;
    let curve = shown.calibration.findings.curve.as_ref();
    let along = |f: &FeatureResidual| {
        if let Some(curve) = curve {
            return along_curve_mm(curve, &f.point_in_base);
        }
        let line = &lines[f.line as usize];
        line.direction().dot(&(f.point_in_base - line.anchor())) * MM_PER_M
    };
    let [title, explanation, alternative, axis] = ALONG[usize::from(curve.is_some())];
    Chart {
        id: "residual-along",
        title,
        explanation: explanation.to_owned(),
        alternative: alternative.to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of(axis),
            y: offset_axis(shown),
            series: two_sides(shown, columns, along),
            marks: Vec::new(),
        },
    }
}

/// Cells along the longer side of the visited part of the view.
const CELLS: f64 = 16.0;
/// The mean of fewer residuals has no information.
const FEWEST: f64 = 3.0;

/// Coordinates of the view: its axes with their limits, the place of a feature in it, and its residual.
type View<'a> =
    ([(Axis, [f64; 2]); 2], Box<dyn Fn(&FeatureResidual) -> Option<([f64; 2], f64)> + 'a>, &'static str);

fn view<'a>(shown: &'a Shown<'_>) -> Option<View<'a>> {
    let features = &shown.source.recording.features;
    match &shown.source.recording.sensor {
        Sensor::CameraLaser { camera, .. } => {
            let [width, height] = camera.size.map(f64::from);
            let v = Axis { inverse: true, ..Axis::of("v (px)") };
            let limits = [(Axis::of("u (px)"), [0.0, width]), (v, [0.0, height])];
            let of = move |f: &FeatureResidual| {
                let Measured::Pixel(pixel) = features[f.row as usize].measured else { return None };
                Some((pixel, f.residual_px?.norm()))
            };
            Some((limits, Box::new(of), "px"))
        }
        Sensor::Profiler => {
            let of = move |f: &FeatureResidual| {
                let Measured::Profile([x, z]) = features[f.row as usize].measured else { return None };
                Some(([x * MM_PER_M, z * MM_PER_M], f.in_sheet_m?.norm() * MM_PER_M))
            };
            let places: Vec<[f64; 2]> =
                shown.features.iter().filter_map(|f| of(f)).map(|(at, _)| at).collect();
            let limits = |k: usize| {
                let low = places.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
                let high = places.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
                [low - 1.0, high + 1.0]
            };
            let axes =
                [(Axis::of("x along the stripe (mm)"), limits(0)), (Axis::of("z, range (mm)"), limits(1))];
            Some((axes, Box::new(of), "mm"))
        }
        Sensor::Points { .. } => None,
    }
}

fn over_image(shown: &Shown<'_>) -> Option<Chart> {
    let ([x, y], of, unit) = view(shown)?;
    let seen: Vec<([f64; 2], f64)> =
        shown.features.iter().filter(|f| !f.is_outlier()).filter_map(|f| of(f)).collect();
    let extent = |k: usize| {
        let at = || seen.iter().map(|(place, _)| place[k]);
        at().fold(f64::NEG_INFINITY, f64::max) - at().fold(f64::INFINITY, f64::min)
    };
    let side = extent(0).max(extent(1)) / CELLS;
    if side.is_nan() || side <= 0.0 {
        return None;
    }
    let mut sums = std::collections::BTreeMap::new();
    for ([u, v], residual) in seen {
        let cell = (((u - x.1[0]) / side) as i64, ((v - y.1[0]) / side) as i64);
        let sum = sums.entry(cell).or_insert((0.0, 0.0));
        *sum = (sum.0 + residual, sum.1 + 1.0);
    }
    let cells: Vec<[f64; 4]> = sums
        .into_iter()
        .filter(|(_, (_, count))| *count >= FEWEST)
        .map(|((column, row), (sum, count))| {
            let middle = |k: i64, low: f64| low + (k as f64 + 0.5) * side;
            [middle(column, x.1[0]), middle(row, y.1[0]), sum / count, count]
        })
        .collect();
    let strongest = 2.0 * median(cells.iter().map(|cell| cell[2])).unwrap_or(1.0);
    Some(Chart {
        id: "residual-image",
        title: "Residual over the field of view",
        explanation: "Mean length of the residual in each part of the view; the scale ends at twice the \
            typical value. A bright corner means a lens or laser plane that differs from sensor.toml. Only \
            the scanned parts are drawn."
            .to_owned(),
        alternative: format!("Mean residual in {unit} over the field of view, in {} cells", cells.len()),
        wide: false,
        drawn: Drawn::Heat(Box::new(Heat {
            x: x.0.between(visited(&cells, 0)[0] - side, visited(&cells, 0)[1] + side),
            y: y.0.between(visited(&cells, 1)[0] - side, visited(&cells, 1)[1] + side),
            cell: [side, side],
            cells,
            strongest,
            unit: format!("mean residual ({unit})"),
            short: unit.to_owned(),
            signed: false,
            equal: true,
        })),
    })
}

/// First and last middle of the cells along an axis.
fn visited(cells: &[[f64; 4]], axis: usize) -> [f64; 2] {
    let at = || cells.iter().map(|cell| cell[axis]);
    [at().fold(f64::INFINITY, f64::min), at().fold(f64::NEG_INFINITY, f64::max)]
}

/// Vectors that are drawn at most.
const VECTORS: usize = 600;
/// Length of a typical vector as a part of the visited part.
const VECTOR_LENGTH: f64 = 0.04;

/// Residuals as vectors over the picture, enlarged: neighbours that point the same way are a lens or a laser plane.
fn vectors(shown: &Shown<'_>, columns: &mut Columns) -> Option<Chart> {
    let features = &shown.source.recording.features;
    let both: Vec<([f64; 2], [f64; 2])> = shown
        .features
        .iter()
        .filter(|f| !f.is_outlier())
        .filter_map(|f| match features[f.row as usize].measured {
            Measured::Pixel(pixel) => f.residual_px.map(|r| (pixel, [r.x, r.y])),
            Measured::Profile([x, z]) => {
                f.in_sheet_m.map(|r| ([x * MM_PER_M, z * MM_PER_M], [r.x * MM_PER_M, r.y * MM_PER_M]))
            }
            Measured::Point(_) => None,
        })
        .collect();
    let thinned: Vec<_> = both.iter().step_by(both.len().div_ceil(VECTORS).max(1)).collect();
    let typical = median(thinned.iter().map(|(_, r)| r[0].hypot(r[1]))).filter(|typical| *typical > 0.0)?;
    let extent = |k: usize| {
        let at = || thinned.iter().map(|(place, _)| place[k]);
        at().fold(f64::NEG_INFINITY, f64::max) - at().fold(f64::INFINITY, f64::min)
    };
    let power = (VECTOR_LENGTH * extent(0).max(extent(1)) / typical).log10();
    // A round number: 1, 2 or 5 times a power of ten.
    let decade = 10f64.powf(power.floor());
    let scale =
        decade * [1.0, 2.0, 5.0].into_iter().rfind(|f| f * decade <= 10f64.powf(power)).unwrap_or(1.0);
    let axis = |k: usize| {
        let of = |(place, r): &&([f64; 2], [f64; 2])| [place[k], place[k] + scale * r[k], f64::NAN];
        thinned.iter().flat_map(of).collect::<Vec<f64>>()
    };
    let (x, y) = (columns.add(axis(0)), columns.add(axis(1)));
    let start = |k: usize| thinned.iter().map(move |(place, _)| place[k]);
    let (from_x, from_y) = (columns.add(start(0)), columns.add(start(1)));
    let ([x_axis, y_axis], ..) = view(shown)?;
    Some(Chart {
        id: "residual-vectors",
        title: "Residual vectors",
        explanation: format!(
            "Measured minus predicted, enlarged {scale} times, for {} features. Neighbours that point the \
            same way mean a lens or laser plane that differs from sensor.toml; noise has no direction.",
            thinned.len()
        ),
        alternative: format!("{} residual vectors over the field of view", thinned.len()),
        wide: false,
        drawn: Drawn::Plot {
            x: x_axis.0,
            y: y_axis.0,
            series: vec![
                Series::line(&format!("residual × {scale}"), x, y, Colour::A),
                Series::points("feature", from_x, from_y, Colour::Soft),
            ],
            marks: Vec::new(),
        },
    })
}

const BIN: f64 = 0.25;
const REACH: f64 = 5.0;

fn histogram(shown: &Shown<'_>) -> Chart {
    let bins = (2.0 * REACH / BIN) as usize;
    let mut counts = vec![0; bins];
    let (mut beyond, mut all) = (0, 0);
    for value in shown.calibration.findings.fit.features.iter().flat_map(|f| [f.whitened.x, f.whitened.y]) {
        all += 1;
        let bin = ((value + REACH) / BIN).floor();
        if bin >= 0.0 && (bin as usize) < bins { counts[bin as usize] += 1 } else { beyond += 1 }
    }
    let normal = |z: f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let within = (all - beyond) as f64;
    let expected = (0..bins).map(|k| within * BIN * normal(-REACH + (k as f64 + 0.5) * BIN)).collect();
    Chart {
        id: "histogram",
        title: "Residuals compared with the expected noise",
        explanation: format!(
            "Both components of every residual in standard deviations, with the expected normal \
            distribution. Not drawn: {beyond} of {all}, beyond ±{REACH} σ."
        ),
        alternative: "Histogram of residuals in standard deviations, with the expected normal curve"
            .to_owned(),
        wide: false,
        drawn: Drawn::Histogram(Histogram {
            axis: Axis::of("residual (σ)"),
            low: -REACH,
            width: BIN,
            counts,
            expected,
            beyond,
        }),
    }
}

/// Residual along the motion, m, and the speed, m/s, of the seam in the sheet.
fn along_motion(f: &FeatureResidual) -> Option<(f64, f64)> {
    let (residual, velocity) = (f.in_sheet_m?, f.crossing_m_s?);
    let speed = velocity.norm();
    (speed > 0.0).then(|| (residual.dot(&velocity) / speed, speed))
}

fn over_speed(shown: &Shown<'_>, columns: &mut Columns) -> Option<Chart> {
    let both: Vec<(f64, f64)> =
        shown.features.iter().filter(|f| !f.is_outlier()).filter_map(|f| along_motion(f)).collect();
    if both.is_empty() {
        return None;
    }
    let fastest = both.iter().map(|(_, speed)| *speed).fold(0.0, f64::max) * MM_PER_M;
    let typical_ms = 0.1;
    let x = columns.add(both.iter().map(|(_, speed)| speed * MM_PER_M));
    let y = columns.add(both.iter().map(|(off, _)| off * MM_PER_M));
    let ends = columns.add([0.0, fastest]);
    // Too little an offset takes the pose too late, when the seam is already further on: the measured point is behind it.
    let late = columns.add([0.0, -fastest * typical_ms * 1e-3]);
    let mut slope = Series::line("effect of an error of 0.1 ms", ends, late, Colour::Soft);
    slope.dashed = true;
    Some(Chart {
        id: "residual-speed",
        title: "Residual along the motion over speed",
        explanation: "Residual of each point in the direction in which the seam crosses the laser plane. A \
            slope means a wrong time offset; a widening cloud means time-stamp jitter."
            .to_owned(),
        alternative: "Residual in the direction of motion in mm over the speed at which the seam crosses the laser plane in mm/s".to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("speed across the laser plane (mm/s)"),
            y: Axis::of("ahead by (mm)"),
            series: vec![Series::points("features", x, y, Colour::A), slope],
            marks: Vec::new(),
        },
    })
}

fn over_direction(shown: &Shown<'_>, columns: &mut Columns) -> Option<Chart> {
    let both: Vec<(f64, f64)> = shown
        .features
        .iter()
        .filter(|f| !f.is_outlier())
        .filter_map(|f| {
            let velocity = f.crossing_m_s?;
            (velocity.norm() > 0.0).then(|| (velocity.y.atan2(velocity.x).to_degrees(), f.normalised))
        })
        .collect();
    if both.is_empty() {
        return None;
    }
    // Sectors of 15°: the median in each.
    let sectors = 24;
    let of_sector = |k: usize| {
        let low = -180.0 + 360.0 * k as f64 / f64::from(sectors);
        let within: Vec<f64> = both
            .iter()
            .filter(|(a, _)| *a >= low && *a < low + 360.0 / f64::from(sectors))
            .map(|(_, n)| *n)
            .collect();
        // The median of a handful has no information.
        let typical = if within.len() < 8 { None } else { median(within.into_iter()) };
        (low + 180.0 / f64::from(sectors), typical.unwrap_or(f64::NAN))
    };
    let (middle, typical): (Vec<f64>, Vec<f64>) = (0..sectors as usize).map(of_sector).unzip();
    let x = columns.add(both.iter().map(|(a, _)| *a));
    let y = columns.add(both.iter().map(|(_, n)| *n));
    let (middle, typical) = (columns.add(middle), columns.add(typical));
    Some(Chart {
        id: "residual-direction",
        title: "Residual over the direction of motion",
        explanation: "Direction in which the seam crosses the laser plane: 0° along the stripe, 90° in \
            range. The medians should be level, at 1.18 σ."
            .to_owned(),
        alternative: "Length of the residual in standard deviations over the direction of motion in degrees"
            .to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("direction in the laser plane (°)").between(-180.0, 180.0),
            y: Axis::of("residual (σ)"),
            series: vec![
                Series::points("features", x, y, Colour::A),
                Series::steps("median of 15°", middle, typical, Colour::B),
            ],
            marks: vec![Mark { name: "expected".to_owned(), at: 1.177, upright: false }],
        },
    })
}
