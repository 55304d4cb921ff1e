"""Runs a method, or any program, over all sequences of a benchmark and writes its submissions."""

import shlex
import subprocess
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from . import submission
from .baselines import METHODS, PICTURE_METHODS
from .files import FileError, read_sequence, read_toml
from .score import sequences
from .submission import Answer

COMMAND_LIMIT_S = 600.0
READABLE = ("line", "arc", "plane", "sphere")
"""Targets whose readings are tables. The others hold pictures."""


def run(
    bench: Path, out: Path, method: str, command: str | None, jobs: int = 1, only: list[str] | None = None
) -> Iterator[str]:
    """Write `out/METHOD/TRACK/SEQUENCE.json` for each sequence and yield a line about each."""
    if command is None and method not in METHODS:
        raise FileError(f"no method {method!r}; there are {', '.join(METHODS)}, or any program with --command")
    tasks = [
        (folder, out / method / folder.parent.name / f"{folder.name}.json", method, command)
        for folder in sequences(bench)
        if not only or folder.parent.name in only
    ]
    if jobs == 1:
        yield from map(_one, tasks)
    else:
        with ProcessPoolExecutor(jobs) as pool:
            yield from pool.map(_one, tasks)


def _one(task: tuple[Path, Path, str, str | None]) -> str:
    folder, path, method, command = task
    path.parent.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    if command is None:
        answer = _solved(folder, method)
    else:
        answer = _commanded(command, folder, path)
    answer = answer.timed(round(time.perf_counter() - began, 3))
    submission.write(path, answer, folder.name, method)
    return f"{folder.name:18} {answer.status:11} {answer.run_time_s:6.2f} s  {'; '.join(answer.reasons)[:90]}"


def _solved(folder: Path, method: str) -> Answer:
    if read_toml(folder / "sequence.toml")["target"] not in READABLE:
        if method not in PICTURE_METHODS:
            return Answer("unsupported", ("pictures",))
        return _tried(lambda: PICTURE_METHODS[method](folder))
    sequence = read_sequence(folder)
    return _tried(lambda: METHODS[method](sequence))


def _tried(solve: Callable[[], Answer]) -> Answer:
    try:
        return solve()
    except Exception as error:
        return Answer("failed", (f"{type(error).__name__}: {error}",))


def _commanded(command: str, folder: Path, path: Path) -> Answer:
    """Run a program with {sequence} and {answer} put in; what it wrote is read back and checked."""
    path.unlink(missing_ok=True)
    words = [word.format(sequence=folder, answer=path) for word in shlex.split(command)]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=COMMAND_LIMIT_S, check=False)
    except subprocess.TimeoutExpired:
        return Answer("failed", (f"longer than {COMMAND_LIMIT_S:.0f} s",))
    except OSError as error:
        raise FileError(f"cannot run {words[0]!r}: {error}") from None
    if not path.is_file():
        return Answer("failed", (f"wrote no answer, exit code {done.returncode}: {done.stderr.strip()[-200:]}",))
    try:
        return submission.read(path)
    except submission.SubmissionError as error:
        return Answer("failed", (str(error),))
