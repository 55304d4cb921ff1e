//! Pairs of segments that may meet in a corner, and why others do not.

use crate::lens::Lens;
use crate::line::Line2;
use crate::locate::line_segment::{LineSegment, SegmentMark, continuous_px};
use crate::locate::tiles::TILE;
use crate::not_found::NotFound;
use nalgebra::Vector2;

/// The flattest bend that makes a corner, rad in the picture.
const FLATTEST: f64 = 0.1;
/// The stripe may be missing this far from the corner on one arm, as a part of its length and in px, and on both
/// together. Beyond that, lines may cross in an empty place.
const MOST_GAP: f64 = 0.5;
const MOST_GAP_PX: f64 = 120.0;
const BOTH_GAPS_PX: f64 = 160.0;
/// Minimum arm length, in stripe widths; in px for thin stripes.
const NEEDED_PX: f64 = 80.0;
const SHOWN_SIGMAS: f64 = 12.5;
/// Distance along an arm at which its side is judged, px.
const SIDE_PX: f64 = 200.0;

/// Least length of a face of a groove, or a riser, that edgels cover, px.
pub(crate) const LEAST_FACE_PX: f64 = 24.0;

/// A weld bead that fills a corner begins and ends this near to the plates, px. Its corner may be further away then.
const MEETS_PX: f64 = 40.0;
const BRIDGED_GAPS_PX: f64 = 600.0;
/// Least part of the way from one plate to the other with straight pieces of a bead: it is round at its toes. They lie
/// beside that way by less than this part of it.
const BRIDGED_PART: f64 = 0.5;
/// The relief slot of a V-block hides at most this much of each face, px, and as a part of its length; of both about as
/// much.
const MOST_SLOT_PX: f64 = 400.0;
const MOST_SLOT: f64 = 1.0;
const SLOT_EVEN: f64 = 2.0;

/// Minimum length of a continuous stretch of stripe for an arm: a multiple of its thickness, and a number of px for a thin stripe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastArm {
    /// Thicknesses (standard deviations across the stripe).
    pub sigmas: f64,
    /// Pixels.
    pub px: f64,
    /// How far from the corner each may begin, px.
    pub most_gap_px: f64,
    /// Part of the arms' evidence that may lie where a corner has nothing.
    pub most_against: f64,
}

impl LeastArm {
    /// In a whole picture, in which much else is to be seen.
    pub const USUAL: Self =
        Self { sigmas: 25.0, px: NEEDED_PX, most_gap_px: f64::INFINITY, most_against: f64::INFINITY };
    /// If the approximate place of the corner is known.
    pub const SHORT: Self = Self { sigmas: 12.5, px: 0.5 * NEEDED_PX, most_gap_px: 24.0, most_against: 0.1 };

    /// The length for a stripe of a thickness, px.
    #[must_use]
    pub fn needed_px(self, sigma_px: f64) -> f64 {
        (self.sigmas * sigma_px).max(self.px)
    }

    /// Whether a continuous stretch is long enough; its ends are known to half a tile each.
    #[must_use]
    pub(crate) fn admits(self, continuous_px: f64, sigma_px: f64) -> bool {
        continuous_px + TILE as f64 >= self.needed_px(sigma_px)
    }
}

/// How long a continuous stretch of stripe usually must be to be an arm, px.
#[must_use]
pub fn needed_px(sigma_px: f64) -> f64 {
    LeastArm::USUAL.needed_px(sigma_px)
}

/// Most that two segments of one stripe differ in brightness and thickness, as factors: a spark across the stripe is
/// brighter, or thicker.
const MOST_CONTRAST: f64 = 4.0;
const MOST_SPREAD: f64 = 2.5;

/// Whether the light on two segments is of one kind.
#[must_use]
pub(crate) fn are_alike(a: &LineSegment, b: &LineSegment) -> bool {
    let within = |a: f64, b: f64, factor: f64| a.max(b) <= factor * a.min(b);
    within(a.brightness, b.brightness, MOST_CONTRAST) && within(a.sigma_px, b.sigma_px, MOST_SPREAD)
}

