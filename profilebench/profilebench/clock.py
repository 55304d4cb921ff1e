"""Stamps of the two streams: what arrives when, and what is lost."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .rotations import Floats


@dataclass(frozen=True)
class Lateness:
    """Arrival of one stream's packets. Times in s."""

    half_normal_s: float = 0.0
    tail_share: float = 0.0
    tail_s: float = 0.003
    stall_every_s: float = 0.0
    """Mean time between stalls of the PC; 0 for none."""
    stall_s: float = 0.015
    lost_share: float = 0.0
    gap_s: float = 0.0
    """Length of one gap in the middle third of the recording."""
    drift_ppm: float = 0.0
    step_s: float = 0.0
    """Step of the stream's clock at about the middle."""
    rounding_s: float = 0.0
    """Resolution of the stamps; 0.001 for stamps in whole ms."""


def stamps(
    rng: np.random.Generator, events_s: Floats, how: Lateness, stalls_s: Floats
) -> tuple[Floats, NDArray[np.bool_], Floats]:
    """Stamps of events, which of them arrive at all, and how late each was (s), without drift, step and rounding."""
    late = np.abs(rng.normal(0, how.half_normal_s, len(events_s))) if how.half_normal_s else np.zeros(len(events_s))
    tail = rng.random(len(events_s)) < how.tail_share
    late = late + np.where(tail, rng.exponential(how.tail_s, len(events_s)), 0.0)
    arrival = events_s + late
    for start in stalls_s:
        held = (arrival > start) & (arrival < start + how.stall_s)
        # A queue that is read out after a stall stamps its packets microseconds apart.
        arrival[held] = start + how.stall_s + 15e-6 * np.arange(held.sum())
    arrival = np.maximum.accumulate(arrival)
    late = arrival - events_s
    keep = rng.random(len(events_s)) >= how.lost_share
    if how.gap_s:
        span = events_s[-1] - events_s[0]
        start = events_s[0] + span * rng.uniform(0.35, 0.6)
        keep &= ~((events_s > start) & (events_s < start + how.gap_s))
    middle = (events_s[0] + events_s[-1]) / 2
    out = arrival + how.drift_ppm * 1e-6 * (arrival - middle)
    if how.step_s:
        out = out + np.where(arrival > middle + rng.uniform(-2, 2), how.step_s, 0.0)
        out -= how.step_s / 2
    if how.rounding_s:
        out = np.round(out / how.rounding_s) * how.rounding_s
    return np.maximum.accumulate(out), keep, late


def stall_times(rng: np.random.Generator, how: Lateness, start_s: float, end_s: float) -> Floats:
    """When the PC stalls."""
    if how.stall_every_s <= 0:
        return np.zeros(0)
    count = rng.poisson((end_s - start_s) / how.stall_every_s)
    return np.sort(rng.uniform(start_s, end_s, count))
