"""Paths of the sensor over a seam, as smooth functions of time.

A path gives the seam's place in the sheet (width a, depth b from the middle of the field), the
sensor's rotation from its nominal attitude (work, travel and spin angle) and the progress along the
seam.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .rotations import Floats

Curve = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Motion:
    """Functions of time in s that return rows (n, 6): along (mm), a (mm), b (mm), three angles (rad)."""

    duration_s: float
    state: Curve
    length_mm: float
    tilt_deg: float
    """Largest tilt of the path."""


def draw(kind: str, rng: np.random.Generator, duration_s: float, length_mm: float) -> Motion:
    """A path of a kind, of the given length in s and mm; see `KINDS`."""
    return KINDS[kind](rng, duration_s, length_mm)


def _eased(t: Floats, duration_s: float) -> Floats:
    x = np.clip(t / duration_s, -0.05, 1.05)
    return np.asarray(0.35 * x + 0.65 * (x * x * (3 - 2 * x)), float)


def _waves(rng: np.random.Generator, amplitude: float, low_hz: float, high_hz: float, count: int = 2) -> Curve:
    rates = rng.uniform(low_hz, high_hz, count)
    phases = rng.uniform(0, 2 * np.pi, count)
    shares = rng.uniform(0.5, 1.0, count)
    shares *= amplitude / shares.sum()
    return lambda t: np.asarray((shares * np.sin(2 * np.pi * rates * t[:, None] + phases)).sum(1), float)


def _assemble(parts: list[Curve], progress: Curve, duration_s: float, length_mm: float, tilt_deg: float) -> Motion:
    def state(t: Floats) -> Floats:
        return np.stack([progress(t), *(part(t) for part in parts)], 1)

    return Motion(duration_s, state, length_mm, tilt_deg)


def _oscillating(
    a_mm: float, b_mm: float, tilts_deg: tuple[float, float, float], low_hz: float, high_hz: float
) -> Callable[[np.random.Generator, float, float], Motion]:
    def make(rng: np.random.Generator, duration_s: float, length_mm: float) -> Motion:
        parts = [_waves(rng, a_mm, low_hz, high_hz), _waves(rng, b_mm, low_hz, high_hz)]
        parts += [_waves(rng, np.radians(tilt), low_hz, high_hz) for tilt in tilts_deg]
        return _assemble(
            parts, lambda t: length_mm * _eased(t, duration_s), duration_s, length_mm, max(tilts_deg)
        )  # fmt: skip

    return make


def _s_scan(rng: np.random.Generator, duration_s: float, length_mm: float) -> Motion:
    """The S-shaped path of Yang et al. (2025): ±10 mm across, slow tilts of ±5°, constant stand-off."""
    rate, phase = rng.uniform(0.4, 0.8), rng.uniform(0, 2 * np.pi)
    parts: list[Curve] = [
        lambda t: 10 * np.sin(2 * np.pi * rate * t + phase),
        _waves(rng, 1.0, 0.05, 0.15),
        *(_waves(rng, np.radians(5.0), 0.04, 0.12, 1) for _ in range(3)),
    ]
    return _assemble(parts, lambda t: length_mm * _eased(t, duration_s), duration_s, length_mm, 5.0)


def _weave(rng: np.random.Generator, duration_s: float, length_mm: float) -> Motion:
    """Everything at one frequency and even progress: the scan repeats itself, so that offsets alias."""
    rate = rng.uniform(0.6, 1.2)
    amplitudes = (10.0, 6.0, np.radians(8.0), np.radians(6.0), np.radians(5.0))
    phases = rng.uniform(0, 2 * np.pi, 5)
    parts = [_sine(float(a), rate, float(p)) for a, p in zip(amplitudes, phases, strict=True)]
    return _assemble(parts, lambda t: length_mm * t / duration_s, duration_s, length_mm, 8.0)


def _taught(rng: np.random.Generator, duration_s: float, length_mm: float) -> Motion:
    """Taught points joined by eased moves of equal time."""
    count = max(6, int(duration_s / 1.1))
    sizes = np.array([18.0, 18.0, *np.radians([14.0, 14.0, 12.0])])
    points = rng.uniform(-1, 1, (count + 1, 5)) * sizes
    # Neighbouring points differ, or the robot would stand.
    points[1:] = np.where(np.abs(points[1:] - points[:-1]) < 0.3 * sizes, -points[1:], points[1:])

    parts = [_joined(points[:, column], duration_s) for column in range(5)]
    return _assemble(parts, lambda t: length_mm * t / duration_s, duration_s, length_mm, 14.0)


def _sine(amplitude: float, rate_hz: float, phase: float) -> Curve:
    return lambda t: amplitude * np.sin(2 * np.pi * rate_hz * t + phase)


def _joined(values: Floats, duration_s: float) -> Curve:
    """Values at equal times, joined by moves that begin and end at rest."""
    count = len(values) - 1

    def value(t: Floats) -> Floats:
        x = np.clip(t / duration_s * count, 0, count - 1e-9)
        k = x.astype(int)
        f = x - k
        f = f**3 * (10 - 15 * f + 6 * f * f)
        return np.asarray(values[k] + f * (values[k + 1] - values[k]), float)

    return value


def _still_feature(rng: np.random.Generator, duration_s: float, length_mm: float) -> Motion:
    """Tilts of ±15° with the seam held at one point of the sheet: time offset and rotation are hidden."""
    zero: Curve = lambda t: np.zeros(len(t))  # noqa: E731
    parts = [zero, zero, *(_waves(rng, np.radians(15.0), 0.1, 0.4) for _ in range(3))]
    return _assemble(parts, lambda t: length_mm * _eased(t, duration_s), duration_s, length_mm, 15.0)


KINDS: dict[str, Callable[[np.random.Generator, float, float], Motion]] = {
    "planned": _oscillating(17.0, 20.0, (18.0, 18.0, 15.0), 0.12, 0.45),
    "fast": _oscillating(17.0, 16.0, (14.0, 14.0, 12.0), 0.5, 1.1),
    "s-scan": _s_scan,
    "taught": _taught,
    "hand": _oscillating(14.0, 16.0, (12.0, 10.0, 9.0), 0.05, 0.7),
    "small-tilts": _oscillating(14.0, 12.0, (3.0, 3.0, 3.0), 0.12, 0.45),
    "one-axis": _oscillating(15.0, 15.0, (15.0, 0.0, 0.0), 0.12, 0.45),
    "fixed-attitude": _oscillating(15.0, 15.0, (0.0, 0.0, 0.0), 0.12, 0.45),
    "still-feature": _still_feature,
    "weave": _weave,
}
"""Kinds of path. The last four hide something or repeat themselves: there no answer is right."""
