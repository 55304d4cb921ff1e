"""Poses of a chessboard in pictures, by OpenCV. Only the real track needs it: `pip install profilebench[pictures]`."""

from pathlib import Path
from typing import Any

import numpy as np

from .files import FileError
from .rotations import Floats, exp
from .sensor import Sensor

MISSING = "pictures need OpenCV: pip install 'profilebench[pictures]'"


def sightings(pictures: list[Path], about: dict[str, Any]) -> tuple[Sensor, dict[str, tuple[Floats, Floats]]]:
    """The camera, and camera_from_board (rotation, mm) by the name of each picture in which the whole board is found.

    The camera is calibrated from all pictures together: one focal length, centre and two radial coefficients.
    """
    try:
        import cv2
    except ImportError:
        raise FileError(MISSING) from None
    columns, rows, square = int(about["columns"]), int(about["rows"]), float(about["square_mm"])
    board = np.array([[x * square, y * square, 0.0] for y in range(rows) for x in range(columns)], np.float32)
    names, seen, size = [], [], (0, 0)
    for picture in pictures:
        image = cv2.imread(str(picture), cv2.IMREAD_GRAYSCALE)
        if image is None:
            raise FileError(f"{picture}: is no picture")
        size = (image.shape[1], image.shape[0])
        # Half the size hides the saturated stripe beside the board well enough.
        half = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        how = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
        found, corners = cv2.findChessboardCorners(half, (columns, rows), flags=how)
        if found:
            names.append(picture.name)
            first = (np.asarray(corners, np.float32).reshape(-1, 1, 2) + 0.5) * 2 - 0.5
            precise = cv2.cornerSubPix(image, first, (9, 9), (-1, -1), (cv2.TERM_CRITERIA_COUNT, 40, 0.0))
            seen.append(_turned(image, np.asarray(precise, np.float32), columns))
    if len(seen) < 4:
        raise FileError(f"{pictures[0].parent}: a board in {len(seen)} picture(s); 4 are needed")
    flags = cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    start = np.array([[2.0 * size[0], 0, size[0] / 2], [0, 2.0 * size[0], size[1] / 2], [0, 0, 1.0]])
    flags |= cv2.CALIB_USE_INTRINSIC_GUESS
    _, K, distortion, turns, places = cv2.calibrateCamera(
        [board] * len(seen), seen, size, start, np.zeros(5), flags=flags
    )
    k1, k2, p1, p2, k3 = (float(v) for v in np.asarray(distortion).reshape(-1)[:5])
    camera = Sensor(
        "camera_laser", fx=float(K[0, 0]), fy=float(K[1, 1]), cx=float(K[0, 2]), cy=float(K[1, 2]), width=size[0],
        height=size[1], distortion=(k1, k2, p1, p2, k3),
    )  # fmt: skip
    return camera, {
        name: (exp(np.asarray(turn, float).reshape(3)), np.asarray(place, float).reshape(3))
        for name, turn, place in zip(names, turns, places, strict=True)
    }


def _turned(image: Any, corners: Any, columns: int) -> Any:
    """The corners in the order whose first square is black: only its colours distinguish the board's two ends."""
    grid = corners.reshape(-1, columns, 2)
    middles = (grid[:-1, :-1] + grid[1:, 1:]) / 2
    grays = np.array([[image[int(round(y)), int(round(x))] for x, y in row] for row in middles], float)
    dark = np.add.outer(np.arange(grays.shape[0]), np.arange(grays.shape[1])) % 2 == 0
    return corners if grays[dark].mean() < grays[~dark].mean() else corners[::-1].copy()
