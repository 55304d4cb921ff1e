//! A log that is read more often than the controller renews the pose.

/// When the pose that is read at a time was renewed, s.
pub(crate) fn renewed_s(time_s: f64, every_s: f64) -> f64 {
    (time_s / every_s).floor() * every_s
}
