"""Reading and writing of sequence folders: sensor.toml, robot.csv, features.csv, poses.csv, profiles.csv, check.csv.

The format is the dataset folder that README.md describes. Columns carry their units.
"""

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .rotations import Floats, PoseStream, matrix, quaternion
from .sensor import Sensor

POSE_COLUMNS = "x_mm,y_mm,z_mm,qw,qx,qy,qz"
READING_COLUMNS = {"camera_laser": "u_px,v_px", "profiler": "x_mm,z_mm", "points": "x_mm,y_mm,z_mm"}


class FileError(ValueError):
    """A file that is missing or does not hold what it should; the text names file and cause."""


@dataclass(frozen=True)
class Guess:
    """A rough hand-eye transform, as a drawing of the bracket would give it, and an offset of zero."""

    time_offset_s: float
    rotation: Floats
    translation_mm: Floats


@dataclass(frozen=True)
class Sequence:
    """One sequence as a method sees it."""

    folder: Path
    name: str
    track: str
    target: str
    """line, arc, plane or sphere."""
    radius_mm: float | None
    sensor: Sensor
    guess: Guess | None
    robot: PoseStream | None
    """The pose stream; None where the robot stood at each reading."""
    stops: tuple[Floats, Floats] | None
    """Rotations and positions of the stops."""
    times_s: Floats
    """Stamps of the readings of a scan; empty at stops."""
    stop: Floats
    """Index of the stop of each reading; empty for scans."""
    readings: Floats
    check: Floats
    """Noise-free readings over the field at which answers are judged."""

    def points_mm(self) -> Floats:
        """Readings placed in the sensor's frame by the stated calibration."""
        return self.sensor.place(self.readings)


@dataclass(frozen=True)
class Boards:
    """A chessboard at stops: poses of the robot, and camera_from_board of the pictures with a board in them."""

    rotations: Floats
    positions_mm: Floats
    seen_rotations: Floats
    seen_positions_mm: Floats
    corners_mm: Floats
    """The board's four outer corners in its own frame."""


def read_table(path: Path) -> dict[str, Floats]:
    """Columns of a csv file of numbers by name."""
    if not path.is_file():
        raise FileError(f"{path}: there is no such file")
    with path.open() as lines:
        names = lines.readline().strip().split(",")
    try:
        rows = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except ValueError as error:
        raise FileError(f"{path}: {error}") from None
    if rows.size and rows.shape[1] != len(names):
        raise FileError(f"{path}: {len(names)} names but {rows.shape[1]} columns")
    rows = rows.reshape(-1, len(names))
    return {name: rows[:, k] for k, name in enumerate(names)}


def write_table(path: Path, header: str, rows: Floats, formats: str) -> None:
    """A csv file with one format for each column, separated by commas."""
    np.savetxt(path, rows, fmt=formats, header=header, comments="")


def write_toml(path: Path, tables: dict[str, Any]) -> None:
    """The part of TOML that these folders need: numbers, words, booleans, lists, and one level of tables."""
    lines = [f"{key} = {_toml(value)}" for key, value in tables.items() if not isinstance(value, dict)]
    for name, table in tables.items():
        if isinstance(table, dict):
            lines += ["", f"[{name}]", *(f"{key} = {_toml(value)}" for key, value in table.items())]
    path.write_text("\n".join(lines) + "\n")


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return repr(int(value)) if isinstance(value, (int, np.integer)) else repr(round(float(value), 10))


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file."""
    try:
        return tomllib.loads(path.read_text())
    except FileNotFoundError:
        raise FileError(f"{path}: there is no such file") from None
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"{path}: {error}") from None


def sensor_tables(sensor: Sensor, accuracy_mm: float | None) -> dict[str, Any]:
    """sensor.toml of a sensor and, where it is known, of the robot's absolute accuracy."""
    tables: dict[str, Any] = {"kind": sensor.kind}
    if sensor.kind == "camera_laser":
        tables["camera"] = {
            "width": sensor.width, "height": sensor.height, "fx": sensor.fx, "fy": sensor.fy, "cx": sensor.cx,
            "cy": sensor.cy, "distortion": list(sensor.distortion),
        }  # fmt: skip
    if sensor.kind != "profiler":
        tables["laser_plane"] = {"normal": list(sensor.normal), "offset_mm": sensor.offset_mm}
    if sensor.uncertainty:
        tables["uncertainty"] = sensor.uncertainty
    if accuracy_mm is not None:
        tables["robot"] = {"accuracy_mm": accuracy_mm}
    return tables


