//! Foreign recordings, one format a file.

pub mod csv_folder;
pub mod foreign_csv;
pub mod lvs_st_calib;
#[cfg(feature = "foreign-tables")]
mod mat_file;
#[cfg(feature = "foreign-tables")]
pub mod matlab;
pub mod profiles;
pub mod robot_layout;
pub mod rows;
pub mod tables_of_programs;
pub mod tum;
#[cfg(feature = "foreign-tables")]
pub mod workbook;
#[cfg(feature = "foreign-tables")]
mod workbook_extent;
