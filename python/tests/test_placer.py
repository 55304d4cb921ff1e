"""Points in base while it runs."""

import json
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import trueline
from numpy.typing import NDArray

PERIOD_S = 0.004
OFFSET_S = 0.017


def result_of(**changed: object) -> trueline.Result:
    """A result of a profiler whose hand-eye transform is the identity."""
    names = ["time_offset_s", *(f"rotation_{a}_rad" for a in "xyz"), *(f"translation_{a}_mm" for a in "xyz")]
    document = {
        "schema_version": 3,
        "status": "accepted",
        "time_offset_s": OFFSET_S,
        "tool_from_camera": {"translation_mm": [0, 0, 0], "rotation_wxyz": [1, 0, 0, 0]},
        "covariance": {"order": names, "matrix": [[1e-10 if i == j else 0 for j in range(7)] for i in range(7)]},
        "residuals": {"rms_mm": 0.02},
    }
    return trueline.Result(json.dumps(document | changed))


TABLE = {
    "name": "table",
    "kind": "rotary",
    "carries": "part",
    "direction": [0.0, 0.0, 1.0],
    "point_mm": [800.0, 0.0, 0.0],
    "scale": 1.0,
    "time_offset_s": 0.0,
    "sigma": {"direction_deg": 0.001, "point_mm": 0.01, "scale": 0.0, "time_offset_s": 1e-5},
}


def poses(times_s: NDArray[np.float64], speed_m_s: float = 0.1) -> NDArray[np.float64]:
    matrices = np.tile(np.eye(4), (len(times_s), 1, 1))
    matrices[:, 0, 3] = 0.8 + speed_m_s * times_s
    return matrices


def heard(placer: trueline.Placer, until_s: float = 1.0) -> trueline.Placer:
    times_s = np.arange(0.0, until_s, PERIOD_S)
    placer.push_pose(times_s, poses(times_s))
    return placer


def test_a_point_is_placed_at_its_exposure() -> None:
    placer = heard(trueline.Placer(result_of(), trueline.Profiler()))
    placed = placer.place(0.517, [[0.01, 0.2], [np.nan, 0.2]])
    assert placed.refused is None and placed.exposed_ns == 500_000_000
    np.testing.assert_allclose(placed.points_m[0], [0.8 + 0.05 + 0.01, 0.0, 0.2], atol=1e-9)
    # A reading errs by 20 µm along two axes.
    assert 2.8e-5 < placed.sigma_m[0] < 4e-5
    assert np.isnan(placed.points_m[1]).all() and np.isinf(placed.sigma_m[1])
    # Whole numbers are nanoseconds.
    again = placer.place(517_000_000, [[0.01, 0.2]])
    np.testing.assert_array_equal(again.points_m[0], placed.points_m[0])


def test_what_is_not_known_is_refused_in_words() -> None:
    placer = trueline.Placer(result_of(), trueline.Profiler())
    assert "not settled" in str(placer.place(0.5, [[0.0, 0.2]]).refused)
    heard(placer)
    ended = placer.place(1.5, [[0.0, 0.2]])
    assert "after the last pose" in str(ended.refused) and ended.exposed_ns is None
    assert np.isnan(ended.points_m).all() and np.isinf(ended.sigma_m).all()
    health = placer.health(1.5)
    assert health.is_settled and health.is_stalled and health.pose_period_s == pytest.approx(PERIOD_S)
    with pytest.raises(trueline.TruelineError, match="behind the last pose"):
        placer.push_pose(0.99, poses(np.array([0.99]))[0])
    bad = poses(np.array([1.1]))
    bad[0, 0, 3] = np.nan
    with pytest.raises(trueline.TruelineError, match="is not a number"):
        placer.push_pose(1.1, bad[0])
    # The stream goes on.
    placer.push_pose(1.0, poses(np.array([1.0]))[0])
    assert placer.place(0.517, [[0.0, 0.2]]).refused is None


