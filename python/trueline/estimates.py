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
class Curve(Brief):
    """A curve in base, m: the seam, where no straight line explains the scan.

    ``points_m`` are points along it in the order of the scan, ``(n, 3)``, ``sigma_m`` one standard deviation of each square to the curve;
    both are empty where the scan does not show where the curve is. The last point of a closed curve is its first again.
    """

    label: str
    closed: bool
    length_m: float
    points_m: NDArray[np.float64]
    sigma_m: NDArray[np.float64]
    cad: Cad | None


@dataclass(frozen=True, repr=False)
class Cad(Brief):
    """A drawing where the scan found it: ``used`` is false where the scan alone is surer than its tolerance, ``base_from_part`` is 4×4 in metres, NaN where the scan does not show it.

    ``rms_m`` is how far the seam is off the drawing. About ``symmetry_axis`` through ``symmetry_point_m`` the drawing fits after a turn as
    well; ``symmetry_rad`` is that turn, NaN where it is any. The axis is ``None`` where there is no symmetry.
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
