//! The server: one thread that waits for requests, a few that answer them.
//!
//! Read-only: GET and HEAD of known paths; a body is never read. A client that sends nothing, or reads nothing, is cut off.
//! A connection carries one request, so that no client holds one. A site may fail or panic, and the next request is
//! answered.

use super::guard::HostNames;
use super::headers::forbid;
use super::prefix::Prefix;
use super::reply::{Reply, Site};
use super::serve_error::ServeError;
use axum::Router;
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::BTreeSet;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::sync::{Semaphore, oneshot};

/// Resources of clients.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Connections at a time; more wait.
    pub connections: usize,
    /// Until the head of a request has come.
    pub head: Duration,
    /// Until the whole reply has gone.
    pub whole: Duration,
    /// Bytes of the head of a request.
    pub head_bytes: usize,
}

impl Default for Limits {
    fn default() -> Self {
        let (head, whole) = (Duration::from_secs(3), Duration::from_secs(10));
        Self { connections: 64, head, whole, head_bytes: 16 << 10 }
    }
}

/// Threads that answer.
const ANSWERERS: usize = 4;
/// How long the end of a program waits for replies that are under way.
const AT_END: Duration = Duration::from_millis(500);
/// After a connection that could not be accepted: too many open files, mostly.
const AFTER_FAILURE: Duration = Duration::from_millis(100);

/// A server that runs until it is dropped.
#[derive(Debug)]
pub struct LiveServer {
    address: SocketAddr,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl LiveServer {
    /// Serves a site at an address of this PC; `names` are its allowed names besides literal addresses and `localhost`.
    ///
    /// # Errors
    /// An unusable address, or an invalid name.
    pub fn start(
        address: SocketAddr,
        names: &[String],
        limits: Limits,
        site: Arc<dyn Site>,
    ) -> Result<Self, ServeError> {
        Self::start_under(&Prefix::default(), address, names, limits, site)
    }

    /// The same behind a proxy that shows the site under a prefix, whether it takes the prefix off or leaves it: paths are answered with it
    /// and without it.
    ///
    /// # Errors
    /// As [`LiveServer::start`].
    pub fn start_under(
        prefix: &Prefix,
        address: SocketAddr,
        names: &[String],
        limits: Limits,
        site: Arc<dyn Site>,
    ) -> Result<Self, ServeError> {
        let names = HostNames::new(names).map_err(ServeError::HostName)?;
        let failed = |source| ServeError::Address { address, source };
        let listener = TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .max_blocking_threads(ANSWERERS)
            .build()
            .map_err(ServeError::Start)?;
        let router = router(Arc::new(Served { site, prefix: prefix.clone() }), Arc::new(names));
        let (stop, stopped) = oneshot::channel();
        let serve = move || {
            runtime.block_on(async {
                tokio::select! {
                    () = accept(listener, router, limits) => {}
                    _ = stopped => {}
                }
            });
            runtime.shutdown_timeout(AT_END);
        };
        let thread =
            std::thread::Builder::new().name("serve".to_owned()).spawn(serve).map_err(ServeError::Start)?;
        tracing::info!(%address, "page served");
        Ok(Self { address, stop: Some(stop), thread: Some(thread) })
    }

    /// Its own address.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for LiveServer {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            let _ended_already = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

/// A site, and the prefix that its paths may have.
struct Served {
    site: Arc<dyn Site>,
    prefix: Prefix,
}

fn router(served: Arc<Served>, names: Arc<HostNames>) -> Router {
    let prefix = served.prefix.text();
    // As it is, and as somebody types it: without the slash at its end.
    let typed = served.site.paths().iter().flat_map(|path| [*path, path.trim_end_matches('/')]);
    let all: BTreeSet<String> = typed
        .flat_map(|path| [path.to_owned(), format!("{prefix}{path}")])
        .filter(|path| !path.is_empty())
        .collect();
    let routed = all.iter().fold(Router::new(), |router, path| router.route(path, get(answer)));
    routed.with_state(served).layer(middleware::from_fn_with_state(names, guarded))
}

/// Refuses requests that name another host, and adds the headers of every reply.
async fn guarded(State(names): State<Arc<HostNames>>, request: Request, next: Next) -> Response {
    let mut response = if names.admit(request.headers(), request.uri()) {
        next.run(request).await
    } else {
        let hint =
            "this server answers only to IP addresses, to localhost, and to the names it was started with";
        (StatusCode::MISDIRECTED_REQUEST, hint).into_response()
    };
    forbid(response.headers_mut());
    response
}

async fn answer(State(served): State<Arc<Served>>, request: Request) -> Response {
    let asked = served.prefix.taken_off(request.uri().path());
    let is_known = |path: &str| served.site.paths().contains(&path);
    let path = if is_known(asked) { asked.to_owned() } else { format!("{asked}/") };
    match tokio::task::spawn_blocking(move || served.site.reply(&path)).await {
        Ok(Ok(Reply { media, body })) => {
            ([(header::CONTENT_TYPE, media.content_type())], body).into_response()
        }
        Ok(Err(why)) => (StatusCode::SERVICE_UNAVAILABLE, why).into_response(),
        Err(_panicked) => StatusCode::INTERNAL_SERVER_ERROR.into_response(),
    }
}

async fn accept(listener: TcpListener, router: Router, limits: Limits) {
    let Ok(listener) = tokio::net::TcpListener::from_std(listener) else { return };
    let room = Arc::new(Semaphore::new(limits.connections));
    loop {
        let Ok(place) = Arc::clone(&room).acquire_owned().await else { return };
        let Ok((stream, _)) = listener.accept().await else {
            tokio::time::sleep(AFTER_FAILURE).await;
            continue;
        };
        let router = router.clone();
        tokio::spawn(async move {
            let _place = place;
            let _cut_off = tokio::time::timeout(limits.whole, connection(stream, router, limits)).await;
        });
    }
}

async fn connection(stream: TcpStream, router: Router, limits: Limits) {
    let service = TowerToHyperService::new(router);
    let served = http1::Builder::new()
        .keep_alive(false)
        .timer(TokioTimer::new())
        .header_read_timeout(limits.head)
        .max_buf_size(limits.head_bytes)
        .serve_connection(TokioIo::new(stream), service);
    // A client that disconnects is not an event.
    let _gone = served.await;
}
