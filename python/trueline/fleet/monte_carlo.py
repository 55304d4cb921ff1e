"""Many simulated cells: errors of the answers, and their stated uncertainties."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any, Unpack

import numpy as np
import pyarrow as pa

from .. import __version__
from ..calibrate import calibrate
from ..options import Options, as_compiled
from ..recording import Guess, simulate
from ..result import Result
from ..rotations import small_rotation
from .engine import Engine, in_parts, run
from .outcome import Each, Outcome, Part
from .store import Store, key_of

SCHEMA = pa.schema(
    [
        ("seed", pa.int64()),
        ("accepted", pa.bool_()),
        ("time_offset_error_s", pa.float64()),
        ("rotation_error_rad", pa.list_(pa.float64(), 3)),
        ("translation_error_m", pa.list_(pa.float64(), 3)),
        ("nees", pa.float64()),
    ],
    metadata={b"trueline.schema": b"1"},
)
"""Columns; ``nees`` is errorᵀ·covariance⁻¹·error of the seven numbers over 7: one on average if the ± are true."""

NAMES = [
    "time_offset_s",
    *(f"rotation_{axis}_rad" for axis in "xyz"),
    *(f"translation_{axis}_mm" for axis in "xyz"),
]


@dataclass(frozen=True)
class Study:
    """The rows of a study, in the files that they are kept in: ``folder`` below ``out``."""

    out: str
    folder: str

    @property
    def table(self) -> pa.Table:
        """All rows by seed."""
        return Store(self.out).table(self.folder, SCHEMA).sort_by("seed")

    @property
    def acceptance(self) -> float:
        """Share of the cells whose result is accepted."""
        accepted = count = 0
        for table in self._tables("accepted"):
            accepted, count = accepted + sum(table["accepted"].to_pylist()), count + len(table)
        return accepted / count if count else np.nan

    @property
    def nees(self) -> float:
        """Mean of ``nees`` over the accepted cells."""
        total, count = 0.0, 0
        for table in self._tables("accepted", "nees"):
            values = table.filter(table["accepted"])["nees"].drop_null().to_numpy()
            total, count = total + float(values.sum()), count + len(values)
        return total / count if count else np.nan

    def _tables(self, *columns: str) -> Iterable[pa.Table]:
        return Store(self.out).tables(self.folder, columns)


@dataclass(frozen=True)
class Cells:
    """Inputs that all parts of a study share."""

    out: str
    preset: str
    random_cell: bool
    options: Options

    @property
    def folder(self) -> str:
        """Folder of this study's cells: those of another version, preset or options do not count as
        done."""
        what = json.dumps([self.preset, self.random_cell, self.options], sort_keys=True, default=list)
        return f"cells/version={__version__}/preset={self.preset}/study={key_of([what])[:12]}"


def monte_carlo(
    seeds: Iterable[int],
    *,
    out: str | os.PathLike[str],
    preset: str = "quick",
    random_cell: bool = True,
    engine: Engine = "local",
    workers: int | None = None,
    cells_in_a_part: int = 1000,
    progress: Callable[[Outcome], None] | None = None,
    **options: Unpack[Options],
) -> Study:
    """Simulate and calibrate a cell for each seed; the rows go into Parquet, part by part.

    Parameters
    ----------
    seeds
        Seeds of the cells: ``range(1_000_000)``.
    out
        Folder of the studies, by any URL that fsspec knows. Parts of this study that exist already are kept.
    preset
        A name of ``trueline simulate --preset``.
    random_cell
        Draw time offset, hand-eye transform and seam anew for each cell.
    engine, workers
        As for :func:`trueline.fleet.calibrate`.
    cells_in_a_part
        Number of cells in one file, and in the memory of each worker. On a cluster one core does one part.
    progress
        Called after every part.
    **options
        As for :func:`trueline.calibrate`.

    Examples
    --------
    >>> import tempfile
    >>> study = monte_carlo(range(3), out=tempfile.mkdtemp(), preset="quick")
    >>> study.table.num_rows
    3
    """
    as_compiled(options)
    if cells_in_a_part < 1:
        raise ValueError(f"cells_in_a_part: expected one or more, found {cells_in_a_part}")
    Store(str(out)).create()
    shared = Cells(str(out), preset, random_cell, options)
    outcome = Outcome()
    for part in run(engine, _study_part, in_parts(seeds, cells_in_a_part), shared, workers):
        outcome.add(part)
        if progress is not None:
            progress(outcome)
    return Study(shared.out, shared.folder)


def _study_part(seeds: Part, shared: Cells, each: Each) -> Outcome:
    """A part is named by its seeds: one that is there is right."""
    name = f"{shared.folder}/seeds-{seeds[0]}-{seeds[-1]}-{key_of(map(str, seeds))[:12]}"
    store = Store(shared.out)
    if store.has(name):
        return Outcome(present=len(seeds))
    answers = list(each(partial(_row, shared), seeds))
    store.write(name, pa.Table.from_pylist([row for row, _ in answers], schema=SCHEMA))
    return Outcome(done=len(seeds), busy_s=sum(duration_s for _, duration_s in answers))


def _row(shared: Cells, seed: int) -> tuple[dict[str, Any], float]:
    """The row of a cell, and how long it took, s."""
    began = time.monotonic()
    scan = simulate(shared.preset, seed=int(seed), random_cell=shared.random_cell)
    truth = scan.truth
    assert truth is not None, "a simulation has a truth"
    row = {"seed": int(seed)} | errors(calibrate(scan, **shared.options), truth)
    return row, time.monotonic() - began


def errors(result: Result, truth: Guess) -> dict[str, Any]:
    """Error of a result; null if the scan does not determine it."""
    row: dict[str, Any] = {"accepted": result.accepted}
    if result.time_offset_s is None or np.isnan(result.tool_from_camera).any():
        return row
    rotation = small_rotation(result.tool_from_camera[:3, :3] @ truth.tool_from_camera[:3, :3].T)
    translation = result.tool_from_camera[:3, 3] - truth.tool_from_camera[:3, 3]
    offset = result.time_offset_s - truth.time_offset_s
    error = np.concatenate([[offset], rotation, translation * 1e3])
    place = [result.covariance.names.index(name) for name in NAMES]
    covariance = result.covariance.matrix[np.ix_(place, place)]
    return row | {
        "time_offset_error_s": offset,
        "rotation_error_rad": rotation.tolist(),
        "translation_error_m": translation.tolist(),
        "nees": None if np.isnan(covariance).any() else float(error @ np.linalg.solve(covariance, error)) / len(error),
    }
