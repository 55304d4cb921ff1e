"""Options of a calibration."""

from __future__ import annotations

import numbers
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, TypeAlias, TypedDict, get_type_hints

from .names import nearest

Held: TypeAlias = Literal["time-offset", "hand-eye"]
Segment: TypeAlias = tuple[Sequence[float], Sequence[float]]


class Options(TypedDict, total=False):
    """Options of a calibration; those of ``trueline calibrate`` by their names with underscores.

    ``sensor_mode`` is ``--sensor``; ``require_…`` are the parts of ``--require``, ``fixed_sigma_…`` those of
    ``--fixed-sigma``. ``drawn_line`` lists two points for each seam, each three numbers in mm. ``target`` is a seam here: a board and
    pose sightings have functions of their own.
    """

    use: Literal["auto", "seam", "stripe", "both"]
    residual: Literal["sheet", "point-to-line"]
    loss: Literal["squared", "huber", "cauchy", "geman-mc-clure", "tukey"]
    fix: Held | Sequence[Held]
    fixed_sigma_ms: float
    fixed_sigma_deg: float
    fixed_sigma_mm: float
    drawn_line: Sequence[Segment]
    drawn_line_sigma_mm: float
    target: Literal["seam", "line", "curve"]
    seam_cad: str | os.PathLike[str]
    cad_tolerance_mm: float
    part_moves: tuple[float, float]
    stamps: Literal["auto", "raw", "regular"]
    sensor_mode: Literal["fixed", "prior", "free"]
    robot_accuracy_mm: float
    feature_bias_px: float
    edge_radius_mm: float
    waviness_mm: float
    feature_sigma_px: float
    feature_sigma_mm: float
    robot_sigma_mm: float
    stamp_sigma_ms: float
    offset_within_s: float
    looks: Literal["+x", "-x", "+y", "-y", "+z", "-z"]
    speed_mm_s: float
    stand_off_mm: float
    accept_partial: bool
    strict: bool
    align_clocks: bool
    threads: int
    require_ms: float
    require_deg: float
    require_mm: float
    require_seam_mm: float


UNITS = ("ms", "deg", "mm")
GROUPS = ("require", "fixed_sigma")


def as_compiled(options: Options, others: Iterable[str] = ()) -> dict[str, Any]:
    """The options as the compiled half takes them; what is not given keeps its default. ``others`` are further keywords of the caller.

    Raises
    ------
    TypeError
        For an option that there is not, or a value of another type.
    ValueError
        For less than one thread.
    """
    taken = {"fix": [], "drawn_line": [], "accept_partial": False, "strict": False, "align_clocks": False}
    every = dict.fromkeys(Options.__annotations__) | taken | checked(options, Options, others)
    if every["threads"] is not None and every["threads"] < 1:
        raise ValueError(f"threads: expected one or more, found {every['threads']}")
    if isinstance(every["fix"], str):
        every["fix"] = [every["fix"]]
    return every | {group: in_units(every, group) for group in GROUPS}


WORDS: dict[Any, tuple[Any, str]] = {
    float: (numbers.Real, "a number"),
    int: (numbers.Integral, "a whole number"),
    bool: (bool, "True or False"),
    Held | Sequence[Held]: (str | list | tuple, "a name or a list of names"),
    Sequence[Segment]: (list | tuple, "a list of pairs of points"),
    str | os.PathLike[str]: (str | os.PathLike, "a path"),
}
"""Allowed values by a type hint, and their name; everything else is a name."""


def checked(given: Mapping[str, Any], of: type, others: Iterable[str] = ()) -> dict[str, Any]:
    """Options that are given, if there are such options and their values are of their type; ``None`` is as if left out.

    >>> checked({"threads": None, "looks": "+z"}, Options)
    {'looks': '+z'}
    """
    hints = get_type_hints(of)
    for name, value in given.items():
        if name not in hints:
            options = sorted({*hints, *others})
            raise TypeError(f"there is no option {name!r}.{nearest(name, options)} Options are {', '.join(options)}")
        kind, words = WORDS.get(hints[name], (str, "a name"))
        # To Python True is a number.
        if value is not None and (not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool)):
            raise TypeError(f"{name}: expected {words}, found {value!r}")
    return {name: value for name, value in given.items() if value is not None}


def in_units(values: Mapping[str, Any], group: str) -> list[float | None]:
    """The values of a group: time in ms, rotation in degrees, translation in mm."""
    return [values[f"{group}_{unit}"] for unit in UNITS]
