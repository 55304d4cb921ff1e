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
    """One standard deviation; NaN if a direction is not observable, ``None`` if there is no
    uncertainty.

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
class Curve(Brief):
    """A curve in base, m: the seam, where no straight line explains the scan.

    ``points_m`` (n, 3) are points along it in the order of the scan, and ``sigma_m`` (n,) is the standard deviation of each,
    perpendicular to the curve. Both are empty if the scan does not determine the curve's place. The last point of a closed curve
    is its first again.
    """

    label: str
    closed: bool
    length_m: float
    points_m: NDArray[np.float64]
    sigma_m: NDArray[np.float64]
    cad: Cad | None


@dataclass(frozen=True, repr=False)
class Cad(Brief):
    """The pose of a drawing: ``used`` is false if the scan alone is more certain than its
    tolerance. ``base_from_part`` is 4×4 in metres, NaN if the scan does not determine it.

    ``rms_m`` is the distance of the seam from the drawing. The drawing also fits after a turn of ``symmetry_rad`` about
    ``symmetry_axis`` through ``symmetry_point_m``; it is NaN if any turn fits. The axis is ``None`` without a symmetry.
    """

    file: str
    tolerance_m: float
    used: bool
    base_from_part: NDArray[np.float64]
    rms_m: float
    symmetry_axis: NDArray[np.float64] | None
    symmetry_point_m: NDArray[np.float64] | None
    symmetry_rad: float


@dataclass(frozen=True, repr=False)
class Plane(Brief):
    """A plate in base: normal · point is the offset. Unobservable quantities are NaN.

    ``sigma_rad`` is the standard deviation of the normal about its least certain axis, and ``sigma_m`` that of the offset in the
    middle of the scan. ``bow_m`` is the largest distance of the readings from the best plane.
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
