"""Stamps: seconds as numbers, or nanoseconds as integers."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

NS_PER_S = 1e9


# 64 bits of nanoseconds hold 292 years.
_LONGEST_S = 9.2e9
# Integers are nanoseconds where seconds would make no sense: hours from one to the next, or tens of thousands of years.
_LEAST_STEP_NS = 10_000
_LEAST_NS = 10**12


def stamps_ns(times: ArrayLike) -> NDArray[np.int64]:
    """Whole nanoseconds of an array of times.

    Floating-point numbers are seconds, integers nanoseconds (whole seconds where they are a few). ``datetime64`` arrays are
    taken to the nanosecond; floating-point seconds since 1970 are no finer than 0.24 µs.

    >>> stamps_ns([0.0, 0.0125])
    array([       0, 12500000])
    >>> stamps_ns(np.array([0, 12_500_000]))
    array([       0, 12500000])
    >>> stamps_ns(np.array(["1970-01-01T00:00:01"], dtype="datetime64[ms]"))
    array([1000000000])
    """
    array = np.asarray(times)
    if array.ndim != 1:
        raise ValueError(f"times: expected one dimension (N,), found {array.shape}")
    if np.issubdtype(array.dtype, np.datetime64):
        _refuse_row(np.isnat(array), "is no time (NaT)")
        return np.ascontiguousarray(array.astype("datetime64[ns]").astype(np.int64))
    if np.issubdtype(array.dtype, np.integer) and _are_nanoseconds(array.astype(np.int64)):
        return np.ascontiguousarray(array, dtype=np.int64)
    seconds = np.ascontiguousarray(array, dtype=np.float64)
    _refuse_row(~np.isfinite(seconds), "is not a finite number")
    _refuse_row(
        np.abs(seconds) > _LONGEST_S, "is no time in seconds; nanoseconds are given as integers, or as datetime64"
    )
    return np.rint(seconds * NS_PER_S).astype(np.int64)


def _are_nanoseconds(whole: NDArray[np.int64]) -> bool:
    if len(whole) == 0:
        return False
    step = float(np.median(np.abs(np.diff(whole)))) if len(whole) > 1 else 0.0
    return step >= _LEAST_STEP_NS or bool((whole >= _LEAST_NS).any() or (whole <= -_LEAST_NS).any())


def _refuse_row(bad: NDArray[np.bool_], why: str) -> None:
    if bad.any():
        raise ValueError(f"times: row {int(np.flatnonzero(bad)[0])} {why}")


def seconds(stamps: NDArray[np.int64]) -> NDArray[np.float64]:
    """Seconds of whole nanoseconds."""
    return stamps / NS_PER_S
