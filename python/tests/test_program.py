"""The module and the program give the same."""

import json
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import trueline

PRESETS = ["paper", "quick", "good", "weak", "two-lines", "profiler", "constant-attitude", "along-line"]


def program(*words: str, check: bool = True) -> subprocess.CompletedProcess:
    done = subprocess.run([sys.executable, "-m", "trueline", *words], capture_output=True, text=True)
    assert not check or done.returncode in (0, 1), done.stderr
    return done


@pytest.mark.parametrize(("preset", "seed"), [(preset, 1) for preset in PRESETS] + [("quick", 2), ("good", 3)])
def test_result_files_are_the_programs_to_the_last_bit(preset: str, seed: int, tmp_path) -> None:
    folder = tmp_path / "scan"
    trueline.simulate(preset, seed=seed).write(folder)
    done = program("calibrate", str(folder), "--json", "-", "--quiet")
    result = trueline.calibrate(folder)
    assert json.loads(result.json()) == json.loads(done.stdout)
    assert done.returncode == (0 if result.accepted else 1)


def test_a_result_is_saved_and_loaded(tmp_path) -> None:
    result = trueline.calibrate(trueline.simulate("quick", seed=1))
    result.save(tmp_path / "result.json")
    again = trueline.load(tmp_path / "result.json")
    assert again.document == result.document
    np.testing.assert_array_equal(again.tool_from_camera, result.tool_from_camera)
    with pytest.raises(ValueError, match="residuals"):
        _ = again.residuals
    exported = program("evaluate", str(tmp_path / "none"), "--calibration", str(tmp_path / "result.json"), check=False)
    assert exported.returncode == 2
    assert "hint" in exported.stderr


def test_a_folder_that_is_not_there_is_an_error_with_a_hint(tmp_path) -> None:
    with pytest.raises(trueline.TruelineError) as error:
        trueline.open(tmp_path / "nothing")
    assert error.value.hint


def test_what_a_scan_does_not_show_is_no_number() -> None:
    result = trueline.calibrate(trueline.simulate("constant-attitude", seed=1))
    assert not result.accepted
    assert all(fact.code and fact.text for fact in result.reasons)
    assert np.isnan(result.tool_from_camera[:3, 3]).any()


def test_other_threads_run_meanwhile() -> None:
    scan = trueline.simulate("paper", seed=1)
    ticks, done = [], threading.Event()

    def tick() -> None:
        while not done.wait(0.001):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    began = time.monotonic()
    trueline.calibrate(scan)
    ended = time.monotonic()
    done.set()
    thread.join()
    # With the lock held there would be none at all.
    assert sum(began < one < ended for one in ticks) > 3


def test_ctrl_c_ends_a_calibration() -> None:
    code = "import trueline\nwhile True: trueline.calibrate(trueline.simulate('paper'))"
    child = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
    time.sleep(3.0)
    child.send_signal(signal.SIGINT)
    _, words = child.communicate(timeout=20)
    assert "KeyboardInterrupt" in words


def test_the_seam_is_found_in_arrays_of_pictures(tmp_path) -> None:
    folder = tmp_path / "scan"
    program("simulate", "--preset", "quick", "--images", "--duration-s", "1", "--out", str(folder), "--quiet")
    read = pytest.importorskip("matplotlib.image").imread
    rows = (folder / "images" / "index.csv").read_text().splitlines()
    names = rows[0].split(",")
    frames = [dict(zip(names, row.split(","), strict=True)) for row in rows[1:]]
    pictures = np.stack([np.rint(read(folder / "images" / f["file"]) * 255).astype(np.uint8) for f in frames])
    times = np.array([float(f["time_s"]) for f in frames])
    seams = trueline.find_seams(pictures, times, sensor=folder)
    program("features", str(folder), "--quiet")
    by_program = np.loadtxt(folder / "features.csv", delimiter=",", skiprows=1, ndmin=2)
    assert len(by_program) > 5
    np.testing.assert_allclose(seams.pixels, by_program[:, 1:3], atol=1e-6)
    assert len(seams.times_s) + len(seams.not_found) == len(times)


def test_the_page_and_the_plots_are_drawn() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    result = trueline.calibrate(trueline.simulate("quick", seed=1))
    assert "<iframe" in result._repr_html_()
    for draw in (result.plot_residuals, result.plot_convergence, result.plot_covariance):
        assert draw().get_title()
