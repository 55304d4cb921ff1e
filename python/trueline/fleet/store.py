"""Where the rows are kept: parts of Parquet in any storage that fsspec knows."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Sequence
from typing import Any

import fsspec
import pyarrow as pa
import pyarrow.parquet as pq

from .row import SCHEMA


class Store:
    """A folder of parts. A part is named by the content of its rows' recordings: writing it twice gives the same file."""

    def __init__(self, url: str) -> None:
        self._files, self._root = fsspec.core.url_to_fs(url)
        self._local = "file" in self._files.protocol

    def hashes(self) -> set[str]:
        """Recordings that are there already."""
        return {value for part in self.parts() for value in self._column(part, "content_hash") if value}

    def write(self, rows: Sequence[dict[str, Any]]) -> str:
        """Write a part; its name. It appears whole or not at all."""
        ordered = sorted(rows, key=_key)
        key = hashlib.sha256("\n".join(map(_key, ordered)).encode()).hexdigest()
        buffer = io.BytesIO()
        pq.write_table(pa.Table.from_pylist(ordered, schema=SCHEMA), buffer)
        name = f"{self._root}/rows-{key[:32]}.parquet"
        self._files.makedirs(self._root, exist_ok=True)
        # Object stores show an object when it is whole; folders need a name of its own until then.
        target = f"{name}.unfinished" if self._local else name
        self._files.pipe_file(target, buffer.getvalue())
        if self._local:
            self._files.mv(target, name)
        return name

    def parts(self) -> list[str]:
        """The parts' names."""
        return sorted(self._files.glob(f"{self._root}/rows-*.parquet"))

    def table(self) -> pa.Table:
        """All rows, one a recording."""
        tables = [pq.read_table(io.BytesIO(self._files.cat_file(part)), schema=SCHEMA) for part in self.parts()]
        if not tables:
            return SCHEMA.empty_table()
        table = pa.concat_tables(tables)
        seen: set[str] = set()
        hashes = table["content_hash"].to_pylist()
        # Two runs at once may have done the same recording in parts that are cut differently.
        first = [key is None or not (key in seen or seen.add(key)) for key in hashes]  # type: ignore[func-returns-value]
        return table.filter(pa.array(first))

    def _column(self, part: str, name: str) -> list[str]:
        with self._files.open(part, "rb") as file:
            values: list[str] = pq.read_table(file, columns=[name])[name].to_pylist()
            return values


def _key(row: dict[str, Any]) -> str:
    return str(row["content_hash"] or row["url"])
