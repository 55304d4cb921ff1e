//! Checks of a result, as in the file: stamps, clocks, other minima, cross-validation, use.

use std::collections::BTreeMap;
use trueline_dataset::result_file::{
    AtTorch, Checks, ClockStep, CrossValidation, Disruption, Ellipsoid, FeatureStream, LeftOut, Moved,
    RobotStream, RunnerUp, Stamps, StepEntry, Stream,
};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::Calibration;
use trueline_method::assess::cross_validation::{HeldOut, Part};
use trueline_method::assess::outlier_segments::{Cause, OutlierSegment};
use trueline_method::assess::seam_point_error::SeamPointError;
use trueline_method::input::timestamps::StampReport;
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};

/// Stamps of both streams.
#[must_use]
pub fn stamps(c: &Calibration) -> Stamps {
    let (streams, clock) = (&c.findings.streams, &c.findings.clock);
    Stamps {
        zero_s: streams.stamp_s(0.0),
        robot: RobotStream { stream: stream(&streams.robot), drift_ppm: streams.robot.device_drift_ppm },
        features: FeatureStream {
            stream: stream(&streams.images),
            drift_ppm: clock.drift.map(|d| d.ppm),
            drift_sigma_ppm: clock.drift.map(|d| d.sigma_ppm),
            drift_taken_out: clock.drifted.is_some(),
            drift_about_s: clock.drift.map(|d| d.about_s),
        },
        robot_noise_mm: streams.robot_noise_m * MM_PER_M,
        robot_smoothed: streams.robot_smoothed,
        robot_poses_repeated: streams.robot_poses_repeated,
        meaning: None,
    }
}

fn stream(s: &StampReport) -> Stream {
    Stream {
        count: s.count,
        repeated: s.doubles,
        median_period_s: s.median_period_s,
        longest_gap_s: s.longest_gap_s,
        period_s: s.period_s,
        jitter_s: s.jitter_s,
        drops: s.missing,
        silences: s.silences,
        device_drift_ppm: s.device_drift_ppm,
        one_sided: s.one_sided,
        late_s: s.lateness_s.map(|[median_s, _]| median_s),
        latest_s: s.lateness_s.map(|[_, most_s]| most_s),
        wander_s: s.wander_s,
        grain_s: s.grain_s,
        steps: s.steps.iter().map(|(at_s, step_s)| StepEntry { at_s: *at_s, step_s: *step_s }).collect(),
        step_taken_out: s.step_taken_out,
        used: if s.dejittered { "regular" } else { "raw" }.to_owned(),
    }
}

/// Checks of the estimate.
#[must_use]
pub fn checks(c: &Calibration) -> Checks {
    let found = &c.findings.checks;
    Checks {
        runner_up: found.ambiguity.runner_up.map(|r| RunnerUp {
            time_offset_s: c.in_recorded_stamps_s(r.time_offset_s),
            explains: r.test.explains,
            best_explains: r.test.best_explains,
            z: r.test.z,
            decided: r.test.decided(),
        }),
        held_out: found.held_out.as_ref().map(cross_validation),
        largest_clock_step: c.findings.clock.step.map(|s| ClockStep {
            at_s: s.at_s,
            step_s: s.step_s,
            sigma_s: s.sigma_s,
        }),
        disruptions: found.outlier_segments.iter().map(stretch).collect(),
    }
}

fn cross_validation(check: &HeldOut) -> CrossValidation {
    CrossValidation {
        parts: if check.passes { "passes" } else { "blocks of time" }.to_owned(),
        rms_mm: check.rms_m * MM_PER_M,
        expected_rms_mm: check.expected_rms_m * MM_PER_M,
        fitted_rms_mm: check.fitted_rms_m * MM_PER_M,
        left_out: check.parts.iter().map(left_out).collect(),
    }
}

fn left_out(part: &Part) -> LeftOut {
    let three = |first: usize, scale: f64| [0, 1, 2].map(|k| part.moved[first + k] * scale);
    LeftOut {
        span_s: part.span_s,
        rms_mm: part.rms_m * MM_PER_M,
        moved: Moved {
            time_offset_s: part.moved[TIME_OFFSET],
            rotation_rad: three(ROTATION, 1.0),
            translation_mm: three(TRANSLATION, MM_PER_M),
        },
        largest_sigmas: part.sigmas.amax(),
    }
}

fn stretch(d: &OutlierSegment) -> Disruption {
    let one = |key: &str, value: f64| Some(BTreeMap::from([(key.to_owned(), value)]));
    let (cause, amount) = match d.cause {
        Cause::RobotStoodStill => ("robot_stood_still", Some(BTreeMap::new())),
        Cause::ClockStep(step_s) => ("clock_step", one("step_s", step_s)),
        Cause::OtherLine(beside_m) => ("other_line", one("beside_mm", beside_m * MM_PER_M)),
        Cause::Unknown => ("unknown", None),
    };
    Disruption { span_s: d.span_s, features: d.features, cause: cause.to_owned(), amount }
}

/// The calibration's error in use.
#[must_use]
pub fn at_torch(torch: &SeamPointError) -> AtTorch {
    let [along, across, height] = torch.sigma_m.map(|s| s * MM_PER_M);
    AtTorch {
        speed_mm_s: torch.speed_m_s * MM_PER_M,
        stand_off_mm: torch.stand_off_m * MM_PER_M,
        sigma_along_mm: along,
        sigma_across_mm: across,
        sigma_height_mm: height,
        ellipsoid: Ellipsoid {
            semi_axes_mm: torch.semi_axes_m.map(|s| s * MM_PER_M),
            directions_in_base: torch.directions_in_base,
        },
    }
}
