# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Compared with a hand-eye transform that ignores time
# Board-based tools need a robot that stands still: they know no time offset. Here the same scan is solved with the offset
# held at zero, as such a tool would, and with it estimated.

# %%
import numpy as np
import trueline

scan = trueline.simulate("good", seed=3)
truth = scan.truth


def off_mm(result: trueline.Result) -> float:
    return float(np.linalg.norm(result.tool_from_camera[:3, 3] - truth.tool_from_camera[:3, 3]) * 1e3)


ignoring = trueline.calibrate(scan, initial=(0.0, truth.tool_from_camera), fix="time-offset")
estimating = trueline.calibrate(scan)
print(f"time offset ignored: {off_mm(ignoring):.2f} mm off; estimated: {off_mm(estimating):.2f} mm off")

# %%
assert off_mm(estimating) < off_mm(ignoring)
