"""Casts a scan: moves the true sensor over the true seam and logs what robot and sensor would log."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import cell as cells
from . import clock, motion
from .cell import Cell
from .files import pose_rows
from .recipe import Recipe
from .rotations import Floats, apply, exp, log

MARGIN_S = 1.0
"""The robot log begins this much before the first exposure and ends this much after the last one."""
EPOCH_S = 1_700_000_000.0
"""Stamps are of this order, as a PC's clock gives them."""
SOLVE_STEPS = 6
"""Newton steps for the seam's intersection with the sheet; it is nearly linear."""
PX_MM = 0.036
"""Size of a camera's pixel on the seam, by which sizes in px are converted for other sensors."""


@dataclass(frozen=True)
class Cast:
    """The log of a scan with everything that the truth is made from."""

    cell: Cell
    motion: motion.Motion
    robot_rows: Floats
    """Stamp and pose (`files.POSE_COLUMNS`)."""
    feature_rows: Floats
    """Stamp, reading, and frame counter."""
    outlier_share: float
    time_offset_interval_s: tuple[float, float]
    exposures_s: Floats
    """True exposure of each row of `feature_rows`."""
    good_ab_mm: Floats
    """True places in the sheet of the readings that are no outliers."""
    notes: dict[str, Any]


class Path:
    """Poses that the controller reports (without noise) and true poses at any time."""

    def __init__(self, cell: Cell, move: motion.Motion, recipe: Recipe) -> None:
        """Remember cell and path; poses are computed on demand."""
        self.cell, self.move, self.recipe = cell, move, recipe
        self._back = cell.tool_from_camera[0].T

    def reported(self, times_s: Floats) -> tuple[Floats, Floats]:
        """base_from_tool of the nominal path."""
        seam, sensor = self.cell.seam, self.cell.stated_sensor
        state = self.move.state(np.clip(times_s, 0, self.move.duration_s))
        s = state[:, 0] - self.move.length_mm / 2
        _, along, depth, _ = sensor.axes()
        from_camera = np.stack([along, np.cross(depth, along), depth])  # rows: across, along, down
        frames = seam.frames(s)
        nominal = np.stack([frames[:, :, 1], frames[:, :, 0], -frames[:, :, 2]], 2)
        rotation = nominal @ exp(state[:, [4, 3, 5]]) @ from_camera
        # Looked at along the seam: the middle of the work is straight above the seam, between the plates.
        held = apply(rotation, sensor.in_sheet(state[:, 1:3]))
        camera = seam.points(s) - held
        tool = rotation @ self._back
        return tool, camera - apply(tool, np.broadcast_to(self.cell.tool_from_camera[1], camera.shape))

    def true(self, times_s: Floats) -> tuple[Floats, Floats]:
        """True base_from_tool: behind the reported pose by a lag, and with the arm's errors."""
        if self.recipe.lag_s:
            rotations, positions = self._lagged(times_s)
        else:
            rotations, positions = self.reported(times_s)
        return self.cell.robot.true_pose(rotations, positions, times_s)

    def _lagged(self, times_s: Floats) -> tuple[Floats, Floats]:
        """First-order lag of what is commanded, by its impulse response on a fine grid."""
        ages = np.linspace(0, 6 * self.recipe.lag_s, 49)
        weights = np.exp(-ages / self.recipe.lag_s)
        weights /= weights.sum()
        ages += 1.0 * self.recipe.lag_s - (weights * ages).sum()  # the grid's mean age is the lag exactly
        now, _ = self.reported(times_s)
        turn, place = np.zeros((len(times_s), 3)), np.zeros((len(times_s), 3))
        for age, weight in zip(ages, weights, strict=True):
            rotation, position = self.reported(times_s - age)
            turn += weight * log(np.swapaxes(now, -1, -2) @ rotation)
            place += weight * position
        return now @ exp(turn), place


