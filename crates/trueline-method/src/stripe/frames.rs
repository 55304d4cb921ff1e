//! Recording → measurements of a joint in each frame: support points of its plates' stripes, or its seam point.

use crate::assess::residuals::why_not_placed;
use crate::config::{Config, Measurements};
use crate::error::Error;
use crate::input::observations::{Observation, Observations};
use crate::input::skip::Skip;
use nalgebra::{Matrix2, Vector2};
use std::collections::BTreeMap;
use trueline_dataset::picture_rows::PicturesOfRows;
use trueline_dataset::{Measured, PlateStripe, Recording, Sensor};
use trueline_model::SupportPair;

/// One support point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support {
    /// Reported position, sheet coordinates, m.
    pub reported: Vector2<f64>,
    /// Its depth in the camera frame, m. 1 for sensors that report lengths.
    pub depth_m: f64,
    /// Standard deviation perpendicular to the stripe, in the sheet, m.
    pub sigma_m: f64,
    /// Size of a pixel in the sheet, m, along the image's rows and across them. For sensors that report lengths, the equivalent of their noise.
    pub sheet_per_px: Matrix2<f64>,
}

/// Both support points of a stripe as reported.
#[must_use]
pub fn reported([first, second]: &[Support; 2]) -> SupportPair {
    let reported = [first.reported, second.reported];
    SupportPair { reported, depth_ratio: second.depth_m / first.depth_m }
}

/// A seam point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamSight {
    /// Index of its observation.
    pub observation: usize,
    /// Reported position, sheet coordinates, m.
    pub reported: Vector2<f64>,
    /// Its covariance there, m².
    pub covariance: Matrix2<f64>,
    /// As for [`Support`].
    pub sheet_per_px: Matrix2<f64>,
}

/// The measurements of a joint that are used in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sight {
    /// The stripes on its plates; at least one of them.
    Stripes([Option<[Support; 2]>; 2]),
    /// Its seam point.
    Seam(SeamSight),
}

/// A joint in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripeFrame {
    /// Time since the start of the recording, s, on the time base of the seam points.
    pub stamp_s: f64,
    /// Its joint.
    pub joint: usize,
    /// Its measurements.
    pub sight: Sight,
    /// Its seam point beside the stripes. If the plates do not meet it is a point of the edge.
    pub edge: Option<SeamSight>,
    /// The unit vector in the sheet along which the edge point is used. Errors that move the point across its stripe do not move it along this
    /// vector. The point's height comes from the same light as the stripe. On a bowed plate the height deviates from the straight line on which the
    /// end is measured.
    pub edge_axis: Vector2<f64>,
}

impl StripeFrame {
    /// Number of its stripes.
    #[must_use]
    pub(crate) fn stripes(&self) -> usize {
        match &self.sight {
            Sight::Stripes(stripes) => stripes.iter().flatten().count(),
            Sight::Seam(_) => 0,
        }
    }
}

/// The frames of a scan, with counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StripeFrames {
    /// By rising stamp.
    pub list: Vec<StripeFrame>,
    /// Frames with a seam point or a stripe.
    pub total: usize,
    /// Frames with the stripes of both plates. For a joint with one visible plate, frames with that plate and the seam point.
    pub with_both: usize,
    /// Joints without visible plates, for which the seam points are used.
    pub without_plates: Vec<usize>,
    /// Stripes that could not be used.
    pub skipped: BTreeMap<Skip, usize>,
    /// Largest delay of the stripes' stamps relative to the seam point of the same image, s.
    pub stamped_later_s: f64,
}

/// Minimum stripes of a plate. Three support points define a plane.
const LEAST_STRIPES: usize = 2;
/// Minimum fraction of a joint's frames that show a plate. Two false stripes define a plane, but no plate.
const LEAST_PART: f64 = 0.1;

