//! From images to seam features.
//!
//! A picture becomes one point with a covariance, or a reason why there is none: [`tiles`] that stand out →
//! [`element`]s of a stripe → straight [`pieces`] → the [`stripe`] measured along each → the seam of a joint
//! ([`fillet`], [`lap`], [`v_groove`], [`butt`]). [`detector`] is the recipe. No file, no thread and no joint
//! between frames: each picture is looked at as a whole.

pub mod butt;
pub mod choose;
pub mod corner;
pub mod cut;
pub mod detector;
pub mod edge;
pub mod element;
pub mod face;
mod fastest;
pub mod fillet;
pub mod lap;
pub mod lens;
pub mod line;
pub mod neighbours;
pub mod overlay;
pub mod picture;
pub mod pieces;
pub mod regression;
pub mod seam;
pub mod stripe;
pub mod template;
pub mod tiles;
pub mod track;
pub mod v_groove;
mod view;

pub use detector::Detector;
pub use lens::Lens;
pub use picture::{Level, Picture};
pub use seam::{Joint, NotFound, Seam};