/// Whether a continuous stretch is as long as is usually needed.
#[must_use]
pub(crate) fn is_long(continuous_px: f64, sigma_px: f64) -> bool {
    LeastArm::USUAL.admits(continuous_px, sigma_px)
}

/// Whether a continuous stretch is long enough to indicate another plate, which is not measured: a brighter stripe is thicker.
#[must_use]
pub(crate) fn shows_plate(continuous_px: f64, sigma_px: f64) -> bool {
    continuous_px + TILE as f64 >= (SHOWN_SIGMAS * sigma_px).max(NEEDED_PX)
}

/// Two segments that may form a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmPair {
    /// The segments, by number.
    pub segments: [usize; 2],
    /// Their lines, each from the corner outward; the point is the corner.
    pub arms: [Line2; 2],
    /// How far each reaches, px.
    pub lengths: [f64; 2],
    /// Length of each without a break from its start, px.
    pub continuous_px: [f64; 2],
    /// Start of each, px from the corner.
    pub gaps_px: [f64; 2],
    /// Thickness of the stripe on each, px.
    pub sigmas_px: [f64; 2],
    /// Weight of the edgels on each.
    pub weights: [f64; 2],
    /// Weight of edgels that lie where a corner has nothing.
    pub against: f64,
}

impl ArmPair {
    /// Evidence for this corner.
    #[must_use]
    pub fn score(&self) -> f64 {
        self.weights[0] + self.weights[1] - 2.0 * self.against
    }

    /// Whether the gap of the stripe at the corner is so large that only the surroundings of its arms can connect them.
    #[must_use]
    pub(crate) fn is_open(&self) -> bool {
        self.gaps_px[0] + self.gaps_px[1] > BOTH_GAPS_PX
    }

    /// The corner.
    #[must_use]
    pub fn corner(&self) -> Vector2<f64> {
        self.arms[0].point
    }

    /// The arm on a segment: 0 or 1.
    #[must_use]
    pub(crate) fn arm_on(&self, segment: usize) -> Option<usize> {
        self.segments.iter().position(|number| *number == segment)
    }

    /// The same for an arm on a face with a near end that must be left out: the next corner's light is there.
    #[must_use]
    pub(crate) fn clear_of_far_end(mut self, face: usize) -> Self {
        let length_px = self.lengths[face];
        self.lengths[face] = (length_px - 3.0 * self.sigmas_px[face] - 4.0).max(0.5 * length_px);
        self
    }

    /// The pair, if both arms are long enough.
    ///
    /// # Errors
    /// [`NotFound::ArmsTooShort`], with the lengths.
    pub fn long(self, least: LeastArm) -> Result<Self, NotFound> {
        self.ends_at_corner(least)?;
        let is_long = |k: usize| least.admits(self.continuous_px[k], self.sigmas_px[k]);
        if is_long(0) && is_long(1) {
            return Ok(self);
        }
        let needed_px = least.needed_px(self.sigmas_px[0].max(self.sigmas_px[1]));
        Err(NotFound::ArmsTooShort { arms_px: self.continuous_px, needed_px })
    }

    fn ends_at_corner(&self, least: LeastArm) -> Result<(), NotFound> {
        if self.gaps_px.iter().any(|gap_px| *gap_px > least.most_gap_px) {
            return Err(NotFound::ArmsApart { gaps_px: self.gaps_px, most_px: 2.0 * least.most_gap_px });
        }
        let crosses = self.against > least.most_against * (self.weights[0] + self.weights[1]);
        if crosses { Err(NotFound::GoesOn) } else { Ok(()) }
    }

    /// The directions of the arms in the sheet, from the corner outward. `None` if they do not meet it.
    #[must_use]
    pub fn in_sheet(&self, lens: &Lens) -> Option<[Vector2<f64>; 2]> {
        let sheet = |ideal: &Vector2<f64>| lens.on_sheet(ideal).map(|(point, _)| point);
        let corner = sheet(&self.corner())?;
        let end = |k: usize| sheet(&self.arms[k].at(self.lengths[k].min(SIDE_PX)));
        Some([(end(0)? - corner).normalize(), (end(1)? - corner).normalize()])
    }

