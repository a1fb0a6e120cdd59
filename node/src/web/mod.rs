//! The status page: plain HTTP, read-only, on loopback unless the operator says otherwise.

mod server;
mod snapshot;

pub use server::serve;
pub use snapshot::{JobStatus, NodeStatus, Snapshot};

#[cfg(test)]
mod tests;
