//! The form of the seam, and its part that a detector finds. One error a file.

mod bow;
mod heat_bend;
mod rounded_edge;
mod seam_form;
mod tacks;
mod waviness;

pub(crate) use rounded_edge::RoundedEdge;
pub(crate) use seam_form::SeamForm;
