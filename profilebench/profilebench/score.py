"""Scores of submissions: every answer judged, and a line a method and track."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import commitment, submission
from .files import FileError, read_sequence
from .metrics import Judged, judge

REAL = "real"
"""Name of the track without truth."""


@dataclass(frozen=True)
class Line:
    """Results of a method on the sequences of one track (or of all)."""

    method: str
    asked: int
    """Sequences that the method is made for."""
    accepted: int
    good: int
    good_refused: int
    solved: int
    wrong: int
    overconfident: int
    strict_mm: tuple[float, float] | None
    """Median and 90th percentile over accepted answers, as the next two."""
    same_arm_mm: tuple[float, float] | None
    offset_ms: tuple[float, float] | None
    rotation_deg: float | None
    translation_mm: float | None
    nees: tuple[float, float] | None
    """Mean and median of NEES / 7."""
    coverage: float | None
    true_over_said: float | None
    """RMS true over RMS stated seam error of accepted answers."""
    run_time_s: float | None


def sequences(bench: Path) -> Iterator[Path]:
    """Folders of all sequences of a benchmark, in order."""
    found = sorted(path.parent for path in bench.glob("*/*/sequence.toml"))
    if not found:
        raise FileError(f"{bench}: no sequence in it; `profilebench generate --out {bench}` writes some")
    yield from found


def truth_of(folder: Path, key: bytes | None) -> dict[str, Any] | None:
    """Truth of a sequence, or None if it is sealed and there is no key, or if nobody knows it."""
    plain = folder / "truth.json"
    if plain.is_file():
        loaded: dict[str, Any] = json.loads(plain.read_text())
        return loaded
    sealed = folder / "truth.sealed"
    if not sealed.is_file():
        return None
    published = json.loads((folder.parent / "commitments.json").read_text())
    practice = published["key"] == commitment.key_commitment(commitment.PRACTICE_KEY)
    used = key or (commitment.PRACTICE_KEY if practice else None)
    if used is None:
        return None
    if published["key"] != commitment.key_commitment(used):
        raise commitment.SealError(f"{folder.parent / 'commitments.json'}: the key is not the one of this track")
    return commitment.unseal(used, folder.name, sealed.read_bytes(), published["truths"][folder.name])


@dataclass(frozen=True)
class Scores:
    """Judged answers by track and method, and how many sequences stayed sealed."""

    judged: dict[str, dict[str, list[Judged]]]
    sealed: int
    real: list[dict[str, Any]]


def score(bench: Path, submissions: Path, key: bytes | None = None) -> Scores:
    """Judge all submissions, folders `submissions/METHOD/TRACK/SEQUENCE.json`. A missing answer counts as failed."""
    methods = sorted(path.name for path in submissions.iterdir() if path.is_dir()) if submissions.is_dir() else []
    if not methods:
        raise FileError(f"{submissions}: no submissions in it; expected {submissions}/METHOD/TRACK/SEQUENCE.json")
    judged: dict[str, dict[str, list[Judged]]] = {}
    sealed, real = 0, []
    for folder in sequences(bench):
        track = folder.parent.name
        if track == REAL:
            from .real import judge_real

            real += judge_real(folder, submissions, methods)
            continue
        truth = truth_of(folder, key)
        if truth is None:
            sealed += 1
            continue
        sequence = read_sequence(folder)
        for method in methods:
            answer = _answer(submissions / method / track / f"{folder.name}.json")
            judged.setdefault(track, {}).setdefault(method, []).append(judge(answer, sequence, truth))
    return Scores(judged, sealed, real)


def _answer(path: Path) -> submission.Answer:
    if not path.is_file():
        return submission.Answer("failed", ("no submission",))
    return submission.read(path)


def line(method: str, answers: Iterable[Judged]) -> Line:
    """Summary of the answers of one method."""
    asked = [a for a in answers if a.status != "unsupported"]
    taken = [a for a in asked if a.accepted]
    good = [a for a in asked if a.good_scan]
    stated = [(a.true_mm, a.said_mm) for a in taken if a.true_mm is not None and a.said_mm]
    covered = np.array([a.covered for a in taken]).reshape(-1, 2).sum(0)
    nees = _values(a.nees for a in taken)
    ratio = None
    if stated:
        true, said = np.array(stated, float).T
        ratio = float(np.sqrt((true**2).mean() / (said**2).mean()))
    offsets = [abs(v) * 1e3 for v in _values(a.offset_error_s for a in taken)]
    return Line(
        method, len(asked), len(taken), len(good), sum(not a.accepted for a in good), sum(a.solved for a in asked),
        sum(a.wrong for a in taken), sum(a.overconfident for a in taken),
        _spread(_values(a.strict_mm for a in taken)), _spread(_values(a.same_arm_mm for a in taken)), _spread(offsets),
        _median(_values(a.rotation_deg for a in taken)), _median(_values(a.translation_mm for a in taken)),
        (float(np.mean(nees)), float(np.median(nees))) if nees else None,
        float(covered[0] / covered[1]) if covered[1] else None, ratio, _median(_values(a.run_time_s for a in asked)),
    )  # fmt: skip


def _values(values: Iterable[float | None]) -> list[float]:
    return [v for v in values if v is not None]


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def _spread(values: list[float]) -> tuple[float, float] | None:
    return (float(np.median(values)), float(np.percentile(values, 90))) if values else None
