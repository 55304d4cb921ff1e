"""Hand-eye transform of a camera from the poses of a chessboard at stops: AX = XB.

F. C. Park, B. J. Martin, "Robot sensor calibration: solving AX = XB on the Euclidean group", IEEE Transactions on
Robotics and Automation 10(5), 717–721, 1994: rotation from the logarithms of all pairs of motions, then a linear
translation. Last comes least squares over the hand-eye transform: the board's corners in base do not move.
"""

from pathlib import Path

import numpy as np

from ..files import Sequence, read_boards
from ..rotations import Floats, apply, exp, log, nearest_rotation
from ..submission import Answer
from .least_squares import Fit
from .least_squares import solve as minimise

SCALES = np.array([*[0.02] * 3, *[5.0] * 3])
LEAST_STOPS = 4


def solve(sequence: Sequence) -> Answer:
    """A sequence of readings has no board in it."""
    return Answer("unsupported", ("needs pictures of a chessboard",))


def from_pictures(folder: Path) -> Answer:
    """Hand-eye transform from boards.csv, which `profilebench real` makes of the pictures."""
    boards = read_boards(folder)
    if boards is None:
        return Answer("unsupported", ("no boards.csv: OpenCV was not there when the real track was made",))
    if len(boards.rotations) < LEAST_STOPS:
        return Answer("refused", (f"{len(boards.rotations)} boards",))
    rotation, translation, fit = calibrate(
        (boards.rotations, boards.positions_mm), (boards.seen_rotations, boards.seen_positions_mm), boards.corners_mm
    )
    covariance = np.diag([np.nan, *np.diag(fit.covariance())])
    return Answer("accepted", (), None, rotation, translation, covariance, full_covariance=False)


def calibrate(
    stops: tuple[Floats, Floats], seen: tuple[Floats, Floats], corners_mm: Floats
) -> tuple[Floats, Floats, Fit]:
    """Hand-eye transform from the robot's poses and those of the board in the camera's frame."""
    first = closed_form(stops, seen)

    def residual(x: Floats) -> Floats:
        placed = place(stops, seen, (exp(x[:3]) @ first[0], first[1] + x[3:]), corners_mm)
        return np.asarray((placed - placed.mean(0)).reshape(len(placed), -1), float)

    fit = minimise(residual, 6, SCALES)
    return exp(fit.step[:3]) @ first[0], first[1] + fit.step[3:], fit


def closed_form(stops: tuple[Floats, Floats], seen: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Park and Martin's solution over all pairs of stops."""
    moment, rows, right = np.zeros((3, 3)), [], []
    pairs = [(i, j) for i in range(len(stops[0])) for j in range(i)]
    motions = [(_motion(stops, i, j), _seen_motion(seen, i, j)) for i, j in pairs]
    for (turn, _), (seen_turn, _) in motions:
        moment += np.outer(log(seen_turn), log(turn))
    rotation = nearest_rotation(moment.T)
    for (turn, shift), (_, seen_shift) in motions:
        rows.append(turn - np.eye(3))
        right.append(rotation @ seen_shift - shift)
    return rotation, np.linalg.lstsq(np.concatenate(rows), np.concatenate(right), rcond=None)[0]


def _motion(poses: tuple[Floats, Floats], i: int, j: int) -> tuple[Floats, Floats]:
    """tool_i from tool_j."""
    back = poses[0][i].T
    return back @ poses[0][j], back @ (poses[1][j] - poses[1][i])


def _seen_motion(poses: tuple[Floats, Floats], i: int, j: int) -> tuple[Floats, Floats]:
    """camera_i from camera_j, by the board."""
    turn = poses[0][i] @ poses[0][j].T
    return turn, poses[1][i] - turn @ poses[1][j]


def place(
    stops: tuple[Floats, Floats], seen: tuple[Floats, Floats], hand: tuple[Floats, Floats], corners_mm: Floats
) -> Floats:
    """The board's corners in base at each stop, (stops, corners, 3) in mm."""
    placed = []
    for corner in corners_mm:
        in_camera = seen[0] @ corner + seen[1]
        placed.append(apply(stops[0], in_camera @ hand[0].T + hand[1]) + stops[1])
    return np.stack(placed, 1)
