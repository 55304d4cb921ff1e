//! The report of a calibration: verdict, answers, pictures, conventions.

mod checks;
mod conventions;
mod convergence;
mod first_screen;
mod motion;
mod outliers;
mod plates;
mod residuals;
mod scene;
mod seam;
mod seam_error;
mod stamps;

use crate::page::render::render;
use crate::page::{Page, Section, Tone, Verdict};
use crate::summary;
use trueline_dataset::{Guess, Recording};
use trueline_method::assess::residuals::FeatureResidual;
use trueline_method::diagnose::offset_profile;
use trueline_method::diagnose::offset_profile::AtOffset;
use trueline_method::evaluate::evaluation::Deviation;
use trueline_method::evaluate::{evaluation, reference_curve, seam_points};
use trueline_method::{Calibration, Status};

/// A picture of a frame in which something was found that does not fit.
#[derive(Clone, Debug)]
pub struct FramePicture {
    /// Row of the feature, from 0.
    pub row: u32,
    /// PNG.
    pub png: Vec<u8>,
}

/// Inputs of the report.
pub struct Source<'a> {
    /// The result.
    pub calibration: &'a Calibration,
    /// Its recording.
    pub recording: &'a Recording,
    /// Title, for the heading.
    pub title: &'a str,
    /// How to make it again.
    pub command: &'a str,
    /// The mistake in the data that explains why it is not accepted, if one was found.
    pub probable_cause: Option<&'a str>,
    /// Pictures of outliers, where there are pictures.
    pub frames: &'a [FramePicture],
}

/// Renders the report.
#[must_use]
pub fn html(source: &Source<'_>) -> String {
    render(&page(source))
}

/// The report as data.
#[must_use]
pub fn page(source: &Source<'_>) -> Page {
    let c = source.calibration;
    let shown = Shown::of(source);
    let mut page = Page {
        title: source.title.to_owned(),
        verdict: Verdict { text: summary::sentence(c), tone: tone(c) },
        ..Page::default()
    };
    let columns = &mut page.columns;
    let sections = [
        ("answers", "", first_screen::blocks(c, source.probable_cause)),
        ("seam", "Seam", seam::blocks(&shown, columns)),
        ("plates", "Plates", plates::blocks(c)),
        ("residuals", "Residuals", residuals::blocks(&shown, columns)),
        ("uncertainty", "Result and uncertainty", checks::blocks(&shown, columns)),
        ("motion", "Motion and information", motion::blocks(&shown, columns)),
        ("stamps", "Stamps", stamps::blocks(&shown, columns)),
        ("space", "In space", scene::blocks(&shown, columns)),
        ("outliers", "Outliers", outliers::blocks(&shown)),
        ("numbers", "All numbers", vec![crate::page::Block::Facts(numbers(c))]),
        ("conventions", "Conventions and reproduction", conventions::blocks(source)),
        ("developers", "For developers: every step of the solver", convergence::blocks(c, columns)),
    ];
    page.sections = sections
        .into_iter()
        .filter(|(.., blocks)| !blocks.is_empty())
        .map(|(id, heading, blocks)| Section { id, heading, blocks, folded: id == "developers" })
        .collect();
    page
}

/// Accepted is one thing, accepted without a doubt another.
fn tone(c: &Calibration) -> Tone {
    match c.status() {
        Status::Accepted if c.warnings().is_empty() => Tone::Good,
        Status::Accepted => Tone::Doubtful,
        Status::NotAccepted => Tone::Bad,
    }
}

/// The summary's numbers; its bars have a chart of their own here.
fn numbers(c: &Calibration) -> Vec<(String, String)> {
    summary::rows(c).into_iter().filter(|(name, _)| name != summary::OVER_TIME).collect()
}

/// More points than this are thinned out for drawing; outliers never are.
const MOST_POINTS: usize = 100_000;

/// Plotted data of a calibration.
struct Shown<'a> {
    source: &'a Source<'a>,
    calibration: &'a Calibration,
    /// Features that are drawn.
    features: Vec<&'a FeatureResidual>,
    /// One feature in `stride` is drawn.
    stride: usize,
    /// The same seams with the time offset left out.
    before: Vec<Deviation>,
    profile: Vec<AtOffset>,
}

impl<'a> Shown<'a> {
    fn of(source: &'a Source<'a>) -> Self {
        let calibration = source.calibration;
        let stride = calibration.findings.fit.features.len().div_ceil(MOST_POINTS).max(1);
        let features = (calibration.findings.fit.features.iter().enumerate())
            .filter(|(k, f)| k % stride == 0 || f.is_outlier())
            .map(|(_, f)| f)
            .collect();
        Self {
            source,
            calibration,
            features,
            stride,
            before: without_offset(source).unwrap_or_default(),
            // A missing profile leaves its chart empty, and the chart states it.
            profile: offset_profile::around(source.recording, calibration).unwrap_or_default(),
        }
    }

    /// A number of each inlier.
    fn inliers(&self, of: impl Fn(&FeatureResidual) -> f64) -> Vec<f64> {
        self.features.iter().filter(|f| !f.is_outlier()).map(|f| of(f)).collect()
    }

    /// The same of each outlier.
    fn outliers(&self, of: impl Fn(&FeatureResidual) -> f64) -> Vec<f64> {
        self.features.iter().filter(|f| f.is_outlier()).map(|f| of(f)).collect()
    }
}

/// Places of the seams if images were not late.
fn without_offset(source: &Source<'_>) -> Option<Vec<Deviation>> {
    let c = source.calibration;
    if c.best_fit().lines.is_empty() {
        return None;
    }
    let by = Guess { time_offset_s: 0.0, tool_from_camera: *c.file_tool_from_camera() };
    let placed = seam_points::place(source.recording, &by, &c.findings.config).ok()?;
    let lines: Vec<_> =
        c.best_fit().lines.iter().map(|line| reference_curve::ReferenceCurve::Line(*line)).collect();
    let stride = placed.list.len().div_ceil(MOST_POINTS).max(1);
    let thinned: Vec<_> = placed.list.into_iter().step_by(stride).collect();
    Some(evaluation::against(&thinned, &lines).0)
}
