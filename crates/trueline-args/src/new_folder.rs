//! Where an import writes.

use clap::Args;
use std::path::PathBuf;

/// The dataset folder that an import writes.
#[derive(Args)]
pub struct NewFolder {
    /// Folder to write
    #[arg(long)]
    pub out: PathBuf,
    /// Replace the folder if trueline wrote it
    #[arg(long)]
    pub force: bool,
}
