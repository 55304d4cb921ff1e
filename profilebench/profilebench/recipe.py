"""Recipe of one sequence: every size of every error. The defaults are a perfect cell with little
noise."""

from dataclasses import dataclass, field

from .clock import Lateness
from .sensor import Kind


@dataclass(frozen=True)
class Recipe:
    """Sizes of everything that errs in one sequence. Units are in the names."""

    case: str
    sensor: Kind = "profiler"
    motion: str = "planned"
    target: str = "line"
    """line, arc (both scanned while moving), plane or sphere (profiles at stops)."""
    duration_s: float = 15.0
    length_mm: float = 250.0
    feature_hz: float = 40.0
    robot_hz: float = 125.0
    time_offset_s: float = 0.02

    # Noise of the seam points
    noise_px: float = 0.3
    noise_mm: float = 0.02
    student_dof: float = 0.0
    """Degrees of freedom of heavy tails; 0 for Gaussian noise."""
    correlated: float = 0.0
    """Ratio of a slow noise (0.2 s) to the white one."""

    # Clocks
    feature_clock: Lateness = field(default_factory=Lateness)
    robot_clock: Lateness = field(default_factory=Lateness)
    polled_hz: float = 0.0
    """Rate at which the controller renews its pose while the log asks at `robot_hz`; 0 for a new pose each time."""

    # Outliers
    spatter: float = 0.0
    clusters: float = 0.0
    other_edge: float = 0.0
    """Shares of readings: anywhere in the field; reflections at one place for a while; runs on another edge."""

    # Sensor errors: one sigma of what is drawn
    stated: bool = True
    """Whether sensor.toml states the uncertainty of the sensor."""
    intrinsics: float = 0.0
    """1 = 0.08 % of focal length, 1.5 px of principal point, 0.004 of k1."""
    plane: float = 0.0
    """1 = 0.05 mm and 0.05°."""
    shape: float = 0.0
    """1 = scale 0.1 %, shear 0.04°, keystone 0.06 % at 30 mm."""
    linearity_mm: float = 0.0
    bend_mm: float = 0.0
    """Bend of the sheet at 30 mm from its middle."""
    bias_per_rad: float = 0.0
    """Shift of the seam point for a tilt of 1 rad: px for cameras, mm / 0.036 for others."""
    edge_radius_mm: float = 0.0
    exposure_wander_s: float = 0.0
    """Change of the exposure's middle with the tilt (automatic exposure)."""

    # Robot errors
    accuracy_mm: float = 0.0
    state_accuracy: bool = True
    ripple_arcsec: float = 0.0
    hysteresis_arcsec: float = 0.0
    sag_arcsec: float = 0.0
    mean_filter_s: float = 0.0
    """Length of a moving mean over the logged poses."""
    lag_s: float = 0.0
    """First-order lag between the logged (commanded) and the true pose."""
    robot_noise_mm: float = 0.002
    robot_noise_deg: float = 0.0002
    quantised_mm: float = 0.001
    quantised_deg: float = 0.0001

    # Form of the seam
    bow_mm: float = 0.0
    wavy_mm: float = 0.0
    kink_mm: float = 0.0
    tacks_mm: float = 0.0
    radius_mm: float = 600.0
    """Radius of an arc or of a sphere."""

    # Stops (plane and sphere)
    stops: int = 15
    points: int = 80
