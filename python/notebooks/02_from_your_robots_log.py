# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # From your robot's log
# Ten lines from arrays to an answer. Here the arrays come from a simulation; the log has positions in millimetres and
# Euler angles in degrees, as a KUKA writes them (A, B, C about z, then the new y, then the new x).

# %%
import numpy as np
import trueline
from scipy.spatial.transform import Rotation

source = trueline.simulate("quick", seed=4)
log_mm_deg = np.column_stack(
    [
        source.base_from_tool[:, :3, 3] * 1e3,
        Rotation.from_matrix(source.base_from_tool[:, :3, :3]).as_euler("ZYX", degrees=True),
    ]
)

# %% [markdown]
# From here on it is your log.

# %%
positions_m = log_mm_deg[:, :3] * 1e-3
rotations = Rotation.from_euler("ZYX", log_mm_deg[:, 3:], degrees=True)
result = trueline.calibrate(
    source.robot_times_s, (positions_m, rotations), source.feature_times_s, source.points, sensor=source.sensor
)
print(result)

# %%
assert result.accepted

# %% [markdown]
# Into the robot's own form:

# %%
print(trueline.export(result, "kuka"))
