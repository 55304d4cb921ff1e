"""Options of a calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias, TypedDict

Held: TypeAlias = Literal["time-offset", "hand-eye"]


class Options(TypedDict, total=False):
    """Options of a calibration; those of ``trueline calibrate`` by their names with underscores.

    ``sensor_mode`` is ``--sensor``; ``require_…`` are the parts of ``--require``, ``fixed_sigma_…`` those of
    ``--fixed-sigma``.
    """

    use: Literal["auto", "seam", "stripe", "both"]
    residual: Literal["sheet", "point-to-line"]
    loss: Literal["squared", "huber", "cauchy", "geman-mc-clure", "tukey"]
    fix: Held | Sequence[Held]
    fixed_sigma_ms: float
    fixed_sigma_deg: float
    fixed_sigma_mm: float
    stamps: Literal["auto", "raw", "regular"]
    sensor_mode: Literal["fixed", "prior", "free"]
    robot_accuracy_mm: float
    feature_bias_px: float
    feature_sigma_px: float
    feature_sigma_mm: float
    robot_sigma_mm: float
    stamp_sigma_ms: float
    offset_within_s: float
    looks: Literal["+x", "-x", "+y", "-y", "+z", "-z"]
    speed_mm_s: float
    stand_off_mm: float
    accept_partial: bool
    align_clocks: bool
    threads: int
    require_ms: float
    require_deg: float
    require_mm: float


UNITS = ("ms", "deg", "mm")
GROUPS = ("require", "fixed_sigma")


def as_compiled(options: Options) -> dict[str, Any]:
    """The options as the compiled half takes them; what is not given keeps its default.

    Raises
    ------
    TypeError
        For an option that there is not.
    """
    unknown = sorted(set(options) - set(Options.__annotations__))
    if unknown:
        raise TypeError(f"there is no option {unknown[0]!r}; options are {', '.join(sorted(Options.__annotations__))}")
    every = dict.fromkeys(Options.__annotations__) | {"fix": [], "accept_partial": False, "align_clocks": False}
    taken = every | dict(options)
    if isinstance(taken["fix"], str):
        taken["fix"] = [taken["fix"]]
    return taken | {group: in_units(taken, group) for group in GROUPS}


def in_units(values: Mapping[str, Any], group: str) -> list[float | None]:
    """The values of a group: time in ms, rotation in degrees, translation in mm."""
    return [values[f"{group}_{unit}"] for unit in UNITS]
