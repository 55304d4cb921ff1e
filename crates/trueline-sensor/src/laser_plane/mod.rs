//! The laser plane from stripes on boards, or on a plain plate before a robot.

pub mod ground;
pub mod joint;
pub mod next_board;
pub mod plate;
pub mod points;
pub mod stripe;
pub mod striped_picture;

pub use ground::Ground;
pub use joint::{JointFit, KnownCamera, StripedView, fit_joint};
pub use points::{BoardResidual, DOUBTFUL, FEWEST_BOARDS, PlaneFit, fit_points, jackknife};
