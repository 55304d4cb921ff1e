"""One drawn cell: true and stated sensor, arm, seam and mounting."""

from dataclasses import dataclass, replace

import numpy as np

from . import arm, target
from .recipe import Recipe
from .rotations import Floats, exp
from .sensor import Sensor

GUESS_DEG = 5.0
GUESS_MM = 10.0
"""Error of the guess: what a drawing of the bracket gives."""
MAX_MOUNTING_TILT_RAD = 0.45
"""Largest tilt of the sensor's view against the flange's axis, so that every pose stays in reach."""


@dataclass(frozen=True)
class Cell:
    """Everything that is fixed in a sequence. Transforms map from the second frame of their name to the first."""

    true_sensor: Sensor
    stated_sensor: Sensor
    robot: arm.Arm
    tool_from_camera: tuple[Floats, Floats]
    guess: tuple[Floats, Floats]
    seam: target.Seam


def draw(rng: np.random.Generator, recipe: Recipe) -> Cell:
    """The cell of a recipe."""
    stated, true = _sensors(rng, recipe)
    robot = arm.draw(rng, recipe.accuracy_mm, recipe.ripple_arcsec, recipe.hysteresis_arcsec, recipe.sag_arcsec)
    axis = rng.normal(size=3)
    tilt = exp(axis / np.linalg.norm(axis) * rng.uniform(0.05, MAX_MOUNTING_TILT_RAD))
    rotation = tilt @ exp(np.array([0, 0, rng.uniform(-np.pi, np.pi)]))
    translation = np.array([*rng.uniform(-110, 110, 2), rng.uniform(50, 160)])
    turn = rng.normal(size=3)
    guess_rotation = exp(turn / np.linalg.norm(turn) * np.radians(GUESS_DEG)) @ rotation
    shift = rng.normal(size=3)
    guess_translation = translation + shift / np.linalg.norm(shift) * GUESS_MM
    yaw = rng.uniform(-np.pi, np.pi)
    frame = exp(np.array([0, 0, yaw])) @ exp(rng.normal(0, 0.04, 3))
    centre = np.array([rng.uniform(850, 1050), rng.uniform(-250, 250), rng.uniform(150, 350)])
    seam = target.draw(
        rng, centre, frame, recipe.length_mm, recipe.bow_mm, recipe.wavy_mm, recipe.kink_mm, recipe.tacks_mm,
        recipe.radius_mm if recipe.target == "arc" else None,
    )  # fmt: skip
    return Cell(true, stated, robot, (rotation, translation), (guess_rotation, guess_translation), seam)


def _sensors(rng: np.random.Generator, recipe: Recipe) -> tuple[Sensor, Sensor]:
    """The stated and the true sensor."""
    bend = recipe.bend_mm / 30.0**2 * rng.choice([-1.0, 1.0])
    if recipe.sensor == "profiler":
        stated = Sensor("profiler", stand_off_mm=float(rng.uniform(120, 220)))
        return _stated_shape(stated, recipe), _with_shape(rng, replace(stated, bend_per_mm=bend), recipe)
    tilt = exp(rng.normal(0, 0.01, 3))
    normal = tilt @ np.array([0.0, -np.sin(np.radians(65)), np.cos(np.radians(65))])
    offset = float(normal[2] * rng.uniform(120, 150))
    plane = Sensor(recipe.sensor, (float(normal[0]), float(normal[1]), float(normal[2])), offset)
    if recipe.sensor == "points":
        true = replace(plane, bend_per_mm=bend)
        return _stated_shape(plane, recipe), _with_shape(rng, _with_plane(rng, true, recipe), recipe)
    stated = replace(
        plane, width=2448, height=2000, fx=float(rng.normal(3650, 40)), fy=float(rng.normal(3650, 40)),
        cx=float(rng.normal(1223, 12)), cy=float(rng.normal(999, 12)),
        distortion=(float(rng.normal(-0.08, 0.02)), float(rng.normal(0.1, 0.03)), 2e-4, -3e-4, 0.0),
    )  # fmt: skip
    k = recipe.intrinsics
    true = replace(
        stated, bend_per_mm=bend, fx=stated.fx * (1 + rng.normal(0, 8e-4 * k)),
        fy=stated.fy * (1 + rng.normal(0, 8e-4 * k)), cx=stated.cx + rng.normal(0, 1.5 * k),
        cy=stated.cy + rng.normal(0, 1.5 * k),
        distortion=(stated.distortion[0] + rng.normal(0, 0.004 * k), *stated.distortion[1:]),
    )  # fmt: skip
    true = _with_plane(rng, true, recipe)
    if recipe.stated and (k or recipe.plane):
        stated = replace(stated, uncertainty={
            "plane_offset_mm": 0.05 * recipe.plane, "plane_normal_deg": 0.05 * recipe.plane,
            "focal_percent": 0.08 * k, "principal_point_px": 1.5 * k,
        })  # fmt: skip
    return stated, true


def _with_plane(rng: np.random.Generator, sensor: Sensor, recipe: Recipe) -> Sensor:
    """The sensor with its laser plane moved."""
    if not recipe.plane:
        return sensor
    _, along, depth, n = sensor.axes()
    turned = n + np.radians(0.05 * recipe.plane) * (rng.normal() * along + rng.normal() * depth)
    turned /= np.linalg.norm(turned)
    offset = sensor.offset_mm + float(rng.normal(0, 0.05 * recipe.plane))
    return replace(sensor, normal=(float(turned[0]), float(turned[1]), float(turned[2])), offset_mm=offset)


def _with_shape(rng: np.random.Generator, sensor: Sensor, recipe: Recipe) -> Sensor:
    k = recipe.shape
    sizes = np.array([1e-3, 1e-3, np.radians(0.04), 6e-4 / 30, 6e-4 / 30]) * k
    shape = tuple(float(v) for v in rng.normal(size=5) * sizes)
    return replace(sensor, shape=shape, linearity_mm=recipe.linearity_mm)


def _stated_shape(sensor: Sensor, recipe: Recipe) -> Sensor:
    if not (recipe.stated and recipe.shape):
        return sensor
    k = recipe.shape
    return replace(sensor, uncertainty={"scale_percent": 0.1 * k, "shear_deg": 0.04 * k, "keystone_percent": 0.06 * k})