def read_sensor(path: Path) -> Sensor:
    """The stated sensor of a sensor.toml."""
    tables = read_toml(path)
    kind = tables.get("kind")
    if kind == "profiler":
        return Sensor("profiler")
    if kind not in ("camera_laser", "points"):
        raise FileError(f"{path}: kind is {kind!r}; expected camera_laser, profiler or points")
    plane = tables["laser_plane"]
    normal = tuple(float(v) for v in plane["normal"])
    if kind == "points":
        return Sensor("points", (normal[0], normal[1], normal[2]), float(plane["offset_mm"]))
    c = tables["camera"]
    return Sensor(
        "camera_laser", (normal[0], normal[1], normal[2]), float(plane["offset_mm"]), c["fx"], c["fy"], c["cx"],
        c["cy"], c["width"], c["height"], tuple(c["distortion"]),
    )  # fmt: skip


def pose_rows(rotations: Floats, positions_mm: Floats) -> Floats:
    """Rows of `POSE_COLUMNS`."""
    return np.concatenate([positions_mm, quaternion(rotations)], 1)


def _poses(table: dict[str, Floats]) -> tuple[Floats, Floats]:
    q = np.stack([table[k] for k in ("qw", "qx", "qy", "qz")], 1)
    return matrix(q), np.stack([table[k] for k in ("x_mm", "y_mm", "z_mm")], 1)


def read_guess(path: Path) -> Guess | None:
    """The guess of a folder, or None where there is none."""
    if not path.is_file():
        return None
    tables = read_toml(path)
    transform = tables["tool_from_camera"]
    return Guess(
        float(tables.get("time_offset_s", 0.0)),
        matrix(np.array(transform["rotation_wxyz"], float)),
        np.array(transform["translation_mm"], float),
    )


def read_boards(folder: Path) -> Boards | None:
    """The chessboards of a sequence of pictures, or None where there is no boards.csv."""
    if not (folder / "boards.csv").is_file():
        return None
    about = read_toml(folder / "sequence.toml")
    poses, boards = _named(folder / "poses.csv"), _named(folder / "boards.csv")
    names = [name for name in poses if name in boards]
    width, height = (about["columns"] - 1) * about["square_mm"], (about["rows"] - 1) * about["square_mm"]
    corners = np.array([[0, 0, 0], [width, 0, 0], [0, height, 0], [width, height, 0]], float)
    stops, seen = np.array([poses[name] for name in names]), np.array([boards[name] for name in names])
    return Boards(matrix(stops[:, 3:]), stops[:, :3], matrix(seen[:, 3:]), seen[:, :3], corners)


def _named(path: Path) -> dict[str, Floats]:
    """Rows of `picture,` and `POSE_COLUMNS` by the name of the picture."""
    rows = [line.split(",") for line in path.read_text().split()[1:]]
    return {row[0]: np.array(row[1:], float) for row in rows}


def read_sequence(folder: Path) -> Sequence:
    """A sequence folder. The guess is read as well; methods that take none leave it alone."""
    about = read_toml(folder / "sequence.toml")
    sensor = read_sensor(folder / "sensor.toml")
    columns = READING_COLUMNS[sensor.kind].split(",")
    at_stops = bool(about["at_stops"])
    table = read_table(folder / ("profiles.csv" if at_stops else "features.csv"))
    check_path = folder / "check.csv"
    check = read_table(check_path) if check_path.is_file() else None
    robot, stops = None, None
    stop = np.zeros(0)
    if at_stops:
        poses = read_table(folder / "poses.csv")
        stops = _poses(poses)
        stop = np.searchsorted(poses["stop"], table["stop"]).astype(float)
    else:
        rows = read_table(folder / "robot.csv")
        robot = PoseStream(rows["time_s"], *_poses(rows))
    return Sequence(
        folder, about["name"], about["track"], about["target"], about.get("radius_mm"), sensor,
        read_guess(folder / "guess.toml"), robot, stops, np.zeros(0) if at_stops else table["time_s"], stop,
        np.stack([table[c] for c in columns], 1),
        np.zeros((0, len(columns))) if check is None else np.stack([check[c] for c in columns], 1),
    )  # fmt: skip
