"""Where the work of a run is done: threads of this machine, or a Ray cluster."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import Any, Literal, TypeAlias

from .outcome import Outcome, Part, Work

Engine: TypeAlias = Literal["local", "ray"]


def run(engine: Engine, work: Work, parts: Iterable[Part], shared: Any, workers: int | None) -> Iterator[Outcome]:
    """Does all parts in any order; what each did, as soon as it is done.

    Parameters
    ----------
    engine
        ``"local"``: threads (the calculation does not hold Python's lock). ``"ray"``: Ray Data on the cluster that Ray is, or
        can be, connected to.
    shared
        Given to every call; on a cluster it is sent to every node once.
    workers
        Parts that are worked on at once; by default one a core.
    """
    if engine == "local":
        return _local(work, iter(parts), shared, workers or os.cpu_count() or 1)
    if engine == "ray":
        from .on_ray import on_ray

        return on_ray(work, parts, shared, workers)
    raise ValueError(f"engine: there is no {engine!r}; one of local, ray")


def _local(work: Work, parts: Iterator[Part], shared: Any, count: int) -> Iterator[Outcome]:
    """At most as many parts as there are workers are under way at once; Ctrl-C ends each after what it is doing."""
    stop = threading.Event()
    stoppable = (_StoppablePart(part, stop) for part in parts)
    with ThreadPoolExecutor(count) as pool:
        running: set[Future[Outcome]] = {pool.submit(work, part, shared) for part in islice(stoppable, count)}
        try:
            while running:
                ready, running = wait(running, return_when=FIRST_COMPLETED)
                running |= {pool.submit(work, part, shared) for part in islice(stoppable, len(ready))}
                yield from (future.result() for future in ready)
        finally:
            stop.set()


class _StoppablePart(list[Any]):
    """A part that hands out nothing more once its run has ended; what is unfinished is not written."""

    def __init__(self, items: Part, stop: threading.Event) -> None:
        super().__init__(items)
        self._stop = stop

    def __iter__(self) -> Iterator[Any]:
        for item in super().__iter__():
            if self._stop.is_set():
                raise CancelledError
            yield item


def in_parts(items: Iterable[Any], size: int) -> Iterator[Part]:
    """The items in lists of so many."""
    iterator = iter(items)
    while part := list(islice(iterator, size)):
        yield part
