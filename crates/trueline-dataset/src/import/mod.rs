//! Foreign recordings, one format a file.

pub mod axis_columns;
pub mod clock;
pub mod csv_folder;
pub mod foreign_csv;
pub mod lvs_st_calib;
mod makers;
#[cfg(feature = "foreign-tables")]
mod mat_file;
#[cfg(feature = "foreign-tables")]
pub mod matlab;
mod pose_cells;
pub mod profiles;
mod reach;
pub mod robot_layout;
pub mod rows;
#[cfg(feature = "foreign-tables")]
mod rsi_xml;
pub mod stop_tables;
pub mod table_text;
pub mod tables_of_programs;
pub mod tum;
#[cfg(feature = "foreign-tables")]
pub mod workbook;
#[cfg(feature = "foreign-tables")]
mod workbook_extent;
