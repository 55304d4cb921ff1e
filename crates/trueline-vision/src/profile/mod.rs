//! Laser profiles: from the points of a stripe in the profiler's own frame to its seam.

mod bow;
mod bowed_face;
mod corner;
mod edge;
mod end_scatter;
mod end_search;
mod face;
mod face_before_seam;
mod face_end;
mod finder;
mod gap;
mod joint;
mod joint_choice;
mod lap;
mod lingering_ends;
mod no_seam;
mod round_face;
mod scan;
mod seen;
mod seen_joint;
mod shape_of_plate;
mod shared_noise;
mod sight;
mod straight_line;
mod stream;
mod view;

pub use face::FaceSupport;
pub use finder::ProfileFinder;
pub use joint::ProfileJoint;
pub use no_seam::{NoSeam, RadiusUm};
pub use scan::{ProfileSeams, seams};
pub use seen_joint::ProfileSeam;
pub use stream::ProfileStream;
