"""Rotations and rigid transforms as stacks of matrices. Lengths in mm, angles in rad."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]

SMALL_ANGLE_RAD = 1e-8
"""Below this angle the second-order series is exact to rounding."""


def skew(v: Floats) -> Floats:
    """Matrix of the cross product, ``skew(a) @ b == a × b``; stacks (…, 3) give stacks (…, 3, 3)."""
    v = np.asarray(v, float)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def exp(rotvec: Floats) -> Floats:
    """Rotation matrix of a rotation vector in rad.

    >>> exp(np.array([0.0, 0.0, np.pi / 2])).round(6)[0, 1]
    np.float64(-1.0)
    """
    rotvec = np.asarray(rotvec, float)
    angle = np.linalg.norm(rotvec, axis=-1)[..., None, None]
    safe = np.where(angle < SMALL_ANGLE_RAD, 1.0, angle)
    k = skew(rotvec)
    first = np.where(angle < SMALL_ANGLE_RAD, 1.0, np.sin(safe) / safe)
    second = np.where(angle < SMALL_ANGLE_RAD, 0.5, (1 - np.cos(safe)) / safe**2)
    return np.asarray(np.eye(3) + first * k + second * (k @ k), float)


def log(rotation: Floats) -> Floats:
    """Rotation vector in rad of a rotation matrix."""
    q = quaternion(rotation)
    q = np.where(q[..., :1] < 0, -q, q)
    norm = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(norm, q[..., :1])
    return np.asarray(np.where(norm < SMALL_ANGLE_RAD, 2.0, angle / np.where(norm == 0, 1, norm)) * q[..., 1:], float)


def quaternion(rotation: Floats) -> Floats:
    """Unit quaternion w, x, y, z (w ≥ 0) of a rotation matrix."""
    m = np.asarray(rotation, float)
    trace = np.trace(m, axis1=-2, axis2=-1)
    diagonal = np.diagonal(m, axis1=-2, axis2=-1)
    # The largest of the four squared components is divided by, which never is below 1/4.
    squares = np.concatenate([trace[..., None], diagonal], -1)
    which = np.argmax(squares, -1)
    rows = np.empty((*m.shape[:-2], 4, 4))
    rows[..., 0, 0] = 1 + trace
    for axis in range(3):
        rows[..., axis + 1, axis + 1] = 1 + 2 * diagonal[..., axis] - trace
    for axis, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        rows[..., 0, axis + 1] = rows[..., axis + 1, 0] = m[..., k, j] - m[..., j, k]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        rows[..., i + 1, j + 1] = rows[..., j + 1, i + 1] = m[..., i, j] + m[..., j, i]
    q = np.take_along_axis(rows, which[..., None, None], -2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., :1] < 0, -q, q), float)


def matrix(quaternion_wxyz: Floats) -> Floats:
    """Rotation matrix of a quaternion w, x, y, z, which is normalised first."""
    q = np.asarray(quaternion_wxyz, float)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    k = skew(q[..., 1:])
    return np.asarray(np.eye(3) + 2 * q[..., :1, None] * k + 2 * (k @ k), float)


def nearest_rotation(m: Floats) -> Floats:
    """Rotation nearest to a 3×3 matrix in the Frobenius norm."""
    u, _, vt = np.linalg.svd(m)
    return np.asarray(u @ np.diag([1.0, 1.0, float(np.linalg.det(u @ vt))]) @ vt, float)


def apply(rotations: Floats, points: Floats) -> Floats:
    """Row-wise ``rotations[i] @ points[i]``."""
    return np.asarray(np.einsum("...ij,...j->...i", rotations, points), float)


def rigid_fit(source: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Rotation R and translation t (mm) that minimise ``|R source + t − target|²`` (Kabsch)."""
    centre_s, centre_t = source.mean(0), target.mean(0)
    R = nearest_rotation((target - centre_t).T @ (source - centre_s))
    return R, centre_t - R @ centre_s


class PoseStream:
    """Recorded poses with linear interpolation of position and constant body rate of rotation between two rows."""

    def __init__(self, times_s: Floats, rotations: Floats, positions_mm: Floats) -> None:
        """Keep the rows; rows that repeat the stamp of the row before are left out."""
        keep = np.concatenate([[True], np.diff(times_s) > 0])
        self.times_s, self.rotations, self.positions_mm = times_s[keep], rotations[keep], positions_mm[keep]
        self._steps = log(np.swapaxes(self.rotations[:-1], -1, -2) @ self.rotations[1:])

    def inside(self, times_s: Floats) -> NDArray[np.bool_]:
        """Times within the recording."""
        return np.asarray((times_s >= self.times_s[0]) & (times_s <= self.times_s[-1]), bool)

    def at(self, times_s: Floats) -> tuple[Floats, Floats]:
        """Rotations and positions at times; outside the recording the first or last two rows are extrapolated."""
        j = np.clip(np.searchsorted(self.times_s, times_s, side="right") - 1, 0, len(self.times_s) - 2)
        share = ((times_s - self.times_s[j]) / (self.times_s[j + 1] - self.times_s[j]))[:, None]
        rotations = self.rotations[j] @ exp(self._steps[j] * share)
        return rotations, self.positions_mm[j] + share * (self.positions_mm[j + 1] - self.positions_mm[j])
