"""Arrays in, results out."""

import copy
import pickle
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trueline
from numpy.typing import NDArray

# A healthy estimate exceeds this many of its σ once in two million.
FAR = 5.0


@pytest.fixture(scope="module")
def scan() -> trueline.Recording:
    return trueline.simulate("quick", seed=3)


Arrays = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def arrays_of(scan: trueline.Recording) -> Arrays:
    return scan.robot_times_s, scan.base_from_tool, scan.feature_times_s, scan.points


def truth_of(scan: trueline.Recording) -> trueline.Guess:
    truth = scan.truth
    assert truth is not None
    return truth


def test_a_scan_from_arrays_is_calibrated_within_its_sigma(scan: trueline.Recording) -> None:
    result = trueline.calibrate(*arrays_of(scan), sensor=scan.sensor)
    truth = truth_of(scan)
    assert result.accepted, result.reasons
    assert result.time_offset_s is not None and result.sigma.time_offset_s is not None
    assert abs(result.time_offset_s - truth.time_offset_s) < FAR * result.sigma.time_offset_s
    off = result.tool_from_camera[:3, 3] - truth.tool_from_camera[:3, 3]
    assert np.all(np.abs(off) < FAR * result.sigma.translation_m)
    turn = result.tool_from_camera[:3, :3] @ truth.tool_from_camera[:3, :3].T
    rotation = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    assert np.all(np.abs(rotation) < FAR * result.sigma.rotation_rad)


def test_arrays_give_what_the_recording_they_came_from_gives(scan: trueline.Recording) -> None:
    from_arrays = trueline.calibrate(*arrays_of(scan), sensor=scan.sensor)
    whole = trueline.calibrate(scan)
    assert whole.time_offset_s is not None
    # The rotation matrices' last digit is lost on the way to quaternions, so the solver stops
    # elsewhere within its rule: the cost, about 620, falls by less than 1e-13 of itself. Half a χ²
    # of 6e-11 is 1.1e-5 of a standard deviation.
    sigma = whole.sigma
    assert sigma.time_offset_s is not None
    assert from_arrays.time_offset_s == pytest.approx(whole.time_offset_s, abs=1.1e-5 * sigma.time_offset_s)
    apart = np.abs(from_arrays.tool_from_camera - whole.tool_from_camera)
    assert np.all(apart[:3, 3] < 1.1e-5 * sigma.translation_m)
    assert np.all(apart[:3, :3] < 1.1e-5 * sigma.rotation_rad.max())


def test_positions_with_a_scipy_rotation_are_poses(scan: trueline.Recording) -> None:
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    poses = scan.base_from_tool
    pair = (poses[:, :3, 3], rotation.from_matrix(poses[:, :3, :3]))
    result = trueline.calibrate(scan.robot_times_s, pair, scan.feature_times_s, scan.points, sensor=scan.sensor)
    assert result.accepted


def test_residuals_are_of_the_recordings_rows(scan: trueline.Recording) -> None:
    result = trueline.calibrate(scan)
    residuals = result.residuals
    assert set(residuals.row) <= set(range(len(scan.points)))
    kept = residuals.weight > 0.5
    # Two standard normal components each: mean square 2 ± 2/√n.
    mean_square = np.mean(residuals.normalised[kept] ** 2)
    assert abs(mean_square - 2.0) < FAR * 2.0 / np.sqrt(kept.sum())


def test_the_covariance_is_that_of_the_sigmas(scan: trueline.Recording) -> None:
    result = trueline.calibrate(scan)
    variance = dict(zip(result.covariance.names, np.diag(result.covariance.matrix), strict=True))
    assert np.sqrt(variance["time_offset_s"]) == pytest.approx(result.sigma.time_offset_s, rel=1e-12)


