"""The module gives what the program gives, to the last bit, on every kind of dataset."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trueline
from trueline import Options


def program(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "trueline", *words], capture_output=True, text=True, check=False)


def simulated(preset: str, *options: str) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        trueline.run("simulate", "--preset", preset, "--out", str(folder), "--quiet", *options)

    return write


def points(folder: Path) -> None:
    """A sensor that reports points: a profiler's, in the plane y = 0 of its frame."""
    scan = trueline.simulate("profiler", seed=4)
    x, z = scan.points.T
    flat = np.stack([x, np.zeros_like(x), z], axis=1)
    trueline.Recording.from_arrays(
        scan.robot_times_s, scan.base_from_tool, scan.feature_times_s, flat, sensor=trueline.Points()
    ).write(folder)


def beside_the_robot(folder: Path) -> None:
    """A sensor that stands still, and a robot that moves the part: the inverse of every pose."""
    scan = trueline.simulate("quick", seed=6)
    sensor = trueline.SensorText('mounted = "fixed"\n' + scan.sensor.toml())
    trueline.Recording.from_arrays(
        scan.robot_times_s, np.linalg.inv(scan.base_from_tool), scan.feature_times_s, scan.points, sensor=sensor
    ).write(folder)


def stated_uncertainty(folder: Path) -> None:
    scan = trueline.simulate("good", seed=7)
    scan.write(folder)
    with (folder / "sensor.toml").open("a") as file:
        file.write("\n[uncertainty]\nplane_offset_mm = 0.2\nplane_normal_deg = 0.1\nfocal_percent = 0.2\n")


def another_clock(folder: Path) -> None:
    scan = trueline.simulate("quick", seed=8)
    trueline.Recording.from_arrays(
        scan.robot_times_s, scan.base_from_tool, scan.feature_times_s + 1234.5, scan.points, sensor=scan.sensor
    ).write(folder)


