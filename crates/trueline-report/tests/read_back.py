"""Reads every export back with readers that others wrote, and compares it with scipy's Rotation.

pip install numpy scipy pyyaml opencv-python-headless yourdfpy
python crates/trueline-report/tests/read_back.py target/debug/trueline
"""

import csv
import io
import json
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import cv2
import numpy as np
import yaml
import yourdfpy
from scipy.spatial.transform import Rotation

PROGRAM = sys.argv[1]
FOLDER = Path(tempfile.mkdtemp())
CASES = {
    "usual": ([61.97, -17.996, 145.008], [0.72938379143, 0.15063013982, 0.16659079019, 0.64618678104]),
    "upright": ([0.0, 0.0, 100.0], [0.5, 0.5, 0.5, 0.5]),
    "half a turn": ([-1.5, 2.5, -3.5], [0.0, 1.0, 0.0, 0.0]),
    "negative w": ([1.0, 2.0, 3.0], [-0.9, 0.1, -0.2, 0.3]),
}
NUMBER = r"-?\d+\.?\d*(?:e-?\d+)?"


def export(result, name, *options):
    done = subprocess.run([PROGRAM, "export", result, "--as", name, "--quiet", *options], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def numbers(text):
    return [float(n) for n in re.findall(NUMBER, text)]


def angles(axes, degrees):
    return Rotation.from_euler(axes, degrees, degrees=True)


def readers(result):
    """name → (rotation, translation in mm, time offset in s or None)"""
    q = lambda n: Rotation.from_quat([n[1], n[2], n[3], n[0]])
    for name in ("abb-tooldata", "abb-wobjdata", "abb-pose"):
        n = [float(x) for x in re.search(r"\[\[([^]]*)\],\[([^]]*)\]", export(result, name)).expand(r"\1,\2").split(",")]
        yield name, q(n[3:7]), n[:3], None
    for name in ("kuka-tool", "kuka-frame"):
        n = dict(re.findall(rf"([XYZABC]) ({NUMBER})", export(result, name).splitlines()[0]))
        yield name, angles("ZYX", [float(n[k]) for k in "ABC"]), [float(n[k]) for k in "XYZ"], None
    n = {k: float(v) for k, v in re.findall(rf"^([XYZWPR]) = +({NUMBER})", export(result, "fanuc"), re.M)}
    yield "fanuc", angles("xyz", [n[k] for k in "WPR"]), [n[k] for k in "XYZ"], None
    n = {k: float(v) for k, v in re.findall(rf"^([XYZ]|R[xyz]) +({NUMBER})", export(result, "yaskawa"), re.M)}
    yield "yaskawa", angles("xyz", [n[k] for k in ("Rx", "Ry", "Rz")]), [n[k] for k in "XYZ"], None
    n = numbers(export(result, "ur"))
    yield "ur", Rotation.from_rotvec(n[3:6]), 1e3 * np.array(n[:3]), None
    xml = export(result, "staubli").replace("<Data ", '<Data xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" ', 1)
    value = ElementTree.fromstring(xml).find("Value").attrib
    yield "staubli", angles("XYZ", [float(value[k]) for k in ("rx", "ry", "rz")]), [float(value[k]) for k in "xyz"], None

    joint = export(result, "urdf")
    (FOLDER / "robot.urdf").write_text(f'<robot name="r"><link name="flange"/><link name="laser"/>{joint}</robot>')
    matrix = yourdfpy.URDF.load(str(FOLDER / "robot.urdf"), load_meshes=False).get_transform("laser", "flange")
    yield "urdf", Rotation.from_matrix(matrix[:3, :3]), 1e3 * matrix[:3, 3], None
    origin = ElementTree.fromstring(export(result, "xacro")).find(".//origin").attrib
    rpy, xyz = ([float(x) for x in origin[k].split()] for k in ("rpy", "xyz"))
    yield "xacro", Rotation.from_euler("xyz", rpy), 1e3 * np.array(xyz), None
    n = dict(re.findall(rf"--(\w+) ({NUMBER})", export(result, "ros2")))
    yield "ros2", Rotation.from_quat([float(n[k]) for k in ("qx", "qy", "qz", "qw")]), [1e3 * float(n[k]) for k in "xyz"], None
    n = yaml.safe_load(export(result, "easy-handeye2"))["transform"]
    yield "easy-handeye2", Rotation.from_quat([n["rotation"][k] for k in "xyzw"]), [1e3 * n["translation"][k] for k in "xyz"], None
    n = yaml.safe_load(export(result, "kalibr"))["cam0"]
    inverse = np.linalg.inv(np.array(n["T_cam_imu"]))
    yield "kalibr", Rotation.from_matrix(inverse[:3, :3]), 1e3 * inverse[:3, 3], -n["timeshift_cam_imu"]

    (FOLDER / "opencv.yaml").write_text(export(result, "opencv"))
    storage = cv2.FileStorage(str(FOLDER / "opencv.yaml"), cv2.FILE_STORAGE_READ)
    matrix = storage.getNode("T_flange_laser").mat()
    yield "opencv", Rotation.from_matrix(matrix[:3, :3]), 1e3 * matrix[:3, 3], storage.getNode("time_offset_s").real()
    rows = re.search(r"\[(.*)\]", export(result, "matlab")).group(1).split(";")
    matrix = np.array([numbers(row) for row in rows])
    yield "matlab", Rotation.from_matrix(matrix[:3, :3]), matrix[:3, 3], None
    scope = {}
    exec(export(result, "python"), scope)
    matrix = scope["T_flange_laser"]
    yield "python", Rotation.from_matrix(matrix[:3, :3]), matrix[:3, 3], scope["time_offset_s"]
    (row,) = csv.DictReader(io.StringIO(export(result, "csv")))
    n = {k: float(v) for k, v in row.items() if k not in ("parent", "child")}
    yield "csv", q([n["qw"], n["qx"], n["qy"], n["qz"]]), [n["x_mm"], n["y_mm"], n["z_mm"]], 1e-3 * n["time_offset_ms"]
    matrix = np.loadtxt(io.StringIO(export(result, "matrix")))
    yield "matrix", Rotation.from_matrix(matrix[:3, :3]), matrix[:3, 3], None
    n = json.loads(export(result, "json"))
    yield "json", q(n["rotation_wxyz"]), n["translation_mm"], n["time_offset_s"]
    n = numbers(export(result, "quaternion"))
    yield "quaternion", q(n[3:]), n[:3], None
    n = numbers(export(result, "euler"))
    yield "euler", angles("ZYX", n[3:]), n[:3], None


def seam_point_by_the_snippet(result, true_wxyz, translation):
    """Runs the Python of the form `time-offset` on a robot that moves evenly; mm off where the seam point must be."""
    text = export(result, "time-offset")
    (rule_ms,) = re.findall(rf"^true exposure = stamp − ({NUMBER}) ms$", text, re.M)
    assert float(rule_ms) == 17.663, text
    snippet = re.search(r"^import numpy as np\n.*?^p_base = [^\n]*", text, re.M | re.S).group(0)
    truth = np.eye(4)
    truth[:3, :3], truth[:3, 3] = true_wxyz.as_matrix(), translation
    scope = {
        "stamp": 1.5,
        "robot_t": np.array([1.0, 2.0]),
        "robot_xyz": np.array([[0.0, 10.0, 20.0], [100.0, 10.0, 20.0]]),
        "robot_xyzw": np.array([[0.0, 0.0, 0.0, 1.0]] * 2),
        "T": truth,
        "p_camera": np.array([1.0, 2.0, 300.0]),
    }
    exec(snippet, scope)
    # At the true exposure, 1.482337 s, the tool is at 48.2337 mm.
    expected = np.array([48.2337, 10.0, 20.0]) + (truth @ [1.0, 2.0, 300.0, 1.0])[:3]
    return np.abs(scope["p_base"] - expected).max()


def main():
    listed = subprocess.run([PROGRAM, "export", "--list"], capture_output=True, text=True, check=True).stdout
    names = {line.split()[0] for line in listed.splitlines() if not line.startswith(" ")}
    for case, (translation, wxyz) in CASES.items():
        wxyz = np.array(wxyz) / np.linalg.norm(wxyz)
        truth = Rotation.from_quat([wxyz[1], wxyz[2], wxyz[3], wxyz[0]])
        result = FOLDER / "calibration.toml"
        result.write_text(
            f"time_offset_s = 0.017663\n[tool_from_camera]\ntranslation_mm = {list(map(float, translation))}\nrotation_wxyz = {wxyz.tolist()}\n"
        )
        read = set()
        for name, rotation, mm, offset in readers(str(result)):
            read.add(name)
            turn, away = (rotation * truth.inv()).magnitude(), np.abs(np.array(mm) - translation).max()
            # Six decimals of a millimetre; twelve of a quaternion, or nine of a degree; near a singularity the root of 1e-16.
            assert turn < 5e-8 and away < 2e-6, (case, name, turn, away)
            assert offset is None or abs(offset - 0.017663) < 1e-9, (case, name, offset)
        assert seam_point_by_the_snippet(str(result), truth, translation) < 1e-9, case
        read.add("time-offset")
        assert read == names, names ^ read
        print(f"{case}: {len(read)} forms read back")


main()
