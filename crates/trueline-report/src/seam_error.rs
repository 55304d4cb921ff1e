//! Error of a seam point that is measured later: two numbers, their sources, and a remedy for each part.

use crate::number::{digits_for, with_sigma};
use trueline_dataset::result_file::{
    BudgetEntry, FieldEntry, RigidPartEntry, SeamErrorEntry, SensorEntry, SensorFileEntry,
};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::Calibration;
use trueline_method::assess::seam_error::SeamError;
use trueline_method::assess::sensor_shape::{SensorShape, WALD_LIMIT};

/// The entry of the result's file.
#[must_use]
pub fn entry(error: &SeamError) -> SeamErrorEntry {
    let parts = &error.budget_m;
    SeamErrorEntry {
        rms_mm: error.rms_m * MM_PER_M,
        scan_alone_mm: error.scan_alone_m() * MM_PER_M,
        field: FieldEntry { width_mm: error.field_m[0] * MM_PER_M, depth_mm: error.field_m[1] * MM_PER_M },
        budget_mm: BudgetEntry {
            noise: parts.noise * MM_PER_M,
            stamps: parts.stamps * MM_PER_M,
            sensor: parts.sensor * MM_PER_M,
            robot: parts.robot * MM_PER_M,
            seam_form: parts.seam_form * MM_PER_M,
            feature_bias: parts.feature_bias * MM_PER_M,
            held: parts.held * MM_PER_M,
            edge_radius: parts.edge_radius * MM_PER_M,
            detector: parts.detector * MM_PER_M,
            pose_lag: parts.pose_lag * MM_PER_M,
            axes: parts.axes * MM_PER_M,
        },
        remedy: budget(error, false).first().map(|part| format!("{}: {}", part.name, part.cure)),
        robot_accuracy_mm: error.levels.robot_accuracy_m * MM_PER_M,
        robot_is_stated: error.levels.robot_is_stated,
        feature_bias_px: error.levels.feature_bias_px,
        edge_radius_mm: error.levels.edge_radius_m * MM_PER_M,
        edge_is_stated: error.levels.edge_is_stated,
    }
}

/// The sensor in the result's file.
#[must_use]
pub(crate) fn sensor_entry(c: &Calibration) -> SensorEntry {
    let (mode, file) = (c.findings.config.sensor.name().to_owned(), sensor_file(c));
    let kind = Some(c.findings.sensor_kind.to_owned());
    let (stated, written) = (c.findings.unknowns.stated.as_ref(), c.findings.unknowns.written.as_ref());
    let Some(shape) = c.findings.unknowns.sensor else {
        return SensorEntry { kind, mode, file, ..SensorEntry::default() };
    };
    SensorEntry {
        kind,
        mode,
        shape: Some(per_mm(shape.shape.h)),
        shape_sigma: Some(per_mm(shape.sigma)),
        shape_origin_mm: Some(shape.shape.origin_m.map(|m| m * MM_PER_M)),
        prior_sigma: Some(per_mm(shape.prior_sigma)),
        prior_stated: shape.stated,
        improved: shape.improved(),
        wald: Some(shape.wald),
        words: shape.words(),
        file,
        remains_mm: stated.map(|stated| stated.remains_m * MM_PER_M).or(written.map(|_| 0.0)),
        rigid_part: stated.map(|stated| RigidPartEntry::of(&stated.rigid, &stated.sheet, &stated.field)),
    }
}

/// The sensor file of the hand-eye transform: the written one, or the recording's.
fn sensor_file(c: &Calibration) -> Option<SensorFileEntry> {
    if let Some(written) = &c.findings.unknowns.written {
        return Some(written.clone());
    }
    let sha256 = c.findings.inputs.get(STATED)?.clone();
    Some(SensorFileEntry { name: STATED.to_owned(), sha256, corrected: false })
}

/// Name of the sensor file among the inputs.
const STATED: &str = "sensor.toml";

/// h₄ and h₅ are 1/m inside.
fn per_mm([h1, h2, h3, h4, h5]: [f64; 5]) -> [f64; 5] {
    [h1, h2, h3, h4 / MM_PER_M, h5 / MM_PER_M]
}

