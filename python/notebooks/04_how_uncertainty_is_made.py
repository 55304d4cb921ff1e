# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Are the ± true?
# Forty simulated cells, each drawn anew, with a perfect sensor and robot: only the random part of the ± is asked for. If the covariance is true, errorᵀ·covariance⁻¹·error over its seven numbers is one
# on average.

# %%
import matplotlib.pyplot as plt
import numpy as np
from trueline import fleet

study = fleet.monte_carlo(range(40), preset="quick", sensor_mode="fixed", robot_accuracy_mm=0.0, feature_bias_px=0.0)
study.acceptance, study.nees

# %%
rows = study.table.to_pylist()
errors_ms = [row["time_offset_error_s"] * 1e3 for row in rows if row["time_offset_error_s"] is not None]
fig, ax = plt.subplots()
ax.hist(errors_ms, bins=15)
ax.set(xlabel="error of the time offset / ms", ylabel="cells")

# %%
assert study.acceptance > 0.8
# Seven numbers a cell: the mean of 40 scatters by √(2 / 280) = 0.085.
assert abs(study.nees - 1.0) < 5 * 0.085
assert np.isfinite(errors_ms).all()
