"""Casts a planned scan in randomly wrong cells and calibrates each from nothing; see run.sh.

Shares nothing with trueline except its files: homogeneous matrices, splines through the path's
poses, OpenCV's lens formula written out, stamps with uniform errors, a start of the camera at any
time, clocks of any origin.
"""

import csv
import json
import subprocess
import sys
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

NOISE_PX, ROBOT_MM, ROBOT_DEG, STAMP_S = 0.3, 0.03, 0.00115, 1e-4
FRAMES_HZ, ROBOT_HZ, MARGIN_PX = 33.0, 250.0, 100.0
LATENCY_S = 0.06


def rotation_of(wxyz):
    w, x, y, z = wxyz
    return Rotation.from_quat([x, y, z, w])


class Path3:
    """The path as a motion without corners."""

    def __init__(self, file):
        rows = list(csv.DictReader(open(file)))
        column = lambda name: np.array([float(row[name]) for row in rows])
        self.times = column("time_s")
        self.place = CubicSpline(self.times, np.stack([column(k) for k in ("x_mm", "y_mm", "z_mm")], 1))
        turns = Rotation.from_quat(np.stack([column(k) for k in ("qx", "qy", "qz", "qw")], 1))
        self.turn = RotationSpline(self.times, turns)

    def at(self, time):
        return self.turn(time), self.place(time)


class Sensor:
    def __init__(self, file):
        known = tomllib.load(open(file, "rb"))
        camera, plane = known["camera"], known["laser_plane"]
        self.size = np.array([camera["width"], camera["height"]])
        self.f, self.c = np.array([camera["fx"], camera["fy"]]), np.array([camera["cx"], camera["cy"]])
        self.k1, self.k2, self.p1, self.p2, self.k3 = camera["distortion"]
        self.normal, self.offset = np.array(plane["normal"]), plane["offset_mm"]

    def pixel(self, point):
        x, y = point[0] / point[2], point[1] / point[2]
        r2 = x * x + y * y
        radial = 1 + self.k1 * r2 + self.k2 * r2**2 + self.k3 * r2**3
        u = x * radial + 2 * self.p1 * x * y + self.p2 * (r2 + 2 * x * x)
        v = y * radial + self.p1 * (r2 + 2 * y * y) + 2 * self.p2 * x * y
        return np.array([u, v]) * self.f + self.c


def in_ball(random, radius):
    direction = random.normal(size=3)
    return direction / np.linalg.norm(direction) * radius * random.random() ** (1 / 3)


def cast(folder, seed, path, sensor, cell):
    """Writes a scan in a wrong cell, and returns what is true in it and the share of frames that are kept."""
    random = np.random.default_rng(seed)
    guess, wrong = cell["tool_from_camera"], cell["guess_error"]
    turn = Rotation.from_rotvec(in_ball(random, np.radians(wrong["rotation_deg"])))
    hand_eye = turn * rotation_of(guess["rotation_wxyz"])
    shift = np.array(guess["translation_mm"]) + in_ball(random, wrong["translation_mm"])
    ends = [np.array(cell["seam"][k]) + in_ball(random, wrong["line_mm"]) for k in ("from_mm", "to_mm")]
    length = np.linalg.norm(ends[1] - ends[0])
    along = (ends[1] - ends[0]) / length
    last = path.times[-1]
    origin_s = random.uniform(10, 1000)
    folder.mkdir(parents=True)
    with open(folder / "robot.csv", "w") as file:
        print("time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz", file=file)
        times = np.arange(0, last, 1 / ROBOT_HZ)
        turns, places = path.at(times)
        turns = Rotation.from_rotvec(random.normal(size=(len(times), 3)) * np.radians(ROBOT_DEG)) * turns
        places = places + random.normal(size=places.shape) * ROBOT_MM
        for time, (x, y, z, w), place in zip(times, turns.as_quat(), places):
            print(f"{origin_s + time:.9f}," + ",".join(f"{v:.7f}" for v in (*place, w, x, y, z)), file=file)
    kept, frames = 0, 0
    with open(folder / "features.csv", "w") as file:
        print("time_s,u_px,v_px", file=file)
        exposures = np.arange(random.uniform(0, 1 / FRAMES_HZ), last, 1 / FRAMES_HZ)
        turns, places = path.at(exposures)
        for time, turn, place in zip(exposures, turns, places):
            frames += 1
            turn, place = turn * hand_eye, turn.apply(shift) + place
            # The seam in the camera, cut by the laser plane.
            start, toward = turn.inv().apply(ends[0] - place), turn.inv().apply(along)
            distance = (sensor.offset - sensor.normal @ start) / (sensor.normal @ toward)
            pixel = sensor.pixel(start + distance * toward)
            inside = np.all((pixel > MARGIN_PX) & (pixel < sensor.size - MARGIN_PX))
            if inside and 0 <= distance <= length:
                kept += 1
                u, v = pixel + random.normal(size=2) * NOISE_PX
                stamp = origin_s + time + LATENCY_S + random.uniform(-1, 1) * np.sqrt(3) * STAMP_S
                print(f"{stamp:.9f},{u:.6f},{v:.6f}", file=file)
    return hand_eye, shift, kept / frames


