"""Laser-stripe sensors: a camera with a laser plane, a profiler, and a sensor that reports points.

A `Sensor` maps points of its laser sheet to readings and back. The generator uses two of them, the true one and the
stated one (the one in sensor.toml); methods use the stated one alone.
"""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from .rotations import Floats

Kind = Literal["camera_laser", "profiler", "points"]

UNDISTORT_STEPS = 25
"""Fixed-point steps that invert the lens distortion; each gains a factor of ten for the lenses of this benchmark."""


@dataclass(frozen=True)
class Sensor:
    """A sensor whose readings lie in the sheet ``normal · p = offset_mm`` of its frame."""

    kind: Kind
    normal: tuple[float, float, float] = (0.0, 1.0, 0.0)
    offset_mm: float = 0.0
    fx: float = 0.0
    fy: float = 0.0
    cx: float = 0.0
    cy: float = 0.0
    width: int = 0
    height: int = 0
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    stand_off_mm: float = 130.0
    """Middle of the field: on the camera's axis, or as range of a profiler."""
    shape: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Width scale, depth scale, shear, and two keystones per mm of what is reported, for profilers and points."""
    linearity_mm: float = 0.0
    """Amplitude of a wave of the reported range over the field, period 25 mm."""
    bend_per_mm: float = 0.0
    """Curvature of the true sheet: it leaves the plane by this times the square of the width coordinate."""
    uncertainty: dict[str, float] = field(default_factory=dict)
    """Content of ``[uncertainty]`` in sensor.toml."""

    def axes(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Middle of the field (mm), axis along the stripe, axis of depth, and normal; all in the sensor's frame."""
        n = np.array(self.normal, float)
        if self.kind == "profiler":
            origin = np.array([0.0, 0.0, self.stand_off_mm])
        else:
            origin = np.array([0.0, 0.0, self.offset_mm / n[2]])
        along = np.array([1.0, 0.0, 0.0]) - n[0] * n
        along /= np.linalg.norm(along)
        depth = np.cross(along, n)
        return origin, along, depth if depth[2] > 0 else -depth, n

    def beside_sheet(self, points_mm: Floats) -> Floats:
        """Signed distance of points from the (bent) sheet in mm."""
        origin, along, _, n = self.axes()
        rest = points_mm - origin
        return np.asarray(rest @ n - self.bend_per_mm * (rest @ along) ** 2, float)

    def in_sheet(self, ab_mm: Floats) -> Floats:
        """Points of the sheet at width a and depth b from the middle of the field, mm."""
        origin, along, depth, n = self.axes()
        a, b = ab_mm[:, :1], ab_mm[:, 1:]
        return origin + a * along + b * depth + self.bend_per_mm * a**2 * n

    def to_sheet(self, points_mm: Floats) -> Floats:
        """Width and depth of points from the middle of the field, mm."""
        origin, along, depth, _ = self.axes()
        return np.stack([(points_mm - origin) @ along, (points_mm - origin) @ depth], 1)

    def read(self, points_mm: Floats) -> Floats:
        """Readings of points: u, v in px; x, z in mm; or x, y, z in mm."""
        if self.kind == "camera_laser":
            x, y = points_mm[:, 0] / points_mm[:, 2], points_mm[:, 1] / points_mm[:, 2]
            xd, yd = _distorted(x, y, self.distortion)
            return np.stack([self.fx * xd + self.cx, self.fy * yd + self.cy], 1)
        reported = replace(self, bend_per_mm=0.0).in_sheet(self._shaped(self.to_sheet(points_mm)))
        return reported[:, [0, 2]] if self.kind == "profiler" else reported

    def place(self, readings: Floats) -> Floats:
        """Points in the sensor's frame (mm) of readings, by this sensor's calibration without its shape."""
        if self.kind == "profiler":
            return np.stack([readings[:, 0], np.zeros(len(readings)), readings[:, 1]], 1)
        if self.kind == "points":
            return np.asarray(readings, float)
        xd, yd = (readings[:, 0] - self.cx) / self.fx, (readings[:, 1] - self.cy) / self.fy
        x, y = xd.copy(), yd.copy()
        for _ in range(UNDISTORT_STEPS):
            xk, yk = _distorted(x, y, self.distortion)
            x, y = x + xd - xk, y + yd - yk
        rays = np.stack([x, y, np.ones(len(x))], 1)
        return np.asarray(self.offset_mm * rays / (rays @ np.array(self.normal))[:, None], float)

    def _shaped(self, ab: Floats) -> Floats:
        h1, h2, h3, h4, h5 = self.shape
        a, b = ab[:, 0], ab[:, 1]
        w = 1 + h4 * a + h5 * b
        wave = self.linearity_mm * np.sin(2 * np.pi * b / 25.0 + a / 9.0)
        return np.stack([((1 + h1) * a + h3 * b) / w, (1 + h2) * b / w + wave], 1)


def _distorted(x: Floats, y: Floats, distortion: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Brown–Conrady distortion, coefficients k1, k2, p1, p2, k3."""
    k1, k2, p1, p2, k3 = distortion
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
        y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
    )
