//! Pictures of a scan: rays are cast from every pixel near the stripe onto the plates of a joint.
//!
//! The chain follows the light: [`joint`] (plates as facets of a [`cross_section`]), [`light`] (the target of a
//! camera's ray and its illumination by the laser, directly and by mirrors), blur and motion ([`renderer`]),
//! [`speckle`], [`clutter`] (spatter, glow), [`exposure`] (noise, saturation, bits). [`look`] states how much of
//! each.

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
