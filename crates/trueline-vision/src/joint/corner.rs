//! Where two segments of the stripe meet: the corner of a fillet, the bottom of a groove.

use crate::frame::Frame;
use crate::lens::Lens;
use crate::line::Line2;
use crate::locate::line_segment::LineSegment;
use crate::locate::tiles::TILE;
use crate::measure::stripe_meter::{Fit, StripeMeter};
use crate::measure::template::Template;
use crate::picture::Level;
use crate::seam::{NotFound, Seam, known_well};
use nalgebra::{Matrix2, Vector2};

/// The flattest bend that makes a corner, rad in the picture.
const FLATTEST: f64 = 0.1;
/// The stripe may be missing this far from the corner on one arm, as a part of its length and in px, and on both
/// together: further away lines may cross where there is nothing.
const MOST_GAP: f64 = 0.5;
const MOST_GAP_PX: f64 = 120.0;
const BOTH_GAPS_PX: f64 = 160.0;
/// Part of an arm that edgels cover at least.
const LEAST_COVERED: f64 = 0.35;
/// Stretch beyond the corner in which the stripe must have ended, px.
const BEYOND_PX: f64 = 60.0;
/// Light beyond the corner of this part of the arm's counts as the stripe.
const GOES_ON: f64 = 0.6;
/// Least part of the sections of an arm that must show the stripe.
const LEAST_PRESENT: f64 = 0.3;

/// A move of the line at the corner after which it is measured again, px, and how often.
const SETTLED_PX: f64 = 0.3;
const MOST_REPEATS: usize = 3;

/// Two segments that may form a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The segments, by number.
    pub segments: [usize; 2],
    /// Their lines, each from the corner outward; the point is the corner.
    pub arms: [Line2; 2],
    /// How far each reaches, px.
    pub lengths: [f64; 2],
    /// Length of each that edgels cover, px.
    pub covered_px: [f64; 2],
    /// Weight of the edgels on each.
    pub weights: [f64; 2],
    /// Weight of edgels that lie where a corner has nothing.
    pub against: f64,
}

impl Pair {
    /// Evidence for this corner.
    #[must_use]
    pub fn score(&self) -> f64 {
        self.weights[0] + self.weights[1] - 2.0 * self.against
    }

    /// The corner.
    #[must_use]
    pub fn corner(&self) -> Vector2<f64> {
        self.arms[0].point
    }

    /// Whether the arms come towards the camera from the corner: a valley, not a ridge.
    #[must_use]
    pub fn is_valley(&self, lens: &Lens) -> bool {
        let sheet = |ideal: &Vector2<f64>| lens.on_sheet(ideal).map(|(point, _)| point);
        let ends = [0, 1].map(|k| sheet(&self.arms[k].at(self.lengths[k].min(200.0))));
        let (Some(corner), [Some(a), Some(b)]) = (sheet(&self.corner()), ends) else { return false };
        ((a - corner).normalize() + (b - corner).normalize()).dot(&lens.away()) < 0.0
    }
}

/// All pairs of segments that meet in the picture.
pub fn pairs<'a>(segments: &'a [LineSegment], lens: &'a Lens) -> impl Iterator<Item = Pair> + 'a {
    let numbers =
        (0..segments.len()).flat_map(|first| (first + 1..segments.len()).map(move |second| [first, second]));
    numbers.filter_map(|numbers| pair(segments, numbers, lens))
}

fn pair(segments: &[LineSegment], numbers: [usize; 2], lens: &Lens) -> Option<Pair> {
    let [a, b] = numbers.map(|number| &segments[number]);
    if a.line.along.perp(&b.line.along).abs() < FLATTEST.sin() {
        return None;
    }
    let corner = a.line.cross(&b.line)?;
    let [width, height] = lens.camera().size.map(f64::from);
    let pixel = lens.distorted(&corner).0;
    if !((0.0..width).contains(&pixel.x) && (0.0..height).contains(&pixel.y)) {
        return None;
    }
    let [first, second] = [arm(a, &corner)?, arm(b, &corner)?];
    if first.gap_px + second.gap_px > BOTH_GAPS_PX {
        return None;
    }
    Some(Pair {
        segments: numbers,
        arms: [first.line, second.line],
        lengths: [first.length, second.length],
        covered_px: [first.covered_px, second.covered_px],
        weights: [first.weight, second.weight],
        against: first.against + second.against,
    })
}

struct Arm {
    line: Line2,
    length: f64,
    covered_px: f64,
    gap_px: f64,
    weight: f64,
    against: f64,
}

