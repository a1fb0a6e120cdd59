//! How a frame is split into parts and who renders which: pure functions, and the words they share.

pub mod assign;
pub mod evaluate;
pub mod forecast;
pub mod probe;
pub mod split;
mod types;

pub use types::{Assign, CostMap, NodeId, NodePower, Part, PartId, Plan, Probe, Split};
