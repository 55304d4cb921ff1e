//! Destination of an import.

use clap::Args;
use std::path::PathBuf;

/// The dataset folder that an import writes.
#[derive(Args)]
pub(crate) struct NewFolder {
    /// Folder to write
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Replace the folder if it has trueline's files alone; it is kept as OUT.replaced-1
    #[arg(long)]
    pub(crate) force: bool,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}
