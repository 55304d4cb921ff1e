# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Compared with OpenCV's hand-eye calibration
# OpenCV wants a board that the camera looks at from many robot poses. Both are simulated here on the same robot and hand-eye
# transform: the board's corners with 0.1 px of noise, once with a robot that stops for each picture, and once with one that
# moves on while pictures come 12 ms late.

# %%
import cv2
import numpy as np
import trueline
from numpy.typing import NDArray

scan = trueline.simulate("good", "--time-offset-ms", "12", seed=3)
truth = scan.truth
assert truth is not None
tool_from_camera = truth.tool_from_camera
random = np.random.default_rng(1)
camera = np.array([[1800.0, 0.0, 640.0], [0.0, 1800.0, 512.0], [0.0, 0.0, 1.0]])
corners = np.array([[x, y, 0.0] for y in range(6) for x in range(9)]) * 0.025

# %% [markdown]
# The board lies where the camera looks at it from the middle of the scan, 0.4 m away.

# %%
poses = scan.base_from_tool[:: len(scan.base_from_tool) // 60]
middle = poses[len(poses) // 2] @ tool_from_camera
before = np.eye(4)
before[:3, 3] = [-0.1, -0.06, 0.4]
base_from_board = middle @ before


def by_opencv(base_from_tool: NDArray[np.float64], exposed: NDArray[np.float64]) -> NDArray[np.float64]:
    """The hand-eye transform of OpenCV from the robot's reports and its poses at the exposures."""
    seen = []
    for pose in exposed:
        camera_from_board = np.linalg.inv(pose @ tool_from_camera) @ base_from_board
        points = (corners @ camera_from_board[:3, :3].T + camera_from_board[:3, 3]) @ camera.T
        pixels = points[:, :2] / points[:, 2:] + random.normal(0.0, 0.1, (len(corners), 2))
        found, turn, place = cv2.solvePnP(corners, pixels, camera, None)
        assert found
        seen.append((cv2.Rodrigues(turn)[0], place))
    turns, places = base_from_tool[:, :3, :3], base_from_tool[:, :3, 3]
    rotation, translation = cv2.calibrateHandEye(
        list(turns), list(places), [turn for turn, _ in seen], [place for _, place in seen], method=cv2.CALIB_HAND_EYE_DANIILIDIS
    )
    found_transform = np.eye(4)
    found_transform[:3, :3], found_transform[:3, 3] = rotation, translation[:, 0]
    return found_transform


def off_mm(found: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(found[:3, 3] - tool_from_camera[:3, 3]) * 1e3)


# %% [markdown]
# A pose reported 12 ms later is the robot's pose 12 ms after the exposure: three samples of 4 ms.

# %%
late = round(truth.time_offset_s / np.median(np.diff(scan.robot_times_s)))
every = slice(late, None, len(scan.base_from_tool) // 60)
reported = scan.base_from_tool[every]
exposed = scan.base_from_tool[: -late or None][:: len(scan.base_from_tool) // 60][: len(reported)]
standing = by_opencv(reported, reported)
moving = by_opencv(reported, exposed)
result = trueline.calibrate(scan)
print(f"OpenCV, board, the robot stops 60 times: {off_mm(standing):.2f} mm off")
print(f"OpenCV, board, the robot moves on:       {off_mm(moving):.2f} mm off")
print(f"trueline, a seam, the robot moves on:    {off_mm(result.tool_from_camera):.2f} mm off, and the time offset is known:")
print(f"{result.time_offset_s:.6f} ± {result.sigma.time_offset_s:.6f} s, true {truth.time_offset_s:.6f} s")

# %%
assert off_mm(result.tool_from_camera) < off_mm(moving)
assert off_mm(standing) < off_mm(moving)
