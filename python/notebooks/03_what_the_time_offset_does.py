# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # What the time offset does
# As in the paper's Figs. 9 and 10: the seam in base with the time offset left out and with it.

# %%
import matplotlib.pyplot as plt
import numpy as np
import trueline

scan = trueline.simulate("good", seed=2)
truth = scan.truth
with_offset = trueline.calibrate(scan)
without = trueline.calibrate(scan, initial=(0.0, truth.tool_from_camera), fix=["time-offset"])

# %%
fig, ax = plt.subplots()
for name, result in (("time offset held at 0", without), ("time offset estimated", with_offset)):
    distance_mm = np.linalg.norm(result.residuals.offset_m, axis=1) * 1e3
    ax.plot(result.residuals.time_s, distance_mm, ".", markersize=3, label=f"{name}: RMS {np.sqrt(np.mean(distance_mm**2)):.3f} mm")
ax.set(xlabel="time / s", ylabel="distance from the line / mm")
ax.legend()

# %%
rms = [np.sqrt(np.mean(result.residuals.offset_m**2)) for result in (without, with_offset)]
assert rms[0] > 3 * rms[1]
