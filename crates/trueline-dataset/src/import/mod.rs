//! Foreign recordings, one format a file.

pub mod csv_columns;
pub mod lvs_st_calib;
pub mod rows;
pub mod tum;
