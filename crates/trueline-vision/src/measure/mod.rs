//! The stripe along a line, measured: cross-sections, weighed by a template learnt from the picture; a robust
//! regression through them; where the stripe ends.

pub mod cross_section;
mod end_fit;
mod end_light;
pub mod regression;
mod section_view;
pub mod stripe_end;
pub mod stripe_meter;
pub mod template;
pub mod track;
