//! The HTTP server: three read-only addresses.

use std::{future::Future, sync::Arc};

use axum::{
    Json, Router,
    extract::State,
    http::{HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
    routing::get,
};
use tokio::{net::TcpListener, sync::watch};

use super::Snapshot;

/// The page allows itself its own script and style and what it fetches from here, and nothing else.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; frame-ancestors 'none'";

/// Serves the status page until `stop` is ready: `/` for people, `/status.json` for programs (the latest [`Snapshot`]), `/healthz` for
/// supervisors (`ok`, or 503 once nobody makes snapshots any more).
///
/// # Errors
/// What the listener says when it fails for good.
pub async fn serve(
    listener: TcpListener,
    snapshots: watch::Receiver<Arc<Snapshot>>,
    stop: impl Future<Output = ()> + Send + 'static,
) -> std::io::Result<()> {
    axum::serve(listener, router(snapshots)).with_graceful_shutdown(stop).await
}

fn router(snapshots: watch::Receiver<Arc<Snapshot>>) -> Router {
    Router::new().route("/", get(page)).route("/status.json", get(status)).route("/healthz", get(health)).with_state(snapshots)
}

async fn page() -> Response {
    let headers = [
        (header::CONTENT_TYPE, HeaderValue::from_static("text/html; charset=utf-8")),
        (header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY)),
        (header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    ];
    (headers, include_str!("page.html")).into_response()
}

async fn status(State(snapshots): State<watch::Receiver<Arc<Snapshot>>>) -> Response {
    let snapshot = snapshots.borrow().clone();
    ([(header::CACHE_CONTROL, HeaderValue::from_static("no-store"))], Json(&*snapshot)).into_response()
}

async fn health(State(snapshots): State<watch::Receiver<Arc<Snapshot>>>) -> Response {
    match snapshots.has_changed() {
        Ok(_) => (StatusCode::OK, "ok\n").into_response(),
        Err(_) => (StatusCode::SERVICE_UNAVAILABLE, "the coordinator makes no snapshots any more\n").into_response(),
    }
}
