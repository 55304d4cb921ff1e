//! Options of `trueline simulate` for a scan of one seam along a path of its own: other scans refuse them.

pub(crate) const SEAM_SCAN_OPTIONS: [&str; 16] = [
    "PathArgs",
    "preset",
    "plan",
    "random_cell",
    "noise_free",
    "duration_s",
    "robot_period_ms",
    "frame_period_ms",
    "feature_noise_px",
    "feature_noise_mm",
    "robot_noise_mm",
    "stamp_jitter_ms",
    "clock_drift_ppm",
    "outliers",
    "drops",
    "faults",
];
