"""A reference plate with raised pyramids, profiles of it, and distances from its facets."""

from dataclasses import dataclass

import numpy as np

from .arm import Arm
from .rotations import Floats, apply, exp

PITCH_MM, HEIGHT_MM, HALF_BASE_MM, HALF_TOP_MM = 30.0, 6.0, 12.0, 5.0
"""Truncated pyramids on a grid."""
STAND_OFF_MM, HALF_WIDTH_MM = 150.0, 30.0
MARCH_STEPS = 40
"""Steps of the search for the surface along a column of the profile."""


@dataclass(frozen=True)
class Plate:
    """Place of the plate: its frame's z is up."""

    centre_mm: Floats
    frame: Floats

    def moved(self, x: Floats) -> "Plate":
        """The plate turned (rad) and shifted (mm) by x."""
        return Plate(self.centre_mm + x[3:], exp(x[:3]) @ self.frame)

    def above(self, points_mm: Floats) -> Floats:
        """Distance of points from the facet below them, mm."""
        local = (points_mm - self.centre_mm) @ self.frame
        inside = np.abs((local[:, :2] + PITCH_MM / 2) % PITCH_MM - PITCH_MM / 2)
        out = inside.max(1)
        slope = HEIGHT_MM / (HALF_BASE_MM - HALF_TOP_MM)
        height = np.clip((HALF_BASE_MM - out) * slope, 0.0, HEIGHT_MM)
        steep = (height > 0) & (height < HEIGHT_MM)
        return np.asarray((local[:, 2] - height) * np.where(steep, 1 / np.hypot(1, slope), 1.0), float)


Stop = tuple[Floats, Floats, Floats]
"""Reported rotation and position, and points in the sensor's frame."""


def measured(
    rng: np.random.Generator, plate: Plate, robot: Arm, hand: Floats, lever: Floats, tilt_deg: float, count: int,
    noise_mm: float,
) -> Stop:  # fmt: skip
    """One profile of the plate from a random stop."""
    down = plate.frame @ np.diag([1.0, -1.0, -1.0])
    camera = down @ exp(rng.uniform(-1, 1, 3) * np.radians([tilt_deg, tilt_deg, 90.0]))
    goal = plate.centre_mm + plate.frame @ np.array([*rng.uniform(-25, 25, 2), 3.0])
    place = goal - camera[:, 2] * (STAND_OFF_MM + rng.uniform(-15, 15))
    tool = camera @ hand.T
    position = place - tool @ lever
    true = robot.true_pose(tool[None], position[None], None)
    camera, place = true[0][0] @ hand, true[0][0] @ lever + true[1][0]
    x = np.linspace(-HALF_WIDTH_MM, HALF_WIDTH_MM, count)
    z = np.full(count, STAND_OFF_MM - 45.0)
    low, high = z, z + 110.0
    # The surface is a height field that no view here sees from below: the first sign change is the surface.
    grid = np.linspace(low, high, 60)
    heights = np.array([plate.above(np.stack([x, 0 * x, g], 1) @ camera.T + place) for g in grid])
    first = np.argmax(heights < 0, 0)
    low, high = grid[first - 1, np.arange(count)], grid[first, np.arange(count)]
    for _ in range(MARCH_STEPS):
        middle = (low + high) / 2
        over = plate.above(np.stack([x, 0 * x, middle], 1) @ camera.T + place) > 0
        low, high = np.where(over, middle, low), np.where(over, high, middle)
    points = np.stack([x, 0 * x, (low + high) / 2], 1)
    points[:, [0, 2]] += noise_mm * rng.normal(size=(count, 2))
    return tool, position, points


def residuals(plate: Plate, stops: list[Stop], rotation: Floats, translation_mm: Floats) -> Floats:
    """Distances of all points from the plate, (n, 1)."""
    placed = [
        apply(np.broadcast_to(tool, (len(points), 3, 3)), points @ rotation.T + translation_mm) + position
        for tool, position, points in stops
    ]
    return plate.above(np.concatenate(placed))[:, None]
