"""Hand-eye transform of a profiler from profiles of one unknown plane.

F. Bagge Carlson, R. Johansson, A. Robertsson, "Six DOF eye-to-hand calibration from 2D measurements using planar
constraints", IROS 2015, 3628–3632: alternate between the plane of the placed points and a linear hand-eye transform.
S. Sharifzadeh, I. Biro, P. Kinnell, "Robust hand-eye calibration of 2D laser sensors using a single-plane calibration
artefact", Robotics and Computer-Integrated Manufacturing 61, 101823, 2020: one plane is enough if the poses vary.
The last step is least squares over hand-eye transform and plane together.
"""

import numpy as np

from ..files import Sequence
from ..rotations import Floats, apply, exp, nearest_rotation
from ..submission import Answer
from .least_squares import Fit
from .least_squares import solve as minimise

ROUNDS = 12
SCALES = np.array([*[0.02] * 3, *[5.0] * 3, *[0.02] * 2, 5.0])


def solve(sequence: Sequence) -> Answer:
    """Hand-eye transform from the profiles of a plane."""
    if sequence.target != "plane" or sequence.stops is None or sequence.guess is None:
        return Answer("unsupported", ("not profiles of a plane at stops",))
    index = sequence.stop.astype(int)
    rotations, positions = sequence.stops[0][index], sequence.stops[1][index]
    guess = sequence.guess.rotation, sequence.guess.translation_mm
    rotation, translation, fit = calibrate(rotations, positions, sequence.points_mm(), *guess)
    covariance = np.zeros((7, 7))
    covariance[0, 0] = np.nan
    covariance[1:, 1:] = fit.covariance()[:6, :6]
    return Answer("accepted", (), None, rotation, translation, np.diag(np.diag(covariance)), full_covariance=False)


def calibrate(
    rotations: Floats, positions_mm: Floats, points_mm: Floats, rotation: Floats, translation_mm: Floats
) -> tuple[Floats, Floats, Fit]:
    """Hand-eye transform from points (one pose a row) of one plane, from a guess."""
    for _ in range(ROUNDS):
        placed = apply(rotations, points_mm @ rotation.T + translation_mm) + positions_mm
        centre = placed.mean(0)
        normal = np.linalg.svd(placed - centre, full_matrices=False)[2][2]
        rotation, translation_mm = _linear(rotations, positions_mm, points_mm, normal, rotation, translation_mm)
    first = (rotation, translation_mm)
    placed = apply(rotations, points_mm @ rotation.T + translation_mm) + positions_mm
    centre = placed.mean(0)
    axes = np.linalg.svd(placed - centre, full_matrices=False)[2]

    def residual(x: Floats) -> Floats:
        moved = apply(rotations, points_mm @ (exp(x[:3]) @ first[0]).T + first[1] + x[3:6]) + positions_mm
        normal = exp(axes[0] * x[6] + axes[1] * x[7]) @ axes[2]
        return np.asarray(((moved - centre) @ normal - x[8])[:, None], float)

    fit = minimise(residual, 9, SCALES)
    return exp(fit.step[:3]) @ first[0], first[1] + fit.step[3:6], fit


def _linear(
    rotations: Floats, positions: Floats, points: Floats, normal: Floats, rotation: Floats, translation: Floats
) -> tuple[Floats, Floats]:
    """One linear step: two columns of R, t and the plane's offset, with the normal held."""
    rows = np.einsum("k,nkj->nj", normal, rotations)
    middle = points.mean(0)
    rest = points - middle
    system = np.concatenate(
        [rows * rest[:, :1], rows * rest[:, 2:], rows, -np.ones((len(rows), 1))], 1
    )  # fmt: skip
    right = -positions @ normal
    place = rotation @ middle + translation
    offset = float((rows @ place + positions @ normal).mean())
    last = np.concatenate([rotation[:, 0], rotation[:, 2], place, [offset]])
    pull = 1e-4 * np.diag([*[10.0] * 6, *[1.0] * 3, 0.0]) * np.sqrt(len(rows))
    solution = np.linalg.lstsq(np.concatenate([system, pull]), np.concatenate([right, pull @ last]), rcond=None)[0]
    a, b = solution[:3], solution[3:6]
    turned = nearest_rotation(np.stack([a, np.cross(b, a), b], 1))
    return turned, solution[6:9] - turned @ middle
