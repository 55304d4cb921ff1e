"""Calibrate a laser vision sensor on a robot against one straight line.

One moving scan gives the time offset between camera and robot, the hand-eye transform and the line, each with its
uncertainty. Lengths are in metres, times in seconds and angles in radians wherever a name does not say otherwise.

>>> import trueline
>>> result = trueline.calibrate(trueline.simulate("quick", seed=1))
>>> result.accepted
True
"""

from ._trueline import TruelineError, __version__
from .calibrate import calibrate, calibrate_board
from .doctor import doctor
from .estimates import Cad, Covariance, Curve, Fact, Line, Plane, Residuals, Sigma
from .features import Features, features
from .frames import features_columns, from_frames, robot_columns
from .live import LiveRecording, LiveState, Recorded, RecordOptions, record
from .options import Options
from .placer import Health, Placed, Placer, PlacerSettings
from .program import diff, evaluate, export, export_forms, plan
from .recording import Guess, Recording, join, open, simulate
from .result import Result, load
from .run import run
from .seam_track import SeamTrack, SeamTrackSettings, Target
from .sensor import Camera, CameraLaser, Points, Profiler, Sensor, SensorText
from .stripes import Stripes

__all__ = [
    "Cad",
    "Camera",
    "CameraLaser",
    "Covariance",
    "Curve",
    "Fact",
    "Features",
    "Guess",
    "Health",
    "Line",
    "LiveRecording",
    "LiveState",
    "Options",
    "Placed",
    "Placer",
    "PlacerSettings",
    "Plane",
    "Points",
    "Profiler",
    "RecordOptions",
    "Recorded",
    "Recording",
    "Residuals",
    "Result",
    "SeamTrack",
    "SeamTrackSettings",
    "Sensor",
    "SensorText",
    "Sigma",
    "Stripes",
    "Target",
    "TruelineError",
    "__version__",
    "calibrate",
    "calibrate_board",
    "diff",
    "doctor",
    "evaluate",
    "export",
    "export_forms",
    "features",
    "features_columns",
    "from_frames",
    "join",
    "load",
    "open",
    "plan",
    "record",
    "robot_columns",
    "run",
    "simulate",
]
