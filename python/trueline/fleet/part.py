"""A part of a run: a few recordings that are calibrated and written together."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import fsspec

from ..calibrate import Options
from .row import Timing, content_hash, error_row, row_of
from .store import Store

Work = tuple[list[str], Options, str]
"""Where the recordings are, options of the calibration, and the folder of the store."""


@dataclass
class Outcome:
    """What a run did."""

    done: int = 0
    failed: int = 0
    present: int = 0
    timings: list[Timing] = field(default_factory=list)


def calibrate_part(work: Work) -> Outcome:
    """Calibrates a few recordings and writes their rows; what is in the store already is left out."""
    urls, options, out = work
    store = Store(out)
    present = store.hashes()
    outcome, rows = Outcome(), []
    for url in urls:
        try:
            with _fetched(url) as path:
                key = content_hash(path)
                if key in present:
                    outcome.present += 1
                    continue
                row, timing = row_of(url, path, key, options)
        # What cannot be fetched is a row as well.
        except OSError as error:
            rows.append(error_row(url, None, error))
            outcome.failed += 1
        else:
            present.add(key)
            outcome.timings.append(timing)
            outcome.failed += row["status"] == "error"
            rows.append(row)
        outcome.done += 1
    if rows:
        store.write(rows)
    return outcome


class _fetched:  # noqa: N801 (a context manager, used as a function)
    """A recording as a path of this machine."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def __enter__(self) -> Path:
        files, path = fsspec.core.url_to_fs(self._url)
        if "file" in files.protocol:
            return Path(path)
        self._folder = tempfile.TemporaryDirectory()
        target = Path(self._folder.name) / Path(path).name
        files.get(path, str(target), recursive=files.isdir(path))
        return target

    def __exit__(self, *_: object) -> None:
        if self._folder is not None:
            self._folder.cleanup()
