#!/usr/bin/env python3
"""The public hand-eye benchmark KinHEC: its sequences through `trueline calibrate`, beside its own solvers.

    pip install kinhec
    python kinhec.py --program ../../target/release/trueline --tier smoke --data /tmp/kinhec-smoke

Each sequence becomes a dataset of pose sightings without a guess. Rows that the benchmark pairs itself (synchronous ones) are stops. The
others are two streams with an unknown time offset. The first table has a row for each track: the medians of the errors of X, as the
benchmark defines them, over the sequences that trueline answers, beside the best of the benchmark's solvers on the same sequences. It
also has what these solvers do not report: the accepted share, the normalised squared error (NEES, 1 is honest) and the coverage of the
95 % intervals. The second table counts the refusals of each track by their reasons. A table of all solvers for each track follows.
Sequences with an unknown scale are a track of their own, because trueline does not estimate a scale.

--data takes several folders and evaluates them together; a missing folder is created. --solvers
keeps the results of the benchmark's own solvers in a file: they take most of the time and do not
change with trueline.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

# The module has this file's own name: its folder must not come first.
sys.path = [entry for entry in sys.path if Path(entry or ".").resolve() != Path(__file__).resolve().parent]

# A solver's matrices have a few rows: threads within one cost more than they save.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np  # noqa: E402
import pandas as pd  # noqa: E402
import kinhec.se3 as se3  # noqa: E402
from kinhec.benchmark import SOLVERS, evaluate_sequence  # noqa: E402
from kinhec.io import Sequence, iter_sequences, load_manifest, write_index  # noqa: E402
from kinhec.metrics import calibration_errors  # noqa: E402
from kinhec.pipeline import make_shard_jobs, run_shard_jobs  # noqa: E402
from kinhec.plans import build_plan, load_tier  # noqa: E402

OURS = "trueline"
MM_PER_M = 1e3
HALF_95 = 1.96
SHARD = 4
UNKNOWN_SCALE = "unknown scale"
ROTATION, TRANSLATION, LATE = "X_rot_err_deg", "X_trans_err_mm", "time_offset_err_ms"
POSE_COLUMNS = "x_mm,y_mm,z_mm,qw,qx,qy,qz"
Row = dict[str, Any]


def rows(keys: list[str], poses: np.ndarray) -> str:
    """One row for each pose: its key, place in mm and quaternion."""
    numbers = se3.pose_to_pq(poses)
    numbers[:, :3] *= MM_PER_M
    return "".join(f"{key},{','.join(f'{x:.12g}' for x in row)}\n" for key, row in zip(keys, numbers))


def stamps(times: np.ndarray) -> list[str]:
    return [f"{t:.9f}" for t in times]


def write_dataset(sequence: Sequence, folder: Path) -> None:
    """The sequence as a dataset folder. A camera beside the robot sees a target that the robot carries."""
    mounted = "" if sequence.eye_in_hand else 'mounted = "fixed"\n'
    (folder / "sensor.toml").write_text(f'kind = "poses"\n{mounted}')
    seen = sequence.camera.has_measurement
    sighted = sequence.camera.T_cam_target_meas[seen]
    if sequence.synchronous:
        names = [str(k + 1) for k in range(len(sighted))]
        poses = sequence.robot.T_base_ee_meas[seen]
        (folder / "poses.csv").write_text(f"stop,{POSE_COLUMNS}\n" + rows(names, poses))
        (folder / "sightings.csv").write_text(f"stop,{POSE_COLUMNS}\n" + rows(names, sighted))
        return
    robot, camera = sequence.robot, sequence.camera
    (folder / "robot.csv").write_text(f"time_s,{POSE_COLUMNS}\n" + rows(stamps(robot.t), robot.T_base_ee_meas))
    (folder / "sightings.csv").write_text(f"time_s,{POSE_COLUMNS}\n" + rows(stamps(camera.t[seen]), sighted))


def transform(entry: Row) -> np.ndarray | None:
    """A pose of the result in m; None where a part of it could not be determined."""
    place, rotation = entry["translation_mm"], entry["rotation_wxyz"]
    if rotation is None or any(x is None for x in place):
        return None
    return np.asarray(se3.pq_to_pose(np.array([*(x / MM_PER_M for x in place), *rotation])))


def honesty(result: Row, truth: np.ndarray, offset_s: float) -> Row:
    """Squared error of time offset and carrier's transform by their covariance, and how many intervals hold the truth."""
    found = transform(result["tool_from_camera"])
    names = result["covariance"]["order"]
    if found is None or not names:
        return {}
    turn = se3.matrix_to_rotvec(found[:3, :3] @ truth[:3, :3].T)
    shift_mm = (found[:3, 3] - truth[:3, 3]) * MM_PER_M
    late_s = 0.0 if result["time_offset_s"] is None else result["time_offset_s"] - offset_s
    error = np.array([late_s, *turn, *shift_mm])
    matrix = result["covariance"]["matrix"]
    known = [k for k in range(len(names)) if matrix[k][k] is not None]
    covariance = np.array([[matrix[i][j] for j in known] for i in known], dtype=float)
    error = error[known]
    inside = np.abs(error) < HALF_95 * np.sqrt(np.diag(covariance))
    return {"nees": float(error @ np.linalg.solve(covariance, error)) / len(known), "inside": float(inside.mean())}


