//! Models of a scan beside the one that was asked for: which are tried, and what each reports.

pub(crate) mod held;
pub(crate) mod lens;
pub mod tried;
