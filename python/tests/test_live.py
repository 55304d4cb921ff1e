"""A live recording, of a simulated robot and a replayed camera."""

import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trueline


@pytest.fixture
def bind() -> Iterator[str]:
    """An address at which a simulated ABB robot sends."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
    robot = subprocess.Popen([sys.executable, "-m", "trueline", "robot-sim", "--pc", address, "--for-s", "60", "--quiet"])
    yield address
    robot.kill()
    robot.wait()


def test_a_recording_is_an_iterator_and_ends_when_it_is_left(bind: str, tmp_path: Path) -> None:
    folder = tmp_path / "pictures"
    trueline.run(
        *("simulate", "--images", "--duration-s", "1", "--frame-period-ms", "100", "--out", str(folder), "--quiet")
    )
    with trueline.record(tmp_path / "live", bind=bind, replay=folder, sensor=folder, want_ms=0.1) as cell:
        state = next(state for state in cell if state.robot_poses > 50 and state.pictures > 2)
    recorded = cell.recorded
    assert recorded is not None and recorded.robot_poses > 50
    assert Path(recorded.file).exists()
    pose = state.base_from_tool
    assert pose is not None and np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    # Place of the simulated robot: some metres from its base at most.
    assert pose.shape == (4, 4) and 0.01 < np.linalg.norm(pose[:3, 3]) < 5.0
    assert state.estimate is not None and state.time_offset_s is None and state.is_enough is None
    # It records an .mcap, which holds the shown pose.
    scan = trueline.open(recorded.file)
    assert len(scan.robot_times_s) == recorded.robot_poses and scan.sensor.kind == "camera_laser"
    assert np.abs(scan.base_from_tool - pose).max(axis=(1, 2)).min() < 1e-9
    # It is over: there is no state any more, and its address is free.
    assert list(cell) == []
    again = trueline.record(tmp_path / "again", bind=bind, for_s=0.5)
    assert [one.robot_poses for one in again][-1] > 0
    assert again.recorded is not None and again.recorded.complete, again.recorded


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"bind": "127.0.0.1:6510", "want_ms": 0.1}, "camera"),
        ({"bind": "here"}, "bind"),
        ({"protocol": "ur-rtde"}, "address"),
        ({"bind": "127.0.0.1:6510", "fps": 10.0}, "fps"),
        ({"bind": "127.0.0.1:6510", "trigger": "Line1"}, "trigger"),
        ({"bind": "127.0.0.1:6510", "camera": "127.0.0.9", "trigger": "Line1:up"}, "rising, falling or any"),
        ({"bind": "127.0.0.1:6510", "camera": "127.0.0.9", "pixel_format": "YUV"}, "no \"YUV\""),
        ({"bind": "127.0.0.1:6510", "protocol": "smoke"}, "no \"smoke\""),
    ],
)
def test_what_cannot_be_recorded_is_said_with_a_hint(
    options: trueline.RecordOptions, words: str, tmp_path: Path
) -> None:
    with pytest.raises(trueline.TruelineError, match=words) as error:
        list(trueline.record(tmp_path / "scan", **options))
    assert error.value.hint


def test_an_option_that_there_is_not_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="bnd"):
        trueline.record(tmp_path, bnd="127.0.0.1:6510")  # type: ignore[call-arg]


def test_ctrl_c_ends_a_recording_that_is_whole(bind: str, tmp_path: Path) -> None:
    # Started in the background, as a shell does it, a process ignores the signal.
    code = f"""import signal, trueline
signal.signal(signal.SIGINT, signal.default_int_handler)
for state in trueline.record({str(tmp_path / "live")!r}, bind={bind!r}, sensor=trueline.simulate().sensor):
    print(state.robot_poses, flush=True)"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout is not None
    while int(child.stdout.readline()) < 20:
        pass
    child.send_signal(signal.SIGINT)
    _, words = child.communicate(timeout=20)
    assert "KeyboardInterrupt" in words
    # Whole: the program reads it, and says only that no camera was there.
    read = subprocess.run(
        [sys.executable, "-m", "trueline", "calibrate", str(tmp_path / "live")], capture_output=True, text=True, check=False
    )
    assert read.returncode == 2 and "neither pictures nor seam points" in read.stderr, read.stderr
