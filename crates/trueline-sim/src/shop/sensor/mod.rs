//! The sensor: its properties, the statements of its file, and its exposure times. One error a file.

mod automatic_exposure;
mod bent_sheet;
mod intrinsics;
mod laser_plane;
mod lens_terms;
mod linearity;
mod profile_shape;
mod rolling_shutter;
mod sensor_warming;
mod shop_sensor;

pub(crate) use automatic_exposure::AutomaticExposure;
pub(crate) use sensor_warming::warmed;
pub(crate) use shop_sensor::{Seen, ShopSensor, TrueSeam};
