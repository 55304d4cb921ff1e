"""Seams: a straight line with a form of its own, or an arc."""

from dataclasses import dataclass

import numpy as np

from .rotations import Floats

TABLE_STEP_MM = 0.5
"""Step of the table that random forms are interpolated in."""


@dataclass(frozen=True)
class Seam:
    """A curve p(s) in base, s from −length/2 to length/2 (mm)."""

    centre_mm: Floats
    frame: Floats
    """Columns: along the seam, across, and up."""
    length_mm: float
    table_s_mm: Floats
    table_mm: Floats
    """Departures across and up at the places of the table."""
    radius_mm: float | None = None
    """Radius of an arc in the plane of the plates; None for a straight seam."""

    def points(self, s_mm: Floats) -> Floats:
        """Points of the seam at lengths s from its middle."""
        across = np.interp(s_mm, self.table_s_mm, self.table_mm[:, 0])
        up = np.interp(s_mm, self.table_s_mm, self.table_mm[:, 1])
        along = s_mm
        if self.radius_mm is not None:
            angle = s_mm / self.radius_mm
            along, across = self.radius_mm * np.sin(angle), across + self.radius_mm * (1 - np.cos(angle))
        return np.asarray(self.centre_mm + np.stack([along, across, up], 1) @ self.frame.T, float)

    def frames(self, s_mm: Floats) -> Floats:
        """Ideal frames (n, 3, 3) at lengths s, without the small form."""
        if self.radius_mm is None:
            return np.broadcast_to(self.frame, (len(s_mm), 3, 3))
        c, s = np.cos(s_mm / self.radius_mm), np.sin(s_mm / self.radius_mm)
        turn = np.zeros((len(s_mm), 3, 3))
        turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1], turn[:, 2, 2] = c, -s, s, c, 1
        return np.asarray(self.frame @ turn, float)


def draw(
    rng: np.random.Generator,
    centre_mm: Floats,
    frame: Floats,
    length_mm: float,
    bow_mm: float = 0.0,
    wavy_mm: float = 0.0,
    kink_mm: float = 0.0,
    tacks_mm: float = 0.0,
    radius_mm: float | None = None,
) -> Seam:
    """A seam with a bow (mm at the middle), waviness (RMS), a kink, and tack welds of the given height."""
    reach = length_mm / 2 + 40
    s = np.arange(-reach, reach + TABLE_STEP_MM, TABLE_STEP_MM)
    x = s / (length_mm / 2)
    form = np.zeros((len(s), 2))
    for column in range(2):
        side = rng.choice([-1.0, 1.0])
        form[:, column] += side * bow_mm * (1 - x * x)
        form[:, column] += kink_mm * rng.choice([-1.0, 1.0]) * np.maximum(0, x - rng.uniform(-0.5, 0.5))
        if wavy_mm > 0:
            form[:, column] += wavy_mm * _smooth_noise(rng, s, float(np.exp(rng.uniform(np.log(3), np.log(30)))))
    if tacks_mm > 0:
        form[:, 1] += _tacks(rng, s, tacks_mm)
        form[:, 0] += 0.3 * _tacks(rng, s, tacks_mm)
    return Seam(centre_mm, frame, length_mm, s, form, radius_mm)


def _smooth_noise(rng: np.random.Generator, s: Floats, scale_mm: float) -> Floats:
    half = int(4 * scale_mm / TABLE_STEP_MM)
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) * TABLE_STEP_MM / scale_mm) ** 2)
    noise = np.convolve(rng.normal(size=len(s) + 2 * half), kernel, "valid")
    return np.asarray(noise / np.sqrt((kernel**2).sum()), float)


def _tacks(rng: np.random.Generator, s: Floats, height_mm: float) -> Floats:
    out = np.zeros(len(s))
    at = s[0] + rng.uniform(10, 90)
    while at < s[-1]:
        half = rng.uniform(4, 10)
        out += height_mm * rng.uniform(0.5, 1.3) * np.clip(1 - ((s - at) / half) ** 2, 0, None) ** 0.5
        at += rng.uniform(80, 180)
    return out
