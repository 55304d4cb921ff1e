"""Point-to-line methods after Yang, Jiang, Shen and Zhang.

P. Yang, M. Jiang, X. Shen, H. Zhang, "Spatiotemporal Calibration for Laser Vision Sensor in Hand-eye System Based on
Straight-line Constraint", arXiv 2509.12928, accepted by IEEE Robotics and Automation Letters in October 2025: time
offset, hand-eye transform and line from the distance of placed seam points to one line, Huber norm,
Levenberg–Marquardt from a guess and an offset of zero.

`joint` minimises over everything at once. `alternating` takes the blocks in turn: line, hand-eye, time offset. Both
differentiate the measurement model by differences. No code of the paper's authors was used.
"""

from dataclasses import dataclass

import numpy as np

from ..files import Sequence
from ..rotations import Floats, PoseStream, apply, exp
from ..submission import Answer
from .least_squares import Fit, huber_weights, solve

SCALES = np.array([0.01, *[0.02] * 3, *[5.0] * 3, *[0.02] * 2, *[5.0] * 2])
"""Units of the unknowns: s, rad, mm, and of the line rad and mm."""
LIMIT_MM = 1.0
"""A fit whose residuals are larger than this is not offered as a calibration."""
ROUNDS = 80
"""Rounds of the alternating method; it converges linearly and slowly."""
OFFSET_LIMIT_S = 0.9
"""The robot log's margin: an offset beyond it leaves the recording."""


@dataclass
class State:
    """Time offset, hand-eye transform and line of the current iterate."""

    time_offset_s: float
    rotation: Floats
    translation_mm: Floats
    point_mm: Floats
    axes: Floats
    """Columns: direction of the line and two normals."""

    def moved(self, x: Floats) -> "State":
        """The state after a step (11): offset, rotation (left), translation, line's turns and shifts."""
        turn = exp(self.axes @ np.array([0.0, x[7], x[8]]))
        shift = self.axes[:, 1:] @ x[9:]
        return State(
            self.time_offset_s + float(x[0]), exp(x[1:4]) @ self.rotation, self.translation_mm + x[4:7],
            self.point_mm + shift, turn @ self.axes,
        )  # fmt: skip


def placed(robot: PoseStream, times_s: Floats, points_mm: Floats, state: State) -> Floats:
    """Points in base."""
    rotations, positions = robot.at(times_s - state.time_offset_s)
    return apply(rotations, points_mm @ state.rotation.T + state.translation_mm) + positions


def beside(points_mm: Floats, state: State) -> Floats:
    """The cross components of points beside the line, mm."""
    return np.asarray((points_mm - state.point_mm) @ state.axes[:, 1:], float)


def fitted_line(points_mm: Floats) -> tuple[Floats, Floats]:
    """Point and axes of a line through points by principal axes, with Huber weights."""
    weights = np.ones(len(points_mm))
    centre, axes = points_mm.mean(0), np.eye(3)
    for _ in range(10):
        centre = (weights[:, None] * points_mm).sum(0) / weights.sum()
        _, _, vt = np.linalg.svd((points_mm - centre) * np.sqrt(weights)[:, None], full_matrices=False)
        axes = vt.T
        weights = huber_weights((points_mm - centre) @ axes[:, 1:])
    return centre, axes


def start(sequence: Sequence) -> tuple[PoseStream, Floats, Floats, State] | Answer:
    """Stream, stamps, points and first state of a scan; an answer where the sequence is none."""
    if sequence.robot is None or sequence.target not in ("line", "arc"):
        return Answer("unsupported", ("not a scan of a seam",))
    if sequence.guess is None:
        return Answer("unsupported", ("needs a guess",))
    points = sequence.points_mm()
    state = State(
        sequence.guess.time_offset_s, sequence.guess.rotation, sequence.guess.translation_mm, np.zeros(3), np.eye(3)
    )
    state.point_mm, state.axes = fitted_line(placed(sequence.robot, sequence.times_s, points, state))
    return sequence.robot, sequence.times_s, points, state


def joint(sequence: Sequence) -> Answer:
    """All unknowns at once (Yang et al.)."""
    begun = start(sequence)
    if isinstance(begun, Answer):
        return begun
    robot, times, points, first = begun
    fit = solve(lambda x: beside(placed(robot, times, points, first.moved(x)), first.moved(x)), 11, SCALES, 80)
    return _answer(first.moved(fit.step), fit, fit.covariance()[:7, :7])


def alternating(sequence: Sequence) -> Answer:
    """Block after block: the line, the hand-eye transform, the time offset (the baseline of Yang et al.)."""
    begun = start(sequence)
    if isinstance(begun, Answer):
        return begun
    robot, times, points, state = begun
    hand, delay = list(range(1, 7)), [0]
    cost, still, fit = np.inf, 0, None
    for _ in range(ROUNDS):
        state.point_mm, state.axes = fitted_line(placed(robot, times, points, state))
        for block in (hand, delay):
            fit = _block(robot, times, points, state, block)
            state = state.moved(_full(fit.step, block))
        assert fit is not None
        still = still + 1 if abs(cost - fit.rms) < 1e-6 * fit.rms else 0
        cost = fit.rms
        if still >= 3 or abs(state.time_offset_s) > OFFSET_LIMIT_S:
            break
    assert fit is not None
    return _answer(state, fit, None, still >= 3 or cost < LIMIT_MM)


def _block(robot: PoseStream, times: Floats, points: Floats, state: State, block: list[int]) -> Fit:
    def residual(x: Floats) -> Floats:
        moved = state.moved(_full(x, block))
        return beside(placed(robot, times, points, moved), moved)

    return solve(residual, len(block), SCALES[block], 2)


def _full(x: Floats, block: list[int]) -> Floats:
    out = np.zeros(11)
    out[block] = x
    return out


def _answer(state: State, fit: Fit, covariance: Floats | None, converged: bool | None = None) -> Answer:
    done = fit.converged if converged is None else converged
    reasons = [] if done else ["not converged"]
    if fit.rms > LIMIT_MM:
        reasons.append(f"residuals of {fit.rms:.2f} mm")
    if abs(state.time_offset_s) > OFFSET_LIMIT_S:
        reasons.append("the time offset left the recording")
    return Answer(
        "refused" if reasons else "accepted", tuple(reasons), state.time_offset_s, state.rotation,
        state.translation_mm, covariance,
    )  # fmt: skip