/// Collects the measurements of each joint.
///
/// Each image is used once: the seam point of a fillet *is* the intersection of two stripes, so both together would count it twice. Where both
/// stripes are visible, they are used. With [`Measurements::Both`] a frame without both stripes gives its seam point. So does every frame of a joint
/// without visible plates.
///
/// # Errors
/// [`Error::PicturesDisagree`].
pub fn frames(
    recording: &Recording,
    observations: &Observations,
    wanted: Measurements,
    config: &Config,
) -> Result<StripeFrames, Error> {
    let length_per_px_m = config.length_per_px_m();
    let (pictures, stamps) = (PicturesOfRows::of(recording)?, Stamps::of(recording, observations));
    let mut seen: BTreeMap<(i64, usize), Seen> = BTreeMap::new();
    let (mut skipped, mut stamped_later_s) = (BTreeMap::new(), 0.0_f64);
    for stripe in &recording.stripes {
        let (joint, plate) = (stripe.plate as usize / 2, stripe.plate as usize % 2);
        let seen = seen.entry((pictures.of_stripe(stripe), joint)).or_default();
        match lifted(recording, observations, stripe, length_per_px_m) {
            Ok(supports) => seen.stripes[plate] = Some(supports),
            Err(why) => *skipped.entry(why).or_insert(0) += 1,
        }
        seen.stamp_ns = stripe.stamp_ns;
    }
    for (index, o) in observations.list.iter().enumerate() {
        let feature = &recording.features[o.row as usize];
        let seen = seen.entry((pictures.of_feature(feature), o.line as usize)).or_default();
        let later_s = seen.stripes_later_s(feature.stamp_ns);
        if later_s.abs() > stamped_later_s.abs() {
            stamped_later_s = later_s;
        }
        (seen.seam, seen.stamp_ns) = (Some(seam_sight(observations, index)), feature.stamp_ns);
    }
    let plates = plates_of_joints(&mut seen, observations.line_count, &mut skipped);
    let without_plates =
        if wanted == Measurements::Both { joints_without_plates(&plates) } else { Vec::new() };
    let mut frames = StripeFrames {
        total: seen.len(),
        without_plates,
        skipped,
        stamped_later_s,
        ..StripeFrames::default()
    };
    for ((_, joint), seen) in seen {
        let all = seen.has_all(plates.get(joint).unwrap_or(&[true; 2]));
        frames.with_both += usize::from(all);
        let sight = if frames.without_plates.contains(&joint) {
            seen.seam.map(Sight::Seam)
        } else {
            seen.sight(wanted, all)
        };
        let (edge, edge_axis) = (seen.seam, seen.edge_axis(&recording.sensor));
        let stamp_s = stamps.seconds(seen.stamp_ns);
        frames.list.extend(sight.map(|sight| StripeFrame { stamp_s, joint, sight, edge, edge_axis }));
    }
    frames.list.sort_by(|a, b| a.stamp_s.total_cmp(&b.stamp_s));
    Ok(frames)
}

/// The plates of each joint: those visible in a sufficient fraction of its frames. Stripes of other plates are dropped and counted.
fn plates_of_joints(
    seen: &mut BTreeMap<(i64, usize), Seen>,
    joints: usize,
    skipped: &mut BTreeMap<Skip, usize>,
) -> Vec<[bool; 2]> {
    let mut counts = vec![([0; 2], 0); joints];
    for ((_, joint), seen) in seen.iter() {
        let Some((counts, frames)) = counts.get_mut(*joint) else { continue };
        *frames += 1;
        counts
            .iter_mut()
            .zip(&seen.stripes)
            .for_each(|(count, stripe)| *count += usize::from(stripe.is_some()));
    }
    let is_seen =
        |count: usize, frames: usize| count >= LEAST_STRIPES && count as f64 >= LEAST_PART * frames as f64;
    let plates: Vec<[bool; 2]> =
        counts.iter().map(|(of, frames)| of.map(|count| is_seen(count, *frames))).collect();
    for ((_, joint), seen) in seen.iter_mut() {
        let Some(plates) = plates.get(*joint) else { continue };
        let lone = seen.stripes.iter_mut().zip(plates).filter(|(_, has)| !**has);
        let left_out = lone.filter_map(|(stripe, _)| stripe.take()).count();
        if left_out > 0 {
            *skipped.entry(Skip::RarePlate).or_insert(0) += left_out;
        }
    }
    plates
}

/// The joints without a visible plate.
fn joints_without_plates(plates: &[[bool; 2]]) -> Vec<usize> {
    (0..plates.len()).filter(|&joint| plates[joint] == [false; 2]).collect()
}

