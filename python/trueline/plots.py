"""Plots by matplotlib."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np

from .names import nearest

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .estimates import Covariance, Residuals


def residuals_over_time(residuals: Residuals, ax: Axes | None = None) -> Axes:
    """Residuals over time in standard deviations."""
    ax = _axes(ax)
    kept = residuals.weight > 0.0
    ax.plot(residuals.time_s[kept], residuals.normalised[kept], ".", markersize=3, label="used")
    ax.plot(residuals.time_s[~kept], residuals.normalised[~kept], "x", markersize=4, label="left out")
    ax.set(xlabel="time / s", ylabel="residual / σ", title="Residuals")
    ax.legend()
    return ax


Quantity: TypeAlias = Literal["time offset", "distance", "translation", "rotation", "line"]
"""Plots of the solver's steps: the paper's Fig. 6a and 6b, Fig. 8 (two of them) and Fig. 7."""


def convergence(steps: list[dict[str, Any]], of: Quantity, ax: Axes | None = None) -> Axes:
    """Distance of a quantity from its end value after every step of the solver, on a logarithmic
    axis.

    The last step is the end value itself: no logarithm shows its distance, so the curves end one step before it.
    """
    if of not in get_args(Quantity):
        raise ValueError(f"of: no {of!r}; one of {', '.join(get_args(Quantity))}.{nearest(str(of), get_args(Quantity))}")
    label, curves = _curves(steps, of)
    ax = _axes(ax)
    for name, values in curves.items():
        off = np.abs(np.asarray(values) - values[-1])
        ax.plot(np.arange(len(steps)), np.where(off > 0.0, off, np.nan), "o-", markersize=3, label=name)
    ax.set(xlabel="step of the solver", ylabel=f"{label}, off from its end", title=f"Convergence of the {of}", yscale="log")
    if len(curves) > 1:
        ax.legend()
    return ax


def _curves(steps: list[dict[str, Any]], of: Quantity) -> tuple[str, dict[str, list[float]]]:
    """The label of the axis, and the curves by name."""
    if of == "time offset":
        return "time offset (ms)", {of: [step["time_offset_s"] * 1e3 for step in steps]}
    if of == "distance":
        return "RMS distance from the line (mm)", {of: [step["rms_mm"] for step in steps]}
    if of == "translation":
        return "translation (mm)", _columns("xyz", [step["translation_mm"] for step in steps])
    if of == "rotation":
        return "rotation", _columns(("qw", "qx", "qy", "qz"), [step["rotation_wxyz"] for step in steps])
    nearest = [[x for line in step["lines"] for x in line["nearest_point_mm"]] for step in steps]
    names = [f"{axis} of line {number}" for number in range(len(nearest[0]) // 3) for axis in "xyz"]
    return "point of the line nearest to the base (mm)", _columns(names, nearest)


def _columns(names: Iterable[str], rows: list[list[float]]) -> dict[str, list[float]]:
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


def correlations(covariance: Covariance, ax: Axes | None = None) -> Axes:
    """Correlations of everything estimated."""
    ax = _axes(ax)
    sigma = np.sqrt(np.diag(covariance.matrix))
    picture = ax.imshow(covariance.matrix / np.outer(sigma, sigma), vmin=-1.0, vmax=1.0, cmap="RdBu_r")
    ticks = range(len(covariance.names))
    ax.set_xticks(ticks, covariance.names, rotation=90, fontsize=7)
    ax.set_yticks(ticks, covariance.names, fontsize=7)
    ax.set_title("Correlations")
    ax.figure.colorbar(picture, ax=ax)
    return ax


def _axes(ax: Axes | None) -> Axes:
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots()[1]