def track(sequence: Sequence) -> str:
    return str(sequence.manifest["track"]) if sequence.scale == 1.0 else UNKNOWN_SCALE


def run(program: str, sequence: Sequence, accuracy_mm: float | None) -> Row:
    """One sequence through the program: errors as the benchmark defines them, and the program's own
    report."""
    row: Row = {"sequence_id": sequence.id, "track": track(sequence), "solver": OURS, "ok": False, "accepted": False}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "sequence"
        folder.mkdir()
        write_dataset(sequence, folder)
        command = [program, "calibrate", str(folder), "--json", "-", "--quiet"]
        command += [] if accuracy_mm is None else ["--robot-accuracy-mm", f"{accuracy_mm:g}"]
        began = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True)
        row["runtime_ms"] = 1e3 * (time.perf_counter() - began)
    if done.returncode not in (0, 1):
        return row | {"why": done.stderr.strip().splitlines()[0].split(": ")[-1] if done.stderr else "no answer"}
    result = json.loads(done.stdout)
    carrier, target = transform(result["tool_from_camera"]), transform(result["base_from_target"])
    row["accepted"] = done.returncode == 0
    row["why"] = ", ".join(reason["code"] for reason in result["reasons"])
    if result["time_offset_s"] is not None and not sequence.synchronous:
        row["time_offset_err_ms"] = 1e3 * abs(result["time_offset_s"] - sequence.time_offset)
    found, other = (carrier, target) if sequence.eye_in_hand else (target, carrier)
    if found is not None:
        errors = calibration_errors(found, sequence.X, other, sequence.Y if other is not None else None)
        row |= errors | {"ok": True}
    truth = sequence.X if sequence.eye_in_hand else sequence.Y
    return row | honesty(result, truth, sequence.time_offset)


def theirs(sequence: Sequence) -> list[Row]:
    """The benchmark's solvers, with the offset that it estimates where there is one."""
    mode = "oracle" if sequence.synchronous else "estimated"
    found = evaluate_sequence(sequence, list(SOLVERS), sync=mode, rng=np.random.default_rng(0))
    return [row | {"track": track(sequence)} for row in found]


def their_rows(sequences: list[Sequence], kept: Path | None, workers: int) -> pd.DataFrame:
    """The benchmark's solvers on all sequences. Results in the file are not computed again; each
    new sequence is added to it at once."""
    known = pd.read_csv(kept, low_memory=False) if kept and kept.exists() else pd.DataFrame({"sequence_id": []})
    there = set(known.sequence_id)
    with ProcessPoolExecutor(workers) as pool:
        for found in pool.map(theirs, [sequence for sequence in sequences if sequence.id not in there]):
            known = pd.concat([known, pd.DataFrame(found)])
            if kept:
                known.to_csv(kept, index=False)
    return known[known.sequence_id.isin([sequence.id for sequence in sequences])]


def number(value: float, digits: int) -> str:
    return "–" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def median(group: pd.DataFrame, column: str) -> float:
    return float(group[column].median()) if column in group and group[column].notna().any() else float("nan")


def best(solved: pd.DataFrame, column: str, digits: int) -> str:
    """The benchmark's solver with the smallest median, and that median."""
    medians = {name: median(group, column) for name, group in solved.groupby("solver") if name != OURS}
    known = {name: value for name, value in medians.items() if np.isfinite(value)}
    return "–" if not known else f"{number(min(known.values()), digits)} {min(known, key=lambda name: known[name])}"


def summary(results: pd.DataFrame) -> str:
    """A row for each track, over the sequences that trueline answers: refusing hard ones wins nothing."""
    lines = ["| track | sequences | answered | accepted | rotation ° | best solver | translation mm | best solver | offset ms | KinHEC's "
             "| NEES mean | NEES median | in 95 % |", "|---" * 13 + "|"]
    for name, of_track in results.groupby("track"):
        ours = of_track[of_track.solver == OURS]
        answered = ours[ours.ok]
        solved = of_track[of_track.ok & of_track.sequence_id.isin(answered.sequence_id)]
        others = of_track[of_track.solver != OURS]
        cells = [name, len(ours), len(answered), ours.accepted.astype(bool).sum()]
        cells += [number(median(answered, ROTATION), 4), best(solved, ROTATION, 4)]
        cells += [number(median(answered, TRANSLATION), 3), best(solved, TRANSLATION, 3)]
        cells += [number(median(ours, LATE), 3), number(median(others.drop_duplicates("sequence_id"), LATE), 3)]
        cells += [number(answered.nees.mean(), 2), number(answered.nees.median(), 2), number(100 * answered.inside.mean(), 1)]
        lines += ["| " + " | ".join(str(cell) for cell in cells) + " |"]
    return "\n".join(lines) + "\n"


