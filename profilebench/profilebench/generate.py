"""Writes the sequences of the tracks with open truth (training) or sealed truth (evaluation)."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from . import cast, commitment, standing, tracks, truth
from .cell import Cell
from .files import POSE_COLUMNS, READING_COLUMNS, pose_rows, sensor_tables, write_table, write_toml
from .recipe import Recipe
from .rotations import quaternion
from .sensor import Sensor

POSE_FORMATS = "%.4f,%.4f,%.4f,%.9f,%.9f,%.9f,%.9f"
FORMAT_VERSION = 1
PARTS = ("training", "evaluation")


def generate(out: Path, tier: str, key: bytes, only: list[str] | None = None) -> Iterator[str]:
    """Write `out/TRACK/NAME/…` and the commitments of each track; yields the name of each sequence when it is there.

    Sequences of even index are the training part, those of odd index the evaluation part.
    """
    for track in only or list(tracks.TRACKS):
        commitments: dict[str, str] = {}
        for index in range(tracks.TIERS[tier]):
            part = PARTS[index % 2]
            name = f"{track}-{index:03d}"
            used = commitment.TRAINING_KEY if part == "training" else key
            folder = out / track / name
            facts = sequence(folder, track, name, index, used)
            if part == "training":
                (folder / "truth.json").write_text(json.dumps(facts, indent=1) + "\n")
            else:
                (folder / "truth.sealed").write_bytes(commitment.seal(key, name, facts))
                commitments[name] = commitment.commitment(key, name, facts)
            yield name
        published = {
            "format": FORMAT_VERSION, "track": track, "tier": tier, "key": commitment.key_commitment(key),
            "truths": commitments,
        }  # fmt: skip
        (out / track / "commitments.json").write_text(json.dumps(published, indent=1) + "\n")


def sequence(folder: Path, track: str, name: str, index: int, key: bytes) -> dict[str, Any]:
    """Write one sequence without its truth, which is returned."""
    rng = np.random.default_rng(commitment.seed(key, name))
    recipe = tracks.recipe(track, index, rng)
    return write(folder, track, name, recipe, rng)


def write(folder: Path, track: str, name: str, recipe: Recipe, rng: np.random.Generator) -> dict[str, Any]:
    """Cast a recipe into a folder and return its truth."""
    folder.mkdir(parents=True, exist_ok=True)
    about: dict[str, Any] = {"format": FORMAT_VERSION, "name": name, "track": track, "target": recipe.target}
    if recipe.target in ("plane", "sphere"):
        scan = standing.cast(rng, recipe)
        about |= {"at_stops": True} | ({"radius_mm": recipe.radius_mm} if recipe.target == "sphere" else {})
        _write_stops(folder, scan)
        cell, readings, facts = scan.cell, scan.check_readings, scan.truth
    else:
        moving = cast.cast(rng, recipe)
        judged = truth.check(rng, recipe, moving)
        about["at_stops"] = False
        _write_scan(folder, moving)
        cell, readings, facts = moving.cell, judged.readings, judged.truth
    write_toml(folder / "sequence.toml", about)
    sensor = cell.stated_sensor
    accuracy = recipe.accuracy_mm if recipe.state_accuracy else None
    write_toml(folder / "sensor.toml", sensor_tables(sensor, accuracy))
    write_table(folder / "check.csv", READING_COLUMNS[sensor.kind], readings, _formats(sensor))
    _write_guess(folder, cell)
    return facts


def _formats(sensor: Sensor) -> str:
    return ",".join(["%.5f"] * len(READING_COLUMNS[sensor.kind].split(",")))


def _write_scan(folder: Path, scan: cast.Cast) -> None:
    sensor = scan.cell.stated_sensor
    write_table(folder / "robot.csv", "time_s," + POSE_COLUMNS, scan.robot_rows, "%.6f," + POSE_FORMATS)
    header = f"time_s,{READING_COLUMNS[sensor.kind]},frame"
    write_table(folder / "features.csv", header, scan.feature_rows, f"%.6f,{_formats(sensor)},%d")


def _write_stops(folder: Path, scan: standing.Standing) -> None:
    stops = np.unique(scan.profile_rows[:, 0])
    rows = np.column_stack([stops, pose_rows(scan.rotations, scan.positions_mm)])
    write_table(folder / "poses.csv", "stop," + POSE_COLUMNS, rows, "%d," + POSE_FORMATS)
    write_table(folder / "profiles.csv", "stop,x_mm,z_mm", scan.profile_rows, "%d,%.4f,%.4f")


def _write_guess(folder: Path, cell: Cell) -> None:
    rotation, translation = cell.guess
    write_toml(folder / "guess.toml", {
        "time_offset_s": 0.0,
        "tool_from_camera": {
            "translation_mm": [round(float(v), 2) for v in translation],
            "rotation_wxyz": [float(v) for v in quaternion(rotation)],
        },
    })  # fmt: skip