def test_a_guess_is_taken(scan: trueline.Recording) -> None:
    truth = truth_of(scan)
    result = trueline.calibrate(scan, initial=(truth.time_offset_s, truth.tool_from_camera), fix="hand-eye")
    np.testing.assert_allclose(result.tool_from_camera, truth.tool_from_camera, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, p, f, x: (t[::-1], p, f, x), "runs backwards"),
        (lambda t, p, f, x: (t, p[:-1], f, x), "shape"),
        (lambda t, p, f, x: (t, p * 1.1, f, x), "last row"),
        (lambda t, p, f, x: (t, p @ np.diag([1.0, 1.0, -1.0, 1.0]), f, x), "mirrors"),
        (lambda t, p, f, x: (t, p, f, np.full_like(x, np.nan)), "not finite"),
        (lambda t, p, f, x: (t, p, f, np.hstack([x, x[:, :1]])), "shape"),
    ],
)
def test_what_cannot_be_used_is_said_with_a_hint(scan: trueline.Recording, change: Callable[..., Arrays], words: str) -> None:
    with pytest.raises(trueline.TruelineError, match=words) as error:
        trueline.calibrate(*change(*arrays_of(scan)), sensor=scan.sensor)
    assert error.value.hint


def test_millimetres_are_not_taken_for_metres(scan: trueline.Recording) -> None:
    robot_s, poses, seen_s, points = arrays_of(scan)
    millimetres = poses * np.array([[1.0, 1.0, 1.0, 1e3]] * 3 + [[1.0] * 4])
    with pytest.raises(trueline.TruelineError, match="millimetres"):
        trueline.calibrate(robot_s, millimetres, seen_s, points, sensor=scan.sensor)
    profiler = trueline.simulate("profiler", seed=3)
    robot_s, poses, seen_s, points = arrays_of(profiler)
    with pytest.raises(trueline.TruelineError, match="in metres") as error:
        trueline.calibrate(robot_s, poses, seen_s, points * 1e3, sensor=profiler.sensor)
    assert "1000" in error.value.hint
    guess = np.eye(4)
    guess[0, 3] = 62.0
    with pytest.raises(trueline.TruelineError, match="guess.*millimetres"):
        trueline.calibrate(scan, initial=(0.0, guess))


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda x: np.ma.masked_array(x, x > 500.0), "masked"),
        (lambda x: x + 0j, "complex128"),
        (lambda x: x.astype(str), "expected numbers"),
        (lambda x: x[None], "expected an array"),
    ],
)
def test_nothing_of_an_array_is_dropped_silently(scan: trueline.Recording, spoil: Callable[[Any], Any], why: str) -> None:
    robot_s, poses, seen_s, points = arrays_of(scan)
    with pytest.raises(ValueError, match=why):
        trueline.calibrate(robot_s, poses, seen_s, spoil(points), sensor=scan.sensor)
    halves = np.full(len(points), 0.5)
    with pytest.raises(ValueError, match="line: expected whole"):
        trueline.calibrate(robot_s, poses, seen_s, points, sensor=scan.sensor, line=halves)
    with pytest.raises(ValueError, match="frame: expected whole"):
        trueline.calibrate(robot_s, poses, seen_s, points, sensor=scan.sensor, frame=halves)


def test_arrays_of_any_order_and_that_cannot_be_written_to_are_taken(scan: trueline.Recording) -> None:
    robot_s, poses, seen_s, points = arrays_of(scan)
    every_second = np.repeat(points, 2, axis=0)[::2]
    assert not every_second.flags["C_CONTIGUOUS"]
    frozen = robot_s.copy()
    frozen.flags.writeable = False
    expected = trueline.calibrate(*arrays_of(scan), sensor=scan.sensor).json()
    for other in (
        (frozen, np.asfortranarray(poses), list(seen_s), every_second),
        (robot_s.astype(">f8"), poses, seen_s, points.tolist()),
    ):
        assert trueline.calibrate(*other, sensor=scan.sensor).json() == expected