/// The measurements of a joint in one image.
#[derive(Default)]
struct Seen {
    stripes: [Option<[Support; 2]>; 2],
    seam: Option<SeamSight>,
    /// Stamp of the image: that of the seam point if there is one.
    stamp_ns: i64,
}

impl Seen {
    /// Delay of its stripes' stamps relative to its seam point, s. 0 without stripes.
    fn stripes_later_s(&self, seam_ns: i64) -> f64 {
        let has_stripes = self.stripes.iter().any(Option::is_some);
        if has_stripes { (self.stamp_ns - seam_ns) as f64 * 1e-9 } else { 0.0 }
    }

    /// Whether it has all measurements of the joint. A single plate needs its edge too.
    fn has_all(&self, plates: &[bool; 2]) -> bool {
        let stripes = self.stripes.iter().zip(plates).all(|(stripe, has)| stripe.is_some() == *has);
        stripes && plates.contains(&true) && (plates == &[true; 2] || self.seam.is_some())
    }

    /// [`edge_axis`] of an image. The stripes of two plates with an edge are parallel to within 6°.
    fn edge_axis(&self, sensor: &Sensor) -> Vector2<f64> {
        let Some([first, second]) = self.stripes.iter().flatten().next() else { return Vector2::x() };
        edge_axis(sensor, &first.sheet_per_px, &(second.reported - first.reported))
    }

    fn sight(&self, wanted: Measurements, all: bool) -> Option<Sight> {
        if let Some(seam) = self.seam.filter(|_| wanted == Measurements::Both && !all) {
            return Some(Sight::Seam(seam));
        }
        self.stripes.iter().any(Option::is_some).then_some(Sight::Stripes(self.stripes))
    }
}

/// The unit vector in the sheet along which an edge point is used, for a stripe along `chord`. The point's height comes from a line through the end
/// of its stripe. Profiles give it at the end's x, images perpendicular to the stripe.
#[must_use]
pub fn edge_axis(sensor: &Sensor, sheet_per_px: &Matrix2<f64>, chord: &Vector2<f64>) -> Vector2<f64> {
    let across = match sensor {
        Sensor::Profiler => Vector2::y(),
        _ => {
            let in_picture = sheet_per_px.try_inverse().unwrap_or_else(Matrix2::identity) * chord;
            sheet_per_px * Vector2::new(-in_picture.y, in_picture.x)
        }
    };
    Vector2::new(across.y, -across.x).normalize()
}

fn seam_sight(observations: &Observations, observation: usize) -> SeamSight {
    let o = &observations.list[observation];
    let [xx, xy, yy] = o.covariance;
    SeamSight {
        observation,
        reported: observations.sheet.coordinates(&o.point_in_camera),
        covariance: Matrix2::new(xx, xy, xy, yy),
        sheet_per_px: o.sheet_per_px(),
    }
}

impl StripeFrames {
    /// Stripes that lie outside the picture or do not meet the laser plane.
    #[must_use]
    pub(crate) fn unplaced(&self) -> usize {
        [Skip::NoRay, Skip::NoIntersection].iter().filter_map(|why| self.skipped.get(why)).sum()
    }

    /// Unused stripes: those that could not be lifted to the sheet, and those of frames whose robot pose is unknown at a time offset.
    #[must_use]
    pub fn skipped_at(&self, observations: &Observations, time_offset_s: f64) -> BTreeMap<Skip, usize> {
        let mut skipped = self.skipped.clone();
        for frame in &self.list {
            let exposure_s = frame.stamp_s - time_offset_s;
            if let Sight::Stripes(stripes) = &frame.sight
                && observations.robot.trajectory.segment_at(exposure_s).is_none()
            {
                let why = why_not_placed(observations, exposure_s);
                *skipped.entry(why).or_insert(0) += stripes.iter().flatten().count();
            }
        }
        skipped
    }
}

