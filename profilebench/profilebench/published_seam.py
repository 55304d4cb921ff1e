"""Profiles of a fillet at stops, for the program trueline, which calibrates on no plane, plate or sphere."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import arm
from .baselines import program
from .files import POSE_COLUMNS, pose_rows, read_sequence, write_table, write_toml
from .rotations import Floats, apply, exp, log

STAND_OFF_MM = 150.0
TILT_DEG = 20.0


@dataclass(frozen=True)
class Profiles:
    """Number of stops and points, width and noise."""

    stops: int
    points: int
    half_width_mm: float
    noise_mm: float


@dataclass(frozen=True)
class Found:
    """Errors of trueline's answer. The seam error has the robot's own errors in it."""

    accepted: bool
    seam_mm: float
    translation_mm: float
    rotation_deg: float


def seam_at_stops(rng: np.random.Generator, accuracy_mm: float, wanted: Profiles) -> Found | None:
    """Errors of trueline's answer for a fillet; None if there is no answer."""
    hand, lever = exp(rng.normal(0, 0.3, 3)), rng.uniform([-60, -60, 60], [60, 60, 140])
    robot = arm.draw(rng, accuracy_mm, 0.0, 0.0, 0.0) if accuracy_mm > 0 else arm.ideal()
    centre = np.array([900.0, 0.0, 250.0])
    stops = wanted.stops
    poses, rows = _profiles(rng, robot, hand, lever, centre, wanted)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "stops"
        folder.mkdir()
        write_toml(folder / "sensor.toml", {"kind": "profiler", "robot": {"accuracy_mm": accuracy_mm}})
        write_toml(
            folder / "sequence.toml", {"name": "fillet", "track": "published", "target": "line", "at_stops": True}
        )
        numbered = np.column_stack([np.arange(1, stops + 1), pose_rows(*poses)])
        write_table(folder / "poses.csv", "stop," + POSE_COLUMNS, numbered, "%d" + ",%.9f" * 7)
        write_table(folder / "profiles.csv", "stop,x_mm,z_mm", rows, "%d,%.4f,%.4f")
        answer = program.run(read_sequence(folder), "--at-stops")
    if answer.rotation is None or answer.translation_mm is None:
        return None
    # Readings over the field: measured in one pose, welded in another, both with the robot's errors.
    grid = np.stack(np.meshgrid(np.linspace(-12, 12, 5), STAND_OFF_MM + np.linspace(-15, 15, 5)), -1).reshape(-1, 2)
    seen = np.stack([grid[:, 0], 0 * grid[:, 0], grid[:, 1]], 1)
    error = seen @ (answer.rotation - hand).T + answer.translation_mm - lever
    rotations, positions = poses[0][rng.integers(0, stops, len(seen))], poses[1][rng.integers(0, stops, len(seen))]
    tip = hand @ np.array([0, 0, STAND_OFF_MM]) + lever
    slip = _slip(robot, rotations, positions, seen @ hand.T + lever) - _slip(
        robot, poses[0][:1], poses[1][:1], tip[None]
    )
    miss = apply(rotations, error) - slip
    return Found(
        answer.status == "accepted", float(np.sqrt((miss**2).sum(1).mean())),
        float(np.linalg.norm(answer.translation_mm - lever)),
        float(np.degrees(np.linalg.norm(log(answer.rotation @ hand.T)))),
    )  # fmt: skip


def _slip(robot: arm.Arm, rotations: Floats, positions: Floats, points: Floats) -> Floats:
    """True less reported place of points of the tool."""
    true = robot.true_pose(rotations, positions, None)
    return apply(true[0], points) + true[1] - apply(rotations, points) - positions


def _profiles(
    rng: np.random.Generator, robot: arm.Arm, hand: Floats, lever: Floats, centre: Floats, wanted: Profiles
) -> tuple[tuple[Floats, Floats], Floats]:
    """Poses and profiles of two plates at 90°, whose seam runs along y."""
    normals = np.array([[1.0, 0, 1.0], [-1.0, 0, 1.0]]) / np.sqrt(2)
    nominal = np.stack([[1.0, 0, 0], [0, -1.0, 0], [0, 0, -1.0]], 1)
    rotations, positions, rows = [], [], []
    for stop in range(wanted.stops):
        camera = nominal @ exp(rng.uniform(-1, 1, 3) * np.radians([TILT_DEG, TILT_DEG, 25.0]))
        held = np.array([rng.uniform(-12, 12), 0.0, STAND_OFF_MM + rng.uniform(-15, 15)])
        place = centre + np.array([0, rng.uniform(-60, 60), 0]) - camera @ held
        tool = camera @ hand.T
        position = place - tool @ lever
        true = robot.true_pose(tool[None], position[None], None)
        camera, place = true[0][0] @ hand, true[0][0] @ lever + true[1][0]
        x = np.linspace(-wanted.half_width_mm, wanted.half_width_mm, wanted.points)
        faces = normals @ camera
        z = (((centre - place) @ normals.T)[:, None] - faces[:, :1] * x) / faces[:, 2:]
        profile = np.stack([x, z.min(0)], 1) + wanted.noise_mm * rng.normal(size=(wanted.points, 2))
        rotations.append(tool)
        positions.append(position)
        rows.append(np.column_stack([np.full(wanted.points, stop + 1), profile]))
    return (np.array(rotations), np.array(positions)), np.concatenate(rows)
