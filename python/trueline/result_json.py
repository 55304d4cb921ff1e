"""Reads the values of a result from its JSON."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .estimates import Fact, Sigma


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


def numbers_of(values: list[float | None] | None, count: int) -> NDArray[np.float64]:
    """An array in which null is NaN."""
    return np.full(count, np.nan) if values is None else np.array(values, dtype=np.float64)


def number_of(value: float | None) -> float:
    """A number, null as NaN."""
    return np.nan if value is None else value