/// A stripe's support points on the sheet, or the reason that there are none.
fn lifted(
    recording: &Recording,
    observations: &Observations,
    stripe: &PlateStripe,
    length_per_px_m: f64,
) -> Result<[Support; 2], Skip> {
    let [first, second] = stripe.points.map(|point| on_sheet(recording, observations, point));
    let (first, second) = (first?, second?);
    let chord = second.0 - first.0;
    let normal = Vector2::new(-chord.y, chord.x).try_normalize(0.0).ok_or(Skip::NoIntersection)?;
    let support = |(reported, slope): (Vector2<f64>, Matrix2<f64>)| Support {
        reported,
        depth_m: match stripe.points[0] {
            Measured::Pixel(_) => observations.sheet.point(&reported).z,
            _ => 1.0,
        },
        // The error is perpendicular to the stripe in sensor units. D maps it to the sheet.
        sigma_m: (slope.transpose() * normal).norm() * stripe.sigma,
        sheet_per_px: match stripe.points[0] {
            Measured::Pixel(_) => slope,
            _ => Matrix2::identity() * length_per_px_m,
        },
    };
    let supports = [support(first), support(second)];
    let is_weighed = supports.iter().all(|s| s.sigma_m > 0.0 && s.sigma_m.is_finite());
    is_weighed.then_some(supports).ok_or(Skip::NoIntersection)
}

/// A measured point in the sheet, corrected by a known shape, with its Jacobian by the measurement (px or m).
fn on_sheet(
    recording: &Recording,
    observations: &Observations,
    measured: Measured,
) -> Result<(Vector2<f64>, Matrix2<f64>), Skip> {
    let sheet = &observations.sheet;
    let (at, slope) = match (measured, &recording.sensor) {
        (Measured::Pixel(pixel), Sensor::CameraLaser { camera, .. }) => {
            let (ray, d_ray) = camera.ray(&Vector2::from(pixel)).map_err(|_| Skip::NoRay)?;
            let (point, d_point) = sheet.intersect(&ray).ok_or(Skip::NoIntersection)?;
            (sheet.coordinates(&point), sheet.axes().transpose() * d_point * d_ray)
        }
        (Measured::Profile(point), Sensor::Profiler) => (Vector2::from(point), Matrix2::identity()),
        (Measured::Point(point), Sensor::Points { .. }) => {
            (sheet.coordinates(&point.into()), Matrix2::identity())
        }
        _ => return Err(Skip::NoIntersection),
    };
    Ok(recording.setup.shape.as_ref().map_or((at, slope), |shape| {
        let (there, by_reported) = shape.corrected(&at);
        (there, by_reported * slope)
    }))
}

/// Converts the stamps of frames to the time base of the seam points.
struct Stamps {
    /// Recorded stamp (ns) and stamp used (s), rising.
    known: Vec<(i64, f64)>,
    /// Frame interval if image times come from a frame counter, s.
    tick_s: Option<f64>,
}

impl Stamps {
    fn of(recording: &Recording, observations: &Observations) -> Self {
        let stamp = |o: &Observation| (recording.features[o.row as usize].stamp_ns, o.stamp_s);
        let mut known: Vec<(i64, f64)> = observations.list.iter().map(stamp).collect();
        known.dedup_by_key(|(stamp_ns, _)| *stamp_ns);
        Self { known, tick_s: observations.image_tick_s }
    }

    /// The stamp of a frame, s. A frame without a seam point is interpolated between its neighbours. If these have the stamps of an even clock, it
    /// gets the nearest tick.
    fn seconds(&self, stamp_ns: i64) -> f64 {
        let next = self.known.partition_point(|(known_ns, _)| *known_ns < stamp_ns);
        match (next.checked_sub(1).and_then(|last| self.known.get(last)), self.known.get(next)) {
            (_, Some((known_ns, used_s))) if *known_ns == stamp_ns => *used_s,
            (Some((before_ns, before_s)), Some((after_ns, after_s))) => {
                let whole_s = self.elapsed_s(*before_ns, *after_ns);
                // Stamps with jitter above half a tick may get the same tick.
                let part = if whole_s > 0.0 { self.elapsed_s(*before_ns, stamp_ns) / whole_s } else { 0.0 };
                before_s + part * (after_s - before_s)
            }
            (Some((ns, used_s)), None) | (None, Some((ns, used_s))) => used_s + self.elapsed_s(*ns, stamp_ns),
            (None, None) => 0.0,
        }
    }

    /// Time between two recorded stamps, s. In whole ticks if the clock is even.
    fn elapsed_s(&self, from_ns: i64, to_ns: i64) -> f64 {
        let elapsed_s = (to_ns - from_ns) as f64 * 1e-9;
        self.tick_s.map_or(elapsed_s, |tick_s| (elapsed_s / tick_s).round() * tick_s)
    }
}
