"""The real track: recordings that the user fetches, and how answers to them are judged without a truth.

Nothing is downloaded and nothing is part of this package.

RobCalibrator: github.com/GilbertPan97/RobCalibrator, MIT licence, folder data/ScanData: profiles of spheres by an SSZN
SR7140 profiler on a FANUC robot at standstill.
ETNA: github.com/openlmd/etna, BSD licence, folder etna_calib/data: pictures of a chessboard and a laser stripe by a
camera on an ABB robot at standstill.
"""

import ast
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from . import chessboard, submission
from .baselines import board
from .baselines.sphere import calibrate, fitted_circle
from .files import (
    POSE_COLUMNS, FileError, Sequence, pose_rows, read_boards, read_sequence, sensor_tables, write_table, write_toml,
)  # fmt: skip
from .rotations import Floats, apply, exp, matrix, nearest_rotation

FOLDS = 3
"""Each sequence calibrates on the stops of all folds but one and is judged on that one."""
SPHERES = {"p": 40.0, "ball": 12.7}
"""Radii of the two spheres in mm."""
BOARD = {"columns": 7, "rows": 6, "square_mm": 10.0}
"""Inner corners of ETNA's chessboard."""
MAX_ENUMERATED = 12
"""Stops whose side of the sheet is enumerated without a guess; further ones start on one side."""
REFINED = 60
"""Choices of sides that are refined."""


def load(out: Path, robcalibrator: Path | None, etna: Path | None) -> list[str]:
    """Write `out/real/…` from fetched folders and return the names of the sequences."""
    names = []
    if robcalibrator is not None:
        names += _robcalibrator(out / "real", robcalibrator)
    if etna is not None:
        names += _etna(out / "real", etna)
    return names


def _recording(source: Path) -> tuple[Floats, Floats, list[Floats]]:
    """Rotations and positions of RobCalibrator's stops, and the profile of each."""
    poses = source / "RobPoses.rob"
    if not poses.is_file():
        raise FileError(f"{poses}: there is no such file; give the folder ScanData of RobCalibrator")
    rotations, positions = fanuc_poses(np.array(json.loads(poses.read_text())["RobPoses"], float))
    return rotations, positions, [read_scan_line(source / f"p{k + 1}.yml") for k in range(len(rotations))]


def _robcalibrator(out: Path, source: Path) -> list[str]:
    rotations, positions, profiles = _recording(source)
    names = []
    for fold in range(FOLDS):
        name = f"robcalibrator-{fold}"
        held = np.arange(len(rotations)) % FOLDS == fold
        for folder, chosen in ((out / name, ~held), (out / name / "held_out", held)):
            rows = [(int(k) + 1, profiles[k]) for k in np.flatnonzero(chosen)]
            _write_stops(folder, name, rotations[chosen], positions[chosen], rows, SPHERES["p"])
        _write_sphere_guess(out / name)
        names.append(name)
    return names


