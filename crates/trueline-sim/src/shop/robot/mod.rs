//! The robot: what it logs, and where it is. One error a file.

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
