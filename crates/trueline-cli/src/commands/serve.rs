//! `trueline serve`.

use crate::args::ServeCellArgs;
use crate::failure::Failure;
use crate::serve::{FolderSite, Limits, LiveServer, Prefix};
use crate::{interrupt, output};
use std::net::{Ipv4Addr, SocketAddr};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

/// The default port.
const PORT: u16 = 8080;
/// How often it is asked whether somebody pressed Ctrl-C.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Runs the command.
pub(crate) fn run(args: &ServeCellArgs) -> Result<ExitCode, Failure> {
    if !args.cell.is_dir() {
        return Err(Failure::new(
            format!("there is no folder `{}`", args.cell.display()),
            "name the folder of a cell; an empty one will do for the first scan",
        ));
    }
    let prefix = Prefix::new(&args.prefix).ok_or_else(|| {
        Failure::new(
            format!("`--prefix {}`: expected a path of letters, digits, - and _", args.prefix),
            "for example --prefix /cells/7",
        )
    })?;
    // Command lines on the page work from any folder.
    let folder = args.cell.canonicalize().unwrap_or_else(|_| args.cell.clone());
    let site = Arc::new(FolderSite::of(folder, prefix.text()));
    let address = args.serve.serve.unwrap_or(SocketAddr::from((Ipv4Addr::LOCALHOST, PORT)));
    interrupt::watch()?;
    let server = LiveServer::start_under(&prefix, address, &args.serve.serve_name, Limits::default(), site)?;
    if !args.quiet {
        output::words(&format!("pages: http://{}{}/ (Ctrl-C ends)", server.address(), prefix.text()));
    }
    while interrupt::times() == 0 {
        std::thread::sleep(LOOK_EVERY);
    }
    Ok(ExitCode::SUCCESS)
}
