"""A recorded scan."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral, Real
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _trueline
from .arrays import floats, whole
from .brief import Brief
from .poses import Poses, matrices
from .run import run
from .sensor import Sensor, SensorText, sensor_text
from .stamps import seconds, stamps_ns
from .stripes import Stripes, stripe_arrays, stripes_of


@dataclass(frozen=True, repr=False)
class Guess(Brief):
    """Time offset in seconds and ``tool_from_camera`` as a 4×4 matrix in metres."""

    time_offset_s: float
    tool_from_camera: NDArray[np.float64]


class Recording:
    """A recorded scan: robot poses, seam features and the sensor. It does not change.

    Made by :func:`open`, :func:`simulate` or :meth:`from_arrays`.
    """

    def __init__(self, inner: _trueline.Recording) -> None:
        self._inner = inner

    @classmethod
    def from_arrays(
        cls,
        robot_times_s: ArrayLike,
        base_from_tool: Poses,
        feature_times_s: ArrayLike,
        points: ArrayLike,
        *,
        sensor: Sensor,
        line: ArrayLike | None = None,
        frame: ArrayLike | None = None,
        feature_sigma: ArrayLike | None = None,
        feature_correlation: ArrayLike | None = None,
        stripes: Stripes | None = None,
        initial: tuple[float, ArrayLike] | Guess | None = None,
    ) -> Recording:
        """A recording from arrays.

        Parameters
        ----------
        robot_times_s, feature_times_s
            Stamps (N,) and (M,), rising; seconds, nanoseconds as integers, or ``datetime64``. Both in one clock, except for the unknown offset.
        base_from_tool
            Poses: (N, 4, 4) in metres, a pair (positions, scipy ``Rotation``), or a scipy ``RigidTransform``.
        points
            Seam features: (M, 2) distorted pixels of a camera, (M, 2) x and z in metres of a profiler, (M, 3) points in
            metres.
        sensor
            The sensor: a class of this package, the tables of a ``sensor.toml``, or its path.
        line
            Line of each feature, from 0; all on one line by default.
        frame
            The counter (M,) of the pictures; a jump in it is a lost picture.
        feature_sigma
            Standard deviations (M, 2) in the unit of the points.
        feature_correlation
            Correlation (M,) of the two errors, −1 to 1; 0 by default.
        stripes
            The stripes on the plates of the seam. Without points, the crossing of two stripes is the point.
        initial
            A first guess: time offset in seconds and ``tool_from_camera``, 4×4 in metres. None is needed.

        Raises
        ------
        TruelineError
            The first row that cannot be used, with a hint.
        """
        arrays = (
            _robot_stamps_ns(robot_times_s),
            matrices(base_from_tool),
            stamps_ns(feature_times_s, "feature_times_s"),
            floats("points", points, "M", "2 or 3"),
        )
        extras = (
            None if line is None else whole("line", line),
            None if frame is None else whole("frame", frame),
            None if feature_sigma is None else floats("feature_sigma", feature_sigma, "M", "2"),
            None if feature_correlation is None else floats("feature_correlation", feature_correlation, "M"),
        )
        by_stripes = stripe_arrays(stripes)
        text, guess = sensor_text(sensor), guess_arrays(initial)
        return cls(_trueline.Recording.from_arrays(text, arrays, extras, by_stripes, guess))

    @cached_property
    def robot_times_s(self) -> NDArray[np.float64]:
        """Stamps of the poses (N,), s."""
        return seconds(self._inner.robot_stamps_ns())

    @cached_property
    def base_from_tool(self) -> NDArray[np.float64]:
        """Poses (N, 4, 4), m."""
        return self._inner.base_from_tool()

    @cached_property
    def feature_times_s(self) -> NDArray[np.float64]:
        """Stamps of the features (M,), s."""
        return seconds(self._inner.feature_stamps_ns())

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """Features: (M, 2) px or m, or (M, 3) m."""
        return self._inner.points()

    @cached_property
    def line(self) -> NDArray[np.int64]:
        """The line of each feature (M,)."""
        return self._inner.lines()

    @cached_property
    def feature_sigma(self) -> NDArray[np.float64] | None:
        """Standard deviations (M, 2) of the features, px or m; NaN if one has none, ``None`` if
        none has any."""
        sigma, _ = self._inner.feature_errors()
        return None if np.isnan(sigma).all() else sigma

    @cached_property
    def feature_correlation(self) -> NDArray[np.float64] | None:
        """Correlation (M,) of the errors whose standard deviations :attr:`feature_sigma` holds; ``None`` without these."""
        _, correlation = self._inner.feature_errors()
        return None if self.feature_sigma is None else correlation

    @cached_property
    def stripes(self) -> Stripes | None:
        """The stripes on the plates that meet in the seam; ``None`` where only seam points are known."""
        found = stripes_of(self._inner.stripes())
        return found if len(np.asarray(found.sigma)) else None

    @property
    def sensor(self) -> SensorText:
        """The sensor."""
        return SensorText(self._inner.sensor_toml())

    @property
    def truth(self) -> Guess | None:
        """Truth of a simulation; ``None`` for a real scan."""
        truth = self._inner.truth()
        return None if truth is None else Guess(*truth)

    @property
    def notes(self) -> list[str]:
        """Remarks about the file it was opened from."""
        return self._inner.notes()

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Write a dataset folder."""
        self._inner.write(folder)

    def __repr__(self) -> str:
        poses, features = len(self.robot_times_s), len(self.feature_times_s)
        return f"<trueline.Recording: {poses} robot poses, {features} features>"


