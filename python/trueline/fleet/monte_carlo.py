"""Many simulated cells: how far off the answers are, and how far off they say they are."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np
import pyarrow as pa

from ..calibrate import Options, calibrate
from ..recording import Guess, simulate
from ..result import Result

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
    """The rows of a study."""

    table: pa.Table

    @property
    def acceptance(self) -> float:
        """Share of the cells whose result is accepted."""
        return float(np.mean(self.table["accepted"].to_numpy(zero_copy_only=False)))

    @property
    def nees(self) -> float:
        """Mean of ``nees`` over the accepted cells."""
        accepted = self.table.filter(self.table["accepted"])
        return float(np.nanmean(accepted["nees"].to_numpy(zero_copy_only=False)))


def monte_carlo(
    seeds: Iterable[int],
    *,
    preset: str = "quick",
    random_cell: bool = True,
    workers: int | None = None,
    progress: Callable[[int], None] | None = None,
    **options: Unpack[Options],
) -> Study:
    """Simulate and calibrate one cell a seed.

    Parameters
    ----------
    seeds
        One cell each.
    preset
        As for :func:`trueline.simulate`.
    random_cell
        Draw every cell anew.
    workers
        Threads; by default one a core.
    progress
        Called with the number of cells that are done.

    Examples
    --------
    >>> study = monte_carlo(range(2))
    >>> study.table.num_rows
    2
    """

    def row(seed: int) -> dict[str, Any]:
        scan = simulate(preset, seed=seed, random_cell=random_cell)
        truth = scan.truth
        assert truth is not None, "a simulation has a truth"
        return {"seed": seed} | errors(calibrate(scan, **options), truth)

    rows = []
    with ThreadPoolExecutor(workers) as pool:
        for done, one in enumerate(pool.map(row, seeds), start=1):
            rows.append(one)
            if progress is not None:
                progress(done)
    return Study(pa.Table.from_pylist(rows, schema=SCHEMA))


def errors(result: Result, truth: Guess) -> dict[str, Any]:
    """How far a result is from the truth; null where the scan does not show it."""
    row: dict[str, Any] = {"accepted": result.accepted}
    if result.time_offset_s is None or np.isnan(result.tool_from_camera).any():
        return row
    rotation = _small_rotation(result.tool_from_camera[:3, :3] @ truth.tool_from_camera[:3, :3].T)
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


def _small_rotation(matrix: Any) -> Any:
    """The rotation vector of a rotation of less than half a turn."""
    axis = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]) / 2
    sine = np.linalg.norm(axis)
    angle = np.arctan2(sine, (np.trace(matrix) - 1) / 2)
    return axis if sine < 1e-12 else axis * (angle / sine)
