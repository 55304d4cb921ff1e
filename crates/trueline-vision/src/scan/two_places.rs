//! Two rival places of the seam within one scan, noticed over the scan.
//!
//! A bead has two toes, a stripe two ends. If the detector takes one in this picture and the other in the next, each picture
//! looks sound. No point is far from the place by its neighbours, for they alternate as well. But the points lie on two
//! smooth tracks then, beside each other and entered in turn.

use crate::measure::regression::median;
use crate::not_found::NotFound;
use crate::scan::neighbours::{InOrder, places};
use nalgebra::{Matrix3, Vector2, Vector3};

/// Points in one window, and the step from one window to the next.
const WINDOW: usize = 12;
const STEP: usize = 6;
/// Points of the first track, of the second, the points of both together, and changes from one to the other, at least.
const FEWEST: [usize; 2] = [5, 2];
const EXPLAINED: usize = 10;
const CHANGES: usize = 2;
/// Largest distance of a point from its track, px; from the second one, a part of its distance as well, for it
/// changes.
const ON_TRACK_PX: f64 = 4.0;
const CHANGE: f64 = 0.1;
/// The least distance of two tracks, px, and how much it may differ over the scan, as a part of it.
const LEAST_APART_PX: f64 = 12.0;
const DIFFERS: f64 = 0.4;
/// Part of the windows in which two tracks must be seen, and how many at least.
const PART: f64 = 0.15;
const LEAST_WINDOWS: usize = 3;
/// A track with this multiple of the other's points is the right one.
const PREFERRED: usize = 3;

/// Refuses the points of the less frequented of two tracks, or of both if neither is preferred. Returns the distance of
/// the tracks, px; `None` if there is one track, or none.
pub fn refuse_second_place(scan: &mut InOrder<'_>) -> Option<f64> {
    let points = places(scan, |found| Some(found.seam.pixel));
    let windows = points.windows(WINDOW).step_by(STEP);
    let needed = LEAST_WINDOWS.max((PART * windows.len() as f64).ceil() as usize);
    let splits: Vec<(usize, Split)> = windows
        .enumerate()
        .filter_map(|(number, window)| Some((number * STEP, two_tracks(window)?)))
        .collect();
    let typical = typical_offset(&splits)?;
    let distance_px = typical.norm();
    let mut votes = vec![[0_usize; 2]; points.len()];
    let mut seen = 0;
    for (first, split) in &splits {
        // The same side everywhere, whichever of the tracks had more points in a window.
        let turned = usize::from(split.apart.dot(&typical) < 0.0);
        let apart = if turned == 1 { -split.apart } else { split.apart };
        if (apart - typical).norm() > DIFFERS * distance_px {
            continue;
        }
        seen += 1;
        for (votes, track) in votes[*first..].iter_mut().zip(split.tracks) {
            if let Some(track) = track {
                votes[track ^ turned] += 1;
            }
        }
    }
    if seen < needed {
        return None;
    }
    for (number, _, _) in points.iter().zip(wrong(&votes)).filter(|(_, wrong)| *wrong).map(|(point, _)| point)
    {
        *scan[*number].1 = Err(NotFound::TwoPlaces { distance_px });
    }
    Some(distance_px)
}

/// From one track to the other, px: the median of the windows. `None` without any.
fn typical_offset(splits: &[(usize, Split)]) -> Option<Vector2<f64>> {
    let first = splits.first()?.1.apart;
    let mut sides = [0, 1].map(|axis| {
        let aligned = splits.iter().map(|(_, split)| split.apart[axis] * split.apart.dot(&first).signum());
        aligned.collect::<Vec<f64>>()
    });
    Some(Vector2::new(median(&mut sides[0]), median(&mut sides[1])))
}

