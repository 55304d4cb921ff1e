"""The module beside the program: files, errors, threads, Ctrl-C."""

import json
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import trueline
from trueline.plots import Quantity


def program(*words: str, check: bool = True) -> subprocess.CompletedProcess[str]:
    done = subprocess.run([sys.executable, "-m", "trueline", *words], capture_output=True, text=True)
    assert not check or done.returncode in (0, 1), done.stderr
    return done


def test_a_result_is_saved_and_loaded(tmp_path: Path) -> None:
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


def test_a_folder_that_is_not_there_is_an_error_with_a_hint(tmp_path: Path) -> None:
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
    ticks: list[float] = []
    done = threading.Event()

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
    code = "import trueline\nprint('begun', flush=True)\nwhile True: trueline.calibrate(trueline.simulate('paper'))"
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout is not None and child.stdout.readline() == "begun\n"
    child.send_signal(signal.SIGINT)
    _, words = child.communicate(timeout=20)
    assert "KeyboardInterrupt" in words


def test_the_program_runs_as_a_module_and_as_a_command(tmp_path: Path) -> None:
    for command in ([sys.executable, "-m", "trueline"], [str(Path(sys.executable).with_name("trueline"))]):
        done = subprocess.run([*command, "demo", "--quiet"], capture_output=True, text=True, cwd=tmp_path, check=False)
        assert done.returncode == 0, done.stderr
        assert (tmp_path / "trueline-demo" / "report.html").exists()
        shutil.rmtree(tmp_path / "trueline-demo")


def test_the_page_and_the_plots_are_drawn() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    result = trueline.calibrate(trueline.simulate("quick", seed=1))
    # A notebook keeps what it shows: the words by default, the charts for who asks.
    brief, whole = result._repr_html_(), result.report()
    assert "<iframe" in brief and "Accepted" in brief and len(brief) < 150_000
    assert "Apache ECharts" not in brief and "Apache ECharts" in whole and whole._repr_html_().startswith("<iframe")
    for draw in (result.plot_residuals, result.plot_covariance):
        assert draw().get_title()
    steps = result.document["iterations"]
    curves = {"time offset": 1, "distance": 1, "translation": 3, "rotation": 4, "line": 3}
    for quantity in get_args(Quantity):
        lines = result.plot_convergence(of=quantity).get_lines()
        assert len(lines) == curves[quantity] and all(np.size(line.get_xdata()) == len(steps) for line in lines)
    with pytest.raises(ValueError, match="one of"):
        result.plot_convergence(of="everything")  # type: ignore[arg-type]


def test_two_calibrations_are_compared_as_the_program_does(tmp_path: Path) -> None:
    """Two scans of one sensor agree; a result whose sensor is a millimetre further along has moved."""
    first = trueline.calibrate(trueline.simulate("good", seed=1))
    second = trueline.calibrate(trueline.simulate("good", seed=2))
    assert trueline.diff(first, second)["verdict"] == "same"
    document = json.loads(json.dumps(second.document))
    document["tool_from_camera"]["translation_mm"][0] += 1.0
    (tmp_path / "moved.json").write_text(json.dumps(document))
    assert trueline.diff(first, tmp_path / "moved.json")["verdict"] == "moved"
