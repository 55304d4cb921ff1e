"""Methods to compare with: own implementations of published ones, and an adapter for the program trueline."""

from collections.abc import Callable

from ..files import Sequence
from ..submission import Answer
from . import correlation, line, plane, program, sphere

Method = Callable[[Sequence], Answer]

METHODS: dict[str, Method] = {
    "line-alternating": line.alternating,
    "line-joint": line.joint,
    "correlation-linear": correlation.solve,
    "plane": plane.solve,
    "sphere": sphere.solve,
    "trueline": program.default,
    "trueline-guess": program.with_guess,
    "trueline-noise-only": program.noise_only,
}
"""Methods by name."""
