"""Rotation matrices and unit quaternions w, x, y, z."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def matrices_of(wxyz: ArrayLike) -> NDArray[np.float64]:
    """Rotation matrices (…, 3, 3) of unit quaternions (…, 4).

    >>> matrices_of([1.0, 0.0, 0.0, 0.0])
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    w, x, y, z = np.moveaxis(np.asarray(wxyz, dtype=np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_of(m: NDArray[np.float64]) -> NDArray[np.float64]:
    """The unit quaternion of a rotation matrix, w ≥ 0, by the eigenvector of Bar-Itzhack's matrix: as exact near a half turn
    as elsewhere."""
    k = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [0.0, m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [0.0, 0.0, m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [0.0, 0.0, 0.0, m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    vector: NDArray[np.float64] = np.linalg.eigh(k, UPLO="U")[1][:, -1]
    return vector if vector[0] >= 0.0 else -vector


def small_rotation(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The rotation vector of a rotation of less than half a turn."""
    axis = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]) / 2
    sine = float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, (np.trace(matrix) - 1) / 2))
    return axis if sine < 1e-12 else axis * (angle / sine)
