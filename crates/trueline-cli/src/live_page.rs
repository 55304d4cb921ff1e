//! The live pages that `--serve` asks for.

use crate::args::ServeArgs;
use crate::failure::Failure;

#[cfg(feature = "serve")]
pub(crate) use with_server::{CellPage, WatchPage};

#[cfg(feature = "serve")]
mod with_server {
    use super::{Failure, ServeArgs};
    use crate::output;
    use crate::serve::{CellSite, Limits, LiveServer, ServeError, Site, WatchSite};
    use std::path::PathBuf;
    use std::sync::Arc;
    use trueline_cell::{Cell, CellState, RobotBrief};

    impl From<ServeError> for Failure {
        fn from(error: ServeError) -> Self {
            Self::new(error.to_string(), error.hint())
        }
    }

    /// Serves a site on request, and prints its address.
    fn serve(args: &ServeArgs, site: Arc<dyn Site>) -> Result<Option<LiveServer>, Failure> {
        let Some(address) = args.serve else { return Ok(None) };
        let server = LiveServer::start(address, &args.serve_name, Limits::default(), site)?;
        let who = if address.ip().is_loopback() {
            "this PC alone"
        } else {
            "everybody who reaches this address may read it"
        };
        output::words(&format!("live page: http://{}/ ({who})", server.address()));
        Ok(Some(server))
    }

    /// The page of productions, as long as it lives.
    pub(crate) struct WatchPage {
        _server: Option<LiveServer>,
    }

    impl WatchPage {
        /// Of the cells with these states.
        pub(crate) fn of(args: &ServeArgs, states: Vec<PathBuf>) -> Result<Self, Failure> {
            Ok(Self { _server: serve(args, Arc::new(WatchSite::of(states)))? })
        }
    }

    /// The page of a recording, as long as it lives.
    pub(crate) struct CellPage {
        site: Arc<CellSite>,
        _server: Option<LiveServer>,
    }

    impl CellPage {
        /// Of a cell that is about to be recorded.
        pub(crate) fn of(args: &ServeArgs, title: &str, cell: &Cell) -> Result<Self, Failure> {
            let site = Arc::new(CellSite::new(title.to_owned(), cell.picture()));
            let shared: Arc<dyn Site> = Arc::<CellSite>::clone(&site);
            Ok(Self { _server: serve(args, shared)?, site })
        }

        /// Shows how things are.
        pub(crate) fn show(&self, robot: &str, brief: RobotBrief, state: &CellState) {
            self.site.show(robot.to_owned(), brief, state);
        }
    }
}

#[cfg(not(feature = "serve"))]
pub(crate) use without_server::{CellPage, WatchPage};

/// This program has no web server: requests for one are refused.
#[cfg(not(feature = "serve"))]
mod without_server {
    use super::{Failure, ServeArgs};
    use std::path::PathBuf;
    use trueline_cell::{Cell, CellState, RobotBrief};

    fn refuse(args: &ServeArgs) -> Result<(), Failure> {
        match args.serve {
            Some(_) => Err(Failure::new(
                "--serve: this program was built without its web server",
                crate::args::left_out::how_to_build(),
            )),
            None => Ok(()),
        }
    }

    /// Nothing.
    pub(crate) struct WatchPage;

    impl WatchPage {
        /// Refuses to serve.
        pub(crate) fn of(args: &ServeArgs, _: Vec<PathBuf>) -> Result<Self, Failure> {
            refuse(args).map(|()| Self)
        }
    }

    /// Nothing.
    pub(crate) struct CellPage;

    impl CellPage {
        /// Refuses to serve.
        pub(crate) fn of(args: &ServeArgs, _: &str, _: &Cell) -> Result<Self, Failure> {
            refuse(args).map(|()| Self)
        }

        /// Shows nothing.
        pub(crate) fn show(&self, _: &str, _: RobotBrief, _: &CellState) {}
    }
}
