"""One line for what holds arrays: what a terminal or a notebook prints of it."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

MOST_NUMBERS = 16
"""An array of at most this size, a 4×4 matrix, is written out; of a longer one only its shape."""
MOST_ITEMS = 4
MOST_CHARACTERS = 60


class Brief:
    """A dataclass that is printed on one line, however long its arrays are."""

    def __repr__(self) -> str:
        values = ", ".join(f"{field.name}={brief(getattr(self, field.name))}" for field in fields(self))  # type: ignore[arg-type]
        return f"{type(self).__name__}({values})"


def brief(value: Any) -> str:
    """A value in a few words, on one line.

    >>> brief(np.zeros((100, 2)))
    'array of 100 × 2'
    >>> brief(np.array([0.5, 1.0]))
    '[0.5, 1]'
    >>> brief({"unobservable": 3}), brief(list(range(9)))
    ("{'unobservable': 3}", '9 items')
    """
    if isinstance(value, np.ndarray):
        if value.size > MOST_NUMBERS:
            return f"array of {' × '.join(map(str, value.shape))}"
        return _numbers(value.tolist())
    if is_dataclass(value) and not isinstance(value, type):
        return f"{type(value).__name__}(…)"
    if isinstance(value, dict | list | tuple) and len(value) > MOST_ITEMS:
        return f"{len(value)} items"
    words = repr(value)
    return words if len(words) <= MOST_CHARACTERS else f"{words[: MOST_CHARACTERS - 1]}…"


def _numbers(values: Any) -> str:
    if isinstance(values, list):
        return f"[{', '.join(map(_numbers, values))}]"
    return f"{values:.6g}" if isinstance(values, float) else repr(values)