/// The two numbers and the budget as rows of the summary; none where the hand-eye transform is not all observable.
#[must_use]
pub fn rows(c: &Calibration) -> Vec<(String, String)> {
    let Some(error) = &c.findings.checks.seam_error else { return Vec::new() };
    let alone = format!("± {} from the scan alone", mm(error.scan_alone_m()));
    let both = match assumed(c, error) {
        None => alone,
        Some(with) => format!("{alone}; ± {} with {with}", mm(error.rms_m)),
    };
    let mut rows = vec![("seam error".to_owned(), both)];
    let robot_is_doubted = c.findings.checks.robot_seems.is_some();
    rows.extend(budget(error, robot_is_doubted).into_iter().enumerate().map(|(k, part)| {
        let BudgetPart { name, share, cure, .. } = part;
        // The parts add up by their squares: 0.09 of 0.10 mm is 81 %.
        let of_what = if k == 0 { " of the variance" } else { "" };
        (format!("  {name}"), format!("± {}  ({:.0} %{of_what}; {cure})", mm(part.sigma_m), 100.0 * share))
    }));
    rows.extend(sensor_rows(c));
    rows
}

/// Smaller parts of the variance are not listed.
const LEAST_LISTED: f64 = 5e-3;

/// A part of the seam error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BudgetPart {
    /// Its source.
    pub name: &'static str,
    /// One standard deviation, m.
    pub sigma_m: f64,
    /// Its share of the variance, 0 to 1.
    pub share: f64,
    /// Its remedy.
    pub cure: &'static str,
}

/// Contributions to the whole error besides the scan, in words; `None` if nothing else was included.
#[must_use]
pub fn assumed(c: &Calibration, error: &SeamError) -> Option<String> {
    let mut with = Vec::new();
    let levels = &error.levels;
    if error.budget_m.robot > 0.0 {
        let assumed = if levels.robot_is_stated { "" } else { " (assumed)" };
        with.push(format!("a robot accuracy of {} mm{assumed}", levels.robot_accuracy_m * MM_PER_M));
    }
    if error.budget_m.feature_bias.hypot(error.budget_m.detector) > 0.0 {
        let state = if levels.bias_is_estimated { "estimated" } else { "assumed" };
        let per_px_m = c.findings.length_per_px_m();
        let bias = bias(levels.feature_bias_px, per_px_m);
        with.push(format!("a feature bias of {bias} per 10° of tilt ({state})"));
    }
    if error.budget_m.edge_radius > 0.0 {
        let assumed = if levels.edge_is_stated { "" } else { " (assumed)" };
        with.push(format!("an edge of {} mm radius{assumed}", levels.edge_radius_m * MM_PER_M));
    }
    if error.budget_m.held > 0.0 {
        with.push("the quantities held fixed, as stated".to_owned());
    }
    if error.budget_m.sensor > 0.0 {
        let stated = c.findings.unknowns.sensor.is_none_or(|shape| shape.stated);
        with.push(if stated { "the sensor" } else { "the sensor (0.5 % assumed)" }.to_owned());
    }
    match with.as_slice() {
        [] => None,
        [only] => Some(only.clone()),
        [first @ .., last] => Some(format!("{} and {last}", first.join(", "))),
    }
}

/// A feature bias in px. If features are lengths it is in mm, and one of `per_px_m` counts as a pixel.
pub(crate) fn bias(px: f64, per_px_m: Option<f64>) -> String {
    match per_px_m {
        None => format!("{} px", (100.0 * px).round() / 100.0),
        Some(per_px_m) => format!("{} mm", (1000.0 * px * per_px_m * MM_PER_M).round() / 1000.0),
    }
}

