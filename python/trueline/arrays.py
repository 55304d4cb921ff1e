"""Arrays as the compiled half takes them; what would lose something on the way is refused by name."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def floats(name: str, values: ArrayLike, *shape: str) -> NDArray[np.float64]:
    """Values as float64, without a copy where they are that already.

    Parameters
    ----------
    *shape
        The dimensions in words, as ``"M", "2 or 3"``. Their number is checked here, their lengths by the caller.

    >>> floats("points", [[1, 2]], "M", "2 or 3")
    array([[1., 2.]])
    """
    array = unmasked(name, values)
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name}: expected numbers, found an array of {array.dtype}")
    if array.ndim != len(shape):
        raise ValueError(f"{name}: expected an array ({', '.join(shape)}), found {array.shape}")
    return np.ascontiguousarray(array, dtype=np.float64)


def whole(name: str, values: ArrayLike) -> NDArray[np.int64]:
    """Whole numbers as int64; floating-point numbers that are whole are taken.

    >>> whole("line", [0.0, 1.0])
    array([0, 1])
    """
    array = unmasked(name, values)
    if array.dtype.kind == "f":
        bad = np.flatnonzero(~(np.isfinite(array) & (np.rint(array) == array)))
        if len(bad):
            raise ValueError(f"{name}: expected whole numbers, found {array.flat[bad[0]]} at {int(bad[0])}")
    elif array.dtype.kind not in "iu" and array.size:
        raise ValueError(f"{name}: expected whole numbers, found an array of {array.dtype}")
    return np.ascontiguousarray(array, dtype=np.int64)


def unmasked(name: str, values: ArrayLike) -> NDArray[Any]:
    """An array that hides nothing: a mask would be forgotten further on."""
    if np.ma.is_masked(values):
        raise ValueError(f"{name}: some values are masked; leave out their rows")
    return np.asarray(values)
