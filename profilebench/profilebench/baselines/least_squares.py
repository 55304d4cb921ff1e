"""Levenberg–Marquardt with Huber weights and Jacobians by differences, for residuals in groups (one a reading)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..rotations import Floats

Residual = Callable[[Floats], Floats]
"""Residuals (n, k), n groups of k, of a step from the current state."""
HUBER_SIGMAS = 1.345
"""Huber's constant: 95 % efficiency for Gaussian noise."""
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True)
class Fit:
    """End of the iteration."""

    step: Floats
    residuals: Floats
    jacobian: Floats
    weights: Floats
    converged: bool

    @property
    def rms(self) -> float:
        """Weighted RMS of the groups' norms."""
        return float(np.sqrt((self.weights * (self.residuals**2).sum(1)).sum() / self.weights.sum()))

    def covariance(self) -> Floats:
        """σ² (JᵀWJ)⁻¹ with σ² from the weighted residuals; the pseudo-inverse where a direction is hidden."""
        n, k, m = self.jacobian.shape
        J = (self.jacobian * np.sqrt(self.weights)[:, None, None]).reshape(n * k, m)
        r = (self.residuals * np.sqrt(self.weights)[:, None]).reshape(-1)
        scale = np.linalg.norm(J, axis=0)
        scale[scale == 0] = 1.0
        inverse = np.linalg.pinv((J / scale).T @ (J / scale), hermitian=True) / np.outer(scale, scale)
        # A residual of three numbers beside a line has two degrees of freedom.
        freedom = max(1.0, float(self.weights.sum()) * min(k, 2) - m)
        return np.asarray(inverse * float(r @ r) / freedom, float)


def huber_weights(residuals: Floats, floor: float = 1e-9) -> Floats:
    """Huber weights of groups, scaled by the median of their norms."""
    norms = np.linalg.norm(residuals, axis=1)
    limit = HUBER_SIGMAS * max(MAD_TO_SIGMA * float(np.median(norms)), floor)
    return np.asarray(np.minimum(1.0, limit / np.maximum(norms, floor)), float)


def solve(residual: Residual, size: int, scales: Floats, steps: int = 60, tolerance: float = 1e-7) -> Fit:
    """Minimise Huber's loss of `residual(x)` from x = 0; `scales` are the steps of the differences and their units."""
    x = np.zeros(size)
    r = residual(x)
    damping, converged = 1e-4, False
    weights = huber_weights(r)
    for _ in range(steps):
        J = jacobian(residual, x, r, scales)
        weights = huber_weights(r)
        flat = (J * np.sqrt(weights)[:, None, None]).reshape(-1, size) * scales
        g = flat.T @ (r * np.sqrt(weights)[:, None]).reshape(-1)
        H = flat.T @ flat
        cost = float((weights[:, None] * r**2).sum())
        for _ in range(12):
            move = -np.linalg.solve(H + damping * np.diag(np.diag(H) + 1e-12 * np.trace(H)), g) * scales
            trial = residual(x + move)
            if float((weights[:, None] * trial**2).sum()) < cost:
                break
            damping *= 10
        else:
            converged = True
            break
        gain = 1 - float((weights[:, None] * trial**2).sum()) / max(cost, 1e-300)
        x, r, damping = x + move, trial, max(damping / 10, 1e-12)
        if gain < tolerance:
            converged = True
            break
    return Fit(x, r, jacobian(residual, x, r, scales), huber_weights(r), converged)


def jacobian(residual: Residual, x: Floats, at: Floats, scales: Floats) -> Floats:
    """Jacobian (n, k, m) by forward differences of a thousandth of the scales."""
    columns = []
    for k, scale in enumerate(scales):
        moved = x.copy()
        moved[k] += 1e-3 * scale
        columns.append((residual(moved) - at) / (1e-3 * scale))
    return np.stack(columns, 2)