def cast(rng: np.random.Generator, recipe: Recipe) -> Cast:
    """One scan of a recipe."""
    cell = cells.draw(rng, recipe)
    move = motion.draw(recipe.motion, rng, recipe.duration_s, recipe.length_mm)
    path = Path(cell, move, recipe)
    exposures = np.arange(0.05, recipe.duration_s - 0.05, 1 / recipe.feature_hz)
    lean = move.state(exposures)[:, 3]
    shifts = recipe.exposure_wander_s * lean / max(np.abs(lean).max(), 1e-9) if recipe.exposure_wander_s else 0.0
    middles = exposures + shifts
    rotations, positions = path.true(middles)
    points = _seen(cell, rotations, positions, recipe, move.state(middles)[:, 0] - move.length_mm / 2)
    stalls = clock.stall_times(rng, recipe.feature_clock, -MARGIN_S, recipe.duration_s + MARGIN_S)
    readings, outlier = _detected(rng, recipe, cell, points, move.state(middles)[:, 3:])
    stamp, keep, late = clock.stamps(rng, exposures, recipe.feature_clock, stalls)
    inside = _in_view(cell, readings)
    keep &= inside
    rows = np.column_stack([EPOCH_S + stamp + recipe.time_offset_s, readings, np.arange(len(stamp))])[keep]
    robot_rows, robot_late = _robot_log(rng, recipe, path, stalls)
    good = keep & ~outlier
    ends = _offset_interval(recipe, late[keep], robot_late)
    return Cast(
        cell, move, robot_rows, rows, float(outlier[keep].mean()) if keep.any() else 1.0, ends, middles[keep],
        cell.true_sensor.to_sheet(points)[good], {"frames": int(len(stamp)), "kept": int(keep.sum())},
    )  # fmt: skip


def _seen(cell: Cell, rotations: Floats, positions: Floats, recipe: Recipe, s_mm: Floats) -> Floats:
    """Points in the camera's frame where the seam meets the sheet."""
    hand, lever = cell.tool_from_camera
    camera = rotations @ hand
    place = apply(rotations, np.broadcast_to(lever, positions.shape)) + positions
    back = np.swapaxes(camera, -1, -2)

    def point(s: Floats) -> Floats:
        p = cell.seam.points(s)
        if recipe.edge_radius_mm:
            tangent = cell.seam.frames(s)[:, :, 0]
            view = place - p
            view = view - (view * tangent).sum(1, keepdims=True) * tangent
            p = p + recipe.edge_radius_mm * view / np.linalg.norm(view, axis=1, keepdims=True)
        return apply(back, p - place)

    s = s_mm.copy()
    for _ in range(SOLVE_STEPS):
        beside = cell.true_sensor.beside_sheet(point(s))
        slope = (cell.true_sensor.beside_sheet(point(s + 0.05)) - beside) / 0.05
        s = s - np.clip(beside / np.where(np.abs(slope) < 0.05, 0.05, slope), -20, 20)
    return point(s)


def _detected(
    rng: np.random.Generator, recipe: Recipe, cell: Cell, points: Floats, tilts_rad: Floats
) -> tuple[Floats, np.ndarray[Any, np.dtype[np.bool_]]]:
    """Readings with noise, bias and outliers, and which of them are outliers."""
    n = len(points)
    sensor = cell.true_sensor
    wrong = rng.random(n) < recipe.spatter
    ab = sensor.to_sheet(points)
    places = ab.copy()
    places[wrong] = rng.uniform(-1, 1, (int(wrong.sum()), 2)) * [30.0, 28.0]
    for share, spread in ((recipe.clusters, 0.4), (recipe.other_edge, 0.0)):
        for start, stop in _stretches(rng, n, share, recipe.feature_hz):
            if spread:
                places[start:stop] = rng.uniform(-22, 22, 2) + rng.normal(0, spread, (stop - start, 2))
            else:
                places[start:stop] = ab[start:stop] + rng.choice([-1, 1]) * np.array([rng.uniform(2, 6), 0.0])
            wrong[start:stop] = True
    moved = sensor.in_sheet(places)
    readings = sensor.read(np.where(wrong[:, None], moved, points))
    noise = _noise(rng, recipe, n)
    bias = np.zeros((n, 2))
    if recipe.bias_per_rad:
        mix = rng.normal(size=(2, 2)) / np.sqrt(2)
        bias = tilts_rad[:, :2] @ mix.T * recipe.bias_per_rad
    if sensor.kind == "camera_laser":
        return readings + recipe.noise_px * noise + bias, wrong
    small = recipe.noise_mm * noise + PX_MM * bias
    if sensor.kind == "profiler":
        return readings + small, wrong
    _, along, depth, _ = cell.stated_sensor.axes()
    return readings + small @ np.stack([along, depth]), wrong


