"""Stamps: seconds as numbers, or nanoseconds as integers."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

NS_PER_S = 1e9


def stamps_ns(times: ArrayLike) -> NDArray[np.int64]:
    """Whole nanoseconds of an array of times.

    Floating-point numbers are seconds. ``datetime64`` arrays are taken to the nanosecond; floating-point seconds since 1970
    are no finer than 0.24 µs.

    >>> stamps_ns([0.0, 0.0125])
    array([       0, 12500000])
    >>> stamps_ns(np.array(["1970-01-01T00:00:01"], dtype="datetime64[ms]"))
    array([1000000000])
    """
    array = np.asarray(times)
    if np.issubdtype(array.dtype, np.datetime64):
        return np.ascontiguousarray(array.astype("datetime64[ns]").astype(np.int64))
    seconds = np.ascontiguousarray(array, dtype=np.float64)
    if not np.isfinite(seconds).all():
        raise ValueError(f"times: row {int(np.flatnonzero(~np.isfinite(seconds))[0])} is not a finite number")
    return np.rint(seconds * NS_PER_S).astype(np.int64)


def seconds(stamps: NDArray[np.int64]) -> NDArray[np.float64]:
    """Seconds of whole nanoseconds."""
    return stamps / NS_PER_S
