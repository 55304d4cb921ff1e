"""A part of a run: a few recordings that are calibrated and written together."""

from __future__ import annotations

import os
import platform
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import fsspec
import pyarrow as pa

from .. import __version__
from ..options import Options
from .outcome import Each, Outcome, Part
from .row import KEY, SCHEMA, TIMING_SCHEMA, content_hash, error_row, options_json, row_of
from .store import Hashes, Store, key_of


@dataclass(frozen=True)
class Shared:
    """Inputs that all parts of a run share: the options, the folder of the store, and the
    recordings that are in it already."""

    options: Options
    out: str
    present: Hashes

    @classmethod
    def of(cls, options: Options, out: str) -> Shared:
        """The inputs of a run."""
        tables = Store(out).tables(f"rows/{partition(options)}", ["content_hash"])
        hashes = (value for table in tables for value in table["content_hash"].to_pylist() if value)
        return cls(options, out, Hashes(hashes))


def partition(options: Options) -> str:
    """The folder of the rows of this version and these options: results of others do not count as done."""
    return f"version={__version__}/options={'default' if not options else key_of([options_json(options)])[:12]}"


def calibrate_part(urls: Part, shared: Shared, each: Each) -> Outcome:
    """Calibrates a few recordings and writes their rows; those that were there when the run began are left out."""
    outcome = Outcome()
    rows: list[dict[str, Any]] = []
    timings: list[dict[str, Any]] = []
    for row, duration_s in each(partial(_row, shared), urls):
        outcome.busy_s += duration_s
        if row is None:
            outcome.present += 1
            continue
        rows.append(row)
        outcome.done += 1
        outcome.failed += row["status"] == "error"
        if row["content_hash"] is not None:
            timing = {"duration_s": duration_s, "worker": f"{platform.node()}:{os.getpid()}"}
            timings.append(timing | {name: row[name] for name in KEY})
    began = time.monotonic()
    if rows:
        _write(rows, timings, shared)
    outcome.busy_s += time.monotonic() - began
    return outcome


def _row(shared: Shared, url: str) -> tuple[dict[str, Any] | None, float]:
    """The row of a recording, none if it is there already; and how long that took, s."""
    began = time.monotonic()
    row = None
    try:
        with fetched(url) as path:
            key = content_hash(path)
            if key not in shared.present:
                row = row_of(url, path, key, shared.options)
    # An item that cannot be fetched is a row as well; storages have errors of their own.
    except Exception as error:  # noqa: BLE001
        row = error_row(url, None, error, shared.options)
    return row, time.monotonic() - began


def _write(rows: list[dict[str, Any]], timings: list[dict[str, Any]], shared: Shared) -> None:
    """A part is named by the content of its recordings: writing it twice gives the same file."""
    keys = [row["content_hash"] or row["url"] for row in rows]
    ordered = [row for _, row in sorted(zip(keys, rows, strict=True), key=lambda pair: str(pair[0]))]
    store, name = Store(shared.out), f"{partition(shared.options)}/part-{key_of(keys)}"
    # The rows last: where they are, all is.
    store.write(f"timings/{name}", pa.Table.from_pylist(timings, schema=TIMING_SCHEMA))
    store.write(f"rows/{name}", pa.Table.from_pylist(ordered, schema=SCHEMA))


@contextmanager
def fetched(url: str) -> Iterator[Path]:
    """A recording as a path of this machine."""
    files, path = fsspec.core.url_to_fs(url)
    if "file" in files.protocol:
        yield Path(path)
        return
    with tempfile.TemporaryDirectory() as folder:
        prefix = path.rstrip("/")
        target = Path(folder) / Path(prefix).name
        found = files.find(path)
        if not found:
            raise FileNotFoundError(f"{url}: there is no file or folder")
        # One by one: not every storage can copy a folder.
        for file in found:
            own = target / file[len(prefix) :].lstrip("/")
            own.parent.mkdir(parents=True, exist_ok=True)
            files.get_file(file, str(own))
        yield target
