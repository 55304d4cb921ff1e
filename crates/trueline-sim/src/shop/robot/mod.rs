//! The robot: its log, and its true pose. One error a file.

mod arm_geometry;
mod command_lag;
mod gear_ripple;
mod hysteresis;
mod moving_mean;
mod polled_log;
mod quantised_poses;
mod sag;
mod shop_robot;
mod warm_up;

pub(crate) use shop_robot::ShopRobot;
