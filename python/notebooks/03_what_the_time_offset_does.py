# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # What the time offset does
# First on one scan: the same data, calibrated with the time offset held at zero and with it estimated.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import trueline

scan = trueline.simulate("good", seed=2)
truth = scan.truth
assert truth is not None
with_offset = trueline.calibrate(scan)
without = trueline.calibrate(scan, initial=(0.0, truth.tool_from_camera), fix="time-offset")

# %%
fig, ax = plt.subplots()
for name, result in (("time offset held at 0", without), ("time offset estimated", with_offset)):
    distance_mm = np.linalg.norm(result.residuals.offset_m, axis=1) * 1e3
    label = f"{name}: RMS {np.sqrt(np.mean(distance_mm**2)):.3f} mm"
    ax.plot(result.residuals.time_s, distance_mm, ".", markersize=3, label=label)
ax.set(xlabel="time / s", ylabel="distance from the line / mm", yscale="log")
ax.legend()

# %%
rms = [np.sqrt(np.mean(result.residuals.offset_m**2)) for result in (without, with_offset)]
assert rms[0] > 3 * rms[1]

# %% [markdown]
# Then what it means on another seam, as in the paper's Figs. 9 and 10: simulated welds that were measured with a calibration, with the
# time offset applied and left out.

# %%
folder = Path(tempfile.mkdtemp()) / "paper"
trueline.run("reproduce", "--out", str(folder), "--repeats", "1", "--quiet")
straight, curved = (
    np.genfromtxt(folder / f"{weld}_weld_points.csv", delimiter=",", names=True) for weld in ("straight", "c_type")
)

# %%
fig, axes = plt.subplots(2, 1, sharex=True)
for ax, axis in zip(axes, "yz", strict=True):
    for what, style in (("without", "r-"), ("with", "k-")):
        ax.plot(straight["along_mm"], straight[f"{what}_{axis}_mm"], style, linewidth=0.8, label=f"{what} time offset")
    ax.axhline(0.0, color="g", label="truth")
    ax.set(ylabel=f"{axis}, measured − true / mm")
axes[0].set_title("The paper's Fig. 9: a straight weld")
axes[1].set(xlabel="along the weld / mm")
axes[0].legend()

# %%
fig, ax = plt.subplots()
for what, style in (("without", "r-"), ("with", "k-")):
    error_mm = np.sqrt(sum(curved[f"{what}_{axis}_mm"] ** 2 for axis in "xyz"))
    ax.plot(curved["along_mm"], error_mm, style, linewidth=0.8, label=f"{what} time offset: RMS {np.sqrt(np.mean(error_mm**2)):.3f} mm")
ax.set(xlabel="along the weld / mm", ylabel="error / mm", title="The paper's Fig. 10: a C-type weld")
ax.legend()
