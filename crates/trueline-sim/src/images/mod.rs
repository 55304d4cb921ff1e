//! Pictures of a scan: rays are cast from every pixel near the stripe onto the plates of a joint.
//!
//! The chain is that of the light: [`joint`] (plates as facets of a [`cross_section`]), [`light`] (what a ray
//! from the camera meets and how the laser lights it, directly and by mirrors), blur and motion
//! ([`renderer`]), [`speckle`], [`clutter`] (spatter, glow), [`exposure`] (noise, saturation, bits). [`look`]
//! says how much of each.

pub mod clutter;
pub mod cross_section;
mod dataset;
pub mod exposure;
pub mod joint;
pub mod light;
pub mod look;
pub mod patch;
pub mod renderer;
pub mod scan;
pub mod speckle;

pub use dataset::{WrittenPictures, write_pictures};
pub use joint::Joint;
pub use look::Look;
pub use renderer::{Picture, Renderer, Studio};
pub use scan::PictureScan;
