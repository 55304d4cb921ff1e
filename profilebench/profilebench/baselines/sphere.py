"""Hand-eye transform of a profiler from profiles of a sphere of known radius.

Sphere methods of the literature fit a circle to each profile. Two are cited from memory and are not verified: J. Li et
al., "Calibration of a multiple axes 3-D laser scanning system consisting of robot, portable laser scanner and
turntable", Optik 122, 2011, and a paper of S. Yin et al. of 2013. The circle's centre and radius give the sphere's
centre in the sensor's frame up to the side of the sheet. The centre, which is the same point in base, gives linear
equations for the hand-eye transform. The side of each profile is the one nearer to the current answer. Last comes
least squares.
"""

import numpy as np

from ..files import Sequence
from ..rotations import Floats, apply, exp, rigid_fit
from ..submission import Answer, Status
from .least_squares import Fit
from .least_squares import solve as minimise

ROUNDS = 15
REVISIONS = 6
"""Fits after which the sides are chosen anew."""
SCALES = np.array([*[0.02] * 3, *[5.0] * 3, *[5.0] * 3])
TRIM_SIGMAS = 4.0
"""Points further than this from the circle are not of the sphere."""


def solve(sequence: Sequence) -> Answer:
    """Hand-eye transform from the profiles of a sphere."""
    if sequence.target != "sphere" or sequence.stops is None or sequence.radius_mm is None:
        return Answer("unsupported", ("not profiles of a sphere at stops",))
    if sequence.guess is None:
        return Answer("unsupported", ("needs a guess",))
    points = sequence.points_mm()
    used, circles = [], []
    for stop in np.unique(sequence.stop).astype(int):
        circle = fitted_circle(points[sequence.stop == stop][:, [0, 2]])
        if circle is not None:
            used.append(stop)
            circles.append(circle)
    if len(used) < 5:
        return Answer("refused", ("fewer than five arcs",))
    rotations, positions = sequence.stops[0][used], sequence.stops[1][used]
    guess = sequence.guess.rotation, sequence.guess.translation_mm
    rotation, translation, fit = calibrate(rotations, positions, np.array(circles), sequence.radius_mm, *guess)
    covariance = np.diag([np.nan, *np.diag(fit.covariance())[:6]])
    reasons = (f"residuals of {fit.rms:.2f} mm",) if fit.rms > 1.0 else ()
    status: Status = "refused" if reasons else "accepted"
    return Answer(status, reasons, None, rotation, translation, covariance, full_covariance=False)


def fitted_circle(xz_mm: Floats) -> Floats | None:
    """Centre x, z and radius of the circle through points (Kåsa, then Gauss–Newton); None if they are no arc."""
    if len(xz_mm) < 8:
        return None
    for _ in range(3):
        middle = xz_mm.mean(0)
        rest = xz_mm - middle
        system = np.concatenate([2 * rest, np.ones((len(rest), 1))], 1)
        a, b, c = np.linalg.lstsq(system, (rest**2).sum(1), rcond=None)[0]
        circle = np.array([a, b, np.sqrt(max(c + a * a + b * b, 1e-9))])
        for _ in range(10):
            circle = circle + np.linalg.lstsq(*_circle_step(rest, circle), rcond=None)[0]
        error = np.hypot(*(rest - circle[:2]).T) - circle[2]
        keep = np.abs(error) < TRIM_SIGMAS * max(1.4826 * float(np.median(np.abs(error))), 1e-6)
        if keep.all() or keep.sum() < 8:
            break
        xz_mm = xz_mm[keep]
    return np.array([*(circle[:2] + middle), circle[2]])


def _circle_step(rest: Floats, circle: Floats) -> tuple[Floats, Floats]:
    away = rest - circle[:2]
    distance = np.hypot(*away.T)
    return np.concatenate([away / distance[:, None], np.ones((len(rest), 1))], 1), distance - circle[2]


def calibrate(
    rotations: Floats, positions_mm: Floats, circles: Floats, radius_mm: float, rotation: Floats, translation_mm: Floats
) -> tuple[Floats, Floats, Fit]:
    """Hand-eye transform from circles (x, z, radius), one a pose, from a guess.

    Both sides are tried as the first one of all profiles; the fit with the smaller residuals wins.
    """
    heights = np.sqrt(np.maximum(radius_mm**2 - circles[:, 2] ** 2, 0.0))
    fits = [
        _from_side(rotations, positions_mm, circles, heights, (rotation, translation_mm), side) for side in (-1.0, 1.0)
    ]
    return min(fits, key=lambda found: found[2].rms)


def _from_side(
    rotations: Floats, positions_mm: Floats, circles: Floats, heights: Floats, guess: tuple[Floats, Floats], side: float
) -> tuple[Floats, Floats, Fit]:
    rotation, translation_mm = guess
    sides = np.full(len(circles), side)
    back = np.swapaxes(rotations, -1, -2)
    for _ in range(ROUNDS):
        chosen = _centres(circles, sides * heights)
        placed = apply(rotations, chosen @ rotation.T + translation_mm) + positions_mm
        centre = np.median(placed, 0)
        # The centre seen from the tool, Rᵀ(C − p), is where the hand-eye transform brings the centre that is seen.
        rotation, translation_mm = rigid_fit(chosen, apply(back, centre - positions_mm))
        sides = _sides(rotations, positions_mm, circles, heights, (rotation, translation_mm), centre)
    for _ in range(REVISIONS):
        rotation, translation_mm, centre, fit = _refined(
            rotations, positions_mm, _centres(circles, sides * heights), (rotation, translation_mm), centre
        )
        revised = _sides(rotations, positions_mm, circles, heights, (rotation, translation_mm), centre)
        if np.array_equal(revised, sides):
            break
        sides = revised
    return rotation, translation_mm, fit


def _sides(
    rotations: Floats, positions: Floats, circles: Floats, heights: Floats, hand: tuple[Floats, Floats], centre: Floats
) -> Floats:
    """The side of each profile whose centre of the sphere lies nearer to the common one."""
    far = [
        np.linalg.norm(
            apply(rotations, _centres(circles, s * heights) @ hand[0].T + hand[1]) + positions - centre, axis=1
        )
        for s in (-1.0, 1.0)
    ]
    return np.where(far[1] < far[0], 1.0, -1.0)


def _refined(
    rotations: Floats, positions: Floats, chosen: Floats, hand: tuple[Floats, Floats], centre: Floats
) -> tuple[Floats, Floats, Floats, Fit]:
    """Least squares over hand-eye transform and centre."""

    def residual(x: Floats) -> Floats:
        moved = apply(rotations, chosen @ (exp(x[:3]) @ hand[0]).T + hand[1] + x[3:6]) + positions
        return np.asarray(moved - centre - x[6:], float)

    fit = minimise(residual, 9, SCALES)
    return exp(fit.step[:3]) @ hand[0], hand[1] + fit.step[3:6], centre + fit.step[6:], fit


def _centres(circles: Floats, height: Floats) -> Floats:
    return np.stack([circles[:, 0], height, circles[:, 1]], 1)
