"""Profiles of a plane or of a sphere from a robot that stands at each of them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import cell as cells
from .recipe import Recipe
from .rotations import Floats, exp, rigid_fit
from .truth import GRID, _rows, _transform

FIELD_MM = (28.0, 25.0)
"""Half width and half depth of the field."""


@dataclass(frozen=True)
class Standing:
    """Poses and profiles of one sequence with its truth."""

    cell: cells.Cell
    rotations: Floats
    positions_mm: Floats
    profile_rows: Floats
    """Stop, x and z in mm."""
    check_readings: Floats
    truth: dict[str, Any]


def cast(rng: np.random.Generator, recipe: Recipe) -> Standing:
    """Stops over a plane (z = 0 of the seam's frame) or a sphere about its centre."""
    cell = cells.draw(rng, recipe)
    hand, lever = cell.tool_from_camera
    sensor = cell.stated_sensor
    frame, centre = cell.seam.frame, cell.seam.centre_mm
    nominal = np.stack([frame[:, 1], frame[:, 0], -frame[:, 2]], 1)
    rotations, positions, rows = [], [], []
    for stop in range(recipe.stops):
        tilt = rng.uniform(-1, 1, 3) * np.radians([25, 25, 60])
        held = sensor.in_sheet(rng.uniform(-1, 1, (1, 2)) * [12.0, 15.0])[0]
        goal = centre + frame @ np.array([*rng.uniform(-60, 60, 2), 0.0])
        if recipe.target == "sphere":
            # The sheet cuts the sphere somewhere between its pole and 0.7 of its radius.
            goal = centre + 0.7 * recipe.radius_mm * frame @ np.array([rng.uniform(-1, 1), rng.uniform(-0.5, 0.5), 0.0])
        camera = nominal @ exp(tilt)
        place = goal - camera @ held
        tool = camera @ hand.T
        position = place - tool @ lever
        true = cell.robot.true_pose(tool[None], position[None], None)
        profile = _profile(recipe, cell, true[0][0] @ hand, true[0][0] @ lever + true[1][0])
        if len(profile) < 12:
            continue
        profile = sensor.read(profile) + recipe.noise_mm * rng.normal(size=(len(profile), 2))
        rotations.append(tool)
        positions.append(position)
        rows.append(np.column_stack([np.full(len(profile), stop + 1), profile]))
    half = np.array(FIELD_MM) * 0.8
    grid = np.stack(np.meshgrid(*np.linspace(-half, half, GRID).T, indexing="ij"), -1).reshape(-1, 2)
    points = cell.true_sensor.in_sheet(grid)
    readings = cell.true_sensor.read(points)
    in_tool = points @ hand.T + lever
    truth = {
        "case": recipe.case, "motion": "stops", "sensor": recipe.sensor, "good_scan": True, "bound_mm": None,
        "outlier_share": 0.0, "time_offset_s": None, "time_offset_interval_s": None,
        "tool_from_camera": _transform(hand, lever),
        "effective_tool_from_camera": _transform(*rigid_fit(cell.stated_sensor.place(readings), in_tool)),
        "points_in_tool_mm": _rows(in_tool, 6),
    }  # fmt: skip
    return Standing(cell, np.array(rotations), np.array(positions), np.concatenate(rows), readings, truth)


def _profile(recipe: Recipe, cell: cells.Cell, camera: Floats, place: Floats) -> Floats:
    """Points in the sensor's frame of one profile; columns without a return are left out."""
    sensor = cell.true_sensor
    x = np.linspace(-FIELD_MM[0], FIELD_MM[0], recipe.points)
    if recipe.target == "plane":
        normal = camera.T @ cell.seam.frame[:, 2]
        offset = cell.seam.frame[:, 2] @ (cell.seam.centre_mm - place)
        z = (offset - normal[0] * x) / normal[2]
    else:
        centre = camera.T @ (cell.seam.centre_mm - place)
        below = recipe.radius_mm**2 - centre[1] ** 2 - (x - centre[0]) ** 2
        # Flanks steeper than 60° give no return.
        seen = below > (0.5 * recipe.radius_mm) ** 2
        x, below = x[seen], below[seen]
        z = centre[2] - np.sqrt(below)
    inside = np.abs(z - sensor.stand_off_mm) < FIELD_MM[1] + 15
    return np.asarray(np.stack([x, np.zeros_like(x), z], 1)[inside], float)