def test_options_of_another_type_are_refused_by_name(scan: trueline.Recording) -> None:
    cases: list[tuple[dict[str, Any], str]] = [
        ({"offset_within_s": "0.2"}, "offset_within_s: expected a number, found '0.2'"),
        ({"threads": 1.5}, "threads: expected a whole number"),
        ({"accept_partial": 1}, "accept_partial: expected True or False"),
        ({"fix": 5}, "fix: expected a name"),
        ({"robot_accuracy_mm": True}, "robot_accuracy_mm: expected a number"),
        ({"initial": 5}, "initial: expected"),
    ]
    for options, words in cases:
        with pytest.raises(TypeError, match=words):
            trueline.calibrate(scan, **options)
    within = np.float32(0.2)
    assert trueline.calibrate(scan, offset_within_s=within, threads=np.int64(1)).accepted  # type: ignore[call-overload]
    with pytest.raises(ValueError, match="threads"):
        trueline.calibrate(scan, threads=0)


@pytest.mark.parametrize(("sensor", "why"), [(5, "expected a sensor"), ("kind = 1\n", "SensorText"), ({"camera": {"lens": {}}}, "table")])
def test_what_is_no_sensor_is_said(scan: trueline.Recording, sensor: Any, why: str) -> None:
    with pytest.raises((TypeError, ValueError), match=why):
        trueline.calibrate(*arrays_of(scan), sensor=sensor)


def test_unknown_options_are_refused(scan: trueline.Recording) -> None:
    with pytest.raises(TypeError, match="offset_within"):
        trueline.calibrate(scan, offset_withn_s=0.2)  # type: ignore[call-overload]
    with pytest.raises(trueline.TruelineError, match="no \"best\""):
        trueline.calibrate(scan, loss="best")  # type: ignore[call-overload]
    with pytest.raises(trueline.TruelineError, match="exact"):
        trueline.calibrate(scan, residual="point-to-line", sensor_mode="free")
    with pytest.raises(trueline.TruelineError, match="sharp edge"):
        trueline.calibrate(scan, residual="point-to-line", edge_radius_mm=0.1)


def test_arrays_need_a_sensor(scan: trueline.Recording) -> None:
    with pytest.raises(TypeError, match="sensor"):
        trueline.calibrate(*arrays_of(scan))  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="points"):
        trueline.calibrate(scan, points=scan.points)  # type: ignore[call-overload]


def test_a_sensor_may_be_made_of_numbers(scan: trueline.Recording, tmp_path: Path) -> None:
    text = scan.sensor.toml()
    (tmp_path / "sensor.toml").write_text(text)
    tables = tomllib.loads(text)
    camera = trueline.Camera(**tables["camera"])
    plane = tables["laser_plane"]
    made = trueline.CameraLaser(camera, plane["normal"], plane["offset_mm"] * 1e-3)
    sensors: list[trueline.Sensor] = [scan.sensor, tables, tmp_path, tmp_path / "sensor.toml"]
    offsets = {trueline.calibrate(*arrays_of(scan), sensor=sensor).time_offset_s for sensor in sensors}
    assert len(offsets) == 1
    # The file's statement about the seam does not belong to a sensor.
    by_classes = trueline.calibrate(
        *arrays_of(scan), sensor=made, edge_radius_mm=0.0, waviness_mm=0.0
    ).time_offset_s
    assert by_classes == pytest.approx(offsets.pop(), abs=1e-12)


def test_a_sensor_beside_the_robot_from_arrays_is_calibrated_as_such(scan: trueline.Recording) -> None:
    times, poses, feature_times, points = arrays_of(scan)
    on_tool = trueline.calibrate(*arrays_of(scan), sensor=scan.sensor)
    sensor = trueline.SensorText('mounted = "fixed"\n' + scan.sensor.toml())
    beside = trueline.calibrate(times, np.linalg.inv(poses), feature_times, points, sensor=sensor)
    assert beside.document["mounted"] == "fixed"
    # The same numbers with base and tool exchanged; see above for where the solver stops.
    assert on_tool.sigma.time_offset_s is not None
    apart = np.abs(beside.tool_from_camera - on_tool.tool_from_camera)[:3, 3]
    assert np.all(apart < 1e-3 * on_tool.sigma.translation_m)


