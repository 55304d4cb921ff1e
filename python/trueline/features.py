"""Pictures as arrays to seam features."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _trueline
from .sensor import Sensor, sensor_text
from .stamps import seconds, stamps_ns


@dataclass(frozen=True)
class Seams:
    """Seam points of the pictures that show one.

    ``line`` (M,) numbers the seams of a picture that shows two (a groove), ``pixels`` (M, 2) are distorted, ``sigma_px``
    (M, 2) their standard deviations, ``picture`` (M,) their pictures' numbers
    and ``not_found`` the numbers of the others with the reason.
    """

    joint: str
    times_s: NDArray[np.float64]
    picture: NDArray[np.int64]
    line: NDArray[np.int64]
    pixels: NDArray[np.float64]
    sigma_px: NDArray[np.float64]
    not_found: dict[int, str]


def find_seams(
    pictures: NDArray[np.uint8] | NDArray[np.uint16],
    times_s: ArrayLike,
    *,
    sensor: Sensor,
    joint: str | None = None,
) -> Seams:
    """Find the seam in the pictures of a scan.

    Parameters
    ----------
    pictures
        Gray pictures (N, height, width), 8 or 16 bits.
    times_s
        Their stamps (N,), s.
    sensor
        A camera and its laser plane.
    joint
        The joint's name, as in ``trueline features --joint``; by default the pictures tell.

    Raises
    ------
    TruelineError
        Pictures of another size than the camera's, or a sensor without a camera.
    """
    found = _trueline.find_seams(sensor_text(sensor), pictures, stamps_ns(times_s), joint)
    return Seams(
        joint=found["joint"],
        times_s=seconds(found["stamp_ns"]),
        picture=found["picture"],
        line=found["line"],
        pixels=found["pixels"],
        sigma_px=found["sigma_px"],
        not_found=dict(found["not_found"]),
    )
