"""Time offset by cross-correlation, then a linear hand-eye transform.

Offset: the rate of the seam point in the sheet is linear in the robot's twist at the same instant, with factors that
are about affine in where the point is, so the offset is where the squared multiple correlation of the two is largest.
This is the correlation of signal pairs of E. Mair, M. Fleps, M. Suppa, D. Burschka, "Spatio-temporal initialization for
IMU to camera registration", ROBIO 2011, and of F. Furrer et al., "Evaluation of Combined Time-Offset Estimation and
Hand-Eye Calibration on Robotic Datasets", FSR 2017, with multiple correlation in the place of a single signal.

Hand-eye: points of a sheet enter linearly through two columns of the rotation and the translation; the line comes from
the guess and is refined in turn (direct linear transform and projection on the rotations, as R. Tsai and R. Lenz 1989
and later closed forms do for other targets).
"""

import numpy as np

from ..files import Sequence
from ..rotations import Floats, PoseStream, apply, log, nearest_rotation
from ..submission import Answer, Status
from .least_squares import MAD_TO_SIGMA
from .line import LIMIT_MM, State, beside, fitted_line, placed, start

SEARCH_S = 0.5
"""Largest offset that is tested."""
COARSE_S = 0.01
STEP_S = 0.002
"""Steps of the search, the second about the best of the first; a parabola refines it."""
WINDOW_S = 0.06
"""Half width of the differences that rates are formed from."""
ROUNDS = 30


def solve(sequence: Sequence) -> Answer:
    """Offset by correlation, hand-eye by linear least squares."""
    begun = start(sequence)
    if isinstance(begun, Answer):
        return begun
    robot, times, points, state = begun
    state.time_offset_s = _offset(robot, times, sequence.sensor.to_sheet(points))
    rms = np.inf
    for _ in range(ROUNDS):
        state.point_mm, state.axes = fitted_line(placed(robot, times, points, state))
        error = np.linalg.norm(beside(placed(robot, times, points, state), state), axis=1)
        keep = error < max(4 * MAD_TO_SIGMA * float(np.median(error)), 1e-6)
        rms = float(np.sqrt((error[keep] ** 2).mean()))
        state.rotation, state.translation_mm = _linear(robot, times[keep], points[keep], sequence, state)
    reasons = (f"residuals of {rms:.2f} mm",) if rms > LIMIT_MM else ()
    status: Status = "refused" if reasons else "accepted"
    return Answer(status, reasons, state.time_offset_s, state.rotation, state.translation_mm)


def _offset(robot: PoseStream, times_s: Floats, ab_mm: Floats) -> float:
    first, last = times_s + WINDOW_S, times_s - WINDOW_S
    after = np.searchsorted(times_s, first)
    before = np.searchsorted(times_s, last)
    good = (after < len(times_s)) & (before > 0)
    after, before = after[good], before[good]
    rates = (ab_mm[after] - ab_mm[before]) / (times_s[after] - times_s[before])[:, None]
    middle = (times_s[after] + times_s[before]) / 2
    limit = 6 * MAD_TO_SIGMA * np.median(np.abs(rates - np.median(rates, 0)), 0)
    fine = (np.abs(rates - np.median(rates, 0)) < limit).all(1)
    rates, middle = rates[fine], middle[fine]
    place = (ab_mm[after] + ab_mm[before])[fine] / 2
    place = (place - place.mean(0)) / np.maximum(place.std(0), 1e-9)
    coarse = np.arange(-SEARCH_S, SEARCH_S + COARSE_S, COARSE_S)
    best = coarse[np.argmax([_explained(rates, place, _twist(robot, middle - lag)) for lag in coarse])]
    lags = best + np.arange(-COARSE_S, COARSE_S + STEP_S, STEP_S)
    scores = np.array([_explained(rates, place, _twist(robot, middle - lag)) for lag in lags])
    k = int(np.clip(np.argmax(scores), 1, len(lags) - 2))
    left, top, right = scores[k - 1 : k + 2]
    curve = left - 2 * top + right
    return float(lags[k] + (0.5 * (left - right) / curve * STEP_S if curve < 0 else 0.0))


def _twist(robot: PoseStream, times_s: Floats) -> Floats:
    """Linear and angular velocity in the tool's frame (mm/s, rad/s)."""
    before, after = robot.at(times_s - WINDOW_S), robot.at(times_s + WINDOW_S)
    middle, _ = robot.at(times_s)
    linear = apply(np.swapaxes(middle, -1, -2), after[1] - before[1])
    angular = log(np.swapaxes(before[0], -1, -2) @ after[0])
    return np.concatenate([linear, angular], 1) / (2 * WINDOW_S)


def _explained(rates: Floats, place: Floats, twist: Floats) -> float:
    """Share of the rates that the twist explains, with factors that are affine in the place."""
    columns = np.concatenate([twist, twist * place[:, :1], twist * place[:, 1:], np.ones((len(twist), 1))], 1)
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    rest = rates - columns / scale @ np.linalg.lstsq(columns / scale, rates, rcond=1e-8)[0]
    return float(1 - (rest**2).sum() / ((rates - rates.mean(0)) ** 2).sum())


def _linear(
    robot: PoseStream, times_s: Floats, points_mm: Floats, sequence: Sequence, state: State
) -> tuple[Floats, Floats]:
    """Hand-eye transform that brings points to the current line, linear in two columns of R and in t."""
    _, along, depth, n = sequence.sensor.axes()
    origin = sequence.sensor.axes()[0]
    ab = sequence.sensor.to_sheet(points_mm)
    rotations, positions = robot.at(times_s - state.time_offset_s)
    rows = np.swapaxes(state.axes[:, 1:], 0, 1) @ rotations
    system = np.concatenate([rows * ab[:, :1, None], rows * ab[:, 1:, None], rows], 2).reshape(-1, 9)
    right = ((state.point_mm - positions) @ state.axes[:, 1:]).reshape(-1)
    # Weakly pulled to the last iterate: directions that the motion hides stay in place.
    last = np.concatenate(
        [state.rotation @ along, state.rotation @ depth, state.rotation @ origin + state.translation_mm]
    )
    pull = 1e-3 * np.diag([*[30.0] * 6, *[1.0] * 3]) * np.sqrt(len(times_s))
    solution = np.linalg.lstsq(
        np.concatenate([system, pull]), np.concatenate([right, pull @ last]), rcond=None
    )[0]  # fmt: skip
    a, b, middle = solution[:3], solution[3:6], solution[6:]
    sheet = np.stack([along, depth, np.cross(along, depth)], 1)
    rotation = nearest_rotation(np.stack([a, b, np.cross(a, b)], 1) @ sheet.T)
    return rotation, middle - rotation @ origin
