"""The truth by which a sequence's answer is judged.

Two judgements of a seam point that the sensor will measure later, both over a grid of the field that the scan visited:

*strict*: where the point is in the tool's frame, by the true hand-eye transform and the true sensor.
*same arm*: where the same robot, with its own errors, sends a torch whose tip was taught by pivoting. Errors of the
arm that are the same when it measures and when it welds cancel here, as they do in production.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .cast import PX_MM, Cast, Path
from .recipe import Recipe
from .rotations import Floats, apply, exp, quaternion, rigid_fit, skew

SPEED_MM_S = 50.0
"""Speed along the seam at which an error of the time offset is counted."""
GRID = 5
"""Check points a side of the field."""
GOOD_BOUND_MM = 0.08
"""A scan whose own Cramér–Rao bound of the seam error is below this deserves an answer …"""
GOOD_OUTLIERS = 0.25
"""… if fewer of its readings than this are outliers."""
REPEATING = ("weave",)
"""Motions that repeat themselves: an offset of a period fits as well, so no answer is expected."""
LEAST_NOISE_MM = 1e-5
"""Noise that a scan without any counts as having."""
PIVOT_DEG = 25.0
"""Tilt of the six attitudes in which the torch's tip is taught."""


@dataclass(frozen=True)
class Check:
    """Noise-free readings of the field, and where they belong."""

    readings: Floats
    truth: dict[str, Any]


def check(rng: np.random.Generator, recipe: Recipe, scan: Cast) -> Check:
    """Check readings and truth of a scan."""
    cell = scan.cell
    low, high = np.percentile(scan.good_ab_mm, [2, 98], axis=0)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, GRID).T, indexing="ij"), -1).reshape(-1, 2)
    points = cell.true_sensor.in_sheet(grid)
    readings = cell.true_sensor.read(points)
    hand, lever = cell.tool_from_camera
    in_tool = points @ hand.T + lever
    path = Path(cell, scan.motion, recipe)
    times = rng.uniform(0.2, 0.8, len(grid)) * recipe.duration_s
    reported = path.reported(times)
    true = cell.robot.true_pose(*reported, None)
    along = cell.seam.frames(np.zeros(1))[0][:, 0]
    reference, _ = _torch(rng, scan, path, apply(true[0], in_tool) + true[1])
    effective = rigid_fit(cell.stated_sensor.place(readings), in_tool)
    bound = bound_mm(recipe, scan, in_tool)
    interval = scan.time_offset_interval_s
    good = bound < GOOD_BOUND_MM and scan.outlier_share < GOOD_OUTLIERS and recipe.motion not in REPEATING
    return Check(readings, {
        "case": recipe.case, "motion": recipe.motion, "sensor": recipe.sensor, "good_scan": bool(good),
        "bound_mm": _round(bound, 5), "outlier_share": _round(scan.outlier_share, 4),
        "time_offset_s": _round((interval[0] + interval[1]) / 2, 9),
        "time_offset_interval_s": [_round(v, 9) for v in interval],
        "tool_from_camera": _transform(hand, lever),
        "effective_tool_from_camera": _transform(*effective),
        "speed_mm_s": SPEED_MM_S,
        "points_in_tool_mm": _rows(in_tool, 6),
        "along_in_tool": _rows(np.swapaxes(reported[0], -1, -2) @ along, 9),
        "reported_rotation_wxyz": _rows(quaternion(reported[0]), 12),
        "reported_position_mm": _rows(reported[1], 6),
        "torch_reference_mm": _rows(reference, 6),
    })  # fmt: skip


def _torch(rng: np.random.Generator, scan: Cast, path: Path, goals: Floats) -> tuple[Floats, Floats]:
    """Places to which the taught torch must be sent for its true tip to reach goals (base, mm), and
    the taught tip."""
    cell = scan.cell
    hand, lever = cell.tool_from_camera
    tip = hand @ cell.stated_sensor.axes()[0] + lever
    nominal, _ = path.reported(np.array([path.recipe.duration_s / 2]))
    turns = exp(np.radians(PIVOT_DEG) * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]))
    spike = np.broadcast_to(cell.seam.centre_mm, (6, 3))
    rotations, positions = _sent(cell.robot, turns @ nominal, tip, spike)
    # Pivot: R_k τ + p_k = c for the taught tip τ and the spike c.
    system = np.concatenate([rotations, np.broadcast_to(-np.eye(3), (6, 3, 3))], 2).reshape(-1, 6)
    taught = np.linalg.lstsq(system, -positions.reshape(-1), rcond=None)[0][:3]
    rotations, positions = _sent(cell.robot, np.repeat(nominal, len(goals), 0), tip, goals)
    return apply(rotations, np.broadcast_to(taught, goals.shape)) + positions, taught


