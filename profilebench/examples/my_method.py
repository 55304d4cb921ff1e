"""The smallest method that follows the rules: it hands in the guess with the time offset of the best correlation.

python examples/my_method.py SEQUENCE_FOLDER ANSWER_FILE
"""

import sys
from pathlib import Path

import numpy as np

from profilebench import Answer, read_sequence, write_answer


def solve(folder: Path) -> Answer:
    """The guess, and the offset at which the placed points lie best on a line."""
    scan = read_sequence(folder)
    if scan.robot is None or scan.guess is None:
        return Answer("unsupported", ("a scan of a moving robot is needed",))
    points = scan.points_mm() @ scan.guess.rotation.T + scan.guess.translation_mm
    offsets = np.arange(-0.1, 0.2, 0.002)
    widths = []
    for offset in offsets:
        rotations, positions = scan.robot.at(scan.times_s - offset)
        placed = np.einsum("nij,nj->ni", rotations, points) + positions
        widths.append(np.linalg.svd(placed - placed.mean(0), compute_uv=False)[1])
    return Answer(
        status="accepted",
        time_offset_s=float(offsets[np.argmin(widths)]),
        rotation=scan.guess.rotation,
        translation_mm=scan.guess.translation_mm,
    )


if __name__ == "__main__":
    source, target = Path(sys.argv[1]), Path(sys.argv[2])
    write_answer(target, solve(source), source.name, "my-method")
