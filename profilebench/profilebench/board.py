"""The board: tables of all methods as Markdown, as a page, and as JSON."""

import dataclasses
import html
import json
import math
from pathlib import Path
from typing import Any

from .score import Line, Scores, line

COLUMNS = (
    ("method", "method"),
    ("accepted", "accepted answers of the sequences that the method is made for"),
    ("solved", "good scans with an accepted answer of less than 0.5 mm seam error, of all good scans"),
    ("good refused", "good scans without an accepted answer"),
    ("wrong", "accepted with more than 1 mm of seam error"),
    ("over", "accepted, and more than 3 × the stated seam error or 4 σ of the time offset off"),
    ("strict mm", "seam error against the true tool frame: median, 90 % (accepted answers, as all that follows)"),
    ("same arm mm", "seam error of the same arm's taught torch: median, 90 %"),
    ("Δt ms", "error of the time offset: median, 90 %"),
    ("rot °", "rotation error, median"),
    ("trans mm", "translation error, median"),
    ("NEES/7", "mean, median; 1 is right, below 1 cautious"),
    ("95 %", "share of the stated 95 % intervals that hold the truth"),
    ("true/said", "RMS of true over stated seam error"),
    ("s", "run time, median"),
)
STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:1250px;margin:2em auto;padding:0 1em;color:#222;background:#fff}
table{border-collapse:collapse;margin:1em 0;font-variant-numeric:tabular-nums}
th,td{padding:.25em .6em;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}
th:first-child,td:first-child{text-align:left}th{background:#f4f4f4}
"""
NOTE = (
    "Simulated sequences of ProfileBench. Medians are of accepted answers: read them beside the accepted column. "
    "“true” is the smaller of the two seam errors."
)


REAL_NOTE = "Real data: truth unknown, judged on stops that were held out."
REAL_HEADER = ["recording", "method", "answers", "accepted", "held-out RMS mm", "fit RMS mm"]


def cells(row: Line) -> list[str]:
    """One line of a table."""
    return [
        row.method, f"{row.accepted}/{row.asked}", f"{row.solved}/{row.good}", str(row.good_refused), str(row.wrong),
        str(row.overconfident), _pair(row.strict_mm), _pair(row.same_arm_mm), _pair(row.offset_ms),
        _one(row.rotation_deg), _one(row.translation_mm), _pair(row.nees),
        "–" if row.coverage is None else f"{100 * row.coverage:.0f}", _one(row.true_over_said), _one(row.run_time_s),
    ]  # fmt: skip


def _one(value: float | None) -> str:
    if value is None:
        return "–"
    if value >= 1e4:
        return f"{value:.0e}"
    return f"{value:.3f}" if value < 1 else f"{value:.3g}"


def _pair(values: tuple[float, float] | None) -> str:
    return "–" if values is None else f"{_one(values[0])}, {_one(values[1])}"


def tables(scores: Scores) -> list[tuple[str, list[Line]]]:
    """Title and lines: all tracks together first, the best method first, then each track."""
    methods = sorted({method for track in scores.judged.values() for method in track})
    overall = [
        line(method, [a for track in scores.judged.values() for a in track.get(method, [])]) for method in methods
    ]
    overall.sort(key=lambda row: (-row.solved, row.wrong, row.method))
    order = [row.method for row in overall]
    out = [("All tracks", overall)]
    for track, answers in scores.judged.items():
        out.append((track, [line(method, answers[method]) for method in order]))
    return [(title, [row for row in rows if row.asked]) for title, rows in out]


BRIEF = (
    "method", "accepted", "solved", "good refused", "wrong", "over", "strict mm", "same arm mm", "Δt ms", "NEES/7",
    "95 %", "true/said",
)  # fmt: skip
"""Columns of the table of all tracks together where it stands alone."""


def parts(scores: Scores) -> dict[str, str]:
    """The tables alone, as Markdown: all tracks together, solved scans of each track, and the real track."""
    names = [name for name, _ in COLUMNS]
    chosen = [names.index(name) for name in BRIEF]
    (_, overall), *each = tables(scores)
    out = {"overall": _markdown_rows(list(BRIEF), [[cells(row)[k] for k in chosen] for row in overall])}
    by_track = {title: {row.method: f"{row.solved}/{row.good}" for row in rows} for title, rows in each}
    solved = [[row.method, *(by_track[title].get(row.method, "–") for title in by_track)] for row in overall]
    out["tracks"] = _markdown_rows(["method", *by_track], solved)
    if scores.real:
        out["real"] = _markdown_rows(REAL_HEADER, real_summary(scores))
    return {name: "\n".join(rows) for name, rows in out.items()}


def markdown(scores: Scores) -> str:
    """The board as Markdown."""
    parts = ["# ProfileBench board", "", NOTE, ""]
    if scores.sealed:
        parts += [f"{scores.sealed} sequences are sealed and not scored: their key was not given.", ""]
    parts += [f"- **{name}**: {text}" for name, text in COLUMNS[1:]] + [""]
    for title, rows in tables(scores):
        parts += [f"## {title}", "", *_markdown_rows([name for name, _ in COLUMNS], [cells(row) for row in rows]), ""]
    if scores.real:
        header, body = real_rows(scores)
        parts += ["## real", "", REAL_NOTE, "", *_markdown_rows(REAL_HEADER, real_summary(scores)), ""]
        parts += ["### Each sequence", "", *_markdown_rows(header, body), ""]
    return "\n".join(parts)


def real_summary(scores: Scores) -> list[list[str]]:
    """A row for each recording and method: its folds together, answers accepted or not."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in scores.real:
        groups.setdefault((row["sequence"].rsplit("-", 1)[0], row["method"]), []).append(row)
    out = []
    for (recording, method), rows in groups.items():
        known = [row for row in rows if row["held_out_mm"] is not None]
        accepted = sum(row["status"] == "accepted" for row in rows)
        held, fit = (_pooled([row[key] for row in known]) for key in ("held_out_mm", "fit_mm"))
        out.append([recording, method, f"{len(known)}/{len(rows)}", f"{accepted}/{len(rows)}", _one(held), _one(fit)])
    return out


def _pooled(values: list[float]) -> float | None:
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else None


def real_rows(scores: Scores) -> tuple[list[str], list[list[str]]]:
    """The table of the real track."""
    header = ["sequence", "method", "status", "held-out RMS mm", "fit RMS mm", "note"]
    return header, [
        [r["sequence"], r["method"], r["status"], _one(r["held_out_mm"]), _one(r["fit_mm"]), r["note"]]
        for r in scores.real
    ]


def _markdown_rows(header: list[str], rows: list[list[str]]) -> list[str]:
    return [
        "| " + " | ".join(header) + " |",
        "|" + "---|" * len(header),
        *("| " + " | ".join(row) + " |" for row in rows),
    ]


def page(scores: Scores) -> str:
    """The board as one HTML page without scripts."""
    parts = [
        f"<!doctype html><html lang=en><meta charset=utf-8><title>ProfileBench board</title><style>{STYLE}</style>"
    ]
    parts.append(f"<h1>ProfileBench board</h1><p>{html.escape(NOTE)}</p>")
    if scores.sealed:
        parts.append(f"<p>{scores.sealed} sequences are sealed and not scored: their key was not given.</p>")
    for title, rows in tables(scores):
        head = "".join(f'<th title="{html.escape(text)}">{html.escape(name)}</th>' for name, text in COLUMNS)
        parts.append(f"<h2>{html.escape(title)}</h2>" + _html_table(head, [cells(row) for row in rows]))
    if scores.real:
        header, body = real_rows(scores)
        parts.append(f"<h2>real</h2><p>{REAL_NOTE}</p>")
        for names, lines in ((REAL_HEADER, real_summary(scores)), (header, body)):
            parts.append(_html_table("".join(f"<th>{html.escape(name)}</th>" for name in names), lines))
    parts.append("<h2>Columns</h2><ul>")
    parts += [f"<li><b>{html.escape(name)}</b>: {html.escape(text)}" for name, text in COLUMNS[1:]]
    return "\n".join([*parts, "</ul></html>", ""])


def _html_table(head: str, rows: list[list[str]]) -> str:
    body = "".join("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in row) + "</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"


def as_json(scores: Scores) -> dict[str, Any]:
    """Every judged answer and every line."""
    return {
        "tables": {title: [dataclasses.asdict(row) for row in rows] for title, rows in tables(scores)},
        "answers": {
            track: {
                method: [
                    dataclasses.asdict(a) | {"wrong": a.wrong, "overconfident": a.overconfident, "solved": a.solved}
                    for a in answers
                ]
                for method, answers in methods.items()
            }
            for track, methods in scores.judged.items()
        },
        "real": scores.real,
        "sealed": scores.sealed,
    }


def write(scores: Scores, out: Path) -> list[Path]:
    """board.md, board.html and board.json in a folder."""
    out.mkdir(parents=True, exist_ok=True)
    texts = {
        "board.md": markdown(scores),
        "board.html": page(scores),
        "board.json": json.dumps(as_json(scores), indent=1) + "\n",
    }
    for name, text in texts.items():
        (out / name).write_text(text)
    return [out / name for name in texts]
