//! Foreign recordings, one format a file.

pub mod csv_folder;
pub mod foreign_csv;
pub mod lvs_st_calib;
pub mod profiles;
pub mod robot_layout;
pub mod rows;
pub mod tum;
