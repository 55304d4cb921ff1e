//! Records of the models that were tried for a scan over a curve.

use crate::assess::share::{Share, ShareOf};
use crate::config::Measurements;
use crate::curve::answer::Answered;
use crate::findings::Findings;
use crate::models::{Because, Block, ModelTried, Role, SeamModel};

/// The record of the curve, from that of the line.
#[must_use]
pub(crate) fn of_curve(line: &ModelTried, answer: &Answered, because: Because) -> ModelTried {
    ModelTried {
        because,
        target: SeamModel::Curve,
        robot_lag_s: 0.0,
        log_evidence: answer.curve.log_evidence[0],
        noise_factor: answer.finished.factor,
        ..line.with(|block| Some(role_beside_curve(block, answer)))
    }
}

fn role_beside_curve(block: Block, answer: &Answered) -> Role {
    let of = match block {
        Block::TimeOffset | Block::HandEye | Block::SeamForm => return Role::Estimated,
        Block::Line | Block::Bow | Block::PoseLag | Block::Axes => return Role::Held,
        Block::Robot => ShareOf::Robot,
        Block::Sensor => ShareOf::Sensor,
        Block::Detector => ShareOf::Detector,
        Block::EdgeRadius => ShareOf::EdgeRadius,
    };
    if of == ShareOf::Sensor && answer.shape.is_some() {
        return Role::Estimated;
    }
    let is_considered = |share: &Share| share.of == of && share.columns.ncols() > 0;
    if answer.shares.iter().any(is_considered) { Role::Considered } else { Role::Held }
}

/// All models, the curve first.
#[must_use]
pub(crate) fn models(findings: &Findings, answer: &Answered) -> Vec<ModelTried> {
    let lines = findings.models_tried.iter();
    let mut lines: Vec<ModelTried> = lines
        .map(|line| {
            let because = if line.because.is_taken() { Because::LineRefused } else { line.because };
            ModelTried { because, ..line.clone() }
        })
        .collect();
    if let Some(line) = lines.iter_mut().find(|model| model.measurements == Measurements::Seam) {
        line.because = Because::LineRefused;
        line.log_evidence = answer.curve.log_evidence[1];
        let used = findings.stripes.as_ref().map_or(Measurements::Seam, |stripes| stripes.used);
        let curve = of_curve(line, answer, Because::CurveExplains);
        lines.insert(0, ModelTried { measurements: used, ..curve });
    }
    lines
}
