"""The scans of a fleet by cell: how far each has drifted."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..rotations import matrices_of, small_rotation

COLUMNS = ("url", "status", "time_offset_s", "translation_mm", "rotation_wxyz", "rotation_sigma_rad", "reasons")
"""Columns of a row that are used."""


@dataclass
class Cell:
    """The scans of one cell, its last accepted one against its first.

    A cell is the folder of its recordings, in the order of their names. ``drift_sigma`` is the largest change
    of an unknown over its standard deviation, NaN with fewer than two accepted scans; ``offset_drift_ms``, ``shift_mm`` and
    ``turn_deg`` are the changes of the time offset and of the hand-eye transform.
    """

    name: str
    scans: int = 0
    accepted: int = 0
    unreadable: int = 0
    last_status: str = ""
    reasons: dict[str, int] = field(default_factory=dict)
    drift_sigma: float = np.nan
    offset_drift_ms: float = np.nan
    shift_mm: float = np.nan
    turn_deg: float = np.nan


def cells(rows: Iterable[dict[str, Any]]) -> list[Cell]:
    """Cells by drift, worst first; before them those without an accepted scan, of which nothing is known.

    Of each cell no more than two rows are kept, however many there are.
    """
    found: dict[str, Cell] = {}
    ends: dict[str, dict[str, dict[str, Any]]] = {}
    for row in rows:
        name = row["url"].rstrip("/").rpartition("/")[0]
        _count(found.setdefault(name, Cell(name)), row, ends.setdefault(name, {}))
    for name, cell in found.items():
        cell.last_status = ends[name]["newest"]["status"]
        if cell.accepted > 1:
            _compare(cell, ends[name]["first"], ends[name]["last"])
    return sorted(found.values(), key=lambda cell: (cell.accepted > 0, -np.nan_to_num(cell.drift_sigma), cell.name))


def _count(cell: Cell, row: dict[str, Any], ends: dict[str, dict[str, Any]]) -> None:
    cell.scans += 1
    cell.unreadable += row["status"] == "error"
    for fact in row.get("reasons") or []:
        cell.reasons[fact["code"]] = cell.reasons.get(fact["code"], 0) + 1
    _keep(ends, "newest", row, later=True)
    if row["status"] == "accepted":
        cell.accepted += 1
        _keep(ends, "first", row, later=False)
        _keep(ends, "last", row, later=True)


def _keep(ends: dict[str, dict[str, Any]], end: str, row: dict[str, Any], *, later: bool) -> None:
    kept = ends.setdefault(end, row)
    if (row["url"] > kept["url"]) if later else (row["url"] < kept["url"]):
        ends[end] = row


def _compare(cell: Cell, first: dict[str, Any], last: dict[str, Any]) -> None:
    offset_s = last["time_offset_s"]["value"] - first["time_offset_s"]["value"]
    shift_mm = np.subtract(last["translation_mm"]["value"], first["translation_mm"]["value"])
    turns = matrices_of([last["rotation_wxyz"], first["rotation_wxyz"]])
    turn_rad = small_rotation(turns[0] @ turns[1].T)
    pairs = (
        ([offset_s], [row["time_offset_s"]["sigma"] for row in (first, last)]),
        (shift_mm, [row["translation_mm"]["sigma"] for row in (first, last)]),
        (turn_rad, [row["rotation_sigma_rad"] for row in (first, last)]),
    )
    cell.drift_sigma = max(_worst(change, sigmas) for change, sigmas in pairs)
    cell.offset_drift_ms = offset_s * 1e3
    cell.shift_mm = float(np.linalg.norm(shift_mm))
    cell.turn_deg = float(np.degrees(np.linalg.norm(turn_rad)))


def _worst(change: Any, sigmas: list[Any]) -> float:
    """The largest change over its sigma; a quantity without a sigma was held fixed, and does not
    count."""
    if any(sigma is None for sigma in sigmas):
        return 0.0
    spread = np.hypot(np.asarray(sigmas[0], dtype=np.float64), np.asarray(sigmas[1], dtype=np.float64))
    return float(np.max(np.abs(change) / spread))
