//! Uncertainty of each unknown, correlations, and other explanations of the scan.

use super::Shown;
use crate::page::{Axis, Block, Chart, Colour, Columns, Drawn, Mark, Matrix, Series};
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::Line;
use trueline_method::Calibration;
use trueline_method::assess::observability::RANK_THRESHOLD;
use trueline_method::problem::parameters::{self, LINES, ROTATION, TIME_OFFSET, TRANSLATION};

pub(super) fn blocks(shown: &Shown<'_>, columns: &mut Columns) -> Vec<Block> {
    let charts = [
        at_the_seam(shown),
        correlation(shown),
        super::seam_error::map(shown),
        Some(spectrum(shown)),
        profile(shown, columns),
        held_out(shown),
    ];
    charts.into_iter().flatten().map(Block::Chart).collect()
}

/// Names of the unknowns for a person.
fn names(lines: usize) -> Vec<String> {
    let tidy = |name: &String| {
        let stem = name.trim_end_matches("_rad").trim_end_matches("_m").trim_end_matches("_s");
        stem.replace('_', " ")
    };
    parameters::names(lines).iter().map(tidy).collect()
}

fn at_the_seam(shown: &Shown<'_>) -> Option<Chart> {
    let c = shown.calibration;
    let torch = c.findings.checks.seam_point_error.as_ref()?;
    let reach = |k: usize| match k {
        TIME_OFFSET => torch.speed_m_s,
        ROTATION..TRANSLATION => torch.stand_off_m,
        _ => 1.0,
    };
    let known: Vec<(usize, f64)> = (0..LINES).filter_map(|k| Some((k, c.sigma(k)?))).collect();
    if known.is_empty() {
        return None;
    }
    let all = names(c.best_fit().lines.len());
    Some(Chart {
        id: "at-the-seam",
        title: "Effect of each uncertainty on the seam",
        explanation: format!(
            "Effect of one standard deviation of each unknown at the seam, {:.0} mm from the sensor at {:.0} \
            mm/s. Correlated effects partly cancel.",
            torch.stand_off_m * MM_PER_M,
            torch.speed_m_s * MM_PER_M
        ),
        alternative: "Bars: effect of one standard deviation of each unknown on the seam, mm".to_owned(),
        wide: false,
        drawn: Drawn::Bars {
            names: known.iter().map(|(k, _)| all[*k].clone()).collect(),
            values: known.iter().map(|(k, sigma)| sigma * reach(*k) * MM_PER_M).collect(),
            axis: Axis::of("at the seam (mm)"),
            mark: None,
        },
    })
}

/// Whether a component has a meaning of its own: of a line all four do, or none.
fn means_something(c: &Calibration, component: usize) -> bool {
    match component.checked_sub(LINES) {
        None => true,
        Some(of_lines) => {
            let first = LINES + of_lines / Line::DIMENSION * Line::DIMENSION;
            (first..first + Line::DIMENSION).all(|k| c.is_known(k))
        }
    }
}

fn correlation(shown: &Shown<'_>) -> Option<Chart> {
    let c = shown.calibration;
    let all = names(c.best_fit().lines.len());
    let known: Vec<(usize, f64)> = (0..all.len())
        .filter(|k| means_something(c, *k))
        .filter_map(|k| Some((k, c.sigma(k).filter(|s| *s > 0.0)?)))
        .collect();
    if known.len() < 2 {
        return None;
    }
    let value = |(i, a): &(usize, f64), (j, b): &(usize, f64)| c.best_fit_covariance()[(*i, *j)] / (a * b);
    let values = known.iter().flat_map(|row| known.iter().map(move |column| value(row, column))).collect();
    let names: Vec<String> = known.iter().map(|(k, _)| all[*k].clone()).collect();
    Some(Chart {
        id: "correlation",
        title: "Correlations",
        explanation: "Correlation of the unknowns. Near ±1 the scan cannot separate the two; tilt about \
            another axis."
            .to_owned(),
        alternative: format!("Correlation matrix of {} unknowns, from −1 to 1", names.len()),
        wide: false,
        drawn: Drawn::Matrix(Matrix { columns: names.clone(), rows: names, values, strongest: 1.0 }),
    })
}

