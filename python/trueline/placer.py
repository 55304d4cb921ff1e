"""Points in base while the robot moves."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _trueline
from .arrays import floats
from .brief import Brief
from .options import checked
from .result import Result, load
from .sensor import Sensor, sensor_text
from .stamps import Stamp, moments_ns

StampRule = Literal["as-stamped", "lower-envelope"]


class PlacerSettings(TypedDict, total=False):
    """Settings of a :class:`Placer`; the defaults suit a robot that reports its pose every 1 to 12 ms.

    Stamps ``"as-stamped"`` are the times of the samples. ``"lower-envelope"`` stamps are arrival
    times of an even clock, with delays to one side: samples are dated by the line along the
    earliest ones. By default, poses and frames are treated as in the result.

    ``readout`` states the exposure of the points of one frame: ``"at-once"``, or one after the other, ``readout_step_s`` from one
    index, row or column to the next; the stamp is that of the first. ``reading_sigma_m`` is the standard deviation of a reading
    along each axis of the laser plane; by default it is that of the result's residuals.

    Beyond the last pose one is predicted for up to ``longest_prediction_s``, with an acceleration of ``acceleration_m_s2`` and
    ``angular_acceleration_rad_s2`` (standard deviations) in the ±. Poses between which the tool is faster than ``fastest_m_s`` or
    ``fastest_rad_s`` are no motion.
    """

    pose_stamps: StampRule
    frame_stamps: StampRule
    axis_stamps: StampRule
    readout: Literal["at-once", "by-index", "by-row", "by-column"]
    readout_step_s: float
    reading_sigma_m: float
    stamp_sigma_s: float
    half_window_s: float
    longest_prediction_s: float
    acceleration_m_s2: float
    angular_acceleration_rad_s2: float
    fastest_m_s: float
    fastest_rad_s: float
    poses_kept: int


@dataclass(frozen=True, repr=False)
class Placed(Brief):
    """The points of a frame in base.

    ``points_m`` (N, 3) and ``sigma_m`` (N,), the root mean square of the distance from the true point. A point that cannot be placed is NaN,
    and its ± infinite. ``exposed_ns`` is when the first of them was exposed, by the robot's clock, and ``age_s`` how long before the last
    pose, negative where the pose is predicted. ``refused`` says why no point could be placed, else it is ``None``.
    """

    points_m: NDArray[np.float64]
    sigma_m: NDArray[np.float64]
    exposed_ns: int | None
    age_s: float | None
    refused: str | None


@dataclass(frozen=True, repr=False)
class Health(Brief):
    """The state of the streams of a :class:`Placer`.

    ``is_settled`` tells whether frames can be placed, ``is_stalled`` whether poses are missing for longer than is bridged. ``silent_s`` is
    the time since the last pose. ``poses_late_s`` and ``frames_late_s`` are the largest usual delays, zero where stamps are taken as they
    are. ``axes_stalled`` names the external axes whose values are missing.
    """

    is_settled: bool
    is_stalled: bool
    silent_s: float | None
    pose_period_s: float
    pose_noise_m: float
    pose_noise_rad: float
    poses_late_s: float
    frames_late_s: float
    pose_clock_jumps: int
    frame_clock_jumps: int
    axes_stalled: list[str]


class Placer:
    """Places the points of a running sensor in base: each at its true exposure, each with its ±.

    Poses and frames go in as they arrive. A frame is placed at its stamp minus the time offset, by
    the interpolation of the estimate. A frame that cannot be placed is refused with the reason:
    there is never a wrong point with a small ±. The GIL is released meanwhile, and several threads
    may share a placer.

    Parameters
    ----------
    result
        The calibration, or its file.
    sensor
        The calibrated sensor. A file with other content than the result's sensor is refused.
    standing
        External axes without a place in the result because they stood still in its scan, and that still stand there.
    in_pose
        External axes with a motion that the controller's poses already contain: direction and a point (m) in base, from the controller.
    **settings
        :class:`PlacerSettings`.

    Raises
    ------
    TruelineError
        If the result does not determine time offset, hand-eye transform or an axis, or belongs to another sensor.

    Examples
    --------
    >>> import trueline
    >>> scan = trueline.simulate("profiler", seed=1)
    >>> placer = trueline.Placer(trueline.calibrate(scan), scan.sensor)
    >>> placer.push_pose(scan.robot_times_s, scan.base_from_tool)
    >>> placed = placer.place(scan.feature_times_s[100], scan.points[100:101])
    >>> placed.points_m.shape, placed.refused
    ((1, 3), None)
    """

    def __init__(
        self,
        result: Result | str | os.PathLike[str],
        sensor: Sensor,
        *,
        standing: Sequence[str] = (),
        in_pose: Mapping[str, tuple[Sequence[float], Sequence[float]]] | None = None,
        **settings: Unpack[PlacerSettings],
    ) -> None:
        known = result if isinstance(result, Result) else load(result)
        every = dict.fromkeys(PlacerSettings.__annotations__) | checked(settings, PlacerSettings, ("standing", "in_pose"))
        axes = [
            (name, [float(x) for x in direction], [float(x) for x in point])
            for name, (direction, point) in (in_pose or {}).items()
        ]
        self._inner = _trueline.Placer(
            known.json(), sensor_text(sensor), _sha256_of(sensor), every | {"standing": list(standing), "in_pose": axes}
        )

    @property
    def axes(self) -> list[str]:
        """Names of the external axes."""
        return self._inner.axes()

    def push_pose(self, stamp: Stamp | ArrayLike, base_from_tool: ArrayLike) -> None:
        """Take a pose that has arrived: 4×4, tool to base, m; or several, (N, 4, 4), in the order of their arrival.

        Parameters
        ----------
        stamp
            Whole numbers are nanoseconds, others seconds; ``datetime64`` is taken to the nanosecond.

        Raises
        ------
        TruelineError
            For what is no pose, and for stamps that do not rise. The stream goes on.
        """
        poses = np.asarray(base_from_tool)
        if poses.ndim == 2:
            poses = poses[np.newaxis]
        self._inner.push_poses(moments_ns(stamp, "stamp"), floats("base_from_tool", poses, "N", "4", "4"))

    def push_axis(self, axis: str, stamp: Stamp | ArrayLike, value: ArrayLike) -> None:
        """Take a value of an external axis, its angle (rad) or its way (m), or several in the order of their arrival.

        Without values up to an exposure no frame is placed.

        Raises
        ------
        TruelineError
            For an axis that is not in the result, values that are not numbers, and stamps that do not rise. The stream goes on.
        """
        self._inner.push_axis(axis, moments_ns(stamp, "stamp"), floats("value", np.atleast_1d(np.asarray(value)), "N"))

    def place(self, stamp: Stamp, points: ArrayLike) -> Placed:
        """Place the points of a frame: (x, z) of a profiler or (x, y, z), m, or pixels (u, v); a point that did not come back is NaN.

        Parameters
        ----------
        stamp
            The frame's own stamp, before the time offset is taken off.
        """
        numbers = floats("points", points, "N", "2 or 3")
        return Placed(*self._inner.place(int(moments_ns(stamp, "stamp")[0]), numbers))

    def health(self, now: Stamp) -> Health:
        """The state of the streams at a time of their clock."""
        return Health(**self._inner.health(int(moments_ns(now, "now")[0])))

    def __repr__(self) -> str:
        return f"<trueline.Placer: axes {', '.join(self.axes)}>" if self.axes else "<trueline.Placer>"


def _sha256_of(sensor: Sensor) -> str | None:
    """SHA-256 of the file of a sensor; ``None`` for a sensor that is no file."""
    if not isinstance(sensor, str | os.PathLike):
        return None
    path = Path(sensor)
    return hashlib.sha256((path / "sensor.toml" if path.is_dir() else path).read_bytes()).hexdigest()
