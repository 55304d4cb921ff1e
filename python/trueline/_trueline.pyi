import os
from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

__version__: str

class TruelineError(ValueError):
    hint: str

class Recording:
    @staticmethod
    def open(path: str | os.PathLike[str]) -> Recording: ...
    @staticmethod
    def from_arrays(
        sensor_toml: str,
        arrays: tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]],
        line: NDArray[np.int64] | None,
        sigma: NDArray[np.float64] | None,
        guess: tuple[float, NDArray[np.float64]] | None,
    ) -> Recording: ...
    @staticmethod
    def simulate(preset: str, seed: int, random_cell: bool) -> Recording: ...
    def calibrate(
        self, options: dict[str, Any], guess: tuple[float, NDArray[np.float64]] | None
    ) -> Calibration: ...
    def evaluate(self, calibration: str | os.PathLike[str]) -> str: ...
    def doctor(self, options: dict[str, Any]) -> str: ...
    def write(self, out: str | os.PathLike[str]) -> None: ...
    def robot_stamps_ns(self) -> NDArray[np.int64]: ...
    def base_from_tool(self) -> NDArray[np.float64]: ...
    def feature_stamps_ns(self) -> NDArray[np.int64]: ...
    def points(self) -> NDArray[np.float64]: ...
    def lines(self) -> NDArray[np.int64]: ...
    def truth(self) -> tuple[float, NDArray[np.float64]] | None: ...
    def sensor_toml(self) -> str: ...
    def notes(self) -> list[str]: ...

class ResidualColumns(TypedDict):
    row: NDArray[np.int64]
    line: NDArray[np.int64]
    time_s: NDArray[np.float64]
    normalised: NDArray[np.float64]
    weight: NDArray[np.float64]
    offset_m: NDArray[np.float64]
    residual_px: NDArray[np.float64]
    point_in_base_m: NDArray[np.float64]

class Calibration:
    def json(self) -> str: ...
    def summary(self) -> str: ...
    def report_html(self) -> str: ...
    def residuals(self) -> ResidualColumns: ...

class SeamColumns(TypedDict):
    joint: str
    stamp_ns: NDArray[np.int64]
    picture: NDArray[np.int64]
    line: NDArray[np.int64]
    pixels: NDArray[np.float64]
    sigma_px: NDArray[np.float64]
    not_found: list[tuple[int, str]]

def main(words: Sequence[str]) -> int: ...
def find_seams(
    sensor_toml: str,
    pictures: NDArray[np.uint8] | NDArray[np.uint16],
    stamps_ns: NDArray[np.int64],
    joint: str | None,
) -> SeamColumns: ...
