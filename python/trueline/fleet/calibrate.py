"""Calibrates many recordings."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import Literal, Unpack

from ..calibrate import Options
from .part import Outcome, Work, calibrate_part

ROWS_IN_A_PART = 32
"""Recordings that are kept in memory at once and written together."""


def calibrate(
    urls: Iterable[str | os.PathLike[str]],
    *,
    out: str | os.PathLike[str],
    engine: Literal["local", "ray"] = "local",
    workers: int | None = None,
    progress: Callable[[Outcome], None] | None = None,
    **options: Unpack[Options],
) -> Outcome:
    """Calibrate recordings wherever they are kept, one row each.

    Parameters
    ----------
    urls
        Recordings: dataset folders, .mcap files or bags, by any URL that fsspec knows.
    out
        Folder of the Parquet files, likewise a URL. What is in it already is not done again.
    engine
        ``"local"``: threads of this machine (the calculation does not hold Python's lock). ``"ray"``: a Ray cluster
        (``pip install trueline[ray]``); ``out`` must be reachable from every node.
    workers
        Parts that are worked on at once; by default one a core, or one a core of the cluster.
    progress
        Called after every part.
    **options
        As for :func:`trueline.calibrate`.

    Returns
    -------
    Outcome
        How many were done, failed (their rows say why) and were there already.
    """
    store = str(out)
    if engine == "ray" and store.startswith("memory:"):
        raise ValueError("out: memory:// is lost with the worker that wrote it; name a storage that all nodes reach")
    work = ((chunk, options, store) for chunk in _chunks(map(str, urls), ROWS_IN_A_PART))
    outcome = Outcome()
    for part in _engine(engine)(work, workers):
        outcome.done += part.done
        outcome.failed += part.failed
        outcome.present += part.present
        outcome.timings += part.timings
        if progress is not None:
            progress(outcome)
    return outcome


def _engine(name: str) -> Callable[[Iterator[Work], int | None], Iterator[Outcome]]:
    if name == "local":
        return _local
    if name == "ray":
        from .on_ray import parts_on_ray

        return parts_on_ray
    raise ValueError(f"engine: there is no {name!r}; one of local, ray")


def _local(work: Iterator[Work], workers: int | None) -> Iterator[Outcome]:
    """At most as many parts as there are workers are under way at once."""
    count = workers or os.cpu_count() or 1
    with ThreadPoolExecutor(count) as pool:
        running: set[Future[Outcome]] = {pool.submit(calibrate_part, one) for one in islice(work, count)}
        while running:
            ready, running = wait(running, return_when=FIRST_COMPLETED)
            running |= {pool.submit(calibrate_part, one) for one in islice(work, len(ready))}
            yield from (future.result() for future in ready)


def _chunks(items: Iterable[str], size: int) -> Iterator[list[str]]:
    iterator = iter(items)
    while chunk := list(islice(iterator, size)):
        yield chunk

