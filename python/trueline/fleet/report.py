"""A fleet on one page: the cells by drift, worst first."""

from __future__ import annotations

import html
import os
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from ..page import Page
from .cells import COLUMNS, Cell, cells
from .store import Store

MOVED_SIGMA = 4.0
"""Seven numbers a cell: beyond 4 σ once in 2,200 cells that are all right."""

STYLE = """
:root{color-scheme:light dark;--line:#8885;--moved:#f906;--lost:#f446}
body{font:16px/1.5 system-ui,sans-serif;margin:2em auto;max-width:76em;padding:0 1em}
h1{font-size:1.6em;margin-bottom:.2em} h2{font-size:1.2em;margin-top:2em}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}
td,th{padding:.35em .9em;border-bottom:1px solid var(--line);text-align:right;vertical-align:top}
td:first-child,th:first-child,:is(td,th):nth-child(n+8){text-align:left}
td:first-child,th{white-space:nowrap}
thead th{position:sticky;top:0;background:Canvas}
.moved{background:var(--moved)} .lost{background:var(--lost)}
""".strip()


def report(out: str | os.PathLike[str]) -> Page:
    """The fleet in the folder of a run as a page of HTML, which a notebook shows.

    Parameters
    ----------
    out
        Folder of a run, by any URL that fsspec knows. Holds it rows of several versions or options, name the one that is meant:
        ``"out/rows/version=0.1.0/options=default"``.

    Raises
    ------
    ValueError
        For a folder without rows, or with rows that were not made alike.
    """
    store = Store(str(out))
    folder = "rows" if store.parts("rows") else ""
    parts = store.parts(folder)
    made = sorted({part.rpartition("/")[0] for part in parts})
    if len(made) != 1:
        told = "there are no rows" if not made else f"rows of several versions or options: name one of {', '.join(made)}"
        raise ValueError(f"{out}: {told}")
    rows = (row for table in store.tables(folder, COLUMNS) for row in table.to_pylist())
    return Page(page(cells(rows), str(out)))


def page(fleet: Sequence[Cell], title: str) -> str:
    """Cells as a page of HTML."""
    scans, accepted = sum(cell.scans for cell in fleet), sum(cell.accepted for cell in fleet)
    unreadable = sum(cell.unreadable for cell in fleet)
    moved = sum(cell.drift_sigma > MOVED_SIGMA for cell in fleet)
    reasons = sum((Counter(cell.reasons) for cell in fleet), Counter())
    name = html.escape(title)
    facts = (
        f"{len(fleet)} cells, {scans} scans: {accepted} accepted, {scans - accepted - unreadable} not accepted, "
        f"{unreadable} that could not be used. Moved: {moved}."
    )
    return "".join(
        (
            f'<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
            f"<title>Fleet: {name}</title><style>{STYLE}</style><h1>Fleet</h1><p>{name}<br>{facts}</p>",
            "<p>Each cell's last accepted scan against its first, in the order of their names. σ: the largest change of time offset, "
            "translation or rotation over its standard deviation, which holds what both scans share as well and so rather "
            f"understates a change. Marked: beyond {MOVED_SIGMA:g} σ, and cells without any accepted scan.</p>",
            _table(
                ("cell", "scans", "accepted", "σ", "time offset / ms", "moved / mm", "turned / °", "last scan", "reasons"),
                map(_cell, fleet),
            ),
            "<h2>Why scans were not accepted</h2>" if reasons else "",
            _table(("reason", "scans"), (("", (code, count)) for code, count in reasons.most_common())) if reasons else "",
            "</html>\n",
        )
    )


def _cell(cell: Cell) -> tuple[str, tuple[object, ...]]:
    mark = "lost" if cell.accepted == 0 else "moved" if cell.drift_sigma > MOVED_SIGMA else ""
    numbers = (
        _number(cell.drift_sigma, ".1f"),
        _number(cell.offset_drift_ms, "+.3f"),
        _number(cell.shift_mm, ".2f"),
        _number(cell.turn_deg, ".3f"),
    )
    status = cell.last_status.replace("_", " ")
    reasons = ", ".join(f"{code} {count}" for code, count in sorted(cell.reasons.items()))
    return mark, (cell.name, cell.scans, cell.accepted, *numbers, status, reasons)


def _number(value: float, form: str) -> str:
    return "–" if np.isnan(value) else format(value, form)


def _table(heads: Sequence[str], rows: Iterable[tuple[str, tuple[object, ...]]]) -> str:
    head = "".join(f"<th>{head}</th>" for head in heads)
    body = "".join(_row(mark, values) for mark, values in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _row(mark: str, values: tuple[object, ...]) -> str:
    cells = "".join(f"<td>{html.escape(str(value))}</td>" for value in values)
    return f'<tr class="{mark}">{cells}</tr>' if mark else f"<tr>{cells}</tr>"