    /// The angle between the arms in the sheet, rad.
    #[must_use]
    pub fn opening_rad(&self, lens: &Lens) -> Option<f64> {
        self.in_sheet(lens).map(|[a, b]| a.angle(&b))
    }

    /// The pair, if its corner lies behind its arms, seen from the camera: a valley; or before them: a ridge.
    ///
    /// # Errors
    /// [`NotFound::WrongSide`].
    pub(crate) fn on_side(self, ridge: bool, lens: &Lens) -> Result<Self, NotFound> {
        let [a, b] = self.in_sheet(lens).ok_or(NotFound::OutOfView)?;
        let arms_away = (a + b).dot(&lens.away()) > 0.0;
        if arms_away == ridge { Ok(self) } else { Err(NotFound::WrongSide { towards_camera: arms_away }) }
    }
}

/// Every pair of segments: their weight together, and the corner they form or why they form none.
pub fn pairs<'a>(
    segments: &'a [LineSegment],
    lens: &'a Lens,
) -> impl Iterator<Item = (f64, Result<ArmPair, NotFound>)> + Clone + 'a {
    pairs_by(segments, lens, may_meet)
}

/// The same for faces that a slot may keep from meeting.
pub(crate) fn pairs_over_slot<'a>(
    segments: &'a [LineSegment],
    lens: &'a Lens,
) -> impl Iterator<Item = (f64, Result<ArmPair, NotFound>)> + Clone + 'a {
    pairs_by(segments, lens, may_meet_over_slot)
}

/// The same for the faces of a groove with a dark root.
pub(crate) fn pairs_over_root<'a>(
    segments: &'a [LineSegment],
    lens: &'a Lens,
) -> impl Iterator<Item = (f64, Result<ArmPair, NotFound>)> + Clone + 'a {
    pairs_by(segments, lens, may_meet_over_root)
}

fn pairs_by<'a>(
    segments: &'a [LineSegment],
    lens: &'a Lens,
    gap_rule: GapRule,
) -> impl Iterator<Item = (f64, Result<ArmPair, NotFound>)> + Clone + 'a {
    numbers(segments.len()).map(move |numbers| {
        let weight = numbers.iter().map(|number| segments[*number].weight()).sum();
        (weight, pair(segments, numbers, lens, gap_rule))
    })
}

fn numbers(segments: usize) -> impl Iterator<Item = [usize; 2]> + Clone {
    (0..segments).flat_map(move |first| (first + 1..segments).map(move |second| [first, second]))
}

/// The reason why there is no corner: that of the heaviest rejected pair.
#[must_use]
pub(crate) fn heaviest_reason(
    results: impl Iterator<Item = (f64, Result<ArmPair, NotFound>)>,
    otherwise: NotFound,
) -> NotFound {
    let reasons = results.filter_map(|(weight, pair)| pair.err().map(|reason| (weight, reason)));
    reasons.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(otherwise, |(_, reason)| reason)
}

/// Whether two arms of given segments belong together, although the stripe is missing between them.
type GapRule = fn(&[LineSegment], [usize; 2], &[Arm; 2]) -> Result<(), NotFound>;

fn pair(
    segments: &[LineSegment],
    numbers: [usize; 2],
    lens: &Lens,
    gap_rule: GapRule,
) -> Result<ArmPair, NotFound> {
    let [a, b] = numbers.map(|number| &segments[number]);
    let sine = bend(a, b);
    let flat = || NotFound::TooFlat { bend_deg: sine.asin().to_degrees(), needed_deg: FLATTEST.to_degrees() };
    if sine < FLATTEST.sin() {
        return Err(flat());
    }
    let corner = a.line.cross(&b.line).ok_or_else(flat)?;
    let [width, height] = lens.camera().size.map(f64::from);
    let pixel = lens.distorted(&corner).0;
    if !((0.0..width).contains(&pixel.x) && (0.0..height).contains(&pixel.y)) {
        return Err(NotFound::OutOfView);
    }
    let arms = [arm(a, &corner), arm(b, &corner)];
    gap_rule(segments, numbers, &arms)?;
    let [first, second] = arms;
    Ok(ArmPair {
        segments: numbers,
        arms: [first.line, second.line],
        lengths: [first.length, second.length],
        continuous_px: [first.continuous_px, second.continuous_px],
        gaps_px: [first.gap_px, second.gap_px],
        sigmas_px: [a.sigma_px, b.sigma_px],
        weights: [first.weight, second.weight],
        against: first.against + second.against,
    })
}

