"""Plots by matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

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


def convergence(offsets_ms: list[float], ax: Axes | None = None) -> Axes:
    """The time offset after every step of the solver."""
    ax = _axes(ax)
    ax.plot(np.arange(len(offsets_ms)), offsets_ms, "o-", markersize=3)
    ax.set(xlabel="step of the solver", ylabel="time offset / ms", title="Convergence")
    return ax


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
