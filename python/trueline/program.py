"""Commands of the program whose answer is a file or a text."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any, TypeAlias

from .recording import Recording, RecordingLike
from .result import Result
from .run import run

ResultLike: TypeAlias = Result | str | os.PathLike[str]
"""A result, or the path of its file."""


def export(result: ResultLike, form: str, *options: str) -> str:
    """The transform in the form of a robot, of ROS or of another program.

    Parameters
    ----------
    result
        The calibration.
    form
        A name that :func:`export_forms` lists: ``"ur"``, ``"kuka"``, ``"ros2"``, …
    *options
        Further words of ``trueline export``.

    Examples
    --------
    >>> import trueline
    >>> result = trueline.calibrate(trueline.simulate("quick", seed=1))
    >>> len(json.loads(export(result, "json"))) > 0
    True
    """
    with tempfile.TemporaryDirectory() as folder:
        return run("export", str(_file(result, folder, "result.json")), "--as", form, "--quiet", *options)


def export_forms() -> str:
    """The forms that :func:`export` knows, each with its convention."""
    return run("export", "--list")


def diff(first: ResultLike, second: ResultLike, *options: str) -> dict[str, Any]:
    """Two calibrations over the sensor's field: whether they are the same, or by how much the sensor moved.

    Returns
    -------
    dict
        What ``trueline diff --json`` writes: ``verdict`` is ``"same"`` or ``"moved"``.
    """
    with tempfile.TemporaryDirectory() as folder:
        files = (_file(first, folder, "first.json"), _file(second, folder, "second.json"))
        found: dict[str, Any] = json.loads(run("diff", *map(str, files), "--json", "-", "--quiet", *options))
    return found


def evaluate(recording: RecordingLike, result: ResultLike, *options: str) -> dict[str, Any]:
    """Check a calibration on another scan: how far its seam points are from the true line, or from the best one.

    Parameters
    ----------
    recording
        The scan.
    result
        The calibration.
    *options
        Further words of ``trueline evaluate``: ``"--reference"``, ``"taught.csv"``; ``"--tolerance"``, ``"0.5mm"``; …

    Returns
    -------
    dict
        What ``trueline evaluate --json`` writes.
    """
    with tempfile.TemporaryDirectory() as folder:
        scan = recording
        if isinstance(recording, Recording):
            scan = Path(folder) / "scan"
            recording.write(scan)
        words = ("--calibration", str(_file(result, folder, "result.json")), "--json", "-", "--quiet")
        found: dict[str, Any] = json.loads(run("evaluate", str(scan), *words, *options))
    return found


def plan(
    cell: str | os.PathLike[str] | None,
    *,
    out: str | os.PathLike[str],
    want: str | None = None,
    duration_s: float | None = None,
    tries: int | None = None,
    seed: int = 1,
) -> dict[str, Any]:
    """Plan the most informative scan within the limits of robot, sensor and guess.

    Parameters
    ----------
    cell
        The ``cell.toml`` with the known facts of the cell; ``None`` plans in the paper's cell and writes its file.
    out
        Folder to write, new or empty: the path, the report and the plan.
    want
        Sigmas to reach, as ``"translation=0.05mm,rotation=0.02deg,time=0.1ms"``.
    duration_s
        Duration of the scan, s.
    tries
        Paths that are tried for each shape.
    seed
        Seed of the search.

    Returns
    -------
    dict
        ``plan.json``: what is predicted of the scan.
    """
    words = ["plan", "--example" if cell is None else str(cell), "--out", str(out), "--seed", str(seed), "--quiet"]
    for option, value in (("--want", want), ("--duration-s", duration_s), ("--tries", tries)):
        words += [] if value is None else [option, str(value)]
    run(*words)
    found: dict[str, Any] = json.loads((Path(out) / "plan.json").read_text(encoding="utf-8"))
    return found


def _file(result: ResultLike, folder: str, name: str) -> Path:
    if not isinstance(result, Result):
        return Path(result)
    file = Path(folder) / name
    result.save(file)
    return file
