"""A live recording of robot and camera."""

from __future__ import annotations

import os
import weakref
from collections.abc import Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from . import _trueline
from .brief import Brief
from .options import checked, in_units
from .sensor import Sensor, sensor_text


class RecordOptions(TypedDict, total=False):
    """Options of a live recording; those of ``trueline record`` by their names with underscores.

    ``want_…`` are the parts of ``--want``.
    """

    protocol: Literal["egm", "ur-rtde", "fanuc-hspo", "fanuc-stream-motion", "kuka-rsi"]
    bind: str
    robot: str
    robot_port: int
    camera: str
    replay: str | os.PathLike[str]
    exposure_us: float
    fps: float
    trigger: str
    pixel_format: str
    laser: Literal["red", "green", "blue", "gray"]
    stamp: Literal["first-packet", "complete", "exposure"]
    joint: str
    tool: str
    for_s: float
    want_ms: float
    want_deg: float
    want_mm: float


DEFAULTS = {"protocol": "egm", "stamp": "first-packet", "tool": "tool0"}


@dataclass(frozen=True, repr=False)
class LiveState(Brief):
    """Progress of a recording.

    ``base_from_tool`` is the robot's newest pose, 4×4 in metres. ``robot`` and ``estimate`` are for
    people; the sigmas are the random part, which a longer scan reduces; ``None`` if not known yet.
    ``is_enough`` tells whether what was wanted is reached, and the calibration accepted.
    """

    robot_poses: int
    base_from_tool: NDArray[np.float64] | None
    robot: str
    pictures: int
    pictures_lost: int
    seam_points: int
    estimate: str | None
    time_offset_s: float | None
    time_offset_sigma_s: float | None
    translation_sigma_m: float | None
    rotation_sigma_rad: float | None
    is_enough: bool | None
    advice: list[str]


@dataclass(frozen=True, repr=False)
class Recorded(Brief):
    """Result of a recording; ``complete`` if nothing was lost, else ``words`` report the losses."""

    file: str
    robot_poses: int
    complete: bool
    words: list[str]


class LiveRecording:
    """A recording under way: an iterator over its state, five times a second, and a context manager that ends it.

    ``recorded`` is what became of it, as soon as it has ended.
    """

    def __init__(self, inner: _trueline.LiveRecording) -> None:
        self._inner = inner
        # Also where nobody closes it, and when the interpreter ends: what was recorded is to be whole.
        self._finish = weakref.finalize(self, inner.finish)
        self.recorded: Recorded | None = None

    def __iter__(self) -> Iterator[LiveState]:
        return self

    def __next__(self) -> LiveState:
        state = self._inner.next() if self._finish.alive else None
        if state is None:
            self.close()
            raise StopIteration
        return LiveState(**state)

    def __repr__(self) -> str:
        if self.recorded is not None:
            return f"<trueline.LiveRecording: ended, {self.recorded.robot_poses} robot poses in {self.recorded.file}>"
        return f"<trueline.LiveRecording: {'under way' if self._finish.alive else 'ended'}>"

    def close(self) -> None:
        """End the recording; it returns when all is in the file.

        Raises
        ------
        TruelineError
            If nothing could be recorded, with a hint.
        """
        ended = self._finish()
        if ended is not None:
            self.recorded = Recorded(**ended)

    def __enter__(self) -> LiveRecording:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def record(
    out: str | os.PathLike[str], *, sensor: Sensor | None = None, **options: Unpack[RecordOptions]
) -> LiveRecording:
    """Record a robot that its own program drives, and a camera; nothing that is sent moves the robot.

    Parameters
    ----------
    out
        Folder of the recording, which must hold none; :func:`trueline.open` opens it afterwards.
    sensor
        The sensor, kept in the recording; with a camera there is an estimate meanwhile.
    **options
        The options of ``trueline record``, by their names with underscores: :class:`RecordOptions`.

    Examples
    --------
    ::

        with trueline.record("scan", bind="192.168.125.10:6510", camera="192.168.1.64", sensor="sensor.toml",
                             want_ms=0.1, want_mm=0.1, want_deg=0.05) as cell:
            for state in cell:
                print(state.estimate)
                if state.is_enough:
                    break
        result = trueline.calibrate("scan")
    """
    taken = dict.fromkeys(RecordOptions.__annotations__) | DEFAULTS | checked(options, RecordOptions, ("sensor",))
    text = None if sensor is None else sensor_text(sensor)
    settings = taken | {"out": out, "sensor_toml": text, "want": in_units(taken, "want")}
    return LiveRecording(_trueline.LiveRecording(settings))