/// Sine of the angle between two segments in the picture.
fn bend(a: &LineSegment, b: &LineSegment) -> f64 {
    a.line.along.perp(&b.line.along).abs()
}

fn may_meet(segments: &[LineSegment], numbers: [usize; 2], arms: &[Arm; 2]) -> Result<(), NotFound> {
    let gaps_px = [arms[0].gap_px, arms[1].gap_px];
    let together_px = gaps_px[0] + gaps_px[1];
    let apart = arms.iter().any(Arm::is_apart) || together_px > BOTH_GAPS_PX;
    if apart && !(together_px < BRIDGED_GAPS_PX && is_bridged(segments, numbers, arms)) {
        return Err(NotFound::ArmsApart { gaps_px, most_px: BOTH_GAPS_PX });
    }
    Ok(())
}

fn may_meet_over_root(
    segments: &[LineSegment],
    numbers: [usize; 2],
    arms: &[Arm; 2],
) -> Result<(), NotFound> {
    let hidden = |arm: &Arm| arm.gap_px > TILE as f64 + MOST_GAP * arm.length;
    if arms.iter().any(hidden) { may_meet(segments, numbers, arms) } else { Ok(()) }
}

fn may_meet_over_slot(
    segments: &[LineSegment],
    numbers: [usize; 2],
    arms: &[Arm; 2],
) -> Result<(), NotFound> {
    let gaps_px = [arms[0].gap_px, arms[1].gap_px];
    let hidden = |arm: &Arm| arm.gap_px > MOST_SLOT_PX.min(MOST_SLOT * arm.continuous_px);
    let tile = TILE as f64;
    let uneven = gaps_px[0].max(gaps_px[1]) > SLOT_EVEN * gaps_px[0].min(gaps_px[1]) + 2.0 * tile;
    // A lit piece between the faces is a root, or a bead.
    if arms.iter().any(hidden) || uneven || is_bridged(segments, numbers, arms) {
        return Err(NotFound::ArmsApart { gaps_px, most_px: 2.0 * MOST_SLOT_PX });
    }
    Ok(())
}

/// Whether a piece can fill a corner of a plate: it meets it at an angle. A face along the plate is a face of its own.
fn meets(plate: &LineSegment, piece: &LineSegment) -> bool {
    bend(plate, piece) > FLATTEST.sin()
}

/// Whether other segments lead from the start of one arm to that of the other: a bead, or a chamfer, over the corner.
fn is_bridged(segments: &[LineSegment], numbers: [usize; 2], arms: &[Arm; 2]) -> bool {
    let others = segments.iter().enumerate().filter(|(number, _)| !numbers.contains(number));
    let others = others.filter(|(_, other)| numbers.iter().all(|plate| meets(&segments[*plate], other)));
    let ends = others.map(|(_, other)| other.span().map(|s| other.line.at(s)));
    let begins = [0, 1].map(|k| arms[k].line.at(arms[k].gap_px));
    let begins_there =
        |begin: &Vector2<f64>| ends.clone().flatten().any(|end| (end - begin).norm() < MEETS_PX);
    begins.iter().all(begins_there) || covers_way(begins, ends)
}

