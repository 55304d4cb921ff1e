//! Items → a recording that can be calibrated, and its pictures.

mod axes;
pub(crate) mod choice;
mod chosen;
mod collect;
mod common_clock;
pub(crate) mod dataset_folder;
mod frame_stamps;
mod in_order;
pub(crate) mod recorded_pictures;
pub(crate) mod recorded_profiles;
mod stored_picture;
pub(crate) mod to_recording;
mod transform_chain;
