"""Engines of a run: threads of this machine, or a Ray cluster."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import Any, Literal, TypeAlias

from .outcome import Outcome, Part, Work

Engine: TypeAlias = Literal["local", "ray"]


def run(engine: Engine, work: Work, parts: Iterable[Part], shared: Any, workers: int | None) -> Iterator[Outcome]:
    """Does all parts in any order, and gives each outcome as soon as it exists.

    Parameters
    ----------
    engine
        ``"local"``: threads (the calculation does not hold Python's lock). ``"ray"``: Ray Data on the cluster to which Ray
        is, or can be, connected.
    shared
        Given to every call; on a cluster it is sent to every node once.
    workers
        Threads (on a cluster, parts in work at once); by default one a core.
    """
    if workers is not None and workers < 1:
        raise ValueError(f"workers: expected one or more, found {workers}")
    if engine == "local":
        return _local(work, iter(parts), shared, workers or os.cpu_count() or 1)
    if engine == "ray":
        from .on_ray import on_ray

        return on_ray(work, parts, shared, workers)
    raise ValueError(f"engine: no {engine!r}; one of local, ray")


def _local(work: Work, parts: Iterator[Part], shared: Any, count: int) -> Iterator[Outcome]:
    """At most as many parts are processed at once as there are threads, and their items share the
    threads: all of them work also if there is only one part. Ctrl-C ends each thread after what it
    is doing; what is unfinished is not written."""
    with ThreadPoolExecutor(count) as threads, ThreadPoolExecutor(count) as writers:

        def begin(most: int) -> set[Future[Outcome]]:
            return {writers.submit(work, part, shared, threads.map) for part in islice(parts, most)}

        running = begin(count)
        try:
            while running:
                ready, running = wait(running, return_when=FIRST_COMPLETED)
                running |= begin(len(ready))
                yield from (future.result() for future in ready)
        finally:
            threads.shutdown(wait=False, cancel_futures=True)


def in_parts(items: Iterable[Any], size: int) -> Iterator[Part]:
    """The items in lists of this length."""
    iterator = iter(items)
    while part := list(islice(iterator, size)):
        yield part


MOST_PARTS = 128
"""So many parts keep the cores of a cluster busy."""

MOST_IN_A_PART = 32
"""A worker that dies loses no more than these."""


def part_size(count: int) -> int:
    """Number of items in a part: the same on every engine, so that the files are the same.

    >>> [part_size(count) for count in (0, 5, 300, 2000, 10_000_000)]
    [1, 1, 3, 16, 32]
    """
    return min(MOST_IN_A_PART, -(-count // MOST_PARTS)) or 1
