"""ProfileBench: an open benchmark for the calibration of laser profilers on robots, in space and time."""

from .files import Sequence, read_sequence
from .submission import Answer
from .submission import write as write_answer

__all__ = ["Answer", "Sequence", "read_sequence", "write_answer"]
__version__ = "0.1.0"
