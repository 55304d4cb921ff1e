//! The scene of a simulated camera, and the wiring of its input.

use trueline_dataset::GrayImage;

/// The camera's scene.
pub trait Pictures: Send {
    /// The picture of the whole sensor of an exposure that has just ended: its start in ns of the steady clock and its
    /// length in s. `None` drops it. A profiler exposes its rows one after the other, and each is a picture of one row.
    fn picture(&mut self, exposure_start_steady_ns: i64, exposure_s: f64) -> Option<GrayImage>;

    /// Called for every exposure, usually before it begins and sometimes more than once: a device wired to the camera's
    /// output.
    fn exposes(&mut self, _start_steady_ns: i64, _exposure_s: f64) {}

    /// The first change of the signal on the input `Line1` after a steady time, ns; `None` if none is known.
    fn edge_after(&mut self, _steady_ns: i64) -> Option<Edge> {
        None
    }

    /// Count of an encoder wired to the camera at a steady time, ns; `None` without one.
    fn encoder(&mut self, _steady_ns: i64) -> Option<i64> {
        None
    }

    /// Whether the signal on the input `Line1` is on at a steady time, ns.
    fn line(&mut self, _steady_ns: i64) -> bool {
        false
    }
}

/// A change of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Steady time, ns.
    pub at_ns: i64,
    /// It switches on.
    pub rises: bool,
}
