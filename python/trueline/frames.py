"""Data frames: recordings from and to pandas and Polars, in the columns of a dataset folder.

Any table will do that gives a column by its name, and any constructor that takes a dictionary of columns.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .poses import matrices
from .recording import Recording
from .rotations import matrices_of, quaternion_of
from .sensor import Sensor

POSITION = ("x_mm", "y_mm", "z_mm")
QUATERNION = ("qw", "qx", "qy", "qz")
POINTS: tuple[tuple[str, ...], ...] = (("u_px", "v_px"), ("x_mm", "y_mm", "z_mm"), ("x_mm", "z_mm"))
MM_PER_M = 1e3


def from_frames(robot: Any, features: Any, *, sensor: Sensor) -> Recording:
    """A recording from two data frames with the columns of ``robot.csv`` and ``features.csv``.

    Parameters
    ----------
    robot
        ``time_s, x_mm, y_mm, z_mm, qw, qx, qy, qz``.
    features
        ``time_s`` and ``u_px, v_px``, or ``x_mm, z_mm`` of a profiler, or ``x_mm, y_mm, z_mm``; ``line`` may be there.
    sensor
        The sensor.

    Examples
    --------
    >>> import trueline
    >>> scan = trueline.simulate("quick", seed=1)
    >>> again = from_frames(robot_columns(scan), features_columns(scan), sensor=scan.sensor)
    >>> len(again.points) == len(scan.points)
    True
    """
    pose = matrices((_columns(robot, POSITION) / MM_PER_M, _rotations(_columns(robot, QUATERNION))))
    names = next((names for names in POINTS if all(name in _names(features) for name in names)), None)
    if names is None:
        raise ValueError(f"features: expected u_px and v_px, or x_mm and z_mm; found {', '.join(_names(features))}")
    scale = 1.0 if names[0].endswith("_px") else MM_PER_M
    return Recording.from_arrays(
        _column(robot, "time_s"),
        pose,
        _column(features, "time_s"),
        _columns(features, names) / scale,
        sensor=sensor,
        line=_column(features, "line") if "line" in _names(features) else None,
    )


def robot_columns(recording: Recording) -> dict[str, NDArray[np.float64]]:
    """The poses as columns: ``pandas.DataFrame(robot_columns(scan))``, ``polars.DataFrame(robot_columns(scan))``."""
    pose = recording.base_from_tool
    columns = {"time_s": recording.robot_times_s}
    columns |= {name: pose[:, axis, 3] * MM_PER_M for axis, name in enumerate(POSITION)}
    quaternions = np.array([quaternion_of(matrix) for matrix in pose[:, :3, :3]])
    return columns | {name: quaternions[:, k] for k, name in enumerate(QUATERNION)}


def features_columns(recording: Recording) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]:
    """The features as columns."""
    points = recording.points
    if points.shape[1] == 3:
        names, scale = POINTS[1], MM_PER_M
    elif recording.sensor.kind == "profiler":
        names, scale = POINTS[2], MM_PER_M
    else:
        names, scale = POINTS[0], 1.0
    columns: dict[str, NDArray[np.float64] | NDArray[np.int64]] = {"time_s": recording.feature_times_s}
    columns |= {name: points[:, k] * scale for k, name in enumerate(names)}
    return columns | {"line": recording.line}


def _names(frame: Any) -> list[str]:
    return [str(name) for name in (frame.columns if hasattr(frame, "columns") else frame)]


def _column(frame: Any, name: str) -> NDArray[np.float64]:
    if name not in _names(frame):
        raise ValueError(f"expected a column {name}; found {', '.join(_names(frame))}")
    return np.asarray(frame[name], dtype=np.float64)


def _columns(frame: Any, names: tuple[str, ...]) -> NDArray[np.float64]:
    return np.column_stack([_column(frame, name) for name in names])


def _rotations(wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    norm = np.linalg.norm(wxyz, axis=1)
    bad = np.flatnonzero(np.abs(norm - 1.0) > 1e-3)
    if len(bad):
        raise ValueError(f"robot: row {bad[0]}: the quaternion has length {norm[bad[0]]:.4f}, not 1")
    return matrices_of(wxyz / norm[:, None])
