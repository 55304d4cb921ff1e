"""Eigenvalues of steps block by block, on the paper's scan at its truth: the figures of theory/equations.md, *Why the block methods do not converge*.

    python block_eigenvalues.py PROGRAM

Needs numpy. Not a part of check.py.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from scan import Scene, simulated, table, toml

# Time offset, turn of the line, its moment, hand-eye rotation, hand-eye translation.
BLOCKS = (slice(0, 1), slice(1, 4), slice(4, 5), slice(5, 8), slice(8, 11))
STRIDE = 10


def matrix(q):
    """The rotation matrix of a unit quaternion w, x, y, z."""
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def hat(a):
    """[a]×."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def jacobian(scan: Path):
    """Derivatives of F (Eq. 10) by the eleven unknowns, right signs, mm."""
    scene, time_offset_s = Scene(scan), toml(scan / "truth.toml")["time_offset_s"]
    stamps = np.array([row["time_s"] for row in scene.robot])
    mounted, arm = matrix(scene.rotation), np.array(scene.shift, float)
    u1 = np.array(scene.direction) / np.linalg.norm(scene.direction)
    moment = np.cross(scene.point, u1)
    m = np.linalg.norm(moment)
    u2, rows = moment / m, []
    for feature in table(scan / "features.csv")[::STRIDE]:
        row = int(np.searchsorted(stamps, feature["time_s"] - time_offset_s)) - 1
        if row < 0 or row + 1 >= len(stamps):
            continue
        (p, q), (p_next, q_next) = scene.tool(row), scene.tool(row + 1)
        period = stamps[row + 1] - stamps[row]
        attitude, velocity = matrix(q), np.subtract(p_next, p) / period
        change = attitude.T @ matrix(q_next)
        rate = np.array([change[2, 1] - change[1, 2], change[0, 2] - change[2, 0], change[1, 0] - change[0, 1]]) / (2 * period)
        turned = mounted @ np.array(scene.on_plane(feature["u_px"], feature["v_px"]))
        lever = attitude @ (turned + arm)
        by_time = hat(lever) @ (attitude @ rate) - velocity
        by_line = -hat(lever + np.array(p)) @ hat(u1) + m * hat(u2)
        rows.append(np.column_stack([-hat(u1) @ by_time, by_line, -u2, hat(u1) @ attitude @ hat(turned), -hat(u1) @ attitude]))
    return np.concatenate(rows)


def main() -> None:
    """Prints them."""
    with tempfile.TemporaryDirectory() as folder:
        j = jacobian(simulated(Path(sys.argv[1]), Path(folder) / "scan", "--preset", "paper", "--noise-free"))
    h = j.T @ j
    d = np.zeros_like(h)
    for block in BLOCKS:
        d[block, block] = h[block, block]
    print("eigenvalues of D⁻¹H:", " ".join(f"{value:.2g}" for value in np.sort(np.linalg.eigvals(np.linalg.solve(d, h)).real)))


if __name__ == "__main__":
    main()
