"""The program trueline as a method: a subprocess that reads the sequence's folder, in three settings.

Found on PATH or under the name that the environment variable PROFILEBENCH_TRUELINE holds. Nothing of it is imported.
"""

import json
import os
import shutil
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..files import Sequence, read_toml
from ..rotations import Floats, matrix
from ..submission import ORDER, Answer, Status

VARIABLE = "PROFILEBENCH_TRUELINE"
TIME_LIMIT_S = 300.0
PERFECT_SEAM = "\n[seam]\nedge_radius_mm = 0.0\nwaviness_mm = 0.0\n"
"""Statements of sensor.toml about a sharp and straight seam."""
NOISE_ONLY = ("--sensor", "fixed", "--robot-accuracy-mm", "0", "--feature-bias-px", "0")


def default(sequence: Sequence) -> Answer:
    """As a user runs it: no guess, nothing stated but what the folder says."""
    return run(sequence)


def with_guess(sequence: Sequence) -> Answer:
    """From the same guess as the published methods."""
    return run(sequence, "--initial", str(sequence.folder / "guess.toml"))


def noise_only(sequence: Sequence) -> Answer:
    """Sensor, robot and seam taken as perfect: the covariance holds noise alone."""
    if sequence.target not in ("line", "arc"):
        return run(sequence, *NOISE_ONLY)
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch) / sequence.name
        copy.mkdir()
        for name in ("robot.csv", "features.csv"):
            shutil.copyfile(sequence.folder / name, copy / name)
        stated = (sequence.folder / "sensor.toml").read_text()
        (copy / "sensor.toml").write_text(stated + PERFECT_SEAM)
        return run(replace(sequence, folder=copy), *NOISE_ONLY)


def executable() -> str | None:
    """The program, or None where it is not installed."""
    return shutil.which(os.environ.get(VARIABLE, "trueline"))


def run(sequence: Sequence, *options: str) -> Answer:
    """Calibrate a folder with options of `trueline calibrate`."""
    program = executable()
    if program is None:
        return Answer("unsupported", (f"trueline is not on PATH, and {VARIABLE} names no program",))
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "result.json"
        command = [
            program,
            "calibrate",
            str(sequence.folder),
            "--json",
            str(out),
            "--quiet",
            "--threads",
            "1",
            *options,
        ]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False)
        except subprocess.TimeoutExpired:
            return Answer("failed", (f"longer than {TIME_LIMIT_S:.0f} s",))
        if not out.is_file():
            # A program that cannot read a target is not made for it.
            status: Status = "unsupported" if sequence.target in ("plane", "sphere") else "failed"
            return Answer(status, (" ".join(done.stderr.split())[:300],))
        return _answer(json.loads(out.read_text()))


def no_pictures(sequence: Sequence) -> Answer:
    """Treatment of readings by `board_own_camera`."""
    return Answer("unsupported", ("needs pictures of a chessboard",))


def board_own_camera(folder: Path) -> Answer:
    """As `board`, with the camera calibrated from the same pictures first."""
    return board(folder, own_camera=True)


def board(folder: Path, own_camera: bool = False) -> Answer:
    """Pictures of a chessboard at stops. `folder` is left as it is."""
    program = executable()
    if program is None:
        return Answer("unsupported", (f"trueline is not on PATH, and {VARIABLE} names no program",))
    about = read_toml(folder / "sequence.toml")
    words = f"chessboard:{about['columns']}x{about['rows']}:{about['square_mm']:g}"
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch) / "scan"
        shutil.copytree(folder, copy, ignore=shutil.ignore_patterns("held_out", "boards.csv"))
        sensor, out = copy / "sensor.toml", Path(scratch) / "result.json"
        if own_camera:
            sensor.unlink(missing_ok=True)
        steps = (
            [program, "sensor", "intrinsics", str(copy / "images"), "--board", words, "--out", str(sensor), "--quiet"],
            [
                program,
                "calibrate",
                str(copy),
                "--target",
                "board",
                "--board",
                words,
                "--at-stops",
                "--json",
                str(out),
                "-q",
            ],
        )
        for command in steps if own_camera else steps[1:]:
            done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False)
        if not out.is_file():
            return Answer("failed", (" ".join(done.stderr.split()).replace(str(copy), folder.name)[:300],))
        return _answer(json.loads(out.read_text()))


def _answer(result: dict[str, Any]) -> Answer:
    pose = result.get("tool_from_camera") or {}
    known = pose.get("rotation_wxyz") is not None and pose.get("translation_mm") is not None
    known = known and all(v is not None for v in (*pose["rotation_wxyz"], *pose["translation_mm"]))
    covariance, full = _covariance(result)
    error = result.get("seam_error") or {}
    reasons = tuple(str(reason.get("code")) for reason in result.get("reasons", []))
    accepted = result.get("status") == "accepted" and known
    return Answer(
        "accepted" if accepted else "refused", reasons, result.get("time_offset_s"),
        matrix(np.array(pose["rotation_wxyz"], float)) if known else None,
        np.array(pose["translation_mm"], float) if known else None, covariance, full, error.get("rms_mm"),
    )  # fmt: skip


def _covariance(result: dict[str, Any]) -> tuple[Floats | None, bool]:
    given = result.get("covariance")
    if given and all(name in given["order"] for name in ORDER):
        at = [given["order"].index(name) for name in ORDER]
        value = np.array(given["matrix"], float)[np.ix_(at, at)]
        return (value, True) if np.all(np.isfinite(value)) else (None, True)
    sigma = result.get("sigma")
    if not sigma:
        return None, True
    parts = [
        sigma.get("time_offset_s"),
        *(sigma.get("rotation_rad") or [None] * 3),
        *(sigma.get("translation_mm") or [None] * 3),
    ]
    return np.diag([np.nan if v is None else float(v) ** 2 for v in parts]), False
