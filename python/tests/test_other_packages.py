"""Data and results go to and come from the packages that people use."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trueline
from matplotlib.image import imread
from trueline import run
from trueline.rotations import matrices_of, quaternion_of


@pytest.fixture(scope="module")
def scan() -> trueline.Recording:
    return trueline.simulate("quick", seed=5)


@pytest.mark.parametrize("package", ["pandas", "polars"])
@pytest.mark.parametrize("preset", ["quick", "profiler", "two-lines"])
def test_data_frames_keep_a_recording(package: str, preset: str) -> None:
    frame = pytest.importorskip(package).DataFrame
    scan = trueline.simulate(preset, seed=5)
    robot, features = frame(trueline.robot_columns(scan)), frame(trueline.features_columns(scan))
    again = trueline.from_frames(robot, features, sensor=scan.sensor)
    np.testing.assert_array_equal(again.robot_times_s, scan.robot_times_s)
    np.testing.assert_array_equal(again.line, scan.line)
    # Rotations through quaternions, lengths through millimetres: a few last digits of 1 and of 2 m.
    np.testing.assert_allclose(again.base_from_tool, scan.base_from_tool, atol=4e-15)
    np.testing.assert_allclose(again.points, scan.points, rtol=1e-15)


def test_a_frame_without_a_column_is_refused_by_name(scan: trueline.Recording) -> None:
    robot = trueline.robot_columns(scan)
    del robot["qy"]
    with pytest.raises(ValueError, match="qy"):
        trueline.from_frames(robot, trueline.features_columns(scan), sensor=scan.sensor)


def test_quaternions_are_scipys(scan: trueline.Recording) -> None:
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    matrices = rotation.random(200, random_state=1).as_matrix()
    half_turns = rotation.from_rotvec(np.pi * np.eye(3)).as_matrix()
    for matrix in [*matrices, *half_turns]:
        wxyz = quaternion_of(matrix)
        np.testing.assert_allclose(matrices_of(wxyz), matrix, atol=1e-14)
        assert abs(wxyz @ np.roll(rotation.from_matrix(matrix).as_quat(), 1)) == pytest.approx(1.0, abs=1e-14)


def test_the_hand_eye_is_a_transform_of_pytransform3d(scan: trueline.Recording) -> None:
    transformations = pytest.importorskip("pytransform3d.transformations")
    result = trueline.calibrate(scan)
    transformations.check_transform(result.tool_from_camera)
    wxyz = np.array(result.document["tool_from_camera"]["rotation_wxyz"])
    by_them = transformations.transform_from_pq(np.concatenate([result.tool_from_camera[:3, 3], wxyz]))
    np.testing.assert_allclose(by_them, result.tool_from_camera, atol=1e-12)


def test_rows_of_a_fleet_are_read_by_polars_and_duckdb(scan: trueline.Recording, tmp_path: Path) -> None:
    polars, duckdb = pytest.importorskip("polars"), pytest.importorskip("duckdb")
    from trueline import fleet

    scan.write(tmp_path / "scan")
    fleet.calibrate([tmp_path / "scan"], out=tmp_path / "rows")
    parts = str(tmp_path / "rows" / "rows" / "**" / "*.parquet")
    timings = str(tmp_path / "rows" / "timings" / "**" / "*.parquet")
    expected = trueline.calibrate(tmp_path / "scan").time_offset_s
    frame = polars.read_parquet(parts)
    assert frame["time_offset_s"].struct.field("value")[0] == expected
    asked = f"select time_offset_s.value, list_transform(reasons, lambda r: r.code) from read_parquet('{parts}')"
    assert duckdb.sql(asked).fetchall() == [(expected, [])]
    assert json.loads(frame["result_json"][0])["schema_version"] == 3
    joined = f"select r.url, t.duration_s > 0 from '{parts}' r join '{timings}' t using (content_hash)"
    assert duckdb.sql(joined).fetchall() == [(str(tmp_path / "scan"), True)]


def test_a_result_goes_into_a_frame_of_pandas_and_polars(scan: trueline.Recording) -> None:
    import pandas
    import polars

    result = trueline.calibrate(scan)
    numbers = {name: column for name, column in vars(result.residuals).items() if column.ndim == 1}
    for frame in (pandas.DataFrame(numbers), polars.DataFrame(numbers)):
        assert len(frame) == len(result.residuals.row)
        np.testing.assert_array_equal(np.asarray(frame["normalised"]), result.residuals.normalised)
    sigma_s = result.sigma.time_offset_s
    assert sigma_s is not None
    covariance = pandas.DataFrame(result.covariance.matrix, result.covariance.names, result.covariance.names)
    assert covariance.loc["time_offset_s", "time_offset_s"] == pytest.approx(sigma_s**2, rel=1e-12)


def test_poses_of_scipy_and_of_pytransform3d_go_in(scan: trueline.Recording) -> None:
    transform = pytest.importorskip("scipy.spatial.transform")
    trajectories = pytest.importorskip("pytransform3d.trajectories")
    poses = scan.base_from_tool
    rigid = transform.RigidTransform.from_matrix(poses)
    by_pq = trajectories.transforms_from_pqs(trajectories.pqs_from_transforms(poses))
    for form in (rigid, by_pq):
        again = trueline.Recording.from_arrays(
            scan.robot_times_s, form, scan.feature_times_s, scan.points, sensor=scan.sensor
        )
        np.testing.assert_allclose(again.base_from_tool, poses, atol=1e-14)


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scan with pictures, and the seam that was found in them."""
    folder = tmp_path_factory.mktemp("pictures") / "scan"
    words = ("--preset", "quick", "--images", "--duration-s", "1.5", "--frame-period-ms", "100")
    run("simulate", *words, "--out", str(folder), "--quiet")
    run("features", str(folder), "--quiet")
    return folder