KINDS: dict[str, tuple[Callable[[Path], None], Options, list[str]]] = {
    "camera": (simulated("paper"), {}, []),
    "camera, any cell, outliers": (simulated("quick", "--random-cell", "--outliers", "0.2", "--seed", "2"), {}, []),
    "two lines": (simulated("two-lines"), {}, []),
    "profiler": (simulated("profiler"), {}, []),
    "points": (points, {}, []),
    "stripes": (simulated("quick", "--plates", "--bow-mm", "0.1"), {"use": "both"}, ["--use", "both"]),
    "stripes, of themselves": (simulated("good", "--plates"), {}, []),
    "profiles": (simulated("profiler", "--plates"), {}, []),
    "sensor beside the robot": (beside_the_robot, {}, []),
    "stated uncertainty": (stated_uncertainty, {"sensor_mode": "free"}, ["--sensor", "free"]),
    "another clock": (another_clock, {"align_clocks": True}, ["--align-clocks"]),
    "not observable": (simulated("constant-attitude"), {}, []),
    "the paper's residual": (
        simulated("weak"),
        {"residual": "point-to-line", "loss": "geman-mc-clure", "require_mm": 0.01},
        ["--residual", "point-to-line", "--loss", "geman-mc-clure", "--require", "translation=0.01mm"],
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_the_result_file_is_the_programs_to_the_last_bit(kind: str, tmp_path: Path) -> None:
    write, options, words = KINDS[kind]
    write(tmp_path / "scan")
    result = trueline.calibrate(tmp_path / "scan", **options)
    done = program("calibrate", str(tmp_path / "scan"), "--json", "-", "--quiet", *words)
    assert result.json().strip() == done.stdout.strip(), done.stderr
    assert done.returncode == (0 if result.accepted else 1)


def test_several_scans_together_give_what_the_program_gives(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("monday", "tuesday")]
    for seed, folder in enumerate(folders):
        trueline.simulate("quick", seed=seed).write(folder)
    done = program("calibrate", *map(str, folders), "--json", "-", "--quiet")
    assert trueline.calibrate(folders).json().strip() == done.stdout.strip()
    assert len(trueline.calibrate([trueline.open(folder) for folder in folders]).lines) == 2


def test_pictures_give_what_the_program_finds_in_them(tmp_path: Path) -> None:
    folder = tmp_path / "scan"
    words = ("--images", "--duration-s", "4", "--frame-period-ms", "100")
    trueline.run("simulate", "--preset", "quick", *words, "--out", str(folder), "--quiet")
    done = program("calibrate", str(folder), "--json", "-", "--quiet")
    by_program, by_module = json.loads(done.stdout), trueline.calibrate(folder).document
    # Of what the search depends on this tells the build as well: another program may find another pixel.
    del by_program["inputs"]["images"], by_module["inputs"]["images"]
    assert by_module == by_program


def test_what_was_held_with_a_sigma_is_held_likewise(tmp_path: Path) -> None:
    folder = tmp_path / "scan"
    scan = trueline.simulate("quick", seed=9)
    scan.write(folder)
    truth = scan.truth
    assert truth is not None
    w, x, y, z = trueline.calibrate(scan).document["tool_from_camera"]["rotation_wxyz"]
    place = (truth.tool_from_camera[:3, 3] * 1e3).tolist()
    text = f"time_offset_s = {truth.time_offset_s!r}\n[tool_from_camera]\ntranslation_mm = {place}\nrotation_wxyz = {[w, x, y, z]}\n"
    (folder / "initial.toml").write_text(text)
    held = trueline.calibrate(folder, fix=["time-offset"], fixed_sigma_ms=0.2)
    done = program(
        "calibrate", str(folder), "--fix", "time-offset", "--fixed-sigma", "time=0.2ms", "--json", "-", "--quiet"
    )
    assert held.json().strip() == done.stdout.strip(), done.stderr
    exact = trueline.calibrate(folder, fix=["time-offset"])
    assert held.seam_error_mm is not None and exact.seam_error_mm is not None
    assert held.seam_error_mm > exact.seam_error_mm
    with pytest.raises(trueline.TruelineError, match="not held"):
        trueline.calibrate(folder, fixed_sigma_mm=0.1)


def test_a_drawn_seam_is_held_likewise(tmp_path: Path) -> None:
    folder = tmp_path / "scan"
    trueline.simulate("quick", seed=9).write(folder)
    points = ((1051.476, 62.909, 118.995), (1248.524, 97.091, 121.005))
    held = trueline.calibrate(folder, drawn_line=[points], drawn_line_sigma_mm=0.05)
    text = ":".join(",".join(str(x) for x in point) for point in points)
    done = program(
        "calibrate", str(folder), "--drawn-line", text, "--drawn-line-sigma-mm", "0.05", "--json", "-", "--quiet"
    )
    assert held.json().strip() == done.stdout.strip(), done.stderr
    with pytest.raises(trueline.TruelineError, match="uncertainty"):
        trueline.calibrate(folder, drawn_line=[points])
    with pytest.raises(trueline.TruelineError, match="no line"):
        trueline.calibrate(folder, drawn_line_sigma_mm=0.05)


def test_the_corrected_sensor_is_what_write_sensor_writes(tmp_path: Path) -> None:
    folder, file = tmp_path / "scan", tmp_path / "corrected.toml"
    stated_uncertainty(folder)
    done = program("calibrate", str(folder), "--write-sensor", str(file), "--quiet")
    assert done.returncode == 0, done.stderr
    corrected = trueline.calibrate(folder).corrected_sensor
    assert corrected is not None and corrected.toml() == file.read_text()


def test_a_calibration_is_evaluated_on_another_scan_as_the_program_does(tmp_path: Path) -> None:
    result = trueline.calibrate(trueline.simulate("quick", seed=1))
    other = trueline.simulate("quick", seed=2)
    found = trueline.evaluate(other, result, "--fit", "line")
    assert found == trueline.evaluate(other, result, "--fit", "line")
    result.save(tmp_path / "result.json")
    other.write(tmp_path / "other")
    done = program(
        *("evaluate", str(tmp_path / "other"), "--calibration", str(tmp_path / "result.json")),
        *("--fit", "line", "--json", "-", "--quiet"),
    )
    assert found == json.loads(done.stdout)


def test_a_board_needs_pictures(tmp_path: Path) -> None:
    trueline.simulate("quick", seed=1).write(tmp_path / "scan")
    with pytest.raises(trueline.TruelineError, match="pictures") as error:
        trueline.calibrate_board(tmp_path / "scan", "chessboard:9x6:25")
    assert error.value.hint
