//! `trueline simulate --boards`.

use crate::args::SimulateArgs;
use crate::failure::Failure;
use crate::{output, progress};
use std::process::ExitCode;
use trueline_dataset::WholeFolder;
use trueline_sensor::Board;
use trueline_sim::boards::BoardFolder;

/// Runs the command.
pub(crate) fn run(args: &SimulateArgs, board: &Board) -> Result<ExitCode, Failure> {
    let corners = [board.columns, board.rows];
    let mut set = BoardFolder::new(corners, board.square_m, args.boards.board_pictures, args.seed);
    set.scan.time_offset_s = args.time_offset_ms.map_or(set.scan.time_offset_s, |ms| ms * 1e-3);
    let whole = WholeFolder::begin(&args.out, args.force)?;
    let bar = progress::bar(set.pictures(), "pictures", args.quiet);
    let written = set.write(whole.path(), &|| bar.inc(1));
    bar.finish_and_clear();
    written?;
    output::former_folder(&args.out, whole.finish()?);
    if !args.quiet {
        output::words(&set.words(&args.out));
    }
    Ok(ExitCode::SUCCESS)
}