@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
def test_a_bag_that_rosbags_wrote_is_opened(storage: str, pictures: Path, tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    scan = trueline.open(pictures)
    types = get_typestore(Stores.ROS2_HUMBLE)
    with rosbag2.Writer(tmp_path / "bag", version=9, storage_plugin=rosbag2.StoragePlugin[storage]) as writer:
        for ns, message in transforms(types.types, trueline.robot_columns(scan)):
            write(writer, types, "/tf", ns, message)
        for ns, message in images(types.types, pictures):
            write(writer, types, "/camera/image_raw", ns, message)
    shutil.copy(pictures / "sensor.toml", tmp_path / "bag" / "sensor.toml")
    opened = trueline.open(tmp_path / "bag")
    np.testing.assert_allclose(opened.points, scan.points, atol=1e-6)
    np.testing.assert_allclose(opened.base_from_tool, scan.base_from_tool, atol=1e-9)
    by_program = json.loads(run("calibrate", str(tmp_path / "bag"), "--json", "-", "--quiet"))
    by_module = trueline.calibrate(tmp_path / "bag").document
    # See test_same_as_program: of what the search depends on this tells the build as well.
    del by_program["inputs"], by_module["inputs"]
    assert by_module == by_program


def write(writer: Any, types: Any, topic: str, ns: int, message: Any) -> None:
    name = message.__msgtype__
    connection = next((c for c in writer.connections if c.topic == topic), None)
    connection = connection or writer.add_connection(topic, name, typestore=types)
    writer.write(connection, ns, types.serialize_cdr(message, name))


def header(make: Any, ns: int, frame: str) -> Any:
    stamp = make["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
    return make["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def transforms(make: Any, columns: Any) -> Iterator[tuple[int, Any]]:
    for row in range(len(columns["time_s"])):
        ns = int(round(columns["time_s"][row] * 1e9))
        xyz = [columns[name][row] * 1e-3 for name in ("x_mm", "y_mm", "z_mm")]
        quaternion = [columns[name][row] for name in ("qx", "qy", "qz", "qw")]
        transform = make["geometry_msgs/msg/Transform"](
            translation=make["geometry_msgs/msg/Vector3"](*xyz),
            rotation=make["geometry_msgs/msg/Quaternion"](*quaternion),
        )
        stamped = make["geometry_msgs/msg/TransformStamped"](
            header=header(make, ns, "base"), child_frame_id="tool0", transform=transform
        )
        yield ns, make["tf2_msgs/msg/TFMessage"](transforms=[stamped])


def images(make: Any, folder: Path) -> Iterator[tuple[int, Any]]:
    rows = (folder / "images" / "index.csv").read_text().splitlines()
    for row in rows[1:]:
        entry = dict(zip(rows[0].split(","), row.split(","), strict=True))
        ns = int(round(float(entry["time_s"]) * 1e9))
        pixels = np.rint(imread(folder / "images" / entry["file"]) * 255).astype(np.uint8)
        height, width = pixels.shape
        yield ns, make["sensor_msgs/msg/Image"](
            header=header(make, ns, "camera"),
            height=height,
            width=width,
            encoding="mono8",
            is_bigendian=0,
            step=width,
            data=pixels.ravel(),
        )
