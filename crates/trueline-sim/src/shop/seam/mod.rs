//! The form of the seam, and what of it a detector sees. One error a file.

mod bow;
mod heat_bend;
mod rounded_edge;
mod seam_form;
mod tacks;
mod waviness;

pub(crate) use rounded_edge::RoundedEdge;
pub(crate) use seam_form::SeamForm;