def _noise(rng: np.random.Generator, recipe: Recipe, n: int) -> Floats:
    """White noise of unit spread, heavy-tailed or with a slow part if the recipe states it."""
    if recipe.student_dof:
        scale = np.sqrt((recipe.student_dof - 2) / recipe.student_dof)
        noise = rng.standard_t(recipe.student_dof, (n, 2)) * scale
    else:
        noise = rng.normal(size=(n, 2))
    if recipe.correlated:
        keep = np.exp(-1 / recipe.feature_hz / 0.2)
        slow = np.zeros((n, 2))
        slow[0] = rng.normal(size=2)
        kicks = rng.normal(size=(n, 2)) * np.sqrt(1 - keep**2)
        for i in range(1, n):
            slow[i] = keep * slow[i - 1] + kicks[i]
        noise = noise + recipe.correlated * slow
    return np.asarray(noise, float)


def _stretches(rng: np.random.Generator, n: int, share: float, rate_hz: float) -> list[tuple[int, int]]:
    """Random stretches of 0.2 to 1 s that make up a share of n readings."""
    out, covered = [], 0.0
    while covered < share * n:
        length = int(min(rng.uniform(0.2, 1.0) * rate_hz, share * n - covered + 1)) + 1
        start = int(rng.integers(0, max(1, n - length)))
        out.append((start, start + length))
        covered += length
    return out


def _in_view(cell: Cell, readings: Floats) -> np.ndarray[Any, np.dtype[np.bool_]]:
    sensor = cell.stated_sensor
    if sensor.kind == "camera_laser":
        low = (readings >= 0).all(1)
        return np.asarray(low & (readings[:, 0] < sensor.width - 1) & (readings[:, 1] < sensor.height - 1))
    ab = sensor.to_sheet(sensor.place(readings))
    return np.asarray((np.abs(ab[:, 0]) < 35) & (np.abs(ab[:, 1]) < 40))


def _robot_log(rng: np.random.Generator, recipe: Recipe, path: Path, stalls_s: Floats) -> tuple[Floats, Floats]:
    """Rows of robot.csv, and how late each was stamped."""
    events = np.arange(-MARGIN_S, recipe.duration_s + MARGIN_S, 1 / recipe.robot_hz)
    taken = events
    if recipe.polled_hz:
        phase = rng.uniform(0, 1 / recipe.polled_hz)
        taken = np.floor((events - phase) * recipe.polled_hz) / recipe.polled_hz + phase
    rotations, positions = path.reported(taken)
    if recipe.mean_filter_s:
        rotations, positions = _averaged(path, taken, recipe.mean_filter_s)
    new = np.concatenate([[True], np.diff(taken) > 0])
    held = np.cumsum(new) - 1
    shake = rng.normal(0, recipe.robot_noise_mm, (new.sum(), 3))[held]
    turn = rng.normal(0, np.radians(recipe.robot_noise_deg), (new.sum(), 3))[held]
    positions = np.round((positions + shake) / recipe.quantised_mm) * recipe.quantised_mm
    rotations = exp(turn) @ rotations
    vectors = np.round(log(rotations) / np.radians(recipe.quantised_deg)) * np.radians(recipe.quantised_deg)
    stamp, keep, late = clock.stamps(rng, events, recipe.robot_clock, stalls_s)
    rows = np.column_stack([EPOCH_S + stamp, pose_rows(exp(vectors), positions)])[keep]
    return rows, late[keep]


def _averaged(path: Path, times_s: Floats, width_s: float) -> tuple[Floats, Floats]:
    """Mean of the reported poses over the last `width_s`."""
    now, _ = path.reported(times_s)
    turn, place = np.zeros((len(times_s), 3)), np.zeros((len(times_s), 3))
    ages = (np.arange(12) + 0.5) / 12 * width_s
    for age in ages:
        rotation, position = path.reported(times_s - age)
        turn += log(np.swapaxes(now, -1, -2) @ rotation) / len(ages)
        place += position / len(ages)
    return now @ exp(turn), place


def _offset_interval(recipe: Recipe, feature_late: Floats, robot_late: Floats) -> tuple[float, float]:
    """Every offset that may be called right: lateness counted or not, and a lag counted as a delay or not.

    Against a log that is a moving mean the sensor seems early by half its length. Against a log of commands, which
    the robot follows late, it seems late by the lag. A clock with a step has two right offsets.
    """
    base = recipe.time_offset_s - recipe.mean_filter_s / 2
    ends = [base]
    for f in (np.mean, np.median):
        if len(feature_late) and len(robot_late):
            ends.append(base + float(f(feature_late)) - float(f(robot_late)))
    spread = abs(recipe.feature_clock.step_s) / 2 + recipe.exposure_wander_s / 2
    # A polled pose is up to a period older than its stamp.
    stale = 1 / recipe.robot_hz if recipe.polled_hz else 0.0
    return min(ends) - spread - stale, max(ends) + spread + recipe.lag_s
