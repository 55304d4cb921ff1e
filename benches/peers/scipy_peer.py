"""The same problem in scipy.optimize.least_squares, vectorised with numpy. See run.sh."""

import json
import sys
import time

import numpy as np
import scipy
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

numbers = np.fromfile(sys.argv[1], dtype="<f8")
count, lines, segments = (int(x) for x in numbers[:3])
sheet, start = numbers[3:12].reshape(3, 3), numbers[15:23]
line_rows = numbers[23 : 23 + 12 * lines].reshape(lines, 12)
rest = numbers[23 + 12 * lines :]
seg, obs = rest[: 15 * segments].reshape(-1, 15), rest[15 * segments : -7].reshape(count, 8)
sigma = rest[-7:]
which = obs[:, 7].astype(int)
xyzw = lambda q: np.roll(q, -1, axis=-1)
base = Rotation.from_quat(xyzw(start[1:5]))
anchors, axes = line_rows[:, :3], line_rows[:, 3:].reshape(lines, 3, 3)


dot = lambda a, b: np.einsum("ij,ij->i", a, b)


def left_jacobian(w):
    angle2 = w @ w
    h = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    if angle2 < 1e-8:
        return np.eye(3) + 0.5 * h + h @ h / 6
    angle = np.sqrt(angle2)
    return np.eye(3) + (1 - np.cos(angle)) / angle2 * h + (angle - np.sin(angle)) / (angle2 * angle) * h @ h


def evaluate(x, with_jacobian):
    exposure = obs[:, 0] - x[0]
    s = seg[np.clip(np.searchsorted(seg[:, 0], exposure, side="right") - 1, 0, segments - 1)]
    elapsed = (exposure - s[:, 0])[:, None]
    tool = Rotation.from_quat(xyzw(s[:, 2:6])) * Rotation.from_rotvec(s[:, 9:12] * elapsed)
    camera = Rotation.from_rotvec(x[1:4]) * base
    own = x[7:].reshape(lines, 4)
    mount, origin = start[5:8] + x[4:7], s[:, 6:9] + s[:, 12:15] * elapsed
    bend = own[:, :1] * axes[:, 1] + own[:, 1:2] * axes[:, 2]
    direction = Rotation.from_rotvec(bend).apply(axes[:, 0])[which]
    anchor = (anchors + own[:, 2:3] * axes[:, 1] + own[:, 3:4] * axes[:, 2])[which]
    both = tool * camera
    ex, ey, n = (both.apply(sheet[k]) for k in range(3))
    off = tool.apply(camera.apply(obs[:, 1:4]) + mount) + origin - anchor
    sine = dot(n, direction)
    rows = [e - (dot(e, direction) / sine)[:, None] * n for e in (ex, ey)]
    r1, r2 = (dot(row, off) for row in rows)
    rows = [obs[:, 4:5] * rows[0], obs[:, 5:6] * rows[0] + obs[:, 6:7] * rows[1]]
    if not with_jacobian:
        return np.concatenate([obs[:, 4] * r1, obs[:, 5] * r1 + obs[:, 6] * r2])
    predicted = obs[:, 1:4] - r1[:, None] * sheet[0] - r2[:, None] * sheet[1]
    arm = camera.apply(predicted)
    lever = tool.apply(arm + mount)
    shift = np.cross(lever, tool.apply(s[:, 9:12])) - s[:, 12:15]
    jacobian = np.zeros((2, count, 7 + 4 * lines))
    turn = left_jacobian(x[1:4])
    for k, row in enumerate(rows):
        in_tool = tool.inv().apply(row)
        jacobian[k, :, 0] = dot(row, shift)
        jacobian[k, :, 1:4] = np.cross(arm, in_tool) @ turn
        jacobian[k, :, 4:7] = in_tool
        for line in range(lines):
            of = which == line
            bent = left_jacobian(bend[line])
            from_anchor = (lever + origin - anchor)[of]
            first = 7 + 4 * line
            jacobian[k, of, first] = -dot(row[of], np.cross(bent @ axes[line, 1], from_anchor))
            jacobian[k, of, first + 1] = -dot(row[of], np.cross(bent @ axes[line, 2], from_anchor))
            jacobian[k, of, first + 2] = -row[of] @ axes[line, 1]
            jacobian[k, of, first + 3] = -row[of] @ axes[line, 2]
    return jacobian.reshape(2 * count, -1)


residuals = lambda x: evaluate(x, False)
derivatives = lambda x: evaluate(x, True)
x0 = np.zeros(7 + 4 * lines)
x0[0] = start[0]


def solve(evaluations):
    return least_squares(
        residuals, x0, jac=derivatives, method="trf", x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=evaluations
    )


# Ends with the first step that is shorter than a millionth of a standard deviation, as every side does.
before, evaluations = x0, 2
while True:
    after = solve(evaluations).x
    if np.max(np.abs(after - before)[:7] / sigma) < 1e-6:
        break
    before, evaluations = after, evaluations + 1
best = np.inf
for _ in range(3):
    began = time.perf_counter()
    found = solve(evaluations)
    best = min(best, time.perf_counter() - began)
print(json.dumps({"side": f"scipy {scipy.__version__}, numpy, analytic derivatives", "found": found.x[:7].tolist(), "iterations": int(found.njev) - 1, "seconds": best}))
