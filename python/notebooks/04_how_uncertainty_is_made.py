# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # How uncertainty is made
# A seam point that is measured later is off by so much (one standard deviation), and for these reasons:

# %%
import tempfile

import matplotlib.pyplot as plt
import numpy as np
import trueline
from trueline import fleet

result = trueline.calibrate(trueline.simulate("quick", seed=1))
budget = result.document["seam_error"]["budget_mm"]
fig, ax = plt.subplots()
ax.barh(list(budget), list(budget.values()))
ax.set(xlabel="seam error / mm", title=f"together {result.seam_error_mm:.3f} mm")

# %%
assert result.seam_error_mm is not None
together = np.sqrt(sum(part**2 for part in budget.values()))
assert abs(together - result.seam_error_mm) < 1e-6 * result.seam_error_mm

# %% [markdown]
# `sigma` holds all of it, `sigma_noise` the random part, which a longer scan makes smaller. `covariance` contains the correlations.

# %%
print("all:      ", result.sigma.translation_m * 1e3, "mm")
print("of noise: ", result.sigma_noise.translation_m * 1e3, "mm")

# %%
result.plot_covariance()

# %% [markdown]
# ## Are the ± true?
# Forty simulated cells, each drawn anew, with a perfect sensor and robot: only the random part of the ± is compared. If the covariance
# is true, errorᵀ·covariance⁻¹·error over its seven numbers is one on average.

# %%
study = fleet.monte_carlo(
    range(40), out=tempfile.mkdtemp(), preset="quick", sensor_mode="fixed", robot_accuracy_mm=0.0, feature_bias_px=0.0
)
print(study.acceptance, study.nees)

# %%
errors_ms = [row["time_offset_error_s"] * 1e3 for row in study.table.to_pylist() if row["time_offset_error_s"] is not None]
fig, ax = plt.subplots()
ax.hist(errors_ms, bins=15)
ax.set(xlabel="error of the time offset / ms", ylabel="cells")

# %%
assert study.acceptance > 0.8
# Seven numbers a cell: the mean of 40 scatters by √(2 / 280) = 0.085.
assert abs(study.nees - 1.0) < 5 * 0.085
assert np.isfinite(errors_ms).all()
