"""A torch that is led along a seam."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _trueline
from .arrays import floats
from .brief import Brief
from .options import checked


class SeamTrackSettings(TypedDict, total=False):
    """Settings of a :class:`SeamTrack`.

    Points within ``half_window_m`` to either side are averaged. At most ``longest_extrapolation_m`` beyond the last point is a target, where
    the seam may bend by ``curvature_per_m`` (a standard deviation). A point further than ``jump_m`` from where the seam was expected is none
    of it; after eight of these another seam begins.
    """

    half_window_m: float
    longest_extrapolation_m: float
    curvature_per_m: float
    jump_m: float
    points_kept: int


@dataclass(frozen=True, repr=False)
class Target(Brief):
    """Target of a torch. It is advice: whoever moves the robot checks it against the limits of the
    motion.

    ``base_from_torch`` is 4×4, m, with the attitude to the seam that the torch has now. ``along_m`` is the way along the seam from its
    first point; ``tangent``, ``across`` and ``upward`` are directions in base. ``sigma_m`` is the standard deviation across the seam, along
    each of the last two; ``off_m`` is how far off the seam the torch is now, along them.
    """

    base_from_torch: NDArray[np.float64]
    along_m: float
    tangent: Sequence[float]
    across: Sequence[float]
    upward: Sequence[float]
    sigma_m: float
    off_m: Sequence[float]


class SeamTrack:
    """The seam points that a sensor measures ahead of a torch, and where the torch is to be when its command acts.

    Parameters
    ----------
    **settings
        :class:`SeamTrackSettings`.

    Examples
    --------
    >>> track = SeamTrack()
    >>> for k in range(100):
    ...     assert track.push([0.001 * k, 0.0, 0.0], 5e-5) is None
    >>> torch = np.eye(4)
    >>> torch[0, 3] = 0.010
    >>> target = track.ahead(torch, speed_m_s=0.020, delay_s=0.100)
    >>> round(float(target.base_from_torch[0, 3]), 6)
    0.012
    """

    def __init__(self, **settings: Unpack[SeamTrackSettings]) -> None:
        self._inner = _trueline.SeamTrack(
            dict.fromkeys(SeamTrackSettings.__annotations__) | checked(settings, SeamTrackSettings)
        )
        self.refused: str | None = None

    @property
    def length_m(self) -> float:
        """Way from the first to the last point, m."""
        return self._inner.length_m()

    def push(self, point_m: ArrayLike, sigma_m: float) -> str | None:
        """Take a seam point in base, further along the seam than the one before; why it is not taken, or ``None``.

        Raises
        ------
        TruelineError
            For a point that is no number, or a ± that is not above zero.
        """
        point = floats("point_m", point_m, "3")
        if len(point) != 3:
            raise ValueError(f"point_m: expected three numbers, found {len(point)}")
        return self._inner.push(point.tolist(), float(sigma_m))

    def ahead(self, base_from_torch: ArrayLike, speed_m_s: float, delay_s: float) -> Target | None:
        """Target of the torch after ``delay_s`` at ``speed_m_s`` along the seam; ``None`` if
        unknown.

        ``delay_s`` is the loop's whole delay, from the pose that is given to the motion that a command makes. ``refused`` then says why
        there is no target.
        """
        target, self.refused = self._inner.ahead(floats("base_from_torch", base_from_torch, "4", "4"), speed_m_s, delay_s)
        return None if target is None else Target(**target)

    def clear(self) -> None:
        """Forget all points: another seam begins."""
        self._inner.clear()

    def __repr__(self) -> str:
        return f"<trueline.SeamTrack: {self.length_m * 1e3:.1f} mm>"