/// The refused points: those of the track with far fewer, or all on either.
fn wrong(votes: &[[usize; 2]]) -> impl Iterator<Item = bool> + use<'_> {
    let on = |side: usize| votes.iter().filter(|votes| votes[side] > votes[1 - side]).count();
    let [a, b] = [on(0), on(1)];
    votes.iter().map(move |votes| {
        if a >= PREFERRED * b {
            votes[1] > votes[0]
        } else if b >= PREFERRED * a {
            votes[0] > votes[1]
        } else {
            votes[0] + votes[1] > 0
        }
    })
}

/// The points of a window on two tracks.
struct Split {
    /// From the first track to the second, px.
    apart: Vector2<f64>,
    /// The track of each point, if it is on one.
    tracks: [Option<usize>; WINDOW],
}

fn two_tracks(window: &[(usize, f64, Vector2<f64>)]) -> Option<Split> {
    let [begin, end] = [window.first()?.1, window.last()?.1];
    let (middle_s, half_s) = (0.5 * (begin + end), 0.5 * (end - begin).max(1e-9));
    let points: Vec<(f64, Vector2<f64>)> =
        window.iter().map(|(_, time_s, at)| ((time_s - middle_s) / half_s, *at)).collect();
    let track = best_track(&points)?;
    let off: Vec<Vector2<f64>> = points.iter().map(|(t, at)| at - track.at(*t)).collect();
    let others = || off.iter().filter(|off| off.norm() > LEAST_APART_PX);
    let beside =
        |apart: &Vector2<f64>, off: &Vector2<f64>| (off - apart).norm() < ON_TRACK_PX + CHANGE * apart.norm();
    // The offset that most of the others share.
    let shared = |apart: &&Vector2<f64>| others().filter(|off| beside(apart, off)).count();
    let apart = *others().max_by_key(shared)?;
    let mut tracks = [None; WINDOW];
    for (place, off) in tracks.iter_mut().zip(&off) {
        *place = if off.norm() < ON_TRACK_PX { Some(0) } else { beside(&apart, off).then_some(1) };
    }
    let on = |number: usize| tracks.iter().filter(|track| **track == Some(number)).count();
    let order: Vec<usize> = tracks.iter().flatten().copied().collect();
    let changes = order.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let plausible =
        on(0) >= FEWEST[0] && on(1) >= FEWEST[1] && order.len() >= EXPLAINED && changes >= CHANGES;
    plausible.then_some(Split { apart, tracks })
}

/// A parabola over time in each coordinate; time runs from −1 to 1.
struct Track([Vector3<f64>; 2]);

impl Track {
    fn through(points: [&(f64, Vector2<f64>); 3]) -> Option<Self> {
        let rows = points.map(|(t, _)| Vector3::new(1.0, *t, t * t).transpose());
        let inverse = Matrix3::from_rows(&rows).try_inverse()?;
        Some(Self([0, 1].map(|axis| inverse * Vector3::from(points.map(|(_, at)| at[axis])))))
    }

    fn at(&self, t: f64) -> Vector2<f64> {
        let row = Vector3::new(1.0, t, t * t);
        Vector2::new(self.0[0].dot(&row), self.0[1].dot(&row))
    }

    fn holds(&self, (t, at): &(f64, Vector2<f64>)) -> bool {
        (self.at(*t) - at).norm() < ON_TRACK_PX
    }
}

/// The track through three of the points that holds most of them.
fn best_track(points: &[(f64, Vector2<f64>)]) -> Option<Track> {
    let mut best: Option<(usize, Track)> = None;
    for (i, a) in points.iter().enumerate() {
        for (j, b) in points.iter().enumerate().skip(i + 1) {
            for c in &points[j + 1..] {
                let Some(track) = Track::through([a, b, c]) else { continue };
                let held = points.iter().filter(|point| track.holds(point)).count();
                if best.as_ref().is_none_or(|(most, _)| held > *most) {
                    best = Some((held, track));
                }
            }
        }
    }
    best.map(|(_, track)| track)
}
