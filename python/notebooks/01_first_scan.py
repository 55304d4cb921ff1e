# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # First scan
# A simulated scan is calibrated and looked at. With your own data, `trueline.open("folder")` takes the place of `simulate`.

# %%
import trueline

scan = trueline.simulate("good", seed=1)
scan

# %%
result = trueline.calibrate(scan)
print(result)

# %% [markdown]
# The hand-eye transform is 4×4 in metres, and everything has its uncertainty.

# %%
result.tool_from_camera.round(4), result.sigma

# %%
result.plot_residuals()

# %% [markdown]
# The solver's way there: the paper's Figs. 6 and 8.

# %%
import matplotlib.pyplot as plt

fig, axes = plt.subplots(1, 2, figsize=(10, 4))
result.plot_convergence(axes[0])
result.plot_convergence(axes[1], of="translation")

# %%
assert result.accepted and result.time_offset_s is not None
assert result.sigma.time_offset_s is not None and scan.truth is not None
assert abs(result.time_offset_s - scan.truth.time_offset_s) < 5 * result.sigma.time_offset_s
