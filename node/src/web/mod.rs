//! The status page and the metrics: plain HTTP, read-only, on loopback unless the operator says otherwise.

mod metrics;
mod server;
mod snapshot;
mod wasted;

pub use metrics::Metrics;
pub use server::serve;
pub use snapshot::{JobStatus, NodeStatus, Snapshot};

#[cfg(test)]
mod openmetrics;
#[cfg(test)]
mod tests;