def refusals(results: pd.DataFrame) -> str:
    """Number of sequences of each track that are not accepted, and the reasons."""
    lines = ["| track | sequences | not accepted | reasons |", "|---" * 4 + "|"]
    for name, ours in results[results.solver == OURS].groupby("track"):
        refused = ours[~ours.accepted.astype(bool)]
        reasons = "; ".join(f"{count} × {why}" for why, count in refused.why.value_counts().items())
        lines += [f"| {name} | {len(ours)} | {len(refused)} | {reasons or '–'} |"]
    return "\n".join(lines) + "\n"


def table(results: pd.DataFrame) -> str:
    """A section for each track: its solvers by their median translation error, beside the same over the sequences that trueline answers."""
    lines = []
    for name, of_track in results.groupby("track"):
        ours = of_track[of_track.solver == OURS]
        answered = ours[ours.ok].sequence_id
        lines += [f"## {name}: {len(ours)} sequences", ""]
        lines += ["| solver | answers | rotation ° | translation mm | the same where trueline answers | ms |", "|---" * 6 + "|"]
        medians = [(median(group[group.ok], TRANSLATION), solver, group) for solver, group in of_track.groupby("solver")]
        for shift_mm, solver, group in sorted(medians, key=lambda entry: (not np.isfinite(entry[0]), entry[0])):
            ok = group[group.ok]
            same = ok[ok.sequence_id.isin(answered)]
            both = f"{number(median(same, ROTATION), 4)} / {number(median(same, TRANSLATION), 3)}"
            shown = f"**{solver}**" if solver == OURS else solver
            turn_deg, run_ms = number(median(ok, ROTATION), 4), number(median(group, "runtime_ms"), 1)
            lines += [f"| {shown} | {len(ok)}/{len(group)} | {turn_deg} | {number(shift_mm, 3)} | {both} | {run_ms} |"]
        lines += [""]
    return "\n".join(lines)


def generate(data: Path, tier: str, tracks: list[str] | None, every: int, workers: int) -> None:
    """Generates each `every`-th sequence of a tier's tracks, as `kinhec generate` does with all of them."""
    plan = {track: configs[::every] for track, configs in build_plan(load_tier(tier), tracks).items()}
    data.mkdir(parents=True)
    rows_done, failures, _ = run_shard_jobs(data, make_shard_jobs(plan, SHARD), workers)
    write_index(data, rows_done)
    if failures:
        sys.exit(f"{len(failures)} shards could not be generated: {', '.join(failures)}")


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--program", default="trueline", help="the program [default: trueline]")
    words.add_argument("--data", type=Path, nargs="+", required=True, help="folders of the benchmark's data; made if not there")
    words.add_argument("--tier", default="smoke", choices=["smoke", "small", "medium"], help="what is made [default: smoke]")
    words.add_argument("--tracks", nargs="*", help="these tracks alone")
    words.add_argument("--every", type=int, default=1, metavar="K", help="generate each K-th sequence of a track [default: 1]")
    words.add_argument("--workers", type=int, default=2)
    words.add_argument("--robot-accuracy-mm", help="passed on; 'default' leaves it to trueline [default: 0]", default="0")
    words.add_argument("--solvers", type=Path, help="keep the results of the benchmark's solvers in this CSV file")
    words.add_argument("--out", type=Path, help="write every row here as CSV")
    args = words.parse_args()
    accuracy_mm = None if args.robot_accuracy_mm == "default" else float(args.robot_accuracy_mm)
    by_id: dict[str, Sequence] = {}
    for folder in args.data:
        if not folder.exists():
            generate(folder, args.tier, args.tracks, args.every, args.workers)
        by_id |= {sequence.id: sequence for sequence in iter_sequences(folder, load_manifest(folder, args.tracks))}
    sequences = list(by_id.values())
    with ThreadPoolExecutor(args.workers) as pool:
        ours = list(pool.map(lambda sequence: run(args.program, sequence, accuracy_mm), sequences))
    results = pd.concat([pd.DataFrame(ours), their_rows(sequences, args.solvers, args.workers)])
    if args.out:
        results.to_csv(args.out, index=False)
    print(summary(results))
    print(refusals(results))
    print(table(results))


if __name__ == "__main__":
    main()
