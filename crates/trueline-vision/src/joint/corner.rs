//! The corner where two arms of the stripe meet, measured.

use crate::detection::{Detection, plates_in_order};
use crate::frame::Frame;
use crate::joint::arm_pair::ArmPair;
use crate::lens::Lens;
use crate::line::Line2;
use crate::measure::stripe_meter::{Fit, StripeMeter};
use crate::measure::template::Template;
use crate::not_found::NotFound;
use crate::picture::Level;
use crate::seam::{Seam, judged};
use nalgebra::{Matrix2, Vector2};

/// Stretch beyond the corner in which the stripe must have ended, px.
const BEYOND_PX: f64 = 60.0;
/// Light beyond the corner of this part of the arm's counts as the stripe.
const GOES_ON: f64 = 0.6;
/// Least part of the sections of an arm that must show the stripe.
const LEAST_PRESENT: f64 = 0.3;

/// A move of the line at the corner after which it is measured again, px, and how often.
const SETTLED_PX: f64 = 0.3;
const MOST_REPEATS: usize = 3;

/// Nothing of an arm could be measured.
const NOTHING: NotFound = NotFound::TooLittle { visible: 0.0, needed: LEAST_PRESENT };
/// Lines that have become parallel.
const PARALLEL: NotFound = NotFound::TooFlat { bend_deg: 0.0, needed_deg: 0.0 };

/// Measures the corner of a pair, and the stripes on its two plates.
///
/// # Errors
/// The reason why there is none, or none that is reliable.
pub fn measure<L: Level>(
    meter: &mut StripeMeter,
    pair: &ArmPair,
    frame: Frame<'_, L>,
) -> Result<Detection, NotFound> {
    let lens = frame.lens;
    let mut arms = pair.arms;
    let mut lengths = pair.lengths;
    let mut templates: [Option<Template>; 2] = [None, None];
    for k in 0..2 {
        let span = [margin(3.0 * pair.sigmas_px[k], &arms), lengths[k]];
        let (line, template) = meter.learn(&arms[k], span, pair.sigmas_px[k], frame).ok_or(NOTHING)?;
        arms[k] = line;
        templates[k] = Some(template);
    }
    let [Some(first), Some(second)] = templates else { return Err(NOTHING) };
    let templates = [first, second];
    outward(&mut arms, &mut lengths, &pair.arms)?;
    let reach = templates[0].reach_px.max(templates[1].reach_px);
    let from = margin(reach, &arms);
    let mut fits = [None, None];
    for k in 0..2 {
        let span = [from, lengths[k]];
        let mut fit = meter.fit_with(&arms[k], span, &templates[k], frame).ok_or(NOTHING)?;
        for _ in 0..MOST_REPEATS {
            if settled(&arms[k], &fit) {
                break;
            }
            outward_again(&mut arms[k], &fit.line);
            fit = meter.fit_with(&arms[k], span, &templates[k], frame).ok_or(NOTHING)?;
        }
        if fit.present < LEAST_PRESENT {
            return Err(NotFound::TooLittle { visible: fit.present, needed: LEAST_PRESENT });
        }
        fits[k] = Some(meter.without_bent_start(fit));
    }
    let [Some(a), Some(b)] = fits else { return Err(NOTHING) };
    let seam = cross(lens, &a, &b)?;
    for (k, fit) in [a, b].iter().enumerate() {
        let usual = UsualStripe { amplitude: fit.amplitude, template: &templates[k] };
        if goes_on(meter, &arms[k], from, &usual, frame) {
            return Err(NotFound::GoesOn);
        }
    }
    let ideal = a.line.cross(&b.line).ok_or(PARALLEL)?;
    let begins = [0, 1].map(|k| lens.on_sheet(&pair.arms[k].at(pair.gaps_px[k])));
    let gap_m = if let [Some((a, _)), Some((b, _))] = begins { (b - a).norm() } else { 0.0 };
    Ok(Detection { plates: plates_in_order([&a, &b], &ideal, lens), ..Seam { gap_m, ..seam }.into() })
}

/// Whether a fit has converged at the corner: after a move m the remaining error is of the order of m² over the stripe's
/// thickness.
fn settled(arm: &Line2, fit: &Fit) -> bool {
    let moved = fit.line.distance(&arm.point).abs();
    let sigma = fit.variance_at(fit.line.station(&arm.point)).sqrt();
    moved < SETTLED_PX && moved < 3.0 * sigma
}

/// Takes a line over, with the point nearest to the corner and the direction that the arm had.
fn outward_again(arm: &mut Line2, line: &Line2) {
    let along = if line.along.dot(&arm.along) < 0.0 { -line.along } else { line.along };
    *arm = Line2 { point: line.at(line.station(&arm.point)), along };
}

/// Distance from the corner at which an arm is clean: beyond its own end, the other arm's light and the neighbouring
/// background.
fn margin(reach_px: f64, arms: &[Line2; 2]) -> f64 {
    let beside = 0.7 * reach_px + 3.0;
    let sine = arms[0].along.perp(&arms[1].along).abs();
    let sharp = arms[0].along.dot(&arms[1].along) > 0.0;
    if sharp { (beside + 4.0) / sine.max(0.1) } else { beside }
}

/// Lets two lines begin at their crossing again, pointing as they did.
fn outward(arms: &mut [Line2; 2], lengths: &mut [f64; 2], before: &[Line2; 2]) -> Result<(), NotFound> {
    let corner = arms[0].cross(&arms[1]).ok_or(PARALLEL)?;
    for k in 0..2 {
        let end = before[k].at(lengths[k]);
        if arms[k].along.dot(&before[k].along) < 0.0 {
            arms[k].along = -arms[k].along;
        }
        arms[k].point = corner;
        lengths[k] = arms[k].station(&end);
    }
    Ok(())
}

/// The crossing of two measured lines and its covariance: n_k · δx = e_k for both.
fn cross(lens: &Lens, a: &Fit, b: &Fit) -> Result<Seam, NotFound> {
    let ideal = a.line.cross(&b.line).ok_or(PARALLEL)?;
    let normals = Matrix2::from_rows(&[a.line.normal().transpose(), b.line.normal().transpose()]);
    let inverse = normals.try_inverse().ok_or(PARALLEL)?;
    let variance = |fit: &Fit| fit.variance_at(fit.line.station(&ideal));
    let errors = Matrix2::from_diagonal(&Vector2::new(variance(a), variance(b)));
    let covariance = inverse * errors * inverse.transpose();
    judged(&covariance)?;
    Seam::from_ideal(lens, &ideal, &covariance, a.present.min(b.present))
}

/// The usual stripe on an arm.
struct UsualStripe<'a> {
    amplitude: f64,
    template: &'a Template,
}

/// Whether an arm's stripe is still there beyond the corner: then the lines cross, and nothing ends.
fn goes_on<L: Level>(
    meter: &mut StripeMeter,
    arm: &Line2,
    margin: f64,
    usual: &UsualStripe<'_>,
    frame: Frame<'_, L>,
) -> bool {
    meter.section(arm, [-margin - BEYOND_PX, -margin], usual.template, frame);
    let sections = meter.sections();
    let bright = sections.iter().filter(|section| section.amplitude > GOES_ON * usual.amplitude).count();
    // A corner at the border of the picture has nothing beyond it.
    sections.len() > 10 && bright * 2 > sections.len()
}
