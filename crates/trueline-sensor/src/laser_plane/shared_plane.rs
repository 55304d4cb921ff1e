//! The plane shared by the stripes of most boards, found without trusting any of them. On the others a wrong line was found,
//! and of several bright lines in a picture one is the laser's.
//!
//! A plane through one line of each of two pictures predicts a stripe in all others: the plane with the most light there is
//! the laser's. Lines printed on the board move with it. Lines fixed before the camera lie in planes through its centre,
//! where no depth could be measured.

use crate::board::Board;
use crate::bundle_state::BoardState;
use crate::error::Error;
use crate::laser_plane::seen_boards::SeenBoards;
use crate::laser_plane::striped_picture::BoardPicture;
use crate::laser_plane::striped_view::StripedView;
use crate::stripe_residual::Sheet;
use nalgebra::{Vector2, Vector3};
use trueline_geometry::statistics::median;
use trueline_geometry::{Plane, Pose, fit};
use trueline_model::Camera;

/// A stripe farther off the plane than this many times the typical distance is rejected.
pub(crate) const GROSS: f64 = 10.0;

/// Stripes this near a plane are on it, px.
pub(crate) const NEAR_PX: f64 = 0.1;

/// A line at this distance from the plane's prediction has half the weight of an exact one, px: bent sheets move a stripe by
/// some px.
pub(crate) const HALF_PX: f64 = 3.0;

/// Lines of a picture for trial planes: those with the most light.
const TRIED: usize = 6;

/// Sampled points of a line.
const LOOKED_AT: usize = 12;

/// The least angle between the laser plane and the camera's rays, rad: sensors have 15° and more, and bodies fixed before
/// the camera zero.
const LEAST_ANGLE_RAD: f64 = 0.03;

/// A bright line in a picture of a board.
struct Line {
    /// Rays of some of its pixels, at depth one.
    rays: Vec<Vector3<f64>>,
    /// Their crossings with the sheet, in the camera frame, m.
    points: Vec<Vector3<f64>>,
    /// Its light, as a part of that of the clearest line of its picture.
    weight: f64,
}

/// The lines of a picture, and its board.
struct Lines {
    board: Pose,
    lines: Vec<Line>,
}

/// A plane, and how far the best line of each picture lies from it.
struct Found {
    plane: Plane,
    evidence: f64,
    off_px: Vec<f64>,
}

/// The plane of most stripes, and which of them lie near it.
///
/// # Errors
/// Stripes that all lie on one line.
pub(crate) fn of_most(
    camera: &Camera,
    board: &Board,
    seen: &SeenBoards,
    views: &[&StripedView],
) -> Result<(Vec<usize>, Plane), Error> {
    let sheet = Sheet { board, shape: &seen.sheet };
    let of_view = |(view, state): (&&StripedView, &BoardState)| {
        let pose = state.camera_from_board;
        let line = Line::of(camera, sheet, &pose, (&view.stripe, 1.0));
        Lines { board: pose, lines: line.into_iter().collect() }
    };
    let lines: Vec<Lines> = views.iter().zip(&seen.boards).map(of_view).collect();
    let found = best(camera, &lines)?;
    let most_px = GROSS * median(found.off_px.iter().copied()).unwrap_or(f64::INFINITY).max(NEAR_PX);
    let near = (0..views.len()).filter(|k| found.off_px[*k] <= most_px);
    Ok((near.collect(), found.plane))
}

