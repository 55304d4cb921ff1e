"""Reads trueline's robot programs with the grammars and conventions of others; see programs.sh."""

import csv
import importlib
import math
import re
import sys

NUMBER = r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?"
# Poses are written to 1 µm and 0.0001 degrees at worst (FANUC), and waypoints lie on samples of the path.
SHIFT_MM = 2e-3
TURN_DEG = 5e-4


def numbers(text):
    return [float(word) for word in re.findall(NUMBER, text)]


def krl(file, folder):
    """Parses a program by a grammar that has no SPLINE block: its points are read as PTP, its times left out."""
    from antlr4 import CommonTokenStream, InputStream
    from antlr4.error.ErrorListener import ErrorListener

    class Errors(ErrorListener):
        def __init__(self):
            self.found = []

        def syntaxError(self, recognizer, symbol, line, column, message, error):
            self.found.append(f"{line}:{column} {message}")

    sys.path.insert(0, folder)
    lexer_of = importlib.import_module("krlLexer").krlLexer
    parser_of = importlib.import_module("krlParser").krlParser
    lines = open(file, newline="").read().replace("\r\n", "\n").split("\n")
    spline = ("SPLINE", "ENDSPLINE", "TIME_BLOCK")
    kept = ["" if line.split()[:1] and line.split()[0] in spline else line for line in lines]
    splines = sum(line.split()[:1] == ["SPL"] for line in kept)
    kept = [re.sub(r"^(\s*)SPL ", r"\1PTP ", line) for line in kept]
    errors = Errors()
    lexer = lexer_of(InputStream("\n".join(kept)))
    parser = parser_of(CommonTokenStream(lexer))
    for part in (lexer, parser):
        part.removeErrorListeners()
        part.addErrorListener(errors)
    parser.module()
    print("; ".join(errors.found[:3]) or f"{len(kept)} lines, {splines} of them points of the spline, no error")
    return not errors.found


def rapid_poses(text):
    from robodk.robomath import quaternion_2_pose

    for line in re.findall(r"Move[JL] \[\[.*", text):
        n = numbers(line.split("[", 1)[1])
        pose = quaternion_2_pose(n[3:7])
        pose.setPos(n[:3])
        yield pose


def krl_poses(text):
    from robodk.robomath import KUKA_2_Pose

    for line in re.findall(r"(?:PTP|SPL) \{X.*\}", text):
        yield KUKA_2_Pose(numbers(line))


def urscript_poses(text):
    from robodk.robomath import UR_2_Pose

    for body in re.findall(r"p\[([^\]]*)\]", text):
        x, y, z, *turn = numbers(body)
        yield UR_2_Pose([x * 1e3, y * 1e3, z * 1e3, *turn])


def ls_poses(text):
    from robodk.robomath import Fanuc_2_Pose

    for body in re.findall(r"P\[\d+\]\{(.*?)\};", text, re.S):
        yield Fanuc_2_Pose([float(value) for value in re.findall(rf"\b[XYZWPR] =\s*({NUMBER})", body)])


def csv_poses(text):
    from robodk.robomath import quaternion_2_pose

    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    for row in rows:
        pose = quaternion_2_pose([float(row[name]) for name in ("qw", "qx", "qy", "qz")])
        pose.setPos([float(row[name]) for name in ("x_mm", "y_mm", "z_mm")])
        yield pose


READERS = {
    "rapid": ("TruelineScan.mod", rapid_poses),
    "krl": ("trueline_scan.src", krl_poses),
    "urscript": ("trueline_scan.script", urscript_poses),
    "ls": ("tl_scan.ls", ls_poses),
    "csv": ("waypoints.csv", csv_poses),
}


def off(one, other):
    """Distance in mm and turn in degrees."""
    shift = math.dist(one.Pos(), other.Pos())
    between = one.inv() * other
    # From the part that is not symmetric: exact for small turns, where an arc cosine is not.
    sine = 0.5 * math.hypot(between[2, 1] - between[1, 2], between[0, 2] - between[2, 0], between[1, 0] - between[0, 1])
    return shift, math.degrees(math.asin(min(1.0, sine)))


def poses(language, folder):
    """Compares the waypoints of a program with the path, in the order in which they come."""
    name, reader = READERS[language]
    path = list(csv_poses(open(f"{folder}/path.csv").read()))
    k, worst, count = 0, [0.0, 0.0], 0
    for waypoint in reader(open(f"{folder}/{name}", newline="").read()):
        # The next sample of the path that it is: within 0.4 s, 100 samples.
        candidates = [(off(waypoint, path[j]), j) for j in range(k, min(k + 100, len(path)))]
        (shift, turn), k = min(candidates, key=lambda c: c[0][0] + c[0][1])
        worst = [max(worst[0], shift), max(worst[1], turn)]
        count += 1
    is_whole = count > 2 and k >= len(path) - 100
    print(f"{count} waypoints, off by {worst[0]:.4f} mm and {worst[1]:.5f} degrees at most")
    return is_whole and worst[0] < SHIFT_MM and worst[1] < TURN_DEG


if __name__ == "__main__":
    what = {"krl": krl, "poses": poses}[sys.argv[1]]
    sys.exit(0 if what(*sys.argv[2:]) else 1)
