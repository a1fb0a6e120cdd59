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

use super::{Metrics, Snapshot};

/// The page allows itself its own script and style and what it fetches from here, and nothing else.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; frame-ancestors 'none'";

/// The text format of OpenMetrics.
const METRICS_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// What requests are answered from.
#[derive(Clone)]
struct Served {
    snapshots: watch::Receiver<Arc<Snapshot>>,
    metrics: Arc<Metrics>,
}

/// Serves the status page until `stop` is ready: `/` for people, `/status.json` for programs (the latest [`Snapshot`]), `/metrics` for
/// Prometheus, `/healthz` for supervisors (`ok`, or 503 once nobody makes snapshots any more), `/readyz` for those who would hand in work (`ok`, or 503
/// and why none is taken).
///
/// # Errors
/// What the listener says when it fails for good.
pub async fn serve(
    listener: TcpListener,
    snapshots: watch::Receiver<Arc<Snapshot>>,
    metrics: Arc<Metrics>,
    stop: impl Future<Output = ()> + Send + 'static,
) -> std::io::Result<()> {
    axum::serve(listener, router(Served { snapshots, metrics })).with_graceful_shutdown(stop).await
}

fn router(served: Served) -> Router {
    let router = Router::new().route("/", get(page)).route("/status.json", get(status)).route("/metrics", get(metrics));
    router.route("/healthz", get(health)).route("/readyz", get(readiness)).with_state(served)
}

async fn page() -> Response {
    let headers = [
        (header::CONTENT_TYPE, HeaderValue::from_static("text/html; charset=utf-8")),
        (header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY)),
        (header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    ];
    (headers, include_str!("page.html")).into_response()
}

async fn status(State(served): State<Served>) -> Response {
    let snapshot = served.snapshots.borrow().clone();
    ([(header::CACHE_CONTROL, HeaderValue::from_static("no-store"))], Json(&*snapshot)).into_response()
}

async fn metrics(State(served): State<Served>) -> Response {
    let snapshot = served.snapshots.borrow().clone();
    match served.metrics.text(&snapshot) {
        Ok(text) => ([(header::CONTENT_TYPE, HeaderValue::from_static(METRICS_TYPE))], text).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}

async fn health(State(served): State<Served>) -> Response {
    said(served.is_gone())
}

async fn readiness(State(served): State<Served>) -> Response {
    let refusal = served.snapshots.borrow().refusal.clone();
    said(served.is_gone().or(refusal))
}

impl Served {
    /// Why nothing more will come, if so.
    fn is_gone(&self) -> Option<String> {
        self.snapshots.has_changed().is_err().then(|| "the coordinator makes no snapshots any more".to_owned())
    }
}

fn said(trouble: Option<String>) -> Response {
    match trouble {
        None => (StatusCode::OK, "ok\n").into_response(),
        Some(trouble) => (StatusCode::SERVICE_UNAVAILABLE, format!("{trouble}\n")).into_response(),
    }
}
