"""The answer of a method to one sequence, as a JSON file.

README.md holds the schema with an example. `Answer` is the same in Python.
"""

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from .rotations import Floats, matrix, quaternion

SCHEMA = "profilebench-submission-1"
Status = Literal["accepted", "refused", "failed", "unsupported"]
STATUSES: tuple[Status, ...] = ("accepted", "refused", "failed", "unsupported")
ORDER = (
    "time_offset_s", "rotation_x_rad", "rotation_y_rad", "rotation_z_rad",
    "translation_x_mm", "translation_y_mm", "translation_z_mm",
)  # fmt: skip
"""Order of a covariance: rotation perturbed on the left, about the tool's axes."""


class SubmissionError(ValueError):
    """A submission that does not follow the schema; the text names file and key."""


@dataclass(frozen=True)
class Answer:
    """One answer. Numbers that the method does not state are None."""

    status: Status
    reasons: tuple[str, ...] = ()
    time_offset_s: float | None = None
    rotation: Floats | None = None
    """tool_from_camera, 3×3."""
    translation_mm: Floats | None = None
    covariance: Floats | None = None
    """7×7 in `ORDER`, or diagonal where only sigmas were stated."""
    full_covariance: bool = True
    """False where the covariance was made from sigmas alone: then no NEES is formed of it."""
    seam_error_mm: float | None = None
    points_in_tool_mm: Floats | None = None
    run_time_s: float | None = None
    notes: dict[str, Any] = field(default_factory=dict)

    def timed(self, seconds: float) -> "Answer":
        """The same with a run time."""
        return replace(self, run_time_s=seconds)


def transform(rotation: Floats, translation_mm: Floats) -> dict[str, list[float]]:
    """A rigid transform as submissions have it."""
    return {
        "translation_mm": [float(v) for v in translation_mm],
        "rotation_wxyz": [float(v) for v in quaternion(rotation)],
    }


def to_json(answer: Answer, sequence: str, method: str) -> dict[str, Any]:
    """The JSON object of an answer."""
    out: dict[str, Any] = {
        "schema": SCHEMA, "sequence": sequence, "method": method, "status": answer.status,
        "reasons": list(answer.reasons), "time_offset_s": answer.time_offset_s, "tool_from_camera": None,
    }  # fmt: skip
    if answer.rotation is not None and answer.translation_mm is not None:
        out["tool_from_camera"] = transform(answer.rotation, answer.translation_mm)
    if answer.covariance is not None and answer.full_covariance:
        out["covariance"] = answer.covariance.tolist()
    elif answer.covariance is not None:
        s = [float(v) if np.isfinite(v) else None for v in np.sqrt(np.diag(answer.covariance))]
        out["sigma"] = {"time_offset_s": s[0], "rotation_rad": s[1:4], "translation_mm": s[4:]}
    if answer.points_in_tool_mm is not None:
        out["points_in_tool_mm"] = answer.points_in_tool_mm.tolist()
    out |= {"seam_error_mm": answer.seam_error_mm, "run_time_s": answer.run_time_s}
    return out


def write(path: Path, answer: Answer, sequence: str, method: str) -> None:
    """Write an answer; what is not finite is an error, as JSON has no such numbers."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(to_json(answer, sequence, method), indent=1, allow_nan=False) + "\n")


def read(path: Path) -> Answer:
    """Read and check a submission."""
    try:
        data = json.loads(path.read_text())
    except (OSError, json.JSONDecodeError) as error:
        raise SubmissionError(f"{path}: {error}") from None
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise SubmissionError(f"{path}: schema is not {SCHEMA!r}")
    if data.get("status") not in STATUSES:
        raise SubmissionError(f"{path}: status is {data.get('status')!r}; expected one of {', '.join(STATUSES)}")
    rotation, translation = None, None
    if data.get("tool_from_camera") is not None:
        pose = data["tool_from_camera"]
        if not isinstance(pose, dict):
            raise SubmissionError(f"{path}: tool_from_camera: expected translation_mm and rotation_wxyz")
        translation = _numbers(path, pose, "translation_mm", 3)
        q = _numbers(path, pose, "rotation_wxyz", 4)
        if q is None or translation is None:
            raise SubmissionError(f"{path}: tool_from_camera: needs translation_mm and rotation_wxyz")
        if abs(float(np.linalg.norm(q)) - 1) > 1e-3:
            raise SubmissionError(f"{path}: rotation_wxyz is no unit quaternion")
        rotation = matrix(q)
    offset = _numbers(path, data, "time_offset_s", None)
    if data["status"] == "accepted" and rotation is None:
        raise SubmissionError(f"{path}: accepted without tool_from_camera")
    covariance, full = _covariance(path, data)
    said, seconds = _numbers(path, data, "seam_error_mm", None), _numbers(path, data, "run_time_s", None)
    points = data.get("points_in_tool_mm")
    return Answer(
        data["status"], tuple(str(r) for r in data.get("reasons", [])), None if offset is None else float(offset),
        rotation, translation, covariance, full, None if said is None else float(said),
        None if points is None else np.array(points, float), None if seconds is None else float(seconds),
    )  # fmt: skip


def _covariance(path: Path, data: dict[str, Any]) -> tuple[Floats | None, bool]:
    if data.get("covariance") is not None:
        value = np.array(data["covariance"], float)
        if value.shape != (7, 7) or not np.all(np.isfinite(value)):
            raise SubmissionError(f"{path}: covariance: expected 7×7 finite numbers in the order {', '.join(ORDER)}")
        return value, True
    sigma = data.get("sigma")
    if sigma is None:
        return None, True
    parts = (
        [sigma.get("time_offset_s")],
        sigma.get("rotation_rad") or [None] * 3,
        sigma.get("translation_mm") or [None] * 3,
    )
    # Unstated values are not judged: nan is left out of the coverage.
    values = [float("nan") if v is None else float(v) for part in parts for v in part]
    if len(values) != 7:
        raise SubmissionError(f"{path}: sigma: expected time_offset_s, rotation_rad [3], translation_mm [3]")
    return np.diag(np.array(values) ** 2), False


def _numbers(path: Path, data: dict[str, Any], key: str, count: int | None) -> Any:
    """A finite number (count None) or a list of them; None where the key is absent or null."""
    value = data.get(key)
    if value is None:
        return None
    try:
        out = np.array(value, float)
    except (TypeError, ValueError):
        raise SubmissionError(f"{path}: {key}: not a number") from None
    if out.shape != (() if count is None else (count,)) or not np.all(np.isfinite(out)):
        raise SubmissionError(f"{path}: {key}: expected {count or 1} finite number(s)")
    return out