RecordingLike: TypeAlias = Recording | str | os.PathLike[str]
"""A recording, or the path of a dataset folder, an .mcap or a bag."""


def open(path: str | os.PathLike[str], *, joint: str | None = None) -> Recording:
    """Open a dataset folder, a recording in MCAP or a bag of rosbag2; with pictures, or profiles, instead of features the seam
    is found in them.

    Parameters
    ----------
    path
        The folder or the file.
    joint
        The joint that pictures show, as in ``trueline calibrate --joint``; by default they tell.

    Raises
    ------
    TruelineError
        The first file, line and column that cannot be used, with a hint.
    """
    return Recording(_trueline.Recording.open(path, joint))


def join(recordings: Sequence[RecordingLike]) -> Recording:
    """Several scans of one sensor as one: the same time offset and hand-eye transform, each with its own lines.

    Raises
    ------
    TruelineError
        Scans of different sensors.
    """
    return Recording(_trueline.Recording.join([opened(one)._inner for one in recordings]))


def simulate(preset: str = "quick", *options: str, seed: int = 1, random_cell: bool = False) -> Recording:
    """Simulate a scan; its ``truth`` is known.

    Parameters
    ----------
    preset
        A name of ``trueline simulate --preset``.
    *options
        Further words of ``trueline simulate``: ``"--plates"``, ``"--outliers"``, ``"0.4"``, …
    seed
        Seed of the noise.
    random_cell
        Draw time offset, hand-eye transform and seam anew, instead of the preset's.

    Examples
    --------
    >>> simulate("quick", seed=1)
    <trueline.Recording: 5001 robot poses, 659 features>
    """
    if not isinstance(seed, Integral) or seed < 0:
        raise ValueError(f"seed: expected a whole number of at least zero, found {seed!r}")
    if not options:
        return Recording(_trueline.Recording.simulate(preset, int(seed), random_cell))
    words = ["--preset", preset, "--seed", str(seed), *(["--random-cell"] if random_cell else []), *options]
    with tempfile.TemporaryDirectory() as folder:
        run("simulate", "--out", f"{folder}/scan", "--quiet", *words)
        return open(f"{folder}/scan")


# No scan is driven with a pose every second: such times are milliseconds.
_LONGEST_STEP_NS = 10**9


def _robot_stamps_ns(times: ArrayLike) -> NDArray[np.int64]:
    stamps = stamps_ns(times, "robot_times_s")
    if len(stamps) > 1 and float(np.median(np.diff(stamps))) > _LONGEST_STEP_NS:
        step_s = float(np.median(np.diff(stamps))) / 1e9
        raise ValueError(f"robot_times_s: the poses are {step_s:g} s apart; are these times in milliseconds?")
    return stamps


def opened(recording: RecordingLike) -> Recording:
    """The recording itself, or that of a path."""
    return recording if isinstance(recording, Recording) else open(recording)


def guess_arrays(guess: tuple[float, ArrayLike] | Guess | None) -> tuple[float, NDArray[np.float64]] | None:
    """A guess as the compiled half takes it."""
    if guess is None:
        return None
    if isinstance(guess, Guess):
        guess = (guess.time_offset_s, guess.tool_from_camera)
    if not isinstance(guess, tuple) or len(guess) != 2 or not isinstance(guess[0], Real):
        raise TypeError(f"initial: expected (time offset in s, tool_from_camera 4×4 in m), found {guess!r}")
    return float(guess[0]), floats("initial", guess[1], "4", "4")
