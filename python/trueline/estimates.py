"""The values of a result, each with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .brief import Brief


@dataclass(frozen=True, repr=False)
class Fact(Brief):
    """A reason or a warning: a stable code, a sentence, and the values in it."""

    code: str
    text: str
    values: dict[str, Any]

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, repr=False)
class Sigma(Brief):
    """One standard deviation; NaN where a direction is not observable, ``None`` for what has none at all.

    Rotation is a left perturbation in the tool frame.
    """

    time_offset_s: float | None
    rotation_rad: NDArray[np.float64]
    translation_m: NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Covariance(Brief):
    """Covariance of everything estimated; each name ends in its unit."""

    names: list[str]
    matrix: NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Line(Brief):
    """A line in base, m."""

    label: str
    point_m: NDArray[np.float64]
    direction: NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Plane(Brief):
    """A plate in base: normal · point is the offset. NaN in what is not observable.

    ``sigma_rad`` is the standard deviation of the normal about the axis about which it is known least, ``sigma_m`` that of the
    offset in the middle of the scan, ``bow_m`` the largest distance of what was seen from the plane that fits it best.
    """

    label: str
    normal: NDArray[np.float64]
    offset_m: float
    sigma_rad: float
    sigma_m: float
    bow_m: float


@dataclass(frozen=True, repr=False)
class Residuals(Brief):
    """Residuals, one row a feature that could be used.

    ``row`` is the feature's row in the recording, ``normalised`` its distance in standard deviations, ``weight`` that of the
    robust loss.
    """

    row: NDArray[np.int64]
    line: NDArray[np.int64]
    time_s: NDArray[np.float64]
    normalised: NDArray[np.float64]
    weight: NDArray[np.float64]
    offset_m: NDArray[np.float64]
    residual_px: NDArray[np.float64]
    point_in_base_m: NDArray[np.float64]
