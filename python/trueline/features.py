"""Pictures and profiles as arrays to seam features."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _trueline
from .arrays import floats, unmasked
from .sensor import Sensor, SensorText, sensor_text
from .stamps import seconds, stamps_ns
from .stripes import Stripes, stripes_of


@dataclass(frozen=True, repr=False)
class Features:
    """Seam points of pictures or profiles, for :func:`calibrate`.

    ``frame`` (M,) is the number of the picture, and ``line`` (M,) the number of the seam if a picture shows two (a groove).
    ``points`` (M, 2) are distorted pixels, or x and z in metres, ``sigma`` (M, 2) their standard deviations, and ``correlation``
    (M,) is the correlation of the two errors. ``stripes`` are the stripes on the plates of the seam. ``not_found`` has the numbers
    of the other pictures with the reason.
    """

    joint: str
    times_s: NDArray[np.float64]
    frame: NDArray[np.int64]
    line: NDArray[np.int64]
    points: NDArray[np.float64]
    sigma: NDArray[np.float64]
    correlation: NDArray[np.float64]
    stripes: Stripes
    not_found: dict[int, str]

    def __repr__(self) -> str:
        count = len(self.not_found)
        without = f", none in {count} frame{'s' if count > 1 else ''}" if count else ""
        return f"<trueline.Features: {self.joint}, {len(self.times_s)} seam points{without}>"


def features(
    frames: NDArray[Any],
    times_s: ArrayLike,
    *,
    sensor: Sensor,
    joint: str | None = None,
    stripe: str | None = None,
    region: Sequence[tuple[float, float]] | None = None,
) -> Features:
    """Find the seam in the pictures, or the profiles, of a scan.

    Parameters
    ----------
    frames
        Of a camera, gray pictures (N, height, width) of 8 or 16 bits. Of a profiler, profiles (N, K, 2): x along the stripe and
        z range of K points, m, NaN for no return. Views and arrays of any order are accepted.
    times_s
        Their stamps (N,), s.
    sensor
        The sensor.
    joint
        The joint's name, as in ``trueline features --joint``; by default it is detected. Profiles are searched for
        ``fillet``, ``v-groove``, ``corner``, ``lap``, ``butt`` and ``edge``.
    stripe
        Which of several places to take, as in ``trueline features --stripe``. Of pictures only.
    region
        Look here only: two opposite corners (u, v), upper left first, or the corners of a polygon, px. Of pictures only.

    Raises
    ------
    TruelineError
        Pictures of another size than the camera's, names that are none, a sensor that gives neither pictures nor profiles, profiles
        in millimetres.
    ValueError
        An array of another shape or type.

    Examples
    --------
    Profiles of a fillet of 90° whose corner is at x = 2 mm, z = 300 mm:

    >>> from trueline import Profiler
    >>> x = np.linspace(-30e-3, 30e-3, 601)
    >>> z = 0.3 - np.abs(x - 2e-3)
    >>> found = features(np.stack([x, z], axis=1)[None], [0.0], sensor=Profiler())
    >>> found.points.round(6)
    array([[0.002, 0.3  ]])
    """
    text = sensor_text(sensor)
    if SensorText(text).kind != "profiler":
        how = (joint, stripe, None if region is None else [list(corner) for corner in region])
        return _features(_trueline.picture_seams(text, _pictures(frames), stamps_ns(times_s, "times_s"), how))
    for name, value in (("stripe", stripe), ("region", region)):
        if value is not None:
            raise TypeError(f"features: {name} is for pictures; of the options only joint is for profiles")
    profiles = floats("profiles", frames, "N", "K", "2")
    return _features(_trueline.profile_seams(profiles, stamps_ns(times_s, "times_s"), joint))


def _pictures(frames: NDArray[Any]) -> NDArray[Any]:
    pictures = unmasked("pictures", frames)
    if pictures.ndim != 3:
        raise ValueError(
            f"pictures: expected gray pictures (N, height, width), found {pictures.shape}; of colour take the channel of the laser"
        )
    if pictures.dtype.kind != "u" or pictures.dtype.itemsize > 2:
        raise ValueError(f"pictures: expected uint8 or uint16, found {pictures.dtype}; scaling and rounding are yours to choose")
    # Of another machine's byte order.
    return pictures if pictures.dtype.isnative else pictures.astype(pictures.dtype.newbyteorder("="))


def _features(found: dict[str, Any]) -> Features:
    own = {name: found[name] for name in ("joint", "frame", "line", "points", "sigma", "correlation")}
    return Features(
        **own,
        times_s=seconds(found["stamp_ns"]),
        stripes=stripes_of(found["stripes"]),
        not_found=dict(found["not_found"]),
    )
