//! Pictures of a chessboard, rendered forward: for every pixel the light of the board where its ray meets it.
//!
//! A pixel's light is the mean over points spread in it. Rays come from an inversion of the distortion of their own
//! (a fixed-point iteration), and meet the board in space. What finds boards in pictures shares no line with
//! this.

mod lens;
mod scene;

pub use scene::{BoardScene, Stripe, render};