def _write_stops(
    folder: Path, name: str, rotations: Floats, positions: Floats, profiles: list[tuple[int, Floats]], radius_mm: float
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    about = {
        "format": 1, "name": name, "track": "real", "target": "sphere", "at_stops": True, "radius_mm": radius_mm
    }  # fmt: skip
    write_toml(folder / "sequence.toml", about)
    write_toml(folder / "sensor.toml", {"kind": "profiler"})
    stops = np.array([stop for stop, _ in profiles], float)
    formats = "%d,%.4f,%.4f,%.4f,%.9f,%.9f,%.9f,%.9f"
    write_table(
        folder / "poses.csv", "stop," + POSE_COLUMNS, np.column_stack([stops, pose_rows(rotations, positions)]), formats
    )
    rows = np.concatenate([np.column_stack([np.full(len(xz), stop), xz]) for stop, xz in profiles])
    write_table(folder / "profiles.csv", "stop,x_mm,z_mm", rows, "%d,%.4f,%.4f")


def _write_sphere_guess(folder: Path) -> None:
    """A guess from the data: the linear solution of the sphere's centre, found over both sides of each profile."""
    sequence = read_sequence(folder)
    guess = sphere_guess(sequence)
    write_toml(folder / "guess.toml", {
        "time_offset_s": 0.0, "tool_from_camera": submission.transform(*guess),
    })  # fmt: skip


def sphere_guess(sequence: Sequence) -> tuple[Floats, Floats]:
    """Hand-eye transform of a sphere sequence without any guess.

    Every choice of sides is tried in the linear equations R_i (X c_i + t) + p_i = C with a free matrix X; the best
    proper ones are refined, and the fit with the smallest residuals wins.
    """
    circles, used = _circles(sequence)
    assert sequence.stops is not None and sequence.radius_mm is not None
    return _sphere_guess(sequence.stops[0][used], sequence.stops[1][used], circles, sequence.radius_mm)


def _sphere_guess(
    rotations: Floats, positions: Floats, circles: Floats, radius_mm: float
) -> tuple[Floats, Floats]:
    height = np.sqrt(np.maximum(radius_mm**2 - circles[:, 2] ** 2, 0.0))
    ranked = []
    for pattern in range(2 ** min(len(circles), MAX_ENUMERATED)):
        signs = np.array([1.0 if pattern >> k & 1 else -1.0 for k in range(len(circles))])
        X, t, rest = _linear_sphere(rotations, positions, np.stack([circles[:, 0], signs * height, circles[:, 1]], 1))
        if np.linalg.det(X) > 0:
            ranked.append((rest, pattern, nearest_rotation(X), t))
    best: tuple[float, Floats, Floats] | None = None
    for _, _, rotation, translation in sorted(ranked, key=lambda r: r[:2])[:REFINED]:
        rotation, translation, fit = calibrate(rotations, positions, circles, radius_mm, rotation, translation)
        if best is None or fit.rms < best[0]:
            best = fit.rms, rotation, translation
    if best is None:
        raise FileError("no hand-eye transform explains the profiles of the sphere")
    return best[1], best[2]


def _linear_sphere(rotations: Floats, positions: Floats, centres: Floats) -> tuple[Floats, Floats, float]:
    """X, t and residual RMS (mm) of the linear equations."""
    n = len(rotations)
    moved = np.einsum("nij,nk->nijk", rotations, centres).reshape(n, 3, 9)
    system = np.concatenate([moved, rotations, np.tile(-np.eye(3), (n, 1, 1))], 2).reshape(3 * n, 15)
    scale = np.linalg.norm(system, axis=0)
    solution, *_ = np.linalg.lstsq(system / scale, -positions.reshape(-1), rcond=1e-10)
    rest = system / scale @ solution + positions.reshape(-1)
    solution = solution / scale
    return solution[:9].reshape(3, 3), solution[9:12], float(np.sqrt((rest**2).mean()))


def fanuc_poses(xyzwpr: Floats) -> tuple[Floats, Floats]:
    """Rotations and positions (mm) of FANUC poses X Y Z W P R: mm, degrees about the fixed axes x, y, z."""
    w, p, r = np.radians(xyzwpr[:, 3:6]).T
    zero = np.zeros_like(w)
    turn = (
        exp(np.stack([zero, zero, r], 1)) @ exp(np.stack([zero, p, zero], 1)) @ exp(np.stack([w, zero, zero], 1))
    )  # fmt: skip
    return turn, xyzwpr[:, :3]


def read_scan_line(path: Path) -> Floats:
    """x, z in mm of the returns of one of RobCalibrator's profiles (OpenCV YAML: x, 0, z; .Nan without a return)."""
    found = re.search(r"scan_line:\s*\[(.*?)\]", path.read_text(), re.DOTALL) if path.is_file() else None
    if found is None:
        raise FileError(f"{path}: no scan_line in it")
    text = found.group(1).replace(".Nan", "nan").replace(".NaN", "nan").replace(".nan", "nan")
    values = np.array([float(v) for v in text.split(",") if v.strip()])
    if len(values) % 3:
        raise FileError(f"{path}: scan_line has {len(values)} numbers; expected three for each point")
    rows = values.reshape(-1, 3)[:, [0, 2]]
    return np.asarray(rows[np.isfinite(rows).all(1)], float)


def _etna(out: Path, source: Path) -> list[str]:
    names = []
    for session in sorted(path for path in source.iterdir() if path.is_dir() and path.name.startswith("calib")):
        pictures = sorted(session.glob("frame*.png"))
        if not pictures:
            continue
        camera, boards = chessboard.sightings(pictures, BOARD)
        # The stated camera is that of the whole session: methods differ in the hand-eye transform alone.
        stated = sensor_tables(camera, None)
        del stated["laser_plane"]
        for fold in range(FOLDS):
            name = f"etna-{session.name}-{fold}"
            held = [k % FOLDS == fold for k in range(len(pictures))]
            for folder, part in ((out / name, False), (out / name / "held_out", True)):
                _write_pictures(folder, name, [p for p, h in zip(pictures, held, strict=True) if h is part], boards)
            write_toml(out / name / "sensor.toml", stated)
            names.append(name)
    if not names:
        raise FileError(f"{source}: no folder calib…; give the folder etna_calib/data of ETNA")
    return names


def _write_pictures(folder: Path, name: str, pictures: list[Path], boards: dict[str, tuple[Floats, Floats]]) -> None:
    """Pictures with the robot's poses, and with the poses of the board that were found in them."""
    shutil.rmtree(folder / "images", ignore_errors=True)
    (folder / "images").mkdir(parents=True)
    poses, seen = {}, {}
    for picture in pictures:
        poses[picture.name] = _etna_pose(picture.with_name(picture.name.replace("frame", "pose")).with_suffix(".txt"))
        if picture.name in boards:
            seen[picture.name] = boards[picture.name]
        shutil.copyfile(picture, folder / "images" / picture.name)
    for file, rows in (("poses.csv", poses), ("boards.csv", seen)):
        lines = [f"picture,{POSE_COLUMNS}"]
        for key, (rotation, position) in rows.items():
            lines.append(key + "," + ",".join(f"{v:.9f}" for v in pose_rows(rotation[None], position[None])[0]))
        (folder / file).write_text("\n".join(lines) + "\n")
    about = {"format": 1, "name": name, "track": "real", "target": "board", "at_stops": True, **BOARD}
    write_toml(folder / "sequence.toml", about)


def _etna_pose(path: Path) -> tuple[Floats, Floats]:
    """Rotation and position (mm) of ((x, y, z), (qx, qy, qz, qw)) in m."""
    try:
        position, xyzw = ast.literal_eval(path.read_text())
        return matrix(np.array([xyzw[3], *xyzw[:3]], float)), 1e3 * np.array(position, float)
    except (OSError, ValueError, SyntaxError, TypeError, IndexError) as error:
        raise FileError(f"{path}: no pose ((x, y, z), (qx, qy, qz, qw)): {error}") from None


def leave_one_out(source: Path) -> tuple[float, float]:
    """RobCalibrator's 15 stops by the method `sphere`: RMS (mm) of all residuals, and of each stop held out."""
    rotations, positions, profiles = _recording(source)
    circles = np.array([fitted_circle(profile) for profile in profiles], float)

    def centres(chosen: Floats, hand: tuple[Floats, Floats]) -> Floats:
        return _both(rotations[chosen], positions[chosen], circles[chosen], SPHERES["p"], hand)

    def fitted(chosen: Floats) -> tuple[Floats, tuple[Floats, Floats]]:
        start = _sphere_guess(rotations[chosen], positions[chosen], circles[chosen], SPHERES["p"])
        hand = calibrate(rotations[chosen], positions[chosen], circles[chosen], SPHERES["p"], *start)[:2]
        return _common(centres(chosen, hand)), hand

    everything = np.ones(len(rotations), bool)
    centre, hand = fitted(everything)
    held = []
    for k in range(len(rotations)):
        others = np.arange(len(rotations)) != k
        without, found = fitted(others)
        held.append(_nearer(centres(~others, found), without) - without)
    return _rms(_nearer(centres(everything, hand), centre) - centre), _rms(np.concatenate(held))


def judge_real(folder: Path, submissions: Path, methods: list[str]) -> list[dict[str, Any]]:
    """Lines of the real track's table for one sequence."""
    out = []
    for method in methods:
        path = submissions / method / "real" / f"{folder.name}.json"
        if not path.is_file():
            continue
        answer = submission.read(path)
        if answer.status == "unsupported":
            continue
        held, fit, note = None, None, "; ".join(answer.reasons)
        if answer.rotation is not None and answer.translation_mm is not None:
            hand = answer.rotation, answer.translation_mm
            errors = _board_errors if (folder / "boards.csv").is_file() else _sphere_errors
            fit, held = errors(folder, *hand)
            note = "hand-eye [" + ", ".join(f"{v:.1f}" for v in answer.translation_mm) + "] mm " + note
        out.append({
            "sequence": folder.name, "method": method, "status": answer.status, "held_out_mm": held, "fit_mm": fit,
            "note": note,
        })  # fmt: skip
    return out


def _sphere_errors(folder: Path, rotation: Floats, translation_mm: Floats) -> tuple[float, float]:
    """3-D RMS about the centre of the fitted stops: of these, and of the held-out ones."""
    placed = []
    for part in (folder, folder / "held_out"):
        sequence = read_sequence(part)
        placed.append(_both_sides(sequence, rotation, translation_mm))
    centre = _common(placed[0])
    return _rms(_nearer(placed[0], centre) - centre), _rms(_nearer(placed[1], centre) - centre)


def _common(both: Floats) -> Floats:
    """The place that the nearer ones of both sides have in common."""
    centre = np.median(both.mean(0), 0)
    for _ in range(10):
        centre = _nearer(both, centre).mean(0)
    return np.asarray(centre, float)


def _board_errors(folder: Path, rotation: Floats, translation_mm: Floats) -> tuple[float, float]:
    """3-D RMS of the board's corners about where the fitted stops put them: of these, and of the held-out ones."""
    placed = []
    for part in (folder, folder / "held_out"):
        boards = read_boards(part)
        assert boards is not None
        seen = boards.seen_rotations, boards.seen_positions_mm
        hand = rotation, translation_mm
        placed.append(board.place((boards.rotations, boards.positions_mm), seen, hand, boards.corners_mm))
    where = placed[0].mean(0)
    return _rms((placed[0] - where).reshape(-1, 3)), _rms((placed[1] - where).reshape(-1, 3))


def _circles(sequence: Sequence) -> tuple[Floats, list[int]]:
    points = sequence.points_mm()
    circles, used = [], []
    for stop in np.unique(sequence.stop).astype(int):
        circle = fitted_circle(points[sequence.stop == stop][:, [0, 2]])
        if circle is not None and sequence.radius_mm is not None and circle[2] < 1.05 * sequence.radius_mm:
            circles.append(circle)
            used.append(stop)
    return np.array(circles), used


def _both_sides(sequence: Sequence, rotation: Floats, translation_mm: Floats) -> Floats:
    """The sphere's centre in base for both sides of the sheet, (2, n, 3)."""
    circles, used = _circles(sequence)
    assert sequence.stops is not None and sequence.radius_mm is not None
    stops = sequence.stops[0][used], sequence.stops[1][used]
    return _both(*stops, circles, sequence.radius_mm, (rotation, translation_mm))


def _both(
    rotations: Floats, positions: Floats, circles: Floats, radius_mm: float, hand: tuple[Floats, Floats]
) -> Floats:
    height = np.sqrt(np.maximum(radius_mm**2 - circles[:, 2] ** 2, 0.0))
    sides = [np.stack([circles[:, 0], s * height, circles[:, 1]], 1) for s in (-1.0, 1.0)]
    return np.stack([apply(rotations, c @ hand[0].T + hand[1]) + positions for c in sides])


def _nearer(both: Floats, centre: Floats) -> Floats:
    far = np.linalg.norm(both - centre, axis=2)
    return np.asarray(np.where((far[0] < far[1])[:, None], both[0], both[1]), float)


def _rms(differences: Floats) -> float:
    return float(np.sqrt((differences**2).sum(1).mean()))