/// Whether pieces between two points cover most of the way from the one to the other.
pub(crate) fn covers_way(
    [from, to]: [Vector2<f64>; 2],
    pieces: impl Iterator<Item = [Vector2<f64>; 2]>,
) -> bool {
    let length_px = (to - from).norm();
    let way = Line2 { point: from, along: (to - from) / length_px };
    let covered_px = pieces.map(|ends| {
        let is_near = ends.iter().all(|end| way.distance(end).abs() < BRIDGED_PART * length_px);
        let [a, b] = ends.map(|end| way.station(&end).clamp(0.0, length_px));
        if is_near { (b - a).abs() } else { 0.0 }
    });
    covered_px.sum::<f64>() > BRIDGED_PART * length_px
}

/// Whether an arm of a corner is part of a path from its other arm to a heavier one. Then the corner is the toe of a bead
/// over the intended corner. Returns why the intended one is missing.
#[must_use]
pub(crate) fn toe(
    segments: &[LineSegment],
    corner: &ArmPair,
    least: LeastArm,
    lens: &Lens,
) -> Option<NotFound> {
    let pairs = [[0, 1], [1, 0]].map(|order| order.map(|k| corner.segments[k]));
    pairs.into_iter().find_map(|[plate, piece]| {
        let heavier = |other: &usize| segments[*other].weight() > segments[piece].weight();
        let others = (0..segments.len()).filter(|other| !corner.segments.contains(other)).filter(heavier);
        let others = others.filter(|other| meets(&segments[*other], &segments[piece]));
        others.into_iter().find_map(|other| {
            let whole = pair(segments, [plate, other], lens, |_, _, _| Ok(()))
                .and_then(|pair| pair.long(least))
                .ok()?;
            let begins = [0, 1].map(|k| whole.arms[k].at(whole.gaps_px[k]));
            let ends = segments[piece].span().map(|s| segments[piece].line.at(s));
            let leads = whole.score() > corner.score() && is_on_way(begins, ends);
            leads.then_some(NotFound::ArmsApart { gaps_px: whole.gaps_px, most_px: BOTH_GAPS_PX })
        })
    })
}

/// Whether a piece lies between two points.
fn is_on_way([from, to]: [Vector2<f64>; 2], piece: [Vector2<f64>; 2]) -> bool {
    let length_px = (to - from).norm();
    let way = Line2 { point: from, along: (to - from) / length_px };
    piece.iter().all(|end| {
        let beside = way.distance(end).abs() < BRIDGED_PART * length_px;
        beside && (-MEETS_PX..length_px + MEETS_PX).contains(&way.station(end))
    })
}

struct Arm {
    line: Line2,
    length: f64,
    continuous_px: f64,
    gap_px: f64,
    weight: f64,
    against: f64,
}

impl Arm {
    /// Whether it begins too far from the corner to belong to it.
    fn is_apart(&self) -> bool {
        self.gap_px > TILE as f64 + MOST_GAP_PX.min(MOST_GAP * self.length)
    }
}

/// The part of a segment on one side of a corner.
fn arm(segment: &LineSegment, corner: &Vector2<f64>) -> Arm {
    let at = segment.line.station(corner);
    let [first, last] = segment.span();
    // Edgels within a window of the corner may belong to either arm.
    let near = TILE as f64;
    let before = segment.weight_between(first - 1.0, at - near);
    let after = segment.weight_between(at + near, last + 1.0);
    let forward = after >= before;
    let along = if forward { segment.line.along } else { -segment.line.along };
    let outward = |mark: &SegmentMark| if forward { mark.s - at } else { at - mark.s };
    let reached = segment.marks.iter().map(outward).filter(|s| *s > 0.0);
    let (begin, end) = reached.fold((f64::INFINITY, 0.0_f64), |(begin, end), s| (begin.min(s), end.max(s)));
    let continuous_px = if forward {
        continuous_px(segment.marks.iter().map(outward))
    } else {
        continuous_px(segment.marks.iter().rev().map(outward))
    };
    Arm {
        line: Line2 { point: *corner, along },
        // The stripe may end within the last edgel, cut off at a slant.
        length: end,
        continuous_px,
        gap_px: begin,
        weight: after.max(before),
        against: after.min(before),
    }
}
