"""One scan to one row."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from .. import __version__
from ..calibrate import calibrate
from ..estimates import Fact
from ..options import Options
from ..result import Result

SCHEMA_VERSION = 2

_FACTS = pa.list_(pa.struct([("code", pa.string()), ("text", pa.string())]))
_NUMBER = pa.struct([("value", pa.float64()), ("sigma", pa.float64())])
_VECTOR = pa.struct([("value", pa.list_(pa.float64(), 3)), ("sigma", pa.list_(pa.float64(), 3))])

SCHEMA = pa.schema(
    [
        ("content_hash", pa.string()),
        ("url", pa.string()),
        ("version", pa.string()),
        ("options", pa.string()),
        ("status", pa.string()),
        ("error", pa.string()),
        ("time_offset_s", _NUMBER),
        ("translation_mm", _VECTOR),
        ("rotation_wxyz", pa.list_(pa.float64(), 4)),
        ("rotation_sigma_rad", pa.list_(pa.float64(), 3)),
        ("seam_error_mm", pa.float64()),
        ("reasons", _FACTS),
        ("warnings", _FACTS),
        ("result_json", pa.string()),
    ],
    metadata={b"trueline.schema": str(SCHEMA_VERSION).encode()},
)
"""Columns of the rows; a null struct is what was not estimated. The same recording, version and options give the same row."""

KEY = ("content_hash", "version", "options")
"""Columns that name a row."""

TIMING_SCHEMA = pa.schema(
    [
        ("content_hash", pa.string()),
        ("version", pa.string()),
        ("options", pa.string()),
        ("duration_s", pa.float64()),
        ("worker", pa.string()),
    ],
    metadata={b"trueline.schema": str(SCHEMA_VERSION).encode()},
)
"""Values that differ from run to run, and so are kept beside the rows."""


def content_hash(path: Path) -> str:
    """SHA-256 of a file, or of a folder's files by their names."""
    digest = hashlib.sha256()
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    for file in files:
        digest.update(file.relative_to(path).as_posix().encode() + b"\0")
        with file.open("rb") as content:
            digest.update(hashlib.file_digest(content, "sha256").digest())
    return digest.hexdigest()


def options_json(options: Options) -> str:
    """The options as text: the same for the same options."""
    return json.dumps(options, sort_keys=True, default=_plain)


def _plain(value: Any) -> Any:
    """Types unknown to JSON: numbers of numpy, and tuples."""
    return value.item() if isinstance(value, np.generic) else list(value)


def row_of(url: str, path: Path, key: str, options: Options) -> dict[str, Any]:
    """Calibrates a recording; its row, also where that fails."""
    try:
        return _empty(url, key, options) | _result_row(calibrate(path, **options))
    # A broken recording is a row and stops nothing, whatever is wrong with it.
    except Exception as error:  # noqa: BLE001
        return error_row(url, key, error, options)


def error_row(url: str, key: str | None, error: Exception, options: Options) -> dict[str, Any]:
    """The row of a recording that cannot be used; without a hash it is tried again by the next run."""
    hint = getattr(error, "hint", "")
    return _empty(url, key, options) | {"status": "error", "error": f"{error}\n{hint}".strip()}


def _empty(url: str, key: str | None, options: Options) -> dict[str, Any]:
    known = {"content_hash": key, "url": url, "version": __version__, "options": options_json(options)}
    return dict.fromkeys(SCHEMA.names) | known


def _result_row(result: Result) -> dict[str, Any]:
    offset, sigma = result.time_offset_s, result.sigma
    translation = result.tool_from_camera[:3, 3] * 1e3
    of_translation = {"value": translation.tolist(), "sigma": _known(sigma.translation_m * 1e3)}
    return {
        "status": result.status,
        "time_offset_s": None if offset is None else {"value": offset, "sigma": sigma.time_offset_s},
        "translation_mm": None if np.isnan(translation).any() else of_translation,
        "rotation_wxyz": result.document["tool_from_camera"].get("rotation_wxyz"),
        "rotation_sigma_rad": _known(sigma.rotation_rad),
        "seam_error_mm": result.seam_error_mm,
        "reasons": _facts(result.reasons),
        "warnings": _facts(result.warnings),
        "result_json": result.json(),
    }


def _known(values: Any) -> list[float] | None:
    return None if np.isnan(values).any() else list(map(float, values))


def _facts(facts: list[Fact]) -> list[dict[str, str]]:
    return [{"code": fact.code, "text": fact.text} for fact in facts]
