//! Scans with a name.

use crate::scenario::{
    Between, Cell, Disturbance, Progress, Scan, Scenario, SensorModel, Sine, Timing, TrackedIn,
};
use nalgebra::{UnitVector3, Vector2, Vector3};
use trueline_geometry::{Line, Plane, Pose, se3, so3};
use trueline_model::{BrownConrady, Camera};

/// A ready-made scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// The paper's scan: 60 s, ±10 mm and ±5° at constant stand-off, 33 Hz camera, 4 ms robot, 17.73 ms.
    Paper,
    /// 20 s, ±15° and ±10 mm stand-off: well excited.
    Quick,
    /// 20 s, 200 mm, ±20 mm, ±25° about three axes and ±25 mm stand-off: a good scan.
    Good,
    /// 20 s with hardly any tilt: everything is determined, but uncertain.
    Weak,
    /// As `Quick`, with a second line beside the first.
    TwoLines,
    /// As `Quick`, with a laser profiler.
    Profiler,
    /// S-path without any rotation: the hand-eye translation cannot be determined.
    ConstantAttitude,
    /// Straight along the line: next to nothing can be seen.
    AlongLine,
}

impl Preset {
    /// All presets.
    pub const ALL: [Self; 8] = [
        Self::Paper,
        Self::Quick,
        Self::Good,
        Self::Weak,
        Self::TwoLines,
        Self::Profiler,
        Self::ConstantAttitude,
        Self::AlongLine,
    ];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Quick => "quick",
            Self::Good => "good",
            Self::Weak => "weak",
            Self::TwoLines => "two-lines",
            Self::Profiler => "profiler",
            Self::ConstantAttitude => "constant-attitude",
            Self::AlongLine => "along-line",
        }
    }

    /// The scenario.
    #[must_use]
    pub fn scenario(self) -> Scenario {
        let quick = quick();
        match self {
            Self::Paper => Scenario {
                // The torch swings about its own tip, which changes the sensor's stand-off a little.
                scan: scan(0.010, 0.0015, 5.0),
                timing: Timing { duration_s: 60.0, ..quick.timing.clone() },
                ..quick
            },
            Self::Quick => quick,
            Self::Good => Scenario { scan: good_scan(), ..quick },
            Self::Weak => Scenario { scan: scan(0.005, 0.001, 2.0), ..quick },
            Self::TwoLines => Scenario { cell: two_lines(quick.cell), ..quick },
            Self::Profiler => Scenario { cell: with_profiler(quick.cell), ..quick },
            Self::ConstantAttitude => Scenario { scan: scan(0.010, 0.010, 0.0), ..quick },
            Self::AlongLine => Scenario { scan: scan(0.0, 0.0, 0.0), ..quick },
        }
    }
}

fn quick() -> Scenario {
    Scenario {
        cell: paper_cell(),
        scan: scan(0.010, 0.010, 15.0),
        timing: Timing {
            duration_s: 20.0,
            robot_period_s: 0.004,
            frame_period_s: 1.0 / 33.0,
            time_offset_s: 0.01773,
            start_ns: 1_000_000_000,
            between: Between::Smooth,
        },
        disturbance: Disturbance {
            feature_noise_px: 0.3,
            feature_noise_m: 0.02e-3,
            robot_position_noise_m: 0.03e-3,
            robot_rotation_noise_rad: 2e-5,
            robot_jitter_s: 0.05e-3,
            frame_jitter_s: 0.10e-3,
            ..Disturbance::default()
        },
    }
}

/// An S-scan with frequencies that have no small common multiple, so that nothing repeats exactly.
fn scan(lateral_m: f64, range_m: f64, tilt_deg: f64) -> Scan {
    let sine = |amplitude, frequency_hz, phase_rad| Sine { amplitude, frequency_hz, phase_rad };
    let tilt = tilt_deg.to_radians();
    Scan {
        length_m: 0.3,
        lateral: sine(lateral_m, 0.47, 0.0),
        range: sine(range_m, 0.31, 1.0),
        // A torch with a work angle and a little travel angle, mounted by eye.
        attitude_rad: [10.0_f64.to_radians(), 12.0_f64.to_radians(), 8.0_f64.to_radians()],
        tilts: [sine(tilt, 0.23, 0.5), sine(tilt, 0.17, 2.0), sine(tilt, 0.13, 4.0)],
        tracked_in: TrackedIn::Sensor,
        progress: Progress::Even,
        passes: 1,
        spin_by_pass_rad: 0.0,
    }
}

/// The same about an attitude square to the seam, with all that the field of view allows.
fn good_scan() -> Scan {
    Scan { length_m: 0.2, attitude_rad: [0.0; 3], ..scan(0.020, 0.025, 25.0) }
}

/// A camera like the paper's (2448 × 2000, 3.45 µm, about 12 mm) with the sheet of its public
/// laser-plane data, on a torch of an upright robot; the line lies on a table in front of it.
fn paper_cell() -> Cell {
    let camera = Camera {
        size: [2448, 2000],
        focal: Vector2::new(3598.0, 3597.0),
        centre: Vector2::new(1211.0, 1007.0),
        distortion: BrownConrady { k1: -0.08, k2: 0.12, p1: 2e-4, p2: -3e-4, k3: 0.0 },
    };
    Cell {
        sensor: SensorModel::CameraLaser { camera, laser_plane_in_camera: paper_plane() },
        tool_from_camera: mounting(),
        lines: vec![Line::new(
            Vector3::new(1.150, 0.080, 0.120),
            &UnitVector3::new_normalize(Vector3::new(0.98, 0.17, 0.01)),
        )],
        curve: None,
        approach: -Vector3::z_axis(),
    }
}

/// z = 0.036 x + 2.12 y + 130.7 mm: rounded from the fit of the authors' public data.
fn paper_plane() -> Plane {
    Plane::from_height(0.036, 2.12, 0.1307).unwrap_or_else(|| unreachable!("the coefficients are finite"))
}

fn mounting() -> Pose {
    let rotation = so3::exp(&Vector3::new(0.0, 0.0, 1.45)) * so3::exp(&Vector3::new(0.45, 0.05, 0.0));
    se3::from_parts(rotation, Vector3::new(0.062, -0.018, 0.145))
}

fn two_lines(cell: Cell) -> Cell {
    let first = cell.lines[0];
    let beside = Line::new(
        first.anchor() + Vector3::new(0.0, 0.009, 0.002),
        &UnitVector3::new_normalize(first.direction() + Vector3::new(0.0, 0.01, -0.008)),
    );
    Cell { lines: vec![first, beside], ..cell }
}

fn with_profiler(cell: Cell) -> Cell {
    let sensor = SensorModel::Profiler { half_width_m: 0.040, range_m: [0.080, 0.180] };
    Cell { sensor, ..cell }
}
