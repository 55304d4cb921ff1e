"""Parts as rows of a Ray dataset; the only file that needs Ray.

Ray does a task again whose node has died. A part's file is named by its content, so this leaves the
same files.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from typing import Any

import ray

from .outcome import Outcome, Part, Work

MOST_BLOCKS = 10_000
"""Ray plans by blocks; more of them than this cost more than they spread."""


def on_ray(work: Work, parts: Iterable[Part], shared: Any, workers: int | None) -> Iterator[Outcome]:
    """Works on at most as many parts at once as there are workers, by default as the cluster has cores."""
    if not ray.is_initialized():
        ray.init(log_to_driver=False)
    rows = [{"part": part} for part in parts]
    if not rows:
        return
    context = ray.data.DataContext.get_current()
    context.enable_progress_bars = False
    sent = ray.put(shared)

    def worked(row: dict[str, Any]) -> dict[str, Any]:
        return asdict(work(list(row["part"]), ray.get(sent), map))

    dataset = ray.data.from_items(rows, override_num_blocks=min(len(rows), MOST_BLOCKS))
    # Tasks of one part each: a block is one row, unless there are very many.
    done = dataset.map(worked, num_cpus=1, concurrency=workers)
    for row in done.iter_rows():
        yield Outcome(**row)
