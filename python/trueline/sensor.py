"""The sensor: the Python form of ``sensor.toml``."""

from __future__ import annotations

import numbers
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from .brief import Brief
from .names import text_of


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with the Brown-Conrady distortion, in pixels; (0, 0) is the centre of the top-left pixel.

    Parameters
    ----------
    width, height
        Size of the pictures.
    fx, fy, cx, cy
        Focal lengths and principal point.
    distortion
        k1, k2, p1, p2, k3, in OpenCV's order.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: Sequence[float] = (0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class CameraLaser:
    """A camera that sees the stripe of a laser plane; features are distorted pixels.

    Parameters
    ----------
    camera
        The camera.
    plane_normal
        Normal of the laser plane in the camera frame.
    plane_offset_m
        The plane is where normal · point is this.

    Examples
    --------
    >>> camera = Camera(1280, 1024, fx=1800.0, fy=1800.0, cx=640.0, cy=512.0)
    >>> print(CameraLaser(camera, (0.0, 0.8, -0.6), -0.09).toml())
    kind = "camera_laser"
    <BLANKLINE>
    [camera]
    width = 1280
    height = 1024
    fx = 1800.0
    fy = 1800.0
    cx = 640.0
    cy = 512.0
    distortion = [0.0, 0.0, 0.0, 0.0, 0.0]
    <BLANKLINE>
    [laser_plane]
    normal = [0.0, 0.8, -0.6]
    offset_mm = -90.0
    <BLANKLINE>
    """

    camera: Camera
    plane_normal: Sequence[float]
    plane_offset_m: float

    def toml(self) -> str:
        """The text of its ``sensor.toml``."""
        plane = {"normal": list(self.plane_normal), "offset_mm": self.plane_offset_m * 1e3}
        return _toml({"kind": "camera_laser", "camera": vars(self.camera), "laser_plane": plane})


@dataclass(frozen=True)
class Profiler:
    """A laser profiler; features are (x along the stripe, z range) in its frame, in metres."""

    def toml(self) -> str:
        """The text of its ``sensor.toml``."""
        return _toml({"kind": "profiler"})


@dataclass(frozen=True)
class Points:
    """A sensor that reports points (x, y, z) in its frame, in metres; the laser plane is fitted to them."""

    def toml(self) -> str:
        """The text of its ``sensor.toml``."""
        return _toml({"kind": "points"})


@dataclass(frozen=True, repr=False)
class SensorText(Brief):
    """A sensor as the text of a ``sensor.toml``."""

    text: str

    @property
    def kind(self) -> str:
        """``camera_laser``, ``profiler`` or ``points``."""
        return str(tomllib.loads(self.text)["kind"])

    def toml(self) -> str:
        """The text of its ``sensor.toml``."""
        return self.text


Sensor: TypeAlias = CameraLaser | Profiler | Points | SensorText | Mapping[str, Any] | str | os.PathLike[str]
"""A sensor: one of the classes here, the tables of a ``sensor.toml`` as dictionaries, or the path of one."""


def sensor_text(sensor: Sensor) -> str:
    """The text of the ``sensor.toml`` that describes a sensor."""
    if isinstance(sensor, CameraLaser | Profiler | Points | SensorText):
        return sensor.toml()
    if isinstance(sensor, Mapping):
        return _toml(sensor)
    if not isinstance(sensor, str | os.PathLike):
        raise TypeError(f"sensor: expected a sensor of this package, tables, or the path of a sensor.toml, found {sensor!r}")
    if isinstance(sensor, str) and "\n" in sensor:
        raise ValueError("sensor: expected a path, found several lines; SensorText(text) is a sensor of this text")
    path = Path(sensor)
    return text_of(path / "sensor.toml" if path.is_dir() else path, "a sensor.toml, or a folder that holds one")


def _toml(tables: Mapping[str, Any]) -> str:
    plain = [f"{key} = {_value(value)}" for key, value in tables.items() if not isinstance(value, Mapping)]
    parts = ["\n".join(plain)]
    for name, table in tables.items():
        if isinstance(table, Mapping):
            parts.append("\n".join([f"[{name}]", *(f"{key} = {_value(value)}" for key, value in table.items())]))
    return "\n\n".join(parts) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, Mapping):
        raise TypeError(f"sensor: a table inside of a table: {dict(value)}")
    if hasattr(value, "__iter__"):
        return "[" + ", ".join(_value(one) for one in value) + "]"
    return repr(float(value))
