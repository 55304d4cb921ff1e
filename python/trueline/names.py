"""Names that were mistyped: the nearest one that there is."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable
from pathlib import Path


def nearest(name: str, known: Iterable[str]) -> str:
    """A sentence that asks whether a similar name was meant; empty if none is similar.

    >>> nearest("hubber", ["squared", "huber"])
    " Did you mean 'huber'?"
    >>> nearest("xyz", ["squared", "huber"])
    ''
    """
    similar = difflib.get_close_matches(name, list(known), n=1)
    return f" Did you mean {similar[0]!r}?" if similar else ""


def text_of(path: str | os.PathLike[str], expected: str) -> str:
    """The text of a file.

    Parameters
    ----------
    expected
        What the file should be, in words.

    Raises
    ------
    FileNotFoundError
        With what was expected there, and the names in its folder that are similar.
    ValueError
        For a folder, or for bytes that are no text.
    """
    path = Path(path)
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise FileNotFoundError(f"{path}: no such file; expected {expected}.{_near(path)}") from error
    except IsADirectoryError as error:
        raise ValueError(f"{path}: is a folder; expected {expected}") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is no text; expected {expected}") from error


def _near(path: Path) -> str:
    """Hint for a place without a file: the missing folder, or the similar names beside it."""
    folder = path.parent
    if not folder.is_dir():
        return f" There is no folder {folder} either.{nearest(folder.name, _names(folder.parent))}"
    return nearest(path.name, _names(folder)) or f" The working folder is {Path.cwd()}."


def _names(folder: Path) -> list[str]:
    try:
        return sorted(os.listdir(folder))
    except OSError:
        return []
