"""Methods to compare with: own implementations of published ones, and an adapter for the program trueline."""

from collections.abc import Callable
from pathlib import Path

from ..files import Sequence
from ..submission import Answer
from . import board, correlation, line, plane, program, sphere

Method = Callable[[Sequence], Answer]

METHODS: dict[str, Method] = {
    "line-alternating": line.alternating,
    "line-joint": line.joint,
    "correlation-linear": correlation.solve,
    "plane": plane.solve,
    "sphere": sphere.solve,
    "board": board.solve,
    "trueline": program.default,
    "trueline-guess": program.with_guess,
    "trueline-noise-only": program.noise_only,
    "trueline-own-camera": program.no_pictures,
}
"""Methods by name."""
PICTURE_METHODS: dict[str, Callable[[Path], Answer]] = {
    "board": board.from_pictures,
    "trueline": program.board,
    "trueline-own-camera": program.board_own_camera,
}
"""Action of the methods on a folder of pictures; the others do not use one."""
