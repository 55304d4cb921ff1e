"""Quality of one answer, and of its stated uncertainty."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .files import Sequence
from .rotations import Floats, apply, log, matrix
from .submission import Answer

WRONG_MM = 1.0
"""An accepted answer with a seam error above this is wrong."""
SOLVED_MM = 0.5
"""A good scan is solved by an accepted answer with a seam error below this."""
OVER_SAID = 3.0
"""True over stated seam error above which an answer is overconfident."""
OVER_SIGMAS = 4.0
"""Error of the time offset, in stated sigmas, above which an answer is overconfident."""
COVERAGE_SIGMAS = 1.959964
"""Half width of a 95 % interval."""


@dataclass(frozen=True)
class Judged:
    """Everything that is known of one answer. Numbers that cannot be formed are None."""

    sequence: str
    case: str
    status: str
    good_scan: bool
    accepted: bool
    strict_mm: float | None = None
    same_arm_mm: float | None = None
    said_mm: float | None = None
    offset_error_s: float | None = None
    """Signed; 0 anywhere in the interval of right offsets."""
    offset_z: float | None = None
    rotation_deg: float | None = None
    translation_mm: float | None = None
    nees: float | None = None
    """Divided by its 7 degrees of freedom: 1 on average if the covariance is right."""
    covered: tuple[int, int] = (0, 0)
    """Components within their 95 % interval, and the number of stated ones."""
    run_time_s: float | None = None

    @property
    def true_mm(self) -> float | None:
        """The smaller of the two seam errors: an estimate may serve the true tool or the arm as it is."""
        values = [v for v in (self.strict_mm, self.same_arm_mm) if v is not None]
        return min(values) if values else None

    @property
    def wrong(self) -> bool:
        """Accepted, and of no use."""
        return self.accepted and (self.true_mm is None or self.true_mm > WRONG_MM)

    @property
    def overconfident(self) -> bool:
        """Accepted with a ± that is far too small."""
        over = self.said_mm is not None and self.true_mm is not None and self.true_mm > OVER_SAID * self.said_mm
        return self.accepted and (over or (self.offset_z is not None and self.offset_z > OVER_SIGMAS))

    @property
    def solved(self) -> bool:
        """A good scan with a good answer."""
        return self.good_scan and self.accepted and self.true_mm is not None and self.true_mm < SOLVED_MM


def judge(answer: Answer, sequence: Sequence, truth: dict[str, Any]) -> Judged:
    """Judge an answer by the truth of its sequence."""
    base = {
        "sequence": sequence.name, "case": truth["case"], "status": answer.status, "good_scan": truth["good_scan"],
        "accepted": answer.status == "accepted", "run_time_s": answer.run_time_s, "said_mm": answer.seam_error_mm,
    }  # fmt: skip
    moving = truth["time_offset_interval_s"] is not None
    if answer.rotation is None or answer.translation_mm is None or (moving and answer.time_offset_s is None):
        return Judged(**base)
    late = 0.0
    if moving:
        low, high = truth["time_offset_interval_s"]
        assert answer.time_offset_s is not None
        late = answer.time_offset_s - float(np.clip(answer.time_offset_s, low, high))
    points = answer.points_in_tool_mm
    if points is None or points.shape != (len(sequence.check), 3):
        points = sequence.sensor.place(sequence.check) @ answer.rotation.T + answer.translation_mm
    shift = -truth["speed_mm_s"] * late * np.array(truth["along_in_tool"]) if moving else 0.0
    points = points + shift
    strict = _rms(points - np.array(truth["points_in_tool_mm"]))
    same_arm = None
    if moving:
        torch = apply(matrix(np.array(truth["reported_rotation_wxyz"])), points) + np.array(
            truth["reported_position_mm"]
        )
        same_arm = _rms(torch - np.array(truth["torch_reference_mm"]))
    errors = _errors(answer, truth, late if moving else np.nan)
    nees, covered, z = _against_stated(answer, errors)
    return Judged(
        **base, strict_mm=strict, same_arm_mm=same_arm, offset_error_s=late if moving else None, offset_z=z,
        rotation_deg=float(np.degrees(np.linalg.norm(errors[1:4]))), translation_mm=float(np.linalg.norm(errors[4:])),
        nees=nees, covered=covered,
    )  # fmt: skip


def _errors(answer: Answer, truth: dict[str, Any], late_s: float) -> Floats:
    """Error in the order of `submission.ORDER` against the effective hand-eye transform of the stated sensor."""
    pose = truth["effective_tool_from_camera"]
    assert answer.rotation is not None and answer.translation_mm is not None
    turn = log(answer.rotation @ matrix(np.array(pose["rotation_wxyz"])).T)
    return np.array([late_s, *turn, *(answer.translation_mm - np.array(pose["translation_mm"]))])


def _against_stated(answer: Answer, errors: Floats) -> tuple[float | None, tuple[int, int], float | None]:
    """NEES / 7, components covered, and the offset's error in sigmas."""
    if answer.covariance is None:
        return None, (0, 0), None
    variances = np.diag(answer.covariance)
    known = np.isfinite(variances) & (variances > 0) & np.isfinite(errors)
    z = np.abs(errors[known]) / np.sqrt(variances[known])
    covered = int((z < COVERAGE_SIGMAS).sum()), int(known.sum())
    nees = None
    if answer.full_covariance and known.all():
        scale = np.sqrt(variances)
        correlation = answer.covariance / np.outer(scale, scale)
        nees = float(errors / scale @ np.linalg.pinv(correlation, hermitian=True) @ (errors / scale)) / len(errors)
    return nees, covered, float(z[0]) if known[0] else None


def _rms(differences: Floats) -> float:
    return float(np.sqrt((differences**2).sum(1).mean()))
