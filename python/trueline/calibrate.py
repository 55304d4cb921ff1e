"""The main job."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Literal, TypedDict, Unpack, overload

from numpy.typing import ArrayLike

from .poses import Poses
from .recording import Guess, Recording, empty_options, guess_arrays, open
from .result import Result
from .sensor import Sensor


class Options(TypedDict, total=False):
    """Options of a calibration; every one is an option of ``trueline calibrate`` as well."""

    residual: Literal["sheet", "point-to-line"]
    loss: Literal["squared", "huber", "cauchy", "geman-mcclure", "tukey"]
    fix: Sequence[Literal["time-offset", "hand-eye"]]
    stamps: Literal["auto", "raw", "regular"]
    sensor_mode: Literal["fixed", "prior", "free"]
    robot_accuracy_mm: float
    feature_bias_px: float
    feature_sigma_px: float
    feature_sigma_mm: float
    robot_sigma_mm: float
    stamp_sigma_ms: float
    offset_within_s: float
    looks: Literal["+x", "-x", "+y", "-y", "+z", "-z"]
    speed_mm_s: float
    stand_off_mm: float
    accept_partial: bool
    require_ms: float
    require_deg: float
    require_mm: float


@overload
def calibrate(
    recording: Recording | str | os.PathLike[str],
    /,
    *,
    initial: tuple[float, ArrayLike] | Guess | None = None,
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
    feature_sigma: ArrayLike | None = None,
    initial: tuple[float, ArrayLike] | Guess | None = None,
    **options: Unpack[Options],
) -> Result: ...
def calibrate(
    robot_times_s: Recording | str | os.PathLike[str] | ArrayLike,
    base_from_tool: Poses = None,
    feature_times_s: ArrayLike | None = None,
    points: ArrayLike | None = None,
    *,
    sensor: Sensor | None = None,
    line: ArrayLike | None = None,
    feature_sigma: ArrayLike | None = None,
    initial: tuple[float, ArrayLike] | Guess | None = None,
    **options: Unpack[Options],
) -> Result:
    """Estimate time offset, hand-eye transform and lines from one scan.

    Takes a :class:`Recording`, the path of a dataset folder, an .mcap or a bag, or arrays as
    :meth:`Recording.from_arrays` does.

    Parameters
    ----------
    initial
        A first guess: time offset in seconds and ``tool_from_camera``, 4×4 in metres. None is needed.
    **options
        The options of ``trueline calibrate``, by their names with underscores; ``sensor_mode`` is ``--sensor``.

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
    inner = _recording(robot_times_s, base_from_tool, feature_times_s, points, sensor, line, feature_sigma)
    return Result.of(inner._inner.calibrate(_known(options), guess_arrays(initial)))


def _recording(
    first: Recording | str | os.PathLike[str] | ArrayLike,
    base_from_tool: Poses,
    feature_times_s: ArrayLike | None,
    points: ArrayLike | None,
    sensor: Sensor | None,
    line: ArrayLike | None,
    feature_sigma: ArrayLike | None,
) -> Recording:
    rest = {
        "base_from_tool": base_from_tool,
        "feature_times_s": feature_times_s,
        "points": points,
        "sensor": sensor,
    }
    if isinstance(first, Recording | str | os.PathLike):
        extra = [name for name, value in rest.items() if value is not None]
        extra += [name for name, value in (("line", line), ("feature_sigma", feature_sigma)) if value is not None]
        if extra:
            raise TypeError(f"calibrate: {', '.join(extra)} cannot be given for a recording that has its own")
        return first if isinstance(first, Recording) else open(first)
    missing = [name for name, value in rest.items() if value is None]
    if missing or feature_times_s is None or points is None or sensor is None:
        raise TypeError(f"calibrate: from arrays, {', '.join(missing)} must be given as well")
    return Recording.from_arrays(
        first, base_from_tool, feature_times_s, points, sensor=sensor, line=line, feature_sigma=feature_sigma
    )


def _known(options: Options) -> dict[str, object]:
    known = empty_options()
    given: dict[str, object] = dict(options)
    known["require"] = [given.pop(name, None) for name in ("require_ms", "require_deg", "require_mm")]
    unknown = sorted(set(given) - set(known))
    if unknown:
        raise TypeError(f"calibrate: there is no option {unknown[0]!r}; options are {', '.join(sorted(known))}")
    if isinstance(given.get("fix"), str):
        given["fix"] = [given["fix"]]
    return known | given
