"""Published experiments, repeated with the same numbers of poses, points and noise.

Published figures are quoted. If a publication omits an input of the simulation, the constant below
states the assumption. The sphere is no simulation: its profiles are real.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import arm, real
from .baselines import program
from .baselines.least_squares import Residual
from .baselines.least_squares import solve as minimise
from .published_plane import HALF_WIDTH_MM, LINES, NOISE_MM, POINTS, REFERENCES, single_plane
from .published_plate import Plate, Stop, measured, residuals
from .published_seam import Found, Profiles, seam_at_stops
from .rotations import Floats, exp

PLANE_STOPS = 9 * LINES + REFERENCES
PLATE_STOPS, PLATE_POINTS, PLATE_NOISE_MM = 15, 400, 0.02
"""U. Pavlovčič, P. Arko, M. Jezeršek, "Simultaneous Hand–Eye and Intrinsic Calibration of a Laser Profilometer Mounted
on a Robot Arm", Sensors 21(4), 1037, 2021: 15 poses. Assumed: 400 points of 0.02 mm noise, and the plate's form."""
PLATE_TILT_DEG, PLATE_HALF_WIDTH_MM = 20.0, 30.0
"""Assumed."""
ARMS = (("CNC machine", 0.02, "0.046"), ("robot arm", 0.15, "0.105"))
"""Assumed absolute accuracy in the plate's surroundings in mm, and the published bound of the displacement's spread."""
NOT_SUPPORTED = "not supported"
NOT_FOUND = "trueline is not on PATH"


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    experiment: str
    data: str
    quantity: str
    published: str
    baseline: str
    trueline: str


