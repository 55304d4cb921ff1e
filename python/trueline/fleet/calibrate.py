"""Calibrates many recordings."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from typing import Unpack

import pyarrow as pa

from ..options import Options, as_compiled
from .engine import Engine, in_parts, part_size, run
from .outcome import Outcome
from .part import Shared, calibrate_part
from .row import KEY, SCHEMA, TIMING_SCHEMA
from .store import Store


def calibrate(
    urls: Iterable[str | os.PathLike[str]],
    *,
    out: str | os.PathLike[str],
    engine: Engine = "local",
    workers: int | None = None,
    recordings_in_a_part: int | None = None,
    progress: Callable[[Outcome], None] | None = None,
    **options: Unpack[Options],
) -> Outcome:
    """Calibrate recordings wherever they are kept, one row each.

    Parameters
    ----------
    urls
        Recordings: dataset folders, .mcap files or bags, by any URL that fsspec knows.
    out
        Folder of the Parquet files, likewise a URL. Rows of this version and these options that exist already are kept.
    engine
        ``"local"``: threads of this machine (the calculation does not hold Python's lock). ``"ray"``: Ray Data on a cluster
        (``pip install trueline[ray]``); ``out`` must be reachable from every node.
    workers
        Recordings in work at once (on a cluster, parts); by default one a core.
    recordings_in_a_part
        Number of recordings in one file. A worker that dies loses at most these. By default 1/128 of all, at least one and at
        most 32. Use more for millions: 1000 make 10,000 files of ten millions.
    progress
        Called after every part.
    **options
        As for :func:`trueline.calibrate`.

    Returns
    -------
    Outcome
        How many were done, failed (their rows say why) and were there already.
    """
    as_compiled(options)
    if isinstance(urls, (str, os.PathLike)):
        raise TypeError(f"urls: expected several recordings, found one; give a list: [{str(urls)!r}]")
    if recordings_in_a_part is not None and recordings_in_a_part < 1:
        raise ValueError(f"recordings_in_a_part: expected one or more, found {recordings_in_a_part}")
    store = str(out)
    if engine == "ray" and store.startswith("memory:"):
        raise ValueError("out: memory:// is lost with the worker that wrote it; name a storage that all nodes reach")
    Store(store).create()
    names = map(str, urls)
    if recordings_in_a_part is None:
        counted = list(names)
        parts = in_parts(counted, part_size(len(counted)))
    else:
        parts = in_parts(names, recordings_in_a_part)
    outcome = Outcome()
    for part in run(engine, calibrate_part, parts, Shared.of(options, store), workers):
        outcome.add(part)
        if progress is not None:
            progress(outcome)
    return outcome


def table(out: str | os.PathLike[str]) -> pa.Table:
    """All rows of a run's folder, one a recording, with ``duration_s`` and ``worker``.

    Two runs at once may both have done a recording; then it is here once, as everywhere the same. A recording that was done by
    two versions, or with two sets of options, has a row of each.
    """
    store = Store(str(out))
    rows, timings = store.table("rows", SCHEMA), store.table("timings", TIMING_SCHEMA)
    took = dict(zip(_keys(timings), timings.to_pylist(), strict=True))
    of_rows = [took.get(key, {}) for key in _keys(rows)]
    for name in ("duration_s", "worker"):
        field = TIMING_SCHEMA.field(name)
        rows = rows.append_column(field, pa.array([timing.get(name) for timing in of_rows], field.type))
    return rows.filter(pa.array(_first_of_each(rows), pa.bool_())).sort_by("url")


def _first_of_each(rows: pa.Table) -> list[bool]:
    """Whether a row is the first of its recording. One that could not be read goes by its URL, and
    gives way once it could."""
    urls, keys = rows["url"].to_pylist(), _keys(rows)
    read = {(url, *key[1:]) for url, key in zip(urls, keys, strict=True) if key[0] is not None}
    seen: set[tuple[str, ...]] = set()
    first = []
    for url, key in zip(urls, keys, strict=True):
        place = (url, *key[1:])
        name = ("url", *place) if key[0] is None else ("content", *key)
        first.append(name not in seen and not (key[0] is None and place in read))
        seen.add(name)
    return first


def _keys(rows: pa.Table) -> list[tuple[str, ...]]:
    return list(zip(*(rows[name].to_pylist() for name in KEY), strict=True))
