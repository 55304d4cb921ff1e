"""Reads the values of a result from its JSON."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .estimates import Cad, Curve, Fact, Sigma
from .rotations import matrices_of


def facts_of(entries: list[dict[str, Any] | str]) -> list[Fact]:
    """Reasons or warnings; those of schema 1 are sentences without a code."""
    facts = []
    for entry in entries:
        values = {"code": "", "text": entry} if isinstance(entry, str) else dict(entry)
        facts.append(Fact(values.pop("code"), values.pop("text"), values))
    return facts


def sigma_of(entry: dict[str, Any]) -> Sigma:
    """Standard deviations, null as NaN."""
    return Sigma(
        time_offset_s=entry.get("time_offset_s"),
        rotation_rad=numbers_of(entry.get("rotation_rad"), 3),
        translation_m=numbers_of(entry.get("translation_mm"), 3) * 1e-3,
    )


def curve_of(entry: dict[str, Any]) -> Curve:
    """A curve in m."""
    drawing = entry.get("cad")
    return Curve(
        label=entry["label"],
        closed=entry["closed"],
        length_m=entry["length_mm"] * 1e-3,
        points_m=np.array(entry["points_mm"], dtype=np.float64).reshape(-1, 3) * 1e-3,
        sigma_m=np.array(entry["sigma_mm"], dtype=np.float64) * 1e-3,
        cad=None if drawing is None else cad_of(drawing),
    )


def cad_of(entry: dict[str, Any]) -> Cad:
    """A drawing in m, where the scan found it."""
    place, symmetry = entry.get("base_from_part"), entry.get("symmetric_about")
    pose = np.full((4, 4), np.nan)
    if place is not None:
        pose = np.eye(4)
        pose[:3, :3] = matrices_of(place["rotation_wxyz"])
        pose[:3, 3] = np.array(place["translation_mm"]) * 1e-3
    return Cad(
        file=entry["file"],
        tolerance_m=entry["tolerance_mm"] * 1e-3,
        used=entry["used"],
        base_from_part=pose,
        rms_m=entry["rms_mm"] * 1e-3,
        symmetry_axis=None if symmetry is None else numbers_of(symmetry["axis"], 3),
        symmetry_point_m=None if symmetry is None else numbers_of(symmetry["point_mm"], 3) * 1e-3,
        symmetry_rad=np.nan if symmetry is None else float(np.radians(number_of(symmetry["angle_deg"]))),
    )


def numbers_of(values: list[float | None] | None, count: int) -> NDArray[np.float64]:
    """An array in which null is NaN."""
    return np.full(count, np.nan) if values is None else np.array(values, dtype=np.float64)


def number_of(value: float | None) -> float:
    """A number, null as NaN."""
    return np.nan if value is None else value
