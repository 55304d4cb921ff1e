//! The laser plane from a plain flat plate: no board, but a robot that moves sensor or plate from stop to stop.
//!
//! ```text
//! p_base = base_from_tool · tool_from_camera · λ r,   λ from  n_plate · p_base = d_plate,   n_laser · λ r = d_laser
//! ```
//!
//! The pose of the plate and that of the camera on the robot are unknown, so they are estimated with the plane: twelve
//! unknowns, and nine of an inexact camera. The robot's motion gives the scale. A stop gives two numbers, however many
//! pixels its stripe has: the stripe is straight, and errors of plate and robot move all of it.
//!
//! At one attitude it does not work, however the tool moves: nearer or farther along a plane of unknown distance looks the same for
//! another distance and another laser plane. The plate must be seen tilted about two axes, near and far.

mod fit;
mod problem;
mod residual;
mod spread;
mod start;
mod state;
mod stop;

pub use fit::{FEWEST_STOPS, PlateFit, StopResidual, fit_plate};
pub use problem::PlateProblem;
pub use state::{CAMERA, HAND_EYE, LASER_PLANE, PLATE, PlateState, SIZE};
pub use stop::{PlateStop, Support};
