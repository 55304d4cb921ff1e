"""Poses in the forms that people have."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import floats

Poses: TypeAlias = Any
"""A stack (N, 4, 4) in metres; a pair of positions (N, 3) in metres and a scipy ``Rotation``; or whatever has
``as_matrix()`` that gives such a stack, as scipy's ``RigidTransform``."""


def matrices(poses: Poses) -> NDArray[np.float64]:
    """The poses as a stack (N, 4, 4).

    >>> matrices((np.zeros((2, 3)), np.stack([np.eye(3)] * 2))).shape
    (2, 4, 4)
    """
    if isinstance(poses, (tuple, list)) and len(poses) == 2 and any(hasattr(part, "as_matrix") for part in poses):
        if hasattr(poses[0], "as_matrix"):
            raise ValueError("poses: positions come first, then the rotations")
        return _joined(*poses)
    if isinstance(poses, tuple) and len(poses) == 2:
        return _joined(*poses)
    matrices = _matrix(poses)
    if np.ndim(matrices) != 3 or np.shape(matrices)[1:] != (4, 4):
        raise ValueError(f"poses: expected a stack (N, 4, 4) or a pair (positions, rotations), found {np.shape(matrices)}")
    return floats("poses", matrices, "N", "4", "4")


def _joined(positions: ArrayLike, rotations: Any) -> NDArray[np.float64]:
    places = floats("positions", positions, "N", "3")
    turns = floats("rotations", _matrix(rotations), "N", "3", "3")
    if places.shape[1] != 3 or turns.shape != (len(places), 3, 3):
        raise ValueError(
            f"poses: expected positions (N, 3) and as many rotations, found {places.shape} and {turns.shape}"
        )
    stack = np.zeros((len(places), 4, 4))
    stack[:, :3, :3] = turns
    stack[:, :3, 3] = places
    stack[:, 3, 3] = 1.0
    return stack


def _matrix(rotations: Any) -> Any:
    return rotations.as_matrix() if hasattr(rotations, "as_matrix") else rotations