def test_stamps_that_jump_give_no_wrong_point() -> None:
    placer = heard(trueline.Placer(result_of(), trueline.Profiler()))
    # A gap of half a second, then the poses go on.
    later_s = 1.5 + np.arange(0.0, 0.5, PERIOD_S)
    placer.push_pose(later_s, poses(later_s))
    gap = placer.place(1.25 + OFFSET_S, [[0.0, 0.2]])
    assert gap.refused is not None and np.isnan(gap.points_m).all() and np.isinf(gap.sigma_m).all()
    back_s = -60.0
    with pytest.raises(trueline.TruelineError, match="went back"):
        placer.push_pose(back_s, poses(np.array([back_s]))[0])
    # The poses of the clock before are forgotten, those of the new one count.
    assert placer.place(0.517, [[0.0, 0.2]]).refused is not None
    new_s = back_s + np.arange(PERIOD_S, 1.0, PERIOD_S)
    placer.push_pose(new_s, poses(new_s))
    placed = placer.place(back_s + 0.517, [[0.0, 0.2]])
    assert placed.refused is None
    np.testing.assert_allclose(placed.points_m[0], [0.8 + 0.1 * (back_s + 0.5), 0, 0.2], atol=1e-9)


def test_a_part_on_a_table_is_placed_in_its_own_frame() -> None:
    placer = heard(trueline.Placer(result_of(axes=[TABLE]), trueline.Profiler()))
    assert placer.axes == ["table"]
    assert "axis 0" in str(placer.place(0.517, [[0.0, 0.2]]).refused)
    times_s = np.arange(0.0, 1.0, 0.01)
    placer.push_axis("table", times_s, 0.5 * times_s)
    placed = placer.place(0.517, [[0.0, 0.2]])
    # The tool was at 0.05 m from the table's axis, and the table had turned by 0.25 rad: back by as much.
    np.testing.assert_allclose(placed.points_m[0], [0.8 + 0.05 * np.cos(0.25), -0.05 * np.sin(0.25), 0.2], atol=1e-8)
    assert placer.health(1.5).axes_stalled == ["table"]
    with pytest.raises(trueline.TruelineError, match='Did you mean "table"'):
        placer.push_axis("tabel", 1.0, 0.5)
    with pytest.raises(trueline.TruelineError, match="not finite"):
        placer.push_axis("table", 1.0, np.nan)


def test_an_axis_that_the_result_does_not_place_is_refused_unless_it_stands() -> None:
    unknown = TABLE | {"direction": None, "point_mm": None, "sigma": {"scale": 0.0}}
    result = result_of(axes=[unknown])
    with pytest.raises(trueline.TruelineError, match="its place is missing in the result"):
        trueline.Placer(result, trueline.Profiler())
    assert trueline.Placer(result, trueline.Profiler(), standing=["table"]).axes == []
    with pytest.raises(trueline.TruelineError, match="no axis track"):
        trueline.Placer(result, trueline.Profiler(), standing=["track"])
    # A controller that counts the table in already: nothing is added.
    contained = trueline.Placer(
        result_of(axes=[TABLE]), trueline.Profiler(), in_pose={"table": ([0, 0, 1], [0.8, 0, 0])}
    )
    times_s = np.arange(0.0, 1.0, 0.01)
    contained.push_axis("table", times_s, 0.5 * times_s)
    np.testing.assert_allclose(heard(contained).place(0.517, [[0.0, 0.2]]).points_m[0], [0.85, 0, 0.2], atol=1e-9)


def test_another_sensor_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "sensor.toml").write_text('kind = "profiler"\n')
    file = {"file": {"name": "sensor.toml", "sha256": "0" * 64, "corrected": False}}
    with pytest.raises(trueline.TruelineError, match="not the one that the result belongs to"):
        trueline.Placer(result_of(sensor=file), tmp_path)
    with pytest.raises(trueline.TruelineError, match="drift"):
        trueline.Placer(result_of(stamps={"features": {"drift_taken_out": True, "drift_ppm": 20.0}}), tmp_path)
    with pytest.raises(trueline.TruelineError, match="no covariance"):
        trueline.Placer(result_of(covariance={}), tmp_path)
    with pytest.raises(trueline.TruelineError, match="half_window_s"):
        trueline.Placer(result_of(), tmp_path, half_window_s=-1.0)
    with pytest.raises(ValueError, match=r"found the shape \[1, 3\]"):
        heard(trueline.Placer(result_of(), tmp_path)).place(0.517, [[0.0, 0.0, 0.2]])