fn spectrum(shown: &Shown<'_>) -> Chart {
    let c = shown.calibration;
    let observability = &c.findings.unknowns.observability;
    let values = &observability.singular_values;
    let unknowns = names(c.best_fit().lines.len());
    let name = |made_of: &Vec<usize>| {
        let two = made_of.iter().take(2).filter_map(|k| unknowns.get(*k));
        let named = two.cloned().collect::<Vec<_>>().join(" and ");
        // None carries a fifth of it.
        if named.is_empty() { "several together".to_owned() } else { named }
    };
    Chart {
        id: "spectrum",
        title: "Observability",
        explanation: format!(
            "Singular values of the scaled problem, relative to the largest. A longer bar means a better \
            determined direction; its name lists the dominating unknowns. {} of {} are above the limit of \
            {RANK_THRESHOLD:.0e} and can be determined.",
            observability.rank, observability.size
        ),
        alternative: "Bars: singular values of the whitened, scaled Jacobian relative to the largest, on a \
            logarithmic axis"
            .to_owned(),
        wide: false,
        drawn: Drawn::Bars {
            names: observability.composition.iter().map(name).collect(),
            // A logarithmic axis has no zero; values below rounding are drawn at it.
            values: values.iter().map(|value| value.max(1e-16)).collect(),
            axis: Axis::log("relative to the largest"),
            mark: Some(Mark { name: "not determined below".to_owned(), at: RANK_THRESHOLD, upright: true }),
        },
    }
}

/// A runner-up that explains less of the features is not listed.
const WORTH_NAMING: f64 = 0.05;

fn profile(shown: &Shown<'_>, columns: &mut Columns) -> Option<Chart> {
    let c = shown.calibration;
    if shown.profile.is_empty() || !c.is_known(TIME_OFFSET) {
        return None;
    }
    let x = columns.add(shown.profile.iter().map(|p| c.in_recorded_stamps_s(p.time_offset_s) * 1e3));
    let y = columns.add(shown.profile.iter().map(|p| p.typical_sigmas));
    let mut marks =
        vec![Mark { name: "estimate".to_owned(), at: c.recorded_time_offset_s() * 1e3, upright: true }];
    let other = c.findings.checks.ambiguity.runner_up.as_ref().filter(|other| other.test.explains >= WORTH_NAMING).map(|other| {
        marks.push(Mark { name: "next best".to_owned(), at: c.in_recorded_stamps_s(other.time_offset_s) * 1e3, upright: true });
        format!(
            " The next best local minimum is at {:.1} ms and explains {:.0} % of the features instead of {:.0} %.",
            c.in_recorded_stamps_s(other.time_offset_s) * 1e3,
            100.0 * other.test.explains,
            100.0 * other.test.best_explains
        )
    });
    Some(Chart {
        id: "offset-profile",
        title: "Other time offsets",
        explanation: format!(
            "Typical residual every 40 ms, and every 1 ms near the estimate, with the other unknowns \
            re-estimated. A path that repeats itself has several local minima; the estimate must be the only \
            deep one.{}",
            other.unwrap_or_else(|| { " No other local minimum explains 5 % of the features.".to_owned() })
        ),
        alternative:
            "Typical residual in standard deviations over the time offset in ms, on a logarithmic axis"
                .to_owned(),
        wide: false,
        drawn: Drawn::Plot {
            x: Axis::of("time offset (ms)"),
            y: Axis::log("typical residual (σ)"),
            series: vec![Series::steps("other unknowns re-estimated", x, y, Colour::A)],
            marks,
        },
    })
}

fn held_out(shown: &Shown<'_>) -> Option<Chart> {
    let check = shown.calibration.findings.checks.held_out.as_ref()?;
    let what = if check.passes { "pass" } else { "block" };
    let rows = check
        .parts
        .iter()
        .map(|part| format!("{what} {:.1}–{:.1} s", part.span_s[0], part.span_s[1]))
        .collect();
    let c = shown.calibration;
    // Undetermined quantities have nothing to move.
    let known: Vec<usize> = (0..LINES).filter(|k| c.sigma(*k).is_some()).collect();
    if known.is_empty() {
        return None;
    }
    let all = names(0);
    let columns = known.iter().map(|k| all[*k].clone()).collect();
    let values = check.parts.iter().flat_map(|part| known.iter().map(|k| part.sigmas[*k])).collect();
    Some(Chart {
        id: "held-out",
        title: "Leave-one-out cross-validation",
        explanation: format!(
            "Change of the estimate without each part, in standard deviations. RMS residual of the left-out \
            part: {:.4} mm predicted from the rest, {:.4} mm fitted.",
            check.rms_m * MM_PER_M,
            check.fitted_rms_m * MM_PER_M
        ),
        alternative:
            "Matrix: parts of the scan left out in turn against unknowns, change in standard deviations"
                .to_owned(),
        wide: false,
        drawn: Drawn::Matrix(Matrix { columns, rows, values, strongest: 5.0 }),
    })
}
