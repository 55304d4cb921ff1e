# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # From your robot's log
# Ten lines from two logs to an answer. Here a simulation writes the logs: positions in millimetres and Euler angles in degrees, as a KUKA
# has them (A, B, C about z, then the new y, then the new x), and the seam's pixels.

# %%
import numpy as np
import trueline
from scipy.spatial.transform import Rotation

source = trueline.simulate("quick", seed=4)
poses = source.base_from_tool
euler_deg = Rotation.from_matrix(poses[:, :3, :3]).as_euler("ZYX", degrees=True)
robot_log = np.column_stack([source.robot_times_s, poses[:, :3, 3] * 1e3, euler_deg])
np.savetxt("robot.csv", robot_log, delimiter=",", header="t,X,Y,Z,A,B,C")
np.savetxt("seam.csv", np.column_stack([source.feature_times_s, source.points]), delimiter=",", header="t,u,v")

# %% [markdown]
# From here on it is your log, your camera and its laser plane, in ten lines:

# %%
import numpy as np
import trueline
from scipy.spatial.transform import Rotation

robot = np.loadtxt("robot.csv", delimiter=",")  # s, mm, degrees
seam = np.loadtxt("seam.csv", delimiter=",")  # s, pixels
camera = trueline.Camera(2448, 2000, fx=3598.0, fy=3597.0, cx=1211.0, cy=1007.0, distortion=(-0.08, 0.12, 0.0002, -0.0003, 0.0))
sensor = trueline.CameraLaser(camera, plane_normal=(-0.015356, -0.904325, 0.426568), plane_offset_m=0.055752)
rotations = Rotation.from_euler("ZYX", robot[:, 4:], degrees=True)
result = trueline.calibrate(robot[:, 0], (robot[:, 1:4] * 1e-3, rotations), seam[:, 0], seam[:, 1:], sensor=sensor)
print(result)

# %% [markdown]
# Into the robot's own form:

# %%
print(trueline.export(result, "kuka"))

# %%
truth = source.truth
assert result.accepted and truth is not None
off_mm = (result.tool_from_camera[:3, 3] - truth.tool_from_camera[:3, 3]) * 1e3
assert np.all(np.abs(off_mm) < 5e3 * result.sigma.translation_m)