def test_a_recording_is_placed_where_apply_puts_it(tmp_path: Path) -> None:
    program = [sys.executable, "-m", "trueline"]
    for words in (
        "simulate --quiet --preset profiler --out scan",
        "calibrate scan --quiet --json result.json",
        "apply scan --calibration result.json --out seam.csv --quiet",
    ):
        subprocess.run([*program, *words.split()], cwd=tmp_path, check=True)
    seam = np.genfromtxt(tmp_path / "seam.csv", delimiter=",", names=True)
    scan = trueline.open(tmp_path / "scan")
    placer = trueline.Placer(tmp_path / "result.json", tmp_path / "scan")
    placer.push_pose(scan.robot_times_s, scan.base_from_tool)
    worst_m, compared = 0.0, 0
    exposed_s = scan.feature_times_s - float(trueline.load(tmp_path / "result.json").time_offset_s or 0.0)
    for stamp_s, exposure_s, point in zip(scan.feature_times_s, exposed_s, scan.points, strict=True):
        placed = placer.place(stamp_s, point[np.newaxis])
        row = seam[np.argmin(np.abs(seam["time_s"] - exposure_s))]
        if placed.refused is None:
            wanted = np.array([row["x_mm"], row["y_mm"], row["z_mm"]]) * 1e-3
            worst_m = max(worst_m, float(np.abs(placed.points_m[0] - wanted).max()))
            compared += 1
    assert compared > 0.95 * len(seam)
    # The estimate's path and the one that is made while it runs are the same to the pieces between the samples.
    assert worst_m < 5e-6


def test_other_threads_run_meanwhile() -> None:
    placer = heard(trueline.Placer(result_of(), trueline.Profiler()))
    points = np.full((1_000_000, 2), 0.2)
    ticks: list[float] = []
    stop = threading.Event()

    def tick() -> None:
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.0005)

    thread = threading.Thread(target=tick)
    thread.start()
    # Of several calls one is enough: a busy machine may keep the other thread waiting.
    during = 0
    for _ in range(50):
        began = time.perf_counter()
        placer.place(0.517, points)
        ended = time.perf_counter()
        # The arrays are made before and handed over after; the middle is the placer's.
        middle = began + 0.4 * (ended - began), began + 0.6 * (ended - began)
        during += sum(middle[0] < moment < middle[1] for moment in list(ticks))
        if during > 0:
            break
    stop.set()
    thread.join()
    assert during > 0


def test_a_torch_is_led_along_an_arc() -> None:
    track = trueline.SeamTrack()
    radius_m = 0.1

    def seam(along_m: float) -> NDArray[np.float64]:
        angle = along_m / radius_m
        return np.array([radius_m * np.sin(angle), radius_m * (1 - np.cos(angle)), 0.2])

    for k in range(100):
        assert track.push(seam(0.0005 * k), 2e-5) is None
    assert track.length_m == pytest.approx(0.0495, abs=1e-5)
    torch = np.eye(4)
    torch[:3, 3] = seam(0.02)
    target = track.ahead(torch, speed_m_s=0.020, delay_s=0.080)
    assert target is not None and track.refused is None
    assert np.linalg.norm(target.base_from_torch[:3, 3] - seam(0.0216)) < 5 * target.sigma_m
    assert track.ahead(torch, speed_m_s=1.0, delay_s=1.0) is None and "beyond the last" in str(track.refused)
    assert "behind the last" in str(track.push(seam(0.02), 2e-5))
    with pytest.raises(trueline.TruelineError, match="finite"):
        track.push([np.nan, 0, 0], 2e-5)
    with pytest.raises(trueline.TruelineError, match="half_window_m"):
        trueline.SeamTrack(half_window_m=0.0)
