# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Planning a scan
# Before the robot moves: the path that shows most within limits, with the uncertainty it will give.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import trueline

folder = Path(tempfile.mkdtemp()) / "plan"
plan = trueline.plan(None, out=folder, tries=400)
sorted(path.name for path in folder.iterdir())

# %%
path = np.genfromtxt(folder / "path.csv", delimiter=",", names=True)
fig, ax = plt.subplots()
for axis in "xyz":
    name = f"{axis}_mm"
    ax.plot(path["time_s"], path[name] - path[name][0], label=name)
ax.set(xlabel="time / s", ylabel="way from the start / mm")
ax.legend()

# %% [markdown]
# What the plan predicts, and what a simulated scan along it gives:

# %%
trueline.run("simulate", "--plan", str(folder), "--exact-guess", "--seed", "1", "--out", str(folder.with_name("scan")), "--quiet")
result = trueline.calibrate(folder.with_name("scan"))
print(result)
assert result.accepted
