"""The main job."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TypeAlias, Unpack, overload

from numpy.typing import ArrayLike

from .options import Options, as_compiled
from .poses import Poses
from .recording import Guess, Recording, RecordingLike, guess_arrays, join, opened
from .result import Result
from .run import run
from .sensor import Sensor
from .stripes import Stripes

Initial: TypeAlias = tuple[float, ArrayLike] | Guess | None
"""A first guess: time offset in seconds and ``tool_from_camera``, 4×4 in metres."""


@overload
def calibrate(
    recording: RecordingLike | Sequence[RecordingLike],
    /,
    *,
    initial: Initial = None,
    **options: Unpack[Options],
) -> Result: ...
@overload
def calibrate(
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
    initial: Initial = None,
    **options: Unpack[Options],
) -> Result: ...
def calibrate(
    robot_times_s: RecordingLike | Sequence[RecordingLike] | ArrayLike,
    base_from_tool: Poses = None,
    feature_times_s: ArrayLike | None = None,
    points: ArrayLike | None = None,
    *,
    sensor: Sensor | None = None,
    line: ArrayLike | None = None,
    frame: ArrayLike | None = None,
    feature_sigma: ArrayLike | None = None,
    feature_correlation: ArrayLike | None = None,
    stripes: Stripes | None = None,
    initial: Initial = None,
    **options: Unpack[Options],
) -> Result:
    """Estimate time offset, hand-eye transform and lines from one scan, or from several of one sensor.

    Takes a :class:`Recording`, the path of a dataset folder, an .mcap or a bag, several of them, or arrays as
    :meth:`Recording.from_arrays` does.

    Parameters
    ----------
    initial
        A first guess: time offset in seconds and ``tool_from_camera``, 4×4 in metres. None is needed.
    **options
        The options of ``trueline calibrate``, by their names with underscores: :class:`Options`.

    Returns
    -------
    Result
        Also where it is not accepted: see ``accepted`` and ``reasons``.

    Raises
    ------
    TruelineError
        What cannot be used, with a hint.

    Examples
    --------
    From arrays:

    >>> import trueline
    >>> scan = trueline.simulate("quick", seed=2)
    >>> result = trueline.calibrate(
    ...     scan.robot_times_s, scan.base_from_tool, scan.feature_times_s, scan.points, sensor=scan.sensor
    ... )
    >>> abs(result.time_offset_s - scan.truth.time_offset_s) < 5 * result.sigma.time_offset_s
    True
    """
    arrays = {
        "base_from_tool": base_from_tool,
        "feature_times_s": feature_times_s,
        "points": points,
        "sensor": sensor,
    }
    errors = {"feature_sigma": feature_sigma, "feature_correlation": feature_correlation}
    extras = {"line": line, "frame": frame, **errors, "stripes": stripes}
    known = as_compiled(options, ("initial", *arrays, *extras))
    recordings = _recordings(robot_times_s)
    if recordings:
        given = [name for name, value in (arrays | extras).items() if value is not None]
        if given:
            raise TypeError(f"calibrate: {', '.join(given)} cannot be given for a recording that has its own")
        recording = join(recordings) if len(recordings) > 1 else opened(recordings[0])
    else:
        missing = [name for name, value in arrays.items() if value is None]
        if missing:
            raise TypeError(f"calibrate: from arrays, {', '.join(missing)} must be given as well")
        recording = Recording.from_arrays(robot_times_s, **arrays, **extras)  # type: ignore[arg-type]
    return Result.of(recording._inner.calibrate(known, guess_arrays(initial)))


def calibrate_board(dataset: str | os.PathLike[str], board: str) -> Result:
    """The reference by a chessboard that the camera looked at while the robot moved, the laser off.

    Parameters
    ----------
    dataset
        Folder with ``robot.csv``, ``sensor.toml`` and ``images/index.csv``.
    board
        ``"chessboard:COLUMNSxROWS:SQUARE_MM"``, inner corners.

    Returns
    -------
    Result
        Time offset and hand-eye transform; there are no lines.
    """
    return Result(run("calibrate", str(dataset), "--target", "board", "--board", board, "--json", "-", "--quiet"))


def _recordings(first: object) -> list[RecordingLike]:
    """The recordings in the first argument; none if it is an array."""
    if isinstance(first, Recording | str | os.PathLike):
        return [first]
    if isinstance(first, list | tuple) and first and all(isinstance(one, Recording | str | os.PathLike) for one in first):
        return list(first)
    return []
