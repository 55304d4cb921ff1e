"""Calibrate a laser vision sensor on a robot against one straight line.

One moving scan gives the time offset between camera and robot, the hand-eye transform and the line, each with its
uncertainty. Lengths are in metres, times in seconds and angles in radians wherever a name does not say otherwise.

>>> import trueline
>>> result = trueline.calibrate(trueline.simulate("quick", seed=1))
>>> result.accepted
True
"""

from ._trueline import TruelineError, __version__
from .calibrate import calibrate
from .estimates import Covariance, Fact, Line, Residuals, Sigma
from .features import Seams, find_seams
from .frames import features_columns, from_frames, robot_columns
from .program import diff, export, export_forms, plan
from .recording import Guess, Recording, open, simulate
from .result import Result, load
from .sensor import Camera, CameraLaser, Points, Profiler, Sensor, SensorText

__all__ = [
    "Camera",
    "CameraLaser",
    "Covariance",
    "Fact",
    "Guess",
    "Line",
    "Points",
    "Profiler",
    "Recording",
    "Residuals",
    "Result",
    "Seams",
    "Sensor",
    "SensorText",
    "Sigma",
    "TruelineError",
    "__version__",
    "calibrate",
    "diff",
    "export",
    "export_forms",
    "features_columns",
    "find_seams",
    "from_frames",
    "load",
    "open",
    "plan",
    "robot_columns",
    "simulate",
]
