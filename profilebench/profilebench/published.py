"""Published experiments, simulated again with the same numbers of poses, points and noise.

Published figures are quoted from the papers. Where a paper does not state what a simulation needs, the constant below
says what was assumed.
"""

from dataclasses import dataclass

import numpy as np

from . import arm
from .baselines import plane, program
from .baselines.least_squares import Residual
from .baselines.least_squares import solve as minimise
from .published_plate import Plate, Stop, measured, residuals
from .published_seam import seam_at_stops
from .rotations import Floats, apply, exp, log

PLANE_PROFILES, PLANE_POINTS, PLANE_NOISE_MM = 105, 100, 0.5
"""Sharifzadeh, Biro and Kinnell 2020: 105 profiles of 100 points with 0.5 mm of noise."""
PLANE_TILTS_DEG, PLANE_HALF_WIDTH_MM, PLANE_STAND_OFF_MM = (30.0, 45.0), 40.0, 150.0
"""Assumed: tilts of the target scan lines (two cases), half width of the field, and stand-off ± 40 mm."""
PLATE_STOPS, PLATE_POINTS, PLATE_NOISE_MM = 15, 400, 0.02
"""Pavlovčič, Arko and Jezeršek 2021: 15 poses. Assumed: 400 points of 0.02 mm noise."""
PLATE_TILT_DEG = 20.0
"""Assumed."""
ARMS = (("CNC machine", 0.02, "0.046"), ("robot arm", 0.15, "0.105"))
"""Assumed absolute accuracy in the plate's surroundings in mm, and the published bound of the displacement's spread."""


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    experiment: str
    quantity: str
    published: str
    simulated: str


def table(cells: int) -> str:
    """All experiments as a Markdown table."""
    rows = [*_plane_rows(cells), *_plate_rows(max(3, cells // 4)), *_seam_rows(max(3, cells // 4))]
    lines = ["| experiment | quantity | published | simulated here |", "|---|---|---|---|"]
    return "\n".join([*lines, *(f"| {r.experiment} | {r.quantity} | {r.published} | {r.simulated} |" for r in rows)])


def _mount(rng: np.random.Generator) -> tuple[Floats, Floats]:
    return exp(rng.normal(0, 0.3, 3)), rng.uniform([-60, -60, 60], [60, 60, 140])


def _guess(rng: np.random.Generator, hand: Floats, lever: Floats) -> tuple[Floats, Floats]:
    return exp(rng.normal(0, np.radians(3), 3)) @ hand, lever + rng.normal(0, 6, 3)


def _plane_rows(cells: int) -> list[Row]:
    rows = []
    for tilt in PLANE_TILTS_DEG:
        errors = np.array([single_plane(np.random.default_rng([20, k]), tilt) for k in range(cells)])
        what = f"single plane, {PLANE_PROFILES} × {PLANE_POINTS} points, {PLANE_NOISE_MM} mm noise, tilts {tilt:.0f}°"
        median = np.median(errors, 0)
        rows += [
            Row(what, "translation error, median mm", "0.034", f"{median[0]:.3f} (method plane, tilts assumed)"),
            Row(what, "rotation error, median °", "0.028", f"{median[1]:.3f} (method plane, tilts assumed)"),
        ]
    return rows


def single_plane(rng: np.random.Generator, tilt_deg: float) -> tuple[float, float]:
    """Errors of translation (mm) and rotation (°) of one simulated single-plane calibration.

    The target scan lines lie on circles about a point of the plane, as in the paper; tilt and spin go round with them.
    """
    hand, lever = _mount(rng)
    centre = np.array([900.0, 0.0, 200.0])
    turn = 2 * np.pi * np.arange(PLANE_PROFILES) / 15
    tilt = np.radians(tilt_deg) * (1 + np.arange(PLANE_PROFILES) // 15) / 7
    down = np.diag([1.0, -1.0, -1.0])
    lean = exp(np.stack([tilt * np.cos(turn), tilt * np.sin(turn), np.zeros_like(turn)], 1))
    camera = lean @ down @ exp(np.stack([np.zeros_like(turn), np.zeros_like(turn), turn * 1.7], 1))
    goals = centre + np.stack([60 * np.cos(turn), 60 * np.sin(turn), np.zeros_like(turn)], 1)
    stand_off = PLANE_STAND_OFF_MM + 40 * np.sin(2.3 * turn)
    place = goals - camera[:, :, 2] * stand_off[:, None]
    rotations = camera @ hand.T
    positions = place - apply(rotations, np.broadcast_to(lever, place.shape))
    x = np.linspace(-PLANE_HALF_WIDTH_MM, PLANE_HALF_WIDTH_MM, PLANE_POINTS)
    normal = camera[:, 2, :]
    z = ((centre[2] - place[:, 2])[:, None] - normal[:, :1] * x) / normal[:, 2:]
    points = np.stack([np.broadcast_to(x, z.shape), np.zeros_like(z), z], 2)
    points[:, :, [0, 2]] += PLANE_NOISE_MM * rng.normal(size=(*z.shape, 2))
    which = np.repeat(np.arange(PLANE_PROFILES), PLANE_POINTS)
    guess = _guess(rng, hand, lever)
    found = plane.calibrate(rotations[which], positions[which], points.reshape(-1, 3), *guess)
    turned = float(np.degrees(np.linalg.norm(log(found[0] @ hand.T))))
    return float(np.linalg.norm(found[1] - lever)), turned


def _plate_rows(cells: int) -> list[Row]:
    rows = []
    for name, accuracy, bound in ARMS:
        spread = [reference_plate(np.random.default_rng([21, k]), accuracy) for k in range(cells)]
        rows.append(Row(
            f"reference plate, {PLATE_STOPS} stops, {name}", "displacement of the plate measured again, σ mm",
            f"< {bound}", f"{np.median(spread):.3f} (assumed accuracy {accuracy} mm)",
        ))  # fmt: skip
    return rows


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


def _seam_rows(cells: int) -> list[Row]:
    """The same stops, noise and arms with a straight seam as the target: what trueline needs."""
    rows = []
    for name, accuracy, bound in ARMS:
        errors = [
            seam_at_stops(np.random.default_rng([22, k]), accuracy, PLATE_STOPS, PLATE_NOISE_MM) for k in range(cells)
        ]
        known = [e for e in errors if e is not None]
        said = f"{np.median(known):.3f} ({len(known)} of {cells} accepted)" if known else "no accepted answer"
        if program.executable() is None:
            said = "trueline is not on PATH"
        rows.append(Row(
            f"trueline on a fillet at {PLATE_STOPS} stops, {name}", "seam error, same arm, median mm",
            f"< {bound} (the plate's)", said,
        ))  # fmt: skip
    return rows