/// The relevant parts, largest first, each with a remedy. If the robot seems worse than assumed, nobody is asked to state a
/// better one.
#[must_use]
pub fn budget(error: &SeamError, robot_is_doubted: bool) -> Vec<BudgetPart> {
    let parts = &error.budget_m;
    let of_robot = if robot_is_doubted {
        "check the tool's frame, or calibrate the robot"
    } else {
        "state the robot's accuracy if it is better, or calibrate the robot"
    };
    let of_edge = if error.levels.edge_is_stated {
        "measure the edge's radius, or find the seam where two fitted lines cross"
    } else {
        "state edge_radius_mm under [seam] in sensor.toml; it is 0 where two fitted lines cross"
    };
    let mut list = [
        ("noise", parts.noise, "scan longer, with more tilt and more change of stand-off"),
        ("stamps", parts.stamps, "record the devices' own time stamps"),
        (
            "sensor",
            parts.sensor,
            "state the sensor's uncertainty, or change the stand-off more while scanning",
        ),
        ("robot", parts.robot, of_robot),
        ("seam form", parts.seam_form, "scan a straighter edge, or the same seam back again"),
        (
            "feature bias",
            parts.feature_bias.hypot(parts.detector),
            "add a pass with the sensor spun by 180° about its view",
        ),
        ("quantities held fixed", parts.held, "estimate them too, or state a smaller uncertainty"),
        ("edge radius", parts.edge_radius, of_edge),
        ("axes", parts.axes, "let the axes swing while scanning"),
        ("pose lag", parts.pose_lag, "record measured poses instead of commanded ones"),
    ];
    list.sort_by(|a, b| b.1.total_cmp(&a.1));
    let share = |sigma_m: f64| (sigma_m / error.rms_m).powi(2);
    list.into_iter()
        .map(|(name, sigma_m, cure)| BudgetPart { name, sigma_m, share: share(sigma_m), cure })
        .filter(|part| part.share > LEAST_LISTED)
        .collect()
}

fn sensor_rows(c: &Calibration) -> Vec<(String, String)> {
    let Some(shape) = c.findings.unknowns.sensor else { return Vec::new() };
    let mut rows = vec![("sensor calibration".to_owned(), sensor_state(&shape))];
    let taken: Vec<&str> = (0..5).filter(|k| shape.is_from_prior(*k)).map(|k| COMPONENTS[k]).collect();
    if !taken.is_empty() {
        rows.push(("  undetermined".to_owned(), format!("{}: from the prior", taken.join(", "))));
    }
    if let Some(written) = &c.findings.unknowns.written {
        rows.push((
            "  corrected in".to_owned(),
            format!("{}: the transform belongs to that file", written.name),
        ));
    }
    if let Some(stated) = c.findings.unknowns.stated.as_ref().filter(|_| shape.is_off()) {
        rows.push((
            "  remaining error".to_owned(),
            format!("{} in every seam point, with the present sensor file", mm(stated.remains_m)),
        ));
    }
    rows
}

fn sensor_state(shape: &SensorShape) -> String {
    let words = shape.words().join("; ");
    if shape.is_off() {
        format!("off: {words}")
    } else if shape.wald > WALD_LIMIT {
        format!("not the sensor: the cause named above makes the fit suggest that {words}")
    } else if words.is_empty() {
        "cannot be determined from this scan".to_owned()
    } else if shape.clearest() > DOUBTFUL {
        format!("perhaps off: {words}")
    } else {
        format!("no fault detected; largest deviation: {words}")
    }
}

/// A component this many of its ± from zero is doubtful, even if five of them together are not clearly off.
const DOUBTFUL: f64 = 3.0;

/// The five numbers of a shape.
const COMPONENTS: [&str; 5] = ["width", "depth", "shear", "keystone along the stripe", "keystone in depth"];

/// Millimetres with two digits.
#[must_use]
pub fn mm(value_m: f64) -> String {
    let mm = value_m * MM_PER_M;
    format!("{mm:.0$} mm", digits_for(mm))
}

/// Whether each seam is straight, with a number.
#[must_use]
pub(crate) fn straightness(c: &Calibration) -> Vec<(String, String)> {
    let lines = c.best_fit().lines.iter().zip(&c.best_fit().curvatures).enumerate();
    let row = |(k, (line, curvature)): (usize, (&trueline_geometry::Line, &trueline_model::Curvature))| {
        let bow = c.findings.unknowns.bow(k)?;
        let size = bow[0].0.hypot(bow[1].0);
        let sigma = bow[0].1.hypot(bow[1].1);
        let length_mm = 2.0 * curvature.half_length_m * MM_PER_M;
        let across = line.axes().fixed_columns::<2>(1) * nalgebra::Vector2::new(bow[0].0, bow[1].0);
        let direction = if size > 2.0 * sigma {
            let [x, y, z]: [f64; 3] = across.normalize().into();
            format!(", its ends towards ({x:.2}, {y:.2}, {z:.2})")
        } else {
            String::new()
        };
        let verdict = if size > 2.0 * sigma { "bowed" } else { "straight" };
        let text = format!(
            "{verdict} over {length_mm:.0} mm: bow {}{direction}",
            with_sigma(size * MM_PER_M, Some(sigma * MM_PER_M), "mm")
        );
        Some((format!("seam {k}"), text))
    };
    lines.filter_map(row).collect()
}