def _sent(robot: Any, rotations: Floats, tip: Floats, goals: Floats) -> tuple[Floats, Floats]:
    """Reported poses of given rotation at which the true tip is at the goals."""
    positions = goals - apply(rotations, np.broadcast_to(tip, goals.shape))
    for _ in range(4):
        true = robot.true_pose(rotations, positions, None)
        positions = positions + goals - apply(true[0], np.broadcast_to(tip, goals.shape)) - true[1]
    return rotations, positions


def bound_mm(recipe: Recipe, scan: Cast, in_tool: Floats) -> float:
    """Cramér–Rao bound of the seam error (3-D RMS, mm) from white noise alone, with everything unknown."""
    cell = scan.cell
    path = Path(cell, scan.motion, recipe)
    t = scan.exposures_s
    rotations, positions = path.reported(t)
    hand, lever = cell.tool_from_camera
    state = scan.motion.state(t)
    frames = cell.seam.frames(state[:, 0] - scan.motion.length_mm / 2)
    sensor = cell.stated_sensor
    held = sensor.in_sheet(state[:, 1:3])
    y = held @ hand.T + lever
    step = 1e-3
    before, after = path.reported(t - step), path.reported(t + step)
    velocity = (apply(after[0], y) + after[1] - apply(before[0], y) - before[1]) / (2 * step)
    placed = apply(rotations, y) + positions
    arm = placed - cell.seam.centre_mm
    # Columns of the displacement in base: offset (s), rotation, translation, and the seam's own rotation and shift.
    columns = np.concatenate(
        [
            -velocity[:, :, None],
            -rotations @ skew(held @ hand.T),
            rotations,
            skew(arm),
            -np.tile(np.eye(3), (len(t), 1, 1)),
        ],
        2,
    )
    cross = np.swapaxes(frames[:, :, 1:], -1, -2)
    _, along, depth, _ = sensor.axes()
    # The two of the six motions of a straight seam that change nothing: rotation about it, shift
    # along it.
    basis = np.zeros((13, 11))
    basis[:7, :7] = np.eye(7)
    basis[7:10, 7:9], basis[10:13, 9:11] = cell.seam.frame[:, 1:], cell.seam.frame[:, 1:]
    sheet = cross @ rotations @ hand @ np.stack([along, depth], 1)
    noise = recipe.noise_px * PX_MM if recipe.sensor == "camera_laser" else recipe.noise_mm
    J = (np.linalg.solve(sheet, cross @ columns @ basis) / max(noise, LEAST_NOISE_MM)).reshape(-1, 11)
    J = J * np.sqrt(max(0.0, 1 - scan.outlier_share))
    scale = np.linalg.norm(J, axis=0)
    if not np.all(scale > 0):
        return float("inf")
    values, vectors = np.linalg.eigh((J / scale).T @ (J / scale))
    if values[0] < 1e-9 * values[-1]:
        return float("inf")
    covariance = (vectors / values) @ vectors.T / np.outer(scale, scale)
    return _field_rms(covariance[:7, :7], in_tool, lever, rotations[len(t) // 2].T @ cell.seam.frame[:, 0])


def _field_rms(covariance: Floats, in_tool: Floats, lever: Floats, along: Floats) -> float:
    """Seam error over points in the tool's frame that a 7×7 covariance (s, rad, mm) gives."""
    Y = np.zeros((len(in_tool), 3, 7))
    Y[:, :, 0] = -SPEED_MM_S * along
    Y[:, :, 1:4] = -skew(in_tool - lever)
    Y[:, :, 4:] = np.eye(3)
    return float(np.sqrt(np.einsum("nij,jk,nik->n", Y, covariance, Y).mean()))


def _transform(rotation: Floats, translation_mm: Floats) -> dict[str, list[float]]:
    return {
        "translation_mm": [_round(v, 7) for v in translation_mm],
        "rotation_wxyz": [_round(v, 12) for v in quaternion(rotation)],
    }


def _rows(values: Floats, digits: int) -> list[list[float]]:
    return [[_round(v, digits) for v in row] for row in values]


def _round(value: float, digits: int) -> float:
    return round(float(value), digits)