def test_lost_pictures_are_told_by_their_counter(scan: trueline.Recording) -> None:
    counter = np.arange(len(scan.points)) * 2
    result = trueline.calibrate(*arrays_of(scan), sensor=scan.sensor, frame=counter)
    with pytest.raises(trueline.TruelineError, match="frame"):
        trueline.calibrate(*arrays_of(scan), sensor=scan.sensor, frame=counter - 5)
    # Every second picture is missing.
    assert result.document["stamps"]["features"]["drops"] == len(counter) - 1


def test_nanoseconds_as_integers_are_the_same_scan(scan: trueline.Recording) -> None:
    robot_s, poses, seen_s, points = arrays_of(scan)
    as_dates = [np.rint(times * 1e9).astype("timedelta64[ns]") for times in (robot_s, seen_s)]
    since = trueline.Recording.from_arrays(as_dates[0], poses, as_dates[1], points, sensor=scan.sensor)
    np.testing.assert_array_equal(since.robot_times_s, scan.robot_times_s)
    for since_s in (0.0, 1.7e9):
        whole = [np.rint(times * 1e9).astype(np.int64) + int(since_s) * 10**9 for times in (robot_s, seen_s)]
        recording = trueline.Recording.from_arrays(whole[0], poses, whole[1], points, sensor=scan.sensor)
        # As floating-point numbers nanoseconds since 1970 are 256 ns apart and seconds 238 ns: each end is off by half of both.
        assert np.allclose(np.diff(recording.robot_times_s) * 1e9, np.diff(whole[0]), rtol=0.0, atol=494.0)


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda times: times * 1e3, "milliseconds"),
        (lambda times: times * 1e9 + 1.7e18, "nanoseconds are given as integers"),
        (lambda times: times[:, None], "one dimension"),
        (lambda times: (times * 1e6).astype(np.int64) + 1_700_000_000_000_000, "microseconds"),
        (lambda times: (times * 1e3).astype(np.int64) + 1_700_000_000_000, "milliseconds"),
        (lambda times: times > 0.0, "array of bool"),
        (lambda times: np.full(len(times), 2**63, dtype=np.uint64), "64 bits"),
        (lambda times: np.where(times > 5.0, np.datetime64("NaT"), np.datetime64("2026-01-01", "ns")), "NaT"),
    ],
)
def test_times_that_are_no_seconds_are_refused(
    scan: trueline.Recording, spoil: Callable[[NDArray[np.float64]], NDArray[np.float64]], why: str
) -> None:
    robot_s, poses, seen_s, points = arrays_of(scan)
    with pytest.raises(ValueError, match=why):
        trueline.calibrate(spoil(robot_s), poses, spoil(seen_s), points, sensor=scan.sensor)


def test_arrays_of_another_shape_are_refused_by_name(scan: trueline.Recording) -> None:
    robot_s, poses, seen_s, points = arrays_of(scan)
    with pytest.raises(ValueError, match="poses: expected a stack"):
        trueline.calibrate(robot_s, poses[:, :3, 3], seen_s, points, sensor=scan.sensor)
    with pytest.raises(ValueError, match="points: expected an array"):
        trueline.calibrate(robot_s, poses, seen_s, points[:, 0], sensor=scan.sensor)


def test_results_are_copied_and_pickled(scan: trueline.Recording, tmp_path: Path) -> None:
    result = trueline.calibrate(scan)
    for other in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert other.json() == result.json() and other.accepted == result.accepted
    (tmp_path / "no.json").write_text('"tool_from_camera"')
    with pytest.raises(ValueError, match="no.json"):
        trueline.load(tmp_path / "no.json")
