//! A calibration as the file of a result: the units of the file, and null for unobservable quantities.

use crate::export::time_offset;
use crate::number::positive_w;
use crate::{axes, checks, facts, seam_error, stripes};
use trueline_dataset::result_file::{
    self, CadEntry, CadPose, Covariance, CurveEntry, DrawnLineOptions, ErrorsFoundEntry, IterationEntry,
    IterationLine, LineEntry, LinePosition, ModelEntry, Observability, Options, OutlierEntry,
    PartMovesOptions, PoseEntry, RequireOptions, Residuals, ResultFile, RivalEntry, SCHEMA_VERSION, Sigma,
    SymmetryEntry, TimeOffsetUse, Tool, UnobservableEntry,
};
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Line;
use trueline_method::adjustment::error_sizes::Amplitudes;
use trueline_method::assess::observability::{Group, RANK_THRESHOLD, Unobservable};
use trueline_method::curve::estimate::{CurveEstimate, SeamOfCurve};
use trueline_method::hypotheses::ambiguity::RivalAnswer;
use trueline_method::models::{Block, ModelTried, Role};
use trueline_method::problem::parameters::{self, ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::solve::iteration_record::IterationRecord;
use trueline_method::verdict::Axis;
use trueline_method::{Calibration, Config, DrawnLine, Hold, Status};

/// The whole result.
#[must_use]
pub fn of(c: &Calibration) -> ResultFile {
    let time_offset_s = c.time_offset().ok().map(|offset| offset.value_s);
    ResultFile {
        schema_version: SCHEMA_VERSION,
        tool: Tool { name: "trueline".to_owned(), version: env!("CARGO_PKG_VERSION").to_owned() },
        status: Some(match c.status() {
            Status::Accepted => result_file::Status::Accepted,
            Status::NotAccepted => result_file::Status::NotAccepted,
        }),
        reasons: c.reasons().iter().map(facts::reason).collect(),
        probable_cause: None,
        warnings: c.warnings().iter().map(facts::warning).collect(),
        time_offset_s,
        time_offset_use: time_offset_s.filter(|_| c.status() == Status::Accepted).map(time_offset_use),
        tool_from_camera: tool_from_camera(c),
        lines: (0..c.best_fit().lines.len()).map(|k| line(c, k)).collect(),
        base_from_target: None,
        cylinder: None,
        sphere: None,
        curves: curves(c),
        axes: c.findings.axes.iter().map(axes::entry).collect(),
        sensors: Vec::new(),
        between: Vec::new(),
        planes: stripes::planes(c),
        stripes: stripes::entry(c),
        sigma: sigma(|component| c.sigma(component)),
        sigma_noise: sigma(|component| c.noise_sigma(component)),
        covariance: covariance(c),
        observability: observability(c),
        residuals: residuals(c),
        stamps: checks::stamps(c),
        checks: checks::checks(c),
        rivals: c.findings.checks.ambiguity.rivals.iter().map(|other| rival(c, other)).collect(),
        decided_by: c.findings.checks.ambiguity.decided_by.map(|by| by.name().to_owned()),
        mounted: None,
        seam_error: c.findings.checks.seam_error.as_ref().map(seam_error::entry),
        errors_found: c.findings.errors_found().map(errors_found),
        sensor: seam_error::sensor_entry(c),
        images_ahead_s: Some(c.findings.streams.images_ahead_s).filter(|ahead_s| *ahead_s != 0.0),
        at_torch: c.findings.checks.seam_point_error.as_ref().map(checks::at_torch),
        termination: c.findings.fit.termination.to_string(),
        iterations: c.findings.fit.iterations.iter().map(|step| iteration(c, step)).collect(),
        inputs: c.findings.inputs.clone(),
        options: options(&c.findings.config),
        models_tried: c.findings.models_tried.iter().map(model).collect(),
    }
}

fn errors_found(amplitudes: &Amplitudes) -> ErrorsFoundEntry {
    ErrorsFoundEntry {
        white_noise: amplitudes.white.clone(),
        lasting_noise: amplitudes.lasting.iter().map(|noise| noise.lasting().sqrt()).collect(),
        lasts_s: amplitudes.lasting.first().map_or(0.0, |noise| noise.lasts_s),
        seam_form_mm: amplitudes.form_m * MM_PER_M,
        robot_mm: amplitudes.robot_m * MM_PER_M,
        robot_times: amplitudes.robot,
        robot_lag_s: amplitudes.lag_s,
        frames_left_out: amplitudes.out.count,
        frames: amplitudes.out.of,
    }
}

fn model(tried: &ModelTried) -> ModelEntry {
    // Most cells have no axes.
    let is_said = |block: &Block| *block != Block::Axes || tried.role(*block) != Role::Held;
    let said = Block::ALL.into_iter().filter(is_said);
    let role = |block: Block| (block.name().to_owned(), tried.role(block).name().to_owned());
    ModelEntry {
        taken: tried.because.is_taken(),
        why: tried.because.code().to_owned(),
        measurements: tried.measurements.name().to_owned(),
        roles: said.map(role).collect(),
        target: tried.target.name().to_owned(),
        clock: tried.clock.name().to_owned(),
        robot_lag_s: tried.robot_lag_s,
        log_evidence: tried.log_evidence,
        noise_factor: tried.noise_factor,
    }
}

fn time_offset_use(offset_s: f64) -> TimeOffsetUse {
    let [python, cpp, rapid] = time_offset::snippets(offset_s).map(|snippet| snippet.text);
    let advice = time_offset::advice(offset_s).to_vec();
    TimeOffsetUse { rule: time_offset::rule(offset_s), advice, python, cpp, rapid }
}

fn tool_from_camera(c: &Calibration) -> PoseEntry {
    PoseEntry {
        translation_mm: Axis::ALL.map(|axis| Some(c.translation(axis).ok()?.value_m * MM_PER_M)),
        rotation_wxyz: c.rotation().ok().map(|rotation| positive_w(&rotation)),
    }
}

/// The curve of each seam; placed only if time offset and hand-eye transform are determined.
fn curves(c: &Calibration) -> Vec<CurveEntry> {
    let found = c.findings.curve.iter();
    found.flat_map(|found| found.seams.iter().map(|seam| curve(c, found, seam))).collect()
}

fn curve(c: &Calibration, found: &CurveEstimate, seam: &SeamOfCurve) -> CurveEntry {
    let is_placed = (TIME_OFFSET..parameters::LINES).all(|component| c.is_known(component));
    let points = found.points_m[seam.points.clone()].iter().map(|point| (point * MM_PER_M).into());
    let sigma = found.sigma_m[seam.points.clone()].iter().map(|sigma_m| sigma_m * MM_PER_M);
    CurveEntry {
        label: seam.label.to_string(),
        closed: found.closed,
        length_mm: seam.length_m * MM_PER_M,
        knots: found.knots,
        spacing_mm: found.spacing_m * MM_PER_M,
        s3_mm: found.s3_m * MM_PER_M,
        edf: found.effective_unknowns,
        points_mm: points.filter(|_| is_placed).collect(),
        sigma_mm: sigma.filter(|_| is_placed).collect(),
        cad: found.cad.as_ref().zip(c.findings.config.seam_cad.as_ref()).map(|(found, cad)| CadEntry {
            file: cad.file.clone(),
            tolerance_mm: cad.tolerance_m * MM_PER_M,
            base_from_part: is_placed.then(|| CadPose {
                translation_mm: (found.base_from_part.translation.vector * MM_PER_M).into(),
                rotation_wxyz: positive_w(&found.base_from_part.rotation),
            }),
            used: found.used,
            rms_mm: found.rms_m * MM_PER_M,
            symmetric_about: found.symmetry.filter(|_| is_placed).map(|symmetry| SymmetryEntry {
                axis: symmetry.axis.into(),
                point_mm: (symmetry.point_m * MM_PER_M).into(),
                angle_deg: symmetry.angle_rad.map(f64::to_degrees),
            }),
        }),
    }
}

fn line(c: &Calibration, number: usize) -> LineEntry {
    let first = parameters::line_index(number);
    let label = number.to_string();
    if !(c.is_known(first) && c.is_known(first + 1)) {
        return LineEntry { label, ..LineEntry::default() };
    }
    let at = &c.best_fit().lines[number];
    if c.line(number).is_err() {
        let direction: [f64; 3] = at.to_pluecker().direction.into();
        return LineEntry { label, direction: Some(direction), ..LineEntry::default() };
    }
    with_bow(c, number, line_entry(label, at))
}

/// The bow of a line, if it was estimated.
fn with_bow(c: &Calibration, number: usize, entry: LineEntry) -> LineEntry {
    let Some((bow, curvature)) = c.findings.unknowns.bow(number).zip(c.best_fit().curvatures.get(number))
    else {
        return entry;
    };
    // Inside it is written over half of the visible length.
    let scale = MM_PER_M * (0.1 / curvature.half_length_m).powi(2);
    let axes = c.best_fit().lines[number].axes();
    LineEntry {
        curvature_mm_per_100mm_squared: Some(bow.map(|(bow_m, _)| bow_m * scale)),
        curvature_sigma_mm_per_100mm_squared: Some(bow.map(|(_, sigma_m)| sigma_m * scale)),
        curvature_axes: Some([1, 2].map(|k| axes.column(k).into_owned().into())),
        ..entry
    }
}

/// A complete answer that the scan does not separate from the given one, without undetermined quantities.
fn rival(c: &Calibration, rival: &RivalAnswer) -> RivalEntry {
    let pose = c.file_pose(&rival.parameters);
    let shows = |group: Group| c.findings.unknowns.observability.shows(group);
    let translation = |axis: Axis| {
        c.is_known(TRANSLATION + axis as usize).then(|| pose.translation.vector[axis as usize] * MM_PER_M)
    };
    let line = |(number, at): (usize, &Line)| {
        let label = number.to_string();
        if shows(Group::Line(number)) {
            line_entry(label, at)
        } else {
            LineEntry { label, ..LineEntry::default() }
        }
    };
    RivalEntry {
        time_offset_s: c.in_recorded_stamps_s(rival.parameters.time_offset_s),
        tool_from_camera: PoseEntry {
            translation_mm: Axis::ALL.map(translation),
            rotation_wxyz: shows(Group::Rotation).then(|| positive_w(&pose.rotation)),
        },
        lines: rival.parameters.lines.iter().enumerate().map(line).collect(),
        explains: rival.test.explains,
        z: rival.test.z,
        noise_factor: rival.noise_factor,
        statements: rival.statements.iter().map(ToString::to_string).collect(),
    }
}

fn line_entry(label: String, at: &Line) -> LineEntry {
    let pluecker = at.to_pluecker();
    let direction: [f64; 3] = pluecker.direction.into();
    let orthonormal = pluecker.to_orthonormal().map(|o| {
        let w = o.rotation_vector();
        [w.x, w.y, w.z, o.distance * MM_PER_M]
    });
    LineEntry {
        label,
        point_mm: Some((at.anchor() * MM_PER_M).into()),
        direction: Some(direction),
        pluecker: Some(LinePosition { moment_mm: (pluecker.moment * MM_PER_M).into(), direction }),
        orthonormal,
        ..LineEntry::default()
    }
}

fn sigma(of: impl Fn(usize) -> Option<f64>) -> Sigma {
    let three = |first: usize, scale: f64| [0, 1, 2].map(|k| of(first + k).map(|s| s * scale));
    Sigma {
        time_offset_s: of(TIME_OFFSET),
        rotation_rad: three(ROTATION, 1.0),
        translation_mm: three(TRANSLATION, MM_PER_M),
    }
}

/// Names and covariance in the units of the names: lengths in mm, angles in rad, time in s.
fn covariance(c: &Calibration) -> Covariance {
    let names = parameters::names(c.best_fit().lines.len());
    let scale = |name: &str| if name.ends_with("_m") { MM_PER_M } else { 1.0 };
    let wire_name = |name: &String| match name.strip_suffix("_m") {
        Some(stem) => format!("{stem}_mm"),
        None => name.clone(),
    };
    let entry = |i: usize, j: usize| Some(c.covariance(i, j)? * scale(&names[i]) * scale(&names[j]));
    let row = |i: usize| (0..names.len()).map(|j| entry(i, j)).collect();
    Covariance { order: names.iter().map(wire_name).collect(), matrix: (0..names.len()).map(row).collect() }
}

fn observability(c: &Calibration) -> Observability {
    let o = &c.findings.unknowns.observability;
    Observability {
        rank: o.rank,
        size: o.size,
        condition: o.condition.is_finite().then_some(o.condition),
        threshold: RANK_THRESHOLD,
        unobservable: o.unobservable.iter().flat_map(Unobservable::one_by_one).map(unobservable).collect(),
        held_at_guess: c.findings.unknowns.held_at_guess,
    }
}

fn unobservable(u: Unobservable) -> UnobservableEntry {
    UnobservableEntry {
        parameter: u.group.name().to_owned(),
        direction: u.directions.first().copied(),
        advice: u.to_string(),
    }
}

fn residuals(c: &Calibration) -> Residuals {
    let fit = &c.findings.fit;
    let outliers = fit.features.iter().zip(&fit.feature_stamps_ns).filter(|(f, _)| f.is_outlier());
    Residuals {
        rms_px: fit.residuals.rms_px,
        rms_mm: (fit.residuals.used > 0).then_some(fit.residuals.rms_m * MM_PER_M),
        rms_deg: None,
        inliers: fit.residuals.inliers,
        outliers: fit.residuals.outliers,
        used: fit.residuals.used,
        skipped: fit.residuals.skipped.iter().map(|(why, count)| (why.code().to_owned(), *count)).collect(),
        noise_factor: fit.noise_factor,
        sheet_fit_rms_mm: fit.sheet_fit_rms_m.map(|m| m * MM_PER_M),
        outlier_list: outliers
            .map(|(f, stamp_ns)| OutlierEntry {
                row: f.row,
                line: f.line,
                stamp_ns: *stamp_ns,
                sigmas: f.normalised,
            })
            .collect(),
    }
}

fn iteration(c: &Calibration, i: &IterationRecord) -> IterationEntry {
    let pose = c.file_pose(&i.parameters);
    let lines = i.parameters.lines.iter().map(|l| IterationLine {
        nearest_point_mm: (l.to_pluecker().nearest_point_to_origin() * MM_PER_M).into(),
        direction: l.direction().into(),
    });
    IterationEntry {
        cost: i.cost,
        rms_mm: i.rms_m * MM_PER_M,
        time_offset_s: c.in_recorded_stamps_s(i.parameters.time_offset_s),
        translation_mm: (pose.translation.vector * MM_PER_M).into(),
        rotation_wxyz: positive_w(&pose.rotation),
        lines: lines.collect(),
        accepted: i.accepted,
    }
}

/// The options of a calibration.
#[must_use]
pub fn options(config: &Config) -> Options {
    let is_held = |hold: Hold| !(config.at_stops && hold == Hold::TimeOffset);
    Options {
        measurements: config.measurements.name().to_owned(),
        residual: config.residual.name().to_owned(),
        loss: format!("{:?}", config.final_loss()),
        at_stops: config.at_stops,
        fix: config.hold.iter().filter(|hold| is_held(**hold)).map(|hold| hold.name().to_owned()).collect(),
        fixed_sigma: RequireOptions {
            time_offset_s: config.held_sigma.time_s,
            rotation_rad: config.held_sigma.rotation_rad,
            translation_mm: config.held_sigma.translation_m.map(|m| m * MM_PER_M),
            seam_mm: None,
        },
        drawn_lines: config.drawn_lines.iter().map(drawn_line).collect(),
        seam_cad: config.seam_cad.as_ref().map(|cad| cad.file.clone()),
        cad_tolerance_mm: config.seam_cad.as_ref().map(|cad| cad.tolerance_m * MM_PER_M),
        part_moves: config.part_moves.map(|moves| PartMovesOptions {
            shift_mm: moves.shift_m * MM_PER_M,
            turn_deg: moves.turn_rad.to_degrees(),
        }),
        feature_sigma_px: config.usual_feature_sigma_px(),
        feature_sigma_mm: config.usual_feature_sigma_m() * MM_PER_M,
        robot_sigma_mm: config.robot_sigma_m.map(|m| m * MM_PER_M),
        stamp_sigma_s: config.stamp_sigma_s,
        stamps: config.stamps.name().to_owned(),
        sensor: config.sensor.name().to_owned(),
        robot_accuracy_mm: config.robot_accuracy_m.map(|m| m * MM_PER_M),
        feature_bias_px: config.feature_bias_px,
        edge_radius_mm: config.edge_radius_m.map(|m| m * MM_PER_M),
        waviness_mm: config.waviness_m.map(|m| m * MM_PER_M),
        offset_within_s: config.known.offset_within_s,
        looks: config.known.looks.map(|axis| axis.name().to_owned()),
        accept_partial: config.accept_partial,
        strict: config.used_at.by_another_robot,
        require: RequireOptions {
            time_offset_s: config.require.time_s,
            rotation_rad: config.require.rotation_rad,
            translation_mm: config.require.translation_m.map(|m| m * MM_PER_M),
            seam_mm: config.require.seam_m.map(|m| m * MM_PER_M),
        },
        speed_mm_s: config.used_at.speed_m_s * MM_PER_M,
        stand_off_mm: config.used_at.stand_off_m.map(|m| m * MM_PER_M),
        offset_search_s: config.offset_search_s,
    }
}

fn drawn_line(drawn: &DrawnLine) -> DrawnLineOptions {
    DrawnLineOptions {
        line: drawn.line,
        anchor_mm: (drawn.line_in_base.anchor() * MM_PER_M).into(),
        direction: drawn.line_in_base.direction().into(),
        direction_sigma_rad: drawn.direction_sigma_rad,
        offset_sigma_mm: drawn.offset_sigma_m * MM_PER_M,
    }
}
