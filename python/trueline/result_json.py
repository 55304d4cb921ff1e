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


def rotation_of(wxyz: list[float]) -> NDArray[np.float64]:
    """The rotation matrix of a unit quaternion."""
    w, x, y, z = wxyz
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
