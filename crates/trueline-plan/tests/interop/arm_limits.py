"""Whether a plan with an arm keeps its joints' limits, by another library's kinematics; see run.sh."""

import csv
import re
import subprocess
import sys
import warnings
import xml.etree.ElementTree
from pathlib import Path

import airo_models
import numpy as np
from ikpy.chain import Chain
from scipy.spatial.transform import Rotation

# Base of the arm: the seam of the example is then in front of it.
STANDS_MM = [1150.0, -420.0, 0.0]
# Little enough to bind the plan, degrees/s².
FASTEST = 150.0
ARM = f"""
[arm]
name = "ur5e"
acceleration_deg_s2 = {[FASTEST] * 6}
base_from_arm = {{ translation_mm = {STANDS_MM}, rotation_wxyz = [1.0, 0.0, 0.0, 0.0] }}
"""
JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
# airo-models has the UR5e's URDF to 0.1 µm and 1e-9 rad; path and joints are written to 0.1 µm and 1e-6 degrees or better.
SHIFT_MM, TURN_DEG = 1e-2, 1e-3


def columns(file):
    rows = list(csv.DictReader(open(file)))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


def main(trueline, work):
    work = Path(work)
    work.mkdir(parents=True)
    run = lambda *words: subprocess.run([trueline, *map(str, words)], capture_output=True, text=True)
    run("plan", "--example", "--out", work / "example", "--tries", 300, "--quiet")
    cell = work / "example" / "cell.toml"
    cell.write_text(cell.read_text() + ARM)
    made = run("plan", cell, "--out", work / "plan", "--tries", 2000, "--quiet")
    if made.returncode != 0:
        print(f"FAIL no plan with the arm: {made.stderr}")
        return False
    # Attributes of a namespace that the file does not declare are left out, for no parser of XML takes them.
    urdf = work / "ur5e.urdf"
    theirs = Path(airo_models.__file__).parent / "arms" / "ur5e" / "ur5e.urdf"
    urdf.write_text(re.sub(r'\sdrake:\w+="[^"]*"', "", theirs.read_text()))
    path, joints = columns(work / "plan" / "path.csv"), columns(work / "plan" / "joints.csv")
    names = [name for name in joints if name != "time_s"]
    angles = np.radians(np.stack([joints[name] for name in names], axis=1))
    # It warns that fixed links do not move.
    warnings.simplefilter("ignore")
    chain = Chain.from_urdf_file(str(urdf), base_elements=["base_link"])
    moving = [k for k, link in enumerate(chain.links) if link.joint_type == "revolute"]
    # Universal Robots' own base is turned against the URDF's.
    base = Rotation.from_euler("z", 180, degrees=True)
    shift, turn = 0.0, 0.0
    for k in range(0, len(angles), 5):
        values = np.zeros(len(chain.links))
        values[moving] = angles[k]
        there = chain.forward_kinematics(values)
        at = base.apply(there[:3, 3]) * 1e3 + STANDS_MM
        wanted = Rotation.from_quat([path[name][k] for name in ("qx", "qy", "qz", "qw")])
        off = wanted.inv() * base * Rotation.from_matrix(there[:3, :3])
        shift = max(shift, np.linalg.norm(at - [path[name][k] for name in ("x_mm", "y_mm", "z_mm")]))
        turn = max(turn, np.degrees(off.magnitude()))
    limits = {j.get("name"): j.find("limit") for j in xml.etree.ElementTree.parse(urdf).iter("joint") if j.find("limit") is not None}
    step = np.diff(path["time_s"])[:, None]
    speeds = np.abs(np.diff(angles, axis=0) / step).max(axis=0)
    accelerations = np.degrees(np.abs(np.diff(np.diff(angles, axis=0) / step, axis=0) / step[1:]).max(axis=0))
    good = shift < SHIFT_MM and turn < TURN_DEG
    print(f"{len(angles)} poses: ikpy puts the tool at most {shift:.5f} mm and {turn:.6f} degrees from the path")
    for k, name in enumerate(JOINTS):
        limit = limits[f"{name}_joint"]
        low, high, fastest = (float(limit.get(key)) for key in ("lower", "upper", "velocity"))
        kept = low <= angles[:, k].min() and angles[:, k].max() <= high and speeds[k] <= fastest and accelerations[k] <= FASTEST
        good &= bool(kept)
        print(
            f"  {name}: {np.degrees(angles[:, k].min()):.1f} to {np.degrees(angles[:, k].max()):.1f} of {np.degrees(low):.0f} to "
            f"{np.degrees(high):.0f} degrees, {np.degrees(speeds[k]):.1f} of {np.degrees(fastest):.0f} degrees/s, "
            f"{accelerations[k]:.0f} of {FASTEST:.0f} degrees/s²"
        )
    print(f"{'PASS' if good else 'FAIL'} a plan with a UR5e keeps its joints' limits")
    return good


if __name__ == "__main__":
    sys.exit(0 if main(*sys.argv[1:3]) else 1)