/// The part of a segment on one side of a corner; `None` if it begins too far from it.
fn arm(segment: &LineSegment, corner: &Vector2<f64>) -> Option<Arm> {
    let at = segment.line.station(corner);
    let [first, last] = segment.span();
    // Edgels within a window of the corner may belong to either arm.
    let near = TILE as f64;
    let before = segment.weight_between(first - 1.0, at - near);
    let after = segment.weight_between(at + near, last + 1.0);
    let forward = after >= before;
    let along = if forward { segment.line.along } else { -segment.line.along };
    let outward = |s: f64| if forward { s - at } else { at - s };
    let reached = segment.marks.iter().map(|[s, _]| outward(*s)).filter(|s| *s > 0.0);
    let (begin, end) = reached.fold((f64::INFINITY, 0.0_f64), |(begin, end), s| (begin.min(s), end.max(s)));
    let covered_px = if forward { segment.covered_px(at, last) } else { segment.covered_px(first, at) };
    let whole = covered_px >= LEAST_COVERED * end && begin <= near + MOST_GAP_PX.min(MOST_GAP * end);
    whole.then(|| Arm {
        line: Line2 { point: *corner, along },
        // The stripe may end within the last edgel, cut off at a slant.
        length: end,
        covered_px,
        gap_px: begin,
        weight: after.max(before),
        against: after.min(before),
    })
}

/// Measures the corner of a pair.
///
/// # Errors
/// Why there is none, or none that could be relied on.
pub fn measure<L: Level>(
    meter: &mut StripeMeter,
    pair: &Pair,
    sigmas_px: [f64; 2],
    frame: Frame<'_, L>,
) -> Result<Seam, NotFound> {
    let lens = frame.lens;
    let mut arms = pair.arms;
    let mut lengths = pair.lengths;
    let mut templates: [Option<Template>; 2] = [None, None];
    for k in 0..2 {
        let span = [margin(3.0 * sigmas_px[k], &arms), lengths[k]];
        let (line, template) = meter.learn(&arms[k], span, sigmas_px[k], frame).ok_or(NotFound::TooLittle)?;
        arms[k] = line;
        templates[k] = Some(template);
    }
    let [Some(first), Some(second)] = templates else { return Err(NotFound::TooLittle) };
    let templates = [first, second];
    outward(&mut arms, &mut lengths, &pair.arms)?;
    let reach = templates[0].reach_px.max(templates[1].reach_px);
    let from = margin(reach, &arms);
    let mut fits = [None, None];
    for k in 0..2 {
        let span = [from, lengths[k]];
        let mut fit = meter.fit_with(&arms[k], span, &templates[k], frame).ok_or(NotFound::TooLittle)?;
        for _ in 0..MOST_REPEATS {
            if settled(&arms[k], &fit) {
                break;
            }
            outward_again(&mut arms[k], &fit.line);
            fit = meter.fit_with(&arms[k], span, &templates[k], frame).ok_or(NotFound::TooLittle)?;
        }
        if fit.present < LEAST_PRESENT {
            return Err(NotFound::TooLittle);
        }
        fits[k] = Some(meter.without_bent_start(&arms[k], fit));
    }
    let [Some(a), Some(b)] = fits else { return Err(NotFound::TooLittle) };
    let seam = cross(lens, &a, &b)?;
    for (k, fit) in [a, b].iter().enumerate() {
        let usual = UsualStripe { amplitude: fit.amplitude, template: &templates[k] };
        if goes_on(meter, &arms[k], from, &usual, frame) {
            return Err(NotFound::GoesOn);
        }
    }
    Ok(seam)
}

/// Whether a fit has moved its line so little at the corner that to repeat it would change nothing: what is
/// left of a move m is of the order of m² over the stripe's thickness.
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

/// How far from the corner an arm is clean: its own end, the other arm's light and the background beside it.
fn margin(reach_px: f64, arms: &[Line2; 2]) -> f64 {
    let beside = 0.7 * reach_px + 3.0;
    let sine = arms[0].along.perp(&arms[1].along).abs();
    let sharp = arms[0].along.dot(&arms[1].along) > 0.0;
    if sharp { (beside + 4.0) / sine.max(0.1) } else { beside }
}

/// Lets two lines begin at their crossing again, pointing as they did.
fn outward(arms: &mut [Line2; 2], lengths: &mut [f64; 2], before: &[Line2; 2]) -> Result<(), NotFound> {
    let corner = arms[0].cross(&arms[1]).ok_or(NotFound::NotThisJoint)?;
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
    let ideal = a.line.cross(&b.line).ok_or(NotFound::NotThisJoint)?;
    let normals = Matrix2::from_rows(&[a.line.normal().transpose(), b.line.normal().transpose()]);
    let inverse = normals.try_inverse().ok_or(NotFound::NotThisJoint)?;
    let variance = |fit: &Fit| fit.variance_at(fit.line.station(&ideal));
    let errors = Matrix2::from_diagonal(&Vector2::new(variance(a), variance(b)));
    let covariance = inverse * errors * inverse.transpose();
    if !known_well(&covariance) {
        return Err(NotFound::Uncertain);
    }
    Seam::from_ideal(lens, &ideal, &covariance, a.present.min(b.present))
}

/// The stripe as it is on an arm.
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

/// Thickness of the stripe on the two segments, px.
#[must_use]
pub fn sigmas_px(segments: &[LineSegment], pair: &Pair) -> [f64; 2] {
    pair.segments.map(|number| segments[number].sigma_px)
}
