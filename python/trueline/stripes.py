"""The stripe on each plate of a joint, picture by picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import floats, whole
from .brief import Brief
from .stamps import seconds, stamps_ns


@dataclass(frozen=True, repr=False)
class Stripes(Brief):
    """Stripes on plates, each known by two of its points whose errors perpendicular to it are independent.

    Parameters
    ----------
    times_s
        Stamps (S,), s: those of the seam points of the same pictures.
    plate
        The plate (S,): 2k and 2k + 1 meet in line k.
    points
        Two support points (S, 2, 2) or (S, 2, 3): px, or m.
    sigma
        Standard deviation (S,) of each point perpendicular to the stripe, px or m.
    """

    times_s: ArrayLike
    plate: ArrayLike
    points: ArrayLike
    sigma: ArrayLike


StripeArrays = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]


def stripe_arrays(stripes: Stripes | None) -> StripeArrays | None:
    """Stripes as the compiled half takes them."""
    if stripes is None:
        return None
    return (
        stamps_ns(stripes.times_s, "stripes.times_s"),
        whole("stripes.plate", stripes.plate),
        floats("stripes.points", stripes.points, "S", "2", "2 or 3"),
        floats("stripes.sigma", stripes.sigma, "S"),
    )


def stripes_of(columns: dict[str, NDArray[Any]]) -> Stripes:
    """Stripes as the compiled half gives them."""
    return Stripes(seconds(columns["stamp_ns"]), columns["plate"], columns["points"], columns["sigma"])
