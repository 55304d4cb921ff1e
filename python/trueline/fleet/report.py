"""A fleet on one page: the cells by drift, worst first."""

from __future__ import annotations

import html
import os
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from .store import Store


@dataclass(frozen=True)
class Cell:
    """The scans of one cell against its first accepted one."""

    name: str
    scans: int
    refused: int
    offset_drift_ms: float
    offset_drift_sigma: float
    shift_mm: float


def cells(rows: list[dict[str, Any]]) -> list[Cell]:
    """Cells by drift, worst first. A cell is the folder that its recordings lie in."""
    by_cell: dict[str, list[dict[str, Any]]] = {}
    for row in sorted(rows, key=lambda row: str(row["url"])):
        by_cell.setdefault(str(PurePosixPath(row["url"]).parent), []).append(row)
    found = [_cell(name, group) for name, group in by_cell.items()]
    return sorted(found, key=lambda cell: (-cell.offset_drift_sigma, -cell.refused, cell.name))


def _cell(name: str, rows: list[dict[str, Any]]) -> Cell:
    good = [row for row in rows if row["status"] == "accepted"]
    drift = sigma = shift = 0.0
    if len(good) > 1:
        first, last = good[0], good[-1]
        offsets = (first["time_offset_s"], last["time_offset_s"])
        drift = (offsets[1]["value"] - offsets[0]["value"]) * 1e3
        spread = np.hypot(offsets[0]["sigma"] or 0.0, offsets[1]["sigma"] or 0.0) * 1e3
        sigma = abs(drift) / spread if spread > 0.0 else 0.0
        moved = np.subtract(last["translation_mm"]["value"], first["translation_mm"]["value"])
        shift = float(np.linalg.norm(moved))
    return Cell(name, len(rows), len(rows) - len(good), drift, float(sigma), shift)


def report(rows: str | os.PathLike[str]) -> str:
    """The fleet in a folder of Parquet as a page of HTML."""
    table = "".join(map(_line, cells(Store(str(rows)).table().to_pylist())))
    heads = ("cell", "scans", "not accepted", "time offset, last − first / ms", "in σ", "hand-eye moved / mm")
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><title>Fleet</title>'
        "<style>body{font:16px system-ui;margin:2em}table{border-collapse:collapse}"
        "td,th{padding:.3em .8em;border-bottom:1px solid #8884;text-align:right}"
        "td:first-child,th:first-child{text-align:left}.moved{background:#f906}</style>"
        f"<h1>Cells by drift</h1><table><tr>{''.join(f'<th>{head}</th>' for head in heads)}</tr>{table}</table></html>\n"
    )


def _line(cell: Cell) -> str:
    numbers = (cell.scans, cell.refused, f"{cell.offset_drift_ms:+.3f}", f"{cell.offset_drift_sigma:.1f}", f"{cell.shift_mm:.2f}")
    # Beyond 4 σ once in 16,000 cells that are all right.
    mark = ' class="moved"' if cell.offset_drift_sigma > 4.0 else ""
    return f"<tr{mark}><td>{html.escape(cell.name)}</td>{''.join(f'<td>{number}</td>' for number in numbers)}</tr>"