def run(trueline, *words):
    return subprocess.run([trueline, *map(str, words)], capture_output=True, text=True)


def one(seed, trueline, plan, work):
    folder = work / f"cell-{seed}"
    path, sensor, cell = plan
    hand_eye, shift, kept = cast(folder, seed, path, sensor, cell)
    (folder / "sensor.toml").write_text((work / "plan" / "sensor.toml").read_text())
    noise_alone = ["--sensor", "fixed", "--robot-accuracy-mm", "0", "--feature-bias-px", "0"]
    done = run(trueline, "calibrate", folder, "--json", folder / "result.json", "--quiet", *noise_alone)
    if done.returncode != 0:
        return None, kept, done.stderr + done.stdout
    result = json.load(open(folder / "result.json"))
    found = result["tool_from_camera"]
    turn = (rotation_of(found["rotation_wxyz"]) * hand_eye.inv()).as_rotvec()
    off = [result["time_offset_s"] - LATENCY_S, *turn, *(np.array(found["translation_mm"]) - shift)]
    for file in folder.iterdir():
        file.unlink()
    return np.array(off), kept, ""


def main(trueline, work, cells):
    work = Path(work)
    made = run(trueline, "plan", "--example", "--out", work / "plan", "--quiet")
    if made.returncode != 0:
        sys.exit(f"FAIL plan: {made.stderr}")
    cell = tomllib.load(open(work / "plan" / "cell.toml", "rb"))
    promised = json.load(open(work / "plan" / "plan.json"))["predicted_sigma"]
    sigma = np.array([promised["time_offset_s"], *promised["rotation_rad"], *promised["translation_mm"]])
    plan = Path3(work / "plan" / "path.csv"), Sensor(work / "plan" / "sensor.toml"), cell
    with ThreadPoolExecutor(2) as workers:
        outcomes = list(workers.map(lambda seed: one(seed, trueline, plan, work), range(cells)))
    errors = np.array([off for off, _, _ in outcomes if off is not None])
    for seed, (off, _, words) in enumerate(outcomes):
        if off is None:
            print(f"cell {seed}: {words}")
    kept = np.sort([share for _, share, _ in outcomes])
    print(f"frames kept: mean {kept.mean():.4f}, of 95 % of the cells at least {kept[len(kept) // 20]:.3f}, least {kept[0]:.3f}")
    ratios = np.sqrt((errors**2).mean(axis=0)) / sigma
    print(f"worst promised: {sigma[0] * 1e3:.4f} ms, {np.degrees(sigma[1:4].max()):.4f} deg, {sigma[4:].max():.4f} mm")
    names = ["time offset", "rotation x", "y", "z", "translation x", "y", "z"]
    print("spread / predicted: " + ", ".join(f"{name} {ratio:.2f}" for name, ratio in zip(names, ratios)))
    # Of n cells a spread is known to 1/√2n: with fewer than 200 there is more room.
    room = 3 * max(0.0, 1 / np.sqrt(2 * len(errors)) - 1 / np.sqrt(400))
    good = len(errors) == cells and np.all((ratios > 0.8 - room) & (ratios < 1.2 + room))
    print(f"{'PASS' if good else 'FAIL'} {len(errors)} of {cells} wrong cells calibrate from nothing")
    return good


if __name__ == "__main__":
    sys.exit(0 if main(sys.argv[1], sys.argv[2], int(sys.argv[3])) else 1)
