"""Storage of the rows: parts of Parquet in any storage that fsspec supports."""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from tempfile import TemporaryFile
from uuid import uuid4

import fsspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

READERS = 16
"""Files that are read at once: a storage far away answers slowly, but to many."""


class Store:
    """A folder of parts, which are files of Parquet below it. A part appears whole or not at all."""

    def __init__(self, url: str) -> None:
        self._files, self._root = fsspec.core.url_to_fs(url)
        self._local = "file" in self._files.protocol

    def create(self) -> None:
        """Make the folder; where nothing can be written, better now than after the first part."""
        self._files.makedirs(self._root, exist_ok=True)
        if self._local:
            with TemporaryFile(dir=self._root):
                pass

    def write(self, name: str, table: pa.Table) -> None:
        """Write a part."""
        buffer = io.BytesIO()
        pq.write_table(table, buffer, compression="zstd")
        target = f"{self._root}/{name}.parquet"
        self._files.makedirs(target.rpartition("/")[0], exist_ok=True)
        # Object stores show an object when it is whole; folders need a name of its own until then.
        # Of each writer's own: two runs may write the same part at once.
        beside = f"{target}.{uuid4().hex}.unfinished" if self._local else target
        self._files.pipe_file(beside, buffer.getvalue())
        if self._local:
            os.replace(beside, target)

    def has(self, name: str) -> bool:
        """Whether a part is there."""
        return bool(self._files.exists(f"{self._root}/{name}.parquet"))

    def parts(self, folder: str = "") -> list[str]:
        """The parts' paths, in order."""
        root = f"{self._root}/{folder}".rstrip("/")
        return sorted(self._files.glob(f"{root}/**/*.parquet"))

    def tables(self, folder: str = "", columns: Iterable[str] | None = None) -> Iterator[pa.Table]:
        """The parts one after the other."""
        wanted = None if columns is None else list(columns)
        with ThreadPoolExecutor(READERS) as pool:
            parts = self.parts(folder)
            # So many are read ahead, not all.
            for first in range(0, len(parts), READERS):
                yield from pool.map(lambda part: self._read(part, wanted), parts[first : first + READERS])

    def table(self, folder: str = "", schema: pa.Schema | None = None) -> pa.Table:
        """All parts as one table."""
        tables = list(self.tables(folder))
        return pa.concat_tables(tables) if tables or schema is None else schema.empty_table()

    def _read(self, part: str, columns: list[str] | None) -> pa.Table:
        with self._files.open(part, "rb") as file:
            # As a file: the folders' names are the reader's business, not columns.
            return pq.ParquetFile(file).read(columns=columns)


class Hashes:
    """A set of SHA-256 as sorted bytes: 16 a recording, so that ten million are 160 MB, and shared memory stays shared.

    Half of each is kept: that two of ten million agree in it has a chance of 1 in 10²⁴.
    """

    def __init__(self, hashes: Iterable[str]) -> None:
        raw = b"".join(bytes.fromhex(value)[:16] for value in hashes)
        self._sorted: NDArray[np.bytes_] = np.unique(np.frombuffer(raw, dtype="S16"))

    def __contains__(self, value: str) -> bool:
        key = np.frombuffer(bytes.fromhex(value)[:16], dtype="S16")[0]
        place = int(np.searchsorted(self._sorted, key))
        return place < len(self._sorted) and bool(self._sorted[place] == key)


def key_of(names: Iterable[str]) -> str:
    """A name for what has these names, in any order."""
    return hashlib.sha256("\n".join(sorted(names)).encode()).hexdigest()[:32]
