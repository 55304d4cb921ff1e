"""Output of the program, read for the drawings: scans, sensors, results."""

import csv
import json
import subprocess
import tomllib
from pathlib import Path


def run(program: Path, *words) -> None:
    """Runs the program; exit code 1 (not accepted) is an outcome."""
    command = [program, *words]
    done = subprocess.run(command, text=True, capture_output=True, check=False)
    if done.returncode > 1:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{done.stderr}")


def simulated(program: Path, folder: Path, *words) -> Path:
    """A simulated scan."""
    run(program, "simulate", "--quiet", "--out", folder, *words)
    return folder


def calibrated(program: Path, scan: Path, name: str, *words) -> dict:
    """The result of calibrating a scan."""
    file = scan.parent / f"{name}.json"
    run(program, "calibrate", scan, "--quiet", "--json", file, *words)
    return json.loads(file.read_text())


def table(file: Path) -> list[dict[str, float]]:
    """A CSV file of numbers; an empty cell is left out."""
    with file.open() as lines:
        return [{key: float(cell) for key, cell in row.items() if cell} for row in csv.DictReader(lines)]


def toml(file: Path) -> dict:
    """A TOML file."""
    return tomllib.loads(file.read_text())


def turn(q, p) -> list[float]:
    """A point rotated by the unit quaternion w, x, y, z."""
    w, x, y, z = q
    t = [2 * (y * p[2] - z * p[1]), 2 * (z * p[0] - x * p[2]), 2 * (x * p[1] - y * p[0])]
    return [p[0] + w * t[0] + y * t[2] - z * t[1], p[1] + w * t[1] + z * t[0] - x * t[2], p[2] + w * t[2] + x * t[1] - y * t[0]]


def plus(a, b, factor=1.0) -> list[float]:
    """a + factor b."""
    return [p + factor * q for p, q in zip(a, b)]


def dot(a, b) -> float:
    """The scalar product."""
    return sum(p * q for p, q in zip(a, b))


class Scene:
    """A simulated scan with its truth, in mm."""

    def __init__(self, scan: Path):
        truth, sensor = toml(scan / "truth.toml"), toml(scan / "sensor.toml")
        self.robot = table(scan / "robot.csv")
        self.camera = sensor["camera"]
        self.normal, self.offset = sensor["laser_plane"]["normal"], sensor["laser_plane"]["offset_mm"]
        self.shift, self.rotation = (truth["tool_from_camera"][key] for key in ("translation_mm", "rotation_wxyz"))
        self.point, self.direction = (truth["lines"][0][key] for key in ("point_mm", "direction"))

    def tool(self, row: int):
        """Position and quaternion of the tool in base."""
        pose = self.robot[row]
        return [pose[f"{axis}_mm"] for axis in "xyz"], [pose[f"q{axis}"] for axis in "wxyz"]

    def in_base(self, row: int, in_camera) -> list[float]:
        """A point of the camera frame in base."""
        position, q = self.tool(row)
        return plus(position, turn(q, plus(self.shift, turn(self.rotation, in_camera))))

    def on_plane(self, u_px: float, v_px: float) -> list[float]:
        """The point of the laser plane at a pixel, in the camera frame; distortion is left out in drawings."""
        camera = self.camera
        ray = [(u_px - camera["cx"]) / camera["fx"], (v_px - camera["cy"]) / camera["fy"], 1.0]
        depth = self.offset / dot(self.normal, ray)
        return [depth * part for part in ray]

    def seam_hit(self, row: int) -> list[float]:
        """Point at which the line meets the laser plane, in base."""
        centre = self.in_base(row, [0, 0, 0])
        tip = self.in_base(row, self.normal)
        normal = plus(tip, centre, -1)
        d = self.offset + dot(normal, centre)
        along = (d - dot(normal, self.point)) / dot(normal, self.direction)
        return plus(self.point, self.direction, along)