def table(cells: int, robcalibrator: Path | None) -> str:
    """All experiments as a Markdown table: planes are simulated `cells` times, plates and fillets a third as often."""
    few = max(3, cells // 3)
    rows = [*_plane_rows(cells), *_plane_seam_rows(few), *_plate_rows(few), *_plate_seam_rows(few)]
    rows += _sphere_rows(robcalibrator)
    lines = ["| experiment | data | quantity | published | method of ProfileBench | trueline |", "|" + "---|" * 6]
    return "\n".join(
        lines
        + [f"| {r.experiment} | {r.data} | {r.quantity} | {r.published} | {r.baseline} | {r.trueline} |" for r in rows]
    )


def _mount(rng: np.random.Generator) -> tuple[Floats, Floats]:
    return exp(rng.normal(0, 0.3, 3)), rng.uniform([-60, -60, 60], [60, 60, 140])


def _guess(rng: np.random.Generator, hand: Floats, lever: Floats) -> tuple[Floats, Floats]:
    return exp(rng.normal(0, np.radians(3), 3)) @ hand, lever + rng.normal(0, 6, 3)


def _plane_rows(cells: int) -> list[Row]:
    errors = np.array([single_plane(np.random.default_rng([20, k])) for k in range(cells)])
    what, data = f"single plane, {PLANE_STOPS} × {POINTS} points, {NOISE_MM} mm noise", f"simulated, {cells} systems"
    median = np.median(errors, 0)
    return [
        Row(what, data, "translation error, median mm", "0.034", f"{median[0]:.3f} (`plane`)", NOT_SUPPORTED),
        Row(what, data, "rotation error, median °", "0.028", f"{median[1]:.3f} (`plane`)", NOT_SUPPORTED),
    ]


def _plane_seam_rows(cells: int) -> list[Row]:
    """A fillet in the place of the plane: as many stops and points, the same noise and no error of the robot."""
    wanted = Profiles(PLANE_STOPS, POINTS, HALF_WIDTH_MM, NOISE_MM)
    found = _fillets(23, cells, 0.0, wanted)
    what = f"fillet in its place, {PLANE_STOPS} × {POINTS} points, {NOISE_MM} mm noise"
    data = f"simulated, {cells} fillets"
    return [
        Row(what, data, "translation error, median mm", "–", "–", _median(found, lambda f: f.translation_mm, 3)),
        Row(what, data, "rotation error, median °", "–", "–", _median(found, lambda f: f.rotation_deg, 3)),
    ]


def _plate_rows(cells: int) -> list[Row]:
    rows = []
    for name, accuracy, bound in ARMS:
        spread = [reference_plate(np.random.default_rng([21, k]), accuracy) for k in range(cells)]
        rows.append(Row(
            f"reference plate, {PLATE_STOPS} stops, {name}",
            f"simulated, {cells} plates, accuracy {accuracy} mm assumed",
            "displacement of the plate measured again, σ mm", f"< {bound}", f"{np.median(spread):.3f}", NOT_SUPPORTED,
        ))  # fmt: skip
    return rows


def _plate_seam_rows(cells: int) -> list[Row]:
    """A fillet in the place of the plate: the same stops, points, noise and arms."""
    rows = []
    for name, accuracy, _ in ARMS:
        wanted = Profiles(PLATE_STOPS, PLATE_POINTS, PLATE_HALF_WIDTH_MM, PLATE_NOISE_MM)
        found = _fillets(22, cells, accuracy, wanted)
        rows.append(Row(
            f"fillet in its place, {PLATE_STOPS} stops, {name}",
            f"simulated, {cells} fillets, accuracy {accuracy} mm assumed",
            "seam error of the same arm, median mm", "–", "–", _median(found, lambda f: f.seam_mm, 3),
        ))  # fmt: skip
    return rows


def _fillets(seed: int, cells: int, accuracy_mm: float, wanted: Profiles) -> list[Found | None] | None:
    if program.executable() is None:
        return None
    return [seam_at_stops(np.random.default_rng([seed, k]), accuracy_mm, wanted) for k in range(cells)]


def _median(found: list[Found | None] | None, value: Callable[[Found], float], digits: int) -> str:
    """Median over all answers, accepted or not: refusing hard ones wins nothing."""
    if found is None:
        return NOT_FOUND
    known = [f for f in found if f is not None]
    if not known:
        return "no answer"
    accepted = sum(f.accepted for f in known)
    return f"{np.median([value(f) for f in known]):.{digits}f} ({accepted} of {len(found)} accepted)"


def _sphere_rows(robcalibrator: Path | None) -> list[Row]:
    """All 15 real profiles, and each of them held out once."""
    what, published = "sphere, 15 stops, FANUC robot (RobCalibrator)", "no figure"
    if robcalibrator is None:
        return [Row(what, "real", "residuals, 3-D RMS mm", published, "give --robcalibrator", NOT_SUPPORTED)]
    fit_mm, held_mm = real.leave_one_out(robcalibrator)
    return [
        Row(what, "real", "residuals, 3-D RMS mm", published, f"{fit_mm:.2f} (`sphere`)", NOT_SUPPORTED),
        Row(what, "real", "each stop held out, 3-D RMS mm", published, f"{held_mm:.2f} (`sphere`)", NOT_SUPPORTED),
    ]


def reference_plate(rng: np.random.Generator, accuracy_mm: float) -> float:
    """Spread (mm, 3-D RMS) of the plate's place over new stops after a calibration at 15 stops."""
    hand, lever = _mount(rng)
    robot = arm.draw(rng, accuracy_mm, 0.0, 0.0, 0.0)
    plate = Plate(np.array([900.0, 0.0, 250.0]), exp(rng.normal(0, 0.03, 3)))
    stops = [measured(rng, plate, robot, hand, lever, PLATE_TILT_DEG, PLATE_POINTS, PLATE_NOISE_MM)
             for _ in range(2 * PLATE_STOPS)]  # fmt: skip
    first, later = stops[:PLATE_STOPS], stops[PLATE_STOPS:]
    guess = _guess(rng, hand, lever)
    scales = np.array([*[0.02] * 3, *[3.0] * 3, *[0.01] * 3, *[3.0] * 3])

    def fit(x: Floats) -> Floats:
        return residuals(plate.moved(x[6:]), first, exp(x[:3]) @ guess[0], guess[1] + x[3:6])

    x = minimise(fit, 12, scales, 40).step
    rotation, translation, found = exp(x[:3]) @ guess[0], guess[1] + x[3:6], plate.moved(x[6:])
    # Each later triple of stops places the plate anew; its displacement is what the paper states.
    moves = []
    for k in range(0, PLATE_STOPS, 3):
        move = minimise(_shifted(found, later[k : k + 3], rotation, translation), 6, scales[6:], 30)
        moves.append(move.step[3:])
    return float(np.sqrt((np.array(moves) ** 2).sum(1).mean()))


def _shifted(plate: Plate, stops: list[Stop], rotation: Floats, translation_mm: Floats) -> Residual:
    """Residuals of stops for a plate that is turned and shifted."""
    return lambda x: residuals(plate.moved(x), stops, rotation, translation_mm)
