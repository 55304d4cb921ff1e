"""Stamps: seconds as numbers, or nanoseconds as integers."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import unmasked

NS_PER_S = 1e9


# 64 bits of nanoseconds hold 292 years.
_LONGEST_S = 9.2e9
# Integers are nanoseconds where seconds would make no sense: hours from one to the next, or tens of thousands of years.
_LEAST_STEP_NS = 10_000
_LEAST_NS = 10**12


def stamps_ns(times: ArrayLike, name: str = "times") -> NDArray[np.int64]:
    """Whole nanoseconds of an array of times.

    Floating-point numbers are seconds, integers nanoseconds (whole seconds where they are a few). ``datetime64`` and
    ``timedelta64`` arrays are taken to the nanosecond; floating-point seconds since 1970 are no finer than 0.24 µs.

    >>> stamps_ns([0.0, 0.0125])
    array([       0, 12500000])
    >>> stamps_ns(np.array([0, 12_500_000]))
    array([       0, 12500000])
    >>> stamps_ns(np.array(["1970-01-01T00:00:01"], dtype="datetime64[ms]"))
    array([1000000000])
    >>> stamps_ns(np.array([1, 5], dtype="timedelta64[ms]"))
    array([1000000, 5000000])
    """
    array = unmasked(name, times)
    if array.ndim != 1:
        raise ValueError(f"{name}: expected one dimension (N,), found {array.shape}")
    stamps = _whole_ns(array, name)
    step_ns = float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.0
    if 0.0 < step_ns < _LEAST_STEP_NS:
        raise ValueError(
            f"{name}: the stamps are {step_ns:g} ns apart; floating-point numbers are seconds, integers nanoseconds. "
            "Are these milliseconds or microseconds?"
        )
    return stamps


Stamp: TypeAlias = int | float | np.integer[Any] | np.floating[Any] | np.datetime64 | np.timedelta64
"""One moment: whole numbers are nanoseconds, others seconds."""


def moments_ns(moments: Stamp | ArrayLike, name: str = "stamp") -> NDArray[np.int64]:
    """Whole nanoseconds of one moment, or of several, of a stream that runs: whole numbers are nanoseconds, others seconds.

    >>> moments_ns(0.0125), moments_ns(12_500_000)
    (array([12500000]), array([12500000]))
    """
    array = np.atleast_1d(unmasked(name, moments))
    if array.dtype.kind == "i":
        return np.ascontiguousarray(array, dtype=np.int64)
    return stamps_ns(array, name)


def _whole_ns(array: NDArray[Any], name: str) -> NDArray[np.int64]:
    if array.dtype.kind in "mM":
        _refuse_row(np.isnat(array), "is no time (NaT)", name)
        return np.ascontiguousarray(array.astype(f"{array.dtype.kind}8[ns]").astype(np.int64))
    if array.dtype.kind not in "fiu":
        raise ValueError(
            f"{name}: expected seconds, whole nanoseconds or datetime64, found an array of {array.dtype}; "
            "times with a time zone come by .to_numpy('datetime64[ns]')"
        )
    if array.dtype.kind == "u":
        _refuse_row(array > np.iinfo(np.int64).max, "is beyond 64 bits of nanoseconds", name)
    if array.dtype.kind != "f" and _are_nanoseconds(array.astype(np.int64)):
        return np.ascontiguousarray(array, dtype=np.int64)
    seconds = np.ascontiguousarray(array, dtype=np.float64)
    _refuse_row(~np.isfinite(seconds), "is not a finite number", name)
    _refuse_row(
        np.abs(seconds) > _LONGEST_S, "is no time in seconds; nanoseconds are given as integers, or as datetime64", name
    )
    return np.rint(seconds * NS_PER_S).astype(np.int64)


def _are_nanoseconds(whole: NDArray[np.int64]) -> bool:
    if len(whole) == 0:
        return False
    step = float(np.median(np.abs(np.diff(whole)))) if len(whole) > 1 else 0.0
    return step >= _LEAST_STEP_NS or bool((whole >= _LEAST_NS).any() or (whole <= -_LEAST_NS).any())


def _refuse_row(bad: NDArray[np.bool_], why: str, name: str) -> None:
    if bad.any():
        raise ValueError(f"{name}: row {int(np.flatnonzero(bad)[0])} {why}")


def seconds(stamps: NDArray[np.int64]) -> NDArray[np.float64]:
    """Seconds of whole nanoseconds."""
    return stamps / NS_PER_S