/// The plane of the pieces of most pictures.
///
/// # Errors
/// Pieces that all lie on one line.
pub(crate) fn of_pieces(
    camera: &Camera,
    board: &Board,
    seen: &SeenBoards,
    pictures: &[BoardPicture],
) -> Result<Plane, Error> {
    let sheet = Sheet { board, shape: &seen.sheet };
    let of_picture = |(picture, state): (&BoardPicture, &BoardState)| {
        let pose = state.camera_from_board;
        let light = |k: usize| picture.pieces[k].length_px * picture.pieces[k].contrast;
        let mut order: Vec<usize> = (0..picture.pieces.len()).collect();
        order.sort_by(|a, b| light(*b).total_cmp(&light(*a)));
        let most = order.first().map_or(1.0, |k| light(*k));
        let of_piece =
            |k: &usize| Line::of(camera, sheet, &pose, (&picture.pieces[*k].pixels, light(*k) / most));
        Lines { board: pose, lines: order.iter().filter_map(of_piece).collect() }
    };
    let lines: Vec<Lines> = pictures.iter().zip(&seen.boards).map(of_picture).collect();
    Ok(best(camera, &lines)?.plane)
}

impl Line {
    fn of(
        camera: &Camera,
        sheet: Sheet<'_>,
        pose: &Pose,
        (pixels, weight): (&[Vector2<f64>], f64),
    ) -> Option<Self> {
        let step = pixels.len().div_ceil(LOOKED_AT).max(1);
        let (mut rays, mut points) = (Vec::new(), Vec::new());
        for pixel in pixels.iter().step_by(step).chain(pixels.last()) {
            rays.push(camera.ray(pixel).ok()?.0);
            points.push(sheet.seen(camera, pose, pixel)?);
        }
        (points.len() >= 2).then_some(Self { rays, points, weight })
    }

    /// Root mean square distance from where a plane shows its stripe on the board, px. With the ray r of a point at depth λ and the board's
    /// normal m, the point moves off the plane by λ (n − m (n·r)/(m·r)) for a move of the ray.
    fn off_px(&self, plane: &Plane, board: &Pose, focal_px: f64) -> f64 {
        let (normal, across) = (plane.normal().into_inner(), board.rotation * Vector3::z());
        let off = |(ray, point): (&Vector3<f64>, &Vector3<f64>)| {
            let per_ray = (normal - across * (normal.dot(ray) / across.dot(ray))).xy().norm() * point.z;
            plane.signed_distance(point) * focal_px / per_ray
        };
        let sum: f64 = self.rays.iter().zip(&self.points).map(|at| off(at).powi(2)).sum();
        (sum / self.points.len() as f64).sqrt()
    }
}

/// The plane with the most light at its predicted stripes.
fn best(camera: &Camera, pictures: &[Lines]) -> Result<Found, Error> {
    let tried = |picture: &'_ Lines| picture.lines.len().min(TRIED);
    let mut best: Option<Found> = None;
    for (i, one) in pictures.iter().enumerate() {
        for other in &pictures[..i] {
            for a in &one.lines[..tried(one)] {
                for b in &other.lines[..tried(other)] {
                    let Some(plane) = through(a, b) else { continue };
                    let found = seen_by(camera, plane, pictures);
                    if best.as_ref().is_none_or(|best| found.evidence > best.evidence) {
                        best = Some(found);
                    }
                }
            }
        }
    }
    best.ok_or(Error::OneLine)
}

/// The plane through two lines; `None` if it passes so near the camera's centre that no depth could be measured with it.
fn through(a: &Line, b: &Line) -> Option<Plane> {
    let all = [a.points.as_slice(), &b.points].concat();
    let plane = fit::plane(&all)?.plane;
    let middle = all.iter().sum::<Vector3<f64>>() / all.len() as f64;
    (plane.offset().abs() > LEAST_ANGLE_RAD * middle.norm()).then_some(plane)
}

fn seen_by(camera: &Camera, plane: Plane, pictures: &[Lines]) -> Found {
    let (mut evidence, mut off_px) = (0.0, Vec::with_capacity(pictures.len()));
    for picture in pictures {
        let worth = picture.lines.iter().map(|line| {
            let off_px = line.off_px(&plane, &picture.board, camera.focal.x);
            (line.weight / (1.0 + (off_px / HALF_PX).powi(2)), off_px)
        });
        let (most, off) = worth.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, f64::INFINITY));
        evidence += most;
        off_px.push(off);
    }
    Found { plane, evidence, off_px }
}
