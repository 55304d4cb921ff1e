//! The laser plane from stripes on boards, or on a plain plate before a robot.

mod flatness;
pub mod ground;
pub mod joint;
pub mod known_camera;
pub mod next_board;
pub mod pictures;
pub mod plate;
pub mod points;
mod seen_boards;
mod shared_plane;
pub mod striped_picture;
pub mod striped_view;

pub use ground::{Ground, StripeOn};
pub use joint::{JointFit, fit_joint};
pub use known_camera::KnownCamera;
pub use pictures::{PicturesFit, fit_pictures};
pub use points::{BoardResidual, DOUBTFUL, FEWEST_BOARDS, PlaneFit, fit_points, jackknife};
pub use striped_picture::{BoardPicture, NoStripe};
pub use striped_view::StripedView;
